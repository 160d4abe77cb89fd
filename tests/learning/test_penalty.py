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
ON_ALL = pytest.mark.parametrize("kind", BUILD)
ALL_AT_ONCE = Penalty(agreement=0.3, alpha=0.02, slope=0.1)
ORDERS = pytest.mark.parametrize("order", [0, 1])


class Model:
    """Rows, rules and any consequents; the strengths of the rules on every row, by hand."""

    def __init__(self, kind, order, n_outputs=1):
        g = np.random.default_rng(3)
        self.antecedent, self.order = BUILD[kind](g), order
        self.rows = oracles.bumpy_rows(g, 200, 2, n_outputs, weighted=True)
        self.Z = self.rows.inputs.apply(self.rows.X.T, np.empty((2, 200)))
        self.y = (self.rows.y - self.rows.targets.offset) / self.rows.targets.scale
        self.share = self.rows.sample_weight / self.rows.sample_weight.sum()
        self.basis = np.vstack([np.ones((1, 200)), self.Z]) if order else np.ones((1, 200))
        self.w = oracles.strengths(self.antecedent, self.antecedent.parameters, self.Z)
        shape = (self.antecedent.n_rules, self.basis.shape[0], n_outputs)
        self.beta = g.normal(size=shape)

    def problem(self, penalty):
        return SeparableProblem(self.rows, self.antecedent, self.order, penalty)

    def evaluate(self, penalty):
        return self.problem(penalty).evaluate(self.antecedent.parameters)


@ON_ALL
@ORDERS
class TestWeightOfAgreement:
    def test_at_one_every_rule_is_a_regression_of_its_own(self, kind, order):
        model = Model(kind, order, 2)
        solved = model.evaluate(Penalty(agreement=1.0)).coefficients.reshape(model.beta.shape)
        for r, w in enumerate(model.w):
            own = LinearRegression(fit_intercept=False)
            own.fit(model.basis.T, model.y, sample_weight=w * model.share)
            assert_allclose(solved[r], own.coef_.T, rtol=1e-6, atol=1e-8)

    def test_without_end_all_rules_are_one_line(self, kind, order):
        model = Model(kind, order, 2)
        solved = model.evaluate(Penalty(agreement=1e7)).coefficients.reshape(model.beta.shape)
        line = LinearRegression(fit_intercept=False)
        line.fit(model.basis.T, model.y, sample_weight=model.share)
        for rule in solved:
            assert_allclose(rule, line.coef_.T, atol=1e-5)


class TestCommonLine:
    def test_pull_is_without_end_the_ridge_of_one_line(self):
        model = Model("grid", 1)
        solved = model.evaluate(Penalty(alpha=1e7, slope=0.3)).coefficients.reshape(6, 3)
        ridge = Ridge(alpha=0.3, tol=1e-12).fit(model.Z.T, model.y[:, 0], model.share)
        assert_allclose(solved, np.tile([ridge.intercept_, *ridge.coef_], (6, 1)), atol=1e-5)
