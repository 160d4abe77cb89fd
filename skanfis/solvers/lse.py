"""Least squares alone: the premises stay where they start, the consequents are solved for once."""

import numpy as np

from .result import SolverResult

__all__ = ["lse"]


def lse(problem, premise, *, max_iter, tol, stiffness=0.0, start=None, on_iteration=None):
    """Solve for the consequents.

    Parameters
    ----------
    problem : SeparableProblem
    premise : Premise
    max_iter, tol, stiffness : object
        Not used: the one solve is exact, and nothing moves.
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
