"""Two worker processes over one: the passes of a fit on a cluster, and of plain processes.

The same passes over the same Parquet files: by dask's workers, the rows kept in their memory or
read anew for every pass, and by processes that know nothing of dask, side by side, which is what
the machine itself can do. Efficiency is the time by the clock of one over that of two, in passes;
it wants a machine on which nothing else runs, which the processor time beside it tells: what two
take in all over what one takes is what they cost each other.
"""

import os
import pickle
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from multiprocessing import get_context
from time import perf_counter, process_time
from unittest.mock import patch

from skanfis._memory import keeps_freed_memory
from skanfis.dask import keeping

from .fresh import alone
from .large_data import _NAMES, on_cluster, write_files
from .report import Measure, Results, Row, Table

__all__ = ["run"]

_ROUNDS = 4
_BAR = 1.7
# What dask's processes watch themselves by, off or less often; see docs/large_data.
_NO_WATCH = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
}


def by_dask(files, n_workers, keeps=True, config=None):
    """Seconds of the passes by the clock, of the workers' processors and of client and scheduler.

    And the passes themselves, pickled: what they need, and what each does with a block.
    """
    import dask

    with ExitStack() as stack:
        stack.enter_context(dask.config.set(config or {}))
        if not keeps:
            stack.enter_context(patch.object(keeping, "_SHARE", 0.0))
        found = on_cluster(files, n_workers)
    wall, cpu, own = (sum(getattr(one, name) for one in found.passes) for name in _SPENT)
    return wall, cpu, own, [one.work for one in found.passes]


_SPENT = ("wall", "cpu", "client_cpu")


def plain(files, passes, start):
    """What a worker does, without dask; seconds by the clock and of the processor."""
    import pandas as pd

    passes = [pickle.loads(work) for work in passes]
    pd.read_parquet(files[0])
    start.wait()
    began, spent = perf_counter(), process_time()
    kept = {}
    for number, (blocks, of_loaded) in enumerate(passes):
        for file in files:
            if number < 2:
                table = pd.read_parquet(file, columns=[*_NAMES, "y"])
                (kept[file],) = blocks.load(0, table[_NAMES], table["y"], None, None)
            with keeps_freed_memory():
                of_loaded(kept[file])
    return perf_counter() - began, process_time() - spent


def side_by_side(files, passes, n_processes):
    """Plain processes, each on its part of the files: longest by the clock, processors in all."""
    context = get_context("spawn")
    with (
        context.Manager() as manager,
        ProcessPoolExecutor(n_processes, mp_context=context) as pool,
    ):
        start = manager.Barrier(n_processes)
        parts = [files[number::n_processes] for number in range(n_processes)]
        found = [pool.submit(plain, part, passes, start) for part in parts]
        walls, spent = zip(*(one.result() for one in found), strict=True)
    return max(walls), sum(spent), 0.0


def measure(files):
    """Seconds of each way, by the number of workers: the best of some rounds, in turn."""
    passes = by_dask(files, 1)[-1]
    ways = {
        "plain processes": lambda n: side_by_side(files, passes, n),
        "dask, rows kept": lambda n: by_dask(files, n)[:3],
        "dask, rows kept, without its watch": lambda n: by_dask(files, n, config=_NO_WATCH)[:3],
        "dask, rows read anew": lambda n: by_dask(files, n, keeps=False)[:3],
    }
    found: dict = {}
    for _ in range(_ROUNDS):
        for way, seconds in ways.items():
            for n_workers in (1, 2):
                found.setdefault((way, n_workers), []).append(seconds(n_workers))
                told = ", ".join(f"{one:.2f} s" for one in found[way, n_workers][-1])
                print(f"{way}, {n_workers}: {told}", file=sys.stderr, flush=True)
    return {key: min(values) for key, values in found.items()}


def run(options):
    with tempfile.TemporaryDirectory() as folder:
        files = list(map(str, write_files(folder, options.rows)))
        found = alone(measure, files)
    lines, measures = [], []
    for way in dict.fromkeys(way for way, _ in found):
        one, two = found[way, 1], found[way, 2]
        efficiency = one[0] / two[0]
        lines.append([way, *one, *two, two[1] / one[1], efficiency])
        measures.append(Measure(f"{way}: one over two, wall", efficiency))
    head = ["passes by", *(f"{n}: {what} [s]" for n in ("one", "two") for what in _HEAD)]
    head += ["CPU of two over one", "efficiency"]
    load = f"load {os.getloadavg()[0]:.1f} at the end"
    return Results(
        [Row(f"two workers over one, {options.rows:,} rows (at least {_BAR}; {load})", measures)],
        [Table("Two workers over one", head, lines)],
    )


_HEAD = ("wall", "CPU", "client and scheduler")
