"""Corners, kinks and what becomes of rows that lie on no term."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent
from skanfis.membership import MEMBERSHIPS
from skanfis.membership.flanked import (
    PiShaped,
    SShaped,
    Trapezoidal,
    Triangular,
    TwoSidedGaussian,
    ZShaped,
)

from .. import oracles

WITH_FOOT = pytest.mark.parametrize("family", [Triangular, Trapezoidal, PiShaped])


def theta_of(*numbers):
    """One term: a location, and lengths that become logarithms."""
    return np.array([[numbers[0]], *[[np.log(length)] for length in numbers[1:]]])


@pytest.mark.parametrize(
    ("family", "numbers", "x", "mu"),
    [
        # a = 1, b = c = 3, d = 7
        (Triangular, (3, 2, 4), [0, 1, 2, 3, 5, 7, 9], [0, 0, 1 / 2, 1, 1 / 2, 0, 0]),
        # a = 1, b = 2, c = 4, d = 8
        (Trapezoidal, (3, 1, 4, 2), [0, 1.5, 2, 3, 4, 5, 8.5], [0, 1 / 2, 1, 1, 1, 3 / 4, 0]),
        (
            PiShaped,
            (3, 1, 4, 2),
            [0, 1.25, 1.5, 2, 3, 4, 5, 7],
            [0, 1 / 8, 1 / 2, 1, 1, 1, 7 / 8, 1 / 8],
        ),
        (TwoSidedGaussian, (3, 1, 4, 2), [1, 2, 3, 4, 8], [np.exp(-0.5), 1, 1, 1, np.exp(-0.5)]),
        (SShaped, (3, 4), [-2, -1, 0, 1, 2, 3, 99], [0, 0, 1 / 8, 1 / 2, 7 / 8, 1, 1]),
        (ZShaped, (3, 4), [-99, 3, 4, 5, 6, 7, 8], [1, 1, 7 / 8, 1 / 2, 1 / 8, 0, 0]),
    ],
)
def test_values_in_numbers(family, numbers, x, mu):
    assert_allclose(family.value(np.array([x]), theta_of(*numbers)), [mu], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("family", [Triangular, Trapezoidal, PiShaped, TwoSidedGaussian])
def test_whatever_the_parameters_mu_rises_to_one_and_falls(family, rng):
    theta = 3.0 * rng.normal(size=(len(family.parameters), 50))
    theta[1:] = np.clip(theta[1:], -8.0, 8.0)
    a, b, c, d = oracles.corners(
        family.name,
        dict(zip([p.name for p in family.parameters], family.natural(theta), strict=True)),
    )
    assert (a < b).all()
    assert (b <= c).all()
    assert (c < d).all()
    x = np.linspace(a, d, 201, axis=1)
    mu = family.value(x, theta)
    rising = np.diff(mu, axis=1)[x[:, 1:] <= b[:, None]]
    falling = np.diff(mu, axis=1)[x[:, :-1] >= c[:, None]]
    # Where a flank is much shorter than the term, the last bit of x is not so small on it.
    assert (rising >= -1e-8).all()
    assert (falling <= 1e-8).all()
    assert_array_equal(family.value(theta[[0]].T, theta), 1.0)


@pytest.mark.parametrize("name", ["trapezoidal", "pi_shaped", "two_sided_gaussian"])
def test_on_the_plateau_there_is_nothing_to_learn(name, rng):
    family = MEMBERSHIPS[name]
    log_mu, gradient = family.log_value_and_gradient(
        rng.uniform(2.01, 3.99, (1, 20)), theta_of(3, 1, 4, 2)
    )
    assert_array_equal(log_mu, 0.0)
    assert_array_equal(gradient, 0.0)


def test_a_peak_has_the_slope_of_its_side():
    x = np.array([[2.9, 3.1]])
    _, gradient = Triangular.log_value_and_gradient(x, theta_of(3, 2, 4))
    # d log mu / dc = -1 / (mu left) on the left, 1 / (mu right) on the right
    assert_allclose(gradient[0, 0], [-1 / 2 / 0.95, 1 / 4 / 0.975], rtol=1e-8)
    assert_array_equal(gradient[[1, 2], 0, [1, 0]], 0.0)


def strengths_on_a_line(family, theta, x):
    """Normalised strengths of terms on one input."""
    antecedent = GridAntecedent.build([family], [0], [theta])
    return antecedent.strengths(np.array([x]))


@WITH_FOOT
def test_strengths_are_the_textbooks_wherever_a_term_is_above_zero(family, rng):
    theta = family.start(np.arange(4.0), np.ones(4), 0.6)
    theta[1:] += 0.2 * rng.normal(size=theta[1:].shape)
    x = rng.uniform(-0.5, 3.5, 500)
    mu = family.value(x[None], theta)
    assert (mu.max(axis=0) > 0.01).all()
    found = strengths_on_a_line(family, theta, x)
    # The floor is 1e-10 of a term, next to a largest membership of 0.01 or more.
    assert_allclose(found, mu / mu.sum(axis=0), rtol=0, atol=3e-8)


@WITH_FOOT
def test_where_no_term_reaches_the_nearest_speaks(family):
    # Terms at 0, 10 and 30 that reach no further than 1.
    theta = family.start(np.array([0.0, 10.0, 30.0]), np.ones(3), 0.6)
    x = np.array([-1e9, -50.0, 4.0, 6.0, 18.0, 22.0, 80.0, 1e9])
    assert not family.value(x[None], theta).any()
    with np.errstate(all="raise", under="ignore"):
        strengths = strengths_on_a_line(family, theta, x)
    assert_allclose(strengths.sum(axis=0), 1.0, rtol=1e-14)
    assert_array_equal(strengths.argmax(axis=0), [0, 0, 0, 1, 1, 2, 2, 2])
    # Half-way the two neighbours share, and strengths pass from one to the other smoothly.
    between = strengths_on_a_line(family, theta, np.linspace(4.0, 6.0, 401))
    assert_allclose(between[:2, 200], 0.5, rtol=1e-10)
    assert (np.abs(np.diff(between, axis=1)) < 0.05).all()
