"""Least squares alone: the premises stay where they start, the consequents are solved for once."""

from typing import ClassVar

import numpy as np

from .solver import Solver
from .solver_result import SolverResult

__all__ = ["LeastSquares", "lse"]


def lse(problem, premise, *, start=None, on_iteration=None):
    """Solve for the consequents.

    Parameters
    ----------
    problem : SeparableProblem
    premise : Premise
    start : ndarray of shape (premise.size,), optional
        Displacements of the premises, inside the box; zero if not given.
    on_iteration : callable, optional
        Called with (1, evaluation).

    Returns
    -------
    SolverResult
        The one solve counts as an iteration; the loss curve's two entries are the same.
    """
    x = np.zeros(premise.size) if start is None else start
    evaluation = problem.evaluate(premise.parameters(x))
    if on_iteration is not None:
        on_iteration(1, evaluation)
    loss_curve = np.full(2, evaluation.mean_squared_error)
    return SolverResult(evaluation, loss_curve, 1, "no_premise")


class LeastSquares(Solver):
    """Least squares alone: the premises stay as they start, the consequents are solved for once.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``solver``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import LeastSquares
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=4, solver=LeastSquares()).fit(X, y)
    >>> model.memberships_ == model.initial_memberships_
    True
    """

    moves_premises: ClassVar[bool] = False

    def solve(
        self, problem, premise, *, max_iter, stiffness=0.0, start=None, on_iteration=None
    ) -> SolverResult:
        return lse(problem, premise, start=start, on_iteration=on_iteration)
