r"""The Allan deviation by allantools, and the reading of N, B and K from it.

IEEE 952 reads three coefficients off the double-logarithmic curve sigma(tau), in deg/h over s:

    slope -1/2:  sigma = N sqrt(1 / tau)                      N from tau = 1 s, in deg/sqrt(h)
    slope 0:     sigma = B sqrt(2 ln 2 / pi) = 0.664 B        at the minimum, in deg/h
    slope +1/2:  sigma = K sqrt(tau / 3)                      K from tau = 3 s, in deg/h/sqrt(h)

Tools differ in whether they call the minimum or minimum / 0.664 the bias instability: both are
given here.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ._columns import PER_HOUR, check_column
from .metrics import rows_by_run

__all__ = ["ALLAN_FIGURES", "allan_coefficients", "allan_deviation", "rows_for_allan"]

ALLAN_FIGURES = {
    "angle_random_walk": "deg/sqrt(h)",
    "bias_instability": "deg/h",
    "allan_minimum": "deg/h",
    "rate_random_walk": "deg/h/sqrt(h)",
}
_FLICKER = np.sqrt(2.0 * np.log(2.0) / np.pi)  # 0.664
_POINTS_PER_SLOPE = 3  # two points have no check
# Neighbouring processes differ by a half in slope: a third of that tells them apart.
_SLOPE_TOLERANCE = 0.15
# A run is at least so many averaging times long: of fewer, a deviation says next to nothing.
_ROWS_PER_TIME = 10
_UNEVEN = 0.01  # largest deviation of the time between rows, relative


def allan_deviation(
    error: ArrayLike, sampling_interval: float, *, run: ArrayLike | None = None
) -> pd.DataFrame:
    """Overlapping Allan deviation, by allantools, in octaves up to a tenth of the run.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Error at the input, evenly sampled within each run [deg/s].
    sampling_interval : float
        Time between rows, positive [s].
    run : array-like of shape (n_rows,), default=None
        Labels of the runs, whose variances are averaged; None is one run.

    Returns
    -------
    curve : DataFrame of shape (n_times, 4)
        averaging_time [s]; deviation [deg/h]; its standard error [deg/h]; n, the differences.

    Raises
    ------
    ImportError
        If allantools is not installed.
    ValueError
        If ``sampling_interval`` is not positive, or no run has ten rows.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import allan_deviation
    >>> white = np.random.default_rng(0).normal(scale=1 / 3600, size=4096)  # deg/s
    >>> curve = allan_deviation(white, 1.0)  # doctest: +SKIP
    >>> curve["deviation"].iloc[0].round(1)  # doctest: +SKIP
    1.0
    """
    try:
        from allantools import oadev
    except ImportError as reason:
        raise ImportError(
            "The Allan deviation needs allantools: pip install allantools."
        ) from reason
    error = check_column(error, "error")
    if not (sampling_interval > 0 and np.isfinite(sampling_interval)):
        raise ValueError(f"sampling_interval={sampling_interval} must be positive [s].")
    parts = []
    for rows in rows_by_run(run, error.size):
        if rows.size < _ROWS_PER_TIME:
            continue
        times, deviations, _, counts = oadev(
            PER_HOUR * error[rows], rate=1.0 / sampling_interval, data_type="freq", taus="octave"
        )
        multiple = np.round(times / sampling_interval)
        part = pd.DataFrame({"multiple": multiple, "sum": counts * deviations**2, "n": counts})
        parts.append(part[multiple * _ROWS_PER_TIME <= rows.size])
    if not parts:
        raise ValueError(f"No Allan deviation: no run has {_ROWS_PER_TIME} rows.")
    curve = pd.concat(parts).groupby("multiple", as_index=False).sum()
    times, counts = curve["multiple"] * sampling_interval, curve["n"].astype(int)
    deviation = np.sqrt(curve["sum"] / counts)
    standard_error = deviation / np.sqrt(counts)
    columns = {
        "averaging_time": times,
        "deviation": deviation,
        "error": standard_error,
        "n": counts,
    }
    return pd.DataFrame(columns)


@dataclass(frozen=True)
class AllanCoefficients:
    """What an Allan curve says of the noise; None where it says nothing, with the reason in notes.

    N [deg/sqrt(h)], the minimum [deg/h], B = minimum / 0.664 [deg/h] and K [deg/h/sqrt(h)].
    """

    angle_random_walk: float | None
    allan_minimum: float | None
    bias_instability: float | None
    rate_random_walk: float | None
    notes: dict = field(default_factory=dict)


def allan_coefficients(averaging_time: ArrayLike, deviation: ArrayLike) -> AllanCoefficients:
    """Read angle random walk, bias instability and rate random walk off an Allan curve.

    A slope is found where a line through three neighbouring points has it within 0.15; the lowest
    such line counts, before the minimum for N and after it for K. A minimum at an end is none.

    Parameters
    ----------
    averaging_time, deviation : array-like of shape (n_times,)
        Averaging times, increasing and positive [s]; Allan deviation, positive [deg/h].

    Returns
    -------
    coefficients : AllanCoefficients
        angle_random_walk, allan_minimum, bias_instability, rate_random_walk, and notes.

    Raises
    ------
    ValueError
        If the curve has fewer than three points, or times or deviations are not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import allan_coefficients
    >>> tau = 2.0 ** np.arange(14)
    >>> white, walk = 3.0 / np.sqrt(tau), 0.05 * np.sqrt(tau / 3)  # deg/h
    >>> read = allan_coefficients(tau, np.hypot(white, walk))
    >>> round(read.angle_random_walk, 3), round(read.rate_random_walk, 2)
    (0.05, 3.0)
    """
    tau = check_column(averaging_time, "averaging_time")
    deviation = check_column(deviation, "deviation", tau.size)
    if tau.size < _POINTS_PER_SLOPE:
        raise ValueError(f"The curve has {tau.size} points; at least {_POINTS_PER_SLOPE} needed.")
    if tau[0] <= 0 or (np.diff(tau) <= 0).any():
        raise ValueError("averaging_time must be positive and increase.")
    if deviation.min() <= 0:
        raise ValueError(f"deviation must be positive; its smallest value is {deviation.min():g}.")
    lowest = int(np.argmin(deviation))
    notes: dict[str, str] = {}
    found: dict[str, float | None] = dict.fromkeys(ALLAN_FIGURES)
    # sigma sqrt(tau) is N where the slope is -1/2: 1 deg/h at 1 s is 1/60 deg/sqrt(h).
    walk = _level(tau[: lowest + 1], deviation[: lowest + 1], -0.5)
    if walk is None:
        notes["angle_random_walk"] = "no slope of -1/2"
    else:
        found["angle_random_walk"] = walk / 60.0
    if lowest in (0, tau.size - 1):
        side = "rises from its shortest" if lowest == 0 else "still falls at its longest"
        reason = f"no minimum: the curve {side} averaging time, {tau[lowest]:g} s"
        notes["allan_minimum"] = notes["bias_instability"] = reason
    else:
        found["allan_minimum"] = minimum = float(deviation[lowest])
        found["bias_instability"] = minimum / float(_FLICKER)
    drift = _level(tau[lowest:], deviation[lowest:], 0.5)
    if drift is None:
        notes["rate_random_walk"] = "no slope of +1/2"
    else:
        # sigma = K sqrt(tau / 3) with tau in h; 60 is the root of the seconds in an hour.
        found["rate_random_walk"] = float(drift * np.sqrt(3.0) * 60.0)
    return AllanCoefficients(**found, notes=notes)


def rows_for_allan(time, run, answered):
    """Rows of the runs that were answered from end to end, and the time between them [s].

    ValueError says why there is no Allan deviation.
    """
    runs = [rows for rows in rows_by_run(run, time.size) if answered[rows].all()]
    if not runs:
        raise ValueError("no run is in range from end to end")
    if max(map(len, runs)) < _ROWS_PER_TIME:
        raise ValueError(f"no run in range has {_ROWS_PER_TIME} rows")
    steps = np.concatenate([np.diff(time[rows]) for rows in runs])
    if np.abs(steps - np.median(steps)).max() > _UNEVEN * np.median(steps):
        raise ValueError("the rows are not evenly spaced in time")
    return np.sort(np.concatenate(runs)), float(np.median(steps))


def _level(tau, deviation, slope):
    """Level of the lowest line of this slope along the curve; None where it never has the slope."""
    x, y = np.log(tau), np.log(deviation)
    levels = []
    for start in range(x.size - _POINTS_PER_SLOPE + 1):
        window = slice(start, start + _POINTS_PER_SLOPE)
        if abs(np.polyfit(x[window], y[window], 1)[0] - slope) <= _SLOPE_TOLERANCE:
            levels.append(np.mean(y[window] - slope * x[window]))
    return float(np.exp(min(levels))) if levels else None
