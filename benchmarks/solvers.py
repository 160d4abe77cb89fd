"""Every solver on Jang's three problems and the gyro-like surface, and how fast each gets there.

All descend one cost: that of the terms that ``n_mfs`` asks for, with the weights of the penalty
that a default fit finds, so that passes and time are those of the descent alone. A pass is one
reading of all rows, beside the first, which comes with the problem; what a solver does with it
differs. The cost to get to is the least that Jang's rule meets in 500 epochs, at the best of
several sizes of its first step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from unittest.mock import patch

import numpy as np

from skanfis import ANFISRegressor
from skanfis.consequent import basis, rule_outputs
from skanfis.learning import GradientDescent, Hybrid, LeastSquares, Solver, VariableProjection
from skanfis.learning.objective import SeparableProblem

from .gyro import SIGMA, make_surface, score
from .jang import PROBLEMS
from .report import Measure, Results, Row, Table
from .timing import side_by_side

__all__ = ["run"]

_EPOCHS = 500
_STEP_SIZES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
# Name, solver and most iterations.
_SOLVERS = [
    ("varpro", VariableProjection(), _EPOCHS),
    ("varpro, tol=1e-6", VariableProjection(tol=1e-6), _EPOCHS),
    ("lse", LeastSquares(), 1),
]
_ROUNDS = 2


class Recorder(Solver):
    """Keeps what the estimator first asks of its solver, and passes it on."""

    def solve(self, problem, premise, *, stiffness=0.0, **settings):
        if not hasattr(self, "asked_"):
            self.asked_ = problem, premise, stiffness
        return VariableProjection().solve(problem, premise, stiffness=stiffness, **settings)


@dataclass(frozen=True)
class Descent:
    """One solver's way down one cost."""

    solver: Solver
    max_iter: int
    problem: SeparableProblem
    premise: object
    stiffness: float

    def __call__(self, max_iter=None, on_iteration=None):
        return self.solver.solve(
            self.problem,
            self.premise,
            max_iter=self.max_iter if max_iter is None else max_iter,
            stiffness=self.stiffness,
            on_iteration=on_iteration,
        )

    def costs(self):
        """The result, and the cost after every iteration, stiffness included."""
        costs = []

        def watch(n_iter, evaluation):
            moved = self.premise.displacement(evaluation.antecedent.parameters)
            costs.append(evaluation.cost + 0.5 * self.stiffness * (moved @ moved))
            return False

        return self(on_iteration=watch), np.array(costs)


@dataclass(frozen=True)
class Task:
    """A problem with the terms given, whether there is a bar, and how its errors are measured."""

    name: str
    has_bar: bool
    parameters: dict
    X: np.ndarray
    y: np.ndarray
    errors: Callable

    def cost(self):
        """The problem, the premise and the stiffness that a default fit finds."""
        solver = Recorder()
        ANFISRegressor(**self.parameters, solver=solver).fit(self.X, self.y)
        return solver.asked_


def tasks():
    for problem in PROBLEMS:
        parameters = {"n_mfs": problem.n_mfs, "mf": problem.mf}
        yield Task(problem.name, True, parameters, *problem.train, problem.errors)
    X, y, X_test, truth = make_surface(seed=0)

    def errors(model):
        rms = np.sqrt(np.mean((model.predict(X) - y) ** 2))
        return float(rms / SIGMA), score(model.predict(X_test), X, X_test, truth)[0]

    yield Task("gyro-like, 27 rules", False, {"n_mfs": 3}, X, y, errors)


@dataclass(frozen=True)
class Found:
    """Predicts by what a solver has found, in the user's units."""

    problem: SeparableProblem
    evaluation: object

    def predict(self, X):
        problem, evaluation = self.problem, self.evaluation
        inputs, targets = problem.rows.inputs, problem.rows.targets
        Z = ((X - inputs.offset) / inputs.scale).T
        by_rule = evaluation.coefficients[:, 0].reshape(-1, problem.n_basis)
        strengths = evaluation.antecedent.strengths(Z)
        output = rule_outputs(by_rule, strengths, basis(Z[problem.consequent_inputs]))[1]
        return targets.offset + targets.scale * output


def count_passes(function):
    """How often a function reads all rows, and what it returned."""
    n_passes = 0
    one_pass = SeparableProblem._sum

    def counted(*args):
        nonlocal n_passes
        n_passes += 1
        return one_pass(*args)

    with patch.object(SeparableProblem, "_sum", counted):
        returned = function()
    return n_passes, returned


def with_best_step(solver, asked):
    """A descent by a solver, its first step being the best of several."""
    every = [Descent(solver(step_size=size), _EPOCHS, *asked) for size in _STEP_SIZES]
    return min(every, key=lambda descent: descent.costs()[1].min())


def compare(task):
    """Lines of the table; passes and time to the common cost, by solver."""
    asked = task.cost()
    descents = {name: Descent(solver, most, *asked) for name, solver, most in _SOLVERS}
    for name, solver in (("hybrid", Hybrid), ("gradient", GradientDescent)):
        descents[name] = with_best_step(solver, asked)
    counted = {name: count_passes(descent.costs) for name, descent in descents.items()}
    goal = counted["hybrid"][1][1].min()
    short = {}
    for name, (_, (_, costs)) in counted.items():
        if costs.min() <= goal:
            short[name] = partial(descents[name], 1 + int(np.argmax(costs <= goal)))
    seconds, to_goal = side_by_side(descents, 1), side_by_side(short, _ROUNDS)
    reached = {name: (count_passes(run)[0], to_goal[name]) for name, run in short.items()}
    lines = []
    for name, (n_passes, (result, costs)) in counted.items():
        step = getattr(descents[name].solver, "step_size", None)
        label = name if step is None else f"{name}, step_size={step:g}"
        errors = task.errors(Found(asked[0], result.evaluation))
        cells = [float(costs.min()), *errors, result.n_iter, n_passes, seconds[name]]
        lines.append([task.name, label, *cells, *reached.get(name, ("never", ""))])
    return lines, reached


def run(options):
    lines, rows = [], []
    for task in tasks():
        own, reached = compare(task)
        lines += own
        if task.has_bar and "varpro" in reached:
            (passes, seconds), (few, short) = reached["hybrid"], reached["varpro"]
            work = f"varpro to the least cost of {_EPOCHS} epochs of Jang's rule: {task.name}"
            measures = [
                Measure("passes", few / passes, "x", 0.1),
                Measure("CPU", short / seconds, "x", 0.2),
            ]
            rows.append(Row(work, measures))
    head = ["problem", "solver", "cost", "error, train", "error, check", "iterations", "passes"]
    head += ["CPU [s]", "passes to Jang's best", "CPU [s]"]
    title = (
        "Solvers on one cost; errors of what they find: RMSE, average percentage error "
        "(three-input), RMSE over the noise (gyro-like)"
    )
    return Results(rows, [Table(title, head, lines)])
