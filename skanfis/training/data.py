"""What goes into a fit, validated rows, and what it leaves behind."""

from dataclasses import dataclass

import numpy as np

from ..bounds.constraints import Constraints
from ..learning import SolverResult
from ..learning.data import StandardisedData, check_scales
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.premise import Premise
from ..model import TSKModel
from ..search import Start


@dataclass(frozen=True, eq=False)
class ValidatedData:
    """Validated data.

    Parameters
    ----------
    X : ndarray of shape (n_rows, n_inputs)
    y : ndarray of shape (n_rows, n_outputs)
    sample_weight : ndarray of shape (n_rows,) or None
        Positive.
    groups : ndarray of shape (n_rows,) or None
    input_names, output_names : sequence of str
    kept : ndarray of bool of shape (n_given_rows,), optional
        Which of the rows given have weight and are here, if not all.
    constraints : Constraints, optional
        What is known of the target, in the user's units.
    """

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None
    groups: np.ndarray | None
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    kept: np.ndarray | None = None
    constraints: Constraints | None = None

    def rows(self, indices=slice(None)):
        """Some of the rows, on scales of their own."""
        weight = None if self.sample_weight is None else self.sample_weight[indices]
        groups = None if self.groups is None else self.groups[indices]
        rows = StandardisedData.of(self.X[indices], self.y[indices], weight, groups)
        check_scales(rows.inputs, rows.targets, self.input_names, self.output_names)
        return rows

    def numbered(self, indices):
        """X and y of some rows, and their numbers among all rows given."""
        numbers = np.arange(len(self.X)) if self.kept is None else np.flatnonzero(self.kept)
        return self.X[indices], self.y[indices], numbers[indices]

    def spread_weights(self, weights):
        """Weights of these rows as weights of all rows given, zero elsewhere."""
        if self.kept is None:
            return weights
        given = np.zeros(self.kept.size)
        given[self.kept] = 1.0 if weights is None else weights
        return given

    def spread_over_rows(self, values, indices):
        """Values of some rows as values of all rows given, NaN elsewhere."""
        every = np.full(self.X.shape[0], np.nan)
        every[indices] = values
        if self.kept is None:
            return every
        given = np.full(self.kept.size, np.nan)
        given[self.kept] = every
        return given


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
