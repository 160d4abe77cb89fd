"""Scales against numpy in longer precision; fingerprints of rows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.blocks import BLOCK_ROWS
from skanfis.learning.data import StandardisedData, column_statistics, fingerprint

# Enough rows for several reads.
N_ROWS = 2 * BLOCK_ROWS + 17


def table(rng, n_rows=N_ROWS):
    return rng.normal(size=(n_rows, 3)) * [1.0, 1e-6, 1e6] + [0.0, 1e-3, -1e7]


@pytest.mark.parametrize("weighted", [False, True])
def test_statistics_are_mean_deviation_and_range(rng, weighted):
    values, weight = table(rng), rng.uniform(0.01, 5.0, N_ROWS) if weighted else None
    found = column_statistics(values, weight)
    mean = np.average(values, axis=0, weights=weight)
    assert_allclose(found.offset, mean, rtol=1e-12, atol=1e-14)
    variance = np.average((values - mean) ** 2, axis=0, weights=weight)
    assert_allclose(found.scale, np.sqrt(variance), rtol=1e-12)
    assert_array_equal(found.minimum, values.min(axis=0))
    assert_array_equal(found.maximum, values.max(axis=0))
    ends = [values.min(axis=0), values.max(axis=0)]
    assert_allclose(found.box, (ends - mean) / np.sqrt(variance), rtol=1e-11)
    assert not found.is_constant.any()


@pytest.mark.parametrize("offset", [1e8, -1e12])
def test_columns_far_from_the_origin_lose_no_digits(rng, offset):
    # Whole numbers, so that adding the offset is exact.
    near = rng.integers(-1000, 1000, (N_ROWS, 2)).astype(float)
    close, far = column_statistics(near), column_statistics(near + offset)
    assert_allclose(far.scale, close.scale, rtol=1e-12)
    assert_allclose(far.offset - offset, close.offset, atol=0.6 * np.spacing(abs(offset)))


def test_constant_column_has_scale_one_and_its_own_value(rng):
    # 0.1 is no binary fraction: the mean of many copies need not be 0.1 to the last bit.
    # 0.1 + 0.2 is the neighbour of 0.3.
    sums = np.where(np.arange(N_ROWS) % 2, 0.3, 0.1 + 0.2)
    still = np.full(N_ROWS, 0.1), np.zeros(N_ROWS), sums
    values = np.column_stack([still[0], rng.normal(size=N_ROWS), *still[1:]])
    found = column_statistics(values, rng.uniform(size=N_ROWS))
    assert_array_equal(found.is_constant, [True, False, True, True])
    assert_array_equal(found.offset[[0, 2, 3]], [0.1, 0.0, 0.3])
    assert_array_equal(found.scale[[0, 2, 3]], 1.0)


def test_part_of_the_rows_keeps_the_scales_of_all(rng):
    values = table(rng, 40)
    whole = StandardisedData.of(values, values[:, :2] ** 2)
    some = np.array([31, 2, 7, 7])
    assert_array_equal(whole.part(some).table(slice(None)), whole.table(some))


@pytest.mark.parametrize("n_columns", [1, 4])
def test_fingerprints_tell_rows_apart_and_know_them_again(rng, n_columns):
    few = rng.normal(size=(n_columns, 300))
    repeated = rng.integers(0, 300, 5000)
    numbers = fingerprint(few[:, repeated])
    # To the last bit, wherever a row stands and whatever is beside it.
    assert_array_equal(numbers, fingerprint(few)[repeated])
    assert np.unique(fingerprint(few)).size == 300
    assert_array_equal(numbers[:7], fingerprint(np.asfortranarray(few[:, repeated[:7]])))
