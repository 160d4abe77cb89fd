"""Every solver on Jang's three problems and the gyro-like surface, and how fast each gets there.

A pass is one reading of all rows; what a solver does with it differs. The error to get to is the
least training error that Jang's rule meets in 500 epochs, at the best of several sizes of its first
step; what it returns is the epoch of the least cost, ridge included, which may be another.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from unittest.mock import patch

import numpy as np

from skanfis import ANFISRegressor
from skanfis.objective import SeparableProblem
from skanfis.solvers import GradientDescent, Hybrid, VariableProjection

from .gyro import SIGMA, make_surface, score
from .jang import PROBLEMS
from .lbfgs import LBFGS
from .report import Measure, Results, Row, Table
from .timing import side_by_side

__all__ = ["run"]

_EPOCHS = 500
_STEP_SIZES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
_SETTINGS = {
    "varpro": {},
    "varpro, tol=1e-6": {"solver": VariableProjection(tol=1e-6)},
    "lbfgs": {"solver": LBFGS()},
    "lbfgs, tol=1e-6": {"solver": LBFGS(tol=1e-6), "max_iter": 5000},
    "lse": {"solver": "lse"},
}
_ROUNDS = 3


@dataclass(frozen=True)
class Task:
    """A problem with the terms given, whether there is a bar, and how its errors are measured."""

    name: str
    has_bar: bool
    parameters: dict
    X: np.ndarray
    y: np.ndarray
    errors: Callable

    def fit(self, settings):
        return ANFISRegressor(**self.parameters, **settings).fit(self.X, self.y)


def tasks():
    for problem in PROBLEMS:
        parameters = {"n_mfs": problem.n_mfs, "mf": problem.mf}
        yield Task(problem.name, True, parameters, *problem.train, problem.errors)
    X, y, X_test, truth = make_surface(seed=0)

    def errors(model):
        rms = np.sqrt(np.mean((model.predict(X) - y) ** 2))
        return float(rms / SIGMA), score(model.predict(X_test), X, X_test, truth)[0]

    yield Task("gyro-like, 27 rules", False, {"n_mfs": 3}, X, y, errors)


def count_passes(function):
    """How often a function's trainings read all rows, and what it returned."""
    n_passes = 0
    one_pass = SeparableProblem._sum

    def counted(*args):
        nonlocal n_passes
        n_passes += 1
        return one_pass(*args)

    with patch.object(SeparableProblem, "_sum", counted):
        returned = function()
    return n_passes, returned


def best_step(task, solver):
    """The settings of a descent, its first step being the best of several."""
    every = [{"solver": solver(step_size=size), "max_iter": _EPOCHS} for size in _STEP_SIZES]
    losses = [task.fit(settings).loss_curve_.min() for settings in every]
    return every[int(np.argmin(losses))]


def until(settings, model, loss):
    """The settings that end as soon as ``loss`` is reached; None if it never was."""
    reached = np.flatnonzero(model.loss_curve_ <= loss)
    if not reached.size:
        return None
    # With no iteration at all, premises stay as they start: least squares alone.
    return {**settings, "max_iter": int(reached[0])}


def compare(task):
    """Lines of the table; passes and time to the common error, by solver."""
    settings = dict(_SETTINGS)
    for name, solver in (("hybrid", Hybrid), ("gradient", GradientDescent)):
        settings[name] = best_step(task, solver)
    runs = {name: partial(task.fit, given) for name, given in settings.items()}
    counted = {name: count_passes(fit) for name, fit in runs.items()}
    goal = counted["hybrid"][1].loss_curve_.min()
    to_goal = {name: until(settings[name], model, goal) for name, (_, model) in counted.items()}
    short = {name: partial(task.fit, given) for name, given in to_goal.items() if given}
    seconds, seconds_to_goal = side_by_side(runs, _ROUNDS), side_by_side(short, _ROUNDS)
    reached = {name: (count_passes(fit)[0], seconds_to_goal[name]) for name, fit in short.items()}
    lines = []
    for name, (n_passes, model) in counted.items():
        step = getattr(settings[name].get("solver"), "step_size", None)
        label = name if step is None else f"{name}, step_size={step:g}"
        cells = [*task.errors(model), model.n_iter_, n_passes, seconds[name]]
        lines.append([task.name, label, *cells, *reached.get(name, ("never", ""))])
    return lines, reached


def run(options):
    lines, rows = [], []
    for task in tasks():
        own, reached = compare(task)
        lines += own
        if task.has_bar:
            (passes, seconds), (few, short) = reached["hybrid"], reached["varpro"]
            work = (
                f"varpro to the best of {_EPOCHS} epochs of Jang's rule, of its cost: {task.name}"
            )
            measures = [
                Measure("passes", few / passes, "x", 0.1),
                Measure("CPU", short / seconds, "x", 0.2),
            ]
            rows.append(Row(work, measures))
    head = ["problem", "solver", "error, train", "error, check", "iterations", "passes", "CPU [s]"]
    head += ["passes to Jang's best", "CPU [s]"]
    title = (
        "Solvers; errors of what fit returns: RMSE, average percentage error (three-input), RMSE "
        "over the noise (gyro-like)"
    )
    return Results(rows, [Table(title, head, lines)])
