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

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..blocks import LARGE_BLOCK_ROWS, row_blocks
from ._columns import check_number
from ._run_feature import Column, RunFeature

__all__ = ["ThermalLag", "ThermalRate", "TimeSincePowerOn"]


class _ThermalFilter(RunFeature):
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
        self, time_constant: float = 300.0, *, time: Column = None, run: Column = None
    ) -> None:
        super().__init__(time_constant, time=time, run=run)

    def _compute(self, quantities, steps, starts):
        return quantities - self.time_constant * self._rates(quantities, steps, starts)


class TimeSincePowerOn(RunFeature):
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
