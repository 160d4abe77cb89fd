"""A log that may be too long to be held: read twice, piece by piece, and never whole.

The first reading checks it and finds its runs; the second gives its rows, each with its run. What
is kept of a run is where it began and its row before. By the first piece it is told how long a
usual step of the time is, and so what is a gap.
"""

import numpy as np
import pandas as pd

from ._checks import check_log
from ._console import check_device
from ._layout import COLUMNS
from ._runs import FEWEST_ROWS, LostRows, Splitter
from ._table import LogFile
from .errors import LogError
from .log import Reading

__all__ = ["LogStream", "rows_before"]


class LogStream:
    """One file as a stream of logs.

    Parameters
    ----------
    path : str
    request : Request
    max_gap : float or "auto"
        Longest step of the time within a run [s].
    device : str, optional
        The rows of this device alone.
    after : LogStream, optional
        That of a file before, of the same log: its columns, and its usual step of the time, hold.
    """

    def __init__(self, path, request, max_gap, device=None, after=None):
        self.path, self._request, self._device = path, request, device
        self._first = None if after is None else after._first or after.file
        self.file = LogFile.open(path, request, self._first)
        self._parts = self.file.layout.places
        can_split = "time" in self._parts and "run" not in self._parts
        self._splitter = Splitter(max_gap) if can_split else None
        self._lost = LostRows()
        if after is not None:
            self._splitter, self._lost = after._splitter, after._lost
        self._names: dict = {}  # of the runs, by device and label or number
        self.n_rows = 0
        self.counts: dict = {}  # rows of each run, by device and label or number

    @property
    def units(self):
        """Units of the parts in the file."""
        return self.file.layout.units

    @property
    def is_split(self):
        """Whether the time tells several runs."""
        return self._splitter is not None and self._splitter.is_split

    def scan(self, tell):
        """Read the file for the first time; LogError where it cannot be compensated.

        Returns what was found out, in sentences.
        """
        self.check(tell)
        self.check_device({device for device, _ in self.counts})
        if "run" in self._parts or self.is_split:
            self._name(list(self.counts))
        return [*self.file.notes, *self.found(len(self.file.dropped))]

    def check(self, tell):
        """Read the file for the first time, and count the rows of its runs."""
        runs = _Runs()
        for codes, keys, piece in self._keyed(self.file, self._splitter, tell):
            log = pd.DataFrame(piece | {"run": codes})
            try:
                runs.check(
                    log.drop(columns="device", errors="ignore"), keys, self.units, self._lost
                )
            except LogError as error:
                if error.row is not None:
                    error.row += self.n_rows
                is_exact = self._request.average is None
                raise Reading(log, [self.file], [], len(log), is_exact).located(error) from error
            self.n_rows += len(log)
            for key, count in zip(keys, np.bincount(codes).tolist(), strict=True):
                self.counts[key] = self.counts.get(key, 0) + count

    def found(self, n_dropped):
        """What the time has told of all files read so far: runs, and rows that are missing."""
        lost = self._lost.sentence(n_dropped) if self._lost.n_steps + 1 >= FEWEST_ROWS else ""
        split = self._splitter.why if self._splitter is not None and self.is_split else ""
        return [sentence for sentence in (split, lost) if sentence]

    def check_device(self, devices):
        """UsageError where the device that is asked for is none of these."""
        if self._device is not None:
            check_device(self._device, devices if "device" in self._parts else None)

    def pieces(self):
        """Its rows as logs, one after the other."""
        for codes, keys, piece in self.again():
            log = pd.DataFrame({part: piece[part] for part in COLUMNS if part in piece})
            if self._names:
                names = pd.Index([self._names[key] for key in keys])
                log["run"] = pd.Categorical.from_codes(codes, names)
            if self._device is not None:
                log = log[log["device"] == self._device].reset_index(drop=True)
            if len(log):
                yield log

    def again(self):
        """Pieces of the file from the beginning: numbers of runs, their keys, and the parts."""
        splitter = None
        if self._splitter is not None and self._splitter.is_split:
            splitter = self._splitter.again()
        yield from self._keyed(LogFile.open(self.path, self._request, self._first), splitter)

    def _keyed(self, file, splitter, tell=None):
        """Pieces of the file, with the run of every row: its place among keys (device, label)."""
        for piece in file.pieces(tell):
            n_rows = len(next(iter(piece.values()))) if piece else 0
            if n_rows == 0:
                continue
            device, run = piece.get("device"), piece.get("run")
            if splitter is not None:
                run = splitter.numbers(device, piece["time"], self.path)
            owners = [
                pd.factorize(np.zeros(n_rows, dtype=int) if labels is None else labels)
                for labels in (device, run)
            ]
            (of_device, devices), (of_run, labels) = owners
            codes, pairs = pd.factorize(of_device * len(labels) + of_run)
            keys = [
                (
                    None if device is None else devices[pair // len(labels)],
                    None if run is None else str(labels[pair % len(labels)]),
                )
                for pair in pairs.tolist()
            ]
            yield codes, keys, piece

    def _name(self, keys):
        """The shortest label that tells the runs apart."""
        labels = [run for _, run in keys]
        alone = len(set(labels)) == len(labels)
        self._names = {key: key[1] if alone else " / ".join(key) for key in keys}


def rows_before(rows, log):
    """A log with some rows, given as dicts, before its own."""
    if not rows:
        return log
    table = pd.DataFrame(rows, columns=log.columns).astype(log.dtypes.to_dict())
    return pd.concat([table, log], ignore_index=True)


class _Runs:
    """What is known of the runs of a log that comes in pieces."""

    def __init__(self):
        self.seen: dict = {}

    def check(self, log, keys, units, lost):
        """Check a piece as a part of its runs: these begin with what came before."""
        if "time" not in log:
            check_log(log, units=units, inputs=())
            self.seen |= dict.fromkeys(keys)
            return
        before = [row for code, key in enumerate(keys) for row in self._before(code, key)]
        joined = rows_before(before, log)
        if len(self.seen | dict.fromkeys(keys)) == 1 and keys[0][1] in (None, "1"):
            # Not known to be a run among others: the messages differ.
            joined = joined.drop(columns="run")
        try:
            check_log(joined, units=units, inputs=())
        except LogError as error:
            if error.row is not None:
                error.row = max(error.row - len(before), 0)
            raise
        for code, rows in log.groupby("run", sort=False):
            key = keys[code]
            first, coldest, hottest, last = self.seen.get(key, (rows.iloc[0], *[None] * 3))
            time, heat = rows["time"].to_numpy(), rows.get("temperature")
            lost.add(time, None if last is None else last["time"])
            if heat is not None:
                coldest = heat.min() if coldest is None else min(coldest, heat.min())
                hottest = heat.max() if hottest is None else max(hottest, heat.max())
            self.seen[key] = first, coldest, hottest, rows.iloc[-1]

    def _before(self, code, key):
        """Two rows that span what is known of a run, in time and temperature."""
        if self.seen.get(key) is None:
            return []
        first, coldest, hottest, last = self.seen[key]
        own = [dict(first) | {"run": code}, dict(last) | {"run": code}]
        if coldest is not None and last["time"] > first["time"]:
            own[0]["temperature"], own[1]["temperature"] = coldest, hottest
        return own if last["time"] > first["time"] else own[1:]
