"""The rows of one file: its parts in the units of a log, piece by piece, with a place for each."""

from array import array
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd

from ._average import Averager
from ._checks import LABELS, QUANTITIES, check_finite, check_label
from ._clock import Clock
from ._columns import SIGNALS, convert
from ._layout import Layout, Request, settle
from ._parquet import ParquetLog, is_parquet
from ._text import TextLog
from .errors import LogError, shortened

__all__ = ["LogFile"]

# Of a piece, which is all that is held beside the log itself.
_ROWS = 200_000
# After so many pieces of a long file, a line of progress.
_PIECES_TOLD = 10
# The form of a clock is told by its first rows.
_CLOCK_ROWS = 200


@dataclass
class LogFile:
    """One file of a log.

    Attributes
    ----------
    n_rows : int
        Rows of the file that were read.
    dropped : array of int
        Positions of those that lack a value, and are left out.
    missing : dict of str to int
        How many values each part lacks.
    """

    path: str
    source: TextLog | ParquetLog
    layout: Layout
    request: Request
    n_rows: int = 0
    dropped: array = field(default_factory=lambda: array("q"))
    missing: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)

    @classmethod
    def open(cls, path, request, first=None):
        """Look at a file's head; LogError where it is no log, or not like the first file of it."""
        if is_parquet(path):
            source: TextLog | ParquetLog = ParquetLog(path)
        else:
            source = TextLog(path, request.separator, request.decimal, request.encoding)
        layout = settle(source, request, None if first is None else first.layout)
        file = cls(path, source, layout, request, notes=[*source.notes, *layout.said])
        if first is not None:
            _check_alike(file, first)
        return file

    def pieces(self, tell=None):
        """Parts as arrays, those of labels as lists of strings, so many rows at a time.

        ``tell`` is called with a line of text now and then.
        """
        self.source.check_lengths()
        clock = self._clock()
        average = None if self.request.average is None else Averager(self.request.average)
        for n_pieces, table in enumerate(self._tables(clock), start=1):
            piece = self._converted(table, clock)
            self.n_rows += len(table)
            if average is not None:
                piece = average.add(piece)
            yield piece
            if tell is not None and n_pieces % _PIECES_TOLD == 0:
                tell(f"{self.path}: {self.n_rows:,} rows so far")
        if average is not None:
            yield average.rest()
            if average.n_rows:
                self.notes.append(
                    f"{average.n_rows:,} rows are averaged over {self.request.average:g} s each, "
                    f"to {average.n_means:,}"
                )
        self._report_missing()

    def place_of(self, row):
        """In words, where a row that was kept is found."""
        dropped = np.array(self.dropped, dtype=int)
        # The rows that were left out before it.
        before = np.searchsorted(dropped - np.arange(dropped.size), row, side="right")
        return f"{self.path}, {self.source.place_of(int(row + before))}"

    def located(self, error, row=None):
        """An error of one part, and row of the file, as one of its column and line."""
        part, row = error.column, error.row if row is None else row
        where = "" if row is None else f", {self.source.place_of(row)}"
        name = self.layout.name(part) if part in self.layout.places else part
        called = "" if name == part else f" ({part})"
        return LogError(f"{self.path}{where}, column {name!r}{called}: {error.reason}")

    def _clock(self):
        """What reads the time, where it is no number."""
        if "time" not in self.layout.places:
            return None
        sample = self.source.sample(_CLOCK_ROWS)
        column = sample[self.layout.places["time"]]
        if column.dtype.kind in "fiu":
            return None
        texts = column.astype("string").astype(object)
        plain = texts.str.replace(self.source.decimal, ".", regex=False)
        if texts.isna().all() or pd.to_numeric(plain, errors="coerce").notna().mean() > 0.5:
            return None
        clock = Clock(self._dated(sample, texts))
        if not clock.form:
            return None
        self.notes.append(f"the time is read as {clock.note}")
        return clock

    def _dated(self, table, texts):
        if self.layout.date is None:
            return texts
        return table[self.layout.date].astype("string").astype(object) + " " + texts

    def _tables(self, clock):
        places = self.layout.places
        kinds = {places[part]: str if part in LABELS else float for part in places}
        if clock is not None:
            kinds[places["time"]] = str
            if self.layout.date is not None:
                kinds[self.layout.date] = str
        read = partial(self.source.pieces, n_rows=_ROWS)
        try:
            yield from read(kinds)
        except LogError:
            raise
        except ValueError as error:
            raise self._no_number(read, kinds, error) from error

    def _no_number(self, read, kinds, error):
        """The error for the first value in the file that should be a number and is none."""
        parts = [part for part in QUANTITIES if kinds.get(self.layout.places.get(part)) is float]
        start = 0
        for table in read({self.layout.places[part]: str for part in parts}):
            for part in parts:
                column = table[self.layout.places[part]]
                plain = column.str.replace(self.source.decimal, ".", regex=False)
                bad = np.flatnonzero(
                    pd.to_numeric(plain, errors="coerce").isna()
                    & column.notna()
                    & ~column.isin(self.source.no_value)
                )
                if bad.size:
                    reason = f"{shortened(column.iloc[bad[0]])} is not a number."
                    return self.located(LogError(reason, part, start + int(bad[0])))
            start += len(table)
        return LogError(f"{self.path}: {error}")

    def _converted(self, table, clock):
        """The parts of a piece, in their canonical units, without the rows that lack a value."""
        piece, units = {}, self.layout.units
        for part, place in self.layout.places.items():
            column = table[place]
            if part in LABELS:
                piece[part] = column.astype("string").astype(object).to_numpy()
            elif part == "time" and clock is not None:
                texts = self._dated(table, column.astype("string").astype(object))
                piece[part] = clock.seconds(texts)
                self._check_times(column, piece[part])
            else:
                unit = units[part]
                if part == "time" and place in self.source.in_seconds:
                    unit = "s"
                piece[part] = convert(column.to_numpy(dtype=float), part, unit)
        missing = {part: np.asarray(pd.isna(values)) for part, values in piece.items()}
        self._check(piece, missing)
        lacking = np.logical_or.reduce(list(missing.values()))
        if not lacking.any():
            return piece
        for part, bad in missing.items():
            self.missing[part] = self.missing.get(part, 0) + int(bad.sum())
        self.dropped.extend((self.n_rows + np.flatnonzero(lacking)).tolist())
        return {part: values[~lacking] for part, values in piece.items()}

    def _check_times(self, texts, seconds):
        bad = np.flatnonzero(np.isnan(seconds) & texts.notna().to_numpy())
        if bad.size:
            reason = f"{shortened(texts.iloc[bad[0]])} is no time like those before."
            raise self.located(LogError(reason, "time", self.n_rows + int(bad[0])))

    def _check(self, piece, missing):
        """Refuse what is infinite, and what is missing unless such rows are to be left out."""
        for part, values in piece.items():
            try:
                if part in LABELS:
                    if not self.request.drop_missing:
                        check_label(missing[part], part)
                    continue
                known = values[~missing[part]] if self.request.drop_missing else values
                check_finite(known, part)
            except LogError as error:
                rows = np.arange(len(values))
                if self.request.drop_missing:
                    rows = rows[~missing[part]]
                raise self.located(error, self.n_rows + int(rows[error.row])) from error

    def _report_missing(self):
        if not self.dropped:
            return
        parts = ", ".join(
            f"{self.layout.name(part)!r} in {count:,}"
            for part, count in self.missing.items()
            if count
        )
        said = f"{len(self.dropped):,} of {self.n_rows:,} rows lack a value ({parts})"
        if 2 * len(self.dropped) > self.n_rows:
            raise LogError(f"{self.path}: {said}: too many to go on without them.")
        first = self.source.place_of(self.dropped[0])
        self.notes.append(f"{said}; they are left out, the first of them {first}")


def _check_alike(file, first):
    """LogError where a file has other parts than the first, or another kind of output."""
    differ = sorted(set(file.layout.places) ^ set(first.layout.places))
    if differ:
        raise LogError(f"{file.path}: the files differ in having {', '.join(differ)}.")
    units = [one.layout.units["output"] for one in (first, file)]
    if units[0] != units[1] and set(units) & set(SIGNALS):
        raise LogError(
            f"{file.path}: the output is in {units[1]}, in {first.path} in {units[0]}; say which "
            "it is (units: output=UNIT)."
        )
