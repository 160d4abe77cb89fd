"""Terms in order: where they may stand, how their widths go with their gaps, and what they say."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import GridAntecedent
from skanfis.learning.premise import Premise
from skanfis.membership import MEMBERSHIPS

from ..premises import (
    HIGH,
    LOW,
    MARGIN,
    ON_ORDERED,
    UNIT,
    distances,
    in_the_box,
    kind_of,
    locations,
    span,
    terms,
)


@ON_ORDERED
def test_terms_stay_in_order_where_the_data_are_and_gaps_are_what_moves(antecedent, rng):
    # Of their logarithms only differences count: the sum of all gaps is the range.
    premise = Premise.of(antecedent, LOW, HIGH)
    start = locations(antecedent, antecedent.parameters)
    at = np.cumsum(np.ones(premise.size)) - 1.0
    for displacement in in_the_box(premise, rng):
        for j, places in locations(antecedent, premise.parameters(displacement)).items():
            low, high = span(start[j], j, MARGIN)
            gaps, before = (np.diff([low, *own, high]) for own in (places, start[j]))
            assert (gaps > 0.0).all()
            change = np.log(gaps) - np.log(before)
            own = np.array([int(t[0]) for _, _, t in terms(antecedent, at)[j]])
            assert_allclose(np.diff(change), UNIT * displacement[own], rtol=1e-7, atol=1e-9)


@ON_ORDERED
def test_widths_go_with_the_mean_distance_to_the_neighbours(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    raw = antecedent.parameters
    for displacement in in_the_box(premise, rng, 3):
        moved = terms(antecedent, premise.parameters(displacement))
        by_hand = terms(antecedent, raw + displacement)
        start = locations(antecedent, raw)
        for j, own in moved.items():
            growth = np.log(distances(np.array([t[0] for _, _, t in own])) / distances(start[j]))
            every = zip(own, by_hand[j], growth, strict=True)
            for (_, family, found), (_, _, expected), widening in every:
                kinds = np.array([p.kind for p in family.parameters])
                expected = expected + np.where(kinds == "log_width", widening, 0.0)
                assert_allclose(found[1:], expected[1:], rtol=1e-10, atol=1e-10)


def truth_between(left, right):
    """The truth half-way of the one that falls there (of most families, both do)."""
    middle = np.array([[0.5 * (left[2][0] + right[2][0])]])
    return min(float(family.value(middle, t[:, None])[0, 0]) for _, family, t in (left, right))


@pytest.mark.theory
@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
@pytest.mark.parametrize("overlap", [0.4, 0.6])
def test_neighbours_as_far_apart_as_at_the_start_can_be_told_apart(family, overlap):
    places = np.linspace(-2.0, 2.5, 5)
    theta = family.start(places, distances(places), overlap)
    antecedent = GridAntecedent.build([family], [0], [theta])
    premise = Premise.of(antecedent, LOW[:1], HIGH[:1])
    at_most = np.where(kind_of(antecedent) == "log_width", premise.upper, 0.0)
    (own,) = terms(antecedent, premise.parameters(at_most)).values()
    highest = max(truth_between(*pair) for pair in pairwise(own))
    assert overlap + 0.1 < highest <= 0.9 + 1e-3
