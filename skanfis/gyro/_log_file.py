"""One file of a log, in pieces: its parts in the units of a log."""

import numpy as np
import pandas as pd

from ._checks import LABELS, check_values
from ._columns import SIGNALS, convert
from ._guess import settle
from ._source import open_source
from ._values import NO_VALUE, Clock, as_numbers
from .errors import LogError, shortened

__all__ = ["LogFile"]

_ROWS = 200_000  # of a piece, which is all that is held beside the log itself
_PIECES_TOLD = 10  # from one line of progress to the next
_CLOCK_ROWS = 200  # by which the form of a clock is told


class LogFile:
    """A file of a log; ``first`` is the first file of the same log, whose columns hold.

    LogError where it is no log, or not like the first.
    """

    def __init__(self, path, request, first=None):
        self.path, self._allow_missing = path, request.guess
        self.source = open_source(path, request.separator, request.decimal, request.encoding)
        self.layout = settle(self.source, request, None if first is None else first.layout)
        self.notes = [*self.source.notes, *self.layout.notes]
        self.n_rows = 0
        if first is not None:
            self._check_like(first)

    def _check_like(self, first):
        differ = sorted(set(self.layout.places) ^ set(first.layout.places))
        if differ:
            raise LogError(f"{self.path}: the files differ in having {', '.join(differ)}.")
        own, other = self.layout.units["output"], first.layout.units["output"]
        if own != other and {own, other} & set(SIGNALS):
            raise LogError(
                f"{self.path}: the output is in {own}, in {first.path} in {other}; say which it is "
                "(units: output=UNIT)."
            )

    def pieces(self, tell=None):
        """Tables of the parts, with the position of each row in the file as "row".

        The command leaves out rows that lack a value. ``tell`` is called with a line of text now
        and then.
        """
        self.source.check_lengths()
        clock, places = self._clock(), self.layout.places
        labels = [places[part] for part in LABELS if part in places]
        lacking = pd.Series(0, index=list(places))
        n_left_out, first = 0, None
        tables = self.source.pieces(list(places.values()), _ROWS, labels)
        for number, table in enumerate(tables, start=1):
            piece = self._converted(table, clock)
            self.n_rows += len(piece)
            missing = piece[list(places)].isna()
            bad = missing.any(axis=1)
            if bad.any():
                lacking += missing.sum()
                n_left_out += int(bad.sum())
                first = piece["row"][bad.idxmax()] if first is None else first
                piece = piece[~bad].reset_index(drop=True)
            if len(piece):
                yield piece
            if tell is not None and number % _PIECES_TOLD == 0:
                tell(f"{self.path}: {self.n_rows:,} rows so far")
        if n_left_out:
            self._report_missing(n_left_out, lacking[lacking > 0], first)

    def _clock(self):
        """What reads the time, where it is no number."""
        if "time" not in self.layout.places:
            return None
        place = self.layout.places["time"]
        table = next(self.source.pieces([place], _CLOCK_ROWS), None)
        if table is None or np.isfinite(as_numbers(table[place], self.source.decimal)).any():
            return None
        clock = Clock(table[place])
        if not clock.form:
            return None
        self.notes.append(f"the time is read as {clock.note}")
        return clock

    def _converted(self, table, clock):
        """The parts of a piece in the units of a log."""
        piece = pd.DataFrame({"row": self.n_rows + np.arange(len(table))})
        try:
            for part, place in self.layout.places.items():
                column = table[place]
                if part in LABELS:
                    piece[part] = column.astype(object).to_numpy()
                else:
                    piece[part] = self._numbers(column, part, clock if part == "time" else None)
                check_values(piece[part], part, self._allow_missing)
        except LogError as error:
            raise self.located(error, piece["row"]) from error
        return piece

    def _numbers(self, column, part, clock):
        numbers = clock.seconds(column) if clock else as_numbers(column, self.source.decimal)
        bad = np.isnan(numbers) & (column.notna() & ~column.isin(NO_VALUE)).to_numpy()
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
            row = error.row if rows is None else int(rows.iloc[error.row])
            where = f"{self.path}, {self.source.place_of(row)}"
        if error.column is None:
            return error
        name = self.layout.name(error.column)
        part = "" if name == error.column else f" ({error.column})"
        return LogError(f"{where}, column {name!r}{part}: {error.reason}")

    def _report_missing(self, n_rows, lacking, first):
        parts = ", ".join(f"{self.layout.name(part)!r} in {n:,}" for part, n in lacking.items())
        said = f"{n_rows:,} of {self.n_rows:,} rows lack a value ({parts})"
        if 2 * n_rows > self.n_rows:
            raise LogError(f"{self.path}: {said}: too many to go on without them.")
        place = self.source.place_of(int(first))
        self.notes.append(f"{said}; they are left out, the first of them {place}")
