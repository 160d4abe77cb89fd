"""Slopes in common, and none: against the marginal likelihood, planted ones, and in a fit."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import linalg, stats

from skanfis import ANFISRegressor
from skanfis.antecedent import TreeAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import WORTH
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.sparse_slopes import _given, _loss, _of, sparse_slopes

from .test_evidence import laplace_at

pytestmark = pytest.mark.theory

STUMP = TreeAntecedent.build([], [[], []], [[]]).split(0, 0, 0.1, -0.5)
TREE = STUMP.split(0, 2, 0.3, -0.7)
PENALTY = Penalty(agreement=1e-4, alpha=1e-4, slope=1e-4)


def planted(rng, n_rows=600):
    """By the second input all rules rise alike; by the first, the last rule does otherwise.

    By the fourth none does, by the fifth the last one alone.
    """
    X = rng.uniform(-1.7, 1.7, (n_rows, 5))
    slopes = [[1.0, 0.7, 0.5, 0.0, 0.0], [1.0, 0.7, -1.0, 0.0, 0.0], [-1.0, 0.7, 2.0, 0.0, 0.6]]
    values = np.array([0.0, 1.0, -1.0]) + X @ np.transpose(slopes)
    y = np.sum(TREE.strengths(X.T).T * values, axis=1)
    return X, y + 0.1 * rng.standard_normal(n_rows)


def posterior_of(X, y, antecedent=TREE, penalty=PENALTY):
    rows = StandardisedData.of(X, y.reshape(len(X), -1))
    problem = SeparableProblem(rows, antecedent, penalty)
    evaluation = problem.evaluate(antecedent.parameters)
    return problem, evaluation, laplace_at(problem, evaluation, penalty)


@pytest.mark.parametrize("n_outputs", [1, 2])
def test_what_it_takes_from_the_evidence_is_that_of_the_marginal_likelihood(rng, n_outputs):
    X = rng.uniform(-1.7, 1.7, (40, 3))
    y = np.column_stack([np.sin(X[:, 0]) + X[:, 1], X[:, 2]])[:, :n_outputs]
    y += 0.1 * rng.normal(size=y.shape)
    problem, evaluation, posterior = posterior_of(X, y)
    line, n = problem.common_line, 40
    noise = posterior.noise_variance
    prior = evaluation.normal.penalty + 1e-3 * np.outer(line.height, line.height)
    # Phi in local coordinates.
    Z, target, _ = StandardisedData.of(X, y).read(slice(None))
    design = (TREE.strengths(Z)[:, None] * np.vstack([np.ones(n), Z])).reshape(12, n)
    design = problem.local.transform_rows(design).T

    def minus_twice_log(of_prior):
        covariance = noise * np.eye(n) + design @ of_prior @ design.T
        return -2.0 * stats.multivariate_normal(cov=covariance).logpdf(target).sum()

    before = noise / n * np.linalg.inv(prior)
    after = noise / n * np.linalg.inv(design.T @ design / n + prior)
    state = [after @ design.T @ target.T / noise, after, before]
    for j, rules in ((1, [0, 1, 2]), (0, [0, 2])):
        contrasts = linalg.helmert(len(rules)) @ line.own_slopes(j, np.array(rules))
        across = before @ contrasts.T
        given = before - across @ np.linalg.solve(contrasts @ across, across.T)
        expected = minus_twice_log(given) - minus_twice_log(before)
        assert_allclose(_loss(_of(state, contrasts)), expected, rtol=1e-6)
        # What is left is conditioned on it.
        before, state = given, _given(state, contrasts)
        assert_allclose(contrasts @ state[0], 0.0, atol=1e-10)


def test_planted_slopes_are_found(rng):
    _, evaluation, posterior = posterior_of(*planted(rng))
    common, absent = sparse_slopes(posterior, evaluation.normal.coefficients, WORTH)
    assert dict(common) == {0: (0, 1), 1: (0, 1, 2)}
    assert dict(absent) == {3: (0, 1, 2), 4: (0, 1)}


def test_held_slopes_are_one_and_count_as_one(rng):
    X, y = planted(rng)
    free = posterior_of(X, y)[2]
    held = replace(PENALTY, common=((0, (0, 1)), (1, (0, 1, 2))), absent=((4, (0, 1)),))
    _, evaluation, posterior = posterior_of(X, y, penalty=held)
    slopes = evaluation.coefficients.reshape(3, 6)
    assert np.ptp(slopes[:, 2]) < 1e-5 * np.abs(slopes[:, 2]).max()
    assert abs(slopes[0, 1] - slopes[1, 1]) < 1e-5
    assert_array_equal(slopes[:2, 5], 0.0)
    assert slopes[2, 5] != 0.0
    # Five of eighteen less, but for what the penalty held of them already.
    assert 4.5 < free.n_effective - posterior.n_effective <= 5.0


class TestFit:
    def model(self, rng, **settings):
        X, y = planted(rng)
        return ANFISRegressor(partition="tree", **settings).fit(X, y)

    def test_the_model_that_is_kept_has_them(self, rng):
        model = self.model(rng)
        common = model.model_.common_slopes
        assert common[:, 1].sum() == model.n_rules_ > 1
        assert_array_equal(model.consequents_[:, 2], model.consequents_[0, 2])
        assert_array_equal(model.consequents_[:, 4], 0.0)
        costs = [one["reading_cost"] for one in model.structures_ if one["chosen"]]
        assert costs == [model.readability_.reading_cost]

    def test_partial_fit_keeps_them(self, rng):
        X, y = planted(rng)
        model = ANFISRegressor(partition="tree").partial_fit(X[:500], y[:500])
        before, common = model.predict(X), model.model_.common_slopes
        model.partial_fit(X[500:], y[500:])
        assert_array_equal(model.model_.common_slopes, common)
        assert_array_equal(model.consequents_[:, 4], 0.0)
        assert_allclose(model.predict(X), before, atol=0.05)

    @pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
    @pytest.mark.parametrize("solver", ["varpro", "hybrid", "gradient", "lse"])
    def test_every_solver_keeps_the_model_that_it_has_trained(self, rng, solver):
        X, y = planted(rng, 300)
        model = ANFISRegressor(partition="tree", max_rules=3, solver=solver, max_iter=20)
        residual = (y - model.fit(X, y).predict(X)) / y.std()
        # Descents keep the point of the least cost, which need not be the last.
        assert np.isclose(np.mean(residual**2), model.loss_curve_, rtol=1e-9, atol=0.0).any()
        assert model.model_.common_slopes.any() == (solver in ("varpro", "lse"))
