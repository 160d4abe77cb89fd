"""One run of a solver: what it needs beside the data and the start, and what it leaves behind."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..objective import SeparableProblem
from ..premise import Premise
from ..rows import Rows
from ..solvers import Solver, SolverResult
from ..structure import Start

__all__ = ["Learned", "Learner"]


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
    solver : Solver
    order : {0, 1}
    consequent_inputs : ndarray of int
    max_iter : int
    map_ordered : callable
        ``map`` or what stands in for it.
    """

    solver: Solver
    order: int
    consequent_inputs: np.ndarray
    max_iter: int
    map_ordered: Callable = map

    def run(self, rows: Rows, start: Start, displacement=None, watch=None) -> Learned:
        """Train from a start, or from a displacement of it; ``watch`` may end it."""
        problem, premise = self.problem(rows, start), self.premise(rows, start)
        displacement = start.displacement if displacement is None else displacement
        if displacement is not None:
            displacement = np.clip(displacement, premise.lower, premise.upper)
        result = self.solver.solve(
            problem,
            premise,
            max_iter=self.max_iter,
            stiffness=start.penalty.stiffness,
            start=displacement,
            on_iteration=watch,
        )
        return Learned(start, problem, premise, result)

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
