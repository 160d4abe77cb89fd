"""Rows kept in the workers' memory for the time of a fit, where they take a small part of it.

A fit has some eight passes. Most of what a pass over Parquet does beside its sums is to read, to
unpack and to convert; kept are the columns of the fit alone, as the passes take them.
"""

from dataclasses import replace
from typing import Any

__all__ = ["kept_blocks"]

# Of the workers' limits of memory, all together. They spill from 0.6 of it on, and may hold much
# already: themselves some 250 MB, and data that were persisted.
_SHARE = 0.25
_NUMBER_BYTES = 8


def kept_blocks(blocks, n_rows):
    """The blocks, loaded in the memory of the cluster if so many rows fit; else as they are.

    They are futures: what a worker that dies has held is loaded anew, and all is forgotten with the
    last reference to the blocks. Threads of this process keep nothing.
    """
    # Weight and group may be there too.
    n_columns = blocks.layout.n_inputs + blocks.layout.n_outputs + 2
    if n_rows * n_columns * _NUMBER_BYTES > _SHARE * _memory():
        return blocks
    from dask.base import persist
    from dask.delayed import delayed

    own = delayed(blocks.without_pieces(), traverse=False)
    load = delayed(_load, pure=False)
    loaded = persist(*(load(own, n, *parts) for n, parts in enumerate(blocks.pieces)))
    return replace(blocks, pieces=[(one,) for one in loaded])


def _load(blocks, number, *parts):
    return blocks.load(number, *parts)


def _memory():
    """Bytes that the workers may take; 0 without a cluster, and where one of them has no limit."""
    from dask.base import get_scheduler

    client: Any = getattr(get_scheduler(), "__self__", None)
    if not hasattr(client, "scheduler_info"):
        return 0
    limits = [
        worker["memory_limit"] for worker in client.scheduler_info(n_workers=-1)["workers"].values()
    ]
    return sum(limits) if limits and all(limits) else 0
