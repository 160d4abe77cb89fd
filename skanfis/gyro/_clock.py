"""Times as loggers write them: numbers, ISO 8601, dates and clocks; in seconds."""

import re

import numpy as np
import pandas as pd

__all__ = ["Clock", "is_clock"]

_CLOCK = (
    r"(?P<h>[0-9]{1,6}):(?P<m>[0-9]{1,2})(?::(?P<s>[0-9]{1,2}(?:[.,][0-9]*)?))?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
)
_DATE = r"(?P<a>[0-9]{1,4})(?P<sign>[./-])(?P<b>[0-9]{1,2})(?P=sign)(?P<c>[0-9]{1,4})"
_FORMS = {
    "clock": re.compile(rf"^\s*{_CLOCK}\s*$"),
    "date": re.compile(rf"^\s*{_DATE}[T,\s]+{_CLOCK}\s*$"),
}
_FRACTION = re.compile(r"(?<=[0-9]),(?=[0-9])")
_DAY = 86_400.0


def is_clock(texts):
    """Whether the texts are times of the day without a date."""
    return _share(texts, "clock") > 0.5


class Clock:
    """Turns texts of one column into seconds, piece by piece; a clock goes on past midnight.

    Parameters
    ----------
    sample : Series of str
        First values of the column, by which the form is told.

    Attributes
    ----------
    form : {"iso", "date", "clock", ""}
        Empty where the texts are no times.
    note : str
        What was found out, in words.
    """

    def __init__(self, sample):
        texts = sample.dropna()
        self.form = ""
        self.note = ""
        self._days, self._last = 0.0, None
        self._order = "dmy"
        if texts.empty:
            return
        if _share(texts, "clock") > 0.5:
            self.form, self.note = "clock", "clock times, in s"
        elif _iso(texts).notna().mean() > 0.5:
            self.form, self.note = "iso", "dates and times of ISO 8601, in s"
        elif _share(texts, "date") > 0.5:
            self.form = "date"
            self._order = _order_of(texts)
            named = {"ymd": "year first", "dmy": "day first", "mdy": "month first"}
            self.note = f"dates ({named[self._order]}) and times, in s"

    def seconds(self, texts):
        """Seconds, shape (n_rows,): since 1970, or since the midnight before the first row.

        NaN where a text is missing or no time.
        """
        if self.form == "iso":
            return _since_1970(_iso(texts))
        parts = texts.str.extract(_FORMS[self.form])
        seconds = _of_day(parts)
        if self.form == "clock":
            return self._unrolled(seconds)
        return seconds + _since_1970(self._dates(parts))

    def _unrolled(self, seconds):
        """A clock's times, a day later after each midnight."""
        known = np.flatnonzero(np.isfinite(seconds))
        if known.size == 0:
            return seconds
        values = seconds[known]
        before = np.concatenate([[values[0] if self._last is None else self._last], values[:-1]])
        days = self._days + np.cumsum(values - before < -0.5 * _DAY)
        self._days, self._last = float(days[-1]), float(values[-1])
        seconds = seconds.copy()
        seconds[known] = values + _DAY * days
        return seconds

    def _dates(self, parts):
        columns = dict(zip(self._order, (parts["a"], parts["b"], parts["c"]), strict=True))
        year, month, day = (pd.to_numeric(columns[key], errors="coerce") for key in "ymd")
        year = year.where(year >= 100, year + 2000)
        frame = pd.DataFrame({"year": year, "month": month, "day": day})
        return pd.to_datetime(frame, errors="coerce", utc=True)


def _share(texts, form):
    return texts.str.match(_FORMS[form]).mean() if len(texts) else 0.0


def _iso(texts):
    return pd.to_datetime(
        texts.str.strip().str.replace(_FRACTION, ".", regex=True),
        format="ISO8601",
        errors="coerce",
        utc=True,
    )


def _since_1970(moments):
    epoch = pd.Timestamp(0, tz="UTC")
    return ((moments - epoch) / pd.Timedelta(seconds=1)).to_numpy(dtype=float)


def _of_day(parts):
    """Seconds since midnight."""
    hours, minutes = (pd.to_numeric(parts[key], errors="coerce") for key in "hm")
    texts = parts["s"].str.replace(",", ".", regex=False)
    seconds = pd.to_numeric(texts, errors="coerce").fillna(0.0)
    half = parts["half"].str.slice(0, 1).str.casefold()
    hours = hours.where(half.isna(), hours % 12).add(12.0 * (half == "p"), fill_value=0.0)
    return (3600.0 * hours + 60.0 * minutes + seconds).to_numpy(dtype=float)


def _order_of(texts):
    """Which of day, month and year comes first, in a column of dates."""
    parts = texts.str.extract(_FORMS["date"]).dropna(subset=["a", "b", "c"])
    if (parts["a"].str.len() == 4).any():
        return "ymd"
    if (parts["sign"] == ".").any():
        return "dmy"
    first, second = (pd.to_numeric(parts[key]) for key in "ab")
    if (first > 12).any() or (second > 12).any():
        return "dmy" if (first > 12).any() else "mdy"
    # The part that changes more is the day; a log within a day is the same either way.
    return "mdy" if second.nunique() > first.nunique() else "dmy"
