"""Simple compensations as they are written: the same rates as the model, the flags of its rows."""

import numpy as np
import pandas as pd
import pytest
from sklearn.compose import TransformedTargetRegressor
from sklearn.linear_model import BayesianRidge, LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro._simpler import kinds, make_law
from skanfis.gyro.c_compensator import export_c_compensator
from skanfis.gyro.compensator import as_written
from skanfis.gyro.metrics import rms

from .targets.models import polynomial

INPUTS = ("time", "temperature", "output")
CUBIC = TransformedTargetRegressor(
    make_pipeline(StandardScaler(), PolynomialFeatures(3, include_bias=False), BayesianRidge()),
    transformer=StandardScaler(),
)


@pytest.fixture(scope="module")
def log():
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=0)


@pytest.fixture(scope="module", params=kinds(INPUTS, "linear"), ids=lambda kind: kind[0])
def case(request, log):
    """A simple compensation: its name, and what it predicts."""
    name, predicts, fit = request.param
    target = log["rate"] if predicts == "rate" else log["output"] - log["rate"]
    return name, fit(log[list(INPUTS)], target.to_numpy()), predicts


def test_it_gives_what_the_model_gives_and_knows_the_rows(case, log):
    kind, estimator, _ = case
    X, rate, error = log[list(INPUTS)], log["rate"], log["output"] - log["rate"]
    expected = {
        "no compensation": lambda: np.zeros(len(X)),
        "constant": lambda: np.full(len(X), error.mean()),
        "straight line": lambda: LinearRegression().fit(X, error).predict(X),
        "arcsine law": lambda: make_law(INPUTS, 1, "linear").fit(X, rate).predict(X),
        # What is left of the rate is orthogonal to every line.
        "arcsine law and a line": lambda: (
            estimator.predict(X) + LinearRegression().fit(X, rate - estimator.predict(X)).predict(X)
        ),
        "cubic polynomial": lambda: CUBIC.fit(X, error).predict(X),
    }[kind]()
    np.testing.assert_allclose(estimator.predict(X), expected, rtol=0, atol=1e-12)
    assert estimator.in_bounds(X).all()
    assert estimator.coverage(X).min() == 1.0
    hot = X.assign(temperature=X["temperature"].max() + 60.0)
    assert not estimator.in_bounds(hot).any()
    assert estimator.coverage(hot).max() < 0.1


def test_the_file_of_it_gives_the_same(case, log, tmp_path):
    kind, estimator, predicts = case
    compensator = GyroCompensator(estimator, INPUTS, predicts=predicts)
    compensator.write_json(tmp_path / "it.json")
    again = GyroCompensator.read_json(tmp_path / "it.json")
    # The law has no use for the time: neither the file nor the C code asks for it.
    assert again.inputs == (INPUTS[1:] if kind == "arcsine law" else INPUTS)
    assert again.inputs == as_written(compensator).inputs
    header = export_c_compensator(again, tmp_path / "it", std="c99").header
    assert ("time is that since power-on" in header) == ("time" in again.inputs)
    warm = log.assign(temperature=log["temperature"] + 10.0, output=1.2 * log["output"])
    for rows in (log, warm):
        found = again.apply(rows[[*again.inputs]])
        expected = compensator.apply(rows)
        np.testing.assert_array_equal(found.to_numpy(), expected.to_numpy())


@pytest.mark.parametrize("policy", ["linear", "clip", "nan"])
def test_beyond_the_box_a_polynomial_keeps_its_policy(log, policy):
    X, error = log[list(INPUTS)], log["output"] - log["rate"]
    estimator, model = polynomial(X, error, policy), CUBIC.fit(X, error)
    far = X.assign(output=3.0 * X["output"], temperature=X["temperature"] - 15.0)
    nearest = far.clip(X.min(), X.max(), axis=1)
    expected, outside = model.predict(nearest), (nearest != far).any(axis=1)
    expected[outside & (policy == "nan")] = np.nan
    np.testing.assert_allclose(estimator.predict(far), expected, atol=1e-7)
    np.testing.assert_allclose(estimator.predict(X), model.predict(X), atol=1e-12)


def test_a_cubic_stays_sane_between_inputs_that_the_log_ties_together():
    """A sine of temperature draws an ellipse, on which terms cancel; a slower one goes within."""
    rng, phase = np.random.default_rng(0), np.linspace(0.0, 6.0 * np.pi, 3_000)

    def cycle(thermal_rate):
        temperature = 20.0 + 40.0 * np.sin(phase) + 0.001 * rng.normal(size=phase.size)
        X = {"temperature": temperature, "temperature_rate": thermal_rate * np.cos(phase)}
        u = (temperature - 20.0) / 40.0
        return pd.DataFrame(X), u - 0.5 * u**2 + 0.4 * u**3 + 30.0 * X["temperature_rate"]

    (fast, drift), (slow, slow_drift) = cycle(0.02), cycle(0.012)
    fits = {name: fit for name, _, fit in kinds(list(fast), "linear")}
    cubic = fits["cubic polynomial"](fast, drift + 0.3 * rng.normal(size=phase.size))
    assert rms(cubic.predict(fast) - drift) < 0.05
    assert rms(cubic.predict(slow) - slow_drift) < 0.5 * rms(slow_drift)
