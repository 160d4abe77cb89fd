r"""Steepest descent, Jang's way: his hybrid rule, and plain back-propagation.

**Hybrid.** An epoch (Jang 1993, section III) moves the premises' natural parameters n (center c,
width a or sigma, slope b of a membership) one step down the gradient of the cost at the
least-squares consequents, and solves for these again. The length kappa of the step is given,

    n -> n - kappa g / |g| ,    g = dF / dn ,

and adapts to the course of the error (``StepSize``). Centers and widths are in standard deviations
of their input, so that a fit does not depend on units. Jang's rule has no bounds: a step can make a
width negative. Here each displacement that would leave the premises' box ends on its edge. By the
envelope theorem the gradient at solved consequents is that of the joint cost, which a pass without
square matrices gives (``SeparableProblem.joint``).

**Gradient.** Premises and consequents beta on [1, z] take one such step together, down the gradient
(dE / dn, dE / dbeta) of the cost E at these consequents (Liu et al. 2009). The consequents start as
the least-squares solution and are never solved for again (the second of the four methods in Jang
1993).
"""

from collections import deque
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from .._sklearn import Interval
from .objective import Evaluation
from .solver import LeastSquares, Solver, SolverResult
from .varpro import GRADIENT_FACTOR, TOLERANCE, VariableProjection

_RISE, _FALL = 1.0, -1.0
# Jang's numbers (1993, section III): 10 % more after four falls, 10 % less after two rises and
# falls in turn.
_CHANGES = [([_FALL, _FALL, _FALL, _FALL], 1.1), ([_RISE, _FALL, _RISE, _FALL], 0.9)]


class StepSize:
    """The length of a step, which adapts to the course of the error."""

    def __init__(self, size, error):
        self.size = size
        self._error = error
        # A course for each change of the length, which starts afresh after that change.
        self._courses: list[deque] = [deque(maxlen=len(course)) for course, _ in _CHANGES]

    def follow(self, error):
        """Take the next error into account."""
        change, self._error = np.sign(error - self._error), error
        for seen, (course, factor) in zip(self._courses, _CHANGES, strict=True):
            seen.append(change)
            if list(seen) == course:
                self.size *= factor
                seen.clear()


class NaturalPremise:
    """A premise in natural parameters n, those of the papers, without logarithms.

    Displacements and natural parameters map one to one, and steps are taken in n.
    """

    def __init__(self, premise):
        self.premise = premise
        kinds = [
            np.repeat([p.kind for p in group.family.parameters], group.n_terms)
            for group in premise.antecedent.groups
        ]
        # Of tied parameters, the first stands for all.
        self._tied = premise.antecedent.tied
        self._first = np.unique(self._tied, return_index=True)[1]
        self._is_log = (np.concatenate(kinds) != "location")[self._first]

    def _natural(self, x):
        """The natural parameters n at a displacement."""
        parameters = self.premise.parameters(x)[self._first]
        return np.where(self._is_log, np.exp(parameters * self._is_log), parameters)

    def slope(self, x, by_parameters, stiffness):
        """Gradient of F + stiffness/2 |x|^2 by n, from dF / d parameters.

        Also the largest entry of the gradient by x, projected on the box.
        """
        # Derivative of each n by its own parameter of the antecedent.
        natural = np.where(self._is_log, self._natural(x), 1.0)
        jacobian = natural[:, None] * self.premise.jacobian(x)[self._first]  # dn / dx
        gradient = np.bincount(self._tied, by_parameters) / natural
        by_displacement = jacobian.T @ gradient + stiffness * x
        gradient += np.linalg.solve(jacobian.T, stiffness * x)
        inside = np.clip(x - by_displacement, self.premise.lower, self.premise.upper)
        return gradient, np.abs(x - inside).max()

    def move(self, x, step):
        """The displacement at n + ``step``, on the edge of the box where that lies outside."""
        # A width, or distance of two terms, that would not be positive goes to its lower bound.
        natural = self._natural(x) + step
        logs = np.log(np.where(self._is_log, np.maximum(natural, np.finfo(float).tiny), 1.0))
        moved = self.premise.displacement(np.where(self._is_log, logs, natural)[self._tied])
        return np.clip(moved, self.premise.lower, self.premise.upper)


@dataclass(frozen=True, eq=False)
class _Point:
    """Where a descent is: displacements x, and the evaluation there."""

    x: np.ndarray
    evaluation: Evaluation
    cost: float  # with that of the stiffness
    by_parameters: np.ndarray  # gradient of the evaluation's cost by the antecedent's parameters
    by_coefficients: np.ndarray  # and by the consequents; empty if these do not take steps


class _Descent(Solver):
    """A solver whose epochs are steps of steepest descent, with its settings.

    It ends at ``max_iter``, at ``error_goal``, or where the projected gradient is zero; the error
    may rise and fall for ever. The result is the epoch of least cost.

    ``_evaluated`` gives the evaluation at some parameters, and the two gradients of a ``_Point``.
    """

    _evaluated: ClassVar[Any]
    _parameter_constraints: ClassVar[dict] = VariableProjection._parameter_constraints | {
        "step_size": [Interval(Real, 0, None, closed="neither")],
        "error_goal": [Interval(Real, 0, None, closed="left"), None],
    }

    def __init__(
        self,
        *,
        step_size: float = 0.01,
        error_goal: float | None = None,
        tol: float = TOLERANCE,
        stiffness: str | float = "auto",
    ) -> None:
        self.step_size = step_size
        self.error_goal = error_goal
        self.tol = tol
        self.stiffness = stiffness

    def solve(
        self, problem, premise, *, max_iter, stiffness=0.0, start=None, on_iteration=None
    ) -> SolverResult:
        if not premise.size:
            return LeastSquares().solve(problem, premise, max_iter=1, on_iteration=on_iteration)
        natural = NaturalPremise(premise)
        x = np.zeros(premise.size) if start is None else start
        first = problem.evaluate(premise.parameters(x)).coefficients
        point = best = self._at(problem, premise, stiffness, x, first)
        length = StepSize(self.step_size, point.cost)
        loss_curve, n_iter = [point.evaluation.mean_squared_error], 0
        while True:
            rms_error = np.sqrt(point.evaluation.mean_squared_error / problem.n_outputs)
            if self.error_goal is not None and rms_error <= self.error_goal:
                best, status = point, "error_goal"
                break
            if n_iter == max_iter:
                status = "epochs" if self.error_goal is None else "max_iter"
                break
            slope, steepest = natural.slope(point.x, point.by_parameters, stiffness)
            steepest = max(steepest, np.abs(point.by_coefficients).max(initial=0.0))
            if steepest <= GRADIENT_FACTOR * self.tol * point.cost:
                status = "gradient"
                break
            whole = np.concatenate([slope, point.by_coefficients])
            step = -length.size / np.linalg.norm(whole) * whole
            coefficients = point.evaluation.coefficients.copy()
            coefficients.ravel()[: point.by_coefficients.size] += step[point.x.size :]
            x = natural.move(point.x, step[: point.x.size])
            point, n_iter = self._at(problem, premise, stiffness, x, coefficients), n_iter + 1
            length.follow(point.cost)
            best = point if point.cost < best.cost else best
            loss_curve.append(point.evaluation.mean_squared_error)
            if on_iteration is not None and on_iteration(n_iter, point.evaluation):
                status = "stopped"
                break
        return SolverResult(best.evaluation, np.array(loss_curve), n_iter, status)

    def _at(self, problem, premise, stiffness, x, coefficients):
        evaluation, *slopes = self._evaluated(problem, premise.parameters(x), coefficients)
        return _Point(x, evaluation, evaluation.cost + 0.5 * stiffness * (x @ x), *slopes)


class Hybrid(_Descent):
    """Jang's hybrid rule: least squares for the consequents, steepest descent for the premises.

    Parameters
    ----------
    step_size : float, default=0.01
        Length of the first step, in standard deviations of the inputs and units of the slope;
        positive.
    error_goal : float, default=None
        Stop at this root mean square error, in standard deviations of the target; zero or positive.
        None: ``max_iter`` epochs are run, unless ``tol`` ends the training.
    tol : float, default=1e-3
        Stop where the projected gradient is zero as far as ``tol`` can tell. Zero or positive.
    stiffness : "auto" or float, default="auto"
        Pull of the premises to their start, zero or positive; see
        :class:`~skanfis.learning.VariableProjection`.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import Hybrid
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2, solver=Hybrid(step_size=0.1), max_iter=20).fit(X, y)
    >>> model.n_iter_
    20
    """

    @staticmethod
    def _evaluated(problem, parameters, coefficients):
        evaluation = problem.evaluate(parameters, coefficients)
        return evaluation, problem.joint(parameters, evaluation.coefficients)[1], np.empty(0)


class GradientDescent(_Descent):
    """Back-propagation: steepest descent on premises and consequents together.

    It is slow, because no single length of step suits all parameters. It is here for comparison
    with its successors.

    Parameters
    ----------
    step_size : float, default=0.01
        Length of the first step, in standardised units; positive.
    error_goal, tol, stiffness
        As for :class:`~skanfis.learning.Hybrid`.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import GradientDescent
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2, solver=GradientDescent(), max_iter=20).fit(X, y)
    >>> model.n_iter_
    20
    """

    @staticmethod
    def _evaluated(problem, parameters, coefficients):
        evaluation, by_parameters, by_coefficients = problem.joint(parameters, coefficients)
        return evaluation, by_parameters, by_coefficients.ravel()
