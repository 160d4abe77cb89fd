"""Fuzzy c-means against Bezdek's equations, and against k-means where it becomes that."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning

from skanfis.cluster import FuzzyCMeans, _rows, fuzzy_cmeans
from skanfis.cluster.fuzzy_cmeans import alternate, largest_exponent


def squared_distances(X, centers):
    return ((X[:, None] - centers[None]) ** 2).sum(axis=2)


def memberships(X, centers, m):
    """u_ik = 1 / Σ_l (D_ik / D_il)^(1/(m-1)), as it stands in the book."""
    D = squared_distances(X, centers)
    return 1.0 / ((D[:, :, None] / D[:, None, :]) ** (1.0 / (m - 1.0))).sum(axis=2)


def reduced_objective(X, weight, centers, m):
    """J with the memberships eliminated, Σ_i w_i (Σ_k D_ik^(-1/(m-1)))^(1-m): analytic in c."""
    D = squared_distances(X, centers)
    return weight @ (D ** (-1.0 / (m - 1.0))).sum(axis=1) ** (1.0 - m)


@pytest.mark.parametrize("m", [1.0 + 1e-12, 2.0, 1e6])
def test_coincident_points_and_ties_are_shared(m):
    D = np.array([[0.0, 1.0], [0.0, 0.0], [4.0, 4.0], [1e-320, 1.0]]).T
    expected = np.array([[1.0, 0.0], [0.5, 0.5], [0.5, 0.5], [1.0, 0.0]])
    found = fuzzy_cmeans.memberships(D, m).T
    assert_array_equal(found[[0, 1, 2]], expected[[0, 1, 2]])
    if m < 3:
        assert_allclose(found[3], expected[3], atol=1e-15)


class TestIteration:
    @pytest.mark.parametrize("m", [1.2, 2.0, 3.5])
    @pytest.mark.parametrize("block_size", [50, 10_000])
    def test_one_step_is_bezdeks(self, rng, m, block_size, monkeypatch):
        monkeypatch.setattr(_rows, "_BLOCK_SIZE", block_size)
        X, weight, centers = rng.normal(size=(60, 3)), rng.uniform(size=60), rng.normal(size=(4, 3))
        pull = weight[:, None] * memberships(X, centers, m) ** m
        scatter = (pull * squared_distances(X, centers)).sum(axis=0)
        found, spread, cost = alternate(X, weight, centers, m)
        assert_allclose(found, pull.T @ X / pull.sum(axis=0)[:, None], rtol=1e-10, atol=1e-12)
        assert_allclose(spread, np.sqrt(scatter / pull.sum(axis=0)), rtol=1e-10)
        assert cost == pytest.approx(scatter.sum(), rel=1e-12)
        assert cost == pytest.approx(reduced_objective(X, weight, centers, m), rel=1e-12)

    def test_a_centre_that_no_row_belongs_to_stays(self, rng):
        X, weight = rng.normal(size=(100, 2)), np.ones(100)
        centers = np.array([[0.0, 0.0], [30.0, 0.0]])
        found, spread, cost = alternate(X, weight, centers, 1.0001)
        assert_allclose(found, [X.mean(axis=0), centers[1]])
        assert spread[1] == 0.0
        assert cost == pytest.approx(np.sum(X**2))


def test_becomes_k_means_as_m_tends_to_one(rng):
    X, weight = rng.normal(size=(300, 3)), rng.uniform(0.5, 2.0, 300)
    hard = KMeans(4, init=X[:4], n_init=1, tol=0).fit(X, sample_weight=weight)
    errors = []
    for m in (1.1, 1.01, 1.001, 1.0 + 1e-9):
        soft = FuzzyCMeans(4, m=m, init=hard.cluster_centers_, tol=1e-10)
        soft.fit(X, sample_weight=weight)
        errors.append(np.abs(soft.cluster_centers_ - hard.cluster_centers_).max())
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-9
    assert_array_equal(soft.labels_, hard.labels_)
    assert soft.inertia_ == pytest.approx(hard.inertia_, rel=1e-9)


# With m < m* the mean is unstable, above it is not: seen from a start next to it.
@pytest.mark.parametrize(("factor", "coincide"), [(0.8, False), (1.25, True)])
def test_largest_exponent_parts_the_two(rng, factor, coincide):
    X = rng.normal(size=(400, 4))
    X -= X.mean(axis=0)
    largest = largest_exponent(X, np.ones(400))
    m = 1.0 + factor * (largest - 1.0)
    model = FuzzyCMeans(2, m=m, init=0.05 * X[:2], tol=1e-7, max_iter=5000)
    if coincide:
        told = f"Only 1 of n_clusters=2 .* from m={largest:.3g} on"
        with pytest.warns(ConvergenceWarning, match=told):
            model.fit(X)
    else:
        model.fit(X)
    assert (np.ptp(model.cluster_centers_, axis=0).max() < 1e-3) == coincide
    assert largest < 3.0
    # About the mean by weight.
    more = np.append(X, X[:100], axis=0)
    weight = np.append(np.full(100, 2.0), np.ones(300))
    largest = largest_exponent(more - more.mean(axis=0), np.ones(500))
    model = FuzzyCMeans(2, m="auto", n_init=1).fit(X, sample_weight=weight)
    assert model.m_ == pytest.approx((1.0 + largest) / 2.0)
