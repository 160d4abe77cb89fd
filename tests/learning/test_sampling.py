"""The sample of many rows is the one that brute force picks, however the rows are cut."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning.data import StandardisedData, place_in_sample
from skanfis.learning.sampling import with_sample

N_ROWS, N_WANTED = 9000, 400


@pytest.fixture
def rows():
    g = np.random.default_rng(0)
    X = g.normal(size=(N_ROWS, 2)) * [1.0, 30.0] + [0.0, 1e4]
    y, groups = X[:, :1] * X[:, 1:] + g.normal(size=(N_ROWS, 1)), g.integers(0, 7, N_ROWS)
    return StandardisedData.of(X, y, groups=groups)


def table(rows):
    """Rows with their weights and groups, in lexical order."""
    whole = np.column_stack([rows.X, rows.y, rows.weights, rows.groups])
    return whole[np.lexsort(whole.T)]


def test_sample_is_the_rows_of_the_smallest_numbers(rows):
    numbers = (8192.0 * place_in_sample(*rows.read(slice(None))[:2])) % 1.0
    picked = np.argsort(numbers)[:N_WANTED]
    assert_array_equal(table(with_sample(rows, N_WANTED).sample), table(rows.part(picked)))


def test_order_and_units_of_rows_and_columns_do_not_matter(rows):
    found = table(with_sample(rows, N_WANTED).sample)
    mixed = np.random.default_rng(1).permutation(N_ROWS)
    other = StandardisedData.of(
        rows.X[mixed, ::-1] * [1e3, 1e-6], rows.y[mixed], groups=rows.groups[mixed]
    )
    sample = with_sample(other, N_WANTED).sample
    back = replace(sample, X=(sample.X / [1e3, 1e-6])[:, ::-1])
    assert_allclose(table(back), found, rtol=1e-12)


@pytest.mark.parametrize("n_distinct", [300, 2000])
def test_repeats_are_one_row_of_their_weight(rows, n_distinct, rng):
    more = rng.integers(0, n_distinct, N_ROWS - n_distinct)
    which = np.concatenate([np.arange(n_distinct), more])
    weight = rng.uniform(0.5, 1.5, N_ROWS)
    repeated = StandardisedData.of(rows.X[which], rows.y[which], weight)
    sample = with_sample(repeated, N_WANTED).sample
    assert sample.n_rows == min(N_WANTED, n_distinct)
    places = [np.flatnonzero((rows.X[:n_distinct] == x).all(axis=1))[0] for x in sample.X]
    totals = np.bincount(which, weights=weight)
    assert_allclose(sample.sample_weight, totals[places], rtol=1e-12)


def test_sample_is_representative(rows):
    # Kolmogorov's distance of 400 of 9,000 rows is below 1.63 / sqrt(400) in 99 of 100 draws.
    sample = with_sample(rows, N_WANTED).sample
    for column, drawn in zip(rows.table(slice(None)).T, sample.table(slice(None)).T, strict=True):
        below = np.searchsorted(np.sort(column), np.sort(drawn)) / N_ROWS
        assert np.max(np.abs(below - np.arange(N_WANTED) / N_WANTED)) < 1.63 / np.sqrt(N_WANTED)
