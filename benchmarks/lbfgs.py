r"""Full-batch quasi-Newton descent on premises and consequents together, without elimination.

SciPy's L-BFGS-B minimises the joint cost

    E(x, beta) = 1/2 [ |y - Phi(x) beta|_S^2 / W + beta' P beta + stiffness |x|^2 ]

over the premises' displacements x in their box and all consequents beta, in each rule's own basis
(see ``consequent``), where they are of one size. They start as the solution of least squares.

One evaluation is one pass that forms no square matrix (``SeparableProblem.joint``); only the start
forms one and factorises it. A pass so costs a fraction of one of ``varpro``, but there are ten to a
hundred times as many: E is a curved valley along which premises and consequents move together, and
descent sees one of its walls at a time.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from skanfis.learning import LeastSquares, Solver, SolverResult
from skanfis.learning.objective import Evaluation

__all__ = ["LBFGS"]

# Steps that the quasi-Newton matrix remembers. On Jang's problems and a gyro-like surface, 1,000
# iterations with 40 got further than 2,000 with SciPy's 10.
_MEMORY = 40
# The cost falls by fits and starts: only what so many iterations change together counts.
_WINDOW = 10
# Gradients below this part of tol times the cost are zero, as in ``varpro``.
_GRADIENT_FACTOR = 1e-2


@dataclass(frozen=True, eq=False)
class _Point:
    """The cost at one vector of displacements and local coefficients."""

    variables: np.ndarray
    evaluation: Evaluation
    cost: float
    gradient: np.ndarray


class _JointCost:
    """E over one vector: displacements first, then local coefficients."""

    def __init__(self, problem, premise, stiffness):
        self.problem, self.premise, self.stiffness = problem, premise, stiffness
        free = np.full(problem.n_columns * problem.n_outputs, np.inf)
        self.lower = np.concatenate([premise.lower, -free])
        self.upper = np.concatenate([premise.upper, free])
        self._latest = None

    def start(self, x):
        """Variables at these displacements, consequents solved for."""
        coefficients = self.problem.evaluate(self.premise.parameters(x)).coefficients
        return np.concatenate([x, self.problem.local.to_local(coefficients).ravel()])

    def at(self, variables):
        """The point at these variables; that asked for last is at hand."""
        if self._latest is None or not np.array_equal(self._latest.variables, variables):
            self._latest = self._evaluated(variables.copy())
        return self._latest

    def _evaluated(self, variables):
        x, local = np.split(variables, [self.premise.size])
        coefficients = local.reshape(self.problem.n_columns, self.problem.n_outputs)
        coefficients = self.problem.local.to_global(coefficients)
        joint = self.problem.joint(self.premise.parameters(x), coefficients)
        by_x, _ = self.premise.pull_back(x, joint.premises, np.eye(x.size))
        by_local = self.problem.local.transform_rows(joint.coefficients)
        cost = joint.evaluation.cost + 0.5 * self.stiffness * (x @ x)
        gradient = np.concatenate([by_x + self.stiffness * x, by_local.ravel()])
        return _Point(variables, joint.evaluation, cost, gradient)


class _Progress:
    """What follows every iteration: the loss curve, the caller's function, the end."""

    def __init__(self, cost_of, first, tol, on_iteration):
        self.cost_of, self.tol, self.on_iteration = cost_of, tol, on_iteration
        self.point, self.loss_curve = first, [first.evaluation.mean_squared_error]
        self._costs = deque([first.cost], maxlen=_WINDOW + 1)
        self._is_stopped = False

    @property
    def n_iter(self):
        return len(self.loss_curve) - 1

    def status(self):
        """Why this is the end; None if it is not."""
        if self._is_stopped:
            return "stopped"
        variables, gradient = self.point.variables, self.point.gradient
        inside = np.clip(variables - gradient, self.cost_of.lower, self.cost_of.upper)
        if np.abs(variables - inside).max() <= _GRADIENT_FACTOR * self.tol * self.point.cost:
            return "gradient"
        decrease = self._costs[0] - self._costs[-1]
        if len(self._costs) > _WINDOW and decrease <= self.tol * self.point.cost:
            return "cost"
        return None

    def follow(self, variables):
        """Take note of an iteration; SciPy ends on StopIteration."""
        self.point = self.cost_of.at(variables)
        self.loss_curve.append(self.point.evaluation.mean_squared_error)
        self._costs.append(self.point.cost)
        if self.on_iteration is not None:
            self._is_stopped = bool(self.on_iteration(self.n_iter, self.point.evaluation))
        if self.status() is not None:
            raise StopIteration


class LBFGS(Solver):
    """L-BFGS-B on the joint cost over premises and consequents.

    Parameters
    ----------
    tol : float, default=1e-3
        Stop when the relative decrease of the cost over ten iterations is below ``tol``.
    stiffness : "auto" or float, default="auto"
    """

    def __init__(self, *, tol=1e-3, stiffness="auto"):
        self.tol = tol
        self.stiffness = stiffness

    def solve(self, problem, premise, *, max_iter, stiffness=0.0, start=None, on_iteration=None):
        if not premise.size:
            return LeastSquares().solve(problem, premise, max_iter=1, on_iteration=on_iteration)
        return _minimised(problem, premise, max_iter, self.tol, stiffness, start, on_iteration)


def _minimised(problem, premise, max_iter, tol, stiffness, start, on_iteration):
    cost_of = _JointCost(problem, premise, stiffness)
    first = cost_of.at(cost_of.start(np.zeros(premise.size) if start is None else start))
    progress = _Progress(cost_of, first, tol, on_iteration)
    status = progress.status()
    if status is None:
        _minimise(cost_of, progress, max_iter)
        at_the_end = "max_iter" if progress.n_iter == max_iter else "step"
        status = progress.status() or at_the_end
    return SolverResult(
        progress.point.evaluation, np.array(progress.loss_curve), progress.n_iter, status
    )


def _minimise(cost_of, progress, max_iter):
    """Run SciPy's minimiser with none of its own tolerances, which are not relative to the cost."""

    def cost_and_gradient(variables):
        point = cost_of.at(variables)
        return point.cost, point.gradient

    optimize.minimize(
        cost_and_gradient,
        progress.point.variables,
        jac=True,
        method="L-BFGS-B",
        bounds=optimize.Bounds(cost_of.lower, cost_of.upper),
        callback=progress.follow,
        options={
            "maxiter": max_iter,
            "maxfun": np.inf,
            "maxcor": _MEMORY,
            "ftol": 0.0,
            "gtol": 0.0,
        },
    )
