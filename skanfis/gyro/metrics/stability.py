"""Bias stability: how far means over some seconds scatter within the runs, in deg/h."""

import numpy as np
from numpy.typing import ArrayLike

from .._columns import PER_HOUR, check_column
from ._runs import rows_by_run

__all__ = ["bias_stability", "pooled_deviation", "squares_by_run"]


def bias_stability(
    error: ArrayLike, time: ArrayLike, *, averaging_time: float = 10.0, run: ArrayLike | None = None
) -> float:
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
    return float(PER_HOUR * np.sqrt(sum_of_squares / degrees_of_freedom))


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
