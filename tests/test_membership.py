"""Every family of MEMBERSHIPS against its textbook formula; what is added is tested as it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.membership import MEMBERSHIPS, Bell, Gaussian

from .oracles import central_difference, complex_step, textbook_membership

FAMILIES = pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
# Distances from the centre in widths. Up to here no textbook formula underflows.
NEAR = np.concatenate([[-30.0, -12.5, 1e-3, -1e-6, 11.0, 29.0], np.linspace(-6.0, 6.0, 49)[1::2]])
FAR = np.array([-1e8, -3e5, 1e3, 4e6, 1e8])


def random_theta(family, rng, n_terms=7):
    centers = rng.normal(size=n_terms)
    theta = family.start(centers, rng.uniform(0.1, 10.0, n_terms), 0.5)
    theta[1:] += 0.3 * rng.normal(size=theta[1:].shape)
    return theta


def widths(family, theta):
    row = [parameter.kind for parameter in family.parameters].index("log_width")
    return np.exp(theta[row])


def points(family, theta, distances):
    return theta[0][:, None] + widths(family, theta)[:, None] * distances


def gradient_by_complex_step(family, x, theta):
    """d log mu / d theta = (d mu / d theta) / mu, through the textbook formula."""
    flat = complex_step(lambda p: family.value(x, p.reshape(theta.shape)), theta.ravel())
    # A term depends on its own parameters alone; the rest of the full derivative is zero.
    full = flat.reshape(*x.shape, *theta.shape)
    own = np.stack([full[t, :, :, t] for t in range(theta.shape[1])])
    assert np.count_nonzero(full) == np.count_nonzero(own)
    return np.moveaxis(own, 2, 0) / family.value(x, theta)


@FAMILIES
def test_registered_under_its_own_name(family):
    assert MEMBERSHIPS[family.name] is family
    kinds = [parameter.kind for parameter in family.parameters]
    assert kinds[0] == "location"
    assert set(kinds) <= {"location", "log_width", "log_shape"}


@FAMILIES
def test_value_is_the_formula_in_papers(family, rng):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    names = [parameter.name for parameter in family.parameters]
    for term, numbers in enumerate(family.natural(theta).T):
        expected = textbook_membership(family.name, x[term], dict(zip(names, numbers, strict=True)))
        # exp(-450) in the tail magnifies the last bit of its argument 450 times.
        assert_allclose(family.value(x, theta)[term], expected, rtol=1e-12)


@FAMILIES
def test_log_value_is_the_logarithm_of_the_value(family, rng):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    # Where mu is nearly one its logarithm is known to the last bit of one only.
    assert_allclose(
        family.log_value(x, theta), np.log(family.value(x, theta)), rtol=1e-12, atol=4e-16
    )


@FAMILIES
def test_gradient_is_that_of_the_textbook_formula(family, rng):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    log_mu, gradient = family.log_value_and_gradient(x, theta)
    assert_allclose(log_mu, family.log_value(x, theta), rtol=1e-14, atol=1e-300)
    assert_allclose(gradient, gradient_by_complex_step(family, x, theta), rtol=1e-10, atol=1e-15)


@FAMILIES
def test_gradient_far_from_every_term(family, rng):
    # The textbook formula underflows here; log mu is smooth in theta on the scale of one.
    theta = random_theta(family, rng)
    x = points(family, theta, FAR)
    _, gradient = family.log_value_and_gradient(x, theta)
    for term in range(theta.shape[1]):
        one = theta[:, term]
        expected = central_difference(lambda p, t=term: family.log_value(x[t], p[:, None])[0], one)
        # The centre's derivative is 1e-8 of the value that is differenced.
        assert_allclose(gradient[1:, term], expected.T[1:], rtol=1e-9)
        assert_allclose(gradient[0, term], expected.T[0], rtol=1e-3, atol=1e-12)


@FAMILIES
def test_log_value_far_away_is_finite_and_falls_with_the_distance(family, rng):
    theta = random_theta(family, rng)
    for side in (-1.0, 1.0):
        x = points(family, theta, side * np.logspace(0, 8, 60))
        with np.errstate(all="raise", under="ignore"):
            log_mu, gradient = family.log_value_and_gradient(x, theta)
            assert np.isfinite(family.log_value(x, theta)).all()
        assert np.isfinite(log_mu).all()
        assert np.isfinite(gradient).all()
        assert (np.diff(log_mu, axis=1) < 0.0).all()


@FAMILIES
@pytest.mark.parametrize("distance", [0.0, 1e-300, 1e-160, -1e-150, 1e-30])
def test_at_its_center_a_term_is_one_and_flat(family, rng, distance):
    theta = random_theta(family, rng)
    theta[0] = 0.0  # elsewhere the distance would be lost in the addition
    with np.errstate(all="raise", under="ignore"):
        log_mu, gradient = family.log_value_and_gradient(points(family, theta, [distance]), theta)
        assert_allclose(family.log_value(points(family, theta, [distance]), theta), 0.0, atol=1e-50)
    assert_allclose(log_mu, 0.0, atol=1e-50)
    assert_allclose(gradient, 0.0, atol=1e-25)


@FAMILIES
def test_values_lie_between_zero_and_one_and_are_symmetric(family, rng):
    theta = random_theta(family, rng)
    theta[0] = 0.0
    mu = np.exp(family.log_value(points(family, theta, NEAR), theta))
    assert (mu >= 0.0).all()
    assert (mu <= 1.0).all()
    assert_array_equal(mu, np.exp(family.log_value(points(family, theta, -NEAR), theta)))


@FAMILIES
def test_one_row_of_x_serves_all_terms(family, rng):
    theta = random_theta(family, rng)
    x = rng.normal(size=20)
    repeated = np.tile(x, (theta.shape[1], 1))
    before = x.copy()
    assert_array_equal(family.log_value(x, theta), family.log_value(repeated, theta))
    for one, many in zip(
        family.log_value_and_gradient(x, theta),
        family.log_value_and_gradient(repeated, theta),
        strict=True,
    ):
        assert_array_equal(one, many)
    assert_array_equal(x, before)


@FAMILIES
@pytest.mark.parametrize(("offset", "scale"), [(-40.0, 1.8), (0.0, 1e-6), (1e3, 1e6)])
def test_change_of_units_moves_term_and_point_together(family, rng, offset, scale):
    theta = random_theta(family, rng)
    x = points(family, theta, NEAR)
    before = theta.copy()
    moved = family.change_units(theta, offset, scale)
    assert_array_equal(theta, before)
    # The point near the centre is known to the last bit of the offset.
    assert_allclose(
        family.log_value(offset + scale * x, moved),
        family.log_value(x, theta),
        rtol=1e-8,
        atol=1e-8,
    )
    back = family.change_units(moved, -offset / scale, 1.0 / scale)
    assert_allclose(back, theta, rtol=1e-9, atol=1e-9)


@FAMILIES
def test_change_of_units_takes_one_offset_and_scale_per_term(family, rng):
    theta = random_theta(family, rng)
    offset, scale = rng.normal(size=7), rng.uniform(0.1, 10.0, 7)
    together = family.change_units(theta, offset, scale)
    for t in range(7):
        assert_array_equal(
            together[:, [t]], family.change_units(theta[:, [t]], offset[t], scale[t])
        )


@FAMILIES
@pytest.mark.parametrize("overlap", [0.1, 0.5, 0.6, 0.9])
def test_neighbours_cross_at_the_overlap(family, rng, overlap):
    spacing = rng.uniform(0.1, 10.0, 5)
    theta = family.start(rng.normal(size=5), spacing, overlap)
    for side in (-0.5, 0.5):
        crossing = (theta[0] + side * spacing)[:, None]
        assert_allclose(family.value(crossing, theta)[:, 0], overlap, rtol=1e-12)
    assert_array_equal(np.exp(family.log_value(theta[0][:, None], theta)), 1.0)


@FAMILIES
def test_center_and_width_give_the_half_height_of_a_gaussian(family, rng):
    center, width = rng.normal(size=(3, 4)), rng.uniform(0.1, 10.0, (3, 4))
    theta = family.from_center_and_width(center, width)
    assert theta.shape == (len(family.parameters), 3, 4)
    flat = theta.reshape(len(family.parameters), -1)
    # exp(-u^2 / 2) = 1/2 at u = sqrt(2 log 2)
    for side in (-1.0, 1.0):
        x = (center + side * width * np.sqrt(2.0 * np.log(2.0))).reshape(-1, 1)
        assert_allclose(family.value(x, flat), 0.5, rtol=1e-12)
    assert_array_equal(theta[0], center)


@FAMILIES
def test_natural_undoes_the_logarithms_and_nothing_else(family, rng):
    theta = random_theta(family, rng)
    before = theta.copy()
    natural = family.natural(theta)
    assert_array_equal(theta, before)
    for row, raw, parameter in zip(natural, theta, family.parameters, strict=True):
        assert_allclose(row, raw if parameter.kind == "location" else np.exp(raw), rtol=1e-15)


def test_gaussian_in_numbers():
    # mu(c +- sigma) = e^(-1/2), mu(c + 10 sigma) = e^(-50); c = 3, sigma = 2
    theta = np.array([[3.0], [np.log(2.0)]])
    x = np.array([[1.0, 3.0, 5.0, 23.0, 3.0 + 2e8]])
    assert_allclose(Gaussian.log_value(x, theta), [[-0.5, 0.0, -0.5, -50.0, -5e15]], rtol=1e-15)


def test_bell_in_numbers():
    # a = 2, b = 2, c = 3: 1/2 at c +- a, 1/17 at c + 2a; far away log mu = -2b log(|x - c| / a)
    theta = np.array([[3.0], [np.log(2.0)], [np.log(2.0)]])
    x = np.array([[1.0, 5.0, 7.0]])
    assert_allclose(Bell.value(x, theta), [[1 / 2, 1 / 2, 1 / 17]], rtol=1e-14)
    far = np.array([[3.0 - 2e8]])
    assert_allclose(Bell.log_value(far, theta), -4.0 * np.log(1e8), rtol=1e-14)


@pytest.mark.parametrize("slope", [0.5, 0.6, 1.0, 30.0])
def test_bell_of_any_slope(rng, slope):
    theta = np.stack(
        [rng.normal(size=4), np.log(rng.uniform(0.5, 2.0, 4)), np.full(4, np.log(slope))]
    )
    x = points(Bell, theta, np.array([-3.0, -1.0, -0.5, 0.01, 0.99, 1.0, 2.5]))
    log_mu, gradient = Bell.log_value_and_gradient(x, theta)
    # Steep shoulders: (1 % off the width)^60 magnifies rounding of the distance 60 times.
    assert_allclose(np.exp(log_mu), Bell.value(x, theta), rtol=1e-12)
    assert_allclose(gradient, gradient_by_complex_step(Bell, x, theta), rtol=1e-10, atol=1e-14)
