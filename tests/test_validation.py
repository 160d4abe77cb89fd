"""The checks alone, where the estimator's tests do not reach: blocks, overflow, switches."""

import re

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn import config_context

from skanfis import _validation
from skanfis._validation import (
    check_finite,
    positive_weights,
)

NAMES = ["a", "b"]


def message_of(values, what="X"):
    with pytest.raises(ValueError, match="not finite") as refusal:
        check_finite(values, what, NAMES)
    return str(refusal.value)


@pytest.mark.parametrize("row", [0, 6, 7, 8, 19])
@pytest.mark.parametrize("column", [0, 1])
@pytest.mark.parametrize(
    ("value", "kind"), [(np.nan, "NaN"), (np.inf, "infinity"), (-np.inf, "infinity")]
)
def test_first_place_is_found_in_any_block(monkeypatch, row, column, value, kind):
    monkeypatch.setattr(_validation, "LARGE_BLOCK_ROWS", 7)
    values = np.ones((20, 2))
    values[row, column] = value
    values[19, 1] = value
    message = message_of(values, "y")
    assert message.startswith(f"Input y contains {kind} in column {NAMES[column]!r}")
    assert f"first at row {row};" in message
    expected = 1 + (column == 1 and row < 19)
    assert f"{expected} of its 20 values" in message


def test_infinities_of_both_signs_do_not_pass_for_nan():
    # Their sum is NaN.
    values = np.ones((4, 2))
    values[1, 0], values[2, 0] = np.inf, -np.inf
    message = message_of(values)
    assert "infinity in column 'a', first at row 1; 2 of its 4" in message


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_numbers_so_large_that_their_sum_overflows_are_finite(dtype):
    values = np.full((100, 2), np.finfo(dtype).max)
    check_finite(values, "X", NAMES)
    values[50, 1] = np.nan
    assert "NaN in column 'b', first at row 50" in message_of(values)


def test_check_is_switched_off_with_that_of_scikit_learn():
    with config_context(assume_finite=True):
        check_finite(np.array([[np.nan, 1.0]]), "X", NAMES)


def test_no_mask_where_all_rows_have_weight():
    assert positive_weights(np.array([1e-300, 1.0, 1e300]), 3) is None


def test_mask_of_the_rows_with_weight():
    mask = positive_weights(np.array([0.0, 0.5, -0.0, 2.0, 5e-324]), 5)
    assert_array_equal(mask, [False, True, False, True, True])


@pytest.mark.parametrize("n_kept", [0, 1])
def test_fewer_than_two_rows_with_weight(n_kept):
    weight = np.zeros(9)
    weight[:n_kept] = 3.0
    message = f"sample_weight leaves {n_kept} of 9 rows with a positive weight; at least 2"
    with pytest.raises(ValueError, match=message):
        positive_weights(weight, 9)


def test_first_negative_weight_is_named():
    message = re.escape("Negative values in sample_weight: -0.25 at row 1;")
    with pytest.raises(ValueError, match=message):
        positive_weights(np.array([1.0, -0.25, -7.0]), 3)
