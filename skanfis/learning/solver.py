"""The interface of solvers, objects with settings of their own that find the premises.

The simplest solver is here too: least squares alone, which leaves the premises where they start.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from sklearn.base import BaseEstimator

from .objective import Evaluation, SeparableProblem
from .premise import Premise

MESSAGES = {
    "gradient": "The projected gradient is below tol: the premises are stationary.",
    "cost": "The relative decrease of the cost, both predicted and actual, is below tol.",
    "step": "No step decreases the cost any further at this precision.",
    "max_iter": "max_iter was reached before the cost converged or the error reached error_goal.",
    "stopped": "Early stopping or a callback ended the training.",
    "as_given": "Nothing was learnt: the rules are as they were given.",
    "error_goal": "The root mean square error is as small as error_goal.",
    "epochs": "All max_iter epochs were run: this solver ends earlier only by error_goal or tol.",
    "no_premise": "There is nothing to iterate on: the consequents are found in one solve.",
}


@dataclass(frozen=True, eq=False)
class SolverResult:
    """The best point found, and how the solver came to it.

    Parameters
    ----------
    evaluation : skanfis.learning.objective.Evaluation or None
        The problem at the best point; None where nothing was trained.
    loss_curve : ndarray of shape (n_iter + 1,)
        Mean squared error of the standardised target, at the start and after every iteration.
    n_iter : int
        Iterations run.
    status : str
        Why it stopped, a key of ``skanfis.learning.MESSAGES``.
    gauss_newton : ndarray of shape (n_displacements, n_displacements) or None
        Curvature of the cost by the premises' displacements, without the stiffness, at most one
        iteration before the end. None for solvers that do not compute it.

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
        """Whether it ended otherwise than by ``max_iter`` before it was done."""
        return self.status != "max_iter"

    @property
    def message(self) -> str:
        """The status in words."""
        return MESSAGES[self.status]


class Solver(BaseEstimator, ABC):
    """A solver; a subclass is one more value of ``ANFISRegressor(solver=...)``.

    As in every scikit-learn estimator, ``__init__`` only assigns its parameters. ``get_params``
    finds them, ``clone`` copies them, and a search varies them as ``solver__name``.

    Attributes
    ----------
    moves_premises : bool
        Whether the premises move at all.
    goes_on_from_tuning : bool
        Whether a run starts where the search for the penalty's weights has moved the premises, by
        variable projection. Else it starts afresh from the partition.
    stiffness : "auto" or float
        Weight of the pull of the premises to their start, if they move.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import Solver, VariableProjection
    >>> class Hurried(Solver):
    ...     "A tenth of the iterations."
    ...
    ...     def solve(self, problem, premise, *, max_iter, **settings):
    ...         return VariableProjection().solve(
    ...             problem, premise, max_iter=max_iter // 10, **settings
    ...         )
    >>> X, y = make_jang_sinc()
    >>> ANFISRegressor(n_mfs=4, solver=Hurried(), max_iter=500).fit(X, y).n_iter_ <= 50
    True
    """

    _parameter_constraints: ClassVar[dict] = {}
    moves_premises: ClassVar[bool] = True
    goes_on_from_tuning: ClassVar[bool] = False
    stiffness: str | float = "auto"

    @abstractmethod
    def solve(
        self,
        problem: SeparableProblem,
        premise: Premise,
        *,
        max_iter: int,
        stiffness: float = 0.0,
        start: np.ndarray | None = None,
        on_iteration: Callable[[int, Evaluation], bool] | None = None,
    ) -> SolverResult:
        """Minimise the cost of ``problem`` over the premises.

        Parameters
        ----------
        problem : SeparableProblem
        premise : Premise
        max_iter : int
            Most iterations.
        stiffness : float
            The weight itself: that of ``self.stiffness``, or for "auto" the evidence's.
        start : ndarray of shape (premise.size,), optional
            Displacements to start from, inside the box; zero if not given.
        on_iteration : callable, optional
            Called with (n_iter, evaluation) after every iteration; a true result ends the run.

        Returns
        -------
        SolverResult
        """


class LeastSquares(Solver):
    """Least squares alone: the premises stay at their start, the consequents are solved for once.

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
    goes_on_from_tuning: ClassVar[bool] = True

    def solve(
        self, problem, premise, *, max_iter, stiffness=0.0, start=None, on_iteration=None
    ) -> SolverResult:
        x = np.zeros(premise.size) if start is None else start
        evaluation = problem.evaluate(premise.parameters(x))
        # The one solve counts as an iteration.
        if on_iteration is not None:
            on_iteration(1, evaluation)
        loss_curve = np.full(2, evaluation.mean_squared_error)
        return SolverResult(evaluation, loss_curve, 1, "no_premise")
