"""Quadratic forms of rows of the design: against the dense product, and with pairs left out."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent
from skanfis.membership import Gaussian, Triangular
from skanfis.quadratic import QuadraticForm


def rows_of_grid(family, counts, Z):
    """Shares, basis and dense design of a grid over [-1, 1], two inputs."""
    thetas = [family.start(np.linspace(-1, 1, m), np.full(m, 2 / (m - 1)), 0.5) for m in counts]
    antecedent = GridAntecedent.build([family] * 2, [0, 1], thetas)
    strengths, shares = antecedent.strengths_and_shares(Z)
    basis = np.vstack([np.ones(Z.shape[1]), Z])
    return shares, basis, (strengths[:, None] * basis).reshape(-1, Z.shape[1])


@pytest.mark.parametrize(("family", "at_most"), [(Gaussian, 13 * 6), (Triangular, 11 * 5)])
def test_form_is_that_of_the_dense_design_and_stays_it_in_fewer_pairs(family, at_most):
    rng, counts = np.random.default_rng(0), (6, 3)
    half = rng.standard_normal((54, 54)) / 10.0
    form = QuadraticForm.of(half.T @ half, counts, 3)
    even = rng.permuted(np.tile(np.linspace(-1, 1, 128), (2, 1)), axis=1)
    short = form.shortened(*rows_of_grid(family, counts, even)[:2], 1e-5)
    shares, basis, design = rows_of_grid(family, counts, rng.uniform(-1, 1, (2, 500)))
    expected = np.sum((half @ design) ** 2, axis=0)
    assert form.table.size == 21 * 6 * 6
    assert_allclose(form.values(shares, basis), expected, rtol=1e-12)
    assert short.table.size <= at_most * 6
    assert_allclose(short.values(shares, basis), expected, atol=3e-5)


@pytest.mark.parametrize("counts", [(6, 2), (2, 5)])
def test_products_with_another_basis_and_of_several_forms(counts):
    rng, size = np.random.default_rng(2), 3 * counts[0] * counts[1]
    halves = rng.standard_normal((2, size, size))
    forms = [QuadraticForm.of(half.T @ half, counts, 3) for half in halves]
    shares, basis, design = rows_of_grid(Gaussian, counts, rng.uniform(-1, 1, (2, 50)))
    psi = rng.standard_normal((3, 50))
    other = (design.reshape(-1, 3, 50)[:, :1] * psi).reshape(size, 50)
    expected = [
        np.sum((halves[0] @ a) * (halves[0] @ b), axis=0)
        for a, b in ((design, design), (design, other), (other, other))
    ]
    assert_allclose(forms[0].products(shares, basis, psi), expected, rtol=1e-9, atol=1e-9)
    both = QuadraticForm.of(halves.swapaxes(1, 2) @ halves, counts, 3).values(shares, basis)
    assert_allclose(both, [np.sum((half @ design) ** 2, axis=0) for half in halves], rtol=1e-11)


def test_of_scattered_rules_with_more_pairs_than_points_all_are_kept():
    rng = np.random.default_rng(1)
    shares = rng.dirichlet(np.ones(5), 20).T
    form = QuadraticForm.of(np.eye(5), (5,), 1)
    short = form.shortened(shares, np.ones((1, 20)), 1.0)
    assert (short.table == form.table).all()
    assert_allclose(short.values(shares, np.ones((1, 20))), np.sum(shares**2, axis=0))


def test_turned_form_takes_what_the_weighted_values_need():
    """A table over three functions of six pairs, which no choice of pairs spans."""
    rng, n = np.random.default_rng(3), 400
    shares = rng.dirichlet(np.ones(3), n).T
    basis = np.vstack([np.ones(n), rng.normal(size=(7, n))])
    mix = rng.normal(size=(6, 3)) @ rng.normal(size=(3, 36))
    full = QuadraticForm.of(np.eye(24), (3,), 8)
    form = replace(full, table=mix + 1e-4 * rng.normal(size=mix.shape))
    weights = rng.uniform(0.5, 1.0, n)
    short = form.turned(shares, basis, weights, 0.05)
    assert short.table.size == 3 * 36 < form.table.size
    wrong = short.values(shares, basis) - form.values(shares, basis)
    assert 0.0 < np.sqrt(np.mean((wrong * weights) ** 2)) < 0.05
    same = form.turned(shares, basis, weights, 0.0)
    assert same.table.size == form.table.size
    single = short.astype(np.float32)
    narrow = single.values(shares.astype(np.float32), basis.astype(np.float32))
    assert narrow.dtype == np.float32
    assert_allclose(narrow, short.values(shares, basis), rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("counts", [(6, 2), (4,), ()])
def test_weighted_sum_of_bilinear_forms_is_that_of_the_dense_designs(counts):
    rng, n = np.random.default_rng(4), 30
    shares = [rng.dirichlet(np.ones(count), n).T for count in counts]
    basis, others = rng.normal(size=(2, 3, n))
    strengths = np.ones((1, n))
    for share in shares:
        strengths = (strengths[:, None] * share).reshape(-1, n)
    phi, psi = ((strengths[:, None] * one).reshape(-1, n) for one in (basis, others))
    matrices, weights = rng.normal(size=(2, len(phi), len(phi))), rng.normal(size=(2, n))
    form = QuadraticForm.between(matrices, counts, 3)
    found = form.summed_between(weights, np.vstack([np.empty((0, n)), *shares]), basis, others)
    expected = np.einsum("mn,in,mij,jn->n", weights, phi, matrices, psi)
    assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
