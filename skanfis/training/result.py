"""What a run of the solver, and a fit, leave behind."""

from dataclasses import dataclass

import numpy as np

from ..learning import SolverResult
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.premise import Premise
from ..model import TSKModel
from ..search import Start

__all__ = ["Fitted", "SolverRun"]


@dataclass(frozen=True, eq=False)
class SolverRun:
    """One run of the solver: where it began, what it worked on, where it ended."""

    start: Start
    problem: SeparableProblem
    premise: Premise
    result: SolverResult
    validation_losses: tuple[float, ...] | None = None

    @property
    def evaluation(self) -> Evaluation:
        """The problem at the best point."""
        assert self.result.evaluation is not None
        return self.result.evaluation

    @property
    def displacement(self) -> np.ndarray:
        """Where the premises are, from their start."""
        return self.premise.displacement(self.evaluation.antecedent.parameters)


@dataclass(frozen=True, eq=False)
class Fitted:
    """What a fit leaves behind."""

    model: TSKModel
    result: SolverResult
    start: Start
    redundant_rules: list[dict]
    robust_weights: np.ndarray | None = None
    validation_losses: tuple[float, ...] | None = None
    constraints: dict | None = None
