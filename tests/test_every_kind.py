"""What a fit of every kind can be asked for: grid, tree and scattered rules.

What only reads a model goes through frozen models of every kind where it is tested.
"""

import pickle
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, TreeAntecedent
from skanfis.bounds import FixedPoint, OutputLimits, bounds, monotonicity
from skanfis.exceptions import ForgottenRowsWarning
from skanfis.export import export_json
from skanfis.export.json_reader import parse_json
from skanfis.learning import VariableProjection

N_ROWS = 200
KINDS = {"grid": GridAntecedent, "tree": TreeAntecedent, "scattered": RuleTableAntecedent}
pytestmark = pytest.mark.parametrize("kind", KINDS)
# Weights that are given are not sought: a fit takes a tenth of the time.
GIVEN = {"agreement": 0.01, "alpha": 1e-4, "solver": VariableProjection(stiffness=1e-3)}
# A step, a slope, and a column of two values.
G = np.random.default_rng(2)
X = G.uniform(-1.0, 1.0, (N_ROWS, 3)) * [1.0, 10.0, 1.0] + [0.0, 5.0, 0.0]
X[:, 2] = G.integers(0, 2, N_ROWS)
Y = np.where(X[:, 0] > 0.2, 0.3 * X[:, 1], 1.0 - 0.1 * X[:, 1]) + X[:, 2] * (X[:, 1] > 5.0)
Y += 0.05 * G.normal(size=N_ROWS)


def searched(kind, **settings):
    given = GIVEN | {"partition": kind, "max_rules": 5, "simplicity": 0.0} | settings
    return ANFISRegressor(**given)


@cache
def fitted(kind):
    """One fit of each kind for all that only read it."""
    estimator = searched(kind).fit(X, Y)
    assert estimator.n_rules_ > 2
    return estimator


def onward(kind, **settings):
    """What goes on from its rules."""
    return ANFISRegressor(**GIVEN | {"partition": fitted(kind).model_} | settings)


def assert_is(estimator, kind):
    """Of this kind, and of some use."""
    assert type(estimator.model_.antecedent) is KINDS[kind]
    assert estimator.score(X, Y) > 0.8
    if kind == "tree":
        above, below = estimator.model_.antecedent.groups
        assert_array_equal(above.theta, below.theta)


def test_is_what_was_asked_for(kind):
    assert_is(fitted(kind), kind)
    compared = fitted(kind).structures_
    assert {one["kind"] for one in compared} <= {kind, "one rule"}
    # As many as max_rules allows, and no candidate with more.
    assert 3 < max(one["rules"] for one in compared) <= 5


def test_features_of_both_parts(kind):
    settings = {"premise_features": ["x0", "x2"], "consequent_features": [1]}
    estimator = searched(kind, **settings).fit(X, Y)
    assert_is(estimator, kind)
    assert set(estimator.model_.antecedent.term_inputs) <= {0, 2}
    slopes = estimator.model_.coefficients[:, 1:]
    assert_array_equal(np.flatnonzero(slopes.any(axis=(0, 2))), [1])


def test_parts_add_up(kind):
    whole = onward(kind, solver="lse").partial_fit(X, Y)
    first, second = (pickle.loads(pickle.dumps(whole)) for _ in range(2))
    first.partial_fit(X[:100], Y[:100])
    second.partial_fit(X[:100], Y[:100])
    assert_allclose(first.predict(X), second.predict(X))
    merged = first.merge(second)
    assert_is(merged, kind)
    again = first.partial_fit(X, Y).partial_fit(X[:100], Y[:100])
    assert_allclose(merged.predict(X), again.predict(X), rtol=1e-6, atol=1e-8)
    with pytest.warns(ForgottenRowsWarning):
        assert_is(pickle.loads(pickle.dumps(fitted(kind))).partial_fit(X, Y), kind)


def test_bounds_hold_and_are_met(kind):
    found = bounds(fitted(kind))
    rows = np.random.default_rng(0).uniform(X.min(axis=0), X.max(axis=0), (20_000, 3))
    y = fitted(kind).model_.predict(rows)[:, 0]
    assert found.converged
    assert found.lower[0] <= y.min()
    assert y.max() <= found.upper[0]
    taken = np.ptp(np.concatenate([y, found.lowest, found.highest]))
    assert found.upper[0] - found.lower[0] < 1.03 * taken


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
def test_constraints_are_kept(kind):
    settings = {"monotonic_cst": {"x1": 1}, "constraints": [FixedPoint([0.5, 5.0, 1.0], 0.7)]}
    estimator = onward(kind, **settings).fit(X, np.maximum(X[:, 0], 0.0) + 0.04 * X[:, 1])
    assert type(estimator.model_.antecedent) is KINDS[kind]
    assert_array_equal(monotonicity(estimator, "x1"), [1])
    assert_allclose(estimator.predict([[0.5, 5.0, 1.0]]), 0.7)
    top = float(fitted(kind).predict(X).max()) - 0.1
    limited = onward(kind, constraints=[OutputLimits(upper=top)]).fit(X, np.minimum(Y, top))
    assert bounds(limited).upper[0] <= top + 1e-9


def test_rules_without_one_can_be_trained_and_written(kind):
    left = fitted(kind).without_rules([1])
    again = ANFISRegressor(**GIVEN | {"partition": left}).fit(X, Y)
    assert again.score(X, Y) > 0.7
    read = parse_json(export_json(again))
    assert_array_equal(read.predict(X), again.model_.predict(X))


def test_json_with_the_posterior(kind):
    """Pickles: test_parts_add_up."""
    estimator = fitted(kind)
    read = parse_json(export_json(estimator, posterior=True))
    assert type(read.antecedent) is KINDS[kind]
    assert_array_equal(read.predict(X), estimator.model_.predict(X))
    assert_array_equal(read.standard_deviation(X), estimator.model_.standard_deviation(X))
