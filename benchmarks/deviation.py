"""Predicting with the standard deviation, against predicting without, side by side."""

import numpy as np
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor

from .report import Measure, Results, Row
from .timing import side_by_side

__all__ = ["run"]

# Rows to predict, inputs, and rules: terms of every input, or clusters.
_CASES = (
    (20_000, 3, [3, 3, 3]),
    (20_000, 3, [4, 3, 3]),
    (20_000, 3, [1, 6, 6]),
    (100_000, 8, [2, 3, 4, 1, 1, 1, 1, 1]),
    (20_000, 3, 12),
)
_ROUNDS = 15


def run(options):
    return Results([_measured(*case) for case in _CASES])


def _measured(n_rows, n_inputs, rules):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (2000, n_inputs))
    y = np.sin(3.0 * X[:, 0]) * X[:, 1] + X[:, 2] ** 2 + 0.1 * rng.standard_normal(len(X))
    if isinstance(rules, int):
        clusters = KMeans(rules, n_init=1, random_state=0)
        model, structure = ANFISRegressor(partition=clusters, max_iter=5), "clusters"
    else:
        model = ANFISRegressor(n_mfs=rules, max_iter=5)
        structure = " x ".join(str(n) for n in rules if n > 1)
    model.fit(X, y)
    new = np.clip(rng.uniform(-1.0, 1.0, (n_rows, n_inputs)), X.min(axis=0), X.max(axis=0))
    beyond = new.copy()
    beyond[:, 0] = 1.3
    # Along two inputs with terms.
    several = new.copy()
    several[:, 1:3] = 1.3
    # Along every one; and along any, by half a standard deviation of noise.
    every = np.full_like(new, 1.3)
    mixed = new + 0.5 * X.std(axis=0) * rng.standard_normal(new.shape)
    seconds = side_by_side(
        {
            "plain": lambda: model.predict(new),
            "std": lambda: model.predict(new, return_std=True),
            "plain beyond": lambda: model.predict(beyond),
            "std beyond": lambda: model.predict(beyond, return_std=True),
            "plain several": lambda: model.predict(several),
            "std several": lambda: model.predict(several, return_std=True),
            "plain every": lambda: model.predict(every),
            "std every": lambda: model.predict(every, return_std=True),
            "plain mixed": lambda: model.predict(mixed),
            "std mixed": lambda: model.predict(mixed, return_std=True),
        },
        _ROUNDS,
    )
    over = {
        where: seconds[f"std{where}"] / seconds[f"plain{where}"]
        for where in ("", " beyond", " several", " every", " mixed")
    }
    work = f"deviation of {n_rows:,} rows, {n_inputs} inputs, {model.n_rules_} rules"
    measures = [
        Measure("in range, over plain", over[""], "x", 4.0),
        Measure("a row", seconds["std"] / n_rows * 1e6, "µs"),
        Measure("out of range along one input, over plain", over[" beyond"], "x", 4.0),
        Measure("along two", over[" several"], "x", 4.0),
        Measure("along all", over[" every"], "x", 4.0),
        Measure("along any, noise", over[" mixed"], "x", 4.0),
    ]
    return Row(f"{work} ({structure})", measures)
