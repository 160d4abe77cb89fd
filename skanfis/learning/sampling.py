r"""A sample of many rows that does not depend on their order, or on how they are split into parts.

Every distinct row [z, y] gets a number from 0 to 1 that its values determine. The rows with the
smallest numbers are the sample, each with the weight of all its repeats (a bottom-k sketch: Cohen
and Kaplan 2007). Samples of parts merge exactly into the sample of the whole: a row among the k
smallest of all is also so in every part that has it. No row is drawn twice, and nothing is random:
the same rows give the same sample, on one machine or on many, in any order of columns.

The number is the fractional part of a multiple of ``place_in_sample``, which is continuous in the
row: rounding errors of the standardisation move it by about 1e-11, too little to reorder rows.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from .._validation import group_numbers
from ..blocks import BLOCK_ROWS, row_blocks
from .data import StandardisedData, fingerprint, place_in_sample

# Beyond MANY_ROWS, the premises are first found on a sample of SAMPLE_ROWS. At the minimum of a
# sample of m rows, q parameters add a part q / m to the squared error: a thousandth for 18 of them
# and 20,000 rows. Then all rows have their say.
MANY_ROWS, SAMPLE_ROWS = 100_000, 20_000
# Factor of the place before its fractional part is taken. A power of two rounds nothing.
_TURNS = 8192.0
# More rows are drawn than wanted, so that enough come: the standard deviation is below one percent.
_MARGIN = 1.25


def is_many(rows):
    """Whether the premises are first found on a sample."""
    return rows.n_rows > MANY_ROWS


def with_sample(rows, most=None):
    """Return the same rows with a ``sample`` of them, on the same scales."""
    most = SAMPLE_ROWS if most is None else most
    # The first limit brings too few distinct rows if many repeat; then all rows may be drawn.
    for limit in (_MARGIN * most / rows.n_rows, 1.0):
        drawn = rows.reduce(partial(_draw, most=most, limit=limit), partial(_smallest, most=most))
        if len(drawn[0]) == most:
            break
    X, y, weight, _, _, *labels = drawn
    groups = [group_numbers(own, len(X)) for own in labels]
    sample = StandardisedData(X, y, weight, rows.inputs, rows.targets, *groups)
    return replace(rows, sample=sample)


def _draw(rows, most, limit):
    """The ``most`` rows with the smallest numbers below ``limit``, of rows in memory.

    A list of raw X, y, weights, fingerprints and numbers, and of groups if the rows have some.
    """
    found, n_found = [_of_block(rows, slice(0, 0), limit)], 0
    for part in row_blocks(rows.n_rows, BLOCK_ROWS):
        found.append(_of_block(rows, part, limit))
        n_found += len(found[-1][0])
        if n_found > 2 * most:
            found, n_found = [_smallest(*found, most=most)], most
    return _smallest(*found, most=most)


def _smallest(*parts, most):
    """The distinct rows with the ``most`` smallest numbers, each with the weight of its repeats."""
    columns = [np.concatenate(of_all) for of_all in zip(*parts, strict=True)]
    order = np.argsort(columns[3], kind="stable")
    columns = [column[order] for column in columns]
    _, _, weight, prints, numbers, *_ = columns
    first = np.flatnonzero(np.diff(prints, prepend=-np.inf))
    if first.size:
        weight[first] = np.add.reduceat(weight, first)
    kept = first[np.argsort(numbers[first], kind="stable")[:most]]
    return [column[kept] for column in columns]


def _of_block(rows, part, limit):
    Z, target, weight = rows.read(part)
    prints = fingerprint(np.concatenate([Z, target]))
    numbers = (_TURNS * place_in_sample(Z, target)) % 1.0
    kept = np.flatnonzero(numbers < limit)
    return [
        np.asarray(rows.X[part], dtype=float)[kept],
        np.asarray(rows.y[part], dtype=float)[kept],
        weight[kept],
        prints[kept],
        numbers[kept],
        *([] if rows.groups is None else [rows.groups[part][kept]]),
    ]
