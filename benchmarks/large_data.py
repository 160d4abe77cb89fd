"""Many rows: a million in one process; on a cluster of two processes, Parquet larger than memory.

Times of one process are its processor time; passes on the cluster are wall time, which on a machine
with other work says little, and the workers' processor time beside it.
"""

import pickle
import tempfile
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from unittest.mock import patch

import numpy as np

from skanfis import ANFISRegressor, sampling
from skanfis.rows import Rows

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


def surface(X):
    return np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.5 * X[:, 2] ** 2


def noisy_rows(n_rows, seed=0):
    g = np.random.default_rng(seed)
    X = g.uniform(-1.0, 1.0, (n_rows, _N_INPUTS))
    return X, surface(X) + _NOISE * g.standard_normal(n_rows)


def off_the_truth(model):
    """Root mean square error against the surface itself, on rows of its own."""
    X = np.random.default_rng(99).uniform(-0.999, 0.999, (50_000, _N_INPUTS))
    return float(np.sqrt(np.mean((model.predict(X) - surface(X)) ** 2)))


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
    spent, whole = {}, Rows.sum

    def timed(rows, one_pass, *args):
        start = process_time()
        sums = whole(rows, one_pass, *args)
        if rows.n_rows == _IN_FIT:
            spent.setdefault(type(one_pass).__name__, []).append(process_time() - start)
        return sums

    with patch.object(Rows, "sum", timed):
        for _ in range(3):
            ANFISRegressor(n_mfs=_N_MFS).fit(X, y)
    product = min(side_by_side(bare_products(make_problem())).values())
    return {name: float(np.median(values)) / product for name, values in spent.items()}


def write_files(folder, n_rows):
    """Parquet, a file per partition."""
    import pandas as pd

    for number, start in enumerate(range(0, n_rows, _FILE_ROWS)):
        X, y = noisy_rows(min(_FILE_ROWS, n_rows - start), seed=number)
        table = pd.DataFrame(X, columns=_NAMES).assign(y=y)
        table.to_parquet(Path(folder) / f"{number:05d}.parquet")


def on_cluster(folder, n_workers):
    """Passes of a fit (name, seconds, bytes there and back), times, peaks in MB, and the error."""
    import dask.dataframe as dd
    from distributed import Client, LocalCluster

    from skanfis.dask import DaskANFISRegressor, rows

    passes, whole = [], rows.reduce_blocks

    def recorded(blocks, of_loaded, merge):
        start = perf_counter()
        result = whole(blocks, of_loaded, merge)
        there = n_workers * len(pickle.dumps((blocks.without_pieces(), of_loaded)))
        back = len(pickle.dumps(result))
        passes.append([_name(of_loaded), perf_counter() - start, there, back])
        return result

    options = {"threads_per_worker": 1, "memory_limit": _MEMORY, "dashboard_address": ":0"}
    with (
        LocalCluster(n_workers=n_workers, **options) as cluster,
        Client(cluster) as client,
        patch.object(rows, "reduce_blocks", recorded),
    ):
        client.run(_import_all)
        before = sum(client.run(process_time).values())
        table = dd.read_parquet(folder)
        start = perf_counter()
        model = DaskANFISRegressor(n_mfs=_N_MFS).fit(table[_NAMES], table["y"])
        seconds = perf_counter() - start
        cpu = sum(client.run(process_time).values()) - before
        workers = max(client.run(partial(status, "VmHWM")).values()) * 1024 / 1e6
    client_peak = status("VmHWM") * 1024 / 1e6
    return passes, seconds, cpu, workers, client_peak, off_the_truth(model)


def _import_all():
    import skanfis.dask  # noqa: F401


def _name(of_loaded):
    """What a pass is for."""
    inner = getattr(of_loaded, "keywords", {}).get("of_rows", of_loaded)
    one_pass = getattr(inner, "keywords", {}).get("one_pass")
    name = getattr(inner, "func", inner).__name__
    what = {
        "describe": "describe: scales, checks",
        "_draw": "sample",
        "_count": "how rules fire",
        "_first_pass": "support: where the data of each rule lie",
        "_radii": "support: radii",
        "rule_sums": "readability",
    }
    return type(one_pass).__name__ if one_pass is not None else what.get(name, name)


def cluster(n_rows):
    """Tables: one fit pass by pass, and fits of growing numbers of rows."""
    summary, detail = [], None
    sizes = [n for n in (n_rows // 100, n_rows // 10, n_rows) if n > sampling.MANY_ROWS]
    with tempfile.TemporaryDirectory() as folder:
        for n in sizes:
            own = Path(folder) / str(n)
            own.mkdir()
            write_files(own, n)
            for n_workers in (1, 2) if n == n_rows or n <= 10_000_000 else (2,):
                passes, *figures = alone(on_cluster, str(own), n_workers)
                summary.append(
                    [f"{n:,}", n_workers, *figures[:2], figures[1] / n * 1e6, *figures[2:]]
                )
                detail = passes
    head = ["rows", "workers", "wall [s]", "workers' CPU [s]", "CPU per million rows [s]"]
    head += ["worker's peak [MB]", "client's peak [MB]", "off the truth (noise 0.1)"]
    return [
        Table(f"A fit on a cluster: Parquet, workers of {_MEMORY}, 27 rules", head, summary),
        Table(
            f"Its passes over {n_rows:,} rows, two workers",
            ["pass", "wall [s]", "sent to workers [bytes]", "sent to client [bytes]"],
            detail,
        ),
    ]


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
    return Results(rows, tables + (cluster(options.rows) if options.rows else []))
