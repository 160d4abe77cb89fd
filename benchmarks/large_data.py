"""A million rows in one process: processor time and peak memory of a fit.

All rows are read before the fit, so that they are in memory already. What the peak adds to that
belongs to the fit.
"""

import tempfile
from pathlib import Path

import numpy as np

from skanfis import ANFISRegressor

from .report import Measure, Results, Row
from .scores import rms_error
from .timing import timed

__all__ = ["run"]

_N_ROWS, _N_MFS, _NOISE = 1_000_000, 3, 0.1
_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")
_RESET_PEAK = "5"


def surface(X):
    return np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.5 * X[:, 2] ** 2


def million():
    """Seconds of a fit, its error off the truth, and MB beyond those of before, if Linux tells."""
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "X.npy"
        np.save(path, rng.uniform(-1.0, 1.0, (_N_ROWS, 3)))
        X = np.load(path, mmap_mode="r")
        y = surface(X) + _NOISE * rng.standard_normal(_N_ROWS)
        if _STATUS.exists():
            _CLEAR.write_text(_RESET_PEAK, encoding="ascii")
            before = status("VmRSS")
        model, seconds = timed(ANFISRegressor(_N_MFS).fit, X, y)
        extra = (status("VmHWM") - before) * 1024 / 1e6 if _STATUS.exists() else None
    fresh = np.random.default_rng(99).uniform(-0.999, 0.999, (50_000, 3))
    off = rms_error(model, fresh, surface(fresh))
    return seconds, off, extra


def status(name):
    """A figure of this process in KiB, as Linux keeps it."""
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


def run(options):
    seconds, off, extra = million()
    measures = [Measure("CPU", seconds, "s", 4.0)]
    if extra is not None:
        measures.append(Measure("peak beyond the rows", extra, "MB", 300.0, 100.0))
    measures.append(Measure("off the truth", off, "", 0.01))
    return Results([Row(f"fit of n={_N_ROWS:,}, 3 inputs, 27 rules, noise {_NOISE}", measures)])
