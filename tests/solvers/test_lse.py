"""One solve is scikit-learn's ridge regression on the design."""

import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.linear_model import Ridge

from skanfis.objective import SeparableProblem
from skanfis.penalty import Penalty
from skanfis.premise import Premise
from skanfis.solvers.lse import lse

from .. import oracles
from .test_varpro import start_of


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("kind", ["grid", "bells", "scattered"])
@pytest.mark.parametrize("alpha", [1e-6, 1e-2])
def test_ridge(rng, kind, weighted, order, alpha):
    rows = oracles.bumpy_rows(rng, n_outputs=2, weighted=weighted)
    antecedent = start_of(kind, rows)
    dense = oracles.DenseProblem(rows, antecedent, order, alpha)
    premise = Premise.of(antecedent, *oracles.box(rows))
    result = lse(SeparableProblem(rows, antecedent, order, Penalty(alpha=alpha)), premise, max_iter=1, tol=0.0)
    # Relative to the mean over rows; centred targets need no intercept.
    ridge = Ridge(alpha=alpha, fit_intercept=False, solver="cholesky")
    design = dense.design(antecedent.parameters) @ dense.local
    ridge.fit(design, dense.y, sample_weight=dense.weight)
    expected = dense.local @ ridge.coef_.T
    assert_allclose(result.evaluation.coefficients, expected, rtol=1e-6, atol=1e-7)


def test_nothing_moves(rng):
    rows = oracles.bumpy_rows(rng)
    antecedent = start_of("grid", rows)
    premise = Premise.of(antecedent, *oracles.box(rows))
    problem = SeparableProblem(rows, antecedent, 1, Penalty(alpha=1e-6))
    result = lse(problem, premise, max_iter=50, tol=1e-6, stiffness=1.0)
    assert result.n_iter == 1
    assert result.converged
    assert result.loss_curve[0] == result.loss_curve[1] == result.evaluation.mean_squared_error
    assert_array_equal(result.evaluation.antecedent.parameters, antecedent.parameters)
    start = 0.1 * rng.normal(size=premise.size)
    moved = lse(problem, premise, max_iter=50, tol=1e-6, start=start)
    assert_array_equal(moved.evaluation.antecedent.parameters, premise.parameters(start))
