"""A log too long to be held: some of its rows, drawn at random, evenly over every run.

The files are read twice, piece by piece. First every row is checked, and the runs are found; then
the temperature's rate is made of all rows, and rows are kept. To keep m of n, the rows of a run are
cut into stretches, n/m long on average, and one row is drawn of each: evenly, but in step with no
rhythm of the log. Kept are also each run's first row, so that the time since power-on is right, and
those at the ends of the ranges.
"""

import numpy as np
import pandas as pd

from ._carried import Carried
from ._checks import LABELS, QUANTITIES
from ._layout import COLUMNS
from ._runs import name_runs
from ._stream import LogStream
from .log import Columns, Reading, notes_of, short_names

__all__ = ["read_thinned"]

_RATE, _PLACE = "temperature_rate", "place"


def read_thinned(paths, request, *, max_gap, most_rows, time_constant, tell, device=None):
    """Read files as :func:`~.log.read` does, so many rows at most beside a few that must be kept.

    ``time_constant`` [s] is that of the temperature's rate, which is among what was ``made`` where
    the log has time and temperature.
    """
    streams: list[LogStream] = []
    for path in paths:
        tell(f"checking {path} ({len(streams) + 1:,} of {len(paths):,})")
        after = streams[0] if streams else None
        streams.append(LogStream(path, request, max_gap, device, after))
        streams[-1].check(tell)
    counts = [item for stream in streams for item in stream.counts.items()]
    streams[0].check_device({key[0] for key, _ in counts})
    n_rows = sum(count for key, count in counts if device in (None, key[0]))
    some = _Some(min(most_rows, n_rows), n_rows, time_constant, device)
    for number, stream in enumerate(streams):
        tell(f"keeping rows of {stream.path} ({number + 1:,} of {len(paths):,})")
        some.add(stream, number)
    return some.reading(streams)


class _Some:
    """Some rows of each run, with the temperature's rate of all."""

    def __init__(self, n_kept, n_rows, time_constant, device):
        self._n_kept, self._n_rows = n_kept, n_rows
        self._time_constant, self._device = time_constant, device
        self._columns = Columns()
        self._ends: dict = {}  # lowest and highest value so far, by column
        self._n_seen = self._n_runs = 0

    def add(self, stream, number):
        """The rows of a file."""
        carried = Carried((_RATE,), self._time_constant)
        seen: dict = {}  # by run: its number, and how many of its rows were before
        for codes, keys, piece in stream.again():
            own = np.ones(codes.size, dtype=bool)
            if self._device is not None:
                own = piece["device"] == self._device
            piece |= {_PLACE: self._n_seen + np.arange(codes.size)}
            self._n_seen += codes.size
            if {"time", "temperature"} <= set(piece):
                log = pd.DataFrame({part: piece[part] for part in ("time", "temperature")})
                log["run"] = pd.Categorical.from_codes(codes, pd.Index(map(str, keys)))
                piece[_RATE] = carried.features(log)[_RATE].to_numpy()
            if stream.is_split:
                labels = np.array([run for _, run in keys], dtype=object)
                piece["run"] = labels[codes]
            kept = own & (self._drawn(codes, keys, seen) | self._at_ends(piece, own))
            self._columns.add({part: values[kept] for part, values in piece.items()}, number)

    def _drawn(self, codes, keys, seen):
        """Whether a row is the first of its run, or the one that is drawn of its stretch."""
        place, runs = np.empty(codes.size, dtype=np.int64), np.empty(codes.size, dtype=np.int64)
        for code, key in enumerate(keys):
            run, before = seen.get(key, (self._n_runs, 0))
            self._n_runs += key not in seen
            rows = codes == code
            count = int(rows.sum())
            place[rows], runs[rows] = before + np.arange(count), run
            seen[key] = run, before + count
        stretch = place * self._n_kept // self._n_rows
        begin, end = (
            -(-number * self._n_rows // self._n_kept) for number in (stretch, stretch + 1)
        )
        length = (end - begin).astype(np.uint64)
        drawn = begin + (_hashed(stretch, runs) % length).astype(np.int64)
        return (place == 0) | (place == drawn)

    def _at_ends(self, piece, own):
        """Whether a row widens the range of a column."""
        found = np.zeros(own.size, dtype=bool)
        rows = np.flatnonzero(own)
        for part in (*QUANTITIES, _RATE):
            if part in piece and part != "time" and rows.size:
                values = piece[part][rows]
                low, high = self._ends.get(part, (np.inf, -np.inf))
                found[rows[values.argmin()]] |= values.min() < low
                found[rows[values.argmax()]] |= values.max() > high
                self._ends[part] = min(low, values.min()), max(high, values.max())
        return found

    def reading(self, streams):
        """What was kept."""
        files = [stream.file for stream in streams]
        parts = [*files[0].layout.places, *(["run"] if streams[0].is_split else []), _RATE, _PLACE]
        has_rate = {"time", "temperature"} <= set(parts)
        log = self._columns.table(
            [part for part in parts if part != _RATE or has_rate],
            short_names([file.path for file in files]),
        )
        places = log[_PLACE].to_numpy()
        made = {_RATE: log[_RATE].to_numpy()} if has_rate else {}
        notes = notes_of(files)
        notes += streams[0].found(sum(len(file.dropped) for file in files))
        if len(log) < self._n_rows:
            notes.append(
                f"of {self._n_rows:,} rows {len(log):,} are kept, drawn at random, evenly over "
                "every run, with those at the ends of the ranges; --check-rows says otherwise"
            )
        log = name_runs(log)
        log = log[[part for part in COLUMNS if part in log]]
        for part in LABELS:
            if part in log:
                log[part] = log[part].cat.remove_unused_categories()
        is_exact = files[0].request.average is None
        return Reading(log, files, notes, self._n_rows, is_exact, places, made)


def _hashed(stretches, runs):
    """A number for each stretch of each run, as good as drawn (Steele, Lea and Flood 2014)."""
    mixed = stretches.astype(np.uint64) + (runs.astype(np.uint64) << np.uint64(40))
    mixed = (mixed + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB), (31, 1)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed
