"""Data and weights near the ends of the range of floats: the model that there is, or the reason."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.learning import VariableProjection

X = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2)) * [10.0, 1.0] + [100.0, 0.0]
Y = np.sin(3.0 * X[:, 1]) + 0.1 * X[:, 0]
SHORT = {"n_mfs": 2, "solver": VariableProjection(tol=0.1)}


@cache
def plain_predictions():
    """And their deviations."""
    return ANFISRegressor(**SHORT).fit(X, Y).predict(X, return_std=True)


@pytest.mark.parametrize("weight", [5e-324, 1e-310, 1e-300, 1e300, 1e308])
def test_weights_that_are_all_alike_are_none(weight):
    weighted = ANFISRegressor(**SHORT).fit(X, Y, np.full(len(Y), weight))
    assert_allclose(weighted.predict(X), plain_predictions()[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("x_scale", "y_scale", "message"),
    [
        (1e-101, 1.0, r"Column 'x0' of X has a .* of only 5\.\d+e-101; .* smaller unit"),
        (5e-324, 1.0, "Column 'x0' of X has a .* only .*e-323"),
        (1e99, 1.0, r"Column 'x0' of X holds numbers up to .*e\+101, .* larger unit"),
        (1.0, 1e307, r"Column 'y' of y holds numbers up to .*e\+308"),
        (1.0, 1e-308, "Column 'y' of y has a .* only .*e-309"),
    ],
)
@pytest.mark.parametrize("settings", [{}, {"n_mfs": 2}, {"n_mfs": 2, "solver": "hybrid"}])
def test_what_floats_do_not_hold_is_refused(x_scale, y_scale, message, settings):
    with pytest.raises(ValueError, match=message):
        ANFISRegressor(**settings).fit(X * x_scale, Y * y_scale)


@pytest.mark.theory
@pytest.mark.parametrize("x_scale", [1e-97, 1e97])
@pytest.mark.parametrize("y_scale", [1e-97, 1e97])
def test_what_floats_hold_is_learnt(x_scale, y_scale):
    model = ANFISRegressor(**SHORT).fit(X * x_scale, Y * y_scale)
    found, deviation = model.predict(X * x_scale, return_std=True)
    expected, of_plain = plain_predictions()
    assert_allclose(found / y_scale, expected, rtol=0, atol=1e-6 * np.ptp(Y))
    assert_allclose(deviation / y_scale, of_plain, rtol=1e-5)


@pytest.mark.theory
@pytest.mark.parametrize(
    ("value", "settings"),
    [
        (1e8, {"n_mfs": 2}),
        (1e12, {"n_mfs": 3, "order": 0}),
        (1e17, {"max_rules": 3}),
        (1e7, {"n_mfs": 2, "solver": VariableProjection(stiffness=0.0)}),
    ],
)
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.UnderdeterminedWarning")
def test_deviations_beside_a_value_that_is_a_mistake(value, settings, rng):
    # A rule is that row's own: what its terms may do is a difference of squares of 1e25 and more.
    X = np.column_stack([rng.normal(size=200), rng.integers(0, 5, 200)])
    y = np.sin(2.0 * X[:, 0]) + 0.3 * X[:, 1] + 0.05 * rng.normal(size=200)
    X[3, 0] = value
    model = ANFISRegressor(**settings).fit(X, y)
    prediction, deviation = model.predict(np.delete(X, 3, axis=0), return_std=True)
    left = np.sqrt(np.mean((prediction - np.delete(y, 3)) ** 2))
    # By the rows less the effective parameters.
    assert 0.95 * left < model.noise_std_ < 1.6 * left
    assert (model.noise_std_ < deviation).all()
    assert deviation.max() < 1.5 * model.noise_std_
