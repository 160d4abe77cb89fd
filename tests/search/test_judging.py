"""Which rows judge, and that nothing but what they say decides on it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning.data import StandardisedData
from skanfis.search.judging import dealt_rows, judging_folds


def measured(rng, n_rows=60):
    X = rng.normal(size=(n_rows, 3))
    return X, np.sin(X[:, :1]) + 0.1 * rng.normal(size=(n_rows, 1))


def dealt(X, y, weight=None, groups=None):
    return dealt_rows(StandardisedData.of(X, y, weight, groups))


class TestDealtRows:
    def test_their_order_is_of_what_the_rows_say(self, rng):
        """In other units and another order, with columns in another order and a constant one."""
        X, y = measured(rng)
        y = np.hstack([y, X[:, :1] ** 2])
        plain = dealt(X, y)
        other = np.insert(1e3 * X[::-1, [2, 0, 1]] + 7.0, 0, 4.0, axis=1)
        found = dealt(other, 1e-6 * y[::-1, ::-1] - 5.0)
        assert_allclose(found.X[:, [2, 3, 1]], plain.X, atol=1e-9)
        assert_allclose(found.y[:, ::-1], plain.y, atol=1e-9)

    def test_weights_are_repeats(self, rng):
        X, y = measured(rng)
        times = rng.integers(1, 4, len(y))
        weighted = dealt(X, y, times.astype(float))
        repeated = dealt(X.repeat(times, 0), y.repeat(times, 0))
        assert_allclose(repeated.X, weighted.X, atol=1e-9)
        assert_array_equal(repeated.sample_weight, weighted.sample_weight)

    def test_none_is_lost_and_every_part_of_them_is_random(self, rng):
        X, y = measured(rng, 400)
        found = dealt(X, y)
        standard = (y[:, 0] - y.mean()) / y.std()
        assert_allclose(np.sort(found.y[:, 0]), np.sort(standard), atol=1e-9)
        # The mean of a half is off by 1 / sqrt(400) of a deviation; the rows came sorted.
        assert abs(found.y[:200].mean()) < 0.15
        assert abs(np.corrcoef(found.y[1:, 0], found.y[:-1, 0])[0, 1]) < 0.15


def left_out(rows, grow):
    return np.setdiff1d(np.arange(rows.n_rows), grow)


def in_range(rows, grow):
    """Of the rows left out, those in the range of the others."""
    left = left_out(rows, grow)
    low, high = rows.X[grow].min(axis=0), rows.X[grow].max(axis=0)
    return left[((rows.X[left] >= low) & (rows.X[left] <= high)).all(axis=1)]


def assert_judges(rows, folds):
    """Of those left out, the ones in the range of the others judge, where most of all are."""
    left, inside = ([of(rows, grow) for grow, _ in folds] for of in (left_out, in_range))
    expected = inside if 2 * sum(map(len, inside)) >= sum(map(len, left)) else left
    for (_, judge), own in zip(folds, expected, strict=True):
        assert_array_equal(np.sort(judge), own)


class TestSplits:
    @pytest.mark.parametrize("n_rows", [2, 4, 37, 150, 400, 999, 1000, 3001])
    def test_each_row_is_left_out_once_or_two_hundred_are(self, rng, n_rows):
        rows = dealt(*measured(rng, n_rows))
        folds = judging_folds(rows)
        parts = [left_out(rows, grow) for grow, _ in folds]
        left = np.concatenate(parts)
        assert np.unique(left).size == left.size >= min(n_rows, 200)
        if n_rows < 200:
            assert len(folds) == min(n_rows, 5)
            assert max(map(len, parts)) - min(map(len, parts)) <= 1
        assert_judges(rows, folds)

    @pytest.mark.parametrize(("n_groups", "n_folds"), [(2, 2), (4, 4), (23, 5)])
    def test_groups_are_left_out_whole(self, rng, n_groups, n_folds):
        X, y = measured(rng, 3000)
        rows = dealt(X, y, groups=rng.integers(0, n_groups, 3000))
        folds = judging_folds(rows)
        assert len(folds) == n_folds
        left = [left_out(rows, grow) for grow, _ in folds]
        assert_array_equal(np.sort(np.concatenate(left)), np.arange(3000))
        for (grow, _), own in zip(folds, left, strict=True):
            assert not np.intersect1d(rows.groups[grow], rows.groups[own]).size
        assert_judges(rows, folds)

    def test_a_run_at_an_end_of_the_range_does_not_judge(self, rng):
        """Each run has its own temperature; the coldest and the hottest are in a fold alone."""
        X, y = measured(rng, 500)
        X[:, 0] = groups = np.arange(500) % 5
        rows = dealt(X, y, groups=groups)
        folds = judging_folds(rows)
        assert len(folds) == 3
        assert_array_equal(np.unique(rows.groups[np.concatenate([j for _, j in folds])]), [1, 2, 3])
        # Of three runs most rows are at an end: the search cannot do without.
        rows = dealt(X[groups < 3], y[groups < 3], groups=groups[groups < 3])
        assert_array_equal(
            np.sort(np.concatenate([j for _, j in judging_folds(rows)])), np.arange(300)
        )

    def test_one_row_judges_itself(self, rng):
        (fold,) = judging_folds(dealt(*measured(rng)).part([0]))
        assert_array_equal(fold, [[0], [0]])
