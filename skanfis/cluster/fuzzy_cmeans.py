r"""Fuzzy c-means by alternating optimisation.

Each step finds the best memberships for fixed centres, then the best centres for these (Bezdek
1981). Distances are relative to that of the nearest centre: as m → 1, their powers would overflow.
"""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import pdist, squareform
from sklearn.base import ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.cluster import kmeans_plusplus
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils import check_array, check_random_state
from sklearn.utils.validation import check_is_fitted

from .._sklearn import Interval, StrOptions
from .._validation import warn_user
from ._rows import Clusterer, check_rows, distance_blocks

# Centres that differ by less than this part of their clusters' spread coincide.
_SAME = 0.01


def memberships(distances, m):
    """Memberships, from squared distances (n_clusters, n_rows)."""
    closest = distances.min(axis=0)
    nearness = np.ones_like(distances)
    np.divide(closest, distances, out=nearness, where=distances > closest)
    # m may be 1: "auto" gives that if all rows are the same.
    nearness **= 1.0 / max(m - 1.0, np.finfo(float).tiny)
    nearness /= nearness.sum(axis=0)
    return nearness


def alternate(points, weight, centers, m):
    """New centres, the root mean square distances from the old ones, and J at the old ones."""
    mass, scatter = np.zeros((2, centers.shape[0], 1))
    moment = np.zeros_like(centers)
    for part, distances in distance_blocks(points, centers):
        pull = memberships(distances, m) ** m
        pull *= weight[part]
        mass += pull.sum(axis=1, keepdims=True)
        scatter += np.einsum("kn,kn->k", pull, distances)[:, np.newaxis]
        moment += pull @ points[part]
    # With m near 1, a centre far from all rows has no mass: it stays where it is.
    has_rows = mass > 0.0
    mass = np.where(has_rows, mass, 1.0)
    new = np.where(has_rows, moment / mass, centers)
    return new, np.sqrt(scatter / mass)[:, 0], float(scatter.sum())


def descend(points, weight, centers, m, tol, max_iter):
    """The objective, centres and spreads at the end, the iterations, and the last one's step."""
    shift, n_iter = np.inf, 0
    while shift > tol and n_iter < max_iter:
        old = centers
        centers, _, _ = alternate(points, weight, old, m)
        shift = float(np.linalg.norm(centers - old, axis=1).max())
        n_iter += 1
    _, spread, objective = alternate(points, weight, centers, m)
    return objective, centers, spread, n_iter, shift


def largest_exponent(points, weight):
    """The m above which all centres fall together at the mean; inf if there is none.

    1 / (1 - 2 λ), λ the largest eigenvalue of Σ_i w_i x_i x_iᵀ / |x_i|² / Σ_i w_i (Yu et al. 2004).
    """
    squares = np.einsum("ij,ij->i", points, points)
    share = np.divide(weight, squares, out=np.zeros_like(weight), where=squares > 0)
    largest = np.linalg.eigvalsh((share * points.T) @ points / weight.sum())[-1]
    return 1.0 / (1.0 - 2.0 * largest) if largest < 0.5 else np.inf


def count_distinct(centers, spread):
    """Number of centres that do not coincide with one before them."""
    apart = squareform(pdist(centers)) > _SAME * np.minimum.outer(spread, spread)
    return sum(apart[k, :k].all() for k in range(centers.shape[0]))


class FuzzyCMeans(ClassNamePrefixFeaturesOutMixin, TransformerMixin, Clusterer):
    r"""Fuzzy c-means: clusters to which every row belongs by degrees.

    Minimises :math:`\sum_i w_i \sum_k u_{ik}^m \, \| x_i - c_k \|^2` over centres and memberships
    of row sum one [1]_. Distances are Euclidean: bring the columns to one scale before.

    Parameters
    ----------
    n_clusters : int, default=3
        Number of clusters.
    m : "auto" or float, default=2.0
        Exponent, greater than 1: the larger, the fuzzier; near 1 it is k-means. From some m on all
        centres fall together [2]_. "auto" is half the way from 1 to there, and at most 2.
    tol : float, default=1e-4
        Stop when no centre moves by more, relative to the spread of the data.
    max_iter : int, default=1000
        Most iterations from one start.
    n_init : int, default=3
        Number of starts, of which the best counts. An array ``init`` is one start.
    init : {"k-means++"} or array-like of shape (n_clusters, n_features), default="k-means++"
        Centres at the start: rows drawn far from each other, or the array.
    random_state : int, RandomState instance or None, default=None
        Seed of the draws of ``init``.

    Attributes
    ----------
    cluster_centers_ : ndarray of shape (n_clusters, n_features)
    inertia_ : float
        The objective, in squared units of the data.
    labels_ : ndarray of shape (n_samples,)
        The cluster of largest membership, which is that of the nearest centre.
    m_ : float
        The exponent.
    n_iter_ : int
        Iterations from the best start.
    n_features_in_ : int
    feature_names_in_ : ndarray of shape (n_features,)

    Warns
    -----
    ConvergenceWarning
        If ``max_iter`` was reached first, or if centres coincide.

    References
    ----------
    .. [1] J. C. Bezdek, "Pattern Recognition with Fuzzy Objective Function Algorithms", 1981.
    .. [2] J. Yu et al., IEEE Transactions on Systems, Man, and Cybernetics B 34 (2004) 634-639.

    Examples
    --------
    >>> from sklearn.datasets import make_blobs
    >>> from skanfis.cluster import FuzzyCMeans
    >>> X, y = make_blobs(centers=[[0, 0], [0, 8]], random_state=0)
    >>> clustering = FuzzyCMeans(n_clusters=2, random_state=0).fit(X)
    >>> clustering.transform([[0, 0], [0, 4]]).sum(axis=1).round(6).tolist()
    [1.0, 1.0]
    """

    _parameter_constraints: ClassVar[dict] = {
        "n_clusters": [Interval(Integral, 1, None, closed="left")],
        "m": [StrOptions({"auto"}), Interval(Real, 1, None, closed="neither")],
        "tol": [Interval(Real, 0, None, closed="left")],
        "max_iter": [Interval(Integral, 1, None, closed="left")],
        "n_init": [Interval(Integral, 1, None, closed="left")],
        "init": [StrOptions({"k-means++"}), "array-like"],
        "random_state": ["random_state"],
    }

    def __init__(
        self,
        n_clusters: int = 3,
        *,
        m: Any = 2.0,
        tol: float = 1e-4,
        max_iter: int = 1000,
        n_init: int = 3,
        init: str | ArrayLike = "k-means++",
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.n_clusters = n_clusters
        self.m = m
        self.tol = tol
        self.max_iter = max_iter
        self.n_init = n_init
        self.init = init
        self.random_state = random_state

    def _find_centers(self, rows, weight):
        if rows.shape[0] < self.n_clusters:
            raise ValueError(
                f"n_clusters={self.n_clusters} needs as many distinct rows with positive weight, "
                f"but there are {rows.shape[0]} (n_samples={rows.shape[0]}). Use fewer clusters."
            )
        mean = np.average(rows, axis=0, weights=weight)
        points = rows - mean
        scale = np.sqrt(np.average(np.einsum("ij,ij->i", points, points), weights=weight)) or 1.0
        points /= scale
        largest = largest_exponent(points, weight)
        self.m_ = float(min(2.0, 0.5 * (1.0 + largest)) if self.m == "auto" else self.m)
        starts = self._starts(points, weight, mean, scale)
        runs = [descend(points, weight, c, self.m_, self.tol, self.max_iter) for c in starts]
        objective, centers, spread, self.n_iter_, shift = min(runs, key=lambda run: run[0])
        n_distinct = count_distinct(centers, spread)
        if shift > self.tol:
            warn_user(
                f"FuzzyCMeans did not converge within max_iter={self.max_iter}: in the last "
                f"iteration, a centre moved by {shift:.2g} times the spread of the data, more than "
                f"tol={self.tol:g}. Increase max_iter or tol.",
                ConvergenceWarning,
            )
        if n_distinct < self.n_clusters:
            warn_user(
                f"Only {n_distinct} of n_clusters={self.n_clusters} centres are distinct. Use "
                f"fewer clusters, or a smaller m than {self.m_:g} (on these data, centres near the "
                f"mean coincide from m={largest:.3g} on).",
                ConvergenceWarning,
            )
        self.cluster_centers_ = mean + scale * centers
        self.inertia_ = scale**2 * objective
        self._n_features_out = self.n_clusters

    def transform(self, X: ArrayLike) -> Any:
        """Find the memberships.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        memberships : ndarray of shape (n_samples, n_clusters)
            With sum one in every row.
        """
        check_is_fitted(self)
        X = check_rows(self, X)
        found = np.empty((X.shape[0], self.n_clusters))
        for part, distances in distance_blocks(X, self.cluster_centers_):
            found[part] = memberships(distances, self.m_).T
        return found

    def _starts(self, points, weight, mean, scale):
        """Centres to start from, on the scale of ``points``."""
        if not isinstance(self.init, str):
            centers = check_array(self.init, dtype=np.float64, input_name="init")
            if centers.shape != (self.n_clusters, points.shape[1]):
                raise ValueError(
                    f"init has shape {centers.shape}, not {(self.n_clusters, points.shape[1])}: "
                    "give one row per cluster, with one number per column of X."
                )
            return [(centers - mean) / scale]
        random_state = check_random_state(self.random_state)
        settings = {"sample_weight": weight, "random_state": random_state}
        return [kmeans_plusplus(points, self.n_clusters, **settings)[0] for _ in range(self.n_init)]
