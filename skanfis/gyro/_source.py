"""Sources of a log: the table in a text file, or one of Parquet, MATLAB or Excel."""

import codecs
import contextlib
import csv
import re
from collections.abc import Mapping
from functools import partial
from itertools import islice

import numpy as np
import pandas as pd

from ..digits import counted
from ._columns import unit_in
from ._numbers import NO_VALUE
from .errors import LogError, needed

_PARQUET, _MATLAB, _EXCEL = (".parquet", ".pq"), (".mat",), (".xlsx", ".xlsm")
_HDF5 = b"\x89HDF"
# Enough for the lines that a logger may write above the header, and a few rows.
_HEAD_ROWS = 60
# Longer lines are refused at once: csv would take minutes for one.
_LONGEST_LINE, _MOST_COLUMNS = 2**22, 10_000
_HEAD_BYTES = 2**16
_END_OF_PREAMBLE = "***End_of_Header***"
_SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "", " ": "blanks"}
_NO_TEXT = re.compile("[\x00-\x08\x0e-\x1f\x7f]")
# A cell that is a number, a date or a time; a number with a decimal fraction.
_VALUE = re.compile(r"[+\u2212-]?[.,]?[0-9][0-9.,:/TZeE +-]*([AP]M)?$")
_FRACTION = re.compile(r"[+\u2212-]?[0-9]*([.,])[0-9]+([eE][+-]?[0-9]+)?$")


def open_source(path):
    """The table in a file; LogError where there is none."""
    name = str(path).lower()
    if name.endswith(_PARQUET):
        return _ParquetSource(path)
    if name.endswith(_MATLAB):
        return _matlab_source(path)
    return _excel_source(path) if name.endswith(_EXCEL) else _TextSource(path)


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
        head = list(islice(self._records(), _HEAD_ROWS))
        if not head:
            raise LogError(f"{path}: is empty.")
        place, first, self.header = _header_place(path, [values for _, values in head])
        self._n_above = first
        self._n_lines = head[first][0] - 1 if first < len(head) else None
        if place:
            self.notes.append(f"the header is line {head[place][0]}; what is above it is skipped")
        self.decimal = self._find_decimal(head)
        self._check_lengths()

    def _find_separator(self):
        """Take the first separator that is on all lines but a preamble's; else a comma."""
        for sign, name in _SEPARATORS.items():
            self._separator = sign
            lengths = [len(values) for _, values in islice(self._records(), _HEAD_ROWS)]
            # A comma need only be on the last line. The next choice, a blank, is in any text.
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


def _header_place(path, rows):
    """Find the header among the first rows: its place, that of the first row below, the names.

    The header is the last line before those of numbers. Units may have a line of their own.
    """
    # LabVIEW marks the end of its preamble, which has lines of numbers.
    ends = [k for k, values in enumerate(rows) if values[0].strip() == _END_OF_PREAMBLE]
    start = ends[-1] + 1 if ends else 0
    data = [k >= start and _is_data(values) for k, values in enumerate(rows)]
    if not any(data) and len(rows) == _HEAD_ROWS:
        raise LogError(f"{path}: has no row of numbers in its first {len(rows)} lines.")
    # A line of the preamble may hold numbers too, but no three such lines in a row.
    together = [
        k
        for k in range(len(rows))
        if all(data[k : k + 3]) and len({len(values) for values in rows[k : k + 3]}) == 1
    ]
    first = next(iter(together), data.index(True) if any(data) else start + 1)
    if first == 0:
        raise LogError(f"{path}: has numbers where names are due; give the file a header.")
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


class _TableSource:
    """A table held in memory, as a source; ``first`` is the number of its first row."""

    decimal = "."

    def __init__(self, path, table, notes, first=0):
        self.path, self.notes, self.header = path, notes, list(map(str, table.columns))
        self._table, self._first = table.set_axis(range(table.shape[1]), axis=1), first

    def place_of(self, row):
        return f"row {row + self._first}"

    def table(self, places, labels=(), n_rows=None):
        return self._table[list(places)][:n_rows].astype(dict.fromkeys(labels, "string"))


class _ParquetSource(_TableSource):
    """A table of which only the columns asked for are read."""

    def __init__(self, path):
        told = f"{path}: Parquet needs pyarrow: pip install 'skanfis[parquet]'"
        parquet = needed("pyarrow.parquet", told)
        with open(path, "rb"):
            pass  # raises the same errors as for any other file
        with _read_as("Parquet", path):
            # No buffer: it would keep the data as long as the file is open.
            self._file = parquet.ParquetFile(path, pre_buffer=False)
        super().__init__(path, pd.DataFrame(columns=self._file.schema_arrow.names), [])
        if len(set(self.header)) < len(self.header):
            raise LogError(f"{path}: two columns have one name; rename one of them.")

    def table(self, places, labels=(), n_rows=None):
        names = [self.header[place] for place in places]
        with _read_as("Parquet", self.path):
            if n_rows and self._file.metadata.num_rows > n_rows:
                found = next(self._file.iter_batches(n_rows, columns=names))
            else:
                found = self._file.read(columns=names)
            columns = {place: found.column(self.header[place]).to_pandas() for place in places}
        return pd.DataFrame(columns).astype(dict.fromkeys(labels, "string"))


def _matlab_source(path):
    """The vectors of the commonest length in a .mat file, from variables or fields of structs."""
    with open(path, "rb") as file:
        head = file.read(516)
    with _read_as("MATLAB file", path):
        if _HDF5 in (head[:4], head[512:]):
            told = "MATLAB 7.3 needs h5py: pip install 'skanfis[logs]'; or save it with -v7"
            with needed("h5py", f"{path}: {told}").File(path) as tree:
                found = dict(_vectors(tree))
        else:
            from scipy.io import loadmat

            found = dict(_vectors(loadmat(path, simplify_cells=True)))
    lengths = [len(values) for values in found.values() if len(values) > 1]
    if not lengths:
        raise LogError(f"{path}: has no vectors of numbers; save them as variables or a struct.")
    length = max(set(lengths), key=lengths.count)
    columns = {name: values for name, values in found.items() if len(values) == length}
    others = sorted(set(found) - set(columns))
    notes = [f"variables of another length are skipped: {', '.join(others)}"] if others else []
    return _TableSource(path, pd.DataFrame(columns), notes, first=1)  # MATLAB counts from 1


@contextlib.contextmanager
def _read_as(kind, path):
    """Raise LogError if a library cannot read the file as its kind."""
    try:
        yield
    except (ImportError, MemoryError):
        raise
    except Exception as error:
        # Damaged archives, XML and compression raise errors of many types.
        reason = str(error).strip().partition("\n")[0].removesuffix(".")
        raise LogError(f"{path}: is no {kind} that can be read: {reason}.") from error


def _vectors(tree):
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _vectors(value)
        elif not name.startswith(("__", "#")) and np.asarray(value).dtype.kind in "iufU":
            vector = np.atleast_1d(np.squeeze(value))
            if vector.ndim == 1:
                yield name, vector


def _excel_source(path):
    """The first sheet that holds a table."""
    told = f"{path}: Excel needs openpyxl: pip install 'skanfis[logs]'; or save it as CSV"
    needed("openpyxl", told)
    with _read_as("Excel file", path):
        sheets = pd.read_excel(path, sheet_name=None, header=None, engine="openpyxl")
    name, sheet = next(((k, s) for k, s in sheets.items() if s.size), (None, None))
    if sheet is None:
        raise LogError(f"{path}: is empty.")
    notes = [f"of {len(sheets)} sheets {name!r} is read"] if len(sheets) > 1 else []
    head = sheet.head(_HEAD_ROWS).astype(object)
    cells = head.where(head.notna(), "").astype(str).to_numpy()
    place, first, header = _header_place(path, cells)
    if place:
        notes.append(f"the header is row {place + 1}; what is above it is skipped")
    table = sheet.iloc[first:].reset_index(drop=True).infer_objects()
    return _TableSource(path, table.set_axis(header, axis=1), notes, first + 1)
