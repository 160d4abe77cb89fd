r"""Jang's hybrid rule: least squares for the consequents, steepest descent for the premises.

An epoch (Jang 1993, section III) takes one step of the premises' natural parameters n (center c,
width a or sigma, and slope b of a membership) down the gradient of the cost at the consequents
that least squares gives, and solves for these again. The step's length is given,

    n -> n - kappa g / |g| ,    g = dF / dn ,

and follows the error: kappa grows by 10 % where the error has fallen four times in a row, and
shrinks by 10 % where it has twice risen and fallen, up, down, up, down. Neither counts a change
of the error again that has once changed kappa in the same way. Centers and widths are in standard
deviations of their input, so that a fit does not depend on units; Jang's were in the data's units.

His rule has no bounds: a step can make a width negative, and nothing keeps terms apart. Here a step
that would leave the premises' box ends on its edge, displacement by displacement; inside the box
the rule is his to the letter.

By the envelope theorem the gradient at solved consequents is that of the joint cost, which a pass
without square matrices gives (``SeparableProblem.joint``): an epoch is that pass and one solve.
"""

from collections import deque
from dataclasses import dataclass
from numbers import Real
from typing import ClassVar

import numpy as np

from .._sklearn import Interval, StrOptions
from .lse import lse
from .objective import Evaluation
from .solver import Solver
from .solver_result import SolverResult

__all__ = ["DescentSolver", "Hybrid", "NaturalPremise", "Point", "StepSize", "View", "descend"]

_RISE, _FALL = 1.0, -1.0
# His own numbers (1993, section III): by 10 %, after four decreases, or two rises and falls.
_GROWTH, _SHRINKAGE = 1.1, 0.9
_GROW_AFTER = [_FALL, _FALL, _FALL, _FALL]
_SHRINK_AFTER = [_RISE, _FALL, _RISE, _FALL]
# Gradients below this part of tol times the cost are zero, as in ``varpro``.
_GRADIENT_FACTOR = 1e-2


class StepSize:
    """The length of a step, by the course of the error."""

    def __init__(self, size, error):
        self.size = size
        self._error = error
        self._course: deque[float] = deque(maxlen=len(_GROW_AFTER))
        self._since_growth = self._since_shrinkage = 0

    def follow(self, error):
        """Take the next error into account."""
        self._course.append(float(np.sign(error - self._error)))
        self._error = error
        self._since_growth += 1
        self._since_shrinkage += 1
        course = list(self._course)
        if course == _SHRINK_AFTER and self._since_shrinkage >= len(course):
            self.size *= _SHRINKAGE
            self._since_shrinkage = 0
        elif course == _GROW_AFTER and self._since_growth >= len(course):
            self.size *= _GROWTH
            self._since_growth = 0


class NaturalPremise:
    """A premise whose parameters are the numbers that a paper writes: no logarithms.

    Displacements and natural parameters n are one to one: a step is taken in n.
    """

    def __init__(self, premise):
        self.premise = premise
        kinds = [
            np.repeat([p.kind for p in group.family.parameters], group.n_terms)
            for group in premise.antecedent.groups
        ]
        self._is_log = np.concatenate(kinds) != "location"

    def _natural(self, x):
        """n."""
        parameters = self.premise.parameters(x)
        return np.where(self._is_log, np.exp(parameters * self._is_log), parameters)

    def _by_parameters(self, x):
        """The derivatives of n by the antecedent's parameters, each by its own alone."""
        return np.where(self._is_log, self._natural(x), 1.0)

    def _jacobian(self, x):
        """dn / dx."""
        identity = np.eye(x.size)
        transposed, _ = self.premise.pull_back(x, identity, identity)
        return self._by_parameters(x)[:, None] * transposed.T

    def slope(self, x, by_parameters, stiffness):
        """Gradient of F + stiffness/2 |x|^2 by n, out of dF / d parameters.

        Also the largest entry of the gradient by x, projected on the box.
        """
        jacobian = self._jacobian(x)
        gradient = by_parameters / self._by_parameters(x)
        by_displacement = jacobian.T @ gradient + stiffness * x
        gradient += np.linalg.solve(jacobian.T, stiffness * x)
        inside = np.clip(x - by_displacement, self.premise.lower, self.premise.upper)
        return gradient, np.abs(x - inside).max()

    def move(self, x, step):
        """The displacement at n + ``step``, or on the edge where that is out of the box."""
        # What would not be positive, a width or the distance of two terms, goes to its lower bound.
        natural = self._natural(x) + step
        logs = np.log(np.where(self._is_log, np.maximum(natural, np.finfo(float).tiny), 1.0))
        moved = self.premise.displacement(np.where(self._is_log, logs, natural))
        return np.clip(moved, self.premise.lower, self.premise.upper)


@dataclass(frozen=True, eq=False)
class Point:
    """Where a descent is."""

    x: np.ndarray  # displacements of the premises
    evaluation: Evaluation
    cost: float  # with the pull of the stiffness


class View:
    """A problem as a descent sees it: where it starts, the slope there, and where a step leads.

    ``start(x)`` gives a :class:`Point`; ``slope(point)`` the gradient in the descent's variables,
    and the largest entry of that projected on the box; ``step(point, step)`` the next point.
    """

    def __init__(self, problem, premise, stiffness):
        self.problem, self.premise, self.stiffness = problem, premise, stiffness
        self.natural = NaturalPremise(premise)


class _SolvedConsequents(View):
    """Premises move, consequents are solved for."""

    def start(self, x):
        return self._at(x, None)

    def _at(self, x, reference):
        evaluation = self.problem.evaluate(self.premise.parameters(x), reference)
        return Point(x, evaluation, evaluation.cost + 0.5 * self.stiffness * (x @ x))

    def slope(self, point):
        evaluation = point.evaluation
        parameters = evaluation.antecedent.parameters
        by_parameters = self.problem.joint(parameters, evaluation.coefficients).premises
        return self.natural.slope(point.x, by_parameters, self.stiffness)

    def step(self, point, step):
        return self._at(self.natural.move(point.x, step), point.evaluation.coefficients)


def descend(view, x, *, max_iter, tol, on_iteration, step_size, error_goal):
    """Take steps of Jang's length down the slope that a :class:`View` gives.

    There is no other end than ``max_iter``, ``error_goal`` and a projected gradient of zero;
    without the last the error may rise and fall for ever. The result is the epoch of the lowest
    cost.
    """
    point = best = view.start(x)
    length = StepSize(step_size, point.cost)
    loss_curve, n_iter = [point.evaluation.mean_squared_error], 0
    while True:
        if error_goal is not None and _rms_error(point) <= error_goal:
            best, status = point, "error_goal"
            break
        if n_iter == max_iter:
            status = "epochs" if error_goal is None else "max_iter"
            break
        slope, steepest = view.slope(point)
        if steepest <= _GRADIENT_FACTOR * tol * point.cost:
            status = "gradient"
            break
        point, n_iter = view.step(point, -length.size / np.linalg.norm(slope) * slope), n_iter + 1
        length.follow(point.cost)
        best = point if point.cost < best.cost else best
        loss_curve.append(point.evaluation.mean_squared_error)
        if on_iteration is not None and on_iteration(n_iter, point.evaluation):
            status = "stopped"
            break
    return SolverResult(best.evaluation, np.array(loss_curve), n_iter, status)


def _rms_error(point):
    n_outputs = point.evaluation.coefficients.shape[1]
    return np.sqrt(point.evaluation.mean_squared_error / n_outputs)


class DescentSolver(Solver):
    """A solver whose epochs are steps of steepest descent, with its settings."""

    _view: ClassVar[type[View]]

    _parameter_constraints: ClassVar[dict] = {
        "step_size": [Interval(Real, 0, None, closed="neither")],
        "error_goal": [Interval(Real, 0, None, closed="left"), None],
        "tol": [Interval(Real, 0, None, closed="left")],
        "stiffness": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
    }

    def __init__(
        self,
        *,
        step_size: float = 0.01,
        error_goal: float | None = None,
        tol: float = 1e-3,
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
            return lse(problem, premise, on_iteration=on_iteration)
        return descend(
            self._view(problem, premise, stiffness),
            np.zeros(premise.size) if start is None else start,
            max_iter=max_iter,
            tol=self.tol,
            on_iteration=on_iteration,
            step_size=self.step_size,
            error_goal=self.error_goal,
        )


class Hybrid(DescentSolver):
    """Jang's hybrid rule: least squares for the consequents, steepest descent for the premises.

    Parameters
    ----------
    step_size : float, default=0.01
        Length of the first step, in standard deviations of the inputs and units of the slope;
        positive.
    error_goal : float, default=None
        Stop at this root mean square error, in standard deviations of the target; zero or positive.
        None: all ``max_iter`` epochs are run.
    tol : float, default=1e-3
        Stop where the projected gradient is zero for all that ``tol`` can tell. Zero or positive.
    stiffness : "auto" or float, default="auto"
        Pull of the premises to their start, zero or positive; see
        :class:`~skanfis.learning.VariableProjection`.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``solver``.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.

    Examples
    --------
    >>> from sklearn.model_selection import GridSearchCV
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import Hybrid
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2, solver=Hybrid(), max_iter=20, out_of_bounds="clip")
    >>> search = GridSearchCV(model, {"solver__step_size": [0.001, 0.1]}, cv=2).fit(X, y)
    >>> search.best_params_
    {'solver__step_size': 0.1}
    """

    _view = _SolvedConsequents
