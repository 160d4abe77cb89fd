"""Rows as a user gives them, checked: to train on, and to predict.

What is wrong with them is said by the column's name. Arrays and frames of any library come out as
arrays of floats; nothing is copied that need not be.
"""

from typing import Any

import numpy as np
from sklearn.utils.validation import check_consistent_length, check_is_fitted, validate_data

from ._sklearn import check_sample_weight
from ._validation import (
    bearable_weights,
    check_finite,
    group_numbers,
    named_refusals,
    on_host,
    positive_weights,
    refuse_lazy,
)
from .bounds.constraints import Constraints
from .model import TSKModel
from .naming import default_output_names
from .training import ValidatedData

__all__ = ["ChecksRowsMixin"]


class ChecksRowsMixin:
    """The checks of an ANFISRegressor, which notes its inputs' names and number by them."""

    monotonic_cst: Any
    constraints: Any
    model_: TSKModel
    n_features_in_: int

    def _check_training_data(self, X, y, sample_weight, groups, *, is_chunk=False):
        """The data, of all rows with weight; ``is_chunk``: as rows that may have come before."""
        refuse_lazy(X=X, y=y, sample_weight=sample_weight, groups=groups)
        X, y, sample_weight, groups = map(on_host, (X, y, sample_weight, groups))
        numeric = {"dtype": (np.float64, np.float32), "ensure_all_finite": False}
        output_names = _target_names(y)
        with named_refusals(X=X, y=y):
            X, y = validate_data(
                self,
                X,
                y,
                reset=not (is_chunk and hasattr(self, "n_features_in_")),
                validate_separately=(
                    {**numeric, "ensure_min_samples": 1 if is_chunk else 2},
                    {**numeric, "ensure_2d": False},
                ),
            )
        check_consistent_length(X, y)
        self._single_output = y.ndim == 1
        targets = y.reshape(-1, 1) if y.ndim == 1 else y
        if output_names is None or len(output_names) != targets.shape[1]:
            output_names = default_output_names(targets.shape[1])
        check_finite(X, "X", self._input_names())
        check_finite(targets, "y", output_names)
        groups = None if groups is None else _checked_groups(groups, X.shape[0])
        keep = None
        if sample_weight is not None:
            sample_weight = _checked_weights(sample_weight, X, is_chunk)
            keep = positive_weights(sample_weight, X.shape[0], 0 if is_chunk else 2)
        if keep is not None:
            X, targets, sample_weight = X[keep], targets[keep], sample_weight[keep]
            groups = None if groups is None else groups[keep]
        names = tuple(map(str, self._input_names()))
        wishes = Constraints.read(self.monotonic_cst, self.constraints, names, targets.shape[1])
        return ValidatedData(X, targets, sample_weight, groups, names, output_names, keep, wishes)

    def _check_inputs(self, X):
        """Rows to predict, as an array."""
        check_is_fitted(self)
        if not self._is_plain_input(X):
            X = on_host(X)
            with named_refusals(X=X):
                X = validate_data(
                    self, X, reset=False, dtype=(np.float64, np.float32), ensure_all_finite=False
                )
        check_finite(X, "X", self.model_.input_names)
        return X

    def _is_plain_input(self, X):
        """Whether X is an array in which scikit-learn's checks, half of a call, find nothing."""
        return (
            type(X) is np.ndarray
            and X.dtype == np.float64
            and X.ndim == 2
            and X.shape[0] > 0
            and X.shape[1] == self.n_features_in_
            and not hasattr(self, "feature_names_in_")
        )

    def _input_names(self):
        names = getattr(self, "feature_names_in_", None)
        return [f"x{j}" for j in range(self.n_features_in_)] if names is None else list(names)


def _checked_groups(groups, n_rows):
    """Numbers of the groups, one per row."""
    groups = group_numbers(groups)
    if len(groups) != n_rows:
        raise ValueError(
            f"groups has {len(groups)} entries for {n_rows} rows of X: give every row its label."
        )
    return groups


def _checked_weights(sample_weight, X, is_chunk):
    """Weights, zero or positive."""
    # A chunk may be without any weight, which scikit-learn refuses from some version on.
    if not (is_chunk and np.array_equal(sample_weight, np.zeros(X.shape[0]))):
        sample_weight = check_sample_weight(sample_weight, X, dtype=np.float64)
    sample_weight = np.asarray(sample_weight, dtype=float)
    # Weights of chunks count against one another: they stay as they are.
    return sample_weight if is_chunk else bearable_weights(sample_weight)


def _target_names(y):
    """Names of a Series or of a frame's columns, if all are str."""
    names = getattr(y, "columns", None)
    if names is None:
        names = [getattr(y, "name", None)]
    names = list(names)
    return tuple(names) if all(isinstance(name, str) and name for name in names) else None
