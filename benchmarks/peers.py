"""Other packages on the gyro-like surface: ``python -m benchmarks peers``.

Each is installed from the package index into an environment of its own, which is thrown away. They
are given X and y scaled, which they need; skanfis and the Gaussian process beside them have raw X
and y.
"""

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

from skanfis import ANFISRegressor

from .gyro import gaussian_process, make_surface, measure, score, summary
from .report import Results, Table

__all__ = ["run"]

_SEEDS = range(3)
# What to install, and which models of _peer.py run there.
_ENVIRONMENTS = [
    (["anfis-toolbox==0.2.2"], ["anfis-toolbox, defaults (27 rules)"]),
    (
        ["highfis==0.36.0", "torch==2.13.0"],
        ["highfis, grid of 64 rules, use_lse=True", "highfis, the same, 1,000 epochs"],
    ),
]


def run(options):
    own = {"ANFISRegressor()": ANFISRegressor, "Gaussian process": gaussian_process}
    lines = [[name, *summary(measure(make, _SEEDS))] for name, make in own.items()]
    for packages, names in _ENVIRONMENTS:
        with tempfile.TemporaryDirectory() as folder:
            lines += lines_of(packages, names, Path(folder))
    head = ["model", "in the box [σ]", "worst", "all rows [σ]", "worst", "fit, CPU [s]"]
    versions = ", ".join(packages[0].replace("==", " ") for packages, _ in _ENVIRONMENTS)
    title = f"Other packages on the gyro-like surface ({versions}), medians of {len(_SEEDS)} seeds"
    return Results(tables=[Table(title, head, lines)])


def lines_of(packages, names, folder):
    """A line per model; why there are none, if the packages cannot be installed or run."""
    try:
        python = install(packages, folder)
        data = folder / "data.npz"
        return [
            [name, *summary(np.array([fit(python, name, data, seed) for seed in _SEEDS]))]
            for name in names
        ]
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["no message"])[-1]
        return [[name, f"failed: {last}", "", "", "", ""] for name in names]


def install(packages, folder):
    """A fresh environment with these packages; its Python."""
    print(f"  installing {', '.join(packages)} ...", file=sys.stderr, flush=True)
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    called([python, "-m", "pip", "install", "--quiet", *packages])
    return python


def fit(python, name, path, seed):
    X, y, X_test, truth = make_surface(seed)
    np.savez(path, X=X, y=y, X_test=X_test)
    found = json.loads(called([python, Path(__file__).with_name("_peer.py"), name, path]))
    return [*score(np.array(found["prediction"]), X, X_test, truth), found["seconds"]]


def called(command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
