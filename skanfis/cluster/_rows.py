"""Rows of both clusterers: checked, merged, measured by blocks, assigned to the nearest centre.

A fit uses the sorted distinct rows, so that neither order nor repetition changes the last bit.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from .._sklearn import fit_context
from .._validation import (
    check_finite,
    named_refusals,
    positive_weights,
    row_weights,
    unchanged_by_failure,
)
from ..blocks import row_blocks

# Number of distances in a block: a few arrays of this size stay in the cache.
_BLOCK_SIZE = 32_768


def check_rows(estimator, X, reset=False) -> np.ndarray:
    """X as a finite array of float64, or ValueError that names the column."""
    with named_refusals(X=X):
        X = validate_data(estimator, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
    names = getattr(estimator, "feature_names_in_", [f"x{j}" for j in range(X.shape[1])])
    check_finite(X, "X", names)
    return X


def distinct_rows(X, sample_weight):
    """Distinct rows of positive weight, in lexicographic order, and the weight of each."""
    weight = row_weights(1.0 if sample_weight is None else sample_weight, len(X))
    positive_weights(weight, len(X), least=1)
    keep = weight > 0
    rows, group = np.unique(X[keep], axis=0, return_inverse=True)
    return rows, np.bincount(group.ravel(), weights=weight[keep])


def distance_blocks(points, centers):
    """Blocks of points, as slices, and their squared distances (n_clusters, n_rows_of_block)."""
    for part in row_blocks(points.shape[0], max(1, _BLOCK_SIZE // centers.shape[0])):
        yield part, cdist(centers, points[part], "sqeuclidean")


def nearest(points, centers):
    """The index of the centre nearest to each point; the first of several."""
    found = [distances.argmin(axis=0) for _, distances in distance_blocks(points, centers)]
    return np.concatenate(found)


class Clusterer(ClusterMixin, BaseEstimator):
    """Finds ``cluster_centers_``; a row belongs to the nearest."""

    cluster_centers_: np.ndarray
    _find_centers: Any

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: ArrayLike, y: Any = None, sample_weight: ArrayLike | None = None) -> Self:
        """Find the centres.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
        y : None
        sample_weight : array-like of shape (n_samples,), default=None
            Zero or positive; a whole number counts as that many copies of the row.
        """
        with unchanged_by_failure(self):
            X = check_rows(self, X, reset=True)
            self._find_centers(*distinct_rows(X, sample_weight))
            self.labels_ = self._labels(X)
        return self

    def predict(self, X: ArrayLike) -> Any:
        """Find the nearest centre.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        labels : ndarray of int of shape (n_samples,)
        """
        check_is_fitted(self)
        return self._labels(check_rows(self, X))

    def _labels(self, X):
        return nearest(X, self.cluster_centers_)
