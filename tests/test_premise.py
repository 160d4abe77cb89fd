"""Displacements: what they mean, the order they keep, the box, and the chain rule through them."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, ScatteredAntecedent, TermGroup
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian
from skanfis.premise import Premise

from . import oracles

LOW, HIGH = np.array([-2.0, -3.0, -1.0]), np.array([2.5, 1.0, 4.0])
# As in the module.
MARGIN, FREE_MARGIN = 0.25, 1.0
FACTOR, RATIO, OUTER, UNIT = np.log(4.0), np.log(2.2), np.log(1.45), 3.0**0.5


def grid(families, counts, inputs=None):
    return oracles.random_grid(np.random.default_rng(1), families, counts, inputs)


def scattered(family, n_rules, inputs, is_listed=True):
    """Rules with terms of their own, all in different places."""
    g, inputs = np.random.default_rng(2), np.array(inputs)
    centers = g.uniform(LOW[inputs], HIGH[inputs], (n_rules, inputs.size))
    theta = family.from_center_and_width(centers, g.uniform(0.5, 1.5, centers.shape))
    own = ScatteredAntecedent.build(family, inputs, theta)
    # The same listed one by one, whose terms are in order on each input.
    return RuleTableAntecedent(own.groups, own.rule_terms) if is_listed else own


def shared_places(family):
    """Four terms on each of two inputs, two of the four in one place; one input with one term."""
    centers = np.array([[-1.0, 0.5, 0.5, 2.0], [-2.0, -2.0, 0.0, 0.5]])
    theta = family.from_center_and_width(centers, np.array([[1.0, 0.5, 0.8, 1.2]] * 2))
    groups = [TermGroup(family, np.full(4, j), theta[:, j]) for j in range(2)]
    groups.append(
        TermGroup(
            family, np.array([2]), family.from_center_and_width(np.array([1.5]), np.array([2.0]))
        )
    )
    table = np.array([[0, 4, 8], [1, 5, 8], [2, 6, 8], [3, 7, 8]])
    return RuleTableAntecedent(tuple(groups), table)


ORDERED = {
    "equal counts": grid([Gaussian] * 2, [3, 3], [0, 2]),
    "gaussians": grid([Gaussian] * 3, [2, 4, 3]),
    "bells": grid([Bell] * 2, [3, 2], [0, 2]),
    "families that alternate": grid([Bell, Gaussian, Bell], [2, 3, 4]),
    "scattered": scattered(Gaussian, 3, [0, 1, 2]),
    "scattered bells": scattered(Bell, 4, [1, 2]),
    **{name: grid([family] * 2, [2, 5], [0, 1]) for name, family in MEMBERSHIPS.items()},
}
ALONE = {
    "shared places": shared_places(Gaussian),
    "shared, bells": shared_places(Bell),
    "terms of their own": scattered(Gaussian, 3, [0, 1, 2], is_listed=False),
}
ANTECEDENTS = ORDERED | ALONE
ALL = pytest.mark.parametrize("antecedent", ANTECEDENTS.values(), ids=list(ANTECEDENTS))
ON_ORDERED = pytest.mark.parametrize("antecedent", ORDERED.values(), ids=list(ORDERED))
ON_ALONE = pytest.mark.parametrize("antecedent", ALONE.values(), ids=list(ALONE))
FREE_OR_NOT = pytest.mark.parametrize("is_free", [False, True])


def in_the_box(premise, rng, n=20):
    """Displacements inside the box, and at its corners."""
    inside = rng.uniform(premise.lower, premise.upper, (n, premise.size))
    corners = np.where(rng.random((n, premise.size)) < 0.5, premise.lower, premise.upper)
    return np.vstack([inside, corners, premise.lower, premise.upper])


def terms(antecedent, vector):
    """A vector laid out as the parameters, by input: families and columns from left to right."""
    by_input, start = {}, 0
    at_start = antecedent.parameters
    for group in antecedent.groups:
        shape = group.theta.shape
        block = vector[start : start + group.theta.size].reshape(shape)
        places = at_start[start : start + group.theta.size].reshape(shape)[0]
        start += group.theta.size
        for t, j in enumerate(group.inputs.tolist()):
            by_input.setdefault(j, []).append((places[t], group.family, block[:, t]))
    return {j: sorted(own, key=lambda term: term[0]) for j, own in by_input.items()}


def locations(antecedent, vector):
    return {j: np.array([t[0] for _, _, t in own]) for j, own in terms(antecedent, vector).items()}


def kind_of(antecedent):
    """Of every parameter, "location", "log_width" or "log_shape"."""
    kinds = [
        np.repeat([p.kind for p in group.family.parameters], group.n_terms)
        for group in antecedent.groups
    ]
    return np.concatenate(kinds)


def distances(places, start):
    """To the nearer and to the farther neighbour of each term, smooth, one by one."""
    near, far = [], []
    for k, place in enumerate(places):
        gaps = [abs(place - places[o]) for o in (k - 1, k + 1) if o in range(len(places))]
        # How far the outer ones have moved inward, twice.
        inward = [2.0 * (place - start[0])] * (k == 0) + [2.0 * (start[-1] - place)] * (
            k == len(places) - 1
        )
        near.append(sum(gap**-8.0 for gap in gaps) ** -0.125)
        far.append(sum(gap**8.0 for gap in [*gaps, *inward] if gap > 0.0) ** 0.125)
    return np.array(near), np.array(far)


def span(places, j, margin):
    """Where the terms of an input may stand."""
    low, high = min(LOW[j], places[0]), max(HIGH[j], places[-1])
    if margin == MARGIN:
        low = max(low, places[0] - (places[1] - places[0]))
        high = min(high, places[-1] + (places[-1] - places[-2]))
    beyond = margin * (places[-1] - places[0]) / (len(places) - 1)
    return low - beyond, high + beyond


@ALL
@FREE_OR_NOT
def test_displacement_zero_is_the_start(antecedent, is_free):
    premise = Premise.of(antecedent, LOW, HIGH, is_free)
    assert premise.size == antecedent.parameters.size
    zero = np.zeros(premise.size)
    assert_allclose(premise.parameters(zero), antecedent.parameters, rtol=1e-13, atol=1e-13)
    assert_allclose(premise.displacement(antecedent.parameters), 0.0, atol=1e-13)
    assert (premise.lower < 0.0).all()
    assert (premise.upper >= 0.0).all()


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
    for displacement in in_the_box(premise, rng, 25):
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


@ON_ALONE
def test_terms_that_share_a_place_move_by_themselves(antecedent, rng):
    premise, kinds = Premise.of(antecedent, LOW, HIGH), kind_of(antecedent)
    raw = antecedent.parameters
    unit = np.ones(raw.size)
    for own in terms(antecedent, np.arange(raw.size)).values():
        for _, _, t in own:
            location, width = int(t[0]), int(t[1])
            unit[location] = np.exp(raw[width])
    for displacement in in_the_box(premise, rng, 5):
        expected = raw + unit * displacement
        assert_allclose(premise.parameters(displacement), expected, rtol=1e-12, atol=1e-12)
    for edge, data, side in ((premise.lower, LOW, -1.0), (premise.upper, HIGH, 1.0)):
        assert_allclose(np.abs(edge[kinds != "location"]), FACTOR)
        for j, own in terms(antecedent, premise.parameters(edge)).items():
            # By one of its first width beyond the data.
            start = terms(antecedent, raw)[j]
            for (_, _, at_edge), (_, _, at_start) in zip(own, start, strict=True):
                assert_allclose(at_edge[0], data[j] + side * np.exp(at_start[1]), rtol=1e-12)


def test_term_beyond_the_data_may_stay_there():
    theta = Gaussian.from_center_and_width(np.array([9.0, 9.0]), np.ones(2))
    group = TermGroup(Gaussian, np.zeros(2, dtype=int), theta)
    premise = Premise.of(RuleTableAntecedent((group,), np.array([[0], [1]])), LOW, HIGH)
    assert_array_equal(premise.upper[:2], 0.0)
    assert_allclose(premise.parameters(premise.lower)[:2], LOW[0] - 1.0)


@ALL
@FREE_OR_NOT
def test_displacement_undoes_parameters(antecedent, is_free, rng):
    premise = Premise.of(antecedent, LOW, HIGH, is_free)
    for displacement in in_the_box(premise, rng, 10):
        found = premise.displacement(premise.parameters(displacement))
        assert_allclose(found, displacement, rtol=1e-9, atol=1e-9)


@ALL
def test_edge_comes_back_to_the_last_bit(antecedent, rng):
    # One bit off, and what is held by its edge would count as free to move.
    premise = Premise.of(antecedent, LOW, HIGH)
    is_gap = np.zeros(premise.size, dtype=bool)
    if antecedent in ORDERED.values():
        is_gap = kind_of(antecedent) == "location"
    for _ in range(20):
        inside = rng.uniform(0.5 * premise.lower, 0.5 * premise.upper)
        displacement = np.where(rng.random(premise.size) < 0.5, premise.upper, inside)
        displacement[is_gap] *= 0.5
        some = int(rng.integers(premise.size))
        displacement[some] = premise.lower[some]
        found = premise.displacement(premise.parameters(displacement))
        on_edge = (displacement == premise.lower) | (displacement == premise.upper)
        assert_array_equal(found[on_edge], displacement[on_edge])
        assert_allclose(found, displacement, rtol=1e-9, atol=1e-9)


def test_parameters_out_of_order_have_a_displacement_too():
    # As a step of Jang's leaves them: what cannot be is as near to it as may be.
    premise = Premise.of(ORDERED["gaussians"], LOW, HIGH)
    raw = ORDERED["gaussians"].parameters
    raw[0], raw[1] = raw[1], raw[0]
    found = premise.displacement(raw)
    assert np.isfinite(found).all()
    found = premise.parameters(np.clip(found, premise.lower, premise.upper))
    assert found[1] > found[0]


@pytest.mark.theory
@ALL
@FREE_OR_NOT
def test_pull_back_is_the_chain_rule(antecedent, is_free, rng):
    premise = Premise.of(antecedent, LOW, HIGH, is_free)
    gradient = rng.normal(size=premise.size)
    root = rng.normal(size=(premise.size, premise.size))
    for displacement in in_the_box(premise, rng, 2):
        jacobian = oracles.central_difference(premise.parameters, displacement, 1e-4)
        slope, curvature = premise.pull_back(displacement, gradient, root.T @ root)
        assert_allclose(slope, jacobian.T @ gradient, rtol=1e-8, atol=1e-8)
        half = root @ jacobian
        assert_allclose(curvature, half.T @ half, rtol=1e-7, atol=1e-7)


@ALL
def test_nothing_is_changed_in_place(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    displacement = rng.uniform(premise.lower, premise.upper)
    copies = displacement.copy(), antecedent.parameters.copy()
    parameters = premise.parameters(displacement)
    premise.displacement(parameters)
    premise.pull_back(displacement, np.ones(premise.size), np.eye(premise.size))
    assert_array_equal(displacement, copies[0])
    assert_array_equal(parameters, premise.parameters(displacement))
    assert_array_equal(antecedent.parameters, copies[1])


@pytest.mark.parametrize(("offset", "scale"), [(3.0, 1e-4), (-1e3, 1e5)])
def test_units_do_not_matter(offset, scale, rng):
    antecedent = ORDERED["gaussians"]
    moved = antecedent.change_units(np.full(3, offset), np.full(3, scale))
    one = Premise.of(antecedent, LOW, HIGH)
    other = Premise.of(moved, offset + scale * LOW, offset + scale * HIGH)
    assert_allclose(other.lower, one.lower, rtol=1e-6)
    assert_allclose(other.upper, one.upper, rtol=1e-6)
    for displacement in in_the_box(one, rng, 3):
        at = antecedent.with_parameters(one.parameters(displacement))
        expected = at.change_units(np.full(3, offset), np.full(3, scale)).parameters
        found = other.parameters(displacement)
        assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * scale)


def test_without_terms_there_is_nothing_to_move():
    premise = Premise.of(GridAntecedent((), counts=()), LOW, HIGH)
    assert premise.size == 0
    assert premise.parameters(np.empty(0)).size == 0
    assert premise.displacement(np.empty(0)).size == 0
