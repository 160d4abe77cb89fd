"""Features of a gyro's thermal state, by recursions that run on the gyro's processor too.

docs/gyro_data.rst and docs/gyro_physics.rst say what they are for. In C, with the state
{rate, previous} of one run, on every sample after the first, h after the one before:

    rate += (1.0 - exp(-h / tau)) * ((temperature - previous) / h - rate);
    previous = temperature;
    lagged = temperature - tau * rate;

A row more on the straight line between two others changes nothing.
"""

from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ..blocks import LARGE_BLOCK_ROWS, row_blocks
from ._columns import check_column, check_number, column_position

__all__ = ["ThermalLag", "ThermalRate", "TimeSincePowerOn"]


class _RunFeature(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
    """Features that are computed run by run, from the past rows of the run alone."""

    _suffix = ""

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
        if self._suffix:
            check_number(self.time_constant, "time_constant")
        names, columns = self._columns_of(X, reset=True)
        self._time, self._run = (
            None if given is None else column_position(names, role, given)
            for role, given in (("time", self.time), ("run", self.run))
        )
        if self._time is not None and self._time == self._run:
            raise ValueError(f"time={self.time!r} and run={self.run!r} are one column.")
        self._quantities = [i for i in range(len(names)) if i not in (self._time, self._run)]
        if self._suffix and not self._quantities:
            raise ValueError(
                f"X has {self.n_features_in_} feature(s), time or run: nothing to filter."
            )
        self._rows_by_run(names, columns)  # what transform refuses, fit refuses
        return self

    def transform(self, X: ArrayLike) -> np.ndarray:
        """Compute the features.

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

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> np.ndarray:
        """Names of the new columns.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the columns of X, where it had none in ``fit``.

        Returns
        -------
        names : ndarray of str
            Those of the columns filtered, each with a suffix; or "time_since_power_on".
        """
        names = super().get_feature_names_out(input_features)
        check_is_fitted(self)
        made = [f"{names[i]}_{self._suffix}" for i in self._quantities]
        return np.array(made if self._suffix else ["time_since_power_on"], dtype=object)

    @property
    def _n_features_out(self):
        return len(self._quantities) if self._suffix else 1

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
            runs = pd.factorize(columns[self._run])[0]
            if np.any(runs < 0):
                raise ValueError(
                    f"column {names[self._run]!r} (run) has missing values, the first at row "
                    f"{runs.argmin()}."
                )
        if self._time is not None:
            time = check_column(columns[self._time], f"column {names[self._time]!r} (time)")
        order = np.argsort(runs, kind="stable")
        starts = np.flatnonzero(np.diff(runs[order], prepend=-1))
        steps = np.diff(time[order], prepend=0.0)
        steps[starts] = np.inf
        if (steps <= 0).any():
            hint = "" if self.run is not None else " Is this where a run starts? Then give run."
            raise ValueError(
                f"time={self.time!r} must increase from row to row within a run; at row "
                f"{order[(steps <= 0).argmax()]} it does not.{hint}"
            )
        filtered = self._quantities if self._suffix else []
        chosen = [check_column(columns[i], f"column {names[i]!r}") for i in filtered]
        return order, starts, steps, np.array(chosen).reshape(-1, n_rows).T[order]

    def _rates(self, quantities, steps, starts):
        """Low-passed rates of change, for rows that are sorted by run.

        A loop over floats, not a linear filter of SciPy: the steps may be unequal, and these are
        the lines that run in C. A million rows take a fifth of a second.
        """
        gains = -np.expm1(-steps / self.time_constant)
        restarts = np.zeros(len(steps), dtype=bool)
        restarts[starts] = True
        rates = np.empty(quantities.shape)
        for column, values in enumerate(quantities.T):
            slopes, rate = np.diff(values, prepend=values[0]) / steps, 0.0
            for part in row_blocks(len(values), LARGE_BLOCK_ROWS):
                # Numbers as Python's take four times the memory: some of them at a time.
                found = []
                block = (each[part].tolist() for each in (slopes, gains, restarts))
                for slope, gain, restart in zip(*block, strict=True):
                    rate = 0.0 if restart else rate + gain * (slope - rate)
                    found.append(rate)
                rates[part, column] = found
        return rates


class ThermalRate(_RunFeature):
    r"""Rate of change of the temperature, causally low-passed.

    A first-order low-pass of the derivative,

    .. math::

        r_k = r_{k-1} + \left(1 - e^{-h_k / \tau}\right)
              \left[\frac{T_k - T_{k-1}}{h_k} - r_{k-1}\right], \qquad r_0 = 0,

    exact for a temperature that is straight between its samples, whatever the steps :math:`h_k`. No
    row depends on a later one. All columns but ``time`` and ``run`` are filtered, and their rates
    are all that comes out: choose columns by a :class:`~sklearn.compose.ColumnTransformer`.

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

    See Also
    --------
    ThermalLag : The low-passed temperature.

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

    _suffix = "rate"

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

    def _compute(self, quantities, steps, starts):
        return self._rates(quantities, steps, starts)


class ThermalLag(_RunFeature):
    r"""The temperature, causally low-passed: as a body feels it that follows with a lag.

    :math:`y_k = T_k - \tau \, r_k` with the rate r of :class:`ThermalRate` solves
    :math:`\tau \, \dot y = T - y`, :math:`y_0 = T_0`.

    Parameters
    ----------
    time_constant : float, default=300.0
        Time constant :math:`\tau`, positive, in the unit of ``time`` (s).
    time, run : int or str, default=None
        Columns of X, as for :class:`ThermalRate`.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where they have names.

    See Also
    --------
    ThermalRate : The low-passed derivative; its notes hold here too.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import ThermalLag
    >>> step = np.array([[0.0], [10], [10], [10]])  # each row one unit of time after the other
    >>> ThermalLag(2.0).fit_transform(step).ravel().round(3).tolist()
    [0.0, 2.131, 5.227, 7.105]
    """

    _suffix = "lagged"

    def __init__(
        self,
        time_constant: float = 300.0,
        *,
        time: int | str | None = None,
        run: int | str | None = None,
    ) -> None:
        self.time_constant = time_constant
        self.time = time
        self.run = run

    def _compute(self, quantities, steps, starts):
        return quantities - self.time_constant * self._rates(quantities, steps, starts)


class TimeSincePowerOn(_RunFeature):
    """Time since the first row of the run, from a clock that goes on from run to run.

    Parameters
    ----------
    time, run : int or str, default=None
        Columns of X, as for :class:`ThermalRate`. :func:`group_by_run` finds runs where there is no
        such column.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X; those that are neither time nor run are not used.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where they have names.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import TimeSincePowerOn
    >>> log = np.array([[100.0, 1], [101, 1], [103, 1], [500, 2], [501, 2]])
    >>> TimeSincePowerOn(time=0, run=1).fit_transform(log).ravel().tolist()
    [0.0, 1.0, 3.0, 0.0, 1.0]
    """

    def __init__(self, *, time: int | str | None = None, run: int | str | None = None) -> None:
        self.time = time
        self.run = run

    def _compute(self, quantities, steps, starts):
        elapsed = np.cumsum(np.where(np.isfinite(steps), steps, 0.0))
        n_rows = np.diff(starts, append=len(steps))
        return (elapsed - np.repeat(elapsed[starts], n_rows))[:, None]
