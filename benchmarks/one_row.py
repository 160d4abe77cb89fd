"""Predicting one row, against a linear regression beside it; the size of a joblib file."""

import io

import joblib
from sklearn.linear_model import LinearRegression

from skanfis import ANFISRegressor

from .gyro import make_surface
from .report import Measure, Results, Row
from .timing import side_by_side

__all__ = ["run"]

_CALLS = 1000


def run(options):
    X, y, _, _ = make_surface(seed=0)
    model, line = ANFISRegressor(n_mfs=3).fit(X, y), LinearRegression().fit(X, y)
    row = X[:1]
    repeated = {
        "ANFIS": lambda: [model.predict(row) for _ in range(_CALLS)],
        "linear": lambda: [line.predict(row) for _ in range(_CALLS)],
    }
    seconds = side_by_side(repeated, rounds=15)
    anfis, linear = (seconds[name] / _CALLS * 1e6 for name in ("ANFIS", "linear"))
    measures = [
        Measure("ratio", anfis / linear, "x", 2.0, 1.5),
        Measure("ANFIS", anfis, "µs"),
        Measure("LinearRegression", linear, "µs"),
    ]
    work = f"predict of one row, {model.n_rules_} rules"
    file = io.BytesIO()
    joblib.dump(model, file)
    size = Measure("size", file.tell() / 1000.0, "kB", 50.0)
    return Results([Row(work, measures), Row(f"joblib file, {model.n_rules_} rules", [size])])
