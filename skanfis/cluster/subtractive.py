"""Subtractive clustering: the data points with the most others nearby, one after the other."""

from __future__ import annotations

from numbers import Integral, Real
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from .._sklearn import Interval
from ._rows import Clusterer, distance_blocks, nearest

# Potentials that differ by less, relative to the first centre's, are tied: the first row wins.
_TIE = 1e-9


def potentials(points, weight):
    """Potentials of points in units of the radius."""
    blocks = distance_blocks(points, points)
    return np.concatenate([weight @ np.exp(-4.0 * squared) for _, squared in blocks])


class SubtractiveClustering(Clusterer):
    r"""Subtractive clustering: finds the number of clusters and their centres.

    The potential of a row [1]_ counts the rows near it, with every column scaled to 0 to 1,
    :math:`P_i = \sum_j w_j \exp(-4 \| x_i - x_j \|^2 / r^2)`. The highest row becomes a centre, its
    part of all potentials is subtracted, and so on. Time grows with the square of the rows.

    Parameters
    ----------
    radius : float or array-like of shape (n_features,), default=0.5
        Range of influence of a centre, as a part of the range of the data.
    squash : float, default=1.25
        The radius in which a centre takes potential from its neighbours, relative to ``radius``.
    accept, reject : float, default=0.5 and 0.15
        A row becomes a centre if its potential P is more than ``accept`` times that of the first
        centre, P_1. It does not if P is less than ``reject`` times P_1. In between, it does if
        P / P_1 + d / radius >= 1, with d the distance from the nearest centre.
    max_clusters : int or None, default=None
        Most clusters, those of highest potential; None sets no limit.

    Attributes
    ----------
    cluster_centers_ : ndarray of shape (n_clusters, n_features)
        Rows, in the order in which they were found.
    potentials_ : ndarray of shape (n_clusters,)
        Potential of each centre when it was chosen.
    widths_ : ndarray of shape (n_features,)
        Standard deviation of the Gaussian of the potential, in the units of the data.
    labels_ : ndarray of shape (n_samples,)
        The nearest centre of each row, in units of ``widths_``.
    n_features_in_ : int
    feature_names_in_ : ndarray of shape (n_features,)

    References
    ----------
    .. [1] S. L. Chiu, Journal of Intelligent and Fuzzy Systems 2 (1994) 267-278.

    Examples
    --------
    >>> from sklearn.datasets import make_blobs
    >>> from skanfis.cluster import SubtractiveClustering
    >>> X, y = make_blobs(centers=[[0, 0], [0, 8], [8, 8]], random_state=0)
    >>> SubtractiveClustering().fit(X).predict([[1, 7], [-1, 1], [2, 7]]).tolist()
    [0, 1, 0]
    """

    _parameter_constraints: ClassVar[dict] = {
        "radius": [Interval(Real, 0, None, closed="neither"), "array-like"],
        "squash": [Interval(Real, 0, None, closed="neither")],
        "accept": [Interval(Real, 0, 1, closed="right")],
        "reject": [Interval(Real, 0, 1, closed="both")],
        "max_clusters": [Interval(Integral, 1, None, closed="left"), None],
    }

    def __init__(
        self,
        radius: float | ArrayLike = 0.5,
        *,
        squash: float = 1.25,
        accept: float = 0.5,
        reject: float = 0.15,
        max_clusters: int | None = None,
    ) -> None:
        self.radius = radius
        self.squash = squash
        self.accept = accept
        self.reject = reject
        self.max_clusters = max_clusters

    def _find_centers(self, rows, weight):
        radius = self._checked_radius()
        low, high = rows.min(axis=0), rows.max(axis=0)
        self.widths_ = radius * (high - low) / np.sqrt(8.0)
        points = self._in_radii(rows, low + 0.5 * (high - low))
        centers, self.potentials_ = self._highest(points, potentials(points, weight))
        self.cluster_centers_ = rows[centers]

    def _highest(self, points, potential):
        """Positions of the centres in ``points``, in the order of choice, and their potentials.

        The next centre is the highest point that may be one (Chiu 1994). Potential and distance
        never grow, so a point that was passed over cannot become one later.
        """
        first, distance = potential.max(), np.full(points.shape[0], np.inf)
        centers: list[int] = []
        peaks: list[float] = []
        while self.max_clusters is None or len(centers) < self.max_clusters:
            ratio = potential / first
            may = (ratio > self.accept) | ((ratio >= self.reject) & (ratio + distance >= 1.0))
            if not may.any():
                break
            candidates = np.where(may, potential, -np.inf)
            k = int(np.argmax(candidates >= candidates.max() - _TIE * first))
            squared = cdist(points[k : k + 1], points, "sqeuclidean")[0]
            centers.append(k)
            peaks.append(potential[k])
            potential = potential - potential[k] * np.exp(-4.0 / self.squash**2 * squared)
            distance = np.minimum(distance, np.sqrt(squared))
        return centers, np.array(peaks)

    def _checked_radius(self):
        if self.reject > self.accept:
            raise ValueError(f"reject={self.reject!r} must not exceed accept={self.accept!r}.")
        radius = np.asarray(self.radius, dtype=np.float64)
        if radius.ndim and radius.shape != (self.n_features_in_,):
            raise ValueError(
                f"radius has shape {radius.shape}, not {(self.n_features_in_,)}: give one number, "
                "or one per column of X."
            )
        if not (np.isfinite(radius) & (radius > 0)).all():
            raise ValueError(f"radius={self.radius!r} must be positive and finite.")
        return radius

    def _in_radii(self, X, origin):
        """Rows in units of the radius, seen from ``origin``; constant columns are zero."""
        unit = np.sqrt(8.0) * np.where(self.widths_ > 0, self.widths_, np.inf)
        return (X - origin) / unit

    def _labels(self, X):
        origin = self.cluster_centers_[0]
        return nearest(self._in_radii(X, origin), self._in_radii(self.cluster_centers_, origin))
