"""The error of rows left out, against the dense design at the nearest points of the box."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian
from skanfis.search import held_out

from .. import oracles


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("consequent_inputs", [[0, 1], [1]])
def test_rows_beyond_the_range_count_at_its_edge(monkeypatch, weighted, consequent_inputs):
    monkeypatch.setattr(held_out, "BLOCK_ROWS", 7)
    g = np.random.default_rng(4)
    rows, used = oracles.bumpy_rows(g, 200, 2, 2, weighted), np.array(consequent_inputs)
    antecedent = oracles.random_grid(g, [Gaussian, Bell], [3, 2])
    problem = SeparableProblem(rows, antecedent, 1, Penalty(alpha=1e-3), consequent_inputs=used)
    evaluation = problem.evaluate(antecedent.parameters)
    # On either side of the box of every input, and in it.
    low, high = rows.inputs.minimum, rows.inputs.maximum
    X = low + (high - low) * g.uniform(-0.5, 1.5, (100, 2))
    weight = g.uniform(0.5, 2.0, 100) if weighted else None
    rest = StandardisedData(X, g.normal(size=(100, 2)), weight, rows.inputs, rows.targets)
    at_edge = rest.inputs.apply(np.clip(X, low, high).T, np.empty((2, 100)))
    design = oracles.dense_design(antecedent, antecedent.parameters, at_edge, 1, used)
    target = (rest.y - rows.targets.offset) / rows.targets.scale
    squares = ((target - design @ evaluation.coefficients) ** 2).sum(axis=1)
    expected = np.average(squares, weights=weight)
    assert_allclose(held_out.held_out_loss(rest, used, evaluation), expected, rtol=1e-9)
