"""Columns of a log as numbers: decimal signs, dates, clock times, counters that overflow."""

import numpy as np
import pandas as pd

from ._columns import evenly_chosen

# Marks of missing values that loggers write, beside those that pandas knows.
NO_VALUE = ["-", "--", "---", "?", "ERR", "Err", "ERROR", "Error", "OVF", "#VALUE!", "#DIV/0!"]

CLOCK = "hours:minutes:seconds"
_DATES = "%d.%m.%Y %d.%m.%y %d-%m-%Y %d-%b-%Y %m/%d/%Y %m/%d/%y %d/%m/%Y %d/%m/%y %Y/%m/%d"
_FORMATS = [
    CLOCK,
    "ISO8601",
    *(
        f"{date} {clock}"
        for date in _DATES.split()
        for clock in ("%H:%M:%S", "%H:%M:%S.%f", "%I:%M:%S %p", "%H:%M")
    ),
]
_CLOCK_ROWS = 200  # from which the format of a clock is found
_EPOCH = pd.Timestamp(0, tz="UTC")
_DAY = 86_400.0  # s


def as_numbers(column, decimal=".", form=""):
    """A column as floats; dates, durations and texts in the format ``form`` in s; else NaN."""
    if form:
        return _moments(_plain(column), form)
    if column.dtype.kind == "M":
        column = pd.to_datetime(column, utc=True) - _EPOCH
    if column.dtype.kind == "m":
        return _in_seconds(column)
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=float, na_value=np.nan)
    plain = _texts(column).str.replace(decimal, ".").str.replace("\u2212", "-")  # a true minus
    return pd.to_numeric(plain, errors="coerce").to_numpy(dtype=float, na_value=np.nan)


def clock_form(column):
    """The time format of most of a column's texts; empty if they are no times."""
    # To the last row: the 13th of a month may tell it from the day.
    texts = column.dropna()
    texts = _plain(texts.iloc[evenly_chosen(len(texts), _CLOCK_ROWS)]).dropna()
    fits = {form: np.isfinite(_moments(texts, form)).sum() for form in _FORMATS}
    best = max(_FORMATS, key=lambda form: fits[form])
    return best if 2 * fits[best] > len(texts) else ""


def going_on(time, form, counter):
    """Unwrap times [s], some NaN, at midnight or where a counter overflows; also return such rows.

    An overflow goes back by the range ``counter`` [s]; any other step back is a reset, and stays.
    """
    known = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[known], prepend=time[known[:1]])
    time, back = time.copy(), steps < 0.0
    if form:
        time[known] += _DAY * np.cumsum((steps < -0.5 * _DAY) & (form == CLOCK))
        return time, known[:0]
    usual = np.median(steps[steps > 0.0]) if (steps > 0.0).any() else 0.0
    is_over = back & (np.abs(steps + counter - usual) <= 3.0 * usual)
    is_over &= known.size > 0 and np.ptp(time[known]) < counter  # no counter exceeds its range
    rounds = np.cumsum(is_over)
    rounds -= np.maximum.accumulate(np.where(back & ~is_over, rounds, 0))
    time[known] += counter * rounds
    return time, known[is_over]


def dated(dates, times):
    """Join a column of dates and one of times of day to one of texts."""
    return _texts(dates).str.cat(_texts(times), sep=" ")


def _plain(column):
    """Texts with single blanks between words, and decimal points."""
    return _texts(column).str.replace(r",?\s+", " ", regex=True).str.replace(",", ".")


def _moments(texts, form):
    if form == CLOCK:
        clocks = texts.where(
            texts.str.fullmatch(r"[0-9]{1,6}(:[0-9]{1,2}){2}(\.[0-9]*)?", na=False)
        )
        return _in_seconds(pd.to_timedelta(clocks, errors="coerce"))
    return _in_seconds(pd.to_datetime(texts, format=form, errors="coerce", utc=True) - _EPOCH)


def _texts(column):
    """Texts without blanks at the ends; NaN where there is no value."""
    texts = column.astype(object)
    return texts.where(column.notna() & ~column.isin(NO_VALUE)).astype("string").str.strip()


def _in_seconds(durations):
    return (durations / pd.Timedelta(seconds=1)).to_numpy(dtype=float).copy()
