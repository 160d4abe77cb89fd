"""Tables in files of Parquet, MATLAB and Excel, in the form of a source of a log."""

from collections.abc import Mapping
from contextlib import nullcontext

import numpy as np
import pandas as pd

from .errors import LogError

PARQUET, MATLAB, EXCEL = (".parquet", ".pq"), (".mat",), (".xlsx", ".xlsm")
_HDF5 = b"\x89HDF"
_HEAD_ROWS = 60


class TableSource:
    """As a text file, of a table that is held whole; ``first`` is the number of its first row."""

    decimal = "."

    def __init__(self, path, table, notes, first=0):
        self.path, self.notes, self.header = path, notes, list(map(str, table.columns))
        self._table, self._first = table.set_axis(range(table.shape[1]), axis=1), first

    def place_of(self, row):
        return f"row {row + self._first}"

    def pieces(self, places, n_rows, labels=()):
        for begin in range(0, len(self._table), n_rows):
            piece = self._table.iloc[begin : begin + n_rows][list(places)]
            yield piece.astype(dict.fromkeys(labels, "string"))


def parquet_source(path):
    """The table in a Parquet file, its index among the columns."""
    try:
        from pyarrow import ArrowException, parquet
    except ImportError as error:
        message = f"{path}: Parquet needs pyarrow: pip install 'skanfis[parquet]'"
        raise ImportError(message) from error
    with open(path, "rb") as file:
        try:
            table = parquet.ParquetFile(file).read()
            table = table.to_pandas(ignore_metadata=True, split_blocks=True)
        except (ArrowException, OSError, ValueError) as error:
            reason = str(error).strip().partition("\n")[0].removesuffix(".")
            raise LogError(f"{path}: is no Parquet that can be read: {reason}.") from error
    return TableSource(path, table, [])


def matlab_source(path):
    """The vectors of one length in a .mat file, of variables or of the fields of structs."""
    with open(path, "rb") as file:
        is_hdf5 = _HDF5 in (file.read(4), file.seek(512) and file.read(4))
    try:
        with (_hdf5 if is_hdf5 else _mat)(path) as tree:
            found = dict(_vectors(tree))
    except (ValueError, TypeError, NotImplementedError, OSError, KeyError) as error:
        raise LogError(f"{path}: is no MATLAB file that can be read: {error}") from error
    lengths = [len(values) for values in found.values() if len(values) > 1]
    if not lengths:
        raise LogError(f"{path}: has no vectors of numbers; save them as variables or a struct.")
    length = max(set(lengths), key=lengths.count)
    columns = {name: values for name, values in found.items() if len(values) == length}
    others = sorted(set(found) - set(columns))
    notes = [f"variables of another length are passed over: {', '.join(others)}"] if others else []
    return TableSource(path, pd.DataFrame(columns), notes)


def _mat(path):
    from scipy.io import loadmat

    return nullcontext(loadmat(path, simplify_cells=True))


def _hdf5(path):
    try:
        import h5py
    except ImportError as error:
        raise ImportError(
            f"{path}: MATLAB 7.3 needs h5py: pip install 'skanfis[logs]'; or save it with -v7"
        ) from error
    return h5py.File(path)


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
    try:
        import openpyxl  # noqa: F401
    except ImportError as error:
        raise ImportError(
            f"{path}: Excel needs openpyxl: pip install 'skanfis[logs]'; or save it as CSV"
        ) from error
    try:
        sheets = pd.read_excel(path, sheet_name=None, header=None, engine="openpyxl")
    except Exception as error:
        # Of a damaged archive or XML, by many names.
        raise LogError(f"{path}: is no Excel file that can be read: {error}") from error
    name, sheet = next(((k, s) for k, s in sheets.items() if s.size), (None, None))
    if sheet is None:
        raise LogError(f"{path}: is empty.")
    notes = [f"of {len(sheets)} sheets {name!r} is read"] if len(sheets) > 1 else []
    head = sheet.head(_HEAD_ROWS).astype(object)
    try:
        place, first, header = header_place(head.where(head.notna(), "").astype(str).to_numpy())
    except LogError as error:
        raise LogError(f"{path}: {error}") from error
    if place:
        notes.append(f"{place} rows above the header are passed over")
    table = sheet.iloc[first:].reset_index(drop=True).infer_objects()
    return TableSource(path, table.set_axis(header, axis=1), notes, first + 1)
