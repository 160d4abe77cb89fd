r"""Features of a gyro's thermal state, by recursions that run on the gyro's processor too.

A thermometer gives a temperature T_k at the times t_k, h_k = t_k - t_(k-1) apart. What an ideal
low-pass of time constant tau makes of its derivative, tau dr/dt = dT/dt - r, is for a temperature
that is straight between its samples exactly

    r_k = r_(k-1) + g_k [(T_k - T_(k-1)) / h_k - r_(k-1)] ,  g_k = 1 - exp(-h_k / tau) ,  r_0 = 0 ,

and the low-passed temperature itself, tau dy/dt = T - y with y_0 = T_0, is

    y_k = T_k - tau r_k .

The steps h_k need not be equal, and a row more on the straight line between two others changes
nothing. In C, with the state {rate, previous} of one run, on every sample after the first:

    rate += (1.0 - exp(-h / tau)) * ((temperature - previous) / h - rate);
    previous = temperature;
    lagged = temperature - tau * rate;

where h is constant, the gain 1 - exp(-h / tau) is a constant too.
"""

from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ..blocks import LARGE_BLOCK_ROWS, row_blocks
from ._columns import check_column
from ._scalars import check_number

__all__ = ["ThermalLag", "ThermalRate", "TimeSincePowerOn"]

# By position in X, or by name.
Column = int | str | None


class _RunFeature(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):
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
        """
        self._check_parameters()
        names, columns = self._columns_of(X, reset=True)
        self._time, self._run = (
            _position(names, role, getattr(self, role)) for role in ("time", "run")
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


class _ThermalFilter(_RunFeature):
    """A low-pass of every column that is neither time nor run."""

    def __init__(self, time_constant: Any, *, time: Any, run: Any) -> None:
        self.time_constant = time_constant
        self.time = time
        self.run = run

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> np.ndarray:
        """Names of the new columns.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the columns of X, where it had none in ``fit``.

        Returns
        -------
        names : ndarray of str
            Those of the columns filtered, each with a suffix.
        """
        names = super().get_feature_names_out(input_features)
        check_is_fitted(self)
        return np.array([f"{names[i]}_{self._suffix}" for i in self._quantities], dtype=object)

    @property
    def _n_features_out(self):
        return len(self._quantities)

    def _check_parameters(self):
        check_number(self.time_constant, "time_constant")

    def _check_quantities(self):
        if not self._quantities:
            raise ValueError(
                f"X has {self.n_features_in_} feature(s), time or run: nothing to filter."
            )

    def _rates(self, quantities, steps, starts):
        gains = -np.expm1(-steps / self.time_constant)
        return np.column_stack([_filtered_rate(T, steps, gains, starts) for T in quantities.T])


class ThermalRate(_ThermalFilter):
    r"""Rate of change of the temperature, causally low-passed.

    The derivative of a measured temperature is mostly noise; what a compensator can use is its mean
    over the last minute or so. Here it is a first-order low-pass of the derivative,

    .. math::

        r_k = r_{k-1} + \left(1 - e^{-h_k / \tau}\right)
              \left[\frac{T_k - T_{k-1}}{h_k} - r_{k-1}\right], \qquad r_0 = 0,

    which is exact for a temperature that is straight between its samples, whatever the steps
    :math:`h_k`. It needs two numbers of memory and one line of C. No row depends on a later one.

    Parameters
    ----------
    time_constant : float, default=60.0
        Time constant :math:`\tau` of the low-pass, positive, in the unit of ``time`` (s). Noise of
        the temperature comes through divided by some :math:`\tau`; the first rows of a run, up to
        some 3 :math:`\tau`, are too small where the temperature was changing before.
    time : int or str, default=None
        Column of X that holds the time, by position or name; it must increase within a run. None:
        the rows are one unit of time apart.
    run : int or str, default=None
        Column that tells runs apart, by position or name, of any type; each begins anew. Runs begin
        where the power is switched on. None: all rows are one run.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where they have names.

    See Also
    --------
    ThermalLag : The low-passed temperature.

    Notes
    -----
    All columns but ``time`` and ``run`` are filtered, and their rates are all that comes out:
    choose columns by a :class:`~sklearn.compose.ColumnTransformer`. The unit is that of the column
    by that of the time, degC/s as a rule.

    Where rows are left out in the middle of a run, as by a K-fold split at random, the recursion
    bridges the gap by a straight line. Split by run, or compute the features before the split:
    they are of the past alone, and nothing leaks by them.

    Examples
    --------
    >>> import pandas as pd
    >>> from skanfis.gyro import ThermalRate
    >>> log = pd.DataFrame({"t": [0.0, 10, 20, 25, 0, 10], "T": [20.0, 21, 22, 22.5, 20, 20]})
    >>> log["start"] = [1, 1, 1, 1, 2, 2]
    >>> rate = ThermalRate(10.0, time="t", run="start").set_output(transform="pandas")
    >>> rate.fit_transform(log).round(4)["T_rate"].tolist()
    [0.0, 0.0632, 0.0865, 0.0918, 0.0, 0.0]

    In a compensator:

    >>> from sklearn.compose import make_column_transformer
    >>> from sklearn.pipeline import make_pipeline
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> data = make_ofog(n_devices=1, n_runs=6, duration=1800, random_state=0)
    >>> inputs = make_column_transformer(
    ...     ("passthrough", ["temperature", "output"]),
    ...     (ThermalRate(60.0, time="time", run="run"), ["time", "temperature", "run"]),
    ...     verbose_feature_names_out=False,
    ... )
    >>> inputs.fit(data).get_feature_names_out().tolist()
    ['temperature', 'output', 'temperature_rate']
    >>> model = make_pipeline(inputs, ANFISRegressor(n_mfs=[2, 3, 1])).fit(data, data["error"])
    """

    _suffix = "rate"

    def __init__(
        self, time_constant: float = 60.0, *, time: Column = None, run: Column = None
    ) -> None:
        super().__init__(time_constant, time=time, run=run)

    def _compute(self, quantities, steps, starts):
        return self._rates(quantities, steps, starts)


class ThermalLag(_ThermalFilter):
    r"""The temperature, causally low-passed: as a body feels it that follows with a lag.

    The coil of a gyro and its thermometer do not follow the case at once, nor each other. The lag
    of first order, :math:`\tau \, \dot y = T - y` with :math:`y_0 = T_0`, is

    .. math:: y_k = T_k - \tau \, r_k

    with the rate r of :class:`ThermalRate` for the same time constant: exact for a temperature that
    is straight between its samples, whatever the steps. No row depends on a later one.

    Parameters
    ----------
    time_constant : float, default=300.0
        Time constant :math:`\tau`, positive, in the unit of ``time`` (s).
    time : int or str, default=None
        Column of X that holds the time, by position or name; it must increase within a run. None:
        the rows are one unit of time apart.
    run : int or str, default=None
        Column that tells runs apart, by position or name, of any type; each begins anew. None: all
        rows are one run.

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
        self, time_constant: float = 300.0, *, time: Column = None, run: Column = None
    ) -> None:
        super().__init__(time_constant, time=time, run=run)

    def _compute(self, quantities, steps, starts):
        return quantities - self.time_constant * self._rates(quantities, steps, starts)


class TimeSincePowerOn(_RunFeature):
    """Time since the first row of the run, from a clock that goes on from run to run.

    Warm-up depends on the time since power-on, and on no other; a log has a clock of its own.

    Parameters
    ----------
    time : int or str, default=None
        Column of X that holds the time, by position or name; it must increase within a run. None:
        the rows are one unit of time apart.
    run : int or str, default=None
        Column that tells runs apart, by position or name, of any type: each begins with the power
        switched on. None: all rows are one run. :func:`group_by_run` finds runs where there is no
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

    _n_features_out = 1

    def __init__(self, *, time: Column = None, run: Column = None) -> None:
        self.time = time
        self.run = run

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> np.ndarray:
        """Name of the new column.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the columns of X, where it had none in ``fit``.

        Returns
        -------
        names : ndarray of str
            ``["time_since_power_on"]``.
        """
        super().get_feature_names_out(input_features)
        return np.array(["time_since_power_on"], dtype=object)

    def _numbers(self, names, columns):
        return np.empty((len(columns[0]), 0))

    def _compute(self, quantities, steps, starts):
        elapsed = np.cumsum(steps)
        n_rows = np.diff(starts, append=len(steps))
        return (elapsed - np.repeat(elapsed[starts], n_rows))[:, None]


def _position(names, role, column):
    """Position of a column that is given by position or name; None where it is None."""
    if column is None:
        return None
    if isinstance(column, str):
        if column not in names:
            raise ValueError(f"X has no column {role}={column!r}; its columns are {names}.")
        return names.index(column)
    if not isinstance(column, int | np.integer) or isinstance(column, bool):
        raise ValueError(f"{role}={column!r} must be the position or the name of a column.")
    if not -len(names) <= column < len(names):
        raise ValueError(f"{role}={column} is no column of X, which has {len(names)} feature(s).")
    return int(column) % len(names)


def _run_numbers(labels, name):
    """Number of the run of each row, from 0 in order of appearance."""
    codes = pd.factorize(labels)[0]
    if np.any(codes < 0):
        raise ValueError(
            f"column {name!r} (run) has missing values, the first at row {codes.argmin()}."
        )
    return codes


def _filtered_rate(temperature, steps, gains, starts):
    """The recursion at the head of this module, for rows that are sorted by run.

    A loop over floats, not a linear filter of SciPy: the steps may be unequal, and these are the
    lines that run in C. A million rows take a fifth of a second.
    """
    # The first row of a run has no slope and a gain of zero; an infinite step is of no slope.
    slopes = np.diff(temperature, prepend=temperature[0]) / np.where(steps > 0, steps, np.inf)
    restarts = np.zeros(len(temperature), dtype=bool)
    restarts[starts] = True
    rates, rate = np.empty(len(temperature)), 0.0
    for part in row_blocks(len(temperature), LARGE_BLOCK_ROWS):
        # Numbers as Python's take four times the memory: some of them at a time.
        found = []
        for slope, gain, restart in zip(
            slopes[part].tolist(), gains[part].tolist(), restarts[part].tolist(), strict=True
        ):
            rate = 0.0 if restart else rate + gain * (slope - rate)
            found.append(rate)
        rates[part] = found
    return rates
