"""What a solver is: an object with the settings of its own, that finds the premises."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from sklearn.base import BaseEstimator

from .objective import Evaluation, SeparableProblem
from .premise import Premise
from .solver_result import SolverResult

__all__ = ["Solver", "Watch"]

# Called with the number of the iteration and the evaluation there; what is true ends the run.
Watch = Callable[[int, Evaluation], bool]


class Solver(BaseEstimator, ABC):
    """A solver; a subclass is one more value of ``ANFISRegressor(solver=...)``.

    Parameters of ``__init__`` are assigned and no more, as in every scikit-learn estimator: they
    are then found by ``get_params``, copied by ``clone`` and searched for as ``solver__name``.

    Attributes
    ----------
    moves_premises : bool
        Whether the premises move at all.
    goes_on_from_tuning : bool
        Whether a run starts where the search for the weights of the penalty has moved the premises,
        by variable projection, or afresh from where the partition has them.
    stiffness : "auto" or float
        Weight of the pull of the premises to their start, where they move.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import LeastSquares, Solver, VariableProjection
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
        on_iteration: Watch | None = None,
    ) -> SolverResult:
        """Minimise the cost of ``problem`` over the premises.

        Parameters
        ----------
        problem : SeparableProblem
        premise : Premise
        max_iter : int
            Most iterations.
        stiffness : float
            The weight itself: what ``self.stiffness`` says, or what the evidence found for "auto".
        start : ndarray of shape (premise.size,), optional
            Displacements to start from, inside the box; zero if not given.
        on_iteration : callable, optional
            Called with (n_iter, evaluation) after every iteration; what is true ends the run.

        Returns
        -------
        SolverResult
        """
