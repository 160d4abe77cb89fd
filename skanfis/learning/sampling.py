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

from ..blocks import BLOCK_ROWS, row_blocks
from .data import StandardisedData, fingerprint

# Beyond so many rows the premises are found on a sample of so many of them. At the minimum of a
# sample of m rows, q parameters cost a part q / m of the error's square: for 18 of them and 20,000
# rows a thousandth, before all rows have their say.
MANY_ROWS, SAMPLE_ROWS = 100_000, 20_000
# So many turns of the wheel per unit of the fingerprint; times a power of two nothing is rounded.
_TURNS = 8192.0
# More are drawn than are wanted, so that enough come: the standard deviation is below one percent.
_MARGIN = 1.25


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Rows by their numbers: raw X, y, weight, fingerprint, number, and group (or None) of each."""

    columns: tuple[np.ndarray, ...]
    groups: np.ndarray | None

    @property
    def size(self):
        return self.columns[0].shape[0]

    @staticmethod
    def of_all(parts):
        """The rows of several."""
        columns = zip(*(part.columns for part in parts), strict=True)
        groups = [part.groups for part in parts]
        return _Drawn(
            tuple(map(np.concatenate, columns)),
            None if groups[0] is None else np.concatenate(groups),
        )

    def taken(self, places):
        """Some of the rows."""
        groups = None if self.groups is None else self.groups[places]
        return _Drawn(tuple(column[places] for column in self.columns), groups)

    def smallest(self, most):
        """Each row once, with the weight of all; at most so many, by their numbers."""
        rows = self.taken(np.argsort(self.columns[3], kind="stable"))
        X, y, weight, prints, numbers = rows.columns
        first = np.flatnonzero(np.diff(prints, prepend=-np.inf))
        if first.size:
            sums = np.zeros(rows.size)
            sums[first] = np.add.reduceat(weight, first)
            rows = replace(rows, columns=(X, y, sums, prints, numbers))
        return rows.taken(first[np.argsort(numbers[first], kind="stable")[:most]])


def is_many(rows):
    """Whether the premises are found on a sample."""
    return rows.n_rows > MANY_ROWS


def with_sample(rows, most=None):
    """Return the same rows with a ``sample`` of them, on the same scales."""
    most = SAMPLE_ROWS if most is None else most
    # The second limit is for rows that repeat each other, of which the first brings too few.
    for limit in (_MARGIN * most / rows.n_rows, 1.0):
        drawn = rows.reduce(partial(_draw, most=most, limit=limit), partial(_join, most=most))
        if drawn.size == most:
            break
    X, y, weight, _, _ = drawn.columns
    weight = None if (weight == 1.0).all() else weight
    sample = StandardisedData(X, y, weight, rows.inputs, rows.targets, drawn.groups)
    return replace(rows, sample=sample)


def _join(one, other, most):
    return _Drawn.of_all([one, other]).smallest(most)


def _draw(rows, most, limit):
    """Of some rows in memory, those of the smallest numbers, below ``limit``."""
    found, n_found = [_of_block(rows, slice(0, 0), limit)], 0
    for part in row_blocks(rows.n_rows, BLOCK_ROWS):
        found.append(_of_block(rows, part, limit))
        n_found += found[-1].size
        if n_found > 2 * most:
            found = [_Drawn.of_all(found).smallest(most)]
            n_found = found[0].size
    return _Drawn.of_all(found).smallest(most)


def _of_block(rows, part, limit):
    Z, target, weight = rows.read(part)
    prints = fingerprint(np.concatenate([Z, target]))
    numbers = (_TURNS * prints) % 1.0
    kept = np.flatnonzero(numbers < limit)
    return _Drawn(
        (
            np.asarray(rows.X[part], dtype=float)[kept],
            np.asarray(rows.y[part], dtype=float)[kept],
            np.ones(kept.size) if weight is None else weight[kept],
            prints[kept],
            numbers[kept],
        ),
        None if rows.groups is None else rows.groups[part][kept],
    )
