"""One solve is scikit-learn's linear regression of all that the cost squares."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.linear_model import LinearRegression

from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.learning.solver import lse

from .. import oracles
from .test_varpro import start_of


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("kind", ["grid", "bells", "scattered"])
@pytest.mark.parametrize(
    "penalty", [Penalty(alpha=1e-6), Penalty(agreement=0.5, alpha=1e-2, slope=0.1)]
)
def test_one_regression_on_all_residuals(rng, kind, weighted, order, penalty):
    rows = oracles.bumpy_rows(rng, n_outputs=2, weighted=weighted)
    antecedent = start_of(kind, rows)
    premise = Premise.of(antecedent, *oracles.box(rows))
    problem = SeparableProblem(rows, antecedent, order, penalty)
    result = lse(problem, premise)
    dense = oracles.DenseProblem(rows, antecedent, order, penalty)
    matrix = dense.residual_matrix(antecedent.parameters)
    line = LinearRegression(fit_intercept=False).fit(matrix, dense.right_side(len(matrix)))
    assert_allclose(result.evaluation.coefficients, line.coef_.T, rtol=1e-6, atol=1e-7)


def test_nothing_moves(rng):
    rows = oracles.bumpy_rows(rng)
    antecedent = start_of("grid", rows)
    premise = Premise.of(antecedent, *oracles.box(rows))
    problem = SeparableProblem(rows, antecedent, 1, Penalty(alpha=1e-6))
    result = lse(problem, premise)
    assert result.n_iter == 1
    assert result.converged
    assert result.loss_curve[0] == result.loss_curve[1] == result.evaluation.mean_squared_error
    parameters = result.evaluation.antecedent.parameters
    assert_array_equal(parameters, premise.parameters(np.zeros(premise.size)))
    assert_allclose(parameters, antecedent.parameters, rtol=1e-14, atol=1e-14)
    start = 0.1 * rng.normal(size=premise.size)
    moved = lse(problem, premise, start=start)
    assert_array_equal(moved.evaluation.antecedent.parameters, premise.parameters(start))
