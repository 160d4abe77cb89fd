"""The table in a file, text or Parquet: its header, and its rows in pieces, columns by position."""

import codecs
import csv
import re
from itertools import islice

import pandas as pd

from ._values import NO_VALUE
from .errors import LogError

__all__ = ["ParquetSource", "TextSource", "open_source"]

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
_CONTROL = re.compile("[\x00-\x08\x0e-\x1f\x7f\x81\x8d\x8f\x90\x9d\ufffd]")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?$")
_MOMENT = re.compile(r"[0-9]{1,4}([:./-])[0-9]{1,2}(\1[0-9]|[T ,:]|$)")


def open_source(path, separator=None, decimal=None, encoding=None):
    """The table in a file; LogError where there is none."""
    if str(path).lower().endswith((".parquet", ".pq")):
        return ParquetSource(path)
    return TextSource(path, separator, decimal, encoding)


class TextSource:
    """A text file with a header and one record per line; what is None is found out.

    ``header`` are the names of the columns; ``notes`` tell what was found out.
    """

    def __init__(self, path, separator=None, decimal=None, encoding=None):
        self.path, self.notes = path, []
        self.encoding = encoding or _find_encoding(path)
        if encoding is None and self.encoding != "utf-8-sig":
            self.notes.append(f"the text is read as {self.encoding.upper()}")
        self.separator = separator or self._find_separator()
        head = list(islice(self._records(), _HEAD_RECORDS))
        if not head:
            raise LogError(f"{path}: is empty.")
        self._place_header(head)
        self.decimal = decimal or self._find_decimal(head)
        if self.separator == self.decimal:
            raise ValueError(
                f"separator and decimal are both {self.decimal!r}: numbers would be cut."
            )

    def _find_separator(self):
        """The first sign that cuts all lines into as many fields, two at least; else a comma."""
        most, found = 1, ","
        for sign, name in _SEPARATORS.items():
            self.separator = sign
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
        if self.separator == "," or commas <= sum("." in cell for cell in numbers):
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

    def _records(self):
        """First line, from 1, and values of every record that is not blank; quotes hide line ends.

        LogError where the file is no such table.
        """
        limit = csv.field_size_limit(_LONGEST_FIELD)
        line = 1
        try:
            with open(self.path, encoding=self.encoding, newline="") as file:
                reader = csv.reader(file, delimiter=self.separator, skipinitialspace=True)
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
        """Tables of so many rows: columns by their places, those of ``labels`` as texts.

        LogError where the file is no such table.
        """
        if self._n_lines is None:
            return
        try:
            with open(self.path, encoding=self.encoding, newline="") as file:
                for _ in range(self._n_lines):
                    file.readline()
                yield from pd.read_csv(
                    file,
                    sep=self.separator,
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

    def check_lengths(self):
        """Refuse rows longer than the header, which pandas would cut without a word."""
        n_columns = len(self.header)
        for line, values in islice(self._records(), self._n_above, None):
            if len(values) > n_columns and "".join(values[n_columns:]).strip():
                raise LogError(
                    f"{self.path}, line {line}: has {len(values)} values, more than the "
                    f"{n_columns} columns of the header."
                )


class ParquetSource:
    """As :class:`TextSource`, of Parquet."""

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

    def check_lengths(self):
        """Every row of such a file has every column."""

    def pieces(self, places, n_rows, labels=()):
        """Tables of so many rows at most, as of :class:`TextSource`."""
        names = [self.header[place] for place in places]
        try:
            for batch in self._file.iter_batches(n_rows, columns=names):
                table = {k: batch.column(self.header[k]).to_pandas() for k in places}
                yield pd.DataFrame(table).astype(dict.fromkeys(labels, "string"))
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
        with open(path, encoding="utf-8") as file:
            while b"\x00" not in head and file.read(_HEAD_BYTES):
                pass
        if b"\x00" not in head:
            return "utf-8-sig"
    except UnicodeDecodeError:
        pass
    if _CONTROL.search(head.decode("cp1252", errors="replace")):
        raise _no_text(path)
    return "cp1252"


def _no_text(path):
    return LogError(
        f"{path}: is not text in UTF-8, UTF-16 or Windows-1252; save it as such, or name its "
        "encoding."
    )


def _is_data(values):
    """Whether most of the fields of a record that are not empty are numbers or times."""
    filled = [cell[:_LONGEST_NUMBER] for cell in map(str.strip, values) if cell]
    numbers = sum(bool(_NUMBER.match(cell) or _MOMENT.match(cell)) for cell in filled)
    return 2 * numbers >= max(len(filled), 1)
