"""The rows of a fit, validated, and the way back to those that were given."""

from dataclasses import dataclass

import numpy as np

from ..bounds.constraints import Constraints
from ..learning.data import StandardisedData, check_scales

__all__ = ["ValidatedData"]


@dataclass(frozen=True, eq=False)
class ValidatedData:
    """Validated data.

    Parameters
    ----------
    X : ndarray of shape (n_rows, n_inputs)
    y : ndarray of shape (n_rows, n_outputs)
    sample_weight : ndarray of shape (n_rows,) or None
        Positive.
    groups : ndarray of shape (n_rows,) or None
    input_names, output_names : sequence of str
    kept : ndarray of bool of shape (n_given_rows,), optional
        Which of the rows given have weight and are here, if not all.
    wishes : Constraints, optional
        What is known of the target, in the user's units.
    """

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None
    groups: np.ndarray | None
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    kept: np.ndarray | None = None
    wishes: Constraints | None = None

    def rows(self, indices=slice(None)):
        """Some of the rows, on scales of their own."""
        weight = None if self.sample_weight is None else self.sample_weight[indices]
        groups = None if self.groups is None else self.groups[indices]
        rows = StandardisedData.of(self.X[indices], self.y[indices], weight, groups)
        check_scales(rows.inputs, rows.targets, self.input_names, self.output_names)
        return rows

    def spread_weights(self, weights):
        """Weights of these rows as weights of all rows given, zero elsewhere."""
        if self.kept is None:
            return weights
        given = np.zeros(self.kept.size)
        given[self.kept] = 1.0 if weights is None else weights
        return given

    def spread_over_rows(self, values, indices):
        """Values of some rows as values of all rows given, NaN elsewhere."""
        every = np.full(self.X.shape[0], np.nan)
        every[indices] = values
        if self.kept is None:
            return every
        given = np.full(self.kept.size, np.nan)
        given[self.kept] = every
        return given
