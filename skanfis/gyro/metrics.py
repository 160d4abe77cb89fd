r"""Figures of merit in the terms of IEEE 952, as plain functions of columns of a log.

Conventions: the true rate is in deg/s, temperatures in degC, times in s, and every argument is one
column, one value per row. Scale factors are found in whatever unit the output has. Bias figures
take the *error*, in deg/s at the input, and give deg/h; :func:`input_error` makes it of an output.

The gyro model of the standard, S0 (dN/dt) = (I + E + D) / (1 + 1e-6 e_K), has the input rate I, the
drift D with its temperature and ramp terms D_T dT + D_Tdot dT/dt, and the scale-factor error
e_K = e_T dT + f(I) in ppm. Definitions that are Chinese practice (GJB 2426) rather than the IEEE's
are marked so.

Where a figure does not exist (no rate of one sign, one run only, no common temperature) these
functions raise ValueError and say why; they never return NaN.
"""

import numpy as np

from ._columns import check_column, check_labels

__all__ = [
    "bias",
    "bias_ramp_sensitivity",
    "bias_repeatability",
    "bias_stability",
    "bias_temperature_sensitivity",
    "hysteresis",
    "input_error",
    "reduction_factor",
    "residual_peak",
    "residual_peak_to_peak",
    "residual_rms",
    "scale_factor",
    "scale_factor_asymmetry",
    "scale_factor_error",
    "scale_factor_nonlinearity",
    "scale_factor_repeatability",
    "scale_factor_temperature_sensitivity",
]

_PPM = 1e6
_SECONDS_PER_HOUR = 3600.0  # 1 deg/s is 3600 deg/h

# Bins of temperature in which warming and cooling are compared, and the rows that a mean needs.
_HYSTERESIS_BINS = 20
_ROWS_PER_MEAN = 5


def scale_factor(rate, output):
    """Scale factor: slope of the least-squares line of the output against the true rate.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones.
    output : array-like of shape (n_rows,)
        Output in any unit.

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
    rate, output = _rate_and_output(rate, output)
    return float(_line(rate, output)[0])


def scale_factor_error(rate, output, *, nominal=1.0):
    """Scale factor error: relative deviation of the scale factor from its nominal value.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones.
    output : array-like of shape (n_rows,)
        Output in any unit.
    nominal : float, default=1.0
        Nominal scale factor, not zero, in units of the output per deg/s; 1 for an output in deg/s.

    Returns
    -------
    error : float
        [ppm]

    Raises
    ------
    ValueError
        If the rate never changes, or ``nominal`` is zero or not finite.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor_error
    >>> scale_factor_error([-10.0, 0.0, 10.0], [-10.005, 0.0, 10.005])
    500.0
    """
    if nominal == 0 or not np.isfinite(nominal):
        raise ValueError(f"nominal={nominal} must be finite and not zero.")
    return float(_PPM * (scale_factor(rate, output) / nominal - 1.0))


def scale_factor_nonlinearity(rate, output, *, statistic="max", full_scale=None):
    """Scale factor nonlinearity: deviation of the output from its least-squares line.

    The output's noise is in it: give means over dwells where the rows are noisy.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones.
    output : array-like of shape (n_rows,)
        Output in any unit.
    statistic : {"max", "rms"}, default="max"
        The largest deviation, as the standards have it, or the root mean square.
    full_scale : float, default=None
        Rate whose output the deviation is related to [deg/s], positive; None is the largest rate
        given.

    Returns
    -------
    nonlinearity : float
        [ppm of full scale]

    Raises
    ------
    ValueError
        If the rate never changes, or a parameter is not one of its values.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor_nonlinearity
    >>> scale_factor_nonlinearity([-10, -5, 0, 5, 10], [-9.99, -5.02, 0.0, 5.02, 9.99])
    2000.0
    """
    if statistic not in ("max", "rms"):
        raise ValueError(f"statistic={statistic!r} must be 'max' or 'rms'.")
    rate, output = _rate_and_output(rate, output)
    full_scale = np.abs(rate).max() if full_scale is None else full_scale
    if not full_scale > 0:
        raise ValueError(f"full_scale={full_scale} must be positive.")
    slope, intercept = _line(rate, output)
    deviation = output - slope * rate - intercept
    size = np.abs(deviation).max() if statistic == "max" else _rms(deviation)
    return float(_PPM * size / (abs(slope) * full_scale))


def scale_factor_asymmetry(rate, output):
    """Scale factor asymmetry: difference of the scale factors for rates of either sign.

    Each side is fitted by a line of its own, rows at rest on both; the difference, positive less
    negative, is related to their mean.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones on each side of zero, zero included.
    output : array-like of shape (n_rows,)
        Output in any unit.

    Returns
    -------
    asymmetry : float
        [ppm]

    Raises
    ------
    ValueError
        If one side has fewer than two different rates.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor_asymmetry
    >>> scale_factor_asymmetry([-10.0, 0.0, 10.0], [-9.999, 0.0, 10.001])
    200.0
    """
    rate, output = _rate_and_output(rate, output)
    slopes = []
    for sign, side in (("positive", rate >= 0), ("negative", rate <= 0)):
        if side.sum() < 2 or np.ptp(rate[side]) == 0:
            raise ValueError(f"No asymmetry: there are not two different {sign} rates.")
        slopes.append(_line(rate[side], output[side])[0])
    return float(_PPM * (slopes[0] - slopes[1]) / np.mean(slopes))


def scale_factor_repeatability(rate, output, run):
    """Scale factor repeatability: standard deviation of the scale factors of several runs.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones in every run.
    output : array-like of shape (n_rows,)
        Output in any unit.
    run : array-like of shape (n_rows,)
        Labels of the runs, two or more.

    Returns
    -------
    repeatability : float
        Standard deviation (of the population estimated, n - 1) over the mean [ppm].

    Raises
    ------
    ValueError
        If there is one run only, or the rate of a run never changes.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor_repeatability
    >>> scale_factor_repeatability([-1, 1, -1, 1], [-1.0, 1.0, -1.001, 1.001], [0, 0, 1, 1])
    706.8
    """
    return relative_spread(scale_factor_by_run(rate, output, run))


def scale_factor_temperature_sensitivity(rate, output, temperature):
    """Scale factor temperature sensitivity: slope of the scale factor in temperature.

    By least squares, output = (S + S_T dT) rate + c + c_T dT with dT the temperature less its mean;
    the sensitivity is S_T / S.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate [deg/s].
    output : array-like of shape (n_rows,)
        Output in any unit.
    temperature : array-like of shape (n_rows,)
        [degC]

    Returns
    -------
    sensitivity : float
        [ppm/degC]

    Raises
    ------
    ValueError
        If rate and temperature do not change independently of each other.

    Examples
    --------
    >>> from skanfis.gyro import scale_factor_temperature_sensitivity
    >>> rate, temperature = [-10, 10, -10, 10], [20, 20, 30, 30]
    >>> scale_factor_temperature_sensitivity(rate, [-10.02, 10.02, -9.98, 9.98], temperature)
    -400.0
    """
    rate, output = _rate_and_output(rate, output)
    difference = _centred(temperature, "temperature", rate.size)
    design = [rate, rate * difference, np.ones_like(rate), difference]
    slope, by_temperature, *_ = _least_squares(
        design, output, "rate and temperature do not change independently of each other"
    )
    return float(_PPM * by_temperature / slope)


def input_error(rate, output):
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
    rate, output = _rate_and_output(rate, output)
    if np.ptp(rate) == 0:
        return output - rate
    return output / _line(rate, output)[0] - rate


def bias(error):
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
    return float(_SECONDS_PER_HOUR * np.mean(check_column(error, "error")))


def bias_repeatability(error, run):
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


def bias_stability(error, time, *, averaging_time=10.0, run=None):
    """Bias stability: standard deviation of means over 10 s, or any other time, within the runs.

    This is Chinese practice (GJB 2426), and not the minimum of the Allan deviation, to which it has
    no fixed relation; drift over the whole run counts in full.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input [deg/s].
    time : array-like of shape (n_rows,)
        [s], increasing within each run.
    averaging_time : float, default=10.0
        Length of the means [s], positive; usual are 10 and 100.
    run : array-like of shape (n_rows,), default=None
        Labels of the runs; None is one run. Each run's own mean is taken off first.

    Returns
    -------
    stability : float
        [deg/h]

    Raises
    ------
    ValueError
        If time does not increase, if rows are further apart than ``averaging_time``, or if no run
        is as long as two such times.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import bias_stability
    >>> error = np.random.default_rng(0).normal(scale=0.01, size=10_000)  # deg/s
    >>> white = bias_stability(error, np.arange(10_000) * 0.1)  # 100 rows in each mean
    >>> bool(abs(white - 3.6) < 0.4)
    True
    """
    return pooled_deviation(squares_by_run(error, time, averaging_time, run))


def bias_temperature_sensitivity(error, temperature, *, temperature_rate=None):
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


def bias_ramp_sensitivity(error, temperature_rate, *, temperature=None):
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


def hysteresis(error, temperature, temperature_rate):
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
    return float(_SECONDS_PER_HOUR * np.nanmax(gaps))


def residual_rms(error):
    """Root mean square of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    rms : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_rms
    >>> residual_rms([0.3, -0.4])
    0.35355
    """
    return float(_rms(check_column(error, "error")))


def residual_peak(error):
    """Largest size of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    peak : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_peak
    >>> residual_peak([0.3, -0.4])
    0.4
    """
    return float(np.abs(check_column(error, "error")).max())


def residual_peak_to_peak(error):
    """Distance from the smallest to the largest of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    peak_to_peak : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_peak_to_peak
    >>> residual_peak_to_peak([0.3, -0.4])
    0.7
    """
    return float(np.ptp(check_column(error, "error")))


def reduction_factor(before, after):
    """Reduction factor: RMS of the error before compensation over that after it.

    Parameters
    ----------
    before, after : array-like of shape (n_rows,)
        Indicated less true rate, without and with compensation [deg/s].

    Returns
    -------
    factor : float
        Larger than 1 where the compensation helps.

    Raises
    ------
    ValueError
        If a column is empty or not finite, or ``after`` is zero everywhere.

    Examples
    --------
    >>> from skanfis.gyro import reduction_factor
    >>> reduction_factor([3.0, -4.0], [0.4, 0.3])
    10.0
    """
    left = residual_rms(after)
    if left == 0:
        raise ValueError("after is zero everywhere: a factor without bound.")
    return residual_rms(before) / left


# The figures over runs are made in two steps, one value (or two) per run and then one of all: a
# bootstrap over runs repeats the second only.


def scale_factor_by_run(rate, output, run):
    """Scale factor of each run, shape (n_runs,)."""
    rate, output = _rate_and_output(rate, output)
    return np.array([_line(rate[rows], output[rows])[0] for rows in rows_by_run(run, rate.size)])


def relative_spread(slopes):
    """Standard deviation over the mean [ppm]."""
    return float(_PPM * np.std(slopes, ddof=1) / abs(np.mean(slopes)))


def error_by_run(error, run):
    """Mean error of each run [deg/s], shape (n_runs,)."""
    error = check_column(error, "error")
    return np.array([error[rows].mean() for rows in rows_by_run(run, error.size)])


def spread_of_bias(means):
    """Standard deviation of mean errors [deg/h]."""
    return float(_SECONDS_PER_HOUR * np.std(means, ddof=1))


def squares_by_run(error, time, averaging_time, run):
    """Sum of squares and degrees of freedom of each run's means, shape (n_runs, 2).

    Zero and zero for a run that is too short to have two means.
    """
    error = check_column(error, "error")
    time = check_column(time, "time", error.size)
    if not averaging_time > 0:
        raise ValueError(f"averaging_time={averaging_time} must be positive.")
    found = []
    for rows in rows_by_run(run, error.size, at_least=1):
        means = _means(error[rows], time[rows], averaging_time)
        found.append((np.sum((means - means.mean()) ** 2), means.size - 1))
    return np.array(found)


def pooled_deviation(squares):
    """Standard deviation within the runs [deg/h]."""
    sum_of_squares, degrees_of_freedom = np.sum(squares, axis=0)
    if degrees_of_freedom == 0:
        raise ValueError("No bias stability: no run is as long as two averaging times.")
    return float(_SECONDS_PER_HOUR * np.sqrt(sum_of_squares / degrees_of_freedom))


def rows_by_run(run, n_rows, at_least=2):
    """Positions of the rows of each run, in order of appearance."""
    if run is None:
        return [np.arange(n_rows)]
    labels = check_labels(run, "run", n_rows)
    _, first, place = np.unique(labels, return_index=True, return_inverse=True)
    if first.size < at_least:
        raise ValueError(f"There is {first.size} run; at least {at_least} are needed.")
    order = np.argsort(place, kind="stable")
    rows = np.split(order, np.cumsum(np.bincount(place))[:-1])
    return [rows[i] for i in np.argsort(first)]


def _rate_and_output(rate, output):
    rate = check_column(rate, "rate")
    return rate, check_column(output, "output", rate.size)


def _line(rate, output):
    """Slope and intercept of the least-squares line."""
    mean = rate.mean()
    squares = np.sum((rate - mean) ** 2)
    if np.ptp(rate) == 0:
        raise ValueError(f"No scale factor: the rate is {mean:g} deg/s in all rows.")
    slope = (rate - mean) @ (output - output.mean()) / squares
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


def _bias_slopes(error, first, second, name="temperature"):
    """Slopes of the error in one or two columns [deg/h per unit]."""
    error = check_column(error, "error")
    design = [_centred(first, name, error.size), np.ones_like(error)]
    without = f"{name} never changes"
    if second is not None:
        design.insert(1, _centred(second, "temperature_rate", error.size))
        without = "temperature and temperature_rate do not change independently of each other"
    slopes = _least_squares(design, error, without)
    return [float(_SECONDS_PER_HOUR * slope) for slope in slopes[:-1]]


def _centred(values, name, n_rows):
    values = check_column(values, name, n_rows)
    # Not values - mean where they are all equal: that leaves rounding errors, not zero.
    return values - (values[0] if np.ptp(values) == 0 else values.mean())


def _means(error, time, averaging_time):
    """Means over whole averaging times of one run; a time that is less than half full has none."""
    if (np.diff(time) <= 0).any():
        raise ValueError("time must increase within each run.")
    if time.size > 1 and np.median(np.diff(time)) > averaging_time * (1.0 + 1e-9):
        raise ValueError(
            f"No bias stability: rows are {np.median(np.diff(time)):g} s apart, more than "
            f"averaging_time={averaging_time:g} s."
        )
    # A time on an edge belongs to the interval that starts there, rounding errors or not.
    place = np.floor((time - time[0]) / averaging_time + 1e-9).astype(int)
    counts = np.bincount(place)
    full = counts >= 0.5 * counts.max()
    return np.bincount(place, error)[full] / counts[full]


def _means_by_bin(values, temperature, edges):
    """Mean in each bin of temperature; NaN where a bin has too few rows."""
    place = np.digitize(temperature, edges) - 1
    # The upper edge belongs to the last bin.
    place[temperature == edges[-1]] = edges.size - 2
    inside = (place >= 0) & (place < edges.size - 1)
    counts = np.bincount(place[inside], minlength=edges.size - 1)
    sums = np.bincount(place[inside], values[inside], minlength=edges.size - 1)
    return np.where(counts >= _ROWS_PER_MEAN, sums / np.maximum(counts, 1), np.nan)


def _rms(values):
    return np.sqrt(np.mean(values**2))
