"""Times as loggers write them: ISO 8601, dates and clocks; in seconds."""

from itertools import product

import numpy as np
import pandas as pd

__all__ = ["Clock", "is_clock", "is_time"]

_CLOCK = r"\s*[0-9]{1,6}:[0-9]{1,2}:[0-9]{1,2}(?:[.,][0-9]*)?\s*$"
_DATE = r"^\s*([0-9]{1,4})[./-]([0-9]{1,2})[./-]([0-9]{1,4})[T,\s]+"
_DAY = 86_400.0
_DATES = ("%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y")
_TIMES = ("%H:%M:%S", "%H:%M:%S.%f", "%H:%M", "%I:%M:%S %p", "%I:%M:%S.%f %p", "%I:%M %p")


def is_clock(texts):
    """Whether the texts are times of the day without a date."""
    return texts.size > 0 and texts.str.match(_CLOCK).mean() > 0.5


def is_time(texts):
    """Whether the texts are times, of the day or with a date."""
    return Clock(texts).form != ""


class Clock:
    """Turns texts of one column into seconds, piece by piece; a clock goes on past midnight.

    ``form`` is "clock", "ISO8601" or a format of dates, by the first values; empty where they are
    no times. ``note`` says so in words.
    """

    def __init__(self, sample):
        texts = _plain(sample.dropna())
        self.form, self.note = "", ""
        self._days, self._last = 0.0, None
        if is_clock(texts):
            self.form, self.note = "clock", "clock times, in s"
        elif texts.empty or not texts.str.match(_DATE).mean() > 0.5:
            return
        elif _moments(texts, "ISO8601").notna().mean() > 0.5:
            self.form, self.note = "ISO8601", "dates and times of ISO 8601, in s"
        else:
            self._find_format(texts)

    def _find_format(self, texts):
        """The format by which most are dates, and which takes the least time from end to end."""
        best = (0.5, -np.inf)
        for date, time in product(_DATES, _TIMES):
            moments = _moments(texts, f"{date} {time}")
            found = moments.notna().mean(), (moments.min() - moments.max()).total_seconds()
            if found > best:
                best, self.form = found, f"{date} {time}"
                first = "day" if date.startswith("%d") else "month"
                self.note = f"dates ({first} first) and times, in s"

    def seconds(self, texts):
        """Seconds, shape (n_rows,): since 1970, or since the midnight before the first row.

        NaN where a text is missing or no time.
        """
        if self.form != "clock":
            since = _moments(_plain(texts), self.form) - pd.Timestamp(0, tz="UTC")
            return (since / pd.Timedelta(seconds=1)).to_numpy(dtype=float)
        moments = pd.to_timedelta(_plain(texts), errors="coerce")
        seconds = (moments / pd.Timedelta(seconds=1)).to_numpy(dtype=float).copy()
        known = np.flatnonzero(np.isfinite(seconds))
        if known.size:
            values = seconds[known]
            last = values[0] if self._last is None else self._last
            midnights = np.diff(values, prepend=last) < -0.5 * _DAY
            days = self._days + np.cumsum(midnights)
            self._days, self._last = float(days[-1]), float(values[-1])
            seconds[known] += _DAY * days
        return seconds


def _moments(texts, form):
    if form != "ISO8601":
        texts = texts.str.replace(_DATE, r"\1/\2/\3 ", regex=True)
    return pd.to_datetime(texts, format=form, errors="coerce", utc=True)


def _plain(texts):
    """Without blanks at the ends, and with decimal points."""
    return texts.str.strip().str.replace(r"(?<=[0-9]),(?=[0-9])", ".", regex=True)
