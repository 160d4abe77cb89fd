"""A feature computed run by run: which columns are what, and rows by run in order of time."""

from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ._columns import check_column, column_position

__all__ = ["Column", "RunFeature"]

# By position in X, or by name.
Column = int | str | None


class RunFeature(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """A feature that is computed run by run, from the past rows of the run alone.

    Subclasses have the parameters ``time`` and ``run``, the columns that are no quantities.
    """

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Take note of the columns, and check them; nothing is learnt.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            A log.
        y : None
            Not used; here for scikit-learn.

        Returns
        -------
        self : object
            The transformer.

        Raises
        ------
        ValueError
            If X is not finite or lacks a column named, or time does not increase within a run.
        """
        self._check_parameters()
        names, columns = self._columns_of(X, reset=True)
        self._time, self._run = (
            None if given is None else column_position(names, role, given)
            for role, given in (("time", self.time), ("run", self.run))
        )
        if self._time is not None and self._time == self._run:
            raise ValueError(f"time={self.time!r} and run={self.run!r} are one column.")
        self._quantities = [i for i in range(len(names)) if i not in (self._time, self._run)]
        self._check_quantities()
        self._rows_by_run(names, columns)  # what transform refuses, fit refuses
        return self

    def transform(self, X: ArrayLike) -> np.ndarray:
        """Compute the feature.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            A log: the rows of a run in time's order, whole runs. Runs may be mixed.

        Returns
        -------
        features : ndarray of shape (n_samples, n_features_out)
            The new columns alone.

        Raises
        ------
        ValueError
            If X is not finite, has other columns than in ``fit``, or time does not increase within
            a run.
        """
        check_is_fitted(self)
        order, starts, steps, quantities = self._rows_by_run(*self._columns_of(X, reset=False))
        features = np.empty((len(order), self._n_features_out))
        features[order] = self._compute(quantities, steps, starts)
        return features

    def _columns_of(self, X, reset):
        """Names, positions where there are none, and values of the columns of X."""
        if hasattr(X, "columns"):
            validate_data(self, X, reset=reset, skip_check_array=True)
            return list(X.columns), [np.asarray(X[name]) for name in X.columns]
        columns = validate_data(self, X, reset=reset, dtype="numeric").T
        return list(range(len(columns))), list(columns)

    def _rows_by_run(self, names, columns):
        """Order of the rows by run; in this order, starts of runs, time steps and quantities."""
        n_rows = len(columns[0])
        runs = np.zeros(n_rows, dtype=np.intp)
        time = np.arange(n_rows, dtype=float)
        if self._run is not None:
            runs = _run_numbers(columns[self._run], names[self._run])
        if self._time is not None:
            time = check_column(columns[self._time], f"column {names[self._time]!r} (time)")
        order = np.argsort(runs, kind="stable")
        starts = np.flatnonzero(np.diff(runs[order], prepend=-1))
        steps = self._steps(time[order], starts, order)
        return order, starts, steps, self._numbers(names, columns)[order]

    def _numbers(self, names, columns):
        """The quantities; none are needed where the subclass does not look at them."""
        chosen = [check_column(columns[i], f"column {names[i]!r}") for i in self._quantities]
        return np.column_stack(chosen)

    def _check_parameters(self):
        """Raise where a parameter makes no sense."""

    def _check_quantities(self):
        """Raise where there is nothing to compute the feature from."""

    def _steps(self, time, starts, rows):
        """Time since the row before, rows sorted by run; zero where a run starts."""
        steps = np.diff(time, prepend=time[0])
        steps[starts] = 0.0
        wrong = steps <= 0
        wrong[starts] = False
        if wrong.any():
            hint = "" if self.run is not None else " Is this where a run starts? Then give run."
            raise ValueError(
                f"time={self.time!r} must increase from row to row within a run; at row "
                f"{rows[wrong.argmax()]} it does not.{hint}"
            )
        return steps


def _run_numbers(labels, name):
    """Number of the run of each row, from 0 in order of appearance."""
    codes = pd.factorize(labels)[0]
    if np.any(codes < 0):
        raise ValueError(
            f"column {name!r} (run) has missing values, the first at row {codes.argmin()}."
        )
    return codes
