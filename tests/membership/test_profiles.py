"""Profiles by numbers, and the floor that keeps log mu finite beyond a foot."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.membership.profiles import GaussianProfile, LinearProfile, SplineProfile

from ..oracles import central_difference

FLOOR = 1e-10
PROFILES = pytest.mark.parametrize("profile", [GaussianProfile, LinearProfile, SplineProfile])
WITH_FOOT = pytest.mark.parametrize("profile", [LinearProfile, SplineProfile])


def test_values_in_numbers():
    t = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 3.0])
    assert_array_equal(LinearProfile.value(t), [1, 0.75, 0.5, 0.25, 0, 0])
    assert_array_equal(SplineProfile.value(t), [1, 0.875, 0.5, 0.125, 0, 0])
    assert_allclose(GaussianProfile.value(np.array([0.0, 1.0, 2.0])), np.exp([0.0, -0.5, -2.0]))


@PROFILES
@pytest.mark.parametrize("mu", [0.01, 0.3, 0.5, 0.6, 0.99])
def test_reach_is_the_inverse_of_the_value(profile, mu):
    assert_allclose(profile.value(profile.reach(mu)), mu, rtol=1e-12)


@PROFILES
def test_slope_is_the_derivative_and_zero_at_the_shoulder(profile):
    # Between the corners at 0, 1/2 and 1; close to the foot log mu turns within 1 - t.
    t = np.array([0.01, 0.3, 0.49, 0.51, 0.7, 0.99, 1.01, 1.5, 4.0, 1e3])
    log_mu, slope = profile.log_value_and_slope(t)
    assert_array_equal(log_mu, profile.log_value(t))
    for one, at in zip(slope, t, strict=True):
        expected = central_difference(lambda p: profile.log_value(p), np.array([at]), 1e-4 * at)
        assert_allclose(one, expected[0, 0], rtol=1e-8)
    assert_array_equal(profile.log_value_and_slope(np.zeros(1)), np.zeros((2, 1)))


@WITH_FOOT
def test_log_value_is_that_of_the_mixture(profile):
    t = np.concatenate([np.linspace(0.0, 1.5, 61), [1.0 - 1e-9, 1.0 + 1e-9]])
    expected = (1.0 - FLOOR) * profile.value(t) + FLOOR * np.exp(-0.5 * t**2)
    assert_allclose(profile.log_value(t), np.log(expected), rtol=1e-13, atol=1e-15)


@WITH_FOOT
def test_the_floor_is_a_gaussian_without_end(profile):
    t = np.array([1.0, 2.0, 40.0, 1e8, 1e150])
    log_mu, slope = profile.log_value_and_slope(t)
    assert_allclose(log_mu, np.log(FLOOR) - 0.5 * t**2, rtol=1e-14)
    assert_allclose(slope, -t, rtol=1e-14)


@WITH_FOOT
def test_log_value_falls_through_the_foot_without_a_jump(profile):
    t = 1.0 + np.linspace(-1e-9, 1e-9, 2001)
    log_mu = profile.log_value(t)
    assert (np.diff(log_mu) <= 0.0).all()
    assert (np.abs(np.diff(log_mu)) < 0.02).all()
    assert log_mu[0] > log_mu[-1]
