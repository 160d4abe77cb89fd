"""Figures of the bias, in deg/h, from the error at the input in deg/s."""

import numpy as np
from numpy.typing import ArrayLike

from .._columns import PER_HOUR, check_column
from ._lines import centred, least_squares, line, rate_and_output
from ._runs import rows_by_run

__all__ = [
    "bias",
    "bias_ramp_sensitivity",
    "bias_repeatability",
    "bias_temperature_sensitivity",
    "error_by_run",
    "hysteresis",
    "input_error",
    "spread_of_bias",
]

# Bins of temperature in which warming and cooling are compared, and the rows that a mean needs.
_HYSTERESIS_BINS = 20
_ROWS_PER_MEAN = 5


def input_error(rate: ArrayLike, output: ArrayLike) -> np.ndarray:
    """Error in units of the input: the output over its scale factor, less the true rate.

    This takes the scale factor out of the bias figures. At one rate (at rest) there is no line to
    fit, and the output must be in deg/s already.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate, the earth's rate about the input axis included [deg/s].
    output : array-like of shape (n_rows,)
        Output, in any unit where the rate changes, in deg/s where it does not.

    Returns
    -------
    error : ndarray of shape (n_rows,)
        [deg/s]

    Raises
    ------
    ValueError
        If a column is empty, not finite, or not as long as the other.

    Examples
    --------
    >>> from skanfis.gyro import input_error
    >>> input_error([-10.0, 0.0, 10.0], [-19.0, 1.0, 21.0])
    array([0.5, 0.5, 0.5])
    """
    rate, output = rate_and_output(rate, output)
    if np.ptp(rate) == 0:
        return output - rate
    return output / line(rate, output)[0] - rate


def bias(error: ArrayLike) -> float:
    """Bias: mean error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s], at rest or from :func:`input_error`.

    Returns
    -------
    bias : float
        [deg/h]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import bias
    >>> bias([0.001, 0.003])
    7.2
    """
    return float(PER_HOUR * np.mean(check_column(error, "error")))


def bias_repeatability(error: ArrayLike, run: ArrayLike) -> float:
    """Bias repeatability: standard deviation of the mean errors of several power-ups.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    run : array-like of shape (n_rows,)
        Labels of the power-ups, two or more.

    Returns
    -------
    repeatability : float
        [deg/h]

    Raises
    ------
    ValueError
        If there is one run only.

    Examples
    --------
    >>> from skanfis.gyro import bias_repeatability
    >>> bias_repeatability([0.001, 0.003, 0.005, 0.007], [0, 0, 1, 1])
    10.1823
    """
    return spread_of_bias(error_by_run(error, run))


def bias_temperature_sensitivity(
    error: ArrayLike, temperature: ArrayLike, *, temperature_rate: ArrayLike | None = None
) -> float:
    """Bias temperature sensitivity: slope of the error in temperature, D_T.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    temperature : array-like of shape (n_rows,)
        [degC]
    temperature_rate : array-like of shape (n_rows,), default=None
        Rate of temperature change [degC/min]; where given, both slopes are found together, so that
        the one does not count for the other.

    Returns
    -------
    sensitivity : float
        [deg/h/degC]

    Raises
    ------
    ValueError
        If the temperature never changes, or not independently of its rate.

    Examples
    --------
    >>> from skanfis.gyro import bias_temperature_sensitivity
    >>> bias_temperature_sensitivity([0.001, 0.002, 0.003], [20.0, 21.0, 22.0])
    3.6
    """
    return _bias_slopes(error, temperature, temperature_rate)[0]


def bias_ramp_sensitivity(
    error: ArrayLike, temperature_rate: ArrayLike, *, temperature: ArrayLike | None = None
) -> float:
    """Bias temperature-ramp sensitivity: slope of the error in the thermal rate, D_Tdot.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    temperature_rate : array-like of shape (n_rows,)
        Rate of temperature change [degC/min].
    temperature : array-like of shape (n_rows,), default=None
        [degC]; where given, both slopes are found together.

    Returns
    -------
    sensitivity : float
        [deg/h/(degC/min)]

    Raises
    ------
    ValueError
        If the thermal rate never changes, or not independently of the temperature.

    Examples
    --------
    >>> from skanfis.gyro import bias_ramp_sensitivity
    >>> bias_ramp_sensitivity([-0.002, 0.0, 0.002], [-1.0, 0.0, 1.0])
    7.2
    """
    if temperature is None:
        return _bias_slopes(error, temperature_rate, None, name="temperature_rate")[0]
    return _bias_slopes(error, temperature, temperature_rate)[1]


def hysteresis(error: ArrayLike, temperature: ArrayLike, temperature_rate: ArrayLike) -> float:
    """Hysteresis: largest gap between warming and cooling at equal temperature.

    The range that both share is cut into 20 bins, and in each the mean errors of at least five rows
    of warming and of cooling are compared.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    temperature : array-like of shape (n_rows,)
        [degC]
    temperature_rate : array-like of shape (n_rows,)
        Rate of temperature change, in any unit: its sign tells warming from cooling, and rows of
        zero are left out.

    Returns
    -------
    hysteresis : float
        [deg/h]

    Raises
    ------
    ValueError
        If warming and cooling meet at no temperature.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import hysteresis
    >>> temperature = np.concatenate([np.linspace(0, 50, 500), np.linspace(50, 0, 500)])
    >>> direction = np.repeat([1.0, -1.0], 500)
    >>> hysteresis(0.001 * direction, temperature, direction)
    7.2
    """
    error = check_column(error, "error")
    temperature = check_column(temperature, "temperature", error.size)
    direction = np.sign(check_column(temperature_rate, "temperature_rate", error.size))
    sides = [direction > 0, direction < 0]
    if not all(side.any() for side in sides):
        raise ValueError("No hysteresis: the temperature does not both rise and fall.")
    low = max(temperature[side].min() for side in sides)
    high = min(temperature[side].max() for side in sides)
    edges = np.linspace(low, high, _HYSTERESIS_BINS + 1)
    means = [_means_by_bin(error[side], temperature[side], edges) for side in sides]
    gaps = np.abs(means[0] - means[1])
    if high < low or np.isnan(gaps).all():
        raise ValueError(
            "No hysteresis: warming and cooling share no temperature at which both have "
            f"{_ROWS_PER_MEAN} rows."
        )
    return float(PER_HOUR * np.nanmax(gaps))


def error_by_run(error, run):
    """Mean error of each run [deg/s], shape (n_runs,)."""
    error = check_column(error, "error")
    return np.array([error[rows].mean() for rows in rows_by_run(run, error.size)])


def spread_of_bias(means):
    """Standard deviation of mean errors [deg/h]."""
    return float(PER_HOUR * np.std(means, ddof=1))


def _bias_slopes(error, first, second, name="temperature"):
    """Slopes of the error in one or two columns [deg/h per unit]."""
    error = check_column(error, "error")
    design = [centred(first, name, error.size), np.ones_like(error)]
    without = f"{name} never changes"
    if second is not None:
        design.insert(1, centred(second, "temperature_rate", error.size))
        without = "temperature and temperature_rate do not change independently of each other"
    slopes = least_squares(design, error, without)
    return [float(PER_HOUR * slope) for slope in slopes[:-1]]


def _means_by_bin(values, temperature, edges):
    """Mean in each bin of temperature; NaN where a bin has too few rows."""
    place = np.digitize(temperature, edges) - 1
    # The upper edge belongs to the last bin.
    place[temperature == edges[-1]] = edges.size - 2
    inside = (place >= 0) & (place < edges.size - 1)
    counts = np.bincount(place[inside], minlength=edges.size - 1)
    sums = np.bincount(place[inside], values[inside], minlength=edges.size - 1)
    return np.where(counts >= _ROWS_PER_MEAN, sums / np.maximum(counts, 1), np.nan)
