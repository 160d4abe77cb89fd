"""What parts of the departures cost, against means and differences; their sums: test_evidence."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent
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


@pytest.mark.parametrize("case", CASES)
def test_cost_and_solution_with_a_pull_for_every_part_are_those_of_the_dense_problem(case, rng):
    build, order, inputs = CASES[case]
    antecedent, used = build(rng), np.array(inputs, dtype=int)
    rows = oracles.bumpy_rows(rng, 80, 3, 2, True)
    plain = Penalty(agreement=0.01, alpha=0.02, slope=0.1)
    problem = SeparableProblem(rows, antecedent, plain, consequent_inputs=used)
    components = problem.common_line.components
    pulls = {one: 10.0 ** rng.uniform(-2.0, 2.0) for one in components}
    slope_pulls = {j: 10.0 ** rng.uniform(-2.0, 2.0) for j in inputs}
    penalty = replace(plain, pulls=pulls, slope_pulls=slope_pulls)
    problem = problem.with_penalty(penalty)
    dense = oracles.DenseProblem(rows, antecedent, order, penalty, used)
    parameters = antecedent.parameters
    assert_allclose(problem.evaluate(parameters).cost, dense.cost(parameters), rtol=1e-9)
    # At any consequents, as the solvers by gradients have it.
    beta = rng.normal(size=(problem.n_columns, 2))
    evaluation, _, slope = problem.joint(parameters, beta)
    assert_allclose(evaluation.cost, dense.cost_at(parameters, beta), rtol=1e-10)
    residuals = dense.residual_matrix(parameters)
    left = residuals @ beta - dense.right_side(len(residuals))
    assert_allclose(slope, residuals.T @ left, rtol=1e-8)
