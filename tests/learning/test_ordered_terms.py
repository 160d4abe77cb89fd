"""Terms in order: where they may stand, how their widths go with their gaps, and what they say."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent
from skanfis.learning.ordered_terms import OrderedTerms, terms_of
from skanfis.learning.premise import Premise
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian, PiShaped, Triangular, TwoSidedGaussian

from ..premises import (
    FACTOR,
    FREE_MARGIN,
    FREE_OR_NOT,
    HIGH,
    LOW,
    MARGIN,
    ON_ORDERED,
    OUTER,
    RATIO,
    UNIT,
    distances,
    in_the_box,
    kind_of,
    locations,
    span,
    terms,
)


@ON_ORDERED
@FREE_OR_NOT
def test_terms_stay_in_order_and_where_the_data_are(antecedent, is_free, rng):
    premise = Premise.of(antecedent, LOW, HIGH, is_free)
    start = locations(antecedent, antecedent.parameters)
    for displacement in in_the_box(premise, rng):
        for j, places in locations(antecedent, premise.parameters(displacement)).items():
            low, high = span(start[j], j, FREE_MARGIN if is_free else MARGIN)
            assert (np.diff(np.concatenate([[low], places, [high]])) > 0.0).all()


@ON_ORDERED
def test_gaps_are_what_moves(antecedent, rng):
    # Of their logarithms only differences count: the sum of all gaps is the range.
    premise = Premise.of(antecedent, LOW, HIGH)
    start = locations(antecedent, antecedent.parameters)
    at = np.cumsum(np.ones(premise.size)) - 1.0
    for displacement in in_the_box(premise, rng, 5):
        for j, places in locations(antecedent, premise.parameters(displacement)).items():
            ends = span(start[j], j, MARGIN)
            changes = [
                np.log(np.diff(np.concatenate([ends[:1], p, ends[1:]]))) for p in (places, start[j])
            ]
            change = changes[0] - changes[1]
            own = np.array([int(t[0]) for _, _, t in terms(antecedent, at)[j]])
            assert_allclose(np.diff(change), UNIT * displacement[own], rtol=1e-7, atol=1e-9)


@ON_ORDERED
def test_widths_of_free_terms_go_with_the_nearer_neighbour(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH, is_free=True)
    raw = antecedent.parameters
    for displacement in in_the_box(premise, rng, 3):
        moved, by_hand = (
            terms(antecedent, v) for v in (premise.parameters(displacement), raw + displacement)
        )
        start = locations(antecedent, raw)
        for j, own in moved.items():
            places = np.array([t[0] for _, _, t in own])
            growth = np.log(distances(places, start[j])[0] / distances(start[j], start[j])[0])
            for (_, family, found), (_, _, expected), widening in zip(
                own, by_hand[j], growth, strict=True
            ):
                kinds = np.array([p.kind for p in family.parameters])
                expected = expected + np.where(kinds == "log_width", widening, 0.0)
                assert_allclose(found[1:], expected[1:], rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("counts", [2, 3, 5])
def test_widths_stand_between_half_true_at_half_the_way_and_hardly_told_apart(counts, rng):
    places = np.sort(np.linspace(-1.5, 2.0, counts) + rng.uniform(-0.02, 0.02, counts))
    theta = Gaussian.start(places, np.full(counts, 3.5 / (counts - 1)), 0.6)
    premise = Premise.of(GridAntecedent.build([Gaussian], [0], [theta]), LOW[:1], HIGH[:1])
    # Half true, or 0.9 true, at half the distance.
    least, most = (1.0 / np.sqrt(-8.0 * np.log(truth)) for truth in (0.5, 0.9))
    for displacement in in_the_box(premise, rng, 5):
        found = premise.parameters(displacement).reshape(2, counts)
        near, far = distances(found[0], places)
        ends = np.log(least * far), np.log(most * near)
        x = displacement[counts:]
        between = (x - premise.lower[counts:]) / (premise.upper - premise.lower)[counts:]
        # The ends are looked for on a grid.
        expected = (1.0 - between) * ends[0] + between * ends[1]
        assert_allclose(found[1], expected, atol=0.02)


@pytest.mark.parametrize("counts", [2, 3, 4, 6])
def test_some_term_is_true_wherever_there_are_rows(counts, rng):
    places = np.linspace(LOW[0], HIGH[0], counts)
    theta = Gaussian.start(places, np.full(counts, places[1] - places[0]), 0.6)
    premise = Premise.of(GridAntecedent.build([Gaussian], [0], [theta]), LOW[:1], HIGH[:1])
    x = np.linspace(LOW[0], HIGH[0], 400)[None]
    widths = kind_of(premise.antecedent) == "log_width"
    least = []
    for displacement in in_the_box(premise, rng, 40):
        for d in (displacement, np.where(widths, premise.lower, displacement)):
            antecedent = premise.antecedent.with_parameters(premise.parameters(d))
            least.append(np.exp(antecedent.log_memberships(x)).max(axis=0).min())
    assert min(least) > 0.48
    # The bound is not idle.
    assert min(least) < 0.55


def crossing(left, right):
    """The greatest min(mu, mu) of two terms, on a fine grid around them."""
    (_, one, theta), (_, other, phi) = left, right
    reach = 3.0 * (phi[0] - theta[0])
    x = np.linspace(theta[0] - reach, phi[0] + reach, 2001)[None]
    mu = [family.log_value(x, t[:, None])[0] for family, t in ((one, theta), (other, phi))]
    return np.exp(np.minimum(*mu).max())


def on_flanks(left, right):
    """The same of terms that are true to one side for good: the truth of the one that falls."""
    middle = np.array([[0.5 * (left[2][0] + right[2][0])]])
    return min(float(family.value(middle, t[:, None])[0, 0]) for _, family, t in (left, right))


PLACES = {
    "two": np.array([-2.0, 2.5]),
    "even": np.linspace(-2.0, 2.5, 5),
    "uneven": np.array([-1.5, -1.2, 0.3, 2.0]),
}


@pytest.mark.theory
@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
@pytest.mark.parametrize("places", PLACES.values(), ids=list(PLACES))
@pytest.mark.parametrize("overlap", [0.4, 0.6])
def test_neighbours_can_be_told_apart_anywhere_in_the_box(family, places, overlap, rng):
    theta = family.start(places, distances(places, places)[0], overlap)
    antecedent = GridAntecedent.build([family], [0], [theta])
    premise = Premise.of(antecedent, LOW[:1], HIGH[:1])
    truth = on_flanks if family.name in {"s_shaped", "z_shaped"} else crossing
    widths = kind_of(antecedent) == "log_width"
    highest = []
    for displacement in in_the_box(premise, rng, 10):
        # With all widths at their most too: between, terms are narrower.
        for x in (displacement, np.where(widths, premise.upper, displacement)):
            (own,) = terms(antecedent, premise.parameters(x)).values()
            highest += [truth(*pair) for pair in pairwise(own)]
    assert max(highest) <= 0.9 + 1e-3
    # The bound is not idle: terms may overlap far more than at the start.
    assert max(highest) > overlap + 0.1


@ON_ORDERED
def test_box_of_ordered_terms(antecedent):
    premise, kinds = Premise.of(antecedent, LOW, HIGH), kind_of(antecedent)
    start = locations(antecedent, antecedent.parameters)
    at = np.cumsum(np.ones(premise.size)) - 1.0
    for j, own in terms(antecedent, at).items():
        own = np.array([int(t[0]) for _, _, t in own])
        ends = span(start[j], j, MARGIN)
        ratios = np.diff(np.log(np.diff(np.concatenate([ends[:1], start[j], ends[1:]]))))
        low, high = np.full(ratios.size, -RATIO), np.full(ratios.size, RATIO)
        low[0], high[-1] = -OUTER, OUTER
        high[0], low[-1] = ratios[0] + FACTOR, ratios[-1] - FACTOR
        # What is out of bounds at the start can just move.
        low, high = np.minimum(low, ratios - 0.01), np.maximum(high, ratios + 0.01)
        assert_allclose(premise.lower[own], (low - ratios) / UNIT, rtol=1e-9)
        assert_allclose(premise.upper[own], (high - ratios) / UNIT, rtol=1e-9)
    assert (premise.lower[kinds == "log_width"] < 0.0).all()
    assert (premise.upper[kinds == "log_width"] <= FACTOR).all()
    assert_array_equal(premise.lower[kinds == "log_shape"], -FACTOR)
    # Sharper corners make a term truer next to its neighbour.
    assert_array_equal(premise.upper[kinds == "log_shape"], np.log(1.5))


@ON_ORDERED
def test_free_terms_may_be_four_times_as_wide_and_leave_the_data(antecedent):
    premise = Premise.of(antecedent, LOW, HIGH, is_free=True)
    assert_array_equal(premise.lower, -FACTOR)
    assert_array_equal(premise.upper, FACTOR)
    # The further gap at its least: the outermost term is beyond what it may otherwise reach.
    start = locations(antecedent, antecedent.parameters)
    x = np.zeros(premise.size)
    at = np.cumsum(np.ones(premise.size)) - 1.0
    for j, places in start.items():
        own = np.array([int(t[0]) for _, _, t in terms(antecedent, at)[j]])
        ends = span(places, j, FREE_MARGIN)
        gaps = np.diff(np.concatenate([ends[:1], places, ends[1:]]))
        change = np.zeros(gaps.size)
        change[-1] = -5.0
        basis = np.linalg.svd(np.ones((1, gaps.size)))[2][1:].T
        x[own] = np.clip(basis.T @ change, -FACTOR, FACTOR)
    moved = locations(antecedent, premise.parameters(x))
    for j, places in moved.items():
        assert places[-1] > span(start[j], j, MARGIN)[1] or places[-1] > start[j][-1]
        assert places[-1] < span(start[j], j, FREE_MARGIN)[1]


def bounds_of_widths(family, theta):
    """Lowest and highest displacement of every width of terms of one input, (n_widths, n_terms)."""
    premise = Premise.of(GridAntecedent.build([family], [0], [theta]), LOW[:1], HIGH[:1])
    is_width = [parameter.kind == "log_width" for parameter in family.parameters]
    lower, upper = (ends.reshape(theta.shape)[is_width] for ends in (premise.lower, premise.upper))
    return lower, upper


@pytest.mark.parametrize("turned", [False, True])
def test_the_narrower_flank_says_how_narrow_a_term_may_be(turned):
    places = np.linspace(LOW[0], HIGH[0], 4)
    narrow, wide = np.log(1.9), np.log(2.1)
    theta = np.stack([places, np.full(4, narrow), np.full(4, wide)])
    theta = theta[[0, 2, 1]] if turned else theta
    lower, _ = bounds_of_widths(Triangular, theta)
    # Half true half-way to the farther neighbour: as wide as that is far.
    expected = np.log(distances(places, places)[1]) - narrow
    assert_allclose(lower, [expected, expected], atol=0.015)


def test_where_one_term_has_no_room_all_widths_go_with_the_nearer_neighbour():
    places = np.linspace(LOW[0], HIGH[0], 3)
    theta = Gaussian.start(places, np.full(3, places[1] - places[0]), 0.6)
    as_gaussians = -0.5 * np.log(np.log(0.5) / np.log(0.6))
    for family in (Bell, TwoSidedGaussian, PiShaped):
        flat = family.start(places, np.full(3, places[1] - places[0]), 0.6)
        lower, _ = bounds_of_widths(family, flat)
        assert_allclose(lower, as_gaussians, rtol=1e-3)
    # One flank of one term is three times as wide as the other: where both are at their widest it
    # is too true next to its neighbour, and where they are at their narrowest not true enough.
    theta = Triangular.start(places, np.full(3, places[1] - places[0]), 0.6)
    room, _ = bounds_of_widths(Triangular, theta)
    assert (np.abs(room - as_gaussians) > 0.01).all()
    theta[1, 1] += np.log(3.0)
    lower, _ = bounds_of_widths(Triangular, theta)
    assert_allclose(lower, as_gaussians, rtol=1e-3)


def test_ends_of_a_width_never_meet(rng):
    places = np.linspace(LOW[0], HIGH[0], 3)
    theta = Gaussian.start(places, np.full(3, places[1] - places[0]), 0.6)
    antecedent = GridAntecedent.build([Gaussian], [0], [theta])
    raw, span = antecedent.parameters, 0.3
    row = OrderedTerms.of(terms_of(antecedent), raw, LOW[0], HIGH[0], is_free=False)
    row = row.between(np.full(3, -0.1), np.full(3, span - 0.1))

    def widening(x):
        return row.widening(x, row.gaps(x))

    least = []
    for x in rng.uniform(-1.5, 1.5, (20, raw.size)):
        _, by_location, own = row.jacobian(x)
        least.append(own.min())
        step = 1e-6
        for j, location in enumerate(row.locations):
            ahead = step * (np.arange(raw.size) == location)
            slope = (widening(x + ahead) - widening(x - ahead)) / (2 * step)
            assert_allclose(by_location[:, j], slope, atol=1e-7)
        for k, width in enumerate(row.widths):
            ahead = step * (np.arange(raw.size) == width)
            slope = (
                (x + ahead)[width]
                - (x - ahead)[width]
                + (widening(x + ahead) - widening(x - ahead))[k]
            )
            assert_allclose(own[k], slope / (2 * step), atol=1e-7)
    # A tenth of what a width is free to do alone, and this is not idle.
    assert_allclose(min(least), 0.1)
