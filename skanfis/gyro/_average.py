"""Means over equal lengths of time, of a log that is too fine: made while it is read."""

import numpy as np

__all__ = ["Averager"]


class Averager:
    """Turns pieces of a log into means over ``seconds``; a cell never spans two runs or devices."""

    def __init__(self, seconds):
        self._seconds = seconds
        self._rest: dict | None = None
        self.n_rows = self.n_means = 0

    def add(self, piece):
        """The means that are complete with this piece; the rest waits for the next."""
        if self._rest is not None:
            piece = {
                part: np.concatenate([self._rest[part], values]) for part, values in piece.items()
            }
        starts = self._starts(piece)
        if starts.size == 0:
            return piece
        last = starts[-1]
        self._rest = {part: values[last:] for part, values in piece.items()}
        return self._means({part: values[:last] for part, values in piece.items()}, starts[:-1])

    def rest(self):
        """The means of what is left."""
        piece = {} if self._rest is None else self._rest
        self._rest = None
        return self._means(piece, self._starts(piece)) if piece else {}

    def _starts(self, piece):
        """First row of every cell."""
        cell = np.floor(piece["time"] / self._seconds)
        new = np.diff(cell, prepend=np.nan) != 0.0
        for values in piece.values():
            if values.dtype == object:
                new[1:] |= values[1:] != values[:-1]
        return np.flatnonzero(new)

    def _means(self, piece, starts):
        if starts.size == 0:
            return {part: values[:0] for part, values in piece.items()}
        n_rows = piece["time"].size
        counts = np.diff(starts, append=n_rows)
        self.n_rows, self.n_means = self.n_rows + n_rows, self.n_means + starts.size
        return {
            part: values[starts]
            if values.dtype == object
            else np.add.reduceat(values, starts) / counts
            for part, values in piece.items()
        }
