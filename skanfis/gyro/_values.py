"""Columns of a file as numbers: numbers, dates and clock times, as loggers write them."""

import warnings

import numpy as np
import pandas as pd

__all__ = ["NO_VALUE", "Clock", "as_numbers"]

# What loggers write where there is no value, beside what pandas knows.
NO_VALUE = ["-", "--", "---", "?", "ERR", "Err", "ERROR", "Error", "OVF", "#VALUE!", "#DIV/0!"]
_CLOCK = r"\s*[0-9]{1,6}:[0-9]{1,2}:[0-9]{1,2}(?:[.,][0-9]*)?\s*$"
_DATE = r"^\s*[0-9]{1,4}[./-][0-9]{1,2}[./-][0-9]{1,4}[T,\s]+[0-9]"
_FORMATS = [
    "ISO8601",
    *(
        f"{date} {clock}"
        for date in ("%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%Y/%m/%d", "%d-%m-%Y")
        for clock in ("%H:%M:%S", "%H:%M:%S.%f", "%I:%M:%S %p", "%H:%M")
    ),
]
_DAY = 86_400.0


def as_numbers(column, decimal="."):
    """A column as floats; dates and durations in s, NaN for all else."""
    if column.dtype.kind == "M":
        return _since_1970(pd.to_datetime(column, utc=True))
    if column.dtype.kind == "m":
        return (column / pd.Timedelta(seconds=1)).to_numpy(dtype=float)
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=float, na_value=np.nan)
    plain = _texts(column).str.replace(decimal, ".")
    return pd.to_numeric(plain, errors="coerce").to_numpy(dtype=float, na_value=np.nan)


class Clock:
    """Turns texts of one column into seconds, piece by piece; a clock goes on past midnight.

    ``form`` is "clock" or a format of pandas; empty where the first values are no times.
    """

    def __init__(self, sample):
        texts = _texts(sample).dropna()
        self.form, self.note = "", ""
        self._day_first = False
        self._days, self._last = 0.0, None
        if texts.empty:
            return
        if texts.str.match(_CLOCK).mean() > 0.5:
            self.form, self.note = "clock", "clock times, in s"
        elif texts.str.match(_DATE).mean() > 0.5:
            dates = texts[texts.str.match(_DATE)]
            self._day_first = "." in dates.iloc[0].split()[0]
            self.form = next((form for form in _FORMATS if _fits(dates, form)), "mixed")
            self.note = f"dates and times ({self.form}), in s"

    def seconds(self, column):
        """Seconds since 1970, or since the midnight before the first row; NaN for no time."""
        texts = _texts(column)
        if self.form != "clock":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                moments = pd.to_datetime(
                    texts, format=self.form, dayfirst=self._day_first, errors="coerce", utc=True
                )
            return _since_1970(moments)
        moments = pd.to_timedelta(texts.str.replace(",", "."), errors="coerce")
        seconds = (moments / pd.Timedelta(seconds=1)).to_numpy(dtype=float).copy()
        known = np.flatnonzero(np.isfinite(seconds))
        if known.size:
            values = seconds[known]
            last = values[0] if self._last is None else self._last
            days = self._days + np.cumsum(np.diff(values, prepend=last) < -0.5 * _DAY)
            self._days, self._last = float(days[-1]), float(values[-1])
            seconds[known] += _DAY * days
        return seconds


def _fits(texts, form):
    return pd.to_datetime(texts, format=form, errors="coerce", utc=True).notna().all()


def _texts(column):
    """Texts without blanks at the ends; NaN where there is no value."""
    texts = column.astype(object)
    return texts.where(column.notna() & ~column.isin(NO_VALUE)).astype("string").str.strip()


def _since_1970(moments):
    since = moments - pd.Timestamp(0, tz="UTC")
    return (since / pd.Timedelta(seconds=1)).to_numpy(dtype=float)
