r"""Figures of merit in the terms of IEEE 952, as plain functions of columns of a log.

The true rate is in deg/s, temperatures in degC, times in s; every argument is one column, one value
per row. Scale factors are found in whatever unit the output has. Bias figures take the *error*, in
deg/s at the input (:func:`input_error` makes it of an output), and give deg/h. Where a figure does
not exist these functions raise ValueError and say why; they never return NaN.
"""

import numpy as np
from numpy.typing import ArrayLike

from ._columns import check_column, check_labels
from ._rate_units import PER_HOUR

__all__ = [
    "bias",
    "bias_ramp_sensitivity",
    "bias_repeatability",
    "bias_stability",
    "bias_temperature_sensitivity",
    "hysteresis",
    "input_error",
    "rms",
    "scale_factor",
    "scale_factor_asymmetry",
    "scale_factor_nonlinearity",
    "scale_factor_repeatability",
    "scale_factor_temperature_sensitivity",
]

_PPM = 1e6
# Bins of temperature in which warming and cooling are compared, and the rows that a mean needs.
_HYSTERESIS_BINS, _ROWS_PER_MEAN = 20, 5


def scale_factor(rate: ArrayLike, output: ArrayLike) -> float:
    """Scale factor: slope of the least-squares line of the output against the true rate.

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
    return float(_line(*_rate_and_output(rate, output))[0])


def scale_factor_nonlinearity(
    rate: ArrayLike, output: ArrayLike, *, statistic: str = "max", full_scale: float | None = None
) -> float:
    """Largest, or RMS, deviation of the output from its least-squares line [ppm of full scale].

    The output's noise is in it: give means over dwells where the rows are noisy. Without
    ``full_scale`` [deg/s] it is related to the largest rate given.
    """
    if statistic not in ("max", "rms"):
        raise ValueError(f"statistic={statistic!r} must be 'max' or 'rms'.")
    rate, output = _rate_and_output(rate, output)
    full_scale = np.abs(rate).max() if full_scale is None else full_scale
    if not full_scale > 0:
        raise ValueError(f"full_scale={full_scale} must be positive.")
    slope, intercept = _line(rate, output)
    deviation = output - slope * rate - intercept
    size = np.abs(deviation).max() if statistic == "max" else rms(deviation)
    return float(_PPM * size / (abs(slope) * full_scale))


def scale_factor_asymmetry(rate: ArrayLike, output: ArrayLike) -> float:
    """Slope of positive less that of negative rates, over their mean [ppm]."""
    rate, output = _rate_and_output(rate, output)
    slopes = []
    for sign, side in (("positive", rate >= 0), ("negative", rate <= 0)):
        if side.sum() < 2 or np.ptp(rate[side]) == 0:
            raise ValueError(f"No asymmetry: there are not two different {sign} rates.")
        slopes.append(_line(rate[side], output[side])[0])
    return float(_PPM * (slopes[0] - slopes[1]) / np.mean(slopes))


def scale_factor_repeatability(rate: ArrayLike, output: ArrayLike, run: ArrayLike) -> float:
    """Standard deviation of the scale factors of two or more runs over their mean [ppm]."""
    rate, output = _rate_and_output(rate, output)
    runs = rows_by_run(run, rate.size, at_least=2)
    return relative_spread([_line(rate[rows], output[rows])[0] for rows in runs])


def scale_factor_temperature_sensitivity(
    rate: ArrayLike, output: ArrayLike, temperature: ArrayLike
) -> float:
    """Slope of the scale factor in temperature [ppm/degC].

    By least squares, output = (S + S_T dT) rate + c + c_T dT with dT the temperature less its mean;
    the sensitivity is S_T / S.
    """
    rate, output = _rate_and_output(rate, output)
    difference = _centred(temperature, "temperature", rate.size)
    design = [rate, rate * difference, np.ones_like(rate), difference]
    without = "rate and temperature do not change independently of each other"
    slope, by_temperature, *_ = _least_squares(design, output, without)
    return float(_PPM * by_temperature / slope)


def input_error(rate: ArrayLike, output: ArrayLike) -> np.ndarray:
    """Error in units of the input: the output over its scale factor, less the true rate.

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

    Examples
    --------
    >>> from skanfis.gyro import input_error
    >>> input_error([-10.0, 0.0, 10.0], [-19.0, 1.0, 21.0])
    array([0.5, 0.5, 0.5])
    """
    rate, output = _rate_and_output(rate, output)
    factor = 1.0 if np.ptp(rate) == 0 else _line(rate, output)[0]
    return output / factor - rate


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

    Examples
    --------
    >>> from skanfis.gyro import bias
    >>> bias([0.001, 0.003])
    7.2
    """
    return float(PER_HOUR * np.mean(check_column(error, "error")))


def bias_repeatability(error: ArrayLike, run: ArrayLike) -> float:
    """Standard deviation of the mean errors of two or more power-ups [deg/h]."""
    error = check_column(error, "error")
    return spread_of_bias([error[rows].mean() for rows in rows_by_run(run, error.size, at_least=2)])


def bias_stability(
    error: ArrayLike, time: ArrayLike, *, averaging_time: float = 10.0, run: ArrayLike | None = None
) -> float:
    """Bias stability: standard deviation of means over 10 s, or any other time, within the runs.

    This is Chinese practice (GJB 2426), and has no fixed relation to the minimum of the Allan
    deviation; drift over the whole run counts in full.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    time : array-like of shape (n_rows,)
        [s], increasing within each run.
    averaging_time : float, default=10.0
        Length of the means, positive [s]; usual are 10 and 100.
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


def bias_temperature_sensitivity(
    error: ArrayLike, temperature: ArrayLike, *, temperature_rate: ArrayLike | None = None
) -> float:
    """Slope of the error in temperature, D_T [deg/h/degC].

    Given the rate of temperature as well, both slopes are found together.
    """
    return _bias_slope(error, temperature=temperature, temperature_rate=temperature_rate)


def bias_ramp_sensitivity(
    error: ArrayLike, temperature_rate: ArrayLike, *, temperature: ArrayLike | None = None
) -> float:
    """Slope of the error in the rate of temperature [degC/min], D_Tdot [deg/h/(degC/min)].

    Given the temperature as well, both slopes are found together.
    """
    return _bias_slope(error, temperature_rate=temperature_rate, temperature=temperature)


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


def rms(values) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


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


def relative_spread(slopes):
    """Standard deviation of scale factors over their mean [ppm]."""
    return float(_PPM * np.std(slopes, ddof=1) / abs(np.mean(slopes)))


def spread_of_bias(means):
    """Standard deviation of mean errors [deg/h]."""
    return float(PER_HOUR * np.std(means, ddof=1))


def squares_of_means(error, time, averaging_time):
    """Sum of squares of one run's means over whole averaging times, and degrees of freedom."""
    if not averaging_time > 0:
        raise ValueError(f"averaging_time={averaging_time} must be positive.")
    if (np.diff(time) <= 0).any():
        raise ValueError("time must increase within each run.")
    if time.size > 1 and np.median(np.diff(time)) > averaging_time * (1.0 + 1e-9):
        raise ValueError(
            f"No bias stability: rows are {np.median(np.diff(time)):g} s apart, more than "
            f"averaging_time={averaging_time:g} s."
        )
    # A time on an edge belongs to the interval that starts there, rounding errors or not.
    place = np.floor((time - time[0]) / averaging_time + 1e-9).astype(int)
    _, place, counts = np.unique(place, return_inverse=True, return_counts=True)
    # A time that is less than half full has no mean.
    full = counts >= 0.5 * counts.max()
    means = np.bincount(place, error)[full] / counts[full]
    return np.sum((means - means.mean()) ** 2), means.size - 1


def pooled_deviation(squares):
    """Standard deviation within the runs [deg/h], of the sums of squares of each."""
    sum_of_squares, degrees_of_freedom = np.sum(squares, axis=0)
    if degrees_of_freedom == 0:
        raise ValueError("No bias stability: no run is as long as two averaging times.")
    return float(PER_HOUR * np.sqrt(sum_of_squares / degrees_of_freedom))


def _rate_and_output(rate, output) -> tuple[np.ndarray, np.ndarray]:
    rate = check_column(rate, "rate")
    return rate, check_column(output, "output", rate.size)


def _line(rate, output):
    """Slope and intercept of the least-squares line."""
    mean = rate.mean()
    if np.ptp(rate) == 0:
        raise ValueError(f"No scale factor: the rate is {mean:g} deg/s in all rows.")
    slope = (rate - mean) @ (output - output.mean()) / np.sum((rate - mean) ** 2)
    return slope, output.mean() - slope * mean


def _least_squares(design, target, without):
    """Coefficients of the columns in ``design``; ValueError where they cannot be told apart."""
    columns = np.column_stack(design)
    size = np.sqrt(np.mean(columns**2, axis=0))
    if (size == 0).any():
        raise ValueError(f"No sensitivity: {without}.")
    solution, _, rank, _ = np.linalg.lstsq(columns / size, target, rcond=1e-10)
    if rank < columns.shape[1]:
        raise ValueError(f"No sensitivity: {without}.")
    return solution / size


def _bias_slope(error, **columns):
    """Slope of the error in the first of the columns [deg/h per unit], all fitted together."""
    error = check_column(error, "error")
    columns = {name: values for name, values in columns.items() if values is not None}
    design = [_centred(values, name, error.size) for name, values in columns.items()]
    without = f"{next(iter(columns))} never changes"
    if len(columns) > 1:
        without = "temperature and temperature_rate do not change independently of each other"
    return float(PER_HOUR * _least_squares([*design, np.ones_like(error)], error, without)[0])


def _centred(values, name, n_rows):
    values = check_column(values, name, n_rows)
    # Not values - mean where they are all equal: that leaves rounding errors, not zero.
    return values - (values[0] if np.ptp(values) == 0 else values.mean())
