"""What a fit of every kind can be asked for: grid, tree and scattered rules.

What only reads a model goes through frozen models of every kind where it is tested.
"""

import pickle
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, TreeAntecedent
from skanfis.bounds import FixedPoint, OutputLimits, bounds, gradient_bounds, monotonicity
from skanfis.exceptions import ForgottenRowsWarning
from skanfis.export import export_json, fold
from skanfis.export.json_reader import parse_json
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
WEIGHT = np.random.default_rng(1).integers(0, 3, N_ROWS)


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

    def test_deviations_and_coverage(self, kind):
        estimator = fitted(kind)
        y, deviation = estimator.predict(X, return_std=True)
        assert_array_equal(y, estimator.predict(X))
        within = np.abs(y - Y) < 2.0 * deviation
        assert 0.85 < within.mean() <= 1.0
        covered = estimator.coverage(np.array([[0.0, 5.0, 1.0], [40.0, 5.0, 1.0]]))
        assert covered[0] > 0.9
        assert covered[1] < 1e-9


class TestFits:
    def test_families_are_of_grids_and_scattered_rules(self, kind):
        if kind == "tree":
            assert_is(searched(kind, mf=Gaussian).fit(X, Y), kind)
            for mf in ("bell", ["gaussian", "bell", "gaussian"]):
                with pytest.raises(ValueError, match=r"mf=.* has no effect with partition='tree'"):
                    searched(kind, mf=mf).fit(X, Y)
        else:
            assert_is(searched(kind, mf="bell").fit(X, Y), kind)

    @pytest.mark.parametrize("order", [0, 1])
    def test_orders_and_several_outputs(self, kind, order):
        estimator = searched(kind, order=order).fit(X, two())
        assert_is(estimator, kind)
        assert estimator.predict(X).shape == (N_ROWS, 2)
        assert estimator.model_.order == order

    @pytest.mark.theory
    def test_weight_of_two_is_the_row_twice(self, kind):
        kept = WEIGHT > 0
        model = searched(kind, max_rules=3)
        weighted = clone(model).fit(X[kept], Y[kept], sample_weight=WEIGHT[kept])
        repeated = clone(model).fit(np.repeat(X, WEIGHT, axis=0), np.repeat(Y, WEIGHT))
        assert_allclose(weighted.predict(X[kept]), repeated.predict(X[kept]), atol=1e-4)
        errors = [[o["expected_error"] for o in m.structures_] for m in (weighted, repeated)]
        assert_allclose(errors[1], errors[0], rtol=1e-4)

    def test_features_of_both_parts(self, kind):
        settings = {"premise_features": ["x0", "x2"], "consequent_features": [1]}
        estimator = searched(kind, **settings).fit(X, Y)
        assert_is(estimator, kind)
        assert set(estimator.model_.antecedent.term_inputs) <= {0, 2}
        slopes = estimator.model_.coefficients[:, 1:]
        assert_array_equal(np.flatnonzero(slopes.any(axis=(0, 2))), [1])

    @pytest.mark.parametrize("settings", [{"max_iter": 15}, {"solver": "lse"}, {"max_iter": 0}])
    def test_solvers_and_none(self, kind, settings):
        estimator = onward(kind, **settings).fit(X, Y)
        assert_is(estimator, kind)
        start = fitted(kind)
        if settings == {"max_iter": 15}:
            moved = estimator.model_.antecedent.parameters != start.model_.antecedent.parameters
            assert moved.any()
        if settings == {"max_iter": 0}:
            assert_array_equal(estimator.predict(X), start.predict(X))

    @pytest.mark.theory
    def test_early_stopping_groups_and_losses(self, kind):
        assert_is(searched(kind, early_stopping=True, loss="huber", max_rules=4).fit(X, Y), kind)
        assert_is(searched(kind, max_rules=4).fit(X, Y, groups=np.arange(N_ROWS) // 40), kind)

    def test_parts_add_up(self, kind):
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

    def test_scaler_is_folded_in(self, kind):
        pipeline = make_pipeline(StandardScaler(), searched(kind)).fit(X, Y)
        model = fold(pipeline)
        assert type(model.antecedent) is KINDS[kind]
        assert_allclose(model.predict(X)[:, 0], pipeline.predict(X), rtol=1e-9, atol=1e-10)
        deviation = pipeline.predict(X, return_std=True)[1]
        assert_allclose(model.standard_deviation(X)[:, 0], deviation, rtol=1e-6)


class TestProofs:
    def test_bounds_hold_and_are_met(self, kind):
        found = bounds(fitted(kind))
        rows = np.random.default_rng(0).uniform(X.min(axis=0), X.max(axis=0), (20_000, 3))
        y = fitted(kind).model_.predict(rows)[:, 0]
        assert found.converged
        assert found.lower[0] <= y.min()
        assert y.max() <= found.upper[0]
        taken = np.ptp(np.concatenate([y, found.lowest, found.highest]))
        assert found.upper[0] - found.lower[0] < 1.03 * taken
        slopes = gradient_bounds(fitted(kind), "x1")
        steep = fitted(kind).model_.gradient(rows)[:, 1, 0]
        assert slopes.lower[0] <= steep.min()
        assert steep.max() <= slopes.upper[0]

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
