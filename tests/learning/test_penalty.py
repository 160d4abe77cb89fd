"""What consequents pay: sums over rows and rules by definition, and regressions by others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.linear_model import LinearRegression, Ridge

from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian

from .. import oracles

BUILD = {
    "grid": lambda g: oracles.random_grid(g, [Gaussian, Bell], [3, 2]),
    "scattered": lambda g: oracles.random_scattered(g, Gaussian, 4, [0, 1]),
    "table": lambda g: oracles.random_table(g, inputs=2),
}


def dense_and_solved(kind, order, penalty, n_outputs=2):
    """What the dense problem knows of rows and rules, and consequents on [1, z] of every rule."""
    g = np.random.default_rng(3)
    antecedent = BUILD[kind](g)
    rows = oracles.bumpy_rows(g, 200, 2, n_outputs, weighted=True)
    problem = SeparableProblem(rows, antecedent, penalty, consequent_inputs=np.arange(2 * order))
    found = problem.evaluate(antecedent.parameters)
    dense = oracles.DenseProblem(rows, antecedent, order, penalty)
    return dense, found.coefficients.reshape(dense.n_rules, len(dense.basis), -1)


@pytest.mark.parametrize("kind", BUILD)
@pytest.mark.parametrize("order", [0, 1])
class TestWeightOfAgreement:
    def test_at_one_every_rule_is_a_regression_of_its_own(self, kind, order):
        dense, solved = dense_and_solved(kind, order, Penalty(agreement=1.0))
        antecedent = dense.antecedent
        strengths = oracles.strengths(antecedent, antecedent.parameters, dense.Z)
        for rule, w in zip(solved, strengths, strict=True):
            own = LinearRegression(fit_intercept=False)
            own.fit(dense.basis.T, dense.y, sample_weight=w * dense.weight)
            assert_allclose(rule, own.coef_.T, rtol=1e-6, atol=1e-8)

    def test_without_end_all_rules_are_one_line(self, kind, order):
        dense, solved = dense_and_solved(kind, order, Penalty(agreement=1e7))
        line = LinearRegression(fit_intercept=False)
        line.fit(dense.basis.T, dense.y, sample_weight=dense.weight)
        for rule in solved:
            assert_allclose(rule, line.coef_.T, atol=1e-5)


def test_pull_to_the_common_line_is_without_end_the_ridge_of_one_line():
    dense, solved = dense_and_solved("grid", 1, Penalty(alpha=1e7, slope=0.3), n_outputs=1)
    ridge = Ridge(alpha=0.3, tol=1e-12).fit(dense.Z.T, dense.y[:, 0], dense.weight)
    for rule in solved:
        assert_allclose(rule[:, 0], [ridge.intercept_, *ridge.coef_], atol=1e-5)
