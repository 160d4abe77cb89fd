"""Ranges of log memberships, slopes and curvatures against what they are at many places."""

import itertools

import numpy as np
import pytest

from skanfis.antecedent import TermGroup
from skanfis.bounds.terms import ranges
from skanfis.membership import MEMBERSHIPS, Bell

N_TERMS, N_BOXES = 5, 200


def a_group(rng, family):
    centers, spacing = rng.normal(size=N_TERMS), rng.uniform(0.3, 2.0, N_TERMS)
    theta = family.start(centers, spacing, 0.6)
    theta[1:] += 0.5 * rng.normal(size=theta[1:].shape)
    if family is Bell:
        # Some have a cusp at the centre: 2b < 1.
        theta[2, :2] = np.log([0.4, 0.6])
    return TermGroup(family, np.zeros(N_TERMS, dtype=int), theta)


def boxes(rng, group):
    """Of all sizes; half of them about a corner of a term."""
    width = 10.0 ** rng.uniform(-6.0, 0.5, N_BOXES)
    low = 2.0 * rng.normal(size=N_BOXES)
    numbers = group.family.natural(group.theta)
    corners = [numbers[0]]
    for sign in (-1.0, 1.0):
        corners += [numbers[0] + sign * row for row in numbers[1:]]
        if len(numbers) == 4:
            corners += [numbers[0] + sign * (0.5 * numbers[3] + row) for row in numbers[1:3]]
    half = N_BOXES // 2
    low[:half] = rng.choice(np.ravel(corners), half) - width[:half] * rng.uniform(size=half)
    return low[None], (low + width)[None]


@pytest.fixture(params=MEMBERSHIPS.values(), ids=MEMBERSHIPS)
def case(request, rng):
    """Terms of a family, boxes, and the ranges in them."""
    group = a_group(rng, request.param)
    low, high = boxes(rng, group)
    return group, low, high, ranges(group, low, high)


def test_ranges_hold(case, rng):
    group, low, high, found = case
    parts = np.append(np.linspace(0.0, 1.0, 101), rng.uniform(size=60))[:, None]
    places = low + parts * (high - low)
    for x in np.minimum(places, high):
        at = np.tile(x, (N_TERMS, 1))
        log_mu, gradient = group.family.log_value_and_gradient(at, group.theta)
        assert (found.log_mu[0] <= log_mu).all()
        assert (log_mu <= found.log_mu[1]).all()
        assert (found.slope[0] <= -gradient[0]).all()
        assert (-gradient[0] <= found.slope[1]).all()


def test_ranges_of_curvature_hold(case):
    group, low, high, found = case
    family = group.family
    is_bounded = np.isfinite(found.curve[0])
    assert is_bounded.any() or family.name not in ("gaussian", "bell", "two_sided_gaussian")

    def slope(x):
        return -family.log_value_and_gradient(np.tile(x, (N_TERMS, 1)), group.theta)[1][0]

    steps = np.linspace(0.0, 1.0, 30)[:, None]
    at = [slope(x) for x in low + steps * (high - low)]
    for before, after in itertools.pairwise(at):
        # What a slope has changed by is its mean curvature.
        width = (high - low) / (len(steps) - 1)
        curve = (after - before) / width
        slack = 1e-6 * np.abs(curve) + 1e-12 * np.abs(after) / width + 1e-9
        # 2b < 1: the slope jumps at the centre.
        assert ((found.curve[0] <= curve + slack) | ~is_bounded).all()
        assert ((curve - slack <= found.curve[1]) | ~is_bounded).all()


def test_slopes_of_bells_hold_far_off(rng):
    """However large the exponents are there."""
    group, x = a_group(rng, Bell), 1e8 * rng.normal(size=(1, N_BOXES))
    group.theta[2] = np.log([0.4, 0.6, 3.0, 5.0, 9.0])
    found = ranges(group, x, x)
    slope = -Bell.log_value_and_gradient(np.tile(x, (N_TERMS, 1)), group.theta)[1][0]
    assert (found.slope[0] <= slope).all()
    assert (slope <= found.slope[1]).all()
