"""Huber's loss: against the linear estimator written out, and with planted outliers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LinearRegression

from skanfis import ANFISRegressor
from skanfis.cluster import FuzzyCMeans
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.options import EarlyStopping, Huber
from skanfis.training import fit, robust

from ..quick import quick

pytestmark = pytest.mark.theory


def with_outliers(n_rows=300):
    g = np.random.default_rng(0)
    X = g.uniform(-3, 3, (n_rows, 2))
    truth = np.sin(X[:, 0]) + 0.5 * X[:, 1]
    y = truth + 0.1 * g.normal(size=n_rows)
    is_outlier = g.random(n_rows) < 0.05
    y[is_outlier] += 8.0
    return X, y, truth, is_outlier


def linear_huber(X, y, epsilon, sample_weight=None):
    """Reweighted least squares of a linear model, written out."""
    own = np.ones(len(y)) if sample_weight is None else sample_weight
    weights = np.ones(len(y))
    for _ in range(500):
        residual = y - LinearRegression().fit(X, y, sample_weight=own * weights).predict(X)
        order = np.argsort(np.abs(residual))
        upto = np.cumsum(own[order])
        median = np.abs(residual)[order][np.searchsorted(upto, 0.5 * upto[-1])]
        if sample_weight is None:
            median = np.median(np.abs(residual))
        before = weights
        weights = np.minimum(1.0, epsilon * median / 0.6744897501960817 / np.abs(residual))
        if np.abs(weights - before).max() < 1e-13:
            break
    return LinearRegression().fit(X, y, sample_weight=own * weights), weights


@pytest.mark.parametrize(("epsilon", "weighted"), [(1.0, False), (1.35, True), (3.0, False)])
def test_one_rule_is_the_linear_huber_estimator(epsilon, weighted, monkeypatch):
    monkeypatch.setattr(fit, "_SETTLED", 1e-12)
    monkeypatch.setattr(fit, "_MOST_TURNS", 500)
    X, y, *_ = with_outliers(200)
    weight = np.random.default_rng(1).uniform(0.5, 2.0, 200) if weighted else None
    model = ANFISRegressor(n_mfs=1, alpha=0.0, loss=Huber(epsilon))
    model.fit(X, y, sample_weight=weight)
    linear, weights = linear_huber(X, y, epsilon, weight)
    expected = [linear.intercept_, *linear.coef_]
    assert_allclose(model.consequents_[0], expected, rtol=1e-6)
    assert_allclose(model.robust_weights_, weights, rtol=1e-5, atol=1e-8)


def test_exact_data_with_a_few_outliers_are_met_exactly():
    g = np.random.default_rng(5)
    X = g.uniform(-1, 1, (300, 2))
    y = 2.0 + X @ [1.0, -3.0]
    y[:10] += 5.0
    model = ANFISRegressor(n_mfs=1, loss="huber").fit(X, y)
    assert_allclose(model.consequents_[0], [2.0, 1.0, -3.0], atol=1e-3)


def test_several_outputs_share_their_weights():
    X, y, truth, is_outlier = with_outliers()
    both = ANFISRegressor(n_mfs=[3, 1], loss="huber").fit(X, np.column_stack([y, -2.0 * truth]))
    assert both.robust_weights_.shape == (len(y),)
    assert both.robust_weights_[is_outlier].max() < 0.1


def test_rows_that_were_not_trained_on_have_no_weight():
    X, y, *_ = with_outliers(200)
    model = quick(loss="huber", early_stopping=EarlyStopping(0.25))
    assert np.isnan(model.fit(X, y).robust_weights_).sum() == 50
    weight = np.ones(200)
    weight[3] = 0.0
    dropped = quick(loss="huber").fit(X, y, sample_weight=weight)
    assert_array_equal(np.flatnonzero(np.isnan(dropped.robust_weights_)), [3])


# The weights may still move in the third digit.
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
@pytest.mark.parametrize(
    ("settings", "size"),
    [
        ({"partition": "grid", "max_rules": 9}, 1e6),
        ({"n_mfs": 4}, 1e3),
        ({"max_rules": 4}, 1e3),
        ({"partition": FuzzyCMeans(6, random_state=0)}, 8.0),
    ],
)
def test_outliers_do_little_and_do_not_decide_on_the_start(settings, size, rng):
    X = rng.uniform(-1, 1, (300, 2))
    # Far from zero, which is no measure of an outlier.
    truth = 1e7 + np.sin(3 * X[:, 0]) * X[:, 1]
    y = truth + 0.02 * rng.normal(size=300)
    is_outlier = np.isin(np.arange(300), rng.choice(300, 5, replace=False))
    model = ANFISRegressor(loss="huber", **settings).fit(X, y + size * is_outlier)
    errors = model.predict(X) - truth
    # Half of the noise; without a robust_start start 18 and 0.9.
    assert np.sqrt(np.mean(errors[~is_outlier] ** 2)) < 0.02
    assert model.robust_weights_[is_outlier].max() < 0.1
    assert np.median(model.robust_weights_[~is_outlier]) == 1.0


@pytest.mark.parametrize("size", [1e9, 1e18, 1e99])
def test_an_outlier_of_any_size_leaves_the_other_rows_their_digits(size, rng):
    """On its scale they would be one number; none of its weights may be rounded up."""
    X = rng.uniform(-1, 1, (90, 2))
    truth = np.sin(3 * X[:, 0]) + 0.3 * X[:, 1]
    y = truth + 0.05 * rng.normal(size=90)
    y[5] = size
    model = ANFISRegressor(n_mfs=[3, 1], loss="huber").fit(X, y)
    assert np.sqrt(np.mean((model.predict(X) - truth) ** 2)) < 0.05
    assert 0.03 < model.noise_std_ < 0.1


@pytest.mark.parametrize("seed", [1, 5])
def test_rows_of_weight_are_rows_repeated_where_outliers_are_many(seed):
    """Which rows are most is said by their weight: here those that are fewer.

    And when the weights have settled, too.
    """
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1.0, 1.0, (125, 1))
    signal = np.sin(3.0 * X[:60, 0]) + 0.05 * rng.normal(size=60)
    y = np.append(signal, rng.uniform(-8.0, 8.0, 65))
    weight = np.repeat([6, 1], [60, 65])
    model = ANFISRegressor(loss="huber", partition="grid", max_rules=4)
    weighted = clone(model).fit(X, y, sample_weight=weight)
    repeated = clone(model).fit(np.repeat(X, weight, 0), np.repeat(y, weight))
    assert weighted.n_rules_ == repeated.n_rules_
    grid = np.linspace(-0.9, 0.9, 50)[:, None]
    assert_allclose(weighted.predict(grid), repeated.predict(grid), rtol=0, atol=1e-10)
    assert weighted.noise_std_ == pytest.approx(repeated.noise_std_, rel=1e-9)


@pytest.mark.floors
def test_weights_that_do_not_settle_are_told(monkeypatch):
    monkeypatch.setattr(fit, "_MOST_TURNS", 1)
    X, y, *_ = with_outliers(200)
    with pytest.warns(ConvergenceWarning, match="weights of the rows still change by"):
        quick(loss="huber").fit(X, y)


@pytest.mark.floors
def test_of_many_rows_some_tell_the_first_weights(monkeypatch):
    X, y, truth, is_outlier = with_outliers(1500)
    monkeypatch.setattr(robust, "SAMPLE_ROWS", 500)
    model = quick(n_mfs=[3, 1], loss="huber").fit(X, y)
    assert model.robust_weights_[is_outlier].max() < 0.1
    assert np.sqrt(np.mean((model.predict(X) - truth) ** 2)) < 0.1
    # The same ones in any order of the rows.
    order = np.random.default_rng(0).permutation(len(y))
    again = quick(n_mfs=[3, 1], loss="huber").fit(X[order], y[order])
    assert_allclose(again.predict(X), model.predict(X), rtol=0, atol=1e-9)


def test_outliers_do_not_say_how_far_the_tangent_is_followed():
    g = np.random.default_rng(0)
    X, is_outlier = g.normal(size=(300, 2)), np.arange(300) % 30 == 0
    y = X @ [2.0, -1.0] + 0.05 * g.normal(size=300)
    model = ANFISRegressor(n_mfs=1, loss="huber")
    for target in (y, y + 30.0 * is_outlier):
        model.fit(X, target)
        with pytest.warns(OutOfBoundsWarning):
            assert_allclose(model.predict([[6.0, -6.0]]), 18.0, atol=0.2)


def test_an_input_that_varies_on_an_outlier_alone_may_have_terms(rng):
    X = np.column_stack([rng.normal(size=60), np.zeros(60)])
    y = 1e-6 * rng.normal(size=60)
    X[0, 1], y[0] = 1.0, -1.0
    model = ANFISRegressor(n_mfs=[1, 2], loss="huber").fit(X, y)
    assert_allclose(model.predict(X)[1:], 0.0, atol=1e-5)


@pytest.mark.filterwarnings("error")
def test_beyond_the_largest_threshold_the_noise_is_that_of_squares(rng):
    X = rng.uniform(-1.0, 1.0, (60, 1))
    y = X[:, 0] ** 2 + 0.1 * rng.standard_normal(60)
    squared, robust = (quick(n_mfs=2, loss=loss).fit(X, y) for loss in (Huber(100.0), Huber(1e200)))
    assert_allclose(robust.noise_std_, squared.noise_std_)
