"""Few rows for many inputs: which inputs the lasso keeps, and what is learnt from them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.linear_model import Lasso, LassoCV, RidgeCV

from skanfis import ANFISRegressor
from skanfis.exceptions import ConstantInputWarning
from skanfis.learning.data import StandardisedData
from skanfis.search.lasso import lasso_inputs


def rows_of(X, y, weight=None):
    rows = StandardisedData.of(X, np.reshape(y, (len(X), -1)), weight)
    table = rows.table(slice(None))
    n_inputs = X.shape[1]
    return StandardisedData.of(table[:, :n_inputs], table[:, n_inputs:], weight)


@pytest.mark.theory
@pytest.mark.parametrize("seed", [1, 3])
def test_the_penalty_is_the_largest_within_one_standard_error(seed):
    """Fold by fold and penalty by penalty."""
    rng = np.random.default_rng(seed)
    X, weight = rng.standard_normal((60, 12)), rng.choice([1.0, 9.0], 60)
    rows = rows_of(X, X[:, 2] - 0.5 * X[:, 7] + rng.standard_normal(60), weight)
    X, y = rows.X, rows.y[:, 0]
    centred = X - np.average(X, axis=0, weights=weight)
    largest = np.abs((weight * (y - np.average(y, weights=weight))) @ centred).max() / weight.sum()
    penalties, errors = np.geomspace(largest, 0.01 * largest, 100), []
    for penalty in penalties:
        errors.append([])
        for k in range(5):
            part, rest = np.arange(k, 60, 5), np.delete(np.arange(60), np.s_[k::5])
            line = Lasso(penalty).fit(X[rest], y[rest], weight[rest])
            left = (y[part] - line.predict(X[part])) ** 2
            errors[-1].append(np.average(left, weights=weight[part]))
    mean, chance = np.mean(errors, axis=1), np.std(errors, axis=1) / np.sqrt(5)
    first = np.flatnonzero(mean <= mean.min() + chance[mean.argmin()])[0]
    kept = np.flatnonzero(Lasso(penalties[first]).fit(X, y, weight).coef_)
    assert 0 < first < mean.argmin()
    assert_array_equal(lasso_inputs(rows, np.arange(12)), kept)


@pytest.mark.parametrize("seed", range(4))
def test_of_equal_columns_the_first_is_kept(seed):
    """In other units, or the other way round, they are equal too."""
    rng = np.random.default_rng(seed)
    first, other = rng.standard_normal((2, 60))
    X = np.column_stack([first, other, -first, 2.0 * first + 1.0, other])
    rows = rows_of(X, first + other + rng.standard_normal(60))
    assert_array_equal(lasso_inputs(rows, np.arange(5)), [0, 1])


def test_runs_are_left_out_whole(rng):
    """What moves with the run alone tells nothing of another run."""
    run = np.repeat(np.arange(10), 12)
    level = rng.standard_normal((10, 30))
    X = level[run] + 0.1 * rng.standard_normal((120, 30))
    rows = rows_of(X, rng.standard_normal(10)[run] + 0.1 * rng.standard_normal(120))
    in_runs = lasso_inputs(replace(rows, groups=run), np.arange(30))
    assert 5 * in_runs.size < lasso_inputs(rows, np.arange(30)).size


def error_to(truth, model, X):
    return np.sqrt(np.mean((model.predict(X) - truth(X)) ** 2))


@pytest.mark.theory
def test_rules_on_few_of_many_inputs_are_found(rng):
    def truth(X):
        return np.tanh(2.0 * X[:, 0]) + X[:, 1] + 0.5 * X[:, 1] * X[:, 2]

    X = rng.standard_normal((120, 150))
    y = truth(X) + 0.5 * rng.standard_normal(120)
    model = ANFISRegressor(max_rules=4).fit(X, y)
    X_new = rng.standard_normal((2000, 150))
    assert model.n_rules_ > 1
    assert error_to(truth, model, X_new) < 0.8 * error_to(truth, LassoCV().fit(X, y), X_new)
    slopes = np.flatnonzero(model.model_.coefficients[:, 1:].any(axis=(0, 2)))
    assert {0, 1} <= set(slopes)
    assert slopes.size <= 8


@pytest.mark.theory
def test_where_all_inputs_count_all_have_slopes(rng):
    weights = rng.standard_normal(60)
    X, X_new = rng.standard_normal((80, 60)), rng.standard_normal((2000, 60))
    y = X @ weights + 0.5 * rng.standard_normal(80)
    model = ANFISRegressor().fit(X, y)
    chosen = next(one["structure"] for one in model.structures_ if one["chosen"])
    assert chosen == "one rule, slopes by all inputs"
    ridge = RidgeCV(np.logspace(-3, 3, 25)).fit(X, y)
    own, of_ridge = (error_to(lambda X: X @ weights, one, X_new) for one in (model, ridge))
    assert own < 1.05 * of_ridge


@pytest.mark.theory
def test_of_noise_on_more_inputs_than_rows_nothing_is_learnt(rng):
    X, y = rng.standard_normal((60, 100)), rng.standard_normal(60)
    assert_allclose(ANFISRegressor().fit(X, y).predict(X), y.mean(), atol=0.2)


@pytest.mark.theory
@pytest.mark.parametrize("alpha", ["auto", 1e-3])
def test_a_stream_goes_on_with_the_inputs_of_its_first_chunk(rng, alpha):
    X = rng.standard_normal((160, 30))
    y = X[:, 0] + X[:, 1] + 0.1 * rng.standard_normal(160)
    model = ANFISRegressor(alpha=alpha, max_rules=2).partial_fit(X[:60], y[:60])
    has_slope = model.model_.coefficients[:, 1:].any(axis=(0, 2))
    assert np.count_nonzero(has_slope) < 10
    model.partial_fit(X[60:], y[60:])
    assert_array_equal(model.model_.coefficients[:, 1:].any(axis=(0, 2)), has_slope)
    assert_allclose(model.model_.coefficients[0, 1:3, 0], 1.0, atol=0.05)


@pytest.mark.theory
def test_a_column_that_has_not_yet_changed_may_gain_a_slope(rng):
    X = rng.standard_normal((160, 30))
    X[:60, 1] = 0.0
    y = X[:, 0] + X[:, 1] + 0.1 * rng.standard_normal(160)
    with pytest.warns(ConstantInputWarning, match="'x1'"):
        model = ANFISRegressor(max_rules=2).partial_fit(X[:60], y[:60])
    model.partial_fit(X[60:], y[60:])
    assert_allclose(model.model_.coefficients[0, 1:3, 0], 1.0, atol=0.05)


def test_constants_have_no_slopes_to_choose(rng):
    """As few rows as there are folds."""
    model = ANFISRegressor(order=0).fit(rng.normal(size=(5, 3)), np.arange(5.0))
    assert model.model_.order == 0
