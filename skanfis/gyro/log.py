"""Reading a calibration log from its files.

The columns of a log play parts: ``time``, ``temperature``, ``output`` (the gyro's own signal),
``rate`` (the truth, from the rate table), ``run`` (from one power-on to the next) and ``device``.
A log that has been read has its columns by these names, in s, degC and deg/s.
"""

import hashlib
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ._checks import LABELS, PARTS, RowChecks
from ._columns import declared_units
from ._guess import Request
from ._log_file import LogFile
from ._runs import RunFinder
from .errors import LogError

__all__ = [
    "Reading",
    "check_different",
    "checked_request",
    "find_logs",
    "pieces_of",
    "read",
    "read_log",
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
        Names in the file by part ("time", "temperature", "output", "rate", "run", "device"), where
        they differ from it; blanks around names, and capitals, do not matter.
    units : dict of str to str, default=None
        Units in the file of "time" (s, ms, us, ns, min, h), "temperature" (degC, K, degF), "rate"
        and "output" (deg/s, deg/h, rad/s, mrad/s, rpm); "output" may also be in counts, V or mV.
    require : sequence of str, default=None
        Parts without which the log is refused; None stands for temperature, output and rate.
    separator, decimal, encoding : str, default=None
        Sign between columns, sign of the decimal fraction, encoding of the text; None finds out.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        Columns by their parts, in the order above: numbers in s, degC and deg/s (a raw signal in
        its own unit), run and device as categories of strings.

    Raises
    ------
    LogError
        If a file is no table or there twice, a required column or a value is missing, or a value
        is no number.
    ValueError
        If an argument names an unknown part or unit, or is no single sign.
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
    """A log that has been read, with what was found out on the way, in sentences (``notes``).

    Of the ``n_rows`` rows that there were ``log`` holds every k-th of each run where they are too
    many. ``files`` and ``rows`` tell the file of each row, and its position there.
    """

    log: pd.DataFrame
    file: np.ndarray
    row: np.ndarray
    files: list
    notes: list
    n_rows: int

    @property
    def units(self):
        """Units of the parts in the (first) file."""
        return self.files[0].layout.units

    def name_row(self, row):
        """In words, where a row of the log is found."""
        file = self.files[self.file[row]]
        return f"{file.path}, {file.source.place_of(int(self.row[row]))}"

    def located(self, error):
        """An error of a check of the log in the words of the files."""
        if error.row is not None:
            file = self.files[self.file[error.row]]
            return file.located(error, pd.Series(self.row))
        where = None if len(self.files) == 1 else "the log"
        return self.files[0].located(error, where=where)


def read(paths, request, *, by_clock=False, tell=None, most_rows=None, check=False):
    """Read files as :func:`read_log` does; returns a :class:`Reading`.

    With ``by_clock``, a file without labels is split where its clock tells new runs. ``tell`` is
    called with a line of text now and then. With ``check``, every row is checked. Of more than
    ``most_rows`` rows every k-th of each run is held, with k a power of two.
    """
    request = checked_request(request)
    if not paths:
        raise ValueError("paths: at least one file is needed.")
    check_different(paths)
    files: list[LogFile] = []
    finder, checks, thinned = RunFinder(by_clock), None, _Thinned(most_rows)
    for number, path in enumerate(paths):
        file = LogFile(path, request, files[0] if files else None)
        files.append(file)
        if check and checks is None:
            checks = RowChecks(file.layout.units)
        for piece in pieces_of(file, number, finder, checks, tell):
            thinned.add(piece.drop(columns="device", errors="ignore"))
        if tell is not None and len(paths) > 1:
            tell(f"read {number + 1:,} of {len(paths):,}: {path}, {file.n_rows:,} rows")
    if not thinned.n_rows:
        raise LogError(f"{paths[0]}: has no rows with values.")
    table, parts = pd.concat(thinned.pieces, ignore_index=True), files[0].layout.places
    code, runs = table["run"].to_numpy(), finder.runs
    log = table[[part for part in parts if part not in LABELS]].copy()
    names = finder.names(_short_names(paths), "run" in parts)
    if names is not None:
        log["run"] = pd.Categorical.from_codes(code, categories=pd.Index(names, dtype=object))
    if "device" in parts:
        log["device"] = pd.Categorical(runs["device"].to_numpy()[code])
    notes = [*_notes_of(files), *filter(None, [finder.note, thinned.note])]
    file, row = runs["file"].to_numpy()[code], table["row"].to_numpy()
    return Reading(log, file, row, files, notes, thinned.n_rows)


def pieces_of(file, number, finder, checks=None, tell=None):
    """Checked pieces of a file of a log, "run" in them being a position in ``finder.runs``."""
    for piece in file.pieces(tell):
        piece["run"] = finder.codes(piece, number)
        try:
            if checks is not None:
                checks.add(piece)
        except LogError as error:
            raise file.located(error, piece["row"]) from error
        yield piece


class _Thinned:
    """The rows of a log that comes in pieces; of too many, every k-th of each run."""

    def __init__(self, most_rows):
        self._most = np.inf if most_rows is None else most_rows
        self._every = 1
        self.pieces: list = []
        self._counts = pd.Series(dtype=int)  # rows so far, by run
        self.n_rows = 0

    def add(self, piece):
        before = piece["run"].map(self._counts).fillna(0).astype(int)
        place = before + piece.groupby("run").cumcount()
        self._counts = self._counts.add(piece["run"].value_counts(), fill_value=0)
        self.n_rows += len(piece)
        self.pieces.append(piece.assign(place=place)[place % self._every == 0])
        if sum(map(len, self.pieces)) > self._most:
            self._every *= 2
            self.pieces = [held[held["place"] % self._every == 0] for held in self.pieces]

    @property
    def note(self):
        if self._every == 1:
            return ""
        n_used = sum(map(len, self.pieces))
        return f"of {self.n_rows:,} rows {n_used:,} are used, one in {self._every} of each run"


def _short_names(paths):
    """Names of the files without folders and endings, where these tell them apart."""
    stems = [Path(path).stem for path in paths]
    return stems if len(set(stems)) == len(stems) else [os.fspath(path) for path in paths]


def _notes_of(files):
    """What was found out about the files; what holds for all is said once."""
    counts = Counter(note for file in files for note in file.notes)
    notes = [
        note if counts[note] == len(files) else f"{file.path}: {note}"
        for file in files
        for note in file.notes
    ]
    return list(dict.fromkeys(notes))


def checked_request(request):
    """The request with the usual names of units; ValueError where it names what is unknown."""
    for name, parts in (("columns", request.columns), ("require", request.require)):
        for part in parts:
            if part not in PARTS:
                known = ", ".join(PARTS)
                raise ValueError(f"{name}: there is no {part!r}; it may be one of {known}.")
    for name, sign in (("separator", request.separator), ("decimal", request.decimal)):
        if sign is None:
            continue
        if not isinstance(sign, str) or len(sign) != 1 or sign.isalnum() or sign in '\r\n"':
            raise ValueError(f"{name}={sign!r} must be one character, such as a comma.")
    try:
        "".encode(request.encoding or "utf-8")
    except (LookupError, ValueError) as error:
        raise ValueError(f"encoding: {error}.") from error
    return replace(request, units=declared_units(request.units))


def find_logs(arguments):
    """The files that are named, with patterns filled in for a shell that does not."""
    return [
        path
        for argument in arguments
        for path in (not os.path.lexists(argument) and sorted(glob(argument))) or [argument]
    ]


def check_different(paths):
    """LogError where one log is there twice: as two runs, each would be tested by the other."""
    seen: dict = {}
    for path in filter(os.path.isfile, paths):
        with open(path, "rb") as opened:
            digest = hashlib.file_digest(opened, "sha256").digest()
        if digest in seen:
            raise LogError(
                f"{path}: holds the same bytes as {seen[digest]}; a run that is there twice would "
                "be tested by itself. Leave one of them out."
            )
        seen[digest] = path
