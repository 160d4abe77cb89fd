"""A real gyro on a rate table, from a CSV that is no part of the project: --campaign PATH.

The true rate lies on a grid of levels. A model judged on levels that it has seen need only remember
them, so whole levels of the rate's size are held out.
"""

from functools import partial

import numpy as np

from skanfis import ANFISRegressor

from .compensation import polynomial
from .gyro import gaussian_process
from .report import Measure, Results, Row, Table
from .scores import rms
from .timing import best_of, timed

__all__ = ["run"]

_LEVEL = 3.6  # deg/s
_N_GROUPS = 5


def read(path):
    """Counts and temperature, the true rate, and the level of each row."""
    data = np.genfromtxt(path, delimiter=",", names=True)
    rate = data["rate_true_deg_s"]
    level = np.round(np.abs(rate) / _LEVEL).astype(int)
    return np.column_stack([data["gyro_counts"], data["temp_c"]]), rate, level


def held_out_rms(make_estimator, X, rate, level):
    """RMS error over the interleaved groups of levels, without the top one; the last model."""
    errors = []
    for group in range(_N_GROUPS):
        held_out = level % _N_GROUPS == group
        model = make_estimator().fit(X[~held_out], rate[~held_out])
        scored = held_out & (level < level.max())
        errors.append(model.predict(X[scored]) - rate[scored])
    return rms(np.concatenate(errors)), model


def run(options):
    data = read(options.campaign)
    (error, model), seconds = best_of(3, held_out_rms, ANFISRegressor, *data)
    lines = [["ANFISRegressor()", model.n_rules_, error, seconds / _N_GROUPS]]
    measures = [
        Measure("RMS", error, "deg/s", 0.050, 0.047),
        Measure("rules", model.n_rules_, "", 12),
    ]
    rows = [Row("rate-table campaign, rate levels held out, defaults", measures)]
    rivals = {
        "cubic polynomial": partial(polynomial, 3),
        "Gaussian process": partial(gaussian_process, n_inputs=2),
    }
    for name, make in rivals.items():
        (error, _), seconds = timed(held_out_rms, make, *data)
        lines.append([name, "", error, seconds / _N_GROUPS])
    head = ["model", "rules", "RMS [deg/s]", "CPU per fit [s]"]
    return Results(rows, [Table("Rate-table campaign", head, lines)])
