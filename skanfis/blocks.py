"""Rows in blocks: how many are taken at once, so that memory does not grow with the rows."""

import numpy as np

# Rows that NumPy works on at once: 32 kB a column, so that some columns stay in the second-level
# cache, and a call costs little beside its work.
BLOCK_ROWS = 4096
# The same where a call costs much more than one of NumPy: other libraries' arrays, frames, and what
# goes through a pipeline's steps. Half a megabyte a column.
LARGE_BLOCK_ROWS = 65_536
# Of all that is worked out at once from a block: a part of the third-level cache, whatever the
# model's size. Of 2^18 to 2^24, this was fastest or near it.
BLOCK_BYTES = 2**22
# With fewer, the calls would cost more than the cache saves.
FEWEST_ROWS = 64


def row_blocks(n_rows, length) -> list[slice]:
    """Slices of at most ``length`` rows, in order."""
    return [slice(start, min(start + length, n_rows)) for start in range(0, n_rows, length)]


def add_each(one, other):
    """Sums of two results over rows, one by one; of no rows there are none."""
    return [a + b for a, b in zip(one, other, strict=True)] if one and other else one or other


def fitting_rows(n_values) -> int:
    """Rows of a block of which so many floats a row exist at one time."""
    return int(np.clip(BLOCK_BYTES // (8 * n_values), FEWEST_ROWS, BLOCK_ROWS))
