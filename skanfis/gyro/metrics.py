"""Figures of merit in the terms of IEEE 952, as plain functions of columns of a log.

Every argument has one value per row: rates in deg/s, temperatures in degC, times in s. Bias figures
take the *error* at the input (:func:`input_error`) and give deg/h. Where a figure does not exist
these functions raise ValueError with the reason; they never return NaN.
"""

import numpy as np
from numpy.typing import ArrayLike

from ._columns import PER_HOUR, check_column, check_labels

__all__ = ["bias", "bias_stability", "hysteresis", "input_error", "rms", "scale_factor"]

# Bins of temperature in which warming and cooling are compared, and the rows that a mean needs.
_HYSTERESIS_BINS, _ROWS_PER_MEAN = 20, 5


def scale_factor(rate: ArrayLike, output: ArrayLike) -> float:
    """Slope of the least-squares line of the output against the true rate.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones; output in any unit.

    Returns
    -------
    scale_factor : float
        In units of the output per deg/s.

    Raises
    ------
    ValueError
        If the rate never changes.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor
    >>> scale_factor([-10.0, 0.0, 10.0], [-199.0, 1.0, 201.0])
    20.0
    """
    rate = check_column(rate, "rate")
    return line(rate, check_column(output, "output", rate.size))[0]


def input_error(rate: ArrayLike, output: ArrayLike) -> np.ndarray:
    """Error in units of the input: the output over its scale factor, less the true rate.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s]; output in any unit where the rate changes, in deg/s where it does not.

    Returns
    -------
    error : ndarray of shape (n_rows,)
        [deg/s]

    Examples
    --------
    >>> from skanfis.gyro import input_error
    >>> input_error([-10.0, 0.0, 10.0], [-19.0, 1.0, 21.0])
    array([0.5, 0.5, 0.5])
    """
    rate = check_column(rate, "rate")
    output = check_column(output, "output", rate.size)
    return output / (1.0 if np.ptp(rate) == 0 else line(rate, output)[0]) - rate


def bias(error: ArrayLike) -> float:
    """Mean error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].

    Returns
    -------
    bias : float
        [deg/h]

    Examples
    --------
    >>> from skanfis.gyro import bias
    >>> bias([0.001, 0.003])
    7.2
    """
    return float(PER_HOUR * check_column(error, "error").mean())


def bias_stability(
    error: ArrayLike, time: ArrayLike, *, averaging_time: float = 10.0, run: ArrayLike | None = None
) -> float:
    """Standard deviation of means over 10 s, or another time, within the runs (GJB 2426).

    Parameters
    ----------
    error, time : array-like of shape (n_rows,)
        Error at the input [deg/s]; time [s], increasing within each run.
    averaging_time : float, default=10.0
        Length of the means, positive [s].
    run : array-like of shape (n_rows,), default=None
        Labels of the runs, whose own means are taken off first; None is one run.

    Returns
    -------
    stability : float
        [deg/h]

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import bias_stability
    >>> error = np.random.default_rng(0).normal(scale=0.01, size=10_000)  # deg/s
    >>> bool(abs(bias_stability(error, np.arange(10_000) * 0.1) - 3.6) < 0.4)  # 100 rows each
    True
    """
    error = check_column(error, "error")
    time = check_column(time, "time", error.size)
    runs = rows_by_run(run, error.size)
    return pooled_deviation([squares_of_means(error[r], time[r], averaging_time) for r in runs])


def hysteresis(error: ArrayLike, temperature: ArrayLike, temperature_rate: ArrayLike) -> float:
    """Largest gap between the mean errors while warming and while cooling, at equal temperature.

    Parameters
    ----------
    error, temperature : array-like of shape (n_rows,)
        Error at the input [deg/s]; temperature [degC].
    temperature_rate : array-like of shape (n_rows,)
        Its sign tells warming from cooling; rows of zero are left out.

    Returns
    -------
    hysteresis : float
        [deg/h]

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
    high = max(low, min(temperature[side].max() for side in sides))
    edges = np.linspace(low, high, _HYSTERESIS_BINS + 1)
    counts, sums = (
        np.array([np.histogram(temperature[side], edges, weights=w[side])[0] for side in sides])
        for w in (np.ones_like(error), error)
    )
    met = (counts >= _ROWS_PER_MEAN).all(axis=0)
    if not met.any():
        raise ValueError(
            "No hysteresis: warming and cooling share no temperature at which both have "
            f"{_ROWS_PER_MEAN} rows."
        )
    warming, cooling = sums[:, met] / counts[:, met]
    return float(PER_HOUR * np.abs(warming - cooling).max())


def rms(values: ArrayLike) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def line(rate, output):
    """Slope and intercept of the least-squares line."""
    mean, middle = rate.mean(), output.mean()
    if rate.min() == rate.max():
        raise ValueError(f"No scale factor: the rate is {mean:g} deg/s in all rows.")
    deviation = rate - mean
    slope = float(deviation @ (output - middle) / (deviation @ deviation))
    return slope, middle - slope * mean


def rows_by_run(run, n_rows, at_least=1):
    """Positions of the rows of each run, in order of appearance."""
    if run is None:
        return [np.arange(n_rows)]
    labels = check_labels(run, "run", n_rows)
    _, first, place = np.unique(labels, return_index=True, return_inverse=True)
    if first.size < at_least:
        raise ValueError(f"There is {first.size} run; at least {at_least} are needed.")
    rows = np.split(np.argsort(place, kind="stable"), np.cumsum(np.bincount(place))[:-1])
    return [rows[i] for i in np.argsort(first)]


def squares_of_means(error, time, averaging_time):
    """Sum of squares of one run's means over whole averaging times, and degrees of freedom."""
    if not averaging_time > 0:
        raise ValueError(f"averaging_time={averaging_time} must be positive.")
    steps = np.diff(time)
    if (steps <= 0).any():
        raise ValueError("time must increase within each run.")
    if time.size > 1 and np.median(steps) > averaging_time * (1.0 + 1e-9):
        raise ValueError(
            f"No bias stability: rows are {np.median(steps):g} s apart, more than "
            f"averaging_time={averaging_time:g} s."
        )
    # A time on an edge belongs to the interval that starts there, rounding errors or not.
    place = np.floor((time - time[0]) / averaging_time + 1e-9).astype(int)
    _, place, counts = np.unique(place, return_inverse=True, return_counts=True)
    full = counts >= 0.5 * counts.max()  # a time less than half full has no mean
    means = np.bincount(place, error)[full] / counts[full]
    return np.sum((means - means.mean()) ** 2), means.size - 1


def pooled_deviation(squares):
    """Standard deviation within the runs [deg/h], of the sums of squares of each."""
    sum_of_squares, degrees_of_freedom = np.sum(squares, axis=0)
    if degrees_of_freedom == 0:
        raise ValueError("No bias stability: no run is as long as two averaging times.")
    return float(PER_HOUR * np.sqrt(sum_of_squares / degrees_of_freedom))
