"""Rows that stand for many, and how many there are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning.data import StandardisedData
from skanfis.search import representative_rows
from skanfis.search.sample import search_sample


def many(rng):
    """Rows of whole numbers, some of them equal, with whole weights."""
    X = rng.integers(0, 12, (300, 2)).astype(float)
    y = rng.integers(0, 3, (300, 1)).astype(float)
    return X, y, rng.integers(1, 6, 300)


class TestRepresentativeRows:
    def test_few_rows_stand_for_themselves(self, rng):
        X, y, times = many(rng)
        rows = StandardisedData.of(X, y, times.astype(float))
        table, share, _ = representative_rows(rows, 10_000)
        table = table * np.append(rows.inputs.scale, rows.targets.scale)
        table += np.append(rows.inputs.offset, rows.targets.offset)
        expected, group = np.unique(np.hstack([X, y]), axis=0, return_inverse=True)
        order = np.lexsort(np.round(table).T[::-1])
        assert_allclose(table[order], expected, atol=1e-9)
        own = np.bincount(group.ravel(), weights=times) / times.sum()
        assert_allclose(share[order] / share.sum(), own, rtol=1e-12)
        assert len(table) < len(X)

    def test_many_rows_are_thinned_evenly(self, rng):
        X = rng.normal(size=(5000, 2))
        y = X.sum(axis=1, keepdims=True)
        rows = StandardisedData.of(X, y)
        table, weight, _ = representative_rows(rows, 500)
        assert len(table) <= 500
        assert weight.sum() == 500
        every = {row.tobytes() for row in rows.table(slice(None))}
        assert all(row.tobytes() in every for row in table)
        # A sample of independent rows would be off by 1 / sqrt(500), 0.045.
        assert_allclose(np.average(table, axis=0, weights=weight), 0.0, atol=0.15)
        assert_allclose(np.average(table**2, axis=0, weights=weight), 1.0, atol=0.2)


class TestCounts:
    @pytest.mark.parametrize("unit", [1e-300, 1e-6, 0.5])
    def test_weights_below_one_count_by_the_precision_they_leave(self, rng, unit):
        # Kish: of equal weights every row counts; of a half with next to none, half of them.
        X, y, times = many(rng)
        whole = StandardisedData.of(X, y, times.astype(float))
        assert whole.effective_weight == times.sum()
        even = StandardisedData.of(X, y, np.full(300, unit))
        assert_allclose(even.effective_weight, 300.0, rtol=1e-12)
        half = StandardisedData.of(X, y, np.where(np.arange(300) < 150, unit, 1e-9 * unit))
        assert_allclose(half.effective_weight, 150.0, rtol=1e-6)

    def test_a_search_knows_the_group_of_each_of_its_rows(self, rng):
        X, y = rng.normal(size=(500, 2)), rng.normal(size=(500, 1))
        rows = StandardisedData.of(X, y, groups=np.arange(500))
        sample = search_sample(rows, 60)
        assert sample.n_rows == 60
        assert_array_equal(np.hstack([sample.X, sample.y]), rows.table(sample.groups))
        # What two runs have in common is a row of each, whichever comes first.
        run = np.repeat([0, 1], 250)
        every = np.column_stack([np.tile(X[:250], (2, 1)), np.tile(y[:250], (2, 1)), run])
        for one in (every, every[::-1]):
            found = search_sample(StandardisedData.of(one[:, :2], one[:, 2:3], groups=one[:, 3]))
            assert_array_equal(found.groups, np.tile([0, 1], 250))
