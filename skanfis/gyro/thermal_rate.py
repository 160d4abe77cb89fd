"""The rate of temperature change, by a recursion that runs on the gyro's processor too.

docs/gyro_data.rst says what it is for, and has the recursion in C.
"""

from __future__ import annotations

from copy import copy
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ._columns import check_column, column_position


class ThermalRate(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    r"""Rate of change of the temperature, causally low-passed; see :doc:`/gyro_data`.

    The temperature of a body that follows with a lag :math:`\tau` is :math:`T - \tau r`, with the
    rate r. All columns but ``time`` and ``run`` are filtered: select columns by a
    :class:`~sklearn.compose.ColumnTransformer`.

    Parameters
    ----------
    time_constant : float, default=60.0
        Time constant :math:`\tau`, in the unit of ``time`` (s). Noise of the temperature comes
        through divided by some :math:`\tau`.
    time : int or str, default=None
        Column of the time, which must increase within a run. None: rows are one unit apart.
    run : int or str, default=None
        Column that tells runs apart, of any type; each begins anew. None: all rows are one run.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where they have names.

    Examples
    --------
    >>> import pandas as pd
    >>> from skanfis.gyro import ThermalRate
    >>> log = pd.DataFrame({"t": [0.0, 10, 20, 25, 0, 10], "T": [20.0, 21, 22, 22.5, 20, 20]})
    >>> log["start"] = [1, 1, 1, 1, 2, 2]
    >>> rate = ThermalRate(10.0, time="t", run="start").set_output(transform="pandas")
    >>> rate.fit_transform(log).round(4)["T_rate"].tolist()
    [0.0, 0.0632, 0.0865, 0.0918, 0.0, 0.0]
    """

    def __init__(
        self,
        time_constant: float = 60.0,
        *,
        time: int | str | None = None,
        run: int | str | None = None,
    ) -> None:
        self.time_constant = time_constant
        self.time = time
        self.run = run

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Record and check the columns of a log; nothing is learnt, and y is not used."""
        constant = self.time_constant
        if not (isinstance(constant, int | float | np.number) and 0.0 < constant < np.inf):
            raise ValueError(f"time_constant={constant!r} must be a positive number.")
        trial = copy(self)  # so that a fit that fails leaves what was there
        names, columns = trial._columns_of(X, reset=True)
        trial._time, trial._run = (
            None if given is None else column_position(names, role, given)
            for role, given in (("time", trial.time), ("run", trial.run))
        )
        if trial._time is not None and trial._time == trial._run:
            raise ValueError(f"time={trial.time!r} and run={trial.run!r} are one column.")
        trial._filtered = [i for i in range(len(names)) if i not in (trial._time, trial._run)]
        if not trial._filtered:
            raise ValueError(f"X has {len(names)} feature(s), time or run: nothing to filter.")
        trial._rates(names, columns)  # so that fit refuses what transform refuses
        self.__dict__ = trial.__dict__
        return self

    def transform(self, X: ArrayLike) -> np.ndarray:
        """Compute the rates of the filtered columns, and return these columns alone.

        Runs must be complete, and their rows in order of time; rows of several runs may be mixed.
        """
        check_is_fitted(self)
        return self._rates(*self._columns_of(X, reset=False))

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> np.ndarray:
        """Names of the filtered columns, each with "_rate" appended."""
        names = super().get_feature_names_out(input_features)
        return np.array([f"{names[i]}_rate" for i in self._filtered], dtype=object)

    def _columns_of(self, X, reset):
        """Names of the columns of X, or positions if there are none, and their values."""
        if hasattr(X, "columns"):
            validate_data(self, X, reset=reset, skip_check_array=True)
            return list(X.columns), [np.asarray(X[name]) for name in X.columns]
        columns = validate_data(self, X, reset=reset, dtype="numeric").T
        return list(range(len(columns))), list(columns)

    def _rates(self, names, columns):
        n_rows = len(columns[0])
        runs, time = np.zeros(n_rows, dtype=int), np.arange(n_rows, dtype=float)
        if self._run is not None:
            runs = pd.factorize(columns[self._run])[0]
            if np.any(runs < 0):
                raise ValueError(
                    f"column {names[self._run]!r} (run) has missing values, the first at row "
                    f"{runs.argmin()}."
                )
        if self._time is not None:
            time = check_column(columns[self._time], f"column {names[self._time]!r} (time)")
        order = np.argsort(runs, kind="stable")
        steps = np.diff(time[order], prepend=0.0)
        steps[np.diff(runs[order], prepend=-1) != 0] = np.inf
        if (steps <= 0).any():
            hint = "" if self.run is not None else " Is this where a run starts? Then give run."
            raise ValueError(
                f"time={self.time!r} must increase from row to row within a run; at row "
                f"{order[(steps <= 0).argmax()]} it does not.{hint}"
            )
        gains = -np.expm1(-steps / self.time_constant)
        rates = np.empty((n_rows, len(self._filtered)))
        for place, column in enumerate(self._filtered):
            values = check_column(columns[column], f"column {names[column]!r}")[order]
            slopes = np.diff(values, prepend=values[0]) / steps
            rates[order, place] = np.fromiter(_low_passed(slopes, gains), float, n_rows)
        return rates


def _low_passed(slopes, gains):
    """Rates of change; a run starts with the slope 0 and the gain 1.

    A loop, not a linear filter of SciPy: the steps may be unequal, and these are the lines that run
    in C. A million rows take a fifth of a second.
    """
    rate = 0.0
    for slope, gain in zip(memoryview(slopes), memoryview(gains), strict=True):
        rate += gain * (slope - rate)
        yield rate
