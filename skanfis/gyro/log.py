"""Reading a calibration log from its files.

The columns of a log play parts: ``time``, ``temperature``, ``output`` (the gyro's own signal),
``rate`` (the truth, from the rate table), ``run`` (from one power-on to the next) and ``device``.
A log that has been read has its columns by these names, in s, degC and deg/s.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ._checks import LABELS, check_log
from ._columns import declared_units
from ._files import check_different
from ._layout import COLUMNS, Request
from ._runs import lost_rows, name_runs, split_runs
from ._table import LogFile
from .errors import LogError

__all__ = [
    "Columns",
    "LogError",
    "Reading",
    "check_log",
    "checked_request",
    "notes_of",
    "read",
    "read_log",
    "short_names",
]


def read_log(
    paths: Any,
    *,
    columns: dict[str, Any] | None = None,
    units: dict[str, Any] | None = None,
    require: Sequence[str] | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
) -> pd.DataFrame:
    r"""Read one log from one or several files.

    Only the columns that play a part are read. Without a column for the run, each file is a run.
    A run never extends over two files or devices: two that only share a label are told apart.

    Parameters
    ----------
    paths : str, path, or sequence of these
        Text files with a header line, or Parquet files (with pyarrow).
    columns : dict of str to str, default=None
        Names in the file by part: keys "time", "temperature", "output", "rate", "run", "device".
        A part that is not named here has its own name in the file. Blanks around names, and
        capitals, do not matter where one column alone fits.
    units : dict of str to str, default=None
        Units in the file of "time" (s, ms, us, ns, min, h), "temperature" (degC, K, degF), "rate"
        and "output" (deg/s, deg/h, rad/s, mrad/s, rpm); "output" may also be a raw signal, in
        counts, V or mV. By default s, degC and deg/s. Times that are no numbers (ISO 8601, dates,
        clocks) come in seconds by themselves.
    require : sequence of str, default=None
        Parts without which the log is refused; None stands for temperature, output and rate. The
        others are read where the file has them.
    separator : str, default=None
        Sign between columns; None finds out which of comma, semicolon, tab and bar it is.
    decimal : str, default=None
        Sign of the decimal fraction; None finds out whether it is a comma.
    encoding : str, default=None
        Of the text; None finds out whether it is UTF-8, UTF-16 or Windows-1252.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        Columns by their parts, in the order above: numbers in s, degC and deg/s (a raw signal in
        its own unit), run and device as categories of strings.

    Raises
    ------
    LogError
        If a file is empty, no such table, or there twice; if a column that is required is not
        there; if a value is missing or no number. The message names the file, its column and line.
    ValueError
        If ``columns``, ``units`` or ``require`` name an unknown part or unit, or if ``separator``
        or ``decimal`` is no single sign.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from skanfis.gyro import read_log
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t_s,temp,counts,table\n0,293.15,-190,10\n1,293.25,-380,20\n")
    ...     names = {"time": "t_s", "temperature": "temp", "output": "counts", "rate": "table"}
    ...     read_log(path, columns=names, units={"temperature": "K", "output": "counts"})
       time  temperature  output  rate
    0   0.0         20.0  -190.0  10.0
    1   1.0         20.1  -380.0  20.0
    """
    require = ("temperature", "output", "rate") if require is None else tuple(require)
    request = Request(columns or {}, units or {}, require, separator, decimal, encoding)
    return read([paths] if isinstance(paths, str | Path) else list(paths), request).log


@dataclass
class Reading:
    """A log that has been read, with what was found out on the way.

    Attributes
    ----------
    log : DataFrame of shape (n_rows, n_parts)
        As :func:`read_log` returns it.
    files : list of LogFile
    notes : list of str
        What was found out, in sentences without a full stop.
    n_rows : int
        Rows that there were, held or not.
    is_exact : bool
        Whether every row of the log is one of a file, in the order of the files.
    places : ndarray of shape (n_rows,), optional
        Which of the files' rows they are, where the log is too long and only some are held.
    made : dict of str to ndarray
        Inputs that were made while all rows were at hand.
    """

    log: pd.DataFrame
    files: list
    notes: list
    n_rows: int
    is_exact: bool = True
    places: np.ndarray | None = None
    made: dict = field(default_factory=dict)

    @property
    def units(self):
        """Units of the parts in the (first) file."""
        return self.files[0].layout.units

    def name_row(self, row):
        """In words, where a row of the log is found."""
        if self.is_exact:
            left = row if self.places is None else int(self.places[row])
            for file in self.files:
                n_kept = file.n_rows - len(file.dropped)
                if left < n_kept:
                    return file.place_of(left)
                left -= n_kept
        if "run" in self.log:
            return f"row {row}, in run {self.log['run'].iloc[row]}"
        return f"row {row}"

    def located(self, error):
        """An error of :func:`check_log` in the words of the files."""
        if error.column is None:
            return error
        layout = self.files[0].layout
        name = layout.name(error.column) if error.column in layout.places else error.column
        called = f"column {name!r}" + ("" if name == error.column else f" ({error.column})")
        where = self.files[0].path if len(self.files) == 1 else "the log"
        if error.row is not None:
            where = self.name_row(error.row)
        return LogError(f"{where}, {called}: {error.reason}")

    def of_device(self, name):
        """The rows of one device alone."""
        log = self.log[(self.log["device"] == name).to_numpy()].reset_index(drop=True)
        for part in ("run", "device"):
            if part in log:
                log[part] = log[part].cat.remove_unused_categories()
        return replace(self, log=log, n_rows=len(log), is_exact=False)


def read(paths, request, *, max_gap=None, tell=None, most_rows=None):
    """Read files as :func:`read_log` does; returns a :class:`Reading`, or None of too many rows.

    ``max_gap`` is the longest step of the time within a run [s], "auto", or None: no file is split.
    ``tell`` is called with a line of text for every file, where there are several. More than
    ``most_rows`` are not held.
    """
    request = checked_request(request)
    if not paths:
        raise ValueError("paths: at least one file is needed.")
    check_different(paths)
    files: list[LogFile] = []
    columns = Columns()
    for path in paths:
        file = LogFile.open(path, request, files[0] if files else None)
        files.append(file)
        for piece in file.pieces(tell):
            columns.add(piece, len(files) - 1)
            if most_rows is not None and columns.n_rows > most_rows:
                return None
        if tell is not None and len(paths) > 1:
            tell(f"read {len(files):,} of {len(paths):,}: {path}, {file.n_rows:,} rows")
    log = columns.table(list(files[0].layout.places), short_names(paths))
    notes = notes_of(files)
    number = None
    if max_gap is not None and "run" not in log:
        number, why = split_runs(log, max_gap)
        notes += [why] if why else []
    log = name_runs(log, number)
    log = log[[part for part in COLUMNS if part in log]]
    if lost := lost_rows(log, sum(len(file.dropped) for file in files)):
        notes.append(lost)
    return Reading(log, files, notes, len(log), is_exact=request.average is None)


class Columns:
    """Columns that grow piece by piece; labels as numbers."""

    def __init__(self):
        self._parts: dict = {}
        self._labels: dict = {}
        self._files: list = []
        self.n_rows = 0

    def add(self, piece, file):
        """Append a piece of a file."""
        n_rows = 0
        for part, values in piece.items():
            n_rows = len(values)
            if part in LABELS:
                known = self._labels.setdefault(part, {})
                codes, names = pd.factorize(values)
                own = np.array([known.setdefault(str(name), len(known)) for name in names], int)
                values = own[codes].astype(np.int32)
            self._parts.setdefault(part, []).append(values)
        if self._files and self._files[-1][0] == file:
            self._files[-1][1] += n_rows
        else:
            self._files.append([file, n_rows])
        self.n_rows += n_rows

    def table(self, parts, names):
        """The log, with a column "file" where there are several."""
        columns: dict = {}
        for part in parts:
            # One column at a time: pieces and columns of all would be the log twice.
            pieces = self._parts.pop(part, [])
            values = np.concatenate(pieces) if pieces else np.empty(0)
            if part in LABELS:
                categories = pd.Index(list(self._labels.get(part, {})), dtype=object)
                values = pd.Categorical.from_codes(values.astype(np.int32), categories)
            columns[part] = values
        log = pd.DataFrame(columns, copy=False)
        if len(names) > 1:
            files, counts = zip(*self._files, strict=True)
            codes = np.repeat(np.array(files, dtype=np.int32), counts)
            log["file"] = pd.Categorical.from_codes(codes, categories=pd.Index(names))
        return log


def short_names(paths):
    """Names of the files without folders and endings, where these tell them apart."""
    stems = [Path(path).stem for path in paths]
    return stems if len(set(stems)) == len(stems) else [os.fspath(path) for path in paths]


def notes_of(files):
    """What was found out about the files; what holds for several is said once."""
    by_note: dict = {}
    for file in files:
        for note in file.notes:
            by_note.setdefault(note, []).append(file.path)
    found = []
    for note, paths in by_note.items():
        where = "" if len(files) in (1, len(paths)) else f"{paths[0]}"
        if where and len(paths) > 1:
            where += f" and {len(paths) - 1} more"
        found.append(f"{where}: {note}" if where and not note.startswith(where) else note)
    return found


def checked_request(request):
    """The request with the usual names of units; ValueError where it names what is unknown."""
    _check_known(request.columns, "columns")
    _check_known(request.require, "require")
    names = list(({part: part for part in COLUMNS} | request.columns).values())
    shared = [name for name in names if names.count(name) > 1]
    if shared and not request.guess:
        raise LogError(f"two parts cannot be the same column of the file, {shared[0]!r}.")
    _check_signs(request.separator, request.decimal)
    if request.encoding is not None:
        try:
            "".encode(request.encoding)
        except (LookupError, ValueError) as error:
            raise ValueError(f"encoding={request.encoding!r} is not known.") from error
    return replace(request, units=declared_units(request.units))


def _check_known(parts, what):
    for part in parts:
        if part not in COLUMNS:
            known = ", ".join(COLUMNS)
            raise ValueError(f"{what}: there is no {part!r}; it may be one of {known}.")


def _check_signs(separator, decimal):
    """ValueError where either is no single sign, or both are the same."""
    for name, sign in (("separator", separator), ("decimal", decimal)):
        if sign is None:
            continue
        if not isinstance(sign, str) or len(sign) != 1 or sign.isalnum() or sign in '\r\n"':
            raise ValueError(f"{name}={sign!r} must be one character, such as a comma.")
    if separator is not None and separator == decimal:
        raise ValueError(f"separator and decimal are both {separator!r}: numbers would be cut.")
