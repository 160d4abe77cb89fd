"""Peak memory of a fit to rows that lie in a file.

The fit has a process of its own. Every page of the file is read there first: what the peak then
exceeds the memory before the fit by is the fit's own.
"""

import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from time import process_time

import numpy as np

from skanfis import ANFISRegressor

from .report import Measure, Results, Row

__all__ = ["run"]

_N_ROWS, _N_INPUTS, _MIB = 4_000_000, 3, 2**20
_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")
_RESET_PEAK = "5"


def run(options):
    work = f"extra memory of a fit, n={_N_ROWS:,} memory-mapped, 27 rules"
    if not _STATUS.exists():
        return Results([Row(f"{work} (needs Linux)", [])])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "X.npy"
        write_rows(path)
        command = [sys.executable, "-m", __name__, str(path)]
        root = Path(__file__).parents[1]
        found = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    figures = json.loads(found.stdout)
    measures = [
        Measure("peak", figures["extra"], "MiB", 300.0, 100.0),
        Measure("CPU for 3 iterations", figures["seconds"], "s"),
    ]
    return Results([Row(work, measures)])


def write_rows(path):
    shape = (_N_ROWS, _N_INPUTS)
    X = np.lib.format.open_memmap(path, mode="w+", dtype=float, shape=shape)
    rng = np.random.default_rng(0)
    for start in range(0, _N_ROWS, 100_000):
        part = X[start : start + 100_000]
        part[:] = rng.uniform(-1.0, 1.0, part.shape)
    X.flush()


def fit_to(path):
    """Fit to the rows in a file; MiB of memory beyond those of before, and seconds."""
    X = np.load(path, mmap_mode="r")
    y = np.sin(3.0 * X[:, 0]) * X[:, 1]
    assert np.isfinite(X[:, 2].sum())  # the last column's pages too
    _CLEAR.write_text(_RESET_PEAK, encoding="ascii")
    before, start = status("VmRSS"), process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ANFISRegressor(n_mfs=3, max_iter=3).fit(X, y)
    seconds = process_time() - start
    return {"extra": (status("VmHWM") - before) / 1024, "seconds": seconds}


def status(name):
    """A figure of this process in KiB, as Linux keeps it."""
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


if __name__ == "__main__":
    print(json.dumps(fit_to(sys.argv[1])))
