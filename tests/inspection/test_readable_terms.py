"""Crossings against closed forms and a dense grid; terms that are the same are one."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent, ScatteredAntecedent, TermGroup
from skanfis.inspection.readable_terms import (
    crossings,
    distinct_terms,
    greatest_truth_in_box,
    own_terms,
)
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian

from .. import oracles
from ..export.rule_bases import EVERY_PAIR, OFFSET, SCALE

DENSE = 200_001


def gaussians(centers, widths):
    return np.array([centers, np.log(widths)], dtype=float)


@pytest.mark.parametrize(("distance", "s", "t"), [(1.0, 1.0, 1.0), (3.0, 0.2, 2.0), (0.01, 5, 1)])
def test_two_gaussians_cross_where_the_closed_form_says(distance, s, t):
    antecedent = GridAntecedent.build([Gaussian], [0], [gaussians([7.0, 7.0 + distance], [s, t])])
    expected = np.exp(-0.5 * (distance / (s + t)) ** 2)
    assert_allclose(crossings(antecedent), [expected, np.nan], rtol=1e-12)


# Of two S- or Z-shaped terms one contains the other, and both are true at its shoulder.
ONE_SIDED = ("s_shaped", "z_shaped")


@pytest.mark.parametrize("overlap", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
def test_neighbours_of_a_start_cross_at_its_overlap(family, overlap):
    # "neighbours cross at mu = overlap" is what start promises.
    theta = family.start(np.array([0.0, 2.0, 4.0]), np.full(3, 2.0), overlap)
    found = crossings(GridAntecedent.build([family], [0], [theta]))
    expected = 1.0 if family.name in ONE_SIDED else overlap
    assert_allclose(found[:2], expected, rtol=1e-8)


@pytest.mark.theory
@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
def test_crossings_of_uneven_terms_are_those_of_a_dense_grid(family):
    rng = np.random.default_rng(0)
    antecedent = oracles.random_grid(rng, [family, family], (4, 3), (0, 2))
    found = crossings(antecedent)
    for j, own in distinct_terms(antecedent).items():
        places = [antecedent.groups[0].theta[0, t] for t in own]
        for (t, following), (low, high) in zip(pairwise(own), pairwise(places), strict=True):
            Z = np.zeros((3, DENSE // 10))
            Z[j] = np.linspace(low, high, DENSE // 10)
            mu = np.exp(antecedent.log_memberships(Z))
            assert found[t] == pytest.approx(np.minimum(mu[t], mu[following]).max(), abs=1e-3)
            assert found[t] >= np.minimum(mu[t], mu[following]).max() * (1.0 - 1e-12)


def test_terms_far_apart_do_not_cross():
    antecedent = GridAntecedent.build([Gaussian], [0], [gaussians([0.0, 1e9], [1.0, 1e-3])])
    assert_array_equal(crossings(antecedent), [0.0, np.nan])


def test_crossings_do_not_depend_on_units_or_order():
    antecedent = oracles.random_scattered(np.random.default_rng(0), Gaussian, 6, (0, 1, 2))
    found = crossings(antecedent)
    moved = antecedent.change_units(OFFSET, SCALE)
    assert_allclose(crossings(moved), found, rtol=1e-6)
    group = antecedent.groups[0]
    turned = ScatteredAntecedent(
        (TermGroup(Gaussian, group.inputs[::-1], group.theta[:, ::-1]),), n_premise_inputs=3
    )
    assert_allclose(crossings(turned)[::-1], found, rtol=1e-12)


def test_scattered_terms_have_neighbours_by_their_location():
    theta = gaussians([5.0, 1.0, 3.0], [1.0, 1.0, 2.0])[:, :, None]
    antecedent = ScatteredAntecedent.build(Gaussian, np.array([4]), theta)
    assert distinct_terms(antecedent) == {4: [1, 2, 0]}
    height = np.exp(-0.5 * (2.0 / 3.0) ** 2)
    assert_allclose(crossings(antecedent), [np.nan, height, height], rtol=1e-12)


def test_terms_that_are_the_very_same_are_one():
    off = 1e-13  # a rounding error
    theta = gaussians([1.0, 3.0, 1.0 + off, 3.0], [0.5, 0.7, 0.5 * (1 + off), 0.7])[:, :, None]
    antecedent = ScatteredAntecedent.build(Gaussian, np.array([0]), theta)
    assert distinct_terms(antecedent) == {0: [0, 1]}
    assert_array_equal(own_terms(antecedent), [0, 1])
    height = np.exp(-0.5 * (2.0 / 1.2) ** 2)
    assert_allclose(crossings(antecedent), [height, np.nan, np.nan, np.nan], rtol=1e-12)


def test_terms_of_one_place_and_two_widths_are_two_that_cannot_be_told_apart():
    theta = gaussians([1.0, 1.0], [0.5, 0.7])[:, :, None]
    antecedent = ScatteredAntecedent.build(Gaussian, np.array([0]), theta)
    assert distinct_terms(antecedent) == {0: [0, 1]}
    assert_array_equal(crossings(antecedent), [1.0, np.nan])


def test_neighbours_of_two_families():
    bells = np.array([[2.0], [np.log(1.0)], [np.log(2.0)]])
    groups = (
        TermGroup(Gaussian, np.array([0, 0]), gaussians([0.0, 2.0], [1.0, 1.0])),
        TermGroup(Bell, np.array([0]), bells),
    )
    antecedent = RuleTableAntecedent(groups, np.array([[0], [1], [2]]))
    x = np.linspace(0.0, 2.0, DENSE)
    bell, gaussian = 1.0 / (1.0 + (x - 2.0) ** 4), np.exp(-0.5 * x**2)
    # Bell before Gaussian at one place, by name: they are not the same term.
    assert distinct_terms(antecedent) == {0: [0, 2, 1]}
    expected = [np.minimum(bell, gaussian).max(), np.nan, 1.0]
    assert_allclose(crossings(antecedent), expected, atol=1e-5)


@pytest.mark.theory
@pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
def test_greatest_truth_in_the_box_is_that_of_a_dense_grid(model):
    Z = model.minimum[:, None] + (model.maximum - model.minimum)[:, None] * np.linspace(0, 1, DENSE)
    expected = np.exp(model.antecedent.log_memberships(Z)).max(axis=1)
    found = greatest_truth_in_box(model)
    assert_allclose(found, expected, rtol=1e-6)


def test_a_base_without_terms():
    nothing = GridAntecedent((), counts=())
    assert distinct_terms(nothing) == {}
    assert crossings(nothing).size == own_terms(nothing).size == 0
