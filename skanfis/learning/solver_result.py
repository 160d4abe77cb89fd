"""What every solver returns, and the reasons for which one stops."""

from dataclasses import dataclass

import numpy as np

from .objective import Evaluation

__all__ = ["MESSAGES", "SolverResult"]

MESSAGES = {
    "gradient": "The projected gradient is below tol: the premises are stationary.",
    "cost": "The relative decrease of the cost, expected and found, is below tol.",
    "step": "No step decreases the cost any further at this precision.",
    "max_iter": "max_iter was reached before the cost settled or the error met its goal.",
    "stopped": "Early stopping or a callback asked for the end.",
    "as_given": "Nothing was learnt: the rules are as they were given.",
    "error_goal": "The root mean square error is as small as error_goal.",
    "epochs": "All max_iter epochs were run: this rule stops of itself at an error_goal only.",
    "no_premise": "There is nothing to iterate on: the consequents are found in one solve.",
}


@dataclass(frozen=True, eq=False)
class SolverResult:
    """The best point found and how the solver came to it.

    Parameters
    ----------
    evaluation : skanfis.learning.objective.Evaluation or None
        The problem at the best point; None where nothing was trained.
    loss_curve : ndarray of shape (n_iter + 1,)
        Mean squared error of the standardised target, at the start and after every iteration.
    n_iter : int
        Iterations run.
    status : str
        Why it stopped, a key of ``skanfis.learning.solver_result.MESSAGES``.
    gauss_newton : ndarray of shape (n_displacements, n_displacements) or None
        Curvature of the cost by the premises' displacements, their pull left out, where the solver
        last asked for it: at most one iteration before the end. None of solvers that never do.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.learning import SolverResult
    >>> SolverResult(None, np.array([0.4, 0.1]), 1, "max_iter").converged
    False
    """

    evaluation: Evaluation | None
    loss_curve: np.ndarray
    n_iter: int
    status: str
    gauss_newton: np.ndarray | None = None

    @property
    def converged(self) -> bool:
        """Whether the solver stopped of its own accord."""
        return self.status != "max_iter"

    @property
    def message(self) -> str:
        """The status in words."""
        return MESSAGES[self.status]
