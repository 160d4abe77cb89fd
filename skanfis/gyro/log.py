"""Reading a calibration log from its files.

The columns of a log play parts: ``time``, ``temperature``, ``output`` (the gyro's own signal),
``rate`` (the truth, from the rate table), ``run`` (from one power-on to the next) and ``device``.
A log that has been read has its columns by these names, in s, degC and deg/s.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ._checks import LABELS, RowChecks, check_values
from ._columns import SIGNALS, convert
from ._guess import Request, checked_request, settle
from ._source import NO_VALUE, Clock, as_numbers, open_source
from ._units import settle_by_all
from .errors import LogError, shortened

_ROWS = 100_000  # of a piece, which is all that is held beside the log itself
# A rest without power is longer than what a logger drops, and than a few of its steps.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
_FEWEST_ROWS = 20  # shorter pieces are no runs, but a logger that stutters
_BEGINNING = 0.1  # part of a run, where a clock is again that has been set anew


def read_log(
    paths: Any,
    *,
    columns: dict[str, Any] | None = None,
    units: dict[str, Any] | None = None,
    require: Sequence[str] = ("temperature", "output", "rate"),
) -> pd.DataFrame:
    r"""Read one log from one or several files.

    Only the columns that play a part are read. Without a column for the run, each file is a run.
    A run never extends over two files or devices: two that only share a label are told apart.

    Parameters
    ----------
    paths : str, path, or sequence of these
        Text files with a header line, or Parquet files (with pyarrow). Encoding, separator and
        decimal sign of a text are found out.
    columns : dict of str to str, default=None
        Names in the file by part ("time", "temperature", "output", "rate", "run", "device"), where
        they differ from it; blanks around names, and capitals, do not matter.
    units : dict of str to str, default=None
        Units in the file of "time" (s, ms, us, ns, min, h), "temperature" (degC, K, degF), "rate"
        and "output" (deg/s, deg/h, rad/s, mdeg/s, mrad/s, rpm); "output" may also be in counts, V
        or mV.
    require : sequence of str, default=("temperature", "output", "rate")
        Parts without which the log is refused.

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
        If an argument names an unknown part or unit.
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
    request = checked_request(Request(columns or {}, units or {}, tuple(require)))
    return read([paths] if isinstance(paths, str | Path) else list(paths), request).log


@dataclass
class Reading:
    """A log that has been read, with what was found out on the way, in sentences (``notes``).

    Of the ``n_rows`` rows that there were ``log`` holds every k-th of each run where they are too
    many. ``files`` and ``rows`` tell the file of each row, and its position there. ``assumed`` has
    sentences on units, by part, that neither names nor options tell.
    """

    log: pd.DataFrame
    file: np.ndarray
    row: np.ndarray
    files: list
    notes: list
    n_rows: int
    digests: tuple
    assumed: dict

    @property
    def units(self):
        """Units of the parts in the (first) file."""
        return self.files[0].layout.units

    def name_row(self, row):
        """In words, where a row of the log is found."""
        file = self.files[self.file[row]]
        return f"{file.path}, {file.source.place_of(int(self.row[row]))}"

    def located(self, error):
        """An error of a check of the whole log in the words of the files."""
        where = None if len(self.files) == 1 else "the log"
        return self.files[0].located(error, where=where)


def read(paths, request, *, tell=lambda text: None, most_rows=np.inf):
    """Read files as :func:`read_log` does; returns a :class:`Reading`.

    ``tell`` is called with a line of text for every file. Of more than ``most_rows`` rows every
    k-th of each run is held, with k a power of two.
    """
    if not paths:
        raise ValueError("paths: at least one file is needed.")
    digests = digests_of(paths)
    files: list[LogFile] = []
    finder, checks, thinned = RunFinder(request.guess), None, _Thinned(most_rows)
    for number, path in enumerate(paths):
        file = LogFile(path, request, files[0] if files else None)
        files.append(file)
        if request.guess and checks is None:
            checks = RowChecks(file.layout.units)
        for piece in file.pieces(finder, checks, number):
            thinned.add(piece.drop(columns="device", errors="ignore"))
        if len(paths) > 1:
            tell(f"read {number + 1:,} of {len(paths):,}: {path}, {file.n_rows:,} rows")
    if not thinned.n_rows:
        raise LogError(f"{paths[0]}: has no rows with values.")
    table, parts = pd.concat(thinned.pieces), files[0].layout.places
    code, runs = table["run"].to_numpy(), finder.runs
    log = table[[part for part in parts if part not in LABELS]].reset_index(drop=True)
    layout = files[0].layout
    if layout.assumed and request.assumed is None:
        found = settle_by_all(log, layout)
        if not found.items() <= layout.units.items():
            # All rows tell otherwise than the first ones.
            retold = replace(request, assumed=layout.units | found)
            return read(paths, retold, tell=tell, most_rows=most_rows)
    names = _names_of_runs(runs, paths, "run" in parts or finder.note)
    if names is not None:
        log["run"] = pd.Categorical.from_codes(code, categories=pd.Index(names, dtype=object))
    if "device" in parts:
        log["device"] = pd.Categorical(runs["device"].to_numpy()[code])
    notes = [note for file in files for note in file.notes]
    notes = list(dict.fromkeys([*notes, *filter(None, [finder.note, thinned.note])]))
    file, row = runs["file"].to_numpy()[code], table.index.to_numpy()
    return Reading(log, file, row, files, notes, thinned.n_rows, digests, layout.assumed)


class LogFile:
    """A file of a log; ``first`` is the first file of the same log, whose columns hold.

    LogError where it is no log, or not like the first.
    """

    def __init__(self, path, request, first=None):
        self.path, self._allow_missing = path, request.guess
        self.source = open_source(path)
        self.layout = settle(self.source, request, None if first is None else first.layout)
        self.notes = [*self.source.notes, *self.layout.notes]
        self.n_rows = 0
        self._clock: Clock | None = None
        if first is None:
            return
        differ = sorted(set(self.layout.places) ^ set(first.layout.places))
        if differ:
            raise LogError(f"{self.path}: the files differ in having {', '.join(differ)}.")
        own, other = self.layout.units["output"], first.layout.units["output"]
        if own != other and {own, other} & set(SIGNALS):
            raise LogError(
                f"{self.path}: the output is in {own}, in {first.path} in {other}; say which it is "
                "(units: output=UNIT)."
            )

    def pieces(self, finder, checks=None, number=0):
        """Tables of the parts in the units of a log, "run" being a position in ``finder.runs``.

        The index is the row's position in the file, of which ``number`` is that in the log. The
        command leaves out rows that lack a value.
        """
        places = self.layout.places
        labels = [places[part] for part in LABELS if part in places]
        lacking = pd.Series(0, index=list(places))
        n_left_out, first = 0, 0
        for table in self.source.pieces(list(places.values()), _ROWS, labels):
            self.n_rows += len(table)
            piece = table  # of which an error tells the rows
            try:
                piece = self._in_order(self._converted(table), table)
                missing = piece.isna()
                bad = missing.any(axis=1)
                if bad.any():
                    lacking += missing.sum()
                    first = first if n_left_out else int(bad.idxmax())
                    n_left_out += int(bad.sum())
                # A gap in one column is none in the clock.
                known = ~missing[[part for part in ("time", *LABELS) if part in piece]].any(axis=1)
                piece, bad = piece[known].copy(), bad[known]
                if bad.all():
                    continue
                piece["run"] = finder.codes(piece, number)
                piece = piece[~bad]
                if checks is not None:
                    checks.add(piece)
            except LogError as error:
                raise self.located(error, piece.index) from error
            yield piece
        if self._clock is not None:
            self.notes += self._clock.notes
        if not n_left_out:
            return
        names = {self.layout.name(part): n for part, n in lacking[lacking > 0].items()}
        counts = ", ".join(f"{name!r} in {n:,}" for name, n in names.items())
        said = f"{self.path}: {n_left_out:,} of {self.n_rows:,} rows lack a value ({counts})"
        if 2 * n_left_out > self.n_rows:
            raise LogError(f"{said}: too many to go on without them.")
        place = self.source.place_of(first)
        self.notes.append(f"{said}; they are left out, the first of them {place}")

    def _in_order(self, piece, table):
        """A piece whose rows do not occur twice, and that begins with the first row."""
        if not self._allow_missing or "time" not in piece:
            return piece
        twice = piece.duplicated() & piece["time"].notna()
        # Runs of one value all through are alike, and two runs.
        if twice.any() and not piece[twice].drop(columns="time").duplicated()[1:].all():
            times = table[self.layout.places["time"]][twice]
            self.notes.append(
                f"{self.path}: {twice.sum():,} rows occur twice, from time {times.iloc[0]} to "
                f"{times.iloc[-1]}; the second time they are left out"
            )
            piece = piece[~twice]
        steps = np.diff(piece["time"].dropna())
        if len(table) < _ROWS and steps.size and (steps < 0.0).all():
            self.notes.append(f"{self.path}: the last row comes first; rows are turned round")
            piece = piece[::-1]
        return piece

    def _converted(self, table):
        piece = pd.DataFrame(index=table.index)
        for part, place in self.layout.places.items():
            column = table[place]
            is_label = part in LABELS
            piece[part] = column.astype(object) if is_label else self._numbers(column, part)
            check_values(piece[part], part, self._allow_missing)
        return piece

    def _numbers(self, column, part):
        numbers = as_numbers(column, self.source.decimal)
        if part == "time" and self._clock is None and not np.isfinite(numbers).any():
            found = Clock(column)
            if found.form:
                self._clock = found
                self.notes.append(f"the time is read in s, its form is {found.form}")
        clock = self._clock if part == "time" else None
        numbers = clock.seconds(column) if clock else numbers
        bad = np.isnan(numbers)
        bad[bad] = (column[bad].notna() & ~column[bad].isin(NO_VALUE)).to_numpy()
        if bad.any():
            row = int(bad.argmax())
            kind = "no time like those before" if clock else "not a number"
            raise LogError(f"{shortened(column.iloc[row])} is {kind}.", part, row)
        is_in_seconds = clock or column.dtype.kind in "mM"
        return numbers if is_in_seconds else convert(numbers, part, self.layout.units[part])

    def located(self, error, rows=None, where=None):
        """An error of one part and row, in terms of this file; ``rows`` are positions in it."""
        where = where or self.path
        if error.row is not None:
            where = f"{self.path}, {self.source.place_of(int(rows[error.row]))}"
        if error.column is None:
            return error
        name = self.layout.name(error.column)
        part = "" if name == error.column else f" ({error.column})"
        return LogError(f"{where}, column {name!r}{part}: {error.reason}")


class RunFinder:
    """Finds the runs of a log that comes in pieces: by labels, else by files.

    With ``by_clock``, a file without labels is split at long steps of its time, and where it begins
    anew. ``runs`` are in the order in which they came.
    """

    def __init__(self, by_clock):
        self._by_clock = by_clock
        self._longest = None  # step of the time within a run [s]
        self._codes: dict = {}
        self._open: dict = {}  # by file: when its clock began, its last time, the number of its run
        self._is_split = False

    @property
    def runs(self):
        """Their files, devices and labels."""
        return pd.DataFrame(list(self._codes), columns=["file", "device", "run"])

    def codes(self, piece, file):
        """Position of each row's run among ``runs``; ``file`` tells files apart."""
        nothing = np.full(len(piece), "", dtype=object)
        if "run" in piece or not ("time" in piece and self._by_clock):
            run = piece.get("run", nothing)
        else:
            run = self._split(piece["time"].to_numpy(), file)
        (own, devices), (code, runs) = map(pd.factorize, (piece.get("device", nothing), run))
        code, keys = pd.factorize(own * len(runs) + code)
        own = [(file, devices[key // len(runs)], str(runs[key % len(runs)])) for key in keys]
        places = [self._codes.setdefault(key, len(self._codes)) for key in own]
        return np.array(places)[code]

    def _split(self, time, file):
        if self._longest is None:
            self._longest = _longest_step(time)
        begin, last, number = self._open.get(file, (time[0], time[0], 1))
        steps = np.diff(time, prepend=last)
        starts = steps > self._longest
        for row in np.flatnonzero(steps < 0.0):
            if time[row] <= begin + _BEGINNING * (time[row] - steps[row] - begin):
                starts[row], begin = True, time[row]
        self._is_split |= bool(starts.any())
        numbers = number + np.cumsum(starts)
        self._open[file] = begin, time[-1], numbers[-1]
        return numbers

    @property
    def note(self):
        """What the clock has told, in words; empty where it tells one run."""
        if not self._is_split:
            return ""
        return (
            f"the log is split into {len(self._codes)} runs, where the time begins anew or steps "
            f"by more than {self._longest:.4g} s"
        )


def _longest_step(time):
    """The longest step of the time within a run, by the first piece of a log."""
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    if forward.size == 0:
        return np.inf
    longest = max(_SHORTEST_GAP, _STEPS * float(np.median(forward)))
    lengths = np.diff(np.flatnonzero(steps > longest), prepend=-1, append=steps.size)
    return longest if np.median(lengths) >= _FEWEST_ROWS else np.inf


class _Thinned:
    """The rows of a log that comes in pieces; of too many, every k-th of each run."""

    def __init__(self, most_rows):
        self._most, self._every = most_rows, 1
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


def _names_of_runs(runs, paths, has_labels):
    """Labels of the runs that tell them apart, short ones if these do; None of a single run."""
    stems = [Path(path).stem for path in paths]
    files = stems if len(set(stems)) == len(stems) else list(map(os.fspath, paths))
    owners = ["file"] if len(paths) > 1 else []
    owners += ["device"] if runs["device"].any() else []
    owners += ["run"] if has_labels else []
    if not {"file", "run"} & set(owners):
        return None
    keys: dict = runs.to_dict("list") | {"file": [files[file] for file in runs["file"]]}
    for parts in (["run"], ["file"], owners):
        names = [" / ".join(row) for row in zip(*map(keys.get, parts), strict=True)]
        if set(parts) <= set(owners) and len(set(names)) == len(names):
            break
    return names


def find_logs(arguments):
    """The files that are named, with patterns filled in for a shell that does not."""
    found = [[] if os.path.lexists(name) else sorted(glob(name)) for name in arguments]
    return [path for name, paths in zip(arguments, found, strict=True) for path in paths or [name]]


def digests_of(paths):
    """Name, bytes and SHA-256 of each file.

    LogError where one log is there twice: as two runs, each would be tested by the other.
    """
    found: dict = {}
    for path in paths:
        open_source(path, head_only=True)  # what is no log is refused before all of it is read
        with open(path, "rb") as opened:
            digest = hashlib.file_digest(opened, "sha256").hexdigest()
            size = opened.tell()
        if digest in found:
            raise LogError(
                f"{path}: holds the same bytes as {found[digest][0]}; a run that is there twice "
                "would be tested by itself. Leave one of them out."
            )
        found[digest] = path, size
    return tuple((Path(path).name, size, digest) for digest, (path, size) in found.items())
