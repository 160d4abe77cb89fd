"""What every solver returns, and the reasons for which one stops."""

from dataclasses import dataclass

import numpy as np

from ..objective import Evaluation

__all__ = ["MESSAGES", "SolverResult"]

MESSAGES = {
    "gradient": "The projected gradient is below tol: the premises are stationary.",
    "cost": "The relative decrease of the cost, expected and found, is below tol.",
    "step": "No step decreases the cost any further at this precision.",
    "max_iter": "max_iter was reached before the cost settled or the error met its goal.",
    "stopped": "Early stopping or a callback asked for the end.",
    "interrupted": "The user interrupted the training.",
    "as_given": "Nothing was learnt: the rules are as they were given.",
    "error_goal": "The root mean square error is as small as error_goal.",
    "epochs": "All max_iter epochs were run: this rule stops of itself at an error_goal only.",
    "no_premise": "There is nothing to iterate on: the consequents are found in one solve.",
}


@dataclass(frozen=True, eq=False)
class SolverResult:
    """The best point found and how the solver came to it."""

    evaluation: Evaluation | None  # None where nothing was trained
    loss_curve: np.ndarray  # mean squared error of the standardised target, start first
    n_iter: int
    status: str  # a key of MESSAGES

    @property
    def converged(self):
        """Whether the solver stopped of its own accord."""
        return self.status not in ("max_iter", "interrupted")

    @property
    def message(self):
        """The status in words."""
        return MESSAGES[self.status]
