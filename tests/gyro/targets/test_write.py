"""What a target is worth on rows held out, by hand; and when there is none."""

import re

import numpy as np
import pytest

from skanfis.gyro.metrics import rms
from skanfis.gyro.targets.autopilots import Cubic
from skanfis.gyro.targets.error_model import ErrorModel
from skanfis.gyro.targets.tables import Table
from skanfis.gyro.targets.write import write_targets

from ..planted import calibrated, log_of

pytestmark = pytest.mark.usefixtures("given_weights", "few_rivals")


def smooth(temperature, rate=0.0):
    return 1e-4 * temperature + 2e-6 * (temperature - 25.0) ** 2


def a_step(temperature, rate):
    return smooth(temperature) + 0.02 * np.tanh((temperature - 25.0) / 3.0)


def at_rest(error, **options):
    log = log_of(error, n_runs=6, n_rows=80)
    log["output"] += 1e-3 * np.random.default_rng(0).normal(size=len(log)) - log["rate"]
    return calibrated(log.assign(rate=0.0), ("temperature",), n_folds=3, **options)


def written(calibration, folder, *texts):
    found = write_targets(calibration, texts, folder)
    return {text.partition(":")[0]: (told, done) for text, told, done in found}


def numbers_of(told):
    """The largest difference, and the errors of target and model."""
    return [float(found) for found in re.findall(r"\b\d[\d.e-]*\d\b", told)]


def test_errors_on_rows_held_out_by_hand_and_files_say_so(tmp_path):
    calibration = at_rest(smooth, terms=(3,))
    told = written(calibration, tmp_path, "table", "px4:x:2:7", "ardupilot:x:2")
    assert all(done for _, done in told.values())
    code = (tmp_path / "gyro_table.c").read_text()
    n_cells = int(re.search(r"gyro_table_values\[(\d+)\]", code)[1]) - 1
    X, rate, after = calibration.X, calibration.rate, calibration.after
    left = {"table": np.empty(len(X)), "px4": np.empty(len(X))}
    lefts = np.empty((len(X), 50))
    for (train, test), model in zip(calibration.split.folds, calibration.fold_models, strict=True):
        error = ErrorModel(calibration.compensator, model, X.iloc[train])
        # Of the definition: the model's own prediction of rows that are new to it.
        inside = test[calibration.inside[test]]
        by_hand = calibration.before[inside] - error(X.iloc[inside].to_numpy())
        np.testing.assert_allclose(by_hand, after[inside], atol=1e-12)
        for name, made in (("table", Table(error, "float", n_cells)), ("px4", Cubic(error, "px4"))):
            off = calibration.before - rate - made.piecewise(X.to_numpy())
            left[name][test] = off[test]
            if name == "px4":
                at = np.linspace(*X.iloc[train].agg(["min", "max"])["temperature"], 50)[:, None]
                lefts[test] = (off[:, None] + made.piecewise(at) - error(at))[test]
    rows = calibration.inside
    for name in ("table", "px4"):
        _, of_target, of_model, *held = numbers_of(told[name][0])
        assert of_target == pytest.approx(rms(left[name][rows]), rel=1e-3)
        assert of_model == pytest.approx(rms((after - rate)[rows]), rel=1e-3)
    # PX4 publishes a correction for every degree.
    whole = ErrorModel(calibration.compensator, calibration.compensator.estimator, X)
    made = Cubic(whole, "px4").piecewise
    at = np.linspace(*made.ends[0], 2001)
    slopes = np.diff(made(at[:, None])) / np.diff(at)
    assert held == [pytest.approx(np.abs(slopes).max(), rel=0.02)]
    # Of the temperatures at boot the worst counts.
    worst = np.sqrt(np.mean(lefts[rows] ** 2, axis=0)).max()
    largest, of_target, _ = numbers_of(told["ardupilot"][0])
    assert of_target == pytest.approx(worst, rel=0.01)
    assert largest > 1.5 * numbers_of(told["px4"][0])[0]
    px4, ardupilot = (tmp_path / name for name in ("px4.params", "ardupilot.parm"))
    header = (tmp_path / "gyro_table.h").read_text().replace("\n * ", " ")
    assert told["table"][0] in header
    assert "subtract y[0] from the raw rate" in header
    assert told["px4"][0] in px4.read_text().replace("\n# ", " ")
    assert "1\t1\tTC_G2_ID\t7\t6\n" in px4.read_text()
    text = ardupilot.read_text()
    assert "T_cal (INS_GYRn_CALTEMP) are measured at boot" in text.replace("\n# ", " ")
    assert "INS_TCAL2_GYR1_X " in text


def test_what_is_much_worse_than_the_model_is_refused_by_name(tmp_path):
    calibration = at_rest(a_step, terms=(5,))
    told = written(calibration, tmp_path, "px4:x", "table")
    assert not told["px4"][1]
    assert "more than 1.5 times as much as the model" in told["px4"][0]
    of_target, limit, of_model = numbers_of(told["px4"][0])
    assert (limit, of_target > 1.5 * of_model) == (1.5, True)
    assert told["table"][1]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gyro_table.c", "gyro_table.h"]


def test_where_there_is_no_rate_outside_a_table_ends_with_the_range(tmp_path):
    calibration = at_rest(smooth, terms=(2,), outside="nan")
    for text in ("table:float", "table:q15", "px4:x"):
        [(told, done)] = written(calibration, tmp_path, text).values()
        assert done, told
