"""Logs that are not tidy: a table on its way between two rates, a chamber that lingers."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from pandas.api.types import is_numeric_dtype

from ._columns import check_column, check_labels, check_number

__all__ = ["clip_dwells", "find_dwells", "resample_in_temperature"]

# Of the largest rate: what a table at rest on its level may move.
_TOLERANCE = 1e-3


def find_dwells(
    rate: ArrayLike, *, run: ArrayLike | None = None, tolerance: float | None = None
) -> np.ndarray:
    """Number the dwells of a rate table: stretches of rows at one rate.

    Parameters
    ----------
    rate : array-like of shape (n_samples,)
        True rate in the order of the log, in any unit.
    run : array-like of shape (n_samples,), default=None
        Number or name of the run: a new run is a new dwell. Default: all rows are one run.
    tolerance : float, default=None
        Largest deviation from the first rate of the dwell, not negative, in the unit of ``rate``.
        Default: 1e-3 of the largest rate.

    Returns
    -------
    dwells : ndarray of int of shape (n_samples,)
        Number of the dwell of each row, from 0. A table on its way makes a dwell of nearly every
        row.

    Raises
    ------
    ValueError
        If ``rate`` has missing values, ``run`` another number of rows, or ``tolerance`` is
        negative.

    Examples
    --------
    >>> from skanfis.gyro import find_dwells
    >>> find_dwells([0.0, 0, 0, 7, 20, 20.01, 20]).tolist()
    [0, 0, 0, 1, 2, 2, 2]
    """
    rate = check_column(rate, "rate")
    if tolerance is None:
        tolerance = _TOLERANCE * np.abs(rate).max()
    else:
        tolerance = check_number(tolerance, "tolerance", zero=True)
    new_run = np.zeros(len(rate), dtype=bool)
    if run is not None:
        runs = pd.factorize(check_labels(run, "run", len(rate)))[0]
        new_run[1:] = runs[1:] != runs[:-1]
    # From the first row of the dwell, not from the row before: a slow ramp is no dwell.
    dwells, dwell, first = [], 0, float(rate[0])
    for value, is_new in zip(rate.tolist(), new_run.tolist(), strict=True):
        if is_new or abs(value - first) > tolerance:
            dwell, first = dwell + 1, value
        dwells.append(dwell)
    return np.array(dwells)


def clip_dwells(
    log: pd.DataFrame,
    lead: float,
    trail: float = 0.0,
    *,
    rate: str = "rate",
    time: str = "time",
    run: str | None = None,
    tolerance: float | None = None,
) -> pd.DataFrame:
    """Leave out the beginning and the end of every dwell, and the table's way between them.

    Parameters
    ----------
    log : DataFrame of shape (n_samples, n_columns)
        A log in time's order.
    lead : float
        Time after the first row of a dwell, whose rows are left out; not negative, in the unit of
        the time. The first row goes with them if it is positive.
    trail : float, default=0.0
        Time before the last row of a dwell likewise.
    rate : str, default="rate"
        Column of the true rate.
    time : str, default="time"
        Column of the time.
    run : str, default=None
        Column that tells runs apart. Default: all rows are one run.
    tolerance : float, default=None
        As for :func:`find_dwells`, which finds the dwells.

    Returns
    -------
    clipped : DataFrame of shape (n_rows_left, n_columns)
        The rows that are left, with their index.

    Raises
    ------
    ValueError
        If a column is not there or has missing values, a time is negative, or no row is left.

    Examples
    --------
    >>> import pandas as pd
    >>> from skanfis.gyro import clip_dwells
    >>> log = pd.DataFrame({"time": range(8), "rate": [0.0, 0, 0, 12, 20, 20, 20, 20]})
    >>> clip_dwells(log, lead=2)["time"].tolist()
    [2, 6, 7]
    """
    lead, trail = check_number(lead, "lead", zero=True), check_number(trail, "trail", zero=True)
    clock = check_column(_column(log, time, "time"), f"column {time!r} (time)")
    runs = None if run is None else _column(log, run, "run")
    dwells = find_dwells(_column(log, rate, "rate"), run=runs, tolerance=tolerance)
    first = np.flatnonzero(np.diff(dwells, prepend=-1))
    last = np.append(first[1:], len(dwells)) - 1
    since, until = clock - clock[first][dwells], clock[last][dwells] - clock
    rounding = 1e-9 * np.abs(clock).max()  # 5.1 - 0.1 is less than 5
    kept = (since >= lead - rounding) & (until >= trail - rounding)
    if not kept.any():
        longest = (clock[last] - clock[first]).max()
        raise ValueError(
            f"No row is left: lead={lead:g} and trail={trail:g} are more than the longest of "
            f"{len(first)} dwells, {longest:g}."
        )
    return log[kept]


def resample_in_temperature(
    log: pd.DataFrame,
    step: float,
    *,
    temperature: str = "temperature",
    by: str | Sequence[str] = (),
) -> pd.DataFrame:
    """Average the rows that lie within one step of the temperature.

    A chamber lingers at its soaks, and most rows of a log are there: a fit would care for little
    else. Afterwards every temperature that the log has seen counts alike.

    Parameters
    ----------
    log : DataFrame of shape (n_samples, n_columns)
        A log.
    step : float
        Width of the steps, positive, in the unit of the temperature (degC). The scale factor should
        change little over it.
    temperature : str, default="temperature"
        Column of the temperature.
    by : str or sequence of str, default=()
        Columns that must not be averaged over: rows are together only if they agree in all of them.
        The rate level as a rule, the run, and whether the temperature rises or falls.

    Returns
    -------
    resampled : DataFrame of shape (n_cells, n_columns + 1)
        Means of the rows of each cell, sorted by the columns of ``by`` and the temperature, and
        ``n_rows``, their number.

    Raises
    ------
    ValueError
        If a column is not there, the temperature has missing values, a column that is to be
        averaged does not hold numbers, or ``step`` is not positive.

    Examples
    --------
    >>> import pandas as pd
    >>> from skanfis.gyro import resample_in_temperature
    >>> log = pd.DataFrame({"temperature": [20.0, 20, 20, 20.5, 21.5, 22.5]})
    >>> log["bias"] = [1.0, 1, 1, 5, 3, 4]
    >>> resample_in_temperature(log, 1.0)
       temperature  bias  n_rows
    0       20.125   2.0       4
    1       21.500   3.0       1
    2       22.500   4.0       1
    """
    step = check_number(step, "step")
    by = [by] if isinstance(by, str) else list(by)
    for name in by:
        _column(log, name, "by")
    averaged = [name for name in log.columns if name not in by]
    for name in averaged:
        if not is_numeric_dtype(log[name]):
            raise ValueError(
                f"column {name!r} cannot be averaged: it does not hold numbers. Name it in by, or "
                "drop it."
            )
    values = check_column(
        _column(log, temperature, "temperature"), f"column {temperature!r} (temperature)"
    )
    cells = pd.Series(np.floor(values / step), index=log.index, name="cell")
    grouped = log.groupby([*(log[name] for name in by), cells], observed=True)
    resampled = grouped[averaged].mean()
    resampled["n_rows"] = grouped.size()
    resampled = resampled.reset_index(level="cell", drop=True).reset_index(drop=not by)
    return resampled[[*log.columns, "n_rows"]]


def _column(log, name, role):
    """A column of the log; ValueError where there is none of this name."""
    if name not in log:
        raise ValueError(f"There is no column {name!r} ({role}) among {list(log.columns)}.")
    return log[name]
