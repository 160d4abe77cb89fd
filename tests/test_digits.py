"""Numbers as people read them."""

import numpy as np
import pytest

from skanfis.digits import in_digits, limits_in_digits, percent, range_in_digits, told_apart


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (2213.4, 3, "2210"),
        (-0.0123456, 3, "-0.0123"),
        (-0.0, 3, "0"),
        (1e12, 3, "1000000000000"),
        (3e-7, 3, "3e-07"),
        (0.1 + 0.2, 17, "0.30000000000000004"),
        (np.float32(0.1), 4, "0.1"),
        (-np.inf, 4, "-inf"),
    ],
)
def test_number_has_so_many_digits(value, digits, text):
    assert in_digits(value, digits) == text


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (-1.4e-14, 60.0123456, "0 to 60.0123"),
        (-0.0, 2e-5, "0 to 2e-05"),
        (1.7e9, 1.7e9 + 12.3456789, "1700000000 to 1700000012.3457"),
        (20.5, 20.5, "20.5 to 20.5"),
        (np.float32(0.1), np.float32(63.512345), "0.1 to 63.5123"),
        # Rounded by NumPy it has more digits.
        (np.float64(5.0151e-22), np.float64(5.0161e-22), "5.0151e-22 to 5.0161e-22"),
        (-np.inf, 1.0, "-inf to 1"),
    ],
)
def test_range_has_digits_that_mean_something(low, high, text):
    assert range_in_digits(low, high, 6) == text


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (-2.3812, 2.0013, "-2.39 to 2.01"),
        (0.0, 1.0, "0 to 1"),
        (-120.0, 0.1 + 0.2, "-120 to 1"),
        (1e-12, 1.2345e-11, "1e-12 to 1.24e-11"),
        (1e12 + 0.123, 1e12 + 7.777, "1000000000000.12 to 1000000000007.78"),
        (-np.inf, 1.23456, "-inf to 1.23456"),
        (20.25, 20.25, "20.25 to 20.25"),
    ],
)
def test_limits_are_rounded_outwards(low, high, text):
    assert " to ".join(limits_in_digits(low, high, 3)) == text


def test_numbers_are_told_apart():
    assert told_apart([1e9 + 1, 1e9 + 2], 3) == ["1000000001", "1000000002"]
    assert told_apart([1.0, 1.0, 2.0], 3) == ["1", "1", "2"]


@pytest.mark.parametrize(
    ("part", "told"),
    [(1.0, "100"), (0.995, "99.5"), (0.99995, "99.995"), (0.994, "99"), (0.065, "6.5")],
)
def test_what_is_not_all_is_never_100_percent(part, told):
    assert percent(part) == f"{told} %"
