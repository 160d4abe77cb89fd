"""Rows kept in the workers' memory for the time of a fit, where they take a small part of it.

A fit has some eight passes. Most of what a pass over Parquet does beside its sums is to read, to
unpack and to convert; kept are the columns of the fit alone, as the passes take them.
"""

from dataclasses import replace
from functools import partial
from typing import Any

from .fusing import Unread

__all__ = ["kept_blocks"]

# Of the workers' limits of memory, all together. They spill from 0.6 of it on, and may hold much
# already: themselves some 250 MB, and data that were persisted.
_SHARE = 0.25
_NUMBER_BYTES = 8


def kept_blocks(blocks, n_rows):
    """The blocks, loaded in the memory of the cluster if so many rows fit; else as they are.

    They are futures: what a worker that dies has held is loaded anew, and all is forgotten with the
    last reference to the blocks. Threads of this process keep nothing.

    Partitions that are read, or made, become as many shares as the workers have threads. Left as
    they are, the scheduler puts them where the first tasks happen to end: of six, four or five came
    to one of two workers, and every later pass waited for that one. Data that the workers hold
    already stay where their owner put them.
    """
    # Weight and group may be there too.
    n_columns = blocks.layout.n_inputs + blocks.layout.n_outputs + 2
    workers = _workers()
    if n_rows * n_columns * _NUMBER_BYTES > _SHARE * _memory(workers):
        return blocks
    from dask.base import persist
    from dask.delayed import delayed

    pieces = blocks.pieces
    n_threads = sum(worker["nthreads"] for worker in workers)
    n_shares = n_threads if isinstance(pieces[0][0], Unread) else len(pieces)
    shares = [range(len(pieces))[first::n_shares] for first in range(min(n_shares, len(pieces)))]
    # What it needs goes with every share: a task goes where one lies that it has in common with
    # others.
    load = delayed(partial(_load, blocks.without_pieces()), pure=False)
    loaded = persist(*(load(share, [pieces[n] for n in share]) for share in shares))
    return replace(blocks, pieces=[(one,) for one in loaded])


def _load(blocks, numbers, pieces):
    return [one for n, parts in zip(numbers, pieces, strict=True) for one in blocks.load(n, *parts)]


def _workers():
    """What the cluster says of each of its workers; none where there is no cluster."""
    from dask.base import get_scheduler

    client: Any = getattr(get_scheduler(), "__self__", None)
    if not hasattr(client, "scheduler_info"):
        return []
    return list(client.scheduler_info(n_workers=-1)["workers"].values())


def _memory(workers):
    """Bytes that the workers may take; 0 without any, and where one of them has no limit."""
    limits = [worker["memory_limit"] for worker in workers]
    return sum(limits) if limits and all(limits) else 0
