"""Figures of the scale factor, in ppm, from the true rate and an output in any unit."""

import numpy as np
from numpy.typing import ArrayLike

from ._lines import centred, least_squares, line, rate_and_output, rms
from ._runs import rows_by_run

__all__ = [
    "relative_spread",
    "scale_factor",
    "scale_factor_asymmetry",
    "scale_factor_by_run",
    "scale_factor_error",
    "scale_factor_nonlinearity",
    "scale_factor_repeatability",
    "scale_factor_temperature_sensitivity",
]

_PPM = 1e6


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
    rate, output = rate_and_output(rate, output)
    return float(line(rate, output)[0])


def scale_factor_error(rate: ArrayLike, output: ArrayLike, *, nominal: float = 1.0) -> float:
    """Scale factor error: relative deviation of the scale factor from its nominal value.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones; output in any unit.
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


def scale_factor_nonlinearity(
    rate: ArrayLike, output: ArrayLike, *, statistic: str = "max", full_scale: float | None = None
) -> float:
    """Scale factor nonlinearity: deviation of the output from its least-squares line.

    The output's noise is in it: give means over dwells where the rows are noisy.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones; output in any unit.
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
    rate, output = rate_and_output(rate, output)
    full_scale = np.abs(rate).max() if full_scale is None else full_scale
    if not full_scale > 0:
        raise ValueError(f"full_scale={full_scale} must be positive.")
    slope, intercept = line(rate, output)
    deviation = output - slope * rate - intercept
    size = np.abs(deviation).max() if statistic == "max" else rms(deviation)
    return float(_PPM * size / (abs(slope) * full_scale))


def scale_factor_asymmetry(rate: ArrayLike, output: ArrayLike) -> float:
    """Scale factor asymmetry: difference of the scale factors for rates of either sign.

    Each side is fitted by a line of its own, rows at rest on both; the difference, positive less
    negative, is related to their mean.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones on each side of zero, zero included; output
        in any unit.

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
    rate, output = rate_and_output(rate, output)
    slopes = []
    for sign, side in (("positive", rate >= 0), ("negative", rate <= 0)):
        if side.sum() < 2 or np.ptp(rate[side]) == 0:
            raise ValueError(f"No asymmetry: there are not two different {sign} rates.")
        slopes.append(line(rate[side], output[side])[0])
    return float(_PPM * (slopes[0] - slopes[1]) / np.mean(slopes))


def scale_factor_repeatability(rate: ArrayLike, output: ArrayLike, run: ArrayLike) -> float:
    """Scale factor repeatability: standard deviation of the scale factors of several runs.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], at least two different ones in every run; output in any unit.
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


def scale_factor_temperature_sensitivity(
    rate: ArrayLike, output: ArrayLike, temperature: ArrayLike
) -> float:
    """Scale factor temperature sensitivity: slope of the scale factor in temperature.

    By least squares, output = (S + S_T dT) rate + c + c_T dT with dT the temperature less its mean;
    the sensitivity is S_T / S.

    Parameters
    ----------
    rate, output : array-like of shape (n_rows,)
        True rate [deg/s], and output in any unit.
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
    rate, output = rate_and_output(rate, output)
    difference = centred(temperature, "temperature", rate.size)
    design = [rate, rate * difference, np.ones_like(rate), difference]
    slope, by_temperature, *_ = least_squares(
        design, output, "rate and temperature do not change independently of each other"
    )
    return float(_PPM * by_temperature / slope)


def scale_factor_by_run(rate, output, run):
    """Scale factor of each run, shape (n_runs,)."""
    rate, output = rate_and_output(rate, output)
    return np.array([line(rate[rows], output[rows])[0] for rows in rows_by_run(run, rate.size)])


def relative_spread(slopes):
    """Standard deviation over the mean [ppm]."""
    return float(_PPM * np.std(slopes, ddof=1) / abs(np.mean(slopes)))
