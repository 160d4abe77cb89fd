"""The joint cost's gradient by complex steps, and descent along it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning import GradientDescent
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty

from .. import oracles
from .test_objective import PAIRS, Case
from .test_varpro import planted


def gradient(problem, premise, *, max_iter, on_iteration=None, **settings):
    """A run of back-propagation with settings of its own."""
    solver = GradientDescent(**settings)
    return solver.solve(problem, premise, max_iter=max_iter, on_iteration=on_iteration)


@pytest.fixture(scope="module", params=PAIRS, ids=lambda pair: f"{pair[0]}, {pair[1].alpha}")
def case(request):
    return Case.named(*request.param)


def any_coefficients(case):
    shape = (case.problem.n_columns, case.problem.n_outputs)
    return np.random.default_rng(8).normal(size=shape)


class TestJointGradient:
    def test_cost(self, case):
        coefficients = any_coefficients(case)
        evaluation, *_ = case.problem.joint(case.point, coefficients)
        expected = case.dense.cost_at(case.point, coefficients)
        assert_allclose(evaluation.cost, expected, rtol=1e-12)
        residual = case.dense.y - case.dense.design(case.point) @ coefficients
        error = np.sum(case.dense.weight[:, None] * residual**2)
        assert_allclose(evaluation.mean_squared_error, error, rtol=1e-11)
        firing = oracles.strengths(case.problem.antecedent, case.point, case.dense.Z)
        assert_allclose(evaluation.masses, firing @ case.dense.weight, rtol=1e-10, atol=1e-14)
        assert evaluation.coefficients is coefficients
        assert_array_equal(evaluation.antecedent.parameters, case.point)

    @pytest.mark.theory
    def test_gradient_by_premises(self, case):
        coefficients = any_coefficients(case)
        _, found, _ = case.problem.joint(case.point, coefficients)
        expected = oracles.complex_step(lambda p: case.dense.cost_at(p, coefficients), case.point)
        assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_step_is_along_the_gradient_by_natural_premises_and_consequents():
    rows, premise, *_ = planted("bells", 0, displaced=0.5, noise=0.1, n_outputs=2)
    antecedent, penalty = premise.antecedent, Penalty(agreement=0.1, alpha=1e-4, slope=1e-3)
    problem = SeparableProblem(rows, antecedent, 1, penalty)
    dense = oracles.DenseProblem(rows, antecedent, 1, penalty)
    (group,) = antecedent.groups
    solved = problem.evaluate(antecedent.parameters).coefficients
    numbers = group.family.natural(group.theta)
    start = np.concatenate([numbers.ravel(), solved.ravel()])

    def cost(variables):
        center, width, slope = variables[: numbers.size].reshape(numbers.shape)
        parameters = np.concatenate([center, np.log(width), np.log(slope)])
        beta = variables[numbers.size :].reshape(solved.shape)
        return dense.cost_at(parameters, beta)

    slope = oracles.complex_step(cost, start)
    expected = start - 0.01 * slope / np.linalg.norm(slope)
    seen = []
    gradient(problem, premise, max_iter=1, tol=0.0, on_iteration=lambda n, e: seen.append(e))
    found = seen[0].antecedent.groups[0]
    variables = [found.family.natural(found.theta).ravel(), seen[0].coefficients.ravel()]
    assert_allclose(np.concatenate(variables), expected, rtol=0, atol=1e-9)
