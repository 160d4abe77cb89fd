"""Simple compensations as they are written: the same rates as the model, the flags of its rows."""

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro._simpler import kinds, make_law
from skanfis.gyro.c_compensator import export_c_compensator
from skanfis.gyro.compensator import as_written

INPUTS = ("time", "temperature", "output")
CUBIC = make_pipeline(StandardScaler(), PolynomialFeatures(3), LinearRegression())


@pytest.fixture(scope="module")
def log():
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=0)


def fitted(kind, log, policy="linear"):
    """A simple compensation, and what it predicts."""
    X, rate = log[list(INPUTS)], log["rate"].to_numpy()
    every = {name: (predicts, fit) for name, predicts, fit in kinds(INPUTS, policy)}
    predicts, fit = every[kind]
    target = rate if predicts == "rate" else log["output"].to_numpy() - rate
    return fit(X, target), predicts


@pytest.fixture(scope="module", params=[name for name, *_ in kinds(INPUTS, "linear")])
def case(request, log):
    return request.param, *fitted(request.param, log)


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
    X = log[list(INPUTS)]
    estimator, _ = fitted("cubic polynomial", log, policy)
    model = CUBIC.fit(X, log["output"] - log["rate"])
    far = X.assign(output=3.0 * X["output"], temperature=X["temperature"] - 15.0)
    nearest = far.clip(X.min(), X.max(), axis=1)
    found, at_edge = estimator.predict(far), model.predict(nearest)
    outside = (nearest != far).any(axis=1).to_numpy()
    np.testing.assert_allclose(found[~outside], model.predict(far)[~outside], atol=1e-12)
    if policy == "nan":
        assert np.isnan(found[outside]).all()
    else:
        np.testing.assert_allclose(found, at_edge, atol=1e-7)
