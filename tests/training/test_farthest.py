"""The extent of rules about any centre, out of corners alone."""

import numpy as np
import pytest

from skanfis.training.farthest import Farthest


def rows(n_rows, seed=0):
    g = np.random.default_rng(seed)
    strengths = g.dirichlet([0.3, 1.0, 1.0], n_rows).T
    return strengths, g.normal(size=(2, n_rows)) * [[3.0], [1e4]] + [[1e3], [-1e5]]


def brute_force(strengths, X, center):
    away = np.abs(X[None] - center[:, :, None])
    return np.max(np.sqrt(strengths)[:, None] * away, axis=2)


@pytest.mark.parametrize("sizes", [[500], [1] * 30 + [470], [20, 480]])
def test_distance_about_any_center_is_that_of_all_rows(sizes):
    strengths, X = rows(500)
    found = Farthest.none(3, np.array([7.0, 0.0]), np.array([0.1, 1e3]))
    other = Farthest.none(3, X.mean(axis=1), X.std(axis=1))
    start = 0
    for place, size in enumerate(sizes):
        part = slice(start, start + size)
        if place % 2:
            other = other.plus_rows(strengths[:, part], X[:, part])
        else:
            found = found.plus_rows(strengths[:, part], X[:, part])
        start += size
    both = found.plus(other)
    g = np.random.default_rng(1)
    for _ in range(20):
        center = X.mean(axis=1) + 3.0 * X.std(axis=1) * g.normal(size=(3, 2))
        assert both.distance(center) == pytest.approx(brute_force(strengths, X, center), rel=1e-11)
    assert max(len(corners.u) for corners in both.above) < 60


def test_rows_on_a_curve_are_thinned_to_a_limit():
    """Where nearly every row is a corner, some go, and the distance hardly changes."""
    x = np.linspace(-3.0, 3.0, 20_000)
    low = 1.0 / (1.0 + np.exp(2.0 * x))
    strengths = np.stack([low, 1.0 - low])
    found = Farthest.none(2, np.zeros(1), np.ones(1)).plus_rows(strengths, x[None])
    assert max(len(corners.u) for corners in [*found.above, *found.below]) <= 256
    for a in (-2.0, 0.1, 1.7):
        center = np.full((2, 1), a)
        expected = brute_force(strengths, x[None], center)
        assert found.distance(center) == pytest.approx(expected, rel=1e-4)
