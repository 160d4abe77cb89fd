"""Many rows: a million in one process; on a cluster of two processes, Parquet larger than memory.

Times of one process are its processor time; passes on the cluster are wall time, which on a machine
with other work says little, and the workers' processor time beside it. The files take
34 bytes a row of the folder for temporary files.
"""

import os
import pickle
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from unittest.mock import patch

import numpy as np

from skanfis import ANFISRegressor
from skanfis.learning import sampling
from skanfis.learning.data import StandardisedData

from .fresh import alone
from .memory import status
from .one_pass import bare_products, make_problem
from .report import Measure, Results, Row, Table
from .timing import best_of, side_by_side

__all__ = ["run"]

_MILLION, _N_INPUTS, _N_MFS = 1_000_000, 3, 3
_IN_FIT = 400_000
_NOISE = 0.1
_FILE_ROWS = 500_000
_MEMORY = "1GB"
_NAMES = ["x0", "x1", "x2"]
_FIGURE = Path(__file__).parents[1] / "docs" / "images" / "large_data.png"


def surface(X):
    return np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.5 * X[:, 2] ** 2


def noisy_rows(n_rows, seed=0):
    g = np.random.default_rng(seed)
    X = g.uniform(-1.0, 1.0, (n_rows, _N_INPUTS))
    return X, surface(X) + _NOISE * g.standard_normal(n_rows)


def off_the_truth(model):
    """Root mean square error against the surface itself, on rows of its own."""
    X = np.random.default_rng(99).uniform(-0.999, 0.999, (50_000, _N_INPUTS))
    return float(np.sqrt(np.mean((model.model_.predict(X)[:, 0] - surface(X)) ** 2)))


def million():
    """Processor seconds and errors of a fit: as it is, and with every step on all rows."""
    X, y = noisy_rows(_MILLION)
    found = {}
    for name, threshold in (("sample first", sampling.MANY_ROWS), ("all rows only", _MILLION)):
        with patch.object(sampling, "MANY_ROWS", threshold):
            rounds = 3 if threshold < _MILLION else 1
            seconds, model = best_of(lambda: ANFISRegressor(n_mfs=_N_MFS).fit(X, y), rounds)
        error = np.sqrt(np.mean((y - model.predict(X)) ** 2))
        found[name] = seconds, float(error), off_the_truth(model)
    return found


def pass_in_fit():
    """Cost, consequents and gradient of all rows inside a fit, in bare products."""
    X, y = noisy_rows(_IN_FIT)
    spent, whole = {}, StandardisedData.sum

    def timed(rows, one_pass, *args):
        start = process_time()
        sums = whole(rows, one_pass, *args)
        if rows.n_rows == _IN_FIT:
            spent.setdefault(type(one_pass).__name__, []).append(process_time() - start)
        return sums

    with patch.object(StandardisedData, "sum", timed):
        for _ in range(3):
            ANFISRegressor(n_mfs=_N_MFS).fit(X, y)
    product = min(side_by_side(bare_products(make_problem())).values())
    return {name: float(np.median(values)) / product for name, values in spent.items()}


def write_files(folder, n_rows):
    """Parquet, a file per partition, each of a seed of its own; the files in order."""
    import pandas as pd

    files = []
    for number, start in enumerate(range(0, n_rows, _FILE_ROWS)):
        files.append(Path(folder) / f"{number:05d}.parquet")
        if not files[-1].exists():
            X, y = noisy_rows(min(_FILE_ROWS, n_rows - start), seed=number)
            pd.DataFrame(X, columns=_NAMES).assign(y=y).to_parquet(files[-1])
    return files


@dataclass(frozen=True)
class Pass:
    """One pass over the rows: seconds by the clock and of the workers' processors, bytes."""

    name: str
    wall: float
    cpu: float
    client_cpu: float  # the scheduler's too
    to_workers: int
    to_client: int
    work: bytes  # pickled: what it needs, and what it does with a block


@dataclass(frozen=True)
class OnCluster:
    """A fit on a cluster."""

    n_rows: int
    n_workers: int
    passes: list[Pass]
    wall: float
    cpu: float
    client_cpu: float
    worker_peak: float  # MB
    client_peak: float
    off: float
    load: float  # of the machine, processes that run or wait, on average

    @property
    def pass_cpu(self):
        """Processor seconds of the workers in passes, per million rows."""
        return sum(one.cpu for one in self.passes) / self.n_rows * 1e6

    @property
    def pass_wall(self):
        """Seconds by the clock in passes, per million rows."""
        return sum(one.wall for one in self.passes) / self.n_rows * 1e6


def on_cluster(files, n_workers):
    """A fit to files by so many worker processes."""
    import dask.dataframe as dd
    from distributed import Client, LocalCluster

    from skanfis.dask import DaskANFISRegressor, rows

    passes, whole = [], rows.reduce_blocks

    def recorded(blocks, of_loaded, merge):
        spent, own, start = worker_time(), process_time(), perf_counter()
        result = whole(blocks, of_loaded, merge)
        wall, own, spent = perf_counter() - start, process_time() - own, worker_time() - spent
        work = pickle.dumps((blocks.without_pieces(), of_loaded))
        there, here = n_workers * len(work), len(pickle.dumps(result))
        passes.append(Pass(_name(of_loaded), wall, spent, own, there, here, work))
        return result

    def worker_time():
        return sum(client.run(process_time).values())

    options = {"threads_per_worker": 1, "memory_limit": _MEMORY, "dashboard_address": ":0"}
    with (
        LocalCluster(n_workers=n_workers, **options) as cluster,
        Client(cluster) as client,
        patch.object(rows, "reduce_blocks", recorded),
    ):
        # What is imported once is not counted.
        client.run(_read_one, files[0])
        table = dd.read_parquet(files)
        start, spent, own = perf_counter(), worker_time(), process_time()
        model = DaskANFISRegressor(n_mfs=_N_MFS).fit(table[_NAMES], table["y"])
        wall, cpu, own = perf_counter() - start, worker_time() - spent, process_time() - own
        workers = max(client.run(partial(status, "VmHWM")).values()) * 1024 / 1e6
        load = os.getloadavg()[1]
    peak = status("VmHWM") * 1024 / 1e6
    n_rows = int(model.readability_.measures.weight)
    off = off_the_truth(model)
    return OnCluster(n_rows, n_workers, passes, wall, cpu, own, workers, peak, off, load)


def _read_one(path):
    import dask.dataframe  # noqa: F401
    import pandas as pd

    import skanfis.dask  # noqa: F401

    pd.read_parquet(path)


def _name(of_loaded):
    """What a pass is for."""
    inner = getattr(of_loaded, "keywords", {}).get("of_rows", of_loaded)
    one_pass = getattr(inner, "keywords", {}).get("one_pass")
    name = getattr(inner, "func", inner).__name__
    what = {
        "describe": "describe: scales, checks",
        "_draw": "sample",
        "_first_pass": "how rules fire, where their data lie",
        "_radii": "support: radii",
        "rule_sums": "readability",
    }
    return type(one_pass).__name__ if one_pass is not None else what.get(name, name)


def cluster(n_rows, folder, figure):
    """Tables and a picture: fits of growing numbers of rows, and the largest pass by pass."""
    sizes = (n_rows // 100, n_rows // 10, n_rows * 3 // 10, n_rows)
    files = write_files(folder, n_rows)
    fits = []
    for n in (n for n in sizes if n > sampling.MANY_ROWS):
        for n_workers in (1, 2):
            # By one worker alone, the largest take too long.
            if n_workers == 2 or n <= 10_000_000:
                own = list(map(str, files[: -(-n // _FILE_ROWS)]))
                fits.append(alone(on_cluster, own, n_workers))
                print(_summary(fits[-1]), file=sys.stderr, flush=True)
    draw(fits, figure)
    head = ["rows", "workers", "wall [s]", "load", "workers' CPU [s]", "client's CPU [s]"]
    head += ["CPU of passes, per million rows [s]", "wall of passes, per million rows [s]"]
    head += ["worker's peak [MB]", "client's peak [MB]", "off the truth (noise 0.1)"]
    per_million = 1e6 / fits[-1].n_rows
    by_pass = [
        [one.name, one.wall, one.cpu, one.cpu * per_million, one.to_workers, one.to_client]
        for one in fits[-1].passes
    ]
    spent = ["wall [s]", "workers' CPU [s]", "per million rows [s]"]
    return [
        Table(
            f"A fit on a cluster: Parquet, workers of {_MEMORY}, 27 rules",
            head,
            [_summary(one) for one in fits],
        ),
        Table(
            f"Its passes over {fits[-1].n_rows:,} rows, two workers",
            ["pass", *spent, "sent to workers [bytes]", "sent to client [bytes]"],
            by_pass,
        ),
    ]


def _summary(fit):
    """A line of the table."""
    line = [f"{fit.n_rows:,}", fit.n_workers, fit.wall, fit.load, fit.cpu, fit.client_cpu]
    line += [fit.pass_cpu, fit.pass_wall]
    return [*line, fit.worker_peak, fit.client_peak, fit.off]


def draw(fits, path):
    """Cost against rows, to a file."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    ax = figure.subplots()
    for n_workers, marker, color in ((1, "s", "0.55"), (2, "o", "C0")):
        own = [fit for fit in fits if fit.n_workers == n_workers]
        x, y = [fit.n_rows for fit in own], [fit.cpu for fit in own]
        label = f"{n_workers} worker{'s' if n_workers > 1 else ''}"
        ax.loglog(x, y, marker, color=color, label=label, mfc="none" if n_workers == 1 else None)
    largest = fits[-1]
    ends = np.array([min(fit.n_rows for fit in fits) / 2.0, largest.n_rows * 2.0])
    ax.loglog(
        ends,
        ends * largest.pass_cpu / 1e6,
        "-",
        color="0.8",
        zorder=0,
        label=f"{largest.pass_cpu:.1f} s per million rows",
    )
    ax.set(xlabel="rows", ylabel="processor time of all workers [s]")
    ax.set_title("A fit of 27 rules on three inputs: cost against rows")
    ax.legend()
    figure.savefig(path, dpi=110)


def run(options):
    found = alone(million)
    (seconds, error, off), (slow, slow_error, slow_off) = found.values()
    ratios = alone(pass_in_fit)
    rows = [
        Row(
            f"fit of n={_MILLION:,}, 3 inputs, 27 rules",
            [
                Measure("CPU", seconds, "s", 3.0),
                Measure(
                    "training error over that of every step on all rows",
                    error / slow_error,
                    "",
                    1.001,
                ),
            ],
        ),
        Row(
            f"pass inside a fit of n={_IN_FIT:,}, 27 rules, in bare products Φ'Φ",
            [Measure("pass", sum(ratios.values()), "x", 2.0)],
        ),
    ]
    lines = [["sample first", seconds, error, off], ["all rows only", slow, slow_error, slow_off]]
    tables = [
        Table("A million rows", ["training", "CPU [s]", "training error", "off the truth"], lines),
        Table(
            "Pass inside a fit", ["pass", "in products"], [list(item) for item in ratios.items()]
        ),
    ]
    if options.rows:
        with tempfile.TemporaryDirectory() as folder:
            tables += cluster(options.rows, folder, _FIGURE)
    return Results(rows, tables)
