"""Terms that are hardly true on any row, or wherever another is, by the memberships themselves."""

from dataclasses import replace

import numpy as np
import pytest

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent, TermGroup
from skanfis.learning.data import StandardisedData
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, has_idle_term
from skanfis.search.readable_terms import has_twin_terms


@pytest.mark.parametrize(("truth", "is_idle"), [(0.501, False), (0.499, True)])
def test_the_nearest_row_decides(truth, is_idle):
    x = np.linspace(0.0, 1.0, 50)[:, None]
    whole = StandardisedData.of(x, x)
    antecedent = grid_antecedent([Gaussian], (2,), Spacing(whole), 0.6)
    (low, high), (_, log_width) = antecedent.groups[0].theta
    # No row nearer to the upper term than this.
    last = high - np.exp(log_width) * np.sqrt(-2.0 * np.log(truth))
    z = np.linspace(low, last, 5000)[:, None]
    rows = replace(whole, X=whole.inputs.offset + whole.inputs.scale * z, y=z)
    assert has_idle_term(rows, antecedent) is is_idle


def test_a_search_leaves_no_term_in_a_gap():
    """A wave, and far from it a plateau."""
    rng = np.random.default_rng(0)
    gap = rng.uniform(2, 20)
    x = np.r_[rng.uniform(0, 1, 60), 1 + gap + rng.uniform(0, 1, rng.integers(1, 20))]
    y = np.sin(rng.uniform(2, 9) * x) * (x < 2) + rng.normal() * (x > 2)
    y += 0.01 * rng.normal(size=x.size)
    terms = ANFISRegressor().fit(x[:, None], y).memberships_
    assert all(np.abs((x - t["center"]) / t["width"]).min() < np.sqrt(2 * np.log(2)) for t in terms)


@pytest.mark.parametrize(("crossing", "are_twins"), [(0.899, False), (0.901, True)])
def test_terms_are_twins_where_they_cross_above_nine_tenths(crossing, are_twins):
    rows = StandardisedData.of(
        np.linspace(-1.0, 1.0, 50)[:, None], np.linspace(0.0, 1.0, 50)[:, None]
    )
    # Two Gaussians of one width cross halfway: exp(-(distance / width)^2 / 8).
    distance = np.sqrt(-8.0 * np.log(crossing))
    # The terms of an input may stand in any order.
    theta = np.array([[distance / 2, 3.0, -distance / 2], [0.0, -1.0, 0.0]])
    antecedent = GridAntecedent((TermGroup(Gaussian, np.zeros(3, dtype=int), theta),), counts=(3,))
    assert has_twin_terms(rows, antecedent) is are_twins
