"""Descent along the joint gradient, of which test_objective speaks."""

import numpy as np
from numpy.testing import assert_allclose

from skanfis.learning import GradientDescent
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty

from .. import oracles
from .test_varpro import planted


def test_step_is_along_the_gradient_by_natural_premises_and_consequents():
    rows, premise, *_ = planted("bells", 0, displaced=0.5, noise=0.1, n_outputs=2)
    antecedent, penalty = premise.antecedent, Penalty(agreement=0.1, alpha=1e-4, slope=1e-3)
    problem = SeparableProblem(rows, antecedent, 1, penalty)
    dense = oracles.DenseProblem(rows, antecedent, 1, penalty)
    seen = []
    solver = GradientDescent(tol=0.0)
    solver.solve(problem, premise, max_iter=2, on_iteration=lambda n, e: seen.append(e))
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
