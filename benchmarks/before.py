"""Processor time of default fits beside another checkout's: ``python -m benchmarks.before PATH``.

A process of each tree, one thread each, fits every real set and every eighth of the battery's
random functions in turn (``A B A B``), after one fit that does not count. Medians are shown.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from . import battery, real_sets
from .random_functions import make_data
from .report import Results, Table, markdown

HERE = Path(__file__).resolve().parents[1]
# Run in the other tree, which need not have these benchmarks.
_FITS = """
import json, sys, time, warnings
import numpy as np
from skanfis import ANFISRegressor
warnings.simplefilter("ignore")
for path in sys.stdin:
    with np.load(path.strip()) as data:
        X, y = data["X"], data["y"]
    start = time.process_time()
    model = ANFISRegressor().fit(X, y)
    spent = time.process_time() - start
    print(json.dumps([spent, int(model.n_rules_)]), flush=True)
"""


def process(tree):
    one_thread = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    return subprocess.Popen(
        [sys.executable, "-c", _FITS],
        cwd="/",
        env=os.environ | one_thread | {"PYTHONPATH": str(tree)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def fit(worker, path):
    worker.stdin.write(f"{path}\n")
    worker.stdin.flush()
    return json.loads(worker.stdout.readline())


def random_functions():
    """Name, X and y of each."""
    for case in battery.cases()[::8]:
        data = make_data(case)
        yield str(case), data.X, data.y


def compared(title, data_sets, workers, n_fits):
    """A table: each set's seconds and rules of either tree, and the ratio of the seconds."""
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.npz"
        for name, X, y in data_sets:
            np.savez(path, X=X, y=y)
            if not lines:
                _ = [fit(worker, path) for worker in workers]
            found = np.array([[fit(worker, path) for worker in workers] for _ in range(n_fits)])
            (a, b), (rules_a, rules_b) = np.median(found, axis=0).T
            lines.append([f"{name}, {X.shape[0]} x {X.shape[1]}", a, b, b / a, rules_a, rules_b])
            print(lines[-1], file=sys.stderr, flush=True)
    lines.append(["median", "", "", median(lines), "", ""])
    head = ["data", "other [s]", "this [s]", "this / other", "rules, other", "rules, this"]
    return Table(title, head, lines)


def median(lines):
    """Of the ratios."""
    return float(np.median([line[3] for line in lines if line[0] != "median"]))


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.before", description=__doc__)
    parser.add_argument("other", type=Path, help="root of another checkout")
    parser.add_argument("--only", default="", metavar="TEXT", help="sets with this in their names")
    parser.add_argument("--fits", type=int, default=3, metavar="N", help="fits of each set")
    args = parser.parse_args()
    title = "Processor time of ANFISRegressor().fit"
    with ExitStack() as stack:
        workers = [stack.enter_context(process(tree.resolve())) for tree in (args.other, HERE)]
        tables = [
            compared(f"{title}: {kind}", chosen, workers, args.fits)
            for kind, data_sets in (
                ("real sets", real_sets.data_sets()),
                ("random functions", random_functions()),
            )
            if (chosen := [data for data in data_sets if args.only in data[0]])
        ]
        for worker in workers:
            worker.stdin.close()
    facts = [f"other: {args.other.resolve()}", f"this: {HERE}"]
    of_all = median([line for table in tables for line in table.lines])
    facts.append(f"this / other, median of all: {of_all:.3g}")
    print(markdown(Results(tables=tables), facts))


if __name__ == "__main__":
    main()
