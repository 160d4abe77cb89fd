"""Blocks of rows: how many are processed at once, so that memory does not grow with the rows."""

import numpy as np

# Rows that NumPy works on at once: 32 kB a column. Some columns then stay in the second-level
# cache, and the overhead of a call is small.
BLOCK_ROWS = 4096
# The same where a call costs much more than one of NumPy: other libraries' arrays, frames, and
# steps of a pipeline. Half a megabyte a column.
LARGE_BLOCK_ROWS = 65_536
# Size of all arrays that exist at once for a block, whatever the model's size: a part of the
# third-level cache. Of the sizes 2^18 to 2^24, this was the fastest or close to it.
BLOCK_BYTES = 2**22
# Fewest rows of a block: with fewer, the calls would cost more than the cache saves.
FEWEST_ROWS = 64


def row_blocks(n_rows, length) -> list[slice]:
    """Slices of at most ``length`` rows, in order."""
    return [slice(start, min(start + length, n_rows)) for start in range(0, n_rows, length)]


def add_each(one, other):
    """Add two lists of sums over rows, entry by entry; the list of no rows is empty."""
    return [a + b for a, b in zip(one, other, strict=True)] if one and other else one or other


def fitting_rows(n_values) -> int:
    """Rows of a block, if ``n_values`` floats per row exist at one time."""
    return int(np.clip(BLOCK_BYTES // (8 * n_values), FEWEST_ROWS, BLOCK_ROWS))
