"""The table in a file, text or Parquet: its header, its rows in pieces, and columns as numbers."""

import codecs
import csv
import re
import warnings
from itertools import islice

import numpy as np
import pandas as pd

from .errors import LogError

__all__ = ["NO_VALUE", "Clock", "as_numbers", "open_source"]

# What loggers write where there is no value, beside what pandas knows.
NO_VALUE = ["-", "--", "---", "?", "ERR", "Err", "ERROR", "Error", "OVF", "#VALUE!", "#DIV/0!"]

_LONGEST_FIELD = 2**31 - 1  # the largest limit that the module csv takes on every system
_HEAD_BYTES = 2**16
# Lines above the header that a logger may write, and a few rows.
_HEAD_RECORDS = 60
_LONGEST_NUMBER = 60
_SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas"}
_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_KINDS = {b"\x1f\x8b": "compressed", b"PK\x03\x04": "an archive or a workbook", b"PAR1": "Parquet"}
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f\ufffd]")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?$")
_MOMENT = re.compile(r"[0-9]{1,4}([:./-])[0-9]{1,2}(\1[0-9]|[T ,:]|$)")

_CLOCK = r"[0-9]{1,6}:[0-9]{1,2}:[0-9]{1,2}(?:[.,][0-9]*)?$"
_DATE = r"[0-9]{1,4}[./-][0-9]{1,2}[./-][0-9]{1,4}[T,\s]+[0-9]"
_FORMATS = [
    "ISO8601",
    *(
        f"{date} {clock}"
        for date in ("%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%Y/%m/%d", "%d-%m-%Y")
        for clock in ("%H:%M:%S", "%H:%M:%S.%f", "%I:%M:%S %p", "%H:%M")
    ),
]
_DAY = 86_400.0


def open_source(path):
    """The table in a file; LogError where there is none."""
    is_parquet = str(path).lower().endswith((".parquet", ".pq"))
    return _ParquetSource(path) if is_parquet else _TextSource(path)


class _TextSource:
    """A text file with a header and one record per line.

    ``header`` are the names of the columns, ``decimal`` is the sign of the decimal fraction;
    ``notes`` tell what was found out.
    """

    def __init__(self, path):
        self.path, self.notes = path, []
        self._encoding = _find_encoding(path)
        if self._encoding != "utf-8-sig":
            self.notes.append(f"the text is read as {self._encoding.upper()}")
        self._separator = self._find_separator()
        head = list(islice(self._records(), _HEAD_RECORDS))
        if not head:
            raise LogError(f"{path}: is empty.")
        self._place_header(head)
        self.decimal = self._find_decimal(head)
        self._check_lengths()

    def _find_separator(self):
        """The first sign that cuts all lines into as many fields, two at least; else a comma."""
        most, found = 1, ","
        for sign, name in _SEPARATORS.items():
            self._separator = sign
            try:
                lengths = [len(values) for _, values in islice(self._records(), _HEAD_RECORDS)]
            except LogError:
                continue
            body = lengths[len(lengths) // 3 :]  # below a preamble
            if body and min(body) == max(body) > 1:
                if sign != ",":
                    self.notes.append(f"columns are separated by {name}")
                return sign
            if lengths and lengths[0] > most:
                most, found = lengths[0], sign
        return found

    def _find_decimal(self, head):
        numbers = [cell for _, values in head for cell in values if _NUMBER.match(cell.strip())]
        commas = sum("," in cell for cell in numbers)
        if self._separator == "," or commas <= sum("." in cell for cell in numbers):
            return "."
        self.notes.append("decimal fractions are written with a comma")
        return ","

    def _place_header(self, head):
        """Find the header: the last line before the first of numbers."""
        rows = [values for _, values in head]
        first = next((k for k, values in enumerate(rows) if _is_data(values)), 1)
        if first == 0:
            raise LogError(
                f"{self.path}, line {head[0][0]}: has numbers where the names of the columns are "
                "due; give the file a header."
            )
        n_fields = len(rows[first]) if first < len(rows) else len(rows[0])
        place = max((k for k in range(first) if len(rows[k]) == n_fields), default=0)
        self._n_above = place + 1
        self._n_lines = head[place + 1][0] - 1 if place + 1 < len(head) else None
        self.header = rows[place]
        if place:
            self.notes.append(f"the header is line {head[place][0]}")

    def _check_lengths(self):
        """Refuse rows longer than the header, which pandas would cut without a word."""
        n_columns = len(self.header)
        for line, values in islice(self._records(), self._n_above, None):
            if len(values) > n_columns and "".join(values[n_columns:]).strip():
                raise LogError(
                    f"{self.path}, line {line}: has {len(values)} values, more than the "
                    f"{n_columns} columns of the header."
                )

    def _records(self):
        """First line, from 1, and values of every record that is not blank; quotes hide line ends.

        LogError where the file is no such table.
        """
        limit = csv.field_size_limit(_LONGEST_FIELD)
        line = 1
        try:
            with open(self.path, encoding=self._encoding, newline="") as file:
                reader = csv.reader(file, delimiter=self._separator, skipinitialspace=True)
                for values in reader:
                    if len(values) > 1 or "".join(values).strip():
                        yield line, values
                    line = reader.line_num + 1
        except UnicodeError as error:
            raise _no_text(self.path) from error
        except (csv.Error, ValueError) as error:
            raise LogError(f"{self.path}, line {line}: is no table: {error}.") from error
        finally:
            csv.field_size_limit(limit)

    def place_of(self, row):
        """In words, on which line of the file, from 1, a row starts."""
        lines = (line for line, _ in self._records())
        return f"line {next(islice(lines, row + self._n_above, None), row + self._n_above + 1)}"

    def pieces(self, places, n_rows, labels=()):
        """Tables of so many rows, columns by their places, those of ``labels`` as texts.

        The index is the position in the file. LogError where the file is no such table.
        """
        if self._n_lines is None:
            return
        try:
            with open(self.path, encoding=self._encoding, newline="") as file:
                for _ in range(self._n_lines):
                    file.readline()
                yield from pd.read_csv(
                    file,
                    sep=self._separator,
                    decimal=self.decimal,
                    skipinitialspace=True,
                    index_col=False,
                    header=None,
                    names=range(len(self.header)),
                    usecols=list(places),
                    dtype=dict.fromkeys(labels, str),
                    na_values=dict.fromkeys(set(places) - set(labels), NO_VALUE),
                    low_memory=False,
                    chunksize=n_rows,
                )
        except pd.errors.EmptyDataError:
            return
        except pd.errors.ParserError as error:
            raise LogError(f"{self.path}: is no table: {str(error).strip()}") from error
        except UnicodeError as error:
            raise _no_text(self.path) from error


class _ParquetSource:
    """As a text file, of Parquet."""

    decimal = "."

    def __init__(self, path):
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError as error:
            message = f"{path}: Parquet needs pyarrow: pip install 'skanfis[parquet]'"
            raise ImportError(message) from error
        self.path, self.notes = path, []
        self._errors = (pyarrow.ArrowException, OSError)
        with open(path, "rb"):
            pass  # what cannot be opened is told as of any other file
        try:
            # Not buffered ahead: what was read would stay as long as the file is open.
            self._file = parquet.ParquetFile(path, pre_buffer=False)
            self.header = list(self._file.schema_arrow.names)
        except (*self._errors, ValueError) as error:
            raise self._damaged(error) from error
        if len(set(self.header)) < len(self.header):
            raise LogError(f"{path}: two columns have one name; rename one of them.")

    def _damaged(self, error):
        reason = str(error).strip().partition("\n")[0].removesuffix(".")
        return LogError(f"{self.path}: is no Parquet that can be read: {reason}.")

    def place_of(self, row):
        return f"row {row}"

    def pieces(self, places, n_rows, labels=()):
        names, begin = [self.header[place] for place in places], 0
        try:
            for batch in self._file.iter_batches(n_rows, columns=names):
                columns = {k: batch.column(self.header[k]).to_pandas() for k in places}
                table = pd.DataFrame(columns).astype(dict.fromkeys(labels, "string"))
                yield table.set_axis(pd.RangeIndex(begin, begin := begin + len(table)))
        except self._errors as error:
            raise self._damaged(error) from error


def _find_encoding(path):
    with open(path, "rb") as file:
        head = file.read(_HEAD_BYTES)
    for mark, name in _MARKS.items():
        if head.startswith(mark):
            return name
    for mark, kind in _KINDS.items():
        if head.startswith(mark):
            raise LogError(f"{path}: is {kind}, not text; export it as CSV.")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
        encoding = "utf-8-sig"
    except UnicodeDecodeError:
        encoding = "cp1252"
    # Text of Windows has no such signs, and none is UTF-16 without its mark.
    if b"\x00" in head or (
        encoding == "cp1252" and _NO_TEXT.search(head.decode(encoding, errors="replace"))
    ):
        raise _no_text(path)
    return encoding


def _no_text(path):
    return LogError(
        f"{path}: is not text in UTF-8, UTF-16 or Windows-1252; save it as one of these."
    )


def _is_data(values):
    """Whether most of the fields of a record that are not empty are numbers or times."""
    filled = [cell[:_LONGEST_NUMBER] for cell in map(str.strip, values) if cell]
    numbers = sum(bool(_NUMBER.match(cell) or _MOMENT.match(cell)) for cell in filled)
    return 2 * numbers >= max(len(filled), 1)


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
        self.form = ""
        self._day_first = False
        self._days, self._last = 0.0, None
        dates = texts[texts.str.match(_DATE)]
        if 2 * texts.str.match(_CLOCK).sum() > len(texts):
            self.form = "clock"
        elif 2 * len(dates) > len(texts):
            self._day_first = "." in dates.iloc[0].split()[0]
            self.form = next((form for form in _FORMATS if _fits(dates, form)), "mixed")

    @property
    def note(self):
        kind = "clock times" if self.form == "clock" else f"dates and times ({self.form})"
        return f"the time is read as {kind}, in s"

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
