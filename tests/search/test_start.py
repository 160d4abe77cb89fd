"""Where training starts: rules that are given, their weights, and when terms are unbounded."""

import numpy as np

from skanfis.learning.data import StandardisedData
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import start
from skanfis.search.grid import Spacing, grid_antecedent

from .test_trials import plan_of


def of_grid(count, truth, rng, noise, weights=(), simplicity=0.0):
    x = rng.uniform(-1.0, 1.0, (300, 1))
    rows = StandardisedData.of(x, truth(x) + noise * rng.normal(size=x.shape))
    antecedent = grid_antecedent([Gaussian], [count], Spacing(rows))
    plan = plan_of(1, 300.0, weights)
    return rows, start.tuned_start(antecedent, rows, plan, simplicity)


def test_terms_have_no_bounds_where_data_are_next_to_exact(rng):
    rows, found = of_grid(2, lambda x: x > 0.2, rng, 0.01)
    assert found.is_unbounded
    antecedent = found.antecedent
    premise = Premise.of(antecedent, *rows.inputs.box, is_unbounded=True)
    low, high = antecedent.with_parameters(premise.parameters(found.displacement)).groups[0].theta.T
    # They cross where the step is, and the one gives way to the other within a twentieth.
    z = rows.inputs.apply(np.array([[0.15, 0.25]]))[0]
    difference = [-0.5 * ((z - c) / np.exp(w)) ** 2 for c, w in (low, high)]
    assert (np.sign(difference[0] - difference[1]) == [1.0, -1.0]).all()
    # Where there is noise they have.
    assert not of_grid(3, sine, rng, 0.1)[1].is_unbounded


def sine(x):
    return np.sin(3.0 * x)


def test_of_rules_that_are_given_simplicity_raises_the_agreement(rng):
    """What is told is the error before; an agreement that is given stays."""
    starts = []
    for simplicity in (0.0, 0.2, 0.5):
        rng = np.random.default_rng(1)
        starts.append(of_grid(3, sine, rng, 0.3, simplicity=simplicity)[1])
    assert len({start.candidates[0]["expected_error"] for start in starts}) == 1
    assert not starts[0].agreement_is_raised
    assert all(start.agreement_is_raised for start in starts[1:])
    agreements = [start.penalty.agreement for start in starts]
    assert 2.0 * agreements[0] < agreements[1] < agreements[2]
    _, given = of_grid(3, sine, rng, 0.3, weights={"agreement": 1e-3}, simplicity=0.5)
    assert given.penalty.agreement == 1e-3
    assert not given.agreement_is_raised
