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
    seen = []
    gradient(problem, premise, max_iter=2, tol=0.0, on_iteration=lambda n, e: seen.append(e))
    # The first step, from the solution of least squares, leaves the consequents where they are.
    (before, start), (_, found) = ((one, variables_of(one)) for one in seen)
    n_consequents = before.coefficients.size

    def cost(variables):
        center, width, slope = variables[:-n_consequents].reshape(3, -1)
        parameters = np.concatenate([center, np.log(width), np.log(slope)])
        return dense.cost_at(parameters, variables[-n_consequents:].reshape(-1, 2))

    slope = oracles.complex_step(cost, start)
    assert np.linalg.norm(slope[-n_consequents:]) > 0.01 * np.linalg.norm(slope)
    expected = start - 0.01 * slope / np.linalg.norm(slope)
    assert_allclose(found, expected, rtol=0, atol=1e-9)


def variables_of(evaluation):
    """Numbers of the premises, as a person reads them, and consequents, in a row."""
    (group,) = evaluation.antecedent.groups
    natural = group.family.natural(group.theta)
    return np.concatenate([natural.ravel(), evaluation.coefficients.ravel()])
