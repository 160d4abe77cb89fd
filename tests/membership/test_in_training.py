"""Every family inside the training problem and the estimator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import MEMBERSHIPS

from .. import oracles
from ..quick import quick

FAMILIES = pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))


@pytest.mark.theory
@FAMILIES
def test_gradient_and_curvature_are_those_of_the_dense_problem(family):
    rng = np.random.default_rng(3)
    antecedent = oracles.random_grid(rng, [family] * 2, [2, 2])
    X = rng.uniform(-1.0, 1.0, (60, 2))
    rows = StandardisedData.of(X, np.sin(3.0 * X[:, :1]) * np.cos(2.0 * X[:, 1:]))
    # Some term reaches every row by the textbook: the dense problem has no floor.
    Z = ((rows.X - rows.inputs.offset) / rows.inputs.scale).T
    mu = oracles.memberships(antecedent, antecedent.parameters, Z).reshape(2, 2, -1)
    assert mu.max(axis=1).min() > 0.01
    penalty = Penalty(agreement=0.1, alpha=1e-4, slope=1e-3)
    problem = SeparableProblem(rows, antecedent, 1, penalty)
    dense = oracles.DenseProblem(rows, antecedent, 1, penalty)
    point = antecedent.parameters
    linearisation = problem.linearise(problem.evaluate(point))
    for found, expected in (
        (linearisation.gradient, dense.gradient(point)),
        (linearisation.gauss_newton, dense.gauss_newton(point)),
    ):
        # The floor of families with a foot is 1e-10, next to memberships of 0.01 or more.
        assert_allclose(found, expected, rtol=0, atol=3e-7 * np.abs(expected).max())


@pytest.mark.theory
@FAMILIES
def test_every_family_learns_a_smooth_surface(family, rng):
    def surface(X):
        return np.sin(2.5 * X[:, 0]) * np.exp(X[:, 1]) + 0.5 * X[:, 1] ** 2

    X, unseen = rng.uniform(-1.0, 1.0, (600, 2)), rng.uniform(-0.95, 0.95, (500, 2))
    y = surface(X) + 0.1 * rng.normal(size=600)
    model = quick(n_mfs=3, mf=family.name, agreement=1e-5).fit(X, y)
    error = np.sqrt(np.mean((model.predict(unseen) - surface(unseen)) ** 2))
    # A linear model: 0.5; the noise: 0.1; 27 coefficients from 600 rows cannot do better than 0.02.
    assert error < 0.05
    assert {term["function"] for term in model.memberships_} == {family.name}
