"""Displacements: what they mean, the order they keep, the box, and the chain rule through them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, ScatteredAntecedent
from skanfis.membership import Bell, Gaussian
from skanfis.premise import Premise

from . import oracles

LOW, HIGH = np.array([-2.0, -3.0, -1.0]), np.array([2.5, 1.0, 4.0])


def grid(families, counts, inputs=None):
    return oracles.random_grid(np.random.default_rng(1), families, counts, inputs)


def scattered(family, n_rules, inputs):
    g, inputs = np.random.default_rng(2), np.array(inputs)
    centers = g.uniform(LOW[inputs], HIGH[inputs], (n_rules, inputs.size))
    theta = family.from_center_and_width(centers, g.uniform(0.5, 1.5, centers.shape))
    return ScatteredAntecedent.build(family, inputs, theta)


GRIDS = {
    "equal counts": grid([Gaussian] * 2, [3, 3], [0, 2]),
    "gaussians": grid([Gaussian] * 3, [2, 4, 3]),
    "bells": grid([Bell] * 2, [3, 2], [0, 2]),
    "families that alternate": grid([Bell, Gaussian, Bell], [2, 3, 4]),
}
SCATTERED = {
    "scattered": scattered(Gaussian, 3, [0, 1, 2]),
    "scattered bells": scattered(Bell, 4, [1, 2]),
}
ANTECEDENTS = GRIDS | SCATTERED
ALL = pytest.mark.parametrize("antecedent", ANTECEDENTS.values(), ids=list(ANTECEDENTS))
ON_GRIDS = pytest.mark.parametrize("antecedent", GRIDS.values(), ids=list(GRIDS))
ON_SCATTERED = pytest.mark.parametrize("antecedent", SCATTERED.values(), ids=list(SCATTERED))


def in_the_box(premise, rng, n=20):
    """Displacements inside the box, and at its corners."""
    inside = rng.uniform(premise.lower, premise.upper, (n, premise.size))
    corners = np.where(rng.random((n, premise.size)) < 0.5, premise.lower, premise.upper)
    return np.vstack([inside, corners])


def parts(antecedent, vector):
    """A vector laid out as the parameters, as (input, theta-like block) for every input."""
    start = 0
    for group in antecedent.groups:
        block = vector[start : start + group.theta.size].reshape(group.theta.shape)
        start += group.theta.size
        for j in dict.fromkeys(group.inputs.tolist()):
            yield j, block[:, group.inputs == j]


def by_hand(antecedent, displacement):
    """Locations and logarithms as the module's docstring says, one number at a time."""
    blocks = []
    moves = parts(antecedent, displacement)
    for (_, theta), (_, d) in zip(parts(antecedent, antecedent.parameters), moves, strict=True):
        moved = theta + d
        if isinstance(antecedent, GridAntecedent):
            gaps = np.diff(theta[0])
            moved[0, 0] = theta[0, 0] + d[0, 0] * gaps.mean()
            for k, gap in enumerate(gaps):
                moved[0, k + 1] = moved[0, k] + gap * np.exp(d[0, k + 1])
        else:
            moved[0] = theta[0] + d[0] * np.exp(theta[1])
        blocks.append(moved)
    return blocks


@ALL
def test_displacement_zero_is_the_start(antecedent):
    premise = Premise.of(antecedent, LOW, HIGH)
    assert premise.size == antecedent.parameters.size
    assert_array_equal(premise.parameters(np.zeros(premise.size)), antecedent.parameters)
    assert (premise.lower < 0.0).all()
    assert (premise.upper > 0.0).all()


@ALL
def test_displacements_mean_what_is_written(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    for displacement in in_the_box(premise, rng):
        found = [block for _, block in parts(antecedent, premise.parameters(displacement))]
        for one, other in zip(found, by_hand(antecedent, displacement), strict=True):
            assert_allclose(one, other, rtol=1e-12, atol=1e-12)


@ON_GRIDS
def test_terms_of_a_grid_stay_in_order(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    starts = [np.diff(theta[0]) for _, theta in parts(antecedent, antecedent.parameters)]
    for displacement in in_the_box(premise, rng):
        moved = parts(antecedent, premise.parameters(displacement))
        for start, (_, theta) in zip(starts, moved, strict=True):
            growth = np.diff(theta[0]) / start
            assert (growth > 0.2 - 1e-12).all()
            assert (growth < 2.0 + 1e-12).all()


@ALL
def test_widths_and_shapes_stay_within_a_factor_of_four(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    start = parts(antecedent, antecedent.parameters)
    for _, theta in start:
        assert theta.shape[0] > 1
    for displacement in in_the_box(premise, rng):
        change = premise.parameters(displacement) - antecedent.parameters
        for _, moved in parts(antecedent, change):
            assert (np.abs(moved[1:]) <= np.log(4.0) + 1e-12).all()


@ON_SCATTERED
def test_scattered_terms_stay_within_a_width_of_the_data(antecedent):
    premise = Premise.of(antecedent, LOW, HIGH)
    widths = [np.exp(theta[1]) for _, theta in parts(antecedent, antecedent.parameters)]
    for edge, data, side in ((premise.lower, LOW, -1.0), (premise.upper, HIGH, 1.0)):
        at_edge = parts(antecedent, premise.parameters(edge))
        for width, (j, theta) in zip(widths, at_edge, strict=True):
            assert_allclose(theta[0], data[j] + side * width, rtol=1e-12)


@ON_GRIDS
def test_first_term_of_a_grid_shifts_by_one_spacing_at_most(antecedent):
    premise = Premise.of(antecedent, LOW, HIGH)
    start = list(parts(antecedent, antecedent.parameters))
    for edge, side in ((premise.lower, -1.0), (premise.upper, 1.0)):
        at_edge = parts(antecedent, premise.parameters(edge))
        for (_, theta), (_, moved) in zip(start, at_edge, strict=True):
            shift = moved[0, 0] - theta[0, 0]
            assert_allclose(shift, side * np.diff(theta[0]).mean(), rtol=1e-12)


@ALL
def test_pull_back_is_the_chain_rule(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    gradient = rng.normal(size=premise.size)
    root = rng.normal(size=(premise.size, premise.size))
    for displacement in in_the_box(premise, rng, 2):
        jacobian = oracles.central_difference(premise.parameters, displacement, 1e-2)
        slope, curvature = premise.pull_back(displacement, gradient, root.T @ root)
        assert_allclose(slope, jacobian.T @ gradient, rtol=1e-9, atol=1e-9)
        half = root @ jacobian
        assert_allclose(curvature, half.T @ half, rtol=1e-8, atol=1e-8)


@ALL
def test_nothing_is_changed_in_place(antecedent, rng):
    premise = Premise.of(antecedent, LOW, HIGH)
    displacement = rng.uniform(premise.lower, premise.upper)
    copies = displacement.copy(), antecedent.parameters.copy()
    premise.parameters(displacement)
    premise.pull_back(displacement, np.ones(premise.size), np.eye(premise.size))
    assert_array_equal(displacement, copies[0])
    assert_array_equal(antecedent.parameters, copies[1])


def test_without_terms_there_is_nothing_to_move():
    premise = Premise.of(GridAntecedent((), counts=()), LOW, HIGH)
    assert premise.size == 0
    assert premise.parameters(np.empty(0)).size == 0
