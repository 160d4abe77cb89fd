"""Which rows judge."""

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
        folds, is_half = judging_folds(rows)
        assert is_half == (n_rows >= 1000)
        parts = [left_out(rows, grow) for grow, _ in folds]
        left = np.concatenate(parts)
        assert np.unique(left).size == left.size >= min(n_rows, 200)
        if n_rows < 200:
            assert len(folds) == min(n_rows, 5)
            assert max(map(len, parts)) - min(map(len, parts)) <= 1
        assert_judges(rows, folds)

    @pytest.mark.parametrize(
        ("n_groups", "n_folds", "n_judging"),
        [(2, 2, 2), (8, 8, 8), (11, 10, 11), (40, 10, 40), (50, 8, 40), (100, 4, 40), (500, 1, 50)],
    )
    def test_groups_are_left_out_whole(self, rng, n_groups, n_folds, n_judging):
        """Few alone, of many a part."""
        X, y = measured(rng, 3000)
        rows = dealt(X, y, groups=np.arange(3000) % n_groups)
        folds, is_half = judging_folds(rows)
        assert len(folds) == n_folds
        assert not is_half
        left = [left_out(rows, grow) for grow, _ in folds]
        assert np.unique(np.concatenate(left)).size == sum(map(len, left))
        assert np.unique(rows.groups[np.concatenate(left)]).size == n_judging
        for (grow, _), own in zip(folds, left, strict=True):
            assert not np.intersect1d(rows.groups[grow], rows.groups[own]).size
        assert_judges(rows, folds)

    def test_a_run_at_an_end_of_the_range_does_not_judge(self, rng):
        """Each run has its own temperature; the coldest and the hottest are in a fold alone."""
        X, y = measured(rng, 500)
        X[:, 0] = groups = np.arange(500) % 5
        rows = dealt(X, y, groups=groups)
        folds, _ = judging_folds(rows)
        assert len(folds) == 3
        assert_array_equal(np.unique(rows.groups[np.concatenate([j for _, j in folds])]), [1, 2, 3])
        # Of three runs most rows are at an end: the search cannot do without.
        rows = dealt(X[groups < 3], y[groups < 3], groups=groups[groups < 3])
        judges = np.concatenate([judge for _, judge in judging_folds(rows)[0]])
        assert_array_equal(np.sort(judges), np.arange(300))

    def test_rounding_neither_parts_rows_nor_takes_them_out_of_range(self, rng):
        X, y = measured(rng, 120)
        X[:, 1], X[60:], y[60:] = np.sign(X[:, 1]), X[:60], y[:60]
        wobble = X * (1.0 + 2e-16 * rng.integers(-1, 2, X.shape))
        exact, found = dealt(X, y), dealt(wobble, y)
        assert_array_equal(found.sample_weight, exact.sample_weight)
        assert_allclose(found.X, exact.X, atol=1e-12)
        parts = zip(judging_folds(found)[0], judging_folds(exact)[0], strict=True)
        for (_, own), (_, expected) in parts:
            assert_array_equal(own, expected)
        # Nor does the order of the columns, where targets are equal.
        found, exact = (dealt(X[:, order], np.sign(y)).X for order in ([2, 0, 1], [0, 1, 2]))
        assert_allclose(found, exact[:, [2, 0, 1]], atol=1e-12)

    def test_one_row_judges_itself(self, rng):
        (fold,), _ = judging_folds(dealt(*measured(rng)).part([0]))
        assert_array_equal(fold, [[0], [0]])
