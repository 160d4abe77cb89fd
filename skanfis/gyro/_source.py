"""Read the table in a log file: its header, its rows, and columns as numbers."""

import codecs
import contextlib
import csv
import re
from functools import partial
from itertools import islice

import numpy as np
import pandas as pd

from ..digits import counted
from ._columns import evenly_chosen, unit_in
from ._tables import EXCEL, HEAD_ROWS, MATLAB, PARQUET, ParquetSource, excel_source, matlab_source
from .errors import LogError

# Marks of missing values that loggers write, beside those that pandas knows.
NO_VALUE = ["-", "--", "---", "?", "ERR", "Err", "ERROR", "Error", "OVF", "#VALUE!", "#DIV/0!"]

# Longer lines are refused at once: csv would take minutes for one.
_LONGEST_LINE, _MOST_COLUMNS = 2**22, 10_000
_HEAD_BYTES = 2**16
_END_OF_PREAMBLE = "***End_of_Header***"
_SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "", " ": "blanks"}
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f]")
# A cell that is a number, a date or a time; a number with a decimal fraction.
_VALUE = re.compile(r"[+\u2212-]?[.,]?[0-9][0-9.,:/TZeE +-]*([AP]M)?$")
_FRACTION = re.compile(r"[+\u2212-]?[0-9]*([.,])[0-9]+([eE][+-]?[0-9]+)?$")

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


def open_source(path):
    """The table in a file; LogError where there is none."""
    name = str(path).lower()
    if name.endswith(PARQUET):
        return ParquetSource(path)
    if name.endswith(MATLAB):
        return matlab_source(path)
    return excel_source(path, header_place) if name.endswith(EXCEL) else _TextSource(path)


class _TextSource:
    """A text file with a header and one record per line.

    ``header`` are the names of the columns, ``decimal`` is the sign of the decimal fraction;
    ``notes`` say what was detected.
    """

    def __init__(self, path):
        self.path, self.notes = path, []
        self._encoding = _find_encoding(path)
        if self._encoding != "utf-8-sig":
            self.notes.append(f"the text is read as {self._encoding.upper()}")
        self._find_separator()
        head = list(islice(self._records(), HEAD_ROWS))
        if not head:
            raise LogError(f"{path}: is empty.")
        self._place_header(head)
        self.decimal = self._find_decimal(head)
        self._check_lengths()

    def _find_separator(self):
        """Take the first separator that is on all lines but a preamble's; else a comma."""
        for sign, name in _SEPARATORS.items():
            self._separator = sign
            lengths = [len(values) for _, values in islice(self._records(), HEAD_ROWS)]
            # A comma need only be on the last line: blanks, the next choice, are in any text.
            ends = lengths[len(lengths) // 3 :] if sign != "," else lengths[-1:]
            if min(ends, default=0) > 1:
                self.notes += [f"columns are separated by {name}"] if name else []
                return
        self._separator = ","

    def _find_decimal(self, head):
        cells = [cell.strip() for _, values in head for cell in values]
        signs = [found[1] for cell in cells if (found := _FRACTION.match(cell))]
        if self._separator == "," or signs.count(",") <= signs.count("."):
            return "."
        self.notes.append("decimal fractions are written with a comma")
        return ","

    def _place_header(self, head):
        try:
            place, first, self.header = header_place([values for _, values in head])
        except LogError as error:
            raise LogError(f"{self.path}, line {head[0][0]}: {error}") from error
        self._n_above = first
        self._n_lines = head[first][0] - 1 if first < len(head) else None
        if place:
            self.notes.append(f"the header is line {head[place][0]}; what is above it is skipped")

    def _check_lengths(self):
        """Refuse rows longer than the header, which pandas would cut silently."""
        n_columns = len(self.header)
        with contextlib.suppress(UnicodeError), open(self.path, encoding=self._encoding) as file:
            if all(line.count(self._separator) < n_columns for line in file):
                return
        for line, values in islice(self._records(), self._n_above, None):
            if len(values) > n_columns and "".join(values[n_columns:]).strip():
                raise LogError(
                    f"{self.path}, line {line}: has {counted(len(values), 'value')}, "
                    f"and the header {counted(n_columns, 'column')}."
                )

    def _records(self):
        """Yield line number (from 1) and values of each record; quoted line ends do not split one.

        Blank records are left out. LogError if the file is no such table.
        """
        limit = csv.field_size_limit(_LONGEST_LINE)
        line = 1
        try:
            with open(self.path, encoding=self._encoding, newline="") as file:
                lines = self._lines(file)
                reader = csv.reader(lines, delimiter=self._separator, skipinitialspace=True)
                for values in reader:
                    if len(values) > _MOST_COLUMNS:
                        raise LogError(
                            f"{self.path}, line {line}: has {len(values):,} columns; a log has "
                            f"{_MOST_COLUMNS:,} at most."
                        )
                    # A comment sign before the first name is not part of the name.
                    first = values[0].lstrip("#%/ ") if values else ""
                    if first or self._separator == " ":
                        values[:1] = [first] if first else []
                    if len(values) > 1 or "".join(values).strip():
                        yield line, values
                    line = reader.line_num + 1
        except LogError:
            raise
        except UnicodeError as error:
            raise _no_text(self.path) from error
        except (csv.Error, ValueError) as error:
            raise LogError(f"{self.path}, line {line}: is no table: {error}.") from error
        finally:
            csv.field_size_limit(limit)

    def _lines(self, file):
        for number, line in enumerate(iter(partial(file.readline, _LONGEST_LINE), ""), 1):
            if len(line) == _LONGEST_LINE:
                raise LogError(
                    f"{self.path}, line {number}: is longer than {_LONGEST_LINE:,} characters: "
                    "that is no log."
                )
            yield line

    def place_of(self, row):
        """The line of the file, from 1, on which a row starts, in words."""
        lines = (line for line, _ in self._records())
        return f"line {next(islice(lines, row + self._n_above, None), row + self._n_above + 1)}"

    def table(self, places, labels=(), n_rows=None):
        """The first rows, or all; columns by their places, those of ``labels`` as texts.

        The index is the position in the file. LogError if the file is no such table.
        """
        try:
            with open(self.path, encoding=self._encoding, newline="") as file:
                for _ in islice(file, self._n_lines):
                    pass
                return pd.read_csv(
                    file,
                    sep=r"\s+" if self._separator == " " else self._separator,
                    decimal=self.decimal,
                    skipinitialspace=True,
                    index_col=False,
                    header=None,
                    names=range(len(self.header)),
                    usecols=list(places),
                    dtype=dict.fromkeys(labels, str),
                    na_values=dict.fromkeys(set(places) - set(labels), NO_VALUE),
                    low_memory=False,
                    nrows=n_rows,
                )
        except pd.errors.EmptyDataError:
            return pd.DataFrame(columns=list(places), dtype="string")
        except pd.errors.ParserError as error:
            # pandas reports an interrupt by this text alone.
            if "Calling read(nbytes) on source failed" in str(error):
                raise KeyboardInterrupt from error
            raise LogError(f"{self.path}: is no table: {str(error).strip()}") from error
        except UnicodeError as error:
            raise _no_text(self.path) from error


def header_place(rows):
    """Find the header among the first rows: its place, that of the first row below, the names.

    The header is the last line before those of numbers. Units may have a line of their own.
    """
    # LabVIEW marks the end of its preamble, which has lines of numbers.
    ends = [k for k, values in enumerate(rows) if values[0].strip() == _END_OF_PREAMBLE]
    start = ends[-1] + 1 if ends else 0
    data = [k >= start and _is_data(values) for k, values in enumerate(rows)]
    if not any(data) and len(rows) == HEAD_ROWS:
        raise LogError(f"has no row of numbers in its first {len(rows)} lines.")
    # A line of the preamble may hold numbers too, but no three such lines in a row.
    together = [
        k
        for k in range(len(rows))
        if all(data[k : k + 3]) and len({len(values) for values in rows[k : k + 3]}) == 1
    ]
    first = next(iter(together), data.index(True) if any(data) else start + 1)
    if first == 0:
        raise LogError("has numbers where names of columns are due; give the file a header.")
    n_fields = len(rows[first]) if first < len(rows) else len(rows[start])
    fits = [k for k in range(start, first) if len(rows[k]) == n_fields]
    place = fits[-1] if fits else start
    units = [cell.strip(" []()-") for cell in rows[place]]
    n_units = sum(unit_in(unit) is not None for unit in units)
    if len(fits) > 1 and n_units > 1 and n_units == sum(map(bool, units)):
        above = zip(rows[fits[-2]], units, strict=True)
        return fits[-2], place + 1, [f"{name} [{unit}]" if unit else name for name, unit in above]
    return place, place + 1, rows[place]


def _find_encoding(path):
    with open(path, "rb") as file:
        head = file.read(_HEAD_BYTES)
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    for encoding in ("utf-8-sig", "cp1252"):
        with contextlib.suppress(UnicodeDecodeError):
            # Incremental, because the head may end within a character.
            text = codecs.getincrementaldecoder(encoding)().decode(head)
            if not _NO_TEXT.search(text):
                return encoding
    raise _no_text(path)


def _no_text(path):
    return LogError(
        f"{path}: is not text in UTF-8, UTF-16 or Windows-1252; export it as CSV in one of these, "
        "or unpack it."
    )


def _is_data(values):
    """Whether most of the fields of a record that are not empty are numbers or times."""
    filled = [cell.strip() for cell in values if cell.strip()]
    return bool(filled) and 2 * sum(bool(_VALUE.match(cell)) for cell in filled) >= len(filled)


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
