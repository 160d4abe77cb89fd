"""Where training starts: rules that are given, their weights, and when terms are unbounded."""

import numpy as np

from skanfis.learning.data import StandardisedData
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, start


def of_grid(count, truth, rng, noise=0.0, n_rows=300):
    x = rng.uniform(-1.0, 1.0, (n_rows, 1))
    rows = StandardisedData.of(x, truth(x) + noise * rng.normal(size=x.shape))
    antecedent = grid_antecedent([Gaussian], [count], Spacing(rows))
    return rows, start.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)


def test_terms_have_no_bounds_where_data_are_next_to_exact(rng):
    rows, found = of_grid(2, lambda x: x > 0.2, rng, 0.01)
    assert found.is_free
    antecedent = found.antecedent
    premise = Premise.of(antecedent, *rows.inputs.box, is_free=True)
    low, high = antecedent.with_parameters(premise.parameters(found.displacement)).groups[0].theta.T
    # They cross where the step is, and the one gives way to the other within a twentieth.
    z = rows.inputs.apply(np.array([[0.15, 0.25]]), np.empty((1, 2)))[0]
    difference = [-0.5 * ((z - c) / np.exp(w)) ** 2 for c, w in (low, high)]
    assert (np.sign(difference[0] - difference[1]) == [1.0, -1.0]).all()


def test_terms_have_bounds_where_there_is_noise(rng):
    _, found = of_grid(3, lambda x: np.sin(3.0 * x), rng, 0.1)
    assert not found.is_free
