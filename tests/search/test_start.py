"""Where training starts: rules that are given, their weights, and when terms are unbounded."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, imported_antecedent, start

from .. import oracles


def test_nothing_is_computed_where_no_weight_is_to_be_found(monkeypatch, two_rules):
    # Premises that stay where they are have no stiffness.
    monkeypatch.setattr(start, "search_sample", None)
    antecedent, rows = two_rules[0].antecedent, two_rules[0].rows
    weights = {"agreement": 0.1, "alpha": 0.01, "slope": 0.02}
    found = start.tuned_start(antecedent, rows, 1, np.arange(1), weights, premises_move=False)
    assert found.antecedent is antecedent
    assert found.penalty == Penalty(**weights, stiffness=0.0)


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
    assert found.expected_error < 0.05


@pytest.mark.parametrize(
    ("centers", "kind"),
    [([1.0, 3.0, 6.0], GridAntecedent), ([1.0, 6.0, 3.0], RuleTableAntecedent)],
)
@pytest.mark.parametrize("widths", [[3.0, 2.0, 1.0], [1.0, 2.0, 3.0]])
def test_terms_move_by_their_distances_where_they_are_in_order(centers, kind, widths, rng):
    rows = oracles.bumpy_rows(rng, 100)
    theta = np.array([centers, np.log(widths)])
    own = GridAntecedent.build([Gaussian] * 2, [0, 1], [theta, theta])
    found = imported_antecedent(SimpleNamespace(antecedent=own), rows)
    assert type(found) is kind
    Z, _, _ = rows.read(slice(None))
    expected = oracles.strengths(own, own.parameters, rows.X.T)
    assert_allclose(found.strengths(Z), expected, rtol=1e-8, atol=1e-12)
