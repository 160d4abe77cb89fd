r"""Variable projection: trust-region Gauss-Newton steps on the reduced problem, within a box.

Let g and H be the gradient and Gauss-Newton matrix of the reduced cost by the premises'
displacements x. A step s of the displacements that are free to move minimises g's + s'Hs / 2 over
|s| <= radius, exactly, from the eigenvalues of H. Displacements that would then leave the box end
on its edge. The radius follows Nocedal and Wright (2006, algorithm 4.1). docs/mathematics.rst has
the details. It says why a little is added to the curvature: so two fits to the same data in other
units take the same path (tests/test_invariance.py).

A rejected step costs one pass over the data, an accepted one two (see ``objective``).
"""

from numbers import Real
from typing import ClassVar

import numpy as np

from .._sklearn import Interval, StrOptions
from .ordered_terms import NEXT_TO_NOTHING
from .solver import Solver, SolverResult

# First and largest radius. Displacements are in spacings and logarithms: longer steps skip from one
# arrangement of the terms to another, and may end in bad minima.
_RADIUS = 1.0
# Steps up to the first factor longer than the radius are accepted: the radius itself is a guess.
# Steps longer than the second part of it, as after the box has cut them, count as on its edge.
_LENGTH_SLACK, _ON_EDGE = 1.01, 0.9
# Added to every curvature: this part of the largest, far above rounding errors and far below the
# curvature that data give; and this part of the cost, which a step of length one has to earn.
_SMALLEST_CURVATURE = 1e-6
_COST_PART = 0.1
# The cost is quadratic in the gradient: a gradient of tol^(1/2) would do; this is on the safe side.
GRADIENT_FACTOR = 1e-2
TOLERANCE = 1e-3


def trust_region_step(gradient, hessian, radius, damping):
    """Minimise g's + s'(H + damping I)s/2 over |s| <= radius, to 1 %, H not negative."""
    values, vectors = np.linalg.eigh(hessian)
    slope = vectors.T @ gradient
    size = np.linalg.norm(slope)
    if size == 0.0:
        return np.zeros_like(gradient)
    # A step is no shorter than |g| over the largest curvature, damping included. So at least this
    # damping is needed to keep it within the radius.
    values = np.maximum(values, 0.0)
    values += damping + _SMALLEST_CURVATURE * max(values[-1], np.finfo(float).tiny)
    values += max(size / radius - values[-1], 0.0)
    step = slope / values
    while (length := np.linalg.norm(step)) > _LENGTH_SLACK * radius:
        # Newton on 1 / |s(damping)| = 1 / radius, which converges from below without overshoot.
        values += (length / radius - 1.0) * length**2 / np.sum(step**2 / values)
        step = slope / values
    return -vectors @ step


def varpro(
    problem,
    premise,
    *,
    max_iter,
    tol,
    stiffness=0.0,
    start=None,
    on_iteration=None,
    patience=2,
    evaluation=None,
):
    """Minimise the reduced cost over the premises, as :meth:`Solver.solve` does.

    An iteration is an accepted step. The run ends when expected and actual relative decrease of the
    cost stay below ``tol`` for ``patience`` iterations: two in general, one if a sample of the rows
    has already settled. ``evaluation`` is that of the start, if it is known.
    """
    x = np.zeros(premise.size) if start is None else start
    current = problem.evaluate(premise.parameters(x)) if evaluation is None else evaluation
    cost = current.cost + 0.5 * stiffness * (x @ x)
    loss_curve = [current.mean_squared_error]
    status = "max_iter" if premise.size else "no_premise"
    radius, settled, n_iter = _RADIUS, 0, 0
    curvature = None
    while premise.size and n_iter < max_iter:
        raw = problem.linearise(current)
        gradient, curvature = premise.pull_back(x, raw.gradient, raw.gauss_newton)
        gradient = gradient + stiffness * x
        hessian = curvature + stiffness * np.eye(x.size)
        # Displacements that a step down the gradient leaves in the box.
        free = np.where(gradient > 0.0, x > premise.lower, x < premise.upper) | (gradient == 0.0)
        steepest = float(np.max(np.abs(gradient[free]), initial=0.0))
        if steepest <= GRADIENT_FACTOR * tol * cost:
            status = "gradient"
            break
        while True:
            step, own = np.zeros_like(x), hessian[np.ix_(free, free)]
            step[free] = trust_region_step(gradient[free], own, radius, _COST_PART * cost)
            # Clip the point, not the step: it then lies on the edge of the box to the last bit.
            trial_x = np.clip(x + step, premise.lower, premise.upper)
            step = trial_x - x
            length = float(np.linalg.norm(step))
            expected = -(gradient @ step + 0.5 * step @ hessian @ step)
            trial = problem.evaluate(premise.parameters(trial_x), current.coefficients)
            trial_cost = trial.cost + 0.5 * stiffness * (trial_x @ trial_x)
            ratio = (cost - trial_cost) / expected if expected > 0.0 else -np.inf
            accepted = ratio > 0.0
            if not ratio >= 0.25:  # also where the trial is not finite
                radius = 0.25 * min(radius, length)  # the length may be NaN
            elif ratio > 0.75 and length > _ON_EDGE * radius:
                radius = min(2.0 * radius, _RADIUS)
            # The decrease that a smaller step promises is lost in the rounding of the cost.
            if accepted or radius < NEXT_TO_NOTHING:
                break
        if not accepted:
            status = "step"
            break
        decrease = cost - trial_cost
        x, current, cost, n_iter = trial_x, trial, trial_cost, n_iter + 1
        loss_curve.append(current.mean_squared_error)
        if on_iteration is not None and on_iteration(n_iter, current):
            status = "stopped"
            break
        settled = settled + 1 if max(decrease, expected) <= tol * cost else 0
        if settled == patience:
            status = "cost"
            break
    return SolverResult(current, np.array(loss_curve), n_iter, status, curvature)


class VariableProjection(Solver):
    """Variable projection: trust-region Gauss-Newton steps on the premises alone.

    The default. The consequents are the solution of a linear least-squares problem at every step.

    Parameters
    ----------
    tol : float, default=1e-3
        Stop when the relative decrease of the cost, expected and found, stays below ``tol`` twice,
        or when the gradient implies that it would. Zero or positive.
    stiffness : "auto" or float, default="auto"
        Pull of the premises to their start, zero or positive: stiffness / 2 times the squared norm
        of their displacements (in spacings of terms and logarithms of widths) is added to the cost.
        "auto": found by the evidence.

    References
    ----------
    .. [1] G. H. Golub and V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least
       squares problems whose variables separate", SIAM Journal on Numerical Analysis 10 (1973)
       413-432.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import VariableProjection
    >>> X, y = make_jang_sinc()
    >>> default = ANFISRegressor(n_mfs=4).fit(X, y)
    >>> longer = ANFISRegressor(n_mfs=4, solver=VariableProjection(tol=1e-6)).fit(X, y)
    >>> longer.n_iter_ > default.n_iter_
    True
    """

    goes_on_from_tuning: ClassVar[bool] = True
    _parameter_constraints: ClassVar[dict] = {
        "tol": [Interval(Real, 0, None, closed="left")],
        "stiffness": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
    }

    def __init__(self, *, tol: float = TOLERANCE, stiffness: str | float = "auto") -> None:
        self.tol = tol
        self.stiffness = stiffness

    def solve(self, problem, premise, **settings) -> SolverResult:
        # After a sample of the rows has settled, one settled step suffices.
        patience = 2 if problem.on_sample is None else 1
        return varpro(problem, premise, tol=self.tol, patience=patience, **settings)
