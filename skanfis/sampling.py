r"""A sample of many rows that can be drawn anywhere: the same whatever their order and their parts.

Every distinct row [z, y] draws a number from 0 to 1 out of its own fingerprint, and the rows of the
smallest numbers are the sample, each with the weight of all its repeats (a bottom-k sketch: Cohen
and Kaplan 2007). Samples of parts merge into the sample of the whole, exactly: a row that is among
the k smallest of all is so in every part that has it. No row is drawn twice, and nothing is random:
the same rows give the same sample, on one machine or on many.

The number is the fractional part of a multiple of the fingerprint, which is continuous in the row:
rounding errors of the standardisation move it by about 1e-11, and with it no row past another.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .rows import Rows, fingerprint

__all__ = ["MANY_ROWS", "SAMPLE_ROWS", "is_many", "with_sample"]

# Beyond so many rows the premises are found on a sample of so many of them. At the minimum of a
# sample of m rows, q parameters cost a part q / m of the error's square: for 18 of them and 20,000
# rows a thousandth, before all rows have their say.
MANY_ROWS, SAMPLE_ROWS = 100_000, 20_000
_READ_ROWS = 4096
# So many turns of the wheel per unit of the fingerprint; a power of two, by which rounding is exact.
_TURNS = 8192.0
# More are drawn than are wanted, so that enough come: the standard deviation is below one percent.
_MARGIN = 1.25


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Distinct rows by their numbers: raw X, y, weight, group, fingerprint and number of each."""

    X: np.ndarray
    y: np.ndarray
    weight: np.ndarray
    groups: np.ndarray | None
    prints: np.ndarray
    numbers: np.ndarray

    def joined(self, other, most):
        """The smallest of both."""
        pairs = zip(self._arrays(), other._arrays(), strict=True)
        joined = [None if a is None else np.concatenate([a, b]) for a, b in pairs]
        return _Drawn(*joined).smallest(most)

    def smallest(self, most):
        """Each row once, with the weight of all; at most so many, by their numbers."""
        order = np.argsort(self.prints, kind="stable")
        first = np.flatnonzero(np.diff(self.prints[order], prepend=-np.inf))
        weight = np.add.reduceat(self.weight[order], first) if first.size else self.weight
        kept = order[first]
        ranks = np.argsort(self.numbers[kept], kind="stable")[:most]
        arrays = [None if a is None else a[kept[ranks]] for a in self._arrays()]
        return replace(_Drawn(*arrays), weight=weight[ranks])

    def _arrays(self):
        return (self.X, self.y, self.weight, self.groups, self.prints, self.numbers)


def is_many(rows):
    """Whether the premises are found on a sample."""
    return rows.n_rows > MANY_ROWS


def with_sample(rows, most=None):
    """Return the same rows with a ``sample`` of them, on the same scales."""
    most = SAMPLE_ROWS if most is None else most
    drawn = None
    for limit in (_MARGIN * most / rows.n_rows, 1.0):
        # The second turn is for rows that repeat each other, of which the first brings too few.
        drawn = rows.reduce(partial(_draw, most=most, limit=limit), partial(_join, most=most))
        if drawn.numbers.size == most:
            break
    sample = Rows(
        drawn.X,
        drawn.y,
        None if (drawn.weight == 1.0).all() else drawn.weight,
        rows.inputs,
        rows.targets,
        drawn.groups,
    )
    return replace(rows, sample=sample)


def _join(one, other, most):
    return one.joined(other, most)


def _draw(rows, most, limit):
    """Of some rows in memory, those of the smallest numbers, below ``limit``."""
    found = _of_block(rows, slice(0, 0), limit)
    waiting = []
    for start in range(0, rows.n_rows, _READ_ROWS):
        waiting.append(_of_block(rows, slice(start, start + _READ_ROWS), limit))
        if sum(block.numbers.size for block in waiting) > 2 * most:
            found, waiting = _all_of([found, *waiting]).smallest(most), []
    return _all_of([found, *waiting]).smallest(most)


def _all_of(blocks):
    columns = zip(*(block._arrays() for block in blocks), strict=True)
    return _Drawn(*(None if c[0] is None else np.concatenate(c) for c in columns))


def _of_block(rows, part, limit):
    Z, target, weight = rows.read(part)
    prints = fingerprint(np.concatenate([Z, target]))
    numbers = (_TURNS * prints) % 1.0
    kept = np.flatnonzero(numbers < limit)
    return _Drawn(
        np.asarray(rows.X[part], dtype=float)[kept],
        np.asarray(rows.y[part], dtype=float)[kept],
        np.ones(kept.size) if weight is None else weight[kept],
        None if rows.groups is None else rows.groups[part][kept],
        prints[kept],
        numbers[kept],
    )
