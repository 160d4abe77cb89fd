"""Policies out of bounds: what is refused, and what is said of rows and of the policy itself."""

import math

import numpy as np
import pytest

from skanfis.policies import check_policy, describe_out_of_bounds, policy_in_words


def test_columns_that_leave_their_range_are_told_with_rows_and_ranges():
    X = np.array([[0.0, 5.0, 1.0], [-1.5, 5.0, 1.0], [2.5, 7.0, 1.0], [3.0, 5.0, 1.0]])
    told = describe_out_of_bounds(X, [0.0, 5.0, 1.0], [2.0, 6.0, 1.0], ["time", "rate", "flat"])
    assert told == (
        "X lies outside the training data: 'time' in 3 of 4 rows (trained on [0, 2], found "
        "[-1.5, 3]); 'rate' in 1 of 4 rows (trained on [5, 6], found [5, 7])."
    )


def test_values_are_told_in_as_many_digits_as_tell_them_apart():
    X = np.array([[1_000_001.5], [1_000_000.25]])
    told = describe_out_of_bounds(X, [999_999.5], [1_000_001.0], ["time"])
    assert "(trained on [999999.5, 1000001], found [1000000, 1000002])" in told


@pytest.mark.parametrize(
    ("policy", "limit", "part"),
    [
        ("extrapolate", 0.5, "'extrapolate' must be one of clip, linear, nan, raise"),
        ("linear", -0.1, "max_extrapolation=-0.1 must be a number"),
        ("linear", math.nan, "max_extrapolation=nan must be a number"),
        ("clip", "far", "max_extrapolation='far' must be a number"),
    ],
)
def test_what_is_no_policy_is_refused(policy, limit, part):
    with pytest.raises(ValueError, match=part):
        check_policy(policy, limit)


def test_policies_in_words():
    assert policy_in_words("nan", 0.5) == policy_in_words("raise", 0.5) == "there is no value"
    assert policy_in_words("linear", 0.0) == policy_in_words("clip", 0.5)
    assert "up to 0.5 of its standard deviations" in policy_in_words("linear", 0.5)
    assert "up to" not in policy_in_words("linear", math.inf)
