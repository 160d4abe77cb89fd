"""Read tables from files of Parquet, MATLAB and Excel, as sources of a log."""

from collections.abc import Mapping
from contextlib import contextmanager

import numpy as np
import pandas as pd

from .errors import LogError, needed

PARQUET, MATLAB, EXCEL = (".parquet", ".pq"), (".mat",), (".xlsx", ".xlsm")
_HDF5 = b"\x89HDF"
# Enough for the lines that a logger may write above the header, and a few rows.
HEAD_ROWS = 60


class TableSource:
    """A table held in memory, as a source; ``first`` is the number of its first row."""

    decimal = "."

    def __init__(self, path, table, notes, first=0):
        self.path, self.notes, self.header = path, notes, list(map(str, table.columns))
        self._table, self._first = table.set_axis(range(table.shape[1]), axis=1), first

    def place_of(self, row):
        return f"row {row + self._first}"

    def table(self, places, labels=(), n_rows=None):
        return self._table[list(places)][:n_rows].astype(dict.fromkeys(labels, "string"))


class ParquetSource(TableSource):
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


def matlab_source(path):
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
    return TableSource(path, pd.DataFrame(columns), notes, first=1)  # MATLAB counts from 1


@contextmanager
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


def excel_source(path, header_place):
    """The first sheet that holds a table; ``header_place`` finds the header in its first rows."""
    told = f"{path}: Excel needs openpyxl: pip install 'skanfis[logs]'; or save it as CSV"
    needed("openpyxl", told)
    with _read_as("Excel file", path):
        sheets = pd.read_excel(path, sheet_name=None, header=None, engine="openpyxl")
    name, sheet = next(((k, s) for k, s in sheets.items() if s.size), (None, None))
    if sheet is None:
        raise LogError(f"{path}: is empty.")
    notes = [f"of {len(sheets)} sheets {name!r} is read"] if len(sheets) > 1 else []
    head = sheet.head(HEAD_ROWS).astype(object)
    try:
        place, first, header = header_place(head.where(head.notna(), "").astype(str).to_numpy())
    except LogError as error:
        raise LogError(f"{path}: {error}") from error
    if place:
        notes.append(f"the header is row {place + 1}; what is above it is skipped")
    table = sheet.iloc[first:].reset_index(drop=True).infer_objects()
    return TableSource(path, table.set_axis(header, axis=1), notes, first + 1)
