"""Parts of the departures, against means and differences."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent
from skanfis.consequent import NormalFactor
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian

from .. import oracles

CASES = {
    # Rules, order, and the inputs of the consequents, of three.
    "grid": (lambda g: oracles.random_grid(g, [Gaussian] * 2, [3, 2], [0, 2]), 1, [0, 1, 2]),
    "grid of three": (lambda g: oracles.random_grid(g, [Bell] * 3, [2, 3, 2]), 1, [0, 1, 2]),
    "one input, slopes of others": (lambda g: oracles.random_grid(g, [Gaussian], [4], [1]), 1, [0]),
    "constants": (lambda g: oracles.random_grid(g, [Gaussian] * 3, [2, 2, 3]), 0, []),
    "one rule": (lambda g: GridAntecedent((), counts=()), 1, [0, 1, 2]),
    "scattered": (lambda g: oracles.random_scattered(g, Gaussian, 4, [0, 1]), 1, [0, 2]),
    "table": (lambda g: oracles.random_table(g, inputs=2), 1, [0, 1, 2]),
}
ON_ALL = pytest.mark.parametrize("case", CASES)


class Problem:
    def __init__(self, case):
        g = np.random.default_rng(7)
        build, order, inputs = CASES[case]
        self.antecedent, self.inputs = build(g), np.array(inputs, dtype=int)
        self.rows = oracles.bumpy_rows(g, 80, 3, 2, True)
        plain = Penalty(agreement=0.01, alpha=0.02, slope=0.1)
        problem = SeparableProblem(
            self.rows, self.antecedent, order, plain, consequent_inputs=self.inputs
        )
        self.line = problem.common_line
        self.departures = self.line.departures
        self.components = self.departures.components
        pulls = {one: 10.0 ** g.uniform(-2.0, 2.0) for one in self.components}
        slope_pulls = {j: 10.0 ** g.uniform(-2.0, 2.0) for j in inputs}
        penalty = replace(plain, pulls=pulls, slope_pulls=slope_pulls)
        self.problem = problem.with_penalty(penalty)
        self.dense = oracles.DenseProblem(self.rows, self.antecedent, order, penalty, self.inputs)


@ON_ALL
class TestComponents:
    def test_they_are_those_of_means_and_differences(self, case):
        one = Problem(case)
        values = np.zeros((one.problem.n_columns,) * 2)
        for r, block in enumerate(one.dense.blocks):
            own = slice(r * len(block), (r + 1) * len(block))
            values[own, own] = block
        to_line, *_ = np.linalg.lstsq(one.dense.line, values, rcond=None)
        departures = values - one.dense.line @ to_line
        parts = oracles.departure_projectors(one.antecedent, one.inputs.tolist())
        assert set(one.components) == set(parts)
        g = np.random.default_rng(0)
        beta = g.normal(size=(one.problem.n_columns, 2))
        local = one.problem.local.to_local(beta)
        expected = [np.sum((parts[key] @ departures @ beta) ** 2) for key in one.components]
        n_slopes = len(one.line.slopes)
        squares = one.line.squares(local)
        assert_allclose(squares[n_slopes:], expected, rtol=1e-9, atol=1e-12)
        slopes = np.sum((one.line.to_slopes @ local) ** 2, axis=1)
        assert_allclose(squares[:n_slopes], slopes, rtol=1e-12)
        # All of them together are all that there is.
        assert_allclose(sum(expected), np.sum((departures @ beta) ** 2), rtol=1e-10, atol=1e-14)
        together = np.sum(local * (one.departures.together @ local))
        assert_allclose(together, sum(expected), rtol=1e-9, atol=1e-12)

    def test_cost_and_solution_are_those_of_the_dense_problem(self, case):
        one = Problem(case)
        parameters = one.antecedent.parameters
        found = one.problem.evaluate(parameters)
        assert_allclose(found.cost, one.dense.cost(parameters), rtol=1e-9)
        # At any consequents, as the solvers by gradients have it.
        g = np.random.default_rng(1)
        beta = g.normal(size=(one.problem.n_columns, 2))
        joint = one.problem.joint(parameters, beta)
        residuals = one.dense.residual_matrix(parameters)
        right = one.dense.right_side(len(residuals))
        expected = 0.5 * np.sum((residuals @ beta - right) ** 2)
        assert_allclose(joint.evaluation.cost, expected, rtol=1e-10)
        assert_allclose(joint.coefficients, residuals.T @ (residuals @ beta - right), rtol=1e-8)

    def test_traces_are_sums_over_the_columns_of_a_root(self, case):
        one = Problem(case)
        n, g = one.problem.n_columns, np.random.default_rng(2)
        root = np.tril(g.normal(size=(n, n)) / n) + np.eye(n)
        # Columns of a root of M^-1 are directions whose squares add up.
        expected = one.line.squares(np.linalg.inv(root).T)
        factor = NormalFactor(root @ root.T)
        assert_allclose(one.line.traces(factor), expected, rtol=1e-9, atol=1e-12)
