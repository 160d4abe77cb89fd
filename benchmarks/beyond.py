"""Predictions beyond the data: the default beside a tangent followed for half a deviation.

In every table, the rows beyond the 12 % and 88 % quantiles of the input with the most values are
left out, and predicted. Errors below 0.02 of the target's deviation count as 0.02 of it.
"""

import numpy as np

from skanfis import ANFISRegressor
from skanfis.options import LinearExtrapolation

from .cases import evaluate
from .every_table import part
from .report import Measure, Results, Row
from .scores import geometric_mean, rms_error

__all__ = ["run"]

_FEWEST_VALUES, _MOST_ROWS = 15, 600


def measure(name, _):
    """The ratio of the errors, and the number of rules."""
    X, y = part(0)[name]
    column = max(X.T, key=_n_values)
    low, high = np.quantile(column, (0.12, 0.88))
    beyond = (column < low) | (column > high)
    model, errors = ANFISRegressor().fit(X[~beyond], y[~beyond]), []
    for policy in ("linear", LinearExtrapolation(0.5)):
        error = rms_error(model.set_params(out_of_bounds=policy), X[beyond], y[beyond])
        errors.append(max(error / y.std(), 0.02))
    return {"case": name, "rules": model.n_rules_, "ratio": errors[0] / errors[1]}


def run(options):
    small = [name for name, (X, y) in part(0).items() if len(y) <= _MOST_ROWS and _is_spread(X)]
    found, failed = evaluate("beyond", measure, small, options)
    rows = [Row("beyond the data: all tables", [failed])]
    for what, is_line in (("a line", True), ("several rules", False)):
        ratios = [one["ratio"] for one in found if (one["rules"] == 1) is is_line]
        middle, most = geometric_mean(ratios), float(np.quantile(ratios, 0.95))
        measures = [Measure("geometric mean", middle, "x", 1.0), Measure("95 %", most, "x")]
        rows.append(Row(f"beyond the data: {what}, {len(ratios)} tables", measures))
    return Results(rows)


def _n_values(column):
    return np.unique(column).size


def _is_spread(X):
    return max(map(_n_values, X.T)) >= _FEWEST_VALUES
