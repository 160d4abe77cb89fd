"""A log as text: its encoding, its signs, where its header is, and its rows piece by piece."""

import codecs
import csv
import re
from contextlib import contextmanager
from itertools import islice

import pandas as pd

from ._columns import unit_in
from .errors import LogError

__all__ = ["TextLog"]

# The largest limit that the module csv takes on every system.
_LONGEST_FIELD = 2**31 - 1
# Of a file, by which encoding, separator and header are told.
_HEAD_BYTES = 2**16
# Lines above the header that a logger may write, and a few rows to tell the columns by.
_HEAD_RECORDS = 60
# Patterns look at no more of a cell: no number is longer.
_LONGEST_NUMBER = 60
_SEPARATORS = "\t;|,"
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_KINDS = {b"\x1f\x8b": "compressed", b"PK\x03\x04": "an archive or a workbook", b"PAR1": "Parquet"}
# What loggers write where there is no value, beside what pandas knows.
_NO_VALUE = ("-", "--", "---", "?", "ERR", "Err", "ERROR", "Error", "OVF", "#VALUE!", "#DIV/0!")
_NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?$")
_MOMENT = re.compile(r"[0-9]{1,4}([:./-])[0-9]{1,2}(\1[0-9]|[T ,:]|$)")


class TextLog:
    """A file of text with one record per line, as far as it can be told from its first lines.

    Parameters
    ----------
    path : str or path-like
    separator, decimal, encoding : str or None
        None is found out.

    Attributes
    ----------
    header : list of str
    units : list of str
        Of a line of units below the header; empty strings where there is none.
    notes : list of str
        What was found out, in sentences.
    """

    no_value = _NO_VALUE

    def __init__(self, path, separator=None, decimal=None, encoding=None):
        self.path = path
        self.notes: list[str] = []
        self.in_seconds: set[int] = set()
        self.encoding = encoding or self._find_encoding()
        self.separator = separator or self._find_separator()
        head = list(islice(self._records(), _HEAD_RECORDS))
        if not head:
            raise LogError(f"{path}: is empty.")
        self._place_header(head)
        cells = [cell for _, values in head for cell in values]
        self.decimal = decimal or self._find_decimal(cells)
        if self.separator == self.decimal:
            raise ValueError(
                f"separator and decimal are both {self.decimal!r}: numbers would be cut."
            )

    def _find_encoding(self):
        with open(self.path, "rb") as file:
            head = file.read(_HEAD_BYTES)
        for mark, name in _MARKS:
            if head.startswith(mark):
                self._say_encoding(name)
                return name
        for mark, kind in _KINDS.items():
            if head.startswith(mark):
                raise LogError(f"{self.path}: is {kind}, not text; export it as CSV.")
        if b"\x00" in head:
            # Of two bytes each: those of Latin text and of digits are zero in every other place.
            zeros = [head[start::2].count(0) for start in (0, 1)]
            if min(zeros) == 0 and 5 * max(zeros) > len(head):
                name = "utf-16-le" if zeros[1] else "utf-16-be"
                self._say_encoding(name)
                return name
            raise self._no_text()
        return "utf-8-sig" if self._is_utf8() else self._one_byte(head)

    def _is_utf8(self):
        decoder = codecs.getincrementaldecoder("utf-8")()
        with open(self.path, "rb") as file:
            try:
                while block := file.read(2**20):
                    decoder.decode(block)
                decoder.decode(b"", final=True)
            except UnicodeDecodeError:
                return False
        return True

    def _one_byte(self, head):
        """Windows' Western encoding, if it is text in it at all."""
        try:
            text = head.decode("cp1252")
        except UnicodeDecodeError as error:
            raise self._no_text() from error
        if any(not (sign.isprintable() or sign in "\t\r\n\f\xa0\xad") for sign in text):
            raise self._no_text()
        self._say_encoding("cp1252")
        return "cp1252"

    def _say_encoding(self, name):
        if name != "utf-8-sig":
            self.notes.append(f"the text is read as {name.upper()}")

    def _no_text(self):
        return LogError(
            f"{self.path}: is not text in UTF-8, UTF-16 or Windows-1252; save it as such, or name "
            "its encoding."
        )

    def _find_separator(self):
        """The first sign that cuts all lines into as many fields, two at least; else a comma."""
        most, found = 1, ","
        for sign in _SEPARATORS:
            self.separator = sign
            try:
                lengths = [len(values) for _, values in islice(self._records(), _HEAD_RECORDS)]
            except LogError:
                continue
            body = lengths[len(lengths) // 3 :]  # below a preamble
            if body and min(body) == max(body) > 1:
                if sign != ",":
                    self.notes.append(f"columns are separated by {_SIGNS.get(sign, sign)}")
                return sign
            if lengths and lengths[0] > most:
                most, found = lengths[0], sign
        return found

    def _find_decimal(self, cells):
        if self.separator == ",":
            return "."
        commas = sum(bool(_NUMBER.match(cell)) and "," in cell for cell in map(str.strip, cells))
        points = sum(bool(_NUMBER.match(cell)) and "." in cell for cell in map(str.strip, cells))
        if commas > points:
            self.notes.append("decimal fractions are written with a comma")
            return ","
        return "."

    def _place_header(self, head):
        """Find the header: the last line before the first of numbers, lines of units apart."""
        first = next((k for k, (_, values) in enumerate(head) if _is_data(values)), None)
        before = head[:first]
        if first == 0:
            line = head[0][0]
            raise LogError(
                f"{self.path}, line {line}: has numbers where the names of the columns are due; "
                "give the file a header."
            )
        place = 0
        if first is not None:
            n_fields = len(head[first][1])
            place = max(
                (k for k, (_, values) in enumerate(before) if len(values) == n_fields), default=0
            )
        units = [""] * len(head[place][1])
        after = place + 1
        if place and _are_units(head[place][1]) and len(head[place - 1][1]) == len(units):
            units, place = [cell.strip() for cell in head[place][1]], place - 1
        if place:
            s = "s" if place > 1 else ""
            self.notes.append(
                f"{place} line{s} above the header {'are' if s else 'is'} passed over"
            )
        self.header, self.units = head[place][1], units
        self._n_above = after

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
        except (UnicodeError, LookupError) as error:
            raise self._no_text() from error
        except (csv.Error, ValueError) as error:
            raise LogError(f"{self.path}, line {line}: is no table: {error}.") from error
        finally:
            csv.field_size_limit(limit)

    def check_lengths(self):
        """Refuse rows longer than the header, such as those of a decimal comma beside commas.

        pandas cuts them without a word where it reads some columns only.
        """
        n_columns, separator = len(self.header), self.separator
        try:
            with open(self.path, encoding=self.encoding, newline="") as file:
                # Counting is fast, and right as long as there are no quotes.
                if all(line.count(separator) < n_columns and '"' not in line for line in file):
                    return
        except UnicodeError as error:
            raise self._no_text() from error
        for line, values in islice(self._records(), self._n_above, None):
            if any(value.strip() for value in values[n_columns:]):
                raise LogError(
                    f"{self.path}, line {line}: has {len(values)} values, more than the "
                    f"{n_columns} columns of the header."
                )

    def place_of(self, row):
        """In words, on which line of the file, from 1, a row starts."""
        lines = (line for line, _ in self._records())
        return f"line {next(islice(lines, row + self._n_above, None), row + self._n_above + 1)}"

    def sample(self, n_rows):
        """The first rows, as text; shape (n_rows, n_columns), columns by their places."""
        every = dict.fromkeys(range(len(self.header)), str)
        try:
            with self._body() as file:
                return pd.read_csv(file, dtype=every, nrows=n_rows, **self._options())
        except (ValueError, pd.errors.ParserError) as error:
            raise LogError(f"{self.path}: is no table: {str(error).strip()}") from error

    def pieces(self, kinds, n_rows):
        """Tables of so many rows: columns by their places; ``kinds`` is float or str by place.

        ValueError where a number is none.
        """
        quantities = {place: list(_NO_VALUE) for place, kind in kinds.items() if kind is float}
        with self._body() as file:
            try:
                yield from pd.read_csv(
                    file,
                    dtype=kinds,
                    usecols=list(kinds),
                    na_values=quantities,
                    chunksize=n_rows,
                    **self._options(),
                )
            except pd.errors.EmptyDataError:
                return
            except pd.errors.ParserError as error:
                raise LogError(f"{self.path}: is no table: {str(error).strip()}") from error
            except UnicodeError as error:
                raise self._no_text() from error

    @contextmanager
    def _body(self):
        """The file as text, from the line below the header on."""
        with open(self.path, encoding=self.encoding, newline="") as file:
            limit = csv.field_size_limit(_LONGEST_FIELD)
            try:
                # Line by line: what a file gives as an iterator cannot be read on by others.
                lines = iter(file.readline, "")
                reader = csv.reader(lines, delimiter=self.separator, skipinitialspace=True)
                count = 0
                while count < self._n_above:
                    values = next(reader)
                    count += len(values) > 1 or bool("".join(values).strip())
            finally:
                csv.field_size_limit(limit)
            yield file

    def _options(self):
        """What is the same for every reading."""
        return {
            "sep": self.separator,
            "decimal": self.decimal,
            "skipinitialspace": True,
            "index_col": False,
            "header": None,
            "names": list(range(len(self.header))),
        }


_SIGNS = {"\t": "tabs", ";": "semicolons", "|": "bars"}


def _is_data(values):
    """Whether most of the fields of a record that are not empty are numbers or times."""
    filled = [cell[:_LONGEST_NUMBER] for cell in map(str.strip, values) if cell]
    numbers = sum(bool(_NUMBER.match(cell) or _MOMENT.match(cell)) for cell in filled)
    return 2 * numbers >= max(len(filled), 1)


def _are_units(values):
    filled = [cell for cell in map(str.strip, values) if cell]
    return bool(filled) and all(unit_in(cell.strip("[](){}")) for cell in filled)
