"""Peak memory of a fit to rows that lie in a file.

Every page of the file is read before: what the peak then exceeds the memory before the fit by is
the fit's own.
"""

import tempfile
from pathlib import Path

import numpy as np

from skanfis import ANFISRegressor

from .report import Measure, Results, Row
from .timing import best_of

__all__ = ["run"]

_N_ROWS, _N_INPUTS = 4_000_000, 3
_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")
_RESET_PEAK = "5"


def run(options):
    work = f"extra memory of a fit, n={_N_ROWS:,} memory-mapped, 27 rules"
    if not _STATUS.exists():
        return Results([row(f"{work} (needs Linux)", None)])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "X.npy"
        write_rows(path)
        extra, seconds = fit_to(path)
    return Results([row(work, extra, Measure("CPU for 3 iterations", seconds, "s"))])


def row(work, extra, *others):
    return Row(work, [Measure("peak", extra, "MB", 300.0, 100.0), *others])


def write_rows(path):
    shape = (_N_ROWS, _N_INPUTS)
    X = np.lib.format.open_memmap(path, mode="w+", dtype=float, shape=shape)
    rng = np.random.default_rng(0)
    for start in range(0, _N_ROWS, 100_000):
        part = X[start : start + 100_000]
        part[:] = rng.uniform(-1.0, 1.0, part.shape)
    X.flush()


def fit_to(path):
    """Fit to the rows in a file; MB of memory beyond those of before, and seconds."""
    X = np.load(path, mmap_mode="r")
    y = np.sin(3.0 * X[:, 0]) * X[:, 1]
    X.sum()  # every page
    _CLEAR.write_text(_RESET_PEAK, encoding="ascii")
    before = status("VmRSS")
    seconds, _ = best_of(lambda: ANFISRegressor(n_mfs=3, max_iter=3).fit(X, y), rounds=1)
    return (status("VmHWM") - before) * 1024 / 1e6, seconds


def status(name):
    """A figure of this process in KiB, as Linux keeps it."""
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))
