"""Simple compensations as they are written: the same rates as the model, the flags of its rows."""

import json

import numpy as np
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro._models import make_law, make_law_and_line, make_polynomial
from skanfis.gyro._simpler import frozen, single_rule
from skanfis.gyro.compose import Polynomial

INPUTS = ("time", "temperature", "output")
KINDS = ("constant", "line", "cubic", "law", "law and line")


@pytest.fixture(scope="module")
def log():
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=0)


def fitted(kind, X, log):
    error = log["output"] - log["rate"]
    if kind == "constant":
        return float(error.mean()), "error"
    if kind.startswith("law"):
        make = make_law if kind == "law" else make_law_and_line
        arguments = (INPUTS, 1, "linear") if kind == "law" else (INPUTS,)
        return make(*arguments).fit(X, log["rate"]), "rate"
    return make_polynomial(1 if kind == "line" else 3).fit(X, error), "error"


@pytest.fixture(scope="module", params=KINDS)
def case(request, log):
    X = log[list(INPUTS)]
    model, predicts = fitted(request.param, X, log)
    return X, model, predicts, frozen(model, single_rule(X, "linear"))


def test_it_gives_what_the_model_gives_and_knows_the_rows(case):
    X, model, _, estimator = case
    expected = model if isinstance(model, float) else model.predict(X)
    np.testing.assert_allclose(estimator.predict(X), expected, rtol=0, atol=1e-12)
    assert estimator.in_bounds(X).all()
    assert estimator.coverage(X).min() == 1.0
    hot = X.assign(temperature=X["temperature"].max() + 60.0)
    assert not estimator.in_bounds(hot).any()
    assert estimator.coverage(hot).max() < 0.1


def test_the_file_of_it_gives_the_same(case, log, tmp_path):
    _, _, predicts, estimator = case
    compensator = GyroCompensator(estimator, INPUTS, predicts=predicts)
    compensator.write_json(tmp_path / "it.json")
    again = GyroCompensator.read_json(tmp_path / "it.json")
    warm = log.assign(temperature=log["temperature"] + 10.0, output=1.2 * log["output"])
    for rows in (log, warm):
        found, expected = again.apply(rows), compensator.apply(rows)
        np.testing.assert_array_equal(found.to_numpy(), expected.to_numpy())


@pytest.mark.parametrize("policy", ["linear", "clip", "nan"])
def test_beyond_the_box_a_polynomial_keeps_its_policy(log, policy):
    X = log[list(INPUTS)]
    model, _ = fitted("cubic", X, log)
    estimator = frozen(model, single_rule(X, policy))
    far = X.assign(output=3.0 * X["output"], temperature=X["temperature"] - 15.0)
    nearest = far.clip(X.min(), X.max(), axis=1)
    found, at_edge = estimator.predict(far), model.predict(nearest)
    outside = (nearest != far).any(axis=1).to_numpy()
    np.testing.assert_allclose(found[~outside], model.predict(far)[~outside], atol=1e-12)
    if policy == "nan":
        assert np.isnan(found[outside]).all()
    else:
        np.testing.assert_allclose(found, at_edge, atol=1e-7)


def test_bounds_of_a_polynomial_hold_and_are_exact_for_one_input(log):
    X = log[list(INPUTS)]
    model, _ = fitted("cubic", X, log)
    estimator = frozen(model, single_rule(X, "linear"))
    box = np.stack([X.min() - 5.0, X.max() + 5.0], axis=1)
    values = estimator.predict(np.random.default_rng(0).uniform(*box.T, (20_000, len(INPUTS))))
    low, high = estimator.base_.bounds(box)
    assert low <= values.min() < values.max() <= high
    # Of z^3 + 2 z^2 on [-1, 2]: exact at the far end.
    low, high = np.array([-20.0]), np.array([70.0])
    third = (high - low) / 3.0
    powers, names = np.arange(4)[:, None], np.array(["temperature"], dtype=object)
    one = Polynomial(low, high, low + third, third, powers, np.array([0.0, 0.0, 2.0, 1.0]), names)
    np.testing.assert_allclose(one.bounds(np.array([[-20.0, 70.0]])), [-16.0, 16.0], atol=1e-9)
    assert one.predict([high])[0] == pytest.approx(16.0)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda d: d["polynomial"].pop("scale"), "must be an object of center, scale"),
        (lambda d: d["polynomial"]["scale"].__setitem__(0, 0.0), r"polynomial.scale\[0\]"),
        (lambda d: d["polynomial"]["coefficients"].append(1.0), "must be a list of 20 number"),
        (lambda d: d["units"].update(output="mph"), "output has no unit 'mph'"),
        (lambda d: d.update(assumed=["x"]), "assumed is .* must be an object of texts"),
    ],
)
def test_a_file_that_was_changed_is_refused(log, tmp_path, spoil, message):
    X = log[list(INPUTS)]
    compensator = GyroCompensator(
        frozen(fitted("cubic", X, log)[0], single_rule(X, "linear")), INPUTS
    )
    compensator.write_json(tmp_path / "it.json")
    document = json.loads((tmp_path / "it.json").read_text())
    spoil(document)
    (tmp_path / "it.json").write_text(json.dumps(document))
    with pytest.raises(ValueError, match=message):
        GyroCompensator.read_json(tmp_path / "it.json")
