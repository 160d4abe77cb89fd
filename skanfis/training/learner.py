"""One run of a solver: what it needs beside the data and the start, and what it leaves behind."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..objective import SeparableProblem
from ..premise import Premise
from ..rows import Rows
from ..solvers import SOLVERS, SolverResult
from ..structure import Start

__all__ = ["Learned", "Learner"]

# Part of tol that a sample of many rows is trained to: its iterations cost next to nothing, and
# what is left to do is done on all rows.
_THOROUGH = 0.1


@dataclass(frozen=True, eq=False)
class Learned:
    """The end of a run."""

    start: Start
    problem: SeparableProblem
    premise: Premise
    result: SolverResult
    validation_losses: tuple[float, ...] = ()

    @property
    def displacement(self):
        """Where the premises are, from their start."""
        evaluation = self.result.evaluation
        assert evaluation is not None
        return self.premise.displacement(evaluation.antecedent.parameters)


@dataclass(frozen=True, eq=False)
class Learner:
    """A solver and its settings.

    Parameters
    ----------
    solver : str
        A key of ``SOLVERS``.
    order : {0, 1}
    consequent_inputs : ndarray of int
    max_iter, tol : int, float
        When to stop.
    options : dict
        What this solver takes beyond what all take.
    map_ordered : callable
        ``map`` or what stands in for it.
    """

    solver: str
    order: int
    consequent_inputs: np.ndarray
    max_iter: int
    tol: float
    options: dict
    map_ordered: Callable = map

    def run(self, rows: Rows, start: Start, displacement=None, watch=None) -> Learned:
        """Train from a start, or from a displacement of it; ``watch`` may end it.

        Of many rows, variable projection first trains on their sample, unwatched: what is left to
        do on all of them is a step or two.
        """
        premise = self.premise(rows, start)
        displacement = start.displacement if displacement is None else displacement
        if displacement is not None:
            displacement = np.clip(displacement, premise.lower, premise.upper)
        if rows.sample is None:
            problem, options = self.problem(rows, start), self.options
        else:
            problem, options = self.problem(rows.sample, start), self.options
            if self.solver == "varpro":
                thorough = {**options, "tol": _THOROUGH * self.tol}
                result = self._solve(problem, premise, displacement, None, thorough)
                displacement = premise.displacement(result.evaluation.antecedent.parameters)
                options = {**options, "patience": 1}
            problem = problem.on_all(rows)
        result = self._solve(problem, premise, displacement, watch, options)
        return Learned(start, problem, premise, result)

    def _solve(self, problem, premise, displacement, watch, options):
        settings = {"max_iter": self.max_iter, "tol": self.tol, **options}
        return SOLVERS[self.solver](
            problem,
            premise,
            stiffness=problem.penalty.stiffness,
            start=displacement,
            on_iteration=watch,
            **settings,
        )

    def problem(self, rows: Rows, start: Start):
        """The least-squares problem at a start."""
        return SeparableProblem(
            rows,
            start.antecedent,
            self.order,
            start.penalty,
            self.map_ordered,
            self.consequent_inputs,
        )

    @staticmethod
    def premise(rows: Rows, start: Start):
        """What moves at a start, within the box of the data."""
        low, high = rows.inputs.box
        return Premise.of(start.antecedent, low, high, start.is_free)
