"""Fuzzy c-means against Bezdek's equations, and against k-means where it becomes that."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.datasets import make_blobs
from sklearn.exceptions import ConvergenceWarning
from sklearn.metrics import adjusted_rand_score

from skanfis.cluster import FuzzyCMeans, _rows
from skanfis.cluster.fuzzy_cmeans import alternate, largest_exponent, log_memberships

ignore_convergence = pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")


def squared_distances(X, centers):
    return ((X[:, None] - centers[None]) ** 2).sum(axis=2)


def memberships(X, centers, m):
    """u_ik = 1 / Σ_l (D_ik / D_il)^(1/(m-1)), as it stands in the book."""
    D = squared_distances(X, centers)
    return 1.0 / ((D[:, :, None] / D[:, None, :]) ** (1.0 / (m - 1.0))).sum(axis=2)


def objective(X, weight, centers, m):
    return (weight[:, None] * memberships(X, centers, m) ** m * squared_distances(X, centers)).sum()


def reduced_objective(X, weight, centers, m):
    """J with the memberships eliminated, Σ_i w_i (Σ_k D_ik^(-1/(m-1)))^(1-m): analytic in c."""
    D = squared_distances(X, centers)
    return weight @ (D ** (-1.0 / (m - 1.0))).sum(axis=1) ** (1.0 - m)


def gradient(X, weight, centers, m):
    """Of the reduced objective, by complex steps."""
    slopes = np.empty_like(centers)
    for place in np.ndindex(centers.shape):
        step = np.zeros(centers.shape, dtype=complex)
        step[place] = 1e-30j
        slopes[place] = reduced_objective(X, weight, centers + step, m).imag / 1e-30
    return slopes


def blobs(n_rows=200, n_columns=2):
    """Three blobs far apart, their labels, and weights."""
    centers = np.array([[0, 0, 0], [10, 2, 0], [3, -9, 5]], dtype=float)[:, :n_columns]
    X, y = make_blobs(n_rows, centers=centers, random_state=0)
    return X, y, np.random.default_rng(1).uniform(0.3, 3.0, n_rows)


class TestMemberships:
    @pytest.mark.parametrize("m", [1.001, 1.1, 1.5, 2.0, 3.0, 40.0])
    def test_formula_in_fifty_digits(self, rng, m):
        D = rng.uniform(0.5, 1.5, (4, 6))
        with localcontext() as context:
            context.prec, context.Emin, context.Emax = 50, -(10**9), 10**9
            exponent = 1 / (Decimal(m) - 1)
            exact = [
                [-sum((Decimal(d) / Decimal(e)) ** exponent for e in row).ln() for d in row]
                for row in D.T
            ]
        # Of log u, which is -1 / (m - 1) times a logarithm that errs by a rounding error.
        assert_allclose(
            log_memberships(D.copy(), m).T,
            np.array(exact, dtype=float),
            rtol=1e-13,
            atol=1e-15 / (m - 1.0),
        )

    @pytest.mark.parametrize("m", [1.0 + 1e-12, 1.01, 2.0, 1e6])
    def test_coincident_points_and_ties_are_shared(self, m):
        D = np.array([[0.0, 1.0], [0.0, 0.0], [4.0, 4.0], [1e-320, 1.0]]).T
        expected = np.array([[1.0, 0.0], [0.5, 0.5], [0.5, 0.5], [1.0, 0.0]])
        found = np.exp(log_memberships(D, m)).T
        assert_array_equal(found[[0, 1, 2]], expected[[0, 1, 2]])
        if m < 3:
            assert_allclose(found[3], expected[3], atol=1e-15)


class TestIteration:
    @pytest.mark.parametrize("m", [1.2, 2.0, 3.5])
    def test_one_step_is_bezdeks(self, rng, m):
        X, weight, centers = rng.normal(size=(60, 3)), rng.uniform(size=60), rng.normal(size=(4, 3))
        pull = weight[:, None] * memberships(X, centers, m) ** m
        scatter = (pull * squared_distances(X, centers)).sum(axis=0)
        found, spread, cost = alternate(X, weight, centers, m)
        assert_allclose(found, pull.T @ X / pull.sum(axis=0)[:, None], rtol=1e-10, atol=1e-12)
        assert_allclose(spread, np.sqrt(scatter / pull.sum(axis=0)), rtol=1e-10)
        assert cost == pytest.approx(scatter.sum(), rel=1e-12)
        assert cost == pytest.approx(reduced_objective(X, weight, centers, m), rel=1e-12)
        # Half the gradient of the reduced objective is what the step sets to zero.
        pulled = -2 * (pull.T @ X - pull.sum(axis=0)[:, None] * centers)
        assert_allclose(gradient(X, weight, centers, m), pulled, rtol=1e-9, atol=1e-10)

    @ignore_convergence
    @pytest.mark.parametrize("m", [1.05, 1.3, 2.0, 4.0])
    def test_objective_never_rises(self, rng, m):
        X, weight = rng.normal(size=(80, 3)), rng.uniform(0.2, 2.0, 80)
        costs = []
        for n_iter in range(1, 25):
            model = FuzzyCMeans(4, m=m, init=X[:4], tol=0.0, max_iter=n_iter)
            model.fit(X, sample_weight=weight)
            assert model.n_iter_ == n_iter
            costs.append(model.inertia_)
        assert (np.diff(costs) <= 1e-13 * costs[0]).all()
        assert costs[-1] < 0.999 * costs[0]

    # At 1.02, u^m of a row far from a cluster is 10^-400 and less.
    @pytest.mark.parametrize("m", [1.02, 2.0])
    @pytest.mark.parametrize("size", [1, 50])
    def test_blocks_change_nothing(self, rng, m, size, monkeypatch):
        X, weight = rng.normal(size=(100, 3)), rng.uniform(size=100)
        centers = np.array([[0, 0, 0], [1, 0, 0], [30, 0, 0]], dtype=float)
        X[:2] = centers[:2]  # no other cluster has any part in these, and they come first
        expected = alternate(X, weight, centers, m)
        monkeypatch.setattr(_rows, "_BLOCK_SIZE", size)
        found = alternate(X, weight, centers, m)
        for a, b in zip(found, expected, strict=True):
            assert_allclose(a, b, rtol=1e-10, atol=1e-13)
            assert np.isfinite(a).all()


class TestClusters:
    @pytest.mark.parametrize("m", [1.1, 2.0, "auto"])
    @pytest.mark.parametrize("n_columns", [2, 3])
    def test_planted_blobs_are_found(self, m, n_columns):
        X, y, _ = blobs(300, n_columns)
        model = FuzzyCMeans(m=m, random_state=0).fit(X)
        assert adjusted_rand_score(y, model.labels_) == 1.0
        for label in range(3):
            mean = X[y == label].mean(axis=0)
            # A hundred rows of unit deviation, and a slight pull from the other blobs.
            assert np.linalg.norm(model.cluster_centers_ - mean, axis=1).min() < 0.3
        assert_array_equal(model.predict(X), model.labels_)
        assert_array_equal(clone(model).fit_predict(X), model.labels_)

    def test_becomes_k_means_as_m_tends_to_one(self, rng):
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


class TestCoincidentCenters:
    def test_noise_in_many_columns_makes_them_coincide_and_is_reported(self, rng):
        X = rng.normal(size=(500, 8))
        with pytest.warns(ConvergenceWarning, match=r"Only 1 of n_clusters=3 .* from m=1\.\d+ on"):
            model = FuzzyCMeans(3, m=2.0, tol=1e-6, random_state=0).fit(X)
        assert_allclose(model.cluster_centers_, np.tile(X.mean(axis=0), (3, 1)), atol=1e-3)

    # With m < m* the mean is unstable, above it is not: seen from a start next to it.
    @pytest.mark.parametrize(("factor", "coincide"), [(0.8, False), (1.25, True)])
    def test_largest_exponent_parts_the_two(self, rng, factor, coincide):
        X = rng.normal(size=(400, 4))
        X -= X.mean(axis=0)
        m = 1.0 + factor * (largest_exponent(X, np.ones(400)) - 1.0)
        model = FuzzyCMeans(2, m=m, init=0.05 * X[:2], tol=1e-7, max_iter=5000)
        if coincide:
            with pytest.warns(ConvergenceWarning, match="Only 1 of n_clusters=2"):
                model.fit(X)
        else:
            model.fit(X)
        assert (np.ptp(model.cluster_centers_, axis=0).max() < 1e-3) == coincide


class TestInvariance:
    # At an offset of 1e8, the data themselves are rounded to 1e-8.
    @pytest.mark.parametrize(
        ("factor", "offset", "rtol"), [(1e6, 0, 1e-9), (1e-6, 0, 1e-9), (1, 1e8, 1e-6)]
    )
    def test_units_and_origin_change_nothing_else(self, factor, offset, rtol):
        X, _, weight = blobs()
        model = FuzzyCMeans(random_state=0)
        expected = clone(model).fit(X, sample_weight=weight)
        found = clone(model).fit(factor * X + offset, sample_weight=weight)
        centers = (found.cluster_centers_ - offset) / factor
        assert_allclose(centers, expected.cluster_centers_, rtol=rtol, atol=rtol)
        assert found.inertia_ == pytest.approx(factor**2 * expected.inertia_, rel=rtol)
        assert_array_equal(found.labels_, expected.labels_)
        assert found.n_iter_ == expected.n_iter_


class TestErrors:
    @pytest.mark.parametrize(
        ("setting", "message"),
        [
            ({"n_clusters": 0}, "'n_clusters' parameter"),
            ({"m": 1.0}, "'m' parameter"),
            ({"m": "two"}, "'m' parameter"),
            ({"tol": -1.0}, "'tol' parameter"),
            ({"max_iter": 0}, "'max_iter' parameter"),
            ({"n_init": 0}, "'n_init' parameter"),
            ({"init": "random"}, "'init' parameter"),
            ({"init": np.zeros((2, 2))}, r"init has shape \(2, 2\), but n_clusters=3"),
            ({"init": np.full((3, 2), np.nan)}, "init contains NaN"),
            ({"n_clusters": 11}, "n_clusters=11 needs as many distinct rows .* there are 10"),
        ],
    )
    def test_bad_parameters(self, rng, setting, message):
        with pytest.raises(ValueError, match=message):
            FuzzyCMeans(**setting).fit(rng.normal(size=(10, 2)))
