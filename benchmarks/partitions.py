"""Every partition on three problems of known noise: a gyro's surface, Friedman's, a small one.

The error is that to be expected on new rows with noise, over the noise: 1 is perfect.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans
from sklearn.datasets import make_friedman1
from sklearn.mixture import GaussianMixture

from skanfis import ANFISRegressor
from skanfis.learning import VariableProjection

from .gyro import SIGMA, make_surface
from .report import Measure, Results, Row, Table
from .timing import best_of

__all__ = ["run"]

_N_TEST = 5000
# Of more consequent parameters than this a fit takes up to twenty seconds: one seed must do.
_MANY_COLUMNS = 1000
# What few or noisy rows ask for; "stiff" below.
_STIFF = {"alpha": 1e-3, "solver": VariableProjection(stiffness=1e-2)}


@dataclass(frozen=True)
class Task:
    """Data by seed: X, y, rows to test with, and the truth there."""

    name: str
    noise: float
    make: Callable
    n_inputs: int
    n_seeds: int

    def figures(self, parameters, seed):
        """Rules, error over the noise, processor time; None if the rules are too many to hold."""
        X, y, X_test, truth = self.make(seed)
        try:
            seconds, model = best_of(lambda: ANFISRegressor(**parameters).fit(X, y), rounds=1)
        except ValueError:
            return None
        inside = model.in_bounds(X_test)
        difference = model.predict(X_test)[inside] - truth[inside]
        error = np.sqrt(np.mean(difference**2) + self.noise**2) / self.noise
        return model.n_rules_, error, seconds


def friedman(n_rows, n_inputs, seed):
    """Friedman's first problem: five inputs matter, one of them by a parabola, two by a sine."""
    n_all = n_rows + _N_TEST
    X, truth = make_friedman1(n_all, n_features=n_inputs, noise=0.0, random_state=seed)
    noise = np.random.default_rng(seed).standard_normal(n_rows)
    return X[:n_rows], truth[:n_rows] + noise, X[n_rows:], truth[n_rows:]


TASKS = [
    Task("gyro-like, 2,000 x 3", SIGMA, make_surface, 3, 3),
    Task("Friedman 1, 5,000 x 8", 1.0, lambda seed: friedman(5000, 8, seed), 8, 3),
    Task("Friedman 1, 100 x 5", 1.0, lambda seed: friedman(100, 5, seed), 5, 10),
]


def partitions(task):
    """What to call it, and the parameters."""
    yield "as it comes", {}
    yield 'partition="grid"', {"partition": "grid"}
    yield "n_mfs=2", {"n_mfs": 2}
    yield "n_mfs=2, stiff", {"n_mfs": 2, **_STIFF}
    yield "n_mfs=3", {"n_mfs": 3}
    yield 'partition="subtractive"', {"partition": "subtractive"}
    yield 'partition="subtractive", stiff', {"partition": "subtractive", **_STIFF}
    yield 'partition="fcm"', {"partition": "fcm"}
    yield "KMeans(5)", {"partition": KMeans(5, n_init=3, random_state=0)}
    yield "GaussianMixture(5)", {"partition": GaussianMixture(5, random_state=0)}
    # Of other rows of the same problem, as from another device.
    X, y, _, _ = task.make(seed=100)
    imported = ANFISRegressor().fit(X, y).model_
    yield 'imported rules, solver="lse"', {"partition": imported, "solver": "lse"}


def compare(task):
    """A line and the figures per partition: rules, and medians of error and time over the seeds."""
    for name, parameters in partitions(task):
        first = task.figures(parameters, seed=0)
        if first is None:
            yield [task.name, name, 0, "too many", "", "", ""], None
            continue
        n_seeds = 1 if first[0] * (1 + task.n_inputs) > _MANY_COLUMNS else task.n_seeds
        figures = [first, *(task.figures(parameters, seed) for seed in range(1, n_seeds))]
        n_rules, errors, seconds = np.transpose(figures)
        line = [float(np.median(errors)), float(errors.max()), float(np.median(seconds))]
        yield [task.name, name, n_seeds, _span(n_rules), *line], (n_rules, errors, seconds)


def _span(numbers):
    low, high = int(numbers.min()), int(numbers.max())
    return str(low) if low == high else f"{low} to {high}"


def run(options):
    lines, found = [], {}
    for task in TASKS:
        for line, figures in compare(task):
            lines.append(line)
            found[task.name, line[1]] = figures
    name = TASKS[1].name
    n_rules, errors, seconds = found[name, "as it comes"]
    rows = [
        Row(
            f"{name}, defaults, worst of {len(errors)} seeds",
            [
                Measure("error over the noise", float(errors.max()), "", 1.02),
                Measure("rules", int(n_rules.max()), "", 12),
                Measure("CPU", float(seconds.max()), "s", 5.0),
            ],
        )
    ]
    for partition in ('partition="subtractive"', 'partition="fcm"'):
        worst = float(found[name, partition][1].max())
        rows.append(
            Row(
                f"{name}, {partition}, worst of {len(errors)} seeds",
                [Measure("error over the noise", worst, "", 1.05)],
            )
        )
    head = [
        "problem",
        "partition",
        "seeds",
        "rules",
        "error over the noise",
        "worst",
        "fit, CPU [s]",
    ]
    return Results(rows, [Table("Partitions, medians of the seeds", head, lines)])
