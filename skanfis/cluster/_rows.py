"""What both clusterers do with rows: check, merge, measure by blocks, give to the nearest centre.

Fitting on the sorted distinct rows, with the weight of all that are equal, makes the result the
same to the last bit in whatever order the rows come, and whether a row is repeated or weighted.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import ClusterMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from .._sklearn import check_sample_weight
from .._validation import check_finite, check_not_negative
from ..blocks import row_blocks

__all__ = ["NearestCenterMixin", "check_rows", "distance_blocks", "distinct_rows", "nearest"]

# Distances in a block: a few arrays of this size stay in the cache.
_BLOCK_SIZE = 32_768


def check_rows(estimator, X, reset=False) -> np.ndarray:
    """X as a finite array of float64, or ValueError that names the column."""
    X = validate_data(estimator, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
    names = getattr(estimator, "feature_names_in_", [f"x{j}" for j in range(X.shape[1])])
    check_finite(X, "X", names)
    return X


def distinct_rows(X, sample_weight):
    """Distinct rows of positive weight, in lexicographic order, and the weight of each."""
    weight = check_sample_weight(sample_weight, X, dtype=np.float64)
    check_not_negative(weight)
    keep = weight > 0
    if not keep.any():
        raise ValueError("Every sample_weight is zero: no row is left to cluster.")
    rows, group = np.unique(X[keep], axis=0, return_inverse=True)
    return rows, np.bincount(group.ravel(), weights=weight[keep])


def distance_blocks(points, centers):
    """Blocks of points, as slices, and their squared distances (n_clusters, n_rows_of_block).

    From differences, not from products: where a point coincides with a centre, the distance is an
    exact zero.
    """
    for part in row_blocks(points.shape[0], max(1, _BLOCK_SIZE // centers.shape[0])):
        yield part, cdist(centers, points[part], "sqeuclidean")


def nearest(points, centers):
    """Which centre is nearest to each point; the first of several."""
    labels = np.empty(points.shape[0], dtype=np.intp)
    for part, distances in distance_blocks(points, centers):
        distances.argmin(axis=0, out=labels[part])
    return labels


class NearestCenterMixin(ClusterMixin):
    """Clusters that a row belongs to by the nearest of ``cluster_centers_``."""

    cluster_centers_: np.ndarray

    def predict(self, X: ArrayLike) -> Any:
        """Find the nearest centre.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        labels : ndarray of shape (n_samples,)
            Positions in ``cluster_centers_``.
        """
        check_is_fitted(self)
        return self._labels(check_rows(self, X))

    def _labels(self, X):
        return nearest(X, self.cluster_centers_)
