"""Local basis and Cholesky factor against explicit matrices and numpy's own solvers."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.consequent import LocalBasis, NormalFactor


def gram_of(strengths, Z, weight):
    phi = np.array([w * b for w in strengths for b in [1, *Z]])
    return (phi * weight) @ phi.T


def test_rule_that_fires_on_one_spot_has_a_spread(rng):
    Z = rng.normal(size=(3, 200)) + np.array([[0.0], [2.0], [-1.0]])
    strengths, weight = rng.dirichlet(np.full(4, 0.5), 200).T, rng.uniform(0.1, 2.0, 200)
    strengths[:, 0], strengths[0, 1:] = [1.0, 0.0, 0.0, 0.0], 0.0
    gram = gram_of(strengths / strengths.sum(axis=0), Z, weight / weight.sum())
    local = LocalBasis.from_gram(gram, 4)
    assert_allclose(local.center[0], Z[:, 0], rtol=1e-12)
    assert_array_equal(local.spread[0], 0.05)


def test_local_basis_spares_the_gram_matrix_its_condition(rng):
    # Two narrow rules far apart: w_r and w_r z are parallel, (z - a) / h and one are not.
    Z = np.concatenate([rng.normal(-100.0, 1.0, 500), rng.normal(100.0, 1.0, 500)])[None]
    strengths = np.array([Z[0] < 0, Z[0] >= 0], dtype=float)
    gram = gram_of(strengths, Z, np.full(1000, 1e-3))
    assert np.linalg.cond(gram) > 1e7
    assert np.linalg.cond(LocalBasis.from_gram(gram, 2).transform_gram(gram)) < 1.5


def test_traces_of_large_matrices_are_exact_where_no_sign_matters(rng):
    # z' M^-1 A z is the trace for any signs z where M^-1 A is diagonal.
    diagonal, other = rng.uniform(0.5, 2.0, (2, 600))
    factor = NormalFactor(np.diag(diagonal))
    assert_allclose(factor.trace(np.diag(other)), np.sum(other / diagonal), rtol=1e-9)
    assert_allclose(factor.trace(np.diag(diagonal)), 600.0, rtol=1e-9)
    rows = np.diag(rng.normal(size=600))
    assert_allclose(factor.squares(rows), np.diag(rows) ** 2 / diagonal, rtol=1e-9)
    q, _ = np.linalg.qr(rng.normal(size=(600, 600)))
    dense = (q * np.geomspace(1.0, 1e-4, 600)) @ q.T
    assert_allclose(NormalFactor(dense).trace(dense), 600.0, rtol=1e-6)
