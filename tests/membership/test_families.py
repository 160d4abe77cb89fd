"""Every family against its textbook formula; what is added is tested as it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent
from skanfis.membership import FAMILIES as EVERY_FAMILY
from skanfis.membership import (
    Bell,
    Gaussian,
    SigmoidDifference,
    SigmoidProduct,
    membership_families,
)
from skanfis.membership.flanked import PiShaped, Trapezoidal, Triangular

from ..oracles import by_formula, central_difference, complex_step, corners, textbook_membership

# What sets families apart. Whatever else is added is taken for smooth, one at its center, and
# falling to both sides.
WITH_FOOT = {"triangular", "trapezoidal", "pi_shaped", "s_shaped", "z_shaped"}
SIDES = {"sigmoid_rising", "sigmoid_falling"}
SIDES_TWICE = {"sigmoids_rising", "sigmoids_falling", "sigmoids_apart"}
OPEN_SIDE = {"s_shaped": 1.0, "z_shaped": -1.0, "sigmoid_rising": 1.0, "sigmoid_falling": -1.0}
OPEN_SIDE |= {"sigmoids_rising": 1.0, "sigmoids_falling": -1.0}
TOP_BELOW_ONE = {"sigmoid_difference", "sigmoid_product"}
PEAKED = {"triangular"}
# The floor of log mu where mu is zero: this much of a Gaussian.
FLOOR = 1e-10


def families(but=()):
    chosen = [family for name, family in EVERY_FAMILY.items() if name not in but]
    return pytest.mark.parametrize("family", chosen, ids=[family.name for family in chosen])


FAMILIES = families()
# Distances from the centre in widths. Up to here no textbook formula underflows.
NEAR = np.concatenate([[-30.0, -12.5, 1e-3, -1e-6, 11.0, 29.0], np.linspace(-6.0, 6.0, 49)[1::2]])
FAR = np.array([-1e8, -3e5, 1e3, 4e6, 1e8])


def random_theta(family, rng):
    centers = rng.normal(size=7)
    theta = family.start(centers, rng.uniform(0.1, 10.0, 7), 0.5)
    theta[1:] += 0.3 * rng.normal(size=theta[1:].shape)
    return theta


def widths(family, theta):
    """The smallest of each term's widths."""
    rows = [parameter.kind == "log_width" for parameter in family.parameters]
    return np.exp(theta[rows].min(axis=0))


def points(family, theta, distances):
    return theta[0][:, None] + widths(family, theta)[:, None] * distances


def falling_sides(family):
    return [side for side in (-1.0, 1.0) if side != OPEN_SIDE.get(family.name)]


def floored(family, x, theta):
    """The textbook formula, and under it the floor where that is zero; for complex theta too."""
    mu = family.value(x, theta)
    if family.name not in WITH_FOOT:
        return mu
    names = [parameter.name for parameter in family.parameters]
    logarithms = np.array([[p.kind != "location"] for p in family.parameters])
    numbers = dict(zip(names, np.where(logarithms, np.exp(theta), theta)[:, :, None], strict=True))
    a, b, c, d = corners(family.name, numbers)
    t = np.zeros(mu.shape, dtype=mu.dtype)
    if family.name != "z_shaped":
        t = np.where(x < np.real(b), (b - x) / (b - a), t)
    if family.name != "s_shaped":
        t = np.where(x > np.real(c), (x - c) / (d - c), t)
    return (1.0 - FLOOR) * mu + FLOOR * np.exp(-(t**2) / 2)


def gradient_by_complex_step(family, x, theta):
    """d log mu / d theta = (d mu / d theta) / mu, through the textbook formula."""
    flat = complex_step(lambda p: floored(family, x, p.reshape(theta.shape)), theta.ravel())
    # A term depends on its own parameters alone; the rest of the full derivative is zero.
    full = flat.reshape(*x.shape, *theta.shape)
    own = np.stack([full[t, :, :, t] for t in range(theta.shape[1])])
    assert np.count_nonzero(full) == np.count_nonzero(own)
    return np.moveaxis(own, 2, 0) / floored(family, x, theta)


@FAMILIES
def test_value_is_the_formula_in_papers(family, rng):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    names = [parameter.name for parameter in family.parameters]
    for term, numbers in enumerate(family.natural(theta).T):
        expected = textbook_membership(family.name, x[term], dict(zip(names, numbers, strict=True)))
        # exp(-450) in the tail magnifies the last bit of its argument 450 times; next to a foot
        # that of x counts.
        assert_allclose(family.value(x, theta)[term], expected, rtol=1e-11, atol=1e-300)
        # A difference of two sigmoids loses its digits in the tails; past a foot there is a trace.
        numbers = dict(zip(names, numbers, strict=True))
        atol = 1e-10 if "1e-10" in family.formula else 1e-15
        assert_allclose(by_formula(family.formula, x[term], numbers), expected, 1e-9, atol)


@FAMILIES
def test_log_value_and_gradient_are_those_of_the_textbook_formula(family, rng):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    log_mu, gradient = family.log_value_and_gradient(x, theta)
    # Where mu is nearly one its logarithm is known to the last bit of one only.
    assert_allclose(log_mu, np.log(floored(family, x, theta)), rtol=1e-12, atol=1e-15)
    assert_allclose(family.log_value(x, theta), log_mu, rtol=1e-14, atol=1e-300)
    assert_allclose(gradient, gradient_by_complex_step(family, x, theta), rtol=1e-10, atol=1e-14)


@FAMILIES
def test_gradient_far_from_every_term(family, rng):
    # The textbook formula underflows here; log mu is smooth in theta on the scale of one.
    theta = random_theta(family, rng)
    x = points(family, theta, FAR)
    _, gradient = family.log_value_and_gradient(x, theta)
    for term in range(theta.shape[1]):
        one = theta[:, term]
        expected = central_difference(lambda p, t=term: family.log_value(x[t], p[:, None])[0], one)
        # A plateau's derivative, like the center's, is 1e-8 of the value that is differenced.
        noise = 1e-12 * np.abs(family.log_value(x[term], one[:, None])[0]) + 1e-200
        error = np.abs(gradient[:, term] - expected.T)
        assert (error <= 1e-9 * np.abs(expected.T) + noise).all()


@FAMILIES
def test_log_value_far_away_is_finite_and_falls_with_the_distance(family, rng):
    theta = random_theta(family, rng)
    for side in (-1.0, 1.0):
        # From beyond the plateau on, if there is one; or the top, which may lie off the place.
        nearest = 2.0 if family.name == "sigmoids_apart" else 0.5
        x = points(family, theta, side * np.logspace(nearest, 8, 60))
        with np.errstate(all="raise", under="ignore"):
            log_mu, gradient = family.log_value_and_gradient(x, theta)
            assert np.isfinite(family.log_value(x, theta)).all()
        assert np.isfinite(log_mu).all()
        assert np.isfinite(gradient).all()
        if side in falling_sides(family):
            assert (np.diff(log_mu, axis=1) < 0.0).all()
        elif family.name in SIDES | SIDES_TWICE:
            assert (np.diff(log_mu, axis=1) >= 0.0).all()
        else:
            assert_array_equal(log_mu, 0.0)


@families(but=TOP_BELOW_ONE | SIDES | SIDES_TWICE)
@pytest.mark.parametrize("distance", [0.0, 1e-300, 1e-160, -1e-150, 1e-30])
def test_at_its_center_a_term_is_one_and_flat(family, rng, distance):
    theta = random_theta(family, rng)
    theta[0] = 0.0  # elsewhere the distance would be lost in the addition
    with np.errstate(all="raise", under="ignore"):
        log_mu, gradient = family.log_value_and_gradient(points(family, theta, [distance]), theta)
        again = family.log_value(points(family, theta, [distance]), theta)
    atol = 1e-25 if family.name in PEAKED else 1e-50
    assert_allclose(log_mu, 0.0, atol=atol)
    assert_allclose(again, 0.0, atol=atol)
    # A peak has a slope on either side of it, by its location; none by its widths, nor at the top.
    flat = gradient[1:] if family.name in PEAKED and distance else gradient
    assert_allclose(flat, 0.0, atol=1e-25)


@FAMILIES
@pytest.mark.parametrize(("offset", "scale"), [(-40.0, 1.8), (0.0, 1e-6), (1e3, 1e6)])
def test_change_of_units_moves_term_and_point_together(family, rng, offset, scale):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    before = theta.copy()
    moved = family.change_units(theta, offset, scale)
    assert_array_equal(theta, before)
    found, expected = family.log_value(offset + scale * x, moved), family.log_value(x, theta)
    # The point near the centre is known to the last bit of the offset.
    assert_allclose(found, expected, rtol=1e-8, atol=1e-8)
    back = family.change_units(moved, -offset / scale, 1.0 / scale)
    assert_allclose(back, theta, rtol=1e-9, atol=1e-9)


@families(but=SIDES_TWICE)
@pytest.mark.parametrize("overlap", [0.1, 0.5, 0.6, 0.9])
def test_neighbours_cross_at_the_overlap(family, rng, overlap):
    spacing = rng.uniform(0.1, 10.0, 5)
    center = rng.normal(size=5)
    theta = family.start(center, spacing, overlap)
    for side in falling_sides(family):
        crossing = (center + 0.5 * side * spacing)[:, None]
        assert_allclose(family.value(crossing, theta)[:, 0], overlap, rtol=1e-12)
    top = np.exp(family.log_value(center[:, None], theta))
    if family.name in SIDES:
        assert (top > overlap).all()
    elif family.name in TOP_BELOW_ONE:
        assert (top > overlap + 0.9 * (1.0 - overlap)).all()
    else:
        assert_array_equal(top, 1.0)


@families(but=SIDES_TWICE)
def test_center_and_width_give_the_half_height_of_a_gaussian(family, rng):
    center, width = rng.normal(size=(3, 4)), rng.uniform(0.1, 10.0, (3, 4))
    theta = family.from_center_and_width(center, width)
    assert theta.shape == (len(family.parameters), 3, 4)
    flat = theta.reshape(len(family.parameters), -1)
    # exp(-u^2 / 2) = 1/2 at u = sqrt(2 log 2)
    for side in falling_sides(family):
        x = (center + side * width * np.sqrt(2.0 * np.log(2.0))).reshape(-1, 1)
        assert_allclose(family.value(x, flat), 0.5, rtol=1e-12)
    if family.name not in SIDES:
        assert_array_equal(theta[0], center)


@pytest.mark.parametrize("slope", [0.5, 0.6, 1.0, 30.0])
def test_bell_of_any_slope(rng, slope):
    center, width = rng.normal(size=4), rng.uniform(0.5, 2.0, 4)
    theta = np.stack([center, np.log(width), np.full(4, np.log(slope))])
    x = points(Bell, theta, np.array([-3.0, -1.0, -0.5, 0.01, 0.99, 1.0, 2.5]))
    log_mu, gradient = Bell.log_value_and_gradient(x, theta)
    # Steep shoulders: (1 % off the width)^60 magnifies rounding of the distance 60 times.
    assert_allclose(np.exp(log_mu), Bell.value(x, theta), rtol=1e-12)
    assert_allclose(gradient, gradient_by_complex_step(Bell, x, theta), rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("family", [SigmoidDifference, SigmoidProduct])
@pytest.mark.parametrize("log_ratio", [-12.0, 6.0, 12.0])
def test_flanks_much_longer_or_shorter_than_the_width(family, log_ratio):
    theta = np.zeros((len(family.parameters), 1))
    theta[1] = log_ratio
    with np.errstate(all="raise", under="ignore"):
        x = np.append(np.linspace(-8.0, 8.0, 33), 1e8)[None]
        log_mu, gradient = family.log_value_and_gradient(x, theta)
    assert (np.isfinite(log_mu) & (log_mu <= 0.0)).all()
    assert np.isfinite(gradient).all()


def test_families_are_given_by_name_or_class_for_all_inputs_or_for_each():
    names = ["time", "rate"]
    assert membership_families("bell", names) == [Bell, Bell]
    assert membership_families(Bell, names) == [Bell, Bell]
    assert membership_families(("bell", Gaussian), names) == [Bell, Gaussian]


@pytest.mark.parametrize("family", [Triangular, Trapezoidal, PiShaped])
def test_where_no_term_reaches_the_nearest_speaks(family):
    # Terms at 0, 10 and 30 that reach no further than 1.
    theta = family.start(np.array([0.0, 10.0, 30.0]), np.ones(3), 0.6)
    x = np.array([-1e9, -50.0, 4.0, 6.0, 18.0, 22.0, 80.0, 1e9])
    assert not family.value(x[None], theta).any()
    antecedent = GridAntecedent.build([family], [0], [theta])
    with np.errstate(all="raise", under="ignore"):
        strengths = antecedent.strengths(x[None])
    assert_allclose(strengths.sum(axis=0), 1.0, rtol=1e-14)
    assert_array_equal(strengths.argmax(axis=0), [0, 0, 0, 1, 1, 2, 2, 2])
    # Half-way the two neighbours share, and strengths pass from one to the other smoothly.
    between = antecedent.strengths(np.linspace(4.0, 6.0, 401)[None])
    assert_allclose(between[:2, 200], 0.5, rtol=1e-10)
    assert (np.abs(np.diff(between, axis=1)) < 0.05).all()
