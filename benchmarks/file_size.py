"""Size of a fitted model in a joblib file."""

import tempfile
from pathlib import Path

import joblib

from skanfis import ANFISRegressor

from .gyro import make_surface
from .report import Measure, Results, Row

__all__ = ["run"]


def run(options):
    X, y, _, _ = make_surface(seed=0)
    model = ANFISRegressor(n_mfs=3).fit(X, y)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.joblib"
        joblib.dump(model, path)
        size = Measure("size", path.stat().st_size / 1000.0, "kB", 50.0)
    return Results([Row(f"joblib file, {model.n_rules_} rules", [size])])
