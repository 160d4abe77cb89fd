"""Where the terms of a grid start."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.membership import (
    MEMBERSHIPS,
    Bell,
    Gaussian,
    SigmoidDifference,
    SigmoidProduct,
)
from skanfis.structure import grid_antecedent

LOW, HIGH = np.array([-1.0, 100.0, 0.0]), np.array([3.0, 102.5, 0.0])


def terms(antecedent):
    """(input, theta of one term) for every term."""
    for group in antecedent.groups:
        for t, j in enumerate(group.inputs):
            yield int(j), group.family, group.theta[:, [t]]


def test_centers_span_the_range_at_even_distances():
    antecedent = grid_antecedent([Gaussian] * 3, [3, 2, 1], LOW, HIGH, 0.6)
    centers = [(j, theta[0, 0]) for j, _, theta in terms(antecedent)]
    assert centers == [(0, -1.0), (0, 1.0), (0, 3.0), (1, 100.0), (1, 102.5)]
    assert antecedent.counts == (3, 2)
    assert antecedent.n_rules == 6


@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
@pytest.mark.parametrize("overlap", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("count", [2, 3, 7])
def test_neighbours_cross_half_way_at_the_overlap(family, overlap, count):
    antecedent = grid_antecedent([family], [count], LOW[:1], HIGH[:1], overlap)
    centers = np.linspace(-1.0, 3.0, count)
    between = 0.5 * (centers[1:] + centers[:-1])
    mu = np.exp(antecedent.log_memberships(between[None]))
    # "At least" and "at most" stay one on the side to which they are open.
    crossing = {"s_shaped": (1.0, overlap), "z_shaped": (overlap, 1.0)}.get(family.name, overlap)
    for k in range(count - 1):
        # A floor where mu is zero takes 1e-10 off it elsewhere.
        assert_allclose(mu[k : k + 2, k], crossing, rtol=1e-9)
    top = np.diag(np.exp(antecedent.log_memberships(centers[None])))
    if family in (SigmoidDifference, SigmoidProduct):
        assert (top > overlap).all()
    else:
        assert_allclose(top, 1.0, rtol=1e-12)


def test_equal_terms_share_alike_half_way():
    antecedent = grid_antecedent([Gaussian, Bell], [2, 2], LOW[:2], HIGH[:2], 0.6)
    middle = 0.5 * (LOW + HIGH)[:2, None]
    assert_allclose(antecedent.strengths(middle), 0.25, rtol=1e-12)


def test_every_input_has_its_own_family_and_inputs_without_terms_are_left_out():
    families = [Bell, Gaussian, Bell, Gaussian]
    low, high = np.zeros(4), np.array([1.0, 0.0, 2.0, 3.0])
    antecedent = grid_antecedent(families, [2, 1, 3, 2], low, high, 0.6)
    found = [(j, family) for j, family, _ in terms(antecedent)]
    assert found == [(0, Bell)] * 2 + [(2, Bell)] * 3 + [(3, Gaussian)] * 2
    assert len(antecedent.groups) == 2  # the bells of two inputs are computed together


def test_one_term_everywhere_is_one_rule_without_terms(rng):
    antecedent = grid_antecedent([Gaussian] * 3, [1, 1, 1], LOW, HIGH, 0.6)
    assert antecedent.n_rules == 1
    assert antecedent.n_terms == 0
    assert_array_equal(antecedent.strengths(rng.normal(size=(3, 5))), 1.0)
