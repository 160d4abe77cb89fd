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


class Model:
    """Rows and rules; the strengths of the rules on every row, by hand."""

    def __init__(self, kind, order, n_outputs=1):
        g = np.random.default_rng(3)
        self.antecedent, self.order = BUILD[kind](g), order
        self.rows = oracles.bumpy_rows(g, 200, 2, n_outputs, weighted=True)
        self.Z = self.rows.inputs.apply(self.rows.X.T)
        self.y = (self.rows.y - self.rows.targets.offset) / self.rows.targets.scale
        self.share = self.rows.sample_weight / self.rows.sample_weight.sum()
        self.basis = np.vstack([np.ones((1, 200)), self.Z]) if order else np.ones((1, 200))
        self.w = oracles.strengths(self.antecedent, self.antecedent.parameters, self.Z)

    def solved(self, penalty):
        """Consequents on [1, z], (n_rules, n_basis, n_outputs)."""
        problem = SeparableProblem(self.rows, self.antecedent, self.order, penalty)
        found = problem.evaluate(self.antecedent.parameters).coefficients
        return found.reshape(len(self.w), len(self.basis), -1)


@pytest.mark.parametrize("kind", BUILD)
@pytest.mark.parametrize("order", [0, 1])
class TestWeightOfAgreement:
    def test_at_one_every_rule_is_a_regression_of_its_own(self, kind, order):
        model = Model(kind, order, 2)
        for rule, w in zip(model.solved(Penalty(agreement=1.0)), model.w, strict=True):
            own = LinearRegression(fit_intercept=False)
            own.fit(model.basis.T, model.y, sample_weight=w * model.share)
            assert_allclose(rule, own.coef_.T, rtol=1e-6, atol=1e-8)

    def test_without_end_all_rules_are_one_line(self, kind, order):
        model = Model(kind, order, 2)
        line = LinearRegression(fit_intercept=False)
        line.fit(model.basis.T, model.y, sample_weight=model.share)
        for rule in model.solved(Penalty(agreement=1e7)):
            assert_allclose(rule, line.coef_.T, atol=1e-5)


def test_pull_to_the_common_line_is_without_end_the_ridge_of_one_line():
    model = Model("grid", 1)
    ridge = Ridge(alpha=0.3, tol=1e-12).fit(model.Z.T, model.y[:, 0], model.share)
    for rule in model.solved(Penalty(alpha=1e7, slope=0.3)):
        assert_allclose(rule[:, 0], [ridge.intercept_, *ridge.coef_], atol=1e-5)
