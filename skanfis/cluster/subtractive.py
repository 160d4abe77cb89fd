r"""Subtractive clustering: data points that many others are near to, one after the other.

With ratios P_i / P_1 of potentials to that of the first centre, and distances from the nearest
centre in radii, the point of highest potential becomes the next centre if ratio > accept, or if
ratio >= reject and ratio + distance >= 1 (Chiu 1994). Neither ever grows: a point that was passed
over could not be accepted later. The next centre is therefore simply the highest among the points
that may be one, and the search ends where there is none.
"""

from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator

from .._sklearn import Interval, fit_context
from ..blocks import row_blocks
from ._rows import NearestCenterMixin, check_rows, distinct_rows, nearest

__all__ = ["SubtractiveClustering"]

# Rows and columns of a block of the kernel matrix: 512 kB, at home in the second-level cache.
_BLOCK_ROWS = 256
# Potentials this near, relative to the first centre's, differ by rounding: on a regular grid the
# first of several equals must win whatever the units of the data and the size of the blocks.
_TIE = 1e-9


def potentials(points, weight):
    """P for points in units of the radius, by blocks of the kernel matrix above its diagonal.

    -4 |x - y|² = 8 x·y - 4 |x|² - 4 |y|² is one matrix product of points with two more columns.
    """
    squares = -4.0 * np.einsum("ij,ij->i", points, points)[:, np.newaxis]
    ones = np.ones_like(squares)
    left = np.hstack([8.0 * points, squares, ones])
    right = np.hstack([points, ones, squares])
    blocks = row_blocks(points.shape[0], _BLOCK_ROWS)
    total = np.zeros(points.shape[0])
    for place, rows in enumerate(blocks):
        for columns in blocks[place:]:
            kernel = left[rows] @ right[columns].T
            np.exp(kernel, out=kernel)
            total[rows] += kernel @ weight[columns]
            if columns != rows:
                total[columns] += weight[rows] @ kernel
    return total


def find_centers(points, potential, *, squash, accept, reject, max_clusters):
    """Positions of the centres in ``points``, as they were chosen, and their potentials."""
    first = potential.max()
    distance = np.full(points.shape[0], np.inf)
    centers: list[int] = []
    peaks: list[float] = []
    while len(centers) < max_clusters:
        ratio = potential / first
        may = (ratio > accept) | ((ratio >= reject) & (ratio + distance >= 1.0))
        if not may.any():
            break
        candidates = np.where(may, potential, -np.inf)
        k = int(np.argmax(candidates >= candidates.max() - _TIE * first))
        squared = cdist(points[k : k + 1], points, "sqeuclidean")[0]
        centers.append(k)
        peaks.append(potential[k])
        potential = potential - potential[k] * np.exp(-4.0 / squash**2 * squared)
        distance = np.minimum(distance, np.sqrt(squared))
    return centers, np.array(peaks)


class SubtractiveClustering(NearestCenterMixin, BaseEstimator):
    r"""Subtractive clustering: finds the number of clusters and their centres.

    Each row is a possible centre. Its potential [1]_ counts the rows near it,

    .. math:: P_i = \sum_j w_j \, e^{-4 \, \| x_i - x_j \|^2 / r_a^2} ,

    with every column scaled to the range 0 to 1 and :math:`r_a` the ``radius``. The row of highest
    potential is the first centre. What it explains, :math:`P_k \, e^{-4 \, \| x_i - x_k \|^2 /
    r_b^2}` with :math:`r_b = \mathrm{squash} \cdot r_a`, is subtracted from all potentials, and the
    highest row that is left is the next, as long as its potential is high, or not too low and the
    row far enough from all centres (see ``accept`` and ``reject``). The defaults are those of
    MATLAB's ``subclust``. The result does not depend on units, on the order of the rows, nor on
    chance.

    Parameters
    ----------
    radius : float or array-like of shape (n_features,), default=0.5
        Range of influence of a centre, as a part of the range of the data, for all columns or each.
        A smaller radius finds more clusters. Distances grow with the square root of the number of
        columns, and so should the radius: 0.5 is for two or three.
    squash : float, default=1.25
        The radius in which a centre takes potential from its neighbours, relative to ``radius``.
        More than one keeps centres apart.
    accept, reject : float, default=0.5 and 0.15
        A row becomes a centre if its potential is more than ``accept`` times that of the first
        centre, and does not if it is less than ``reject`` times that. In between it does if
        P / P_1 + d / radius >= 1, with d the distance from the nearest centre.
    max_clusters : int or None, default=None
        Most clusters, those of highest potential; None sets no limit.

    Attributes
    ----------
    cluster_centers_ : ndarray of shape (n_clusters, n_features)
        Rows that are centres, in the order in which they were found.
    potentials_ : ndarray of shape (n_clusters,)
        Potential of each centre when it was chosen, from the highest to the lowest.
    widths_ : ndarray of shape (n_features,)
        Radius times range over sqrt(8), in the units of the data: the standard deviation of the
        Gaussian that the potential amounts to. Zero where a column is constant.
    labels_ : ndarray of shape (n_samples,)
        The nearest centre of each row, in units of ``widths_``.
    n_features_in_ : int
        Number of columns.
    feature_names_in_ : ndarray of shape (n_features,)
        Names of the columns, where X had names that are all strings.

    See Also
    --------
    FuzzyCMeans : Clusters of given number, with memberships.

    Notes
    -----
    Time grows with the square of the number of distinct rows. A constant column has no influence.

    References
    ----------
    .. [1] S. L. Chiu, "Fuzzy model identification based on cluster estimation", Journal of
       Intelligent and Fuzzy Systems 2 (1994) 267-278.

    Examples
    --------
    >>> from sklearn.datasets import make_blobs
    >>> from skanfis.cluster import SubtractiveClustering
    >>> X, y = make_blobs(centers=[[0, 0], [0, 8], [8, 8]], random_state=0)
    >>> clustering = SubtractiveClustering().fit(X)
    >>> len(clustering.cluster_centers_)
    3
    >>> clustering.predict([[1, 7], [-1, 1], [2, 7]]).tolist()
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

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: ArrayLike, y: Any = None, sample_weight: ArrayLike | None = None) -> Self:
        """Find the clusters.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Data, in any units.
        y : None
            Not used.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive; a whole number counts as so many copies of the row.

        Returns
        -------
        self : SubtractiveClustering
        """
        X = check_rows(self, X, reset=True)
        rows, weight = distinct_rows(X, sample_weight)
        radius = self._checked_radius()
        low, high = rows.min(axis=0), rows.max(axis=0)
        self.widths_ = radius * (high - low) / np.sqrt(8.0)
        points = self._in_radii(rows, low + 0.5 * (high - low))
        centers, self.potentials_ = find_centers(
            points,
            potentials(points, weight),
            squash=self.squash,
            accept=self.accept,
            reject=self.reject,
            max_clusters=rows.shape[0] if self.max_clusters is None else self.max_clusters,
        )
        self.cluster_centers_ = rows[centers]
        self.labels_ = self._labels(X)
        return self

    def _checked_radius(self):
        if self.reject > self.accept:
            raise ValueError(
                f"reject={self.reject!r} exceeds accept={self.accept!r}: no row could be in "
                "between. Give a reject of at most accept."
            )
        radius = np.asarray(self.radius, dtype=np.float64)
        if radius.ndim and radius.shape != (self.n_features_in_,):
            raise ValueError(
                f"radius has shape {radius.shape}, but X has {self.n_features_in_} columns: give "
                "one number, or one per column."
            )
        if not (np.isfinite(radius) & (radius > 0)).all():
            raise ValueError(f"radius={self.radius!r} must be positive and finite everywhere.")
        return radius

    def _in_radii(self, X, origin):
        """Rows in units of the radius, seen from ``origin``; constant columns are zero."""
        unit = np.sqrt(8.0) * np.where(self.widths_ > 0, self.widths_, np.inf)
        return (X - origin) / unit

    def _labels(self, X):
        origin = self.cluster_centers_[0]
        return nearest(self._in_radii(X, origin), self._in_radii(self.cluster_centers_, origin))
