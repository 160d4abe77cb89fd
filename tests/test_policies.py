"""What is answered out of range: policies and what is said of them, and limits of outputs."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.policies import TargetRange, describe_out_of_bounds, policy_in_words


def test_values_are_told_in_as_many_digits_as_tell_them_apart():
    X = np.array([[1_000_001.5], [1_000_000.25]])
    told = describe_out_of_bounds(X, [999_999.5], [1_000_001.0], ["time"])
    assert "(trained on [999999.5, 1000001], found [1000000, 1000002])" in told


def test_policies_in_words():
    assert policy_in_words("nan", 0.5) == policy_in_words("raise", 0.5) == "there is no value"
    assert policy_in_words("linear", 0.0) == policy_in_words("clip", 0.5)
    assert "up to 0.5 of its standard deviations" in policy_in_words("linear", 0.5)
    assert "up to" not in policy_in_words("linear", math.inf)


@pytest.mark.parametrize("is_line", [False, True])
@pytest.mark.parametrize("max_extrapolation", [0.0, 0.5, 0.7, 2.0, 8.0, np.inf])
@pytest.mark.parametrize(("offset", "scale"), [(0.0, 1.0), (10.0, 2.0), (-1e3, 1e-6)])
def test_limits_are_the_range_and_a_margin(max_extrapolation, is_line, offset, scale):
    y = np.random.default_rng(0).standard_normal((50, 2)) * [1.0, 5.0]
    own = TargetRange(y.min(axis=0), y.max(axis=0), y.std(axis=0))
    moved = offset + scale * y
    # For each deviation that inputs are followed, half of one at the least, a deviation of the
    # target, or of rules that bend a twentieth of the range.
    unit = moved.std(axis=0) if is_line else np.ptp(moved, axis=0) / 20.0
    margin = max(max_extrapolation, 0.5) * unit
    found = own.change_units(offset, np.full(2, scale)).limits(max_extrapolation, is_line)
    assert_allclose(found, [moved.min(axis=0) - margin, moved.max(axis=0) + margin], rtol=1e-9)


@pytest.mark.parametrize("max_extrapolation", [0.5, np.inf])
def test_limits_that_were_asked_for_come_first(max_extrapolation):
    own = TargetRange(np.array([0.0, 0.0]), np.array([4.0, 4.0]), np.array([1.0, 1.0]))
    asked = own.within(np.array([-0.05, -9.0]), np.array([np.inf, 4.01]), np.empty((0, 2)))
    end = np.inf if max_extrapolation == np.inf else 4.1
    low = -9.0 if max_extrapolation == np.inf else -0.1
    found = asked.limits(max_extrapolation, is_line=False)
    assert_allclose(found, [[-0.05, low], [end, 4.01]], rtol=1e-12)
    moved = asked.change_units(np.array([1.0, 0.0]), np.array([2.0, 0.1]))
    expected = np.array([1.0, 0.0]) + np.array([2.0, 0.1]) * found
    assert_allclose(moved.limits(max_extrapolation, is_line=False), expected, rtol=1e-12)


def test_what_is_known_beyond_what_was_seen_counts_as_seen():
    own = TargetRange(np.array([0.0]), np.array([4.0]), np.array([1.0]))
    nothing = np.array([-np.inf]), np.array([np.inf])
    found = own.within(*nothing, np.array([[6.0], [-2.0]])).limits(0.5, is_line=False)
    assert_allclose(found, [[-2.2], [6.2]], rtol=1e-12)
    found = own.within(np.array([5.0]), np.array([np.inf]), np.empty((0, 1)))
    assert_allclose(found.limits(0.5, is_line=False), [[5.0], [5.125]], rtol=1e-12)
    found = own.within(np.array([-np.inf]), np.array([-3.0]), np.empty((0, 1)))
    assert_allclose(found.limits(0.5, is_line=False), [[-3.175], [-3.0]], rtol=1e-12)


@pytest.mark.parametrize("is_line", [False, True])
def test_nothing_is_predicted_beyond_a_constant_target(is_line):
    own = TargetRange(np.array([3.0]), np.array([3.0]), np.array([1.0]))
    assert_allclose(own.limits(2.0, is_line), [[3.0], [3.0]], rtol=1e-12)


@pytest.mark.parametrize("is_line", [False, True])
def test_a_constant_target_has_no_limits_where_the_tangent_has_no_end(is_line):
    own = TargetRange(np.array([3.0]), np.array([3.0]), np.array([1.0]), upper=9.0)
    np.testing.assert_array_equal(own.limits(np.inf, is_line), [[-np.inf], [9.0]])
