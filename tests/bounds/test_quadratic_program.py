"""The nearest consequents by the conditions of a minimum, and what cannot be met."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import nnls

from skanfis.bounds.quadratic_program import InfeasibleError, nearest
from skanfis.consequent import NormalFactor

N = 8


def a_problem(rng, n_equal, n_rows):
    """Matrix, start, and constraints that some point keeps with room."""
    root = rng.normal(size=(N, N + 2))
    matrix, start, inside = root @ root.T, rng.normal(size=N), rng.normal(size=N)
    equal, rows = rng.normal(size=(n_equal, N)), rng.normal(size=(n_rows, N))
    return matrix, start, equal, equal @ inside, rows, rows @ inside - rng.uniform(0.0, 0.5, n_rows)


@pytest.mark.parametrize(("n_equal", "n_rows"), [(0, 0), (0, 5), (2, 0), (2, 5), (3, 40), (0, 100)])
def test_it_is_the_minimum(n_equal, n_rows, rng):
    matrix, start, equal, equal_to, rows, least = a_problem(rng, n_equal, n_rows)
    found, is_active = nearest(NormalFactor(matrix), start, equal, equal_to, rows, least)
    assert_allclose((rows @ found - least)[is_active], 0.0, atol=1e-8)
    assert_allclose(equal @ found, equal_to, atol=1e-9)
    assert (rows @ found >= least - 1e-9).all()
    # Karush, Kuhn and Tucker: the slope of the cost is a sum of those of what holds with equality,
    # of inequalities with positive weights. Of a convex problem this is the minimum.
    active = rows[rows @ found - least < 1e-8]
    slope = matrix @ (found - start)
    assert len(active) + n_equal > 0 or not slope.any()
    columns = np.vstack([active, equal, -equal, np.zeros((1, N))]).T
    assert nnls(columns, slope)[1] <= 1e-8 * (1.0 + np.linalg.norm(slope))


def test_what_cannot_be_met_is_refused(rng):
    matrix, start, *_ = a_problem(rng, 0, 0)
    factor, row = NormalFactor(matrix), rng.normal(size=(1, N))
    none, nothing = np.empty((0, N)), np.empty(0)
    with pytest.raises(InfeasibleError):
        nearest(factor, start, none, nothing, np.vstack([row, -row]), np.array([1.0, -0.9]))
    with pytest.raises(InfeasibleError):
        nearest(factor, start, np.vstack([row, row]), np.array([1.0, 2.0]), none, nothing)
    # Twice the same says nothing new.
    once, twice = (
        nearest(factor, start, np.tile(row, (n, 1)), np.ones(n), none, nothing)[0] for n in (1, 2)
    )
    assert_allclose(twice, once, rtol=1e-9)
    # What an equality decides cannot be asked to be otherwise.
    with pytest.raises(InfeasibleError):
        nearest(factor, start, row, np.array([1.0]), row, np.array([1.1]))
