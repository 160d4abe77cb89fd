"""What tables of a posterior make of rows: against the dense product with the design."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.deviation import DerivativeRows, DeviationTables, narrowed
from skanfis.quadratic import QuadraticForm


@pytest.mark.parametrize("n_halves", [1, 4, 40])
@pytest.mark.parametrize("counts", [(2, 3, 4), (5,), ()])
def test_sides_of_a_design_that_is_not_formed_are_those_of_the_dense_one(counts, n_halves):
    rng, n_basis, n_premises = np.random.default_rng(0), 3, 2
    shares = [rng.dirichlet(np.ones(count), 20).T for count in counts]
    basis, design = rng.standard_normal((n_basis, 20)), np.ones((1, 20))
    for factor in (*shares, basis):
        design = (design[:, None] * factor).reshape(-1, 20)
    joint = rng.standard_normal((2, n_halves, n_premises + len(design)))
    form = QuadraticForm.of(np.eye(len(design)), counts, n_basis)
    unit, rulers = np.ones((2, 1)), np.ones((2, 2))
    none = np.zeros((2, 1))
    tables = DeviationTables(form, np.eye(len(design)), joint, unit, n_halves, rulers, none)
    given = np.vstack([np.empty((0, 20)), *shares]), basis
    for k, one in enumerate(joint):
        assert_allclose(tables.of_design(k, *given), one[:, n_premises:] @ design, atol=1e-12)


@pytest.mark.parametrize(("n_added", "tol", "n_left"), [(6, 1e-9, 5), (6, 0.05, 3), (0, 1.0, 0)])
def test_squares_without_weak_halves_are_off_by_no_more_than_was_asked(n_added, tol, n_left):
    """Halves of which two are small, one is nothing, and two that are taken off stay."""
    rng, n = np.random.default_rng(1), 200
    shares, basis = rng.dirichlet(np.ones(3), n).T, np.vstack([np.ones(n), rng.normal(size=n)])
    design = (shares[:, None] * basis).reshape(6, n)
    turn = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    sizes = np.array([1.0, 0.7, 0.4, 0.05, 0.02, 0.0])
    joint = np.stack(
        [
            np.vstack([(turn * sizes @ rng.normal(size=(6, 6)))[:n_added], rng.normal(size=(2, 6))])
            for _ in range(2)
        ]
    )
    form = QuadraticForm.of(np.eye(6), (3,), 2)
    unit = np.ones((2, 1))
    tables = DeviationTables(form, np.eye(6), joint, unit, n_added, np.ones((2, 1)), 0.0 * unit)
    row = DerivativeRows(shares, shares, basis, np.zeros((2, n)), [], [])
    weights = rng.uniform(0.1, 1.0, size=(2, n))
    short = tables.without_weak_halves(row, weights, tol)
    assert short.n_added == n_left
    for k in range(2):
        half, found = (one.of_design(k, shares, basis) for one in (tables, short))
        assert_allclose(found[short.n_added :], half[n_added:])
        wrong = short.signed(found, found) + short.constant[k] - tables.signed(half, half)
        assert (np.abs(wrong) * weights[k]).max() <= tol
        assert_allclose(np.average(wrong, weights=weights[k]), 0.0, atol=1e-12)
    assert_allclose(half, joint[1] @ design)


def test_narrow_shares_are_normal_numbers_and_so_are_products_of_four(rng):
    shares = 10.0 ** rng.uniform(-300.0, 0.0, (6, 200))
    shares[0] = 1.0
    assert narrowed(shares, np.float64) is shares
    narrow = narrowed(shares, np.float32)
    assert narrow.dtype == np.float32
    assert (narrow**4 >= np.finfo(np.float32).tiny).all()
    # Beside a sum of one, what was added is no digit.
    np.testing.assert_allclose(narrow, shares, rtol=1e-7, atol=np.finfo(np.float32).eps / 50)
