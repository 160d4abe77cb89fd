"""Scales against numpy in longer precision; reading, blocks, weights and memory maps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.blocks import BLOCK_ROWS
from skanfis.learning.data import (
    _BLOCKS_PER_CHUNK,
    StandardisedData,
    column_statistics,
    fingerprint,
)

# Enough rows for several reads.
N_ROWS = 2 * BLOCK_ROWS + 17


def table(rng, n_rows=N_ROWS):
    return rng.normal(size=(n_rows, 3)) * [1.0, 1e-6, 1e6] + [0.0, 1e-3, -1e7]


def fields(scale):
    return np.stack([scale.offset, scale.scale, scale.minimum, scale.maximum])


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
    values = np.column_stack([np.full(N_ROWS, 0.1), rng.normal(size=N_ROWS), np.zeros(N_ROWS)])
    found = column_statistics(values, rng.uniform(size=N_ROWS))
    assert_array_equal(found.is_constant, [True, False, True])
    assert_array_equal(found.offset[[0, 2]], [0.1, 0.0])
    assert_array_equal(found.scale[[0, 2]], 1.0)


def test_column_that_varies_by_less_than_floats_can_halve_has_scale_one():
    found = column_statistics(np.array([[0.0], [5e-324]]))
    assert not found.is_constant[0]
    assert found.scale[0] == 1.0


def test_sums_that_overflow_on_either_side_are_taken_again():
    # One block of rows adds up to infinity, the next to minus infinity.
    n, largest = BLOCK_ROWS, 1.7e308
    found = column_statistics(np.repeat([0.0, largest, -largest], [1, n, n])[:, None])
    assert_allclose(found.offset / largest, 0.0, atol=1e-12)
    assert_allclose(found.scale / largest, np.sqrt(2 * n / (2 * n + 1)), rtol=1e-12)


def test_part_of_the_rows_keeps_scales_weights_and_groups(rng):
    values, weight = table(rng, 40), rng.uniform(0.5, 2.0, 40)
    whole = StandardisedData.of(values, values[:, :2] ** 2, weight, groups=np.arange(40) // 4)
    some = np.array([31, 2, 7, 7])
    part = whole.part(some)
    assert_array_equal(part.table(slice(None)), whole.table(some))
    assert_array_equal(part.sample_weight, weight[some])
    assert_array_equal(part.groups, some // 4)
    plain = StandardisedData.of(values, values).part(some)
    assert plain.sample_weight is None
    assert plain.groups is None


def test_read_standardises_and_transposes(rng):
    X, y, weight = table(rng, 100), rng.normal(size=(100, 2)) * 5 + 3, rng.uniform(0.1, 2.0, 100)
    data = StandardisedData.of(X, y, weight)
    part = slice(10, 40)
    Z, target, read_weight = data.read(part)
    z = (X[part] - data.inputs.offset) / data.inputs.scale
    t = (y[part] - data.targets.offset) / data.targets.scale
    assert_array_equal(Z, z.T)
    assert_array_equal(target, t.T)
    assert_array_equal(read_weight, weight[part])
    assert Z.flags.c_contiguous
    assert_array_equal(data.table(part), np.hstack([z, t]))
    assert StandardisedData.of(X, y).read(part)[2] is None


@pytest.mark.parametrize("n_columns", [1, 4])
def test_fingerprints_tell_rows_apart_and_know_them_again(rng, n_columns):
    few = rng.normal(size=(n_columns, 300))
    repeated = rng.integers(0, 300, 5000)
    numbers = fingerprint(few[:, repeated])
    # To the last bit, wherever a row stands and whatever is beside it.
    assert_array_equal(numbers, fingerprint(few)[repeated])
    assert np.unique(fingerprint(few)).size == 300
    assert_array_equal(numbers[:7], fingerprint(np.asfortranarray(few[:, repeated[:7]])))


@pytest.mark.parametrize("n_rows", [1, 127, 128, 129, 5000])
@pytest.mark.parametrize("block_rows", [1, 128, 10_000])
def test_chunks_cover_every_row_once_in_order(n_rows, block_rows):
    data = StandardisedData.of(np.zeros((n_rows, 1)), np.zeros((n_rows, 1)))
    chunks = data.chunks(block_rows)
    parts = [part for chunk in chunks for part in chunk]
    assert_array_equal(np.concatenate([np.arange(n_rows)[p] for p in parts]), np.arange(n_rows))
    assert max(p.stop - p.start for p in parts) <= block_rows
    assert max(map(len, chunks)) <= _BLOCKS_PER_CHUNK
