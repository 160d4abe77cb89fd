"""What tables of a posterior make of rows: against the dense product with the design."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.deviation import DeviationTables
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
    tables = DeviationTables(form, np.eye(len(design)), joint, unit, n_halves, rulers)
    given = np.vstack([np.empty((0, 20)), *shares]), basis
    for k, one in enumerate(joint):
        assert_allclose(tables.of_design(k, *given), one[:, n_premises:] @ design, atol=1e-12)
