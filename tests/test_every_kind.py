"""What a fit of every kind can be asked for: grid, tree and scattered rules.

What only reads a model goes through frozen models of every kind where it is tested.
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, TreeAntecedent
from skanfis.bounds import FixedPoint, OutputLimits, bounds, monotonicity
from skanfis.learning import VariableProjection
from skanfis.membership import Gaussian

N_ROWS = 200
KINDS = {"grid": GridAntecedent, "tree": TreeAntecedent, "scattered": RuleTableAntecedent}
pytestmark = [pytest.mark.parametrize("kind", KINDS)]
# Weights that are given are not sought: a fit takes a tenth of the time.
GIVEN = {"agreement": 0.01, "alpha": 1e-4, "solver": VariableProjection(stiffness=1e-3)}
# A step, a slope, and a column of two values.
G = np.random.default_rng(0)
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
    assert estimator.score(X, Y if estimator.model_.n_outputs == 1 else two()) > 0.8
    if kind == "tree":
        above, below = estimator.model_.antecedent.groups
        assert_array_equal(above.theta, below.theta)


def two():
    return np.column_stack([Y, Y**2])


class TestAnswers:
    def test_is_what_was_asked_for(self, kind):
        assert_is(fitted(kind), kind)
        compared = fitted(kind).structures_
        assert {one["kind"] for one in compared} <= {kind, "one rule"}
        # As many as max_rules allows, and no candidate with more.
        assert 3 < max(one["rules"] for one in compared) <= 5


class TestFits:
    def test_families_are_of_grids_and_scattered_rules(self, kind):
        if kind == "tree":
            assert_is(searched(kind, mf=Gaussian).fit(X, Y), kind)
            for mf in ("bell", ["gaussian", "bell", "gaussian"]):
                with pytest.raises(ValueError, match=r"mf=.* means nothing to partition='tree'"):
                    searched(kind, mf=mf).fit(X, Y)
        else:
            assert_is(searched(kind, mf="bell").fit(X, Y), kind)

    @pytest.mark.parametrize("order", [0, 1])
    def test_orders_and_several_outputs(self, kind, order):
        estimator = searched(kind, order=order, max_rules=6).fit(X, two())
        assert_is(estimator, kind)
        assert estimator.predict(X).shape == (N_ROWS, 2)
        assert estimator.model_.order == order

    def test_features_of_both_parts(self, kind):
        settings = {"premise_features": ["x0", "x2"], "consequent_features": [1]}
        estimator = searched(kind, **settings).fit(X, Y)
        assert_is(estimator, kind)
        assert set(estimator.model_.antecedent.term_inputs) <= {0, 2}
        slopes = estimator.model_.coefficients[:, 1:]
        assert_array_equal(np.flatnonzero(slopes.any(axis=(0, 2))), [1])


class TestProofs:
    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
    def test_constraints_are_kept(self, kind):
        settings = {"monotonic_cst": {"x1": 1}, "constraints": [FixedPoint([0.5, 5.0, 1.0], 0.7)]}
        estimator = onward(kind, **settings).fit(X, np.maximum(X[:, 0], 0.0) + 0.04 * X[:, 1])
        assert type(estimator.model_.antecedent) is KINDS[kind]
        assert_array_equal(monotonicity(estimator, "x1"), [1])
        assert_allclose(estimator.predict([[0.5, 5.0, 1.0]]), 0.7)
        top = float(fitted(kind).predict(X).max()) - 0.1
        limited = onward(kind, constraints=[OutputLimits(upper=top)]).fit(X, np.minimum(Y, top))
        assert bounds(limited).upper[0] <= top + 1e-9
