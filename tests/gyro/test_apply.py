"""``--apply`` to logs that lack rows or values: time since power-on, and every row's rate."""

import pandas as pd
import pytest
from numpy.testing import assert_allclose

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro.compensator import features

from ..quick import quick

INPUTS = ("time", "temperature", "temperature_rate", "output")
COLUMNS = ["time", "temperature", "output", "rate"]


@pytest.fixture(scope="module")
def log():
    """Two devices of two runs, on clocks that begin anew with each."""
    return make_ofog(n_devices=2, n_runs=2, duration=600.0, sampling_interval=2.0, random_state=0)


@pytest.fixture(scope="module")
def model(log, tmp_path_factory):
    runs = log["device"].astype(str) + log["run"].astype(str)
    X = features(log.assign(run=runs), INPUTS, time_constant=60.0)
    error = log["output"] - log["rate"]
    estimator = quick([2, 2, 2, 1]).fit(X, error)
    path = tmp_path_factory.mktemp("model") / "compensator.json"
    GyroCompensator(estimator, INPUTS).write_json(path)
    return path


def cold_starts(log, gap):
    """Runs of one device on clocks from power-on, the second without its first rows, or values."""
    table = log[log["device"] == log["device"].iloc[0]][[*COLUMNS, "run"]].reset_index(drop=True)
    early = (table["run"] == table["run"].iloc[-1]) & (table["time"] < 100.0)
    if gap == "rows":
        return table[~early]
    return table.assign(output=table["output"].mask(early))


@pytest.mark.parametrize("gap", ["rows", "values"])
def test_time_counts_from_power_on_and_not_from_the_first_row_that_is_left(
    log, model, gap, tmp_path, say
):
    whole = cold_starts(log, "values")
    cold_starts(log, gap).to_csv(tmp_path / "log.csv", index=False)
    out = tmp_path / "out.csv"
    code, told, _ = say("--apply", model, tmp_path / "log.csv", "--output", out, "--quiet")
    assert code == 0
    assert ("begins up to 100 s after power-on" in told) == (gap == "rows")
    kept = whole.dropna()
    expected = GyroCompensator.read_json(model).apply(whole.ffill().bfill()).loc[kept.index]
    late = kept["run"].to_numpy() == kept["run"].iloc[-1]
    settled = ~late | (kept["time"].to_numpy() > 500.0)
    found = pd.read_csv(out)
    assert len(found) == len(kept)
    assert_allclose(
        found["rate_compensated"][settled], expected["rate_compensated"][settled], rtol=1e-3
    )


def test_rows_without_the_true_rate_are_compensated(log, model, tmp_path, say):
    table = log[log["device"] == log["device"].iloc[0]][[*COLUMNS, "run"]].reset_index(drop=True)
    answers = []
    for name, known in (
        ("all", table),
        ("few", table.assign(rate=table["rate"].mask(table.index < 99))),
    ):
        path, out = tmp_path / f"{name}.csv", tmp_path / f"{name}-out.csv"
        known.to_csv(path, index=False)
        assert say("--apply", model, path, "--output", out, "--quiet")[0] == 0
        answers.append(pd.read_csv(out))
    pd.testing.assert_frame_equal(*answers)
