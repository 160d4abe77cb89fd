"""Read a calibration log from its files.

The columns of a log are its parts: ``time``, ``temperature``, ``output`` (the gyro's own signal),
``rate`` (the truth, from the rate table), ``run`` (from one power-on to the next) and ``device``.
Once read, a log has these names as columns, in s, degC and deg/s.
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

from ..digits import counted
from ..export.limits import shown
from ..naming import distinct
from ._checks import LABELS, RATE_COLUMN, check_rows, check_values
from ._columns import SIGNALS, convert
from ._guess import Request, settle
from ._numbers import NO_VALUE, as_numbers, clock_form, dated, going_on
from ._source import open_source
from ._units import assumed_text, settle_by_all
from .errors import LogError

# A gap between two runs is at least this long, and this many steps: more than a logger drops.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
_FEWEST_ROWS = 20  # if pieces are shorter, the logger stutters, and they are no runs
_SHORTEST_RUN = 3  # rows, at the end of a file
_NEXT = 2.5  # most steps between two files of one run, between which a row may be lost
_BEGINNING = 0.1  # a clock that goes back to this first part of a run has restarted


def read_log(
    paths: Any,
    *,
    columns: dict[str, Any] | None = None,
    units: dict[str, Any] | None = None,
    require: Sequence[str] = ("temperature", "output", "rate"),
) -> pd.DataFrame:
    r"""Read one log from one or several files.

    Only the columns of the parts are read. Without a column for the run, each file is a run. A run
    never extends over two files or devices: equal labels there are different runs.

    Parameters
    ----------
    paths : str, path, or sequence of these
        Text files with a header line, whose encoding, separator and decimal sign are detected, or
        files of MATLAB, Excel or Parquet (:doc:`/gyro_command`).
    columns : dict of str to str, default=None
        Names in the file by part ("time", "temperature", "output", "rate", "run", "device"), if
        they differ from the part's; blanks around names, and case, do not matter.
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
        If a file is no table or is given twice, if a required column or a value is missing, or if
        a value is no number.
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
    request = Request(columns or {}, units or {}, tuple(require))
    paths = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    return read(paths, request).log.drop(columns="power_on", errors="ignore")


@dataclass
class Reading:
    """A log that has been read; ``notes`` are sentences on what was found.

    The column "power_on" of ``log`` is the clock's time when the run began [s]. Row k is row
    ``row[k]`` of ``files[file[k]]``. ``assumed`` has sentences, by part, on units that neither
    names nor options give.
    """

    log: pd.DataFrame
    file: np.ndarray
    row: np.ndarray
    files: list
    notes: list
    assumed: dict

    @property
    def units(self):
        """Units of the parts in the (first) file."""
        return self.files[0].layout.units

    @property
    def digests(self):
        """Name, bytes and SHA-256 of each file."""
        return [(Path(file.path).name, file.size, file.digest) for file in self.files]

    def name_row(self, row):
        """The file and line of a row of the log, in words."""
        file = self.files[self.file[row]]
        return f"{file.path}, {file.source.place_of(int(self.row[row]))}"

    def located(self, error):
        """An error from a check of the whole log, with the file's names and lines."""
        file = self.files[0 if error.row is None else self.file[error.row]]
        return file.located(error, self.row, None if len(self.files) == 1 else "the log")


def read(paths, request, *, tell=lambda text: None):
    """Read files as :func:`read_log` does; return a :class:`Reading`.

    ``tell`` is called with a line of text for every file.
    """
    if not paths:
        raise ValueError("paths: at least one file is needed.")
    files: list[LogFile] = []
    tables: list[pd.DataFrame] = []
    for number, path in enumerate(paths):
        tell(f"reading {path}" + (f", {number + 1} of {len(paths)}" if len(paths) > 1 else ""))
        files.append(LogFile(path, request, files[0] if files else None))
        for same in [file for file in files[:-1] if file.digest == files[-1].digest]:
            raise LogError(f"{path}: holds the same bytes as {same.path}. Leave one of them out.")
        tables.append(files[-1].read().assign(file=np.int32(number)))
    table = pd.concat(tables)
    if table.empty:
        raise LogError(f"{paths[0]}: has no rows with values.")
    layout, notes = files[0].layout, [note for file in files for note in file.notes]
    by_run = table.groupby(["file", *LABELS], sort=False, observed=True)
    runs = by_run.size().index.to_frame(index=False)
    table = table.drop(columns="device").assign(run=by_run.ngroup().to_numpy(np.int32))
    by_clock = request.guess and "time" in table and "run" not in layout.places
    if by_clock and len(runs) > 1 and runs["device"].nunique() == 1:
        table, runs, told = _joined_by_clock(table, runs, paths)
        notes += told
    assumed = {part: assumed_text(table[part], part, layout) for part in layout.assumed}
    file, code, row = table["file"].to_numpy(), table["run"].to_numpy(), table.index.to_numpy()
    log = table.drop(columns=["file", "run"]).set_axis(pd.RangeIndex(len(table)))
    if layout.assumed and request.assumed is None:
        found = settle_by_all(log, layout)
        if not found.items() <= layout.units.items():
            # All rows give other units than the first ones did: read again with these.
            retold = replace(request, assumed=layout.units | found)
            return read(paths, retold, tell=tell)
    names = _names_of_runs(runs, paths)
    if names is not None:
        log["run"] = pd.Categorical.from_codes(code, categories=pd.Index(names, dtype=object))
    if "device" in layout.places:
        log["device"] = pd.Categorical(runs["device"].to_numpy()[code])
    reading = Reading(log, file, row, files, list(dict.fromkeys(notes)), assumed)
    if request.guess:
        try:
            check_rows(log, layout.units, code, request.optional)
        except LogError as error:
            raise reading.located(error) from error
    return reading


class LogFile:
    """A file of a log; ``first`` is the log's first file, whose column names hold for all.

    LogError if it is no log, or not like the first.
    """

    def __init__(self, path, request, first=None):
        self.path, self._is_command, self._optional = path, request.guess, request.optional
        self.source = open_source(path)
        with open(path, "rb") as opened:
            self.digest = hashlib.file_digest(opened, "sha256").hexdigest()
            self.size = opened.tell()
        self.layout = settle(self.source, request, None if first is None else first.layout)
        self.notes = [*self.source.notes, *self.layout.notes]
        self._form = ""  # format of a time given as text
        if first is None:
            return
        differ = sorted(set(self.layout.places) ^ set(first.layout.places))
        if differ:
            parts = " and ".join(differ)
            raise LogError(f"{self.path}: some of the files have no column for the {parts}.")
        own, other = self.layout.units["output"], first.layout.units["output"]
        if own != other and {own, other} & set(SIGNALS):
            raise LogError(
                f"{self.path}: the output is in {own}, in {first.path} in {other}; say which it is "
                "(units: output=UNIT)."
            )

    def read(self):
        """The parts as a table in the units of a log, with labels of run and device.

        The index is the row's position in the file. For the command, rows that lack a value are
        left out, and runs are told apart by the clock.
        """
        log = self._converted()
        if self._is_command:
            log = self._in_order(log)
        missing = log.drop(columns=list(self._optional), errors="ignore").isna()
        every = log = log.assign(**{part: "" for part in LABELS if part not in log})
        # Rows that lack another value stay for now: their times still belong to the clock.
        log = log[~missing[[part for part in ("time", *LABELS) if part in missing]].any(axis=1)]
        if self._is_command and "time" in log and "run" not in self.layout.places and len(log):
            runs = self._told_by_clock(log["time"].to_numpy())
            every = log = log[: len(runs)].assign(run=runs)
        if "time" in log:
            # From all rows, also those that lack a value.
            by_run = log.groupby(list(LABELS), observed=True)["time"]
            log = log.assign(power_on=by_run.transform("first"))
        is_whole = ~missing.any(axis=1)
        if not is_whole.all():
            log = log[is_whole[log.index]]
            self._note_gaps(missing, every, log)
        return log

    def _converted(self):
        """All rows, in the units of a log."""
        places, dates = self.layout.places, self.layout.dates
        labels = [places[part] for part in LABELS if part in places]
        table = self.source.table([*places.values(), *dates], labels)
        parts = {}
        try:
            for part, place in places.items():
                values = table[place]
                if part == "time" and dates:
                    values = dated(table[dates[0]], values)
                values = values.str.strip() if part in LABELS else self._numbers(values, part)
                check_values(values, part, self._is_command)
                parts[part] = values
        except LogError as error:
            raise self.located(error, table.index) from error
        if "time" in parts:
            for bits in (16, 24, 32):
                counter = convert(2.0**bits, self.layout.units["time"])
                parts["time"], back = going_on(parts["time"], self._form, counter)
                for first in map(self.source.place_of, back[:1]):
                    told = f"in {counted(back.size, 'place')}, first at {first}; the time goes on"
                    what = f"the clock goes back by the range of its {bits} bits"
                    self.notes.append(f"{self.path}: {what} {told}")
        return pd.DataFrame(parts, copy=False)

    def _in_order(self, log):
        """The rows in order of time, without those that occur a second time."""
        time = log["time"].to_numpy() if "time" in log else np.arange(len(log))
        steps = np.diff(time[~np.isnan(time)])
        if (steps > 0.0).all():
            return log
        if np.median(steps) < 0.0:
            self.notes.append(f"{self.path}: the last row comes first; rows are turned round")
            log = log[::-1]
        twice = log.duplicated() & log["time"].notna()
        if twice.any():
            first, last = map(self.source.place_of, log.index[twice][[0, -1]])
            repeated = counted(f"{twice.sum():,}", "repeated row")
            self.notes.append(f"{self.path}: {repeated} left out, from {first} to {last}")
            log = log[~twice]
        return log

    def _told_by_clock(self, time):
        """Labels of runs, "1", "2" and so on: a run starts where the time restarts or steps far.

        A few rows at the end, after a jump of the clock, are no run and get no label.
        """
        steps, longest = np.diff(time, prepend=time[0]), _longest_step(time)
        starts, begin = steps > longest, time[0]
        for row in np.flatnonzero(steps < 0.0):
            if time[row] <= begin + _BEGINNING * (time[row - 1] - begin):
                starts[row], begin = True, time[row]
        code = np.cumsum(starts)
        n_last = np.count_nonzero(code == code[-1])
        if code[-1] and n_last < _SHORTEST_RUN:
            self.notes.append(
                f"{self.path}: the clock jumps; what follows, {counted(n_last, 'row')}, is left out"
            )
            code = code[:-n_last]
        if not code[-1]:
            return pd.Categorical.from_codes(code, [""])
        self.notes.append(
            f"{self.path}: is split into {code[-1] + 1} runs, where the time begins anew or steps "
            f"by more than {longest:.4g} s; if that is no power-on, number the runs in a column"
        )
        return pd.Categorical.from_codes(code, [str(k + 1) for k in range(code[-1] + 1)])

    def _note_gaps(self, missing, *logs):
        lacking, bad = missing.sum(), missing.any(axis=1)
        names = {self.layout.name(part): n for part, n in lacking[lacking > 0].items()}
        counts = ", ".join(f"{name!r} in {n:,}" for name, n in names.items())
        lack = "lacks" if bad.sum() == 1 else "lack"
        said = f"{self.path}: {bad.sum():,} of {bad.size:,} rows {lack} a value ({counts})"
        if 2 * bad.sum() > bad.size:
            raise LogError(f"{said}: too many to leave out. Fill them in, or name other columns.")
        place = self.source.place_of(int(bad.idxmax()))
        runs, left = (log.groupby(list(LABELS), observed=True).size().index for log in logs)
        lost = [" / ".join(filter(None, labels[::-1])) for labels in runs if labels not in left]
        of_runs = f"; no row is left of run {', '.join(map(repr, lost))}" if lost else ""
        self.notes.append(f"{said}; left out, first at {place}{of_runs}")

    def _numbers(self, column, part):
        numbers = as_numbers(column, self.source.decimal)
        if part == "time" and not np.isfinite(numbers).any():
            self._form = clock_form(column)
            if self._form:
                self.notes.append(f"the time is read in s, from texts of the form {self._form}")
            if "%m/%d" in self._form:
                self.notes.append("dates are read month first; if it is the day, write 2024-12-31")
        form = self._form if part == "time" else ""
        numbers = as_numbers(column, form=form) if form else numbers
        bad = np.isnan(numbers)
        # Joined logs repeat their header.
        no_value = [*NO_VALUE, self.layout.name(part)]
        bad[bad] = (column[bad].notna() & ~column[bad].isin(no_value)).to_numpy()
        if bad.any():
            row = int(bad.argmax())
            kind = "no time like those before" if form else "not a number"
            raise LogError(f"{shown(column.iloc[row])} is {kind}.", part, row)
        is_in_seconds = form or column.dtype.kind in "mM"
        return numbers if is_in_seconds else convert(numbers, self.layout.units[part])

    def located(self, error, rows=None, where=None):
        """An error with this file's column name and line; ``rows`` are positions in the file."""
        where = where or self.path
        if error.row is not None:
            where = f"{self.path}, {self.source.place_of(int(rows[error.row]))}"
        if error.column is None:
            return error
        name = self.layout.name(error.column)
        part = "" if name == error.column else f" ({error.column})"
        rate = f"column {self.layout.name('rate')!r} of the rate"
        reason = error.reason.replace(RATE_COLUMN, rate)
        return LogError(f"{where}, column {name!r}{part}: {reason}")


def _joined_by_clock(table, runs, paths):
    """Join runs whose clock goes on in the next file; return the log, its runs, and notes."""
    ends, steps = np.flatnonzero(np.diff(table["run"])), np.diff(table["time"])
    is_new = (steps[ends] <= 0.0) | (steps[ends] >= _NEXT * np.median(steps))
    is_new = np.append(True, is_new | (np.diff(table["file"])[ends] == 0))
    run = (np.cumsum(is_new, dtype=np.int32) - 1)[table["run"]]
    table = table.assign(run=run, power_on=table["power_on"].groupby(run).transform("first"))
    places, told = runs["file"][~is_new].tolist(), []
    if places:
        files = f"{counted(len(places), 'file')}, first {paths[places[0]]}"
        told.append(f"the run goes on in {files}, as the clock does")
    return table, runs[is_new], told


def _longest_step(time):
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    if forward.size == 0:
        return np.inf
    longest = max(_SHORTEST_GAP, _STEPS * float(np.median(forward)))
    lengths = np.diff(np.flatnonzero(steps > longest), prepend=-1, append=steps.size)
    return longest if np.median(lengths) >= _FEWEST_ROWS else np.inf


def _names_of_runs(runs, paths):
    """Different labels of the runs, as short as possible; None if nothing tells runs apart."""
    stems = [Path(path).stem for path in paths]
    files = stems if len(set(stems)) == len(stems) else list(map(os.fspath, paths))
    owners = ["file"] if len(paths) > 1 else []
    owners += [label for label in ("device", "run") if runs[label].astype(bool).any()]
    if not {"file", "run"} & set(owners):
        return None
    keys: dict = runs.to_dict("list") | {"file": [files[file] for file in runs["file"]]}
    for parts in (["run"], ["file"], owners):
        names = [" / ".join(filter(None, row)) for row in zip(*map(keys.get, parts), strict=True)]
        if set(parts) <= set(owners) and len(set(names)) == len(names):
            break
    # Labels that contain a slash may be equal even when all parts are joined.
    return distinct(names)


def find_logs(arguments):
    """The files named; patterns are expanded, for shells that do not do it."""
    found = [[] if os.path.lexists(name) else sorted(glob(name)) for name in arguments]
    return [path for name, paths in zip(arguments, found, strict=True) for path in paths or [name]]
