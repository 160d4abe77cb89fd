"""Subtractive clustering against the paper's algorithm, written out densely and row by row."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.cluster import SubtractiveClustering


def unit_box(X):
    """Columns from 0 to 1; constant ones are 0."""
    spread = np.ptp(X, axis=0)
    return (X - X.min(axis=0)) / np.where(spread > 0, spread, 1.0)


def kernel(X, radius):
    """exp(-4 |x_i - x_j|² / radius²) in the unit box, for one radius or one per column."""
    u = unit_box(X) / radius
    return np.exp(-4.0 * ((u[:, None] - u[None]) ** 2).sum(axis=2))


def chiu(X, radius=0.5, squash=1.25, accept=0.5, reject=0.15, weight=None):
    """Chiu (1994), section 2, to the letter: what is passed over gets the potential zero.

    ``reject`` must be positive, or it never ends. Returns the positions of the centres, their
    potentials.
    """
    u = unit_box(X) / radius
    potential = kernel(X, radius) @ (np.ones(len(X)) if weight is None else weight)
    first = potential.max()
    centers, peaks = [], []
    while True:
        k = int(np.argmax(potential))
        peak = potential[k]
        if peak > accept * first or not centers:
            branch = "clear"
        elif peak < reject * first:
            return centers, peaks
        else:
            d_min = min(np.sqrt(((u[k] - u[c]) ** 2).sum()) for c in centers)
            branch = "far" if d_min + peak / first >= 1.0 else "near"
        if branch == "near":
            potential[k] = 0.0
            continue
        centers.append(k)
        peaks.append(peak)
        for i in range(len(X)):
            potential[i] -= peak * np.exp(-4.0 * ((u[i] - u[k]) ** 2).sum() / squash**2)


def cloud(rng):
    """Clusters of several sizes in columns of several units, with a background."""
    centers = rng.uniform(size=(6, 3))
    rows = centers[rng.choice(6, 150, p=[0.4, 0.2, 0.15, 0.1, 0.1, 0.05])]
    rows = rows + 0.07 * rng.normal(size=rows.shape)
    rows[::10] = rng.uniform(size=rows[::10].shape)
    return rows * np.logspace(-2, 3, 3) + np.linspace(-5, 50, 3)


SETTINGS = [
    {},
    {"radius": 0.2},
    {"radius": 0.3, "squash": 0.6, "accept": 0.9, "reject": 1e-6},
    {"radius": 0.25, "squash": 2.0, "accept": 1.0, "reject": 0.05},
    {"radius": np.array([0.2, 0.4, 0.8])},
]


@pytest.mark.theory
@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("seed", range(2))
def test_centers_and_potentials_are_those_of_the_paper(setting, seed):
    rng = np.random.default_rng(seed)
    X, weight = cloud(rng), rng.uniform(0.2, 3.0, 150)
    for w in (None, weight):
        centers, peaks = chiu(X, **setting, weight=w)
        found = SubtractiveClustering(**setting).fit(X, sample_weight=w)
        assert_array_equal(found.cluster_centers_, X[centers])
        assert_allclose(found.potentials_, peaks, rtol=1e-9)
        # exp(-4 |x|^2 / radius^2) is a Gaussian of this deviation.
        width = setting.get("radius", 0.5) * np.ptp(X, axis=0) / np.sqrt(8.0)
        assert_allclose(found.widths_, width, rtol=1e-14)


class TestInvariance:
    # A grid is full of equal potentials, which rounding errors must not decide between.
    @pytest.mark.parametrize("grid", [False, True])
    @pytest.mark.parametrize("units", [[1e6, 1e-6, 1.0], [0.1, 3.0, 1 / 7]])
    def test_units_change_nothing(self, rng, grid, units):
        X = np.stack(np.meshgrid(*3 * [np.linspace(-1, 1, 6)]), -1).reshape(-1, 3)
        X = X if grid else cloud(rng)
        expected = SubtractiveClustering(0.3).fit(X)
        found = SubtractiveClustering(0.3).fit(units * (X + 5.0))
        assert len(found.cluster_centers_) > 5
        assert_allclose(found.cluster_centers_, units * (expected.cluster_centers_ + 5.0))
        assert_allclose(found.potentials_, expected.potentials_, rtol=1e-9)
        assert_allclose(found.widths_, units * expected.widths_, rtol=1e-9)

    def test_constant_column_has_no_influence(self, rng):
        X = cloud(rng)
        expected = SubtractiveClustering(0.3).fit(X)
        found = SubtractiveClustering(0.3).fit(np.insert(X, 1, 7.0, axis=1))
        assert_array_equal(np.delete(found.cluster_centers_, 1, axis=1), expected.cluster_centers_)
        assert_array_equal(found.cluster_centers_[:, 1], 7.0)
        assert found.widths_[1] == 0.0
        # Not even where another value turns up later.
        assert_array_equal(found.predict(np.insert(X, 1, -1e9, axis=1)), expected.labels_)
