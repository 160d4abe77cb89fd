"""Input and output of a fit: validated rows, runs of the solver, and results."""

from dataclasses import dataclass

import numpy as np
from sklearn.utils.validation import check_consistent_length, validate_data

from .._validation import (
    as_frame,
    bearable_weights,
    check_finite,
    group_numbers,
    named_refusals,
    positive_weights,
    refuse_lazy,
    row_weights,
)
from ..bounds.constraints import Constraints
from ..learning import SolverResult
from ..learning.data import StandardisedData, check_scales
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.premise import Premise
from ..model import TSKModel
from ..naming import target_names
from ..search import Start

# scikit-learn's checks of numbers. Whether they are finite is checked here, to name the column.
NUMERIC: dict = {"dtype": (np.float64, np.float32), "ensure_all_finite": False}


@dataclass(frozen=True, eq=False)
class ValidatedData:
    """The user's data, checked: rows of positive weight as arrays of floats, and their names."""

    X: np.ndarray
    y: np.ndarray  # (n_rows, n_outputs)
    sample_weight: np.ndarray | None  # positive
    groups: np.ndarray | None
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    kept: np.ndarray | None = None  # mask of the given rows that have weight; None if all have
    constraints: Constraints | None = None  # on the outputs, in the user's units

    def rows(self, indices=slice(None)):
        """Some of the rows, on scales of their own."""
        weight = None if self.sample_weight is None else self.sample_weight[indices]
        groups = None if self.groups is None else self.groups[indices]
        rows = StandardisedData.of(self.X[indices], self.y[indices], weight, groups)
        check_scales(rows.inputs, rows.targets, self.input_names, self.output_names)
        return rows

    def numbered(self, indices):
        """X and y of some rows, and their numbers among all given rows."""
        numbers = np.arange(len(self.X)) if self.kept is None else np.flatnonzero(self.kept)
        return self.X[indices], self.y[indices], numbers[indices]

    def over_all(self, values, elsewhere):
        """Values of these rows as values of all given rows, with ``elsewhere`` for the others."""
        if self.kept is None:
            return values
        given = np.full(self.kept.size, elsewhere)
        given[self.kept] = values
        return given


def validated(estimator, X, y, sample_weight, groups, *, is_chunk=False):
    """The data, checked, without rows of weight zero; ``is_chunk`` if other chunks may precede."""
    refuse_lazy(X=X, y=y, sample_weight=sample_weight, groups=groups)
    is_first = not (is_chunk and hasattr(estimator, "model_"))
    X, y = as_frame(X), as_frame(y)
    given = y
    with named_refusals(X=X, y=y):
        X, y = validate_data(
            estimator,
            X,
            y,
            reset=is_first,
            validate_separately=(
                {**NUMERIC, "ensure_min_samples": 1 if is_chunk else 2},
                {**NUMERIC, "ensure_2d": False},
            ),
        )
    check_consistent_length(X, y)
    if is_first:
        # Kept on the estimator, as ``validate_data`` keeps the number and the names of columns.
        estimator._single_output = y.ndim == 1
    targets = y.reshape(-1, 1) if y.ndim == 1 else y
    output_names = target_names(given, targets.shape[1])
    numbered = [f"x{j}" for j in range(X.shape[1])]
    names = tuple(map(str, getattr(estimator, "feature_names_in_", numbered)))
    check_finite(X, "X", names)
    check_finite(targets, "y", output_names)
    groups = None if groups is None else group_numbers(groups, len(X))
    keep = None
    if sample_weight is not None:
        sample_weight = row_weights(sample_weight, len(X))
        # Weights of chunks are relative to each other, and stay as they are.
        sample_weight = sample_weight if is_chunk else bearable_weights(sample_weight)
        keep = positive_weights(sample_weight, len(X), 0 if is_chunk else 2)
    if keep is not None:
        X, targets, sample_weight = X[keep], targets[keep], sample_weight[keep]
        groups = None if groups is None else groups[keep]
    constraints = Constraints.read(
        estimator.monotonic_cst, estimator.constraints, names, targets.shape[1]
    )
    return ValidatedData(X, targets, sample_weight, groups, names, output_names, keep, constraints)


@dataclass(frozen=True, eq=False)
class SolverRun:
    """One run of the solver: its start, its problem, and its end."""

    start: Start
    problem: SeparableProblem
    premise: Premise
    result: SolverResult
    validation_losses: np.ndarray | None = None

    @property
    def evaluation(self) -> Evaluation:
        """The problem at the best point."""
        assert self.result.evaluation is not None
        return self.result.evaluation

    @property
    def displacement(self) -> np.ndarray:
        """Displacement of the premises from their start."""
        return self.premise.displacement(self.evaluation.antecedent.parameters)


@dataclass(frozen=True, eq=False)
class Fitted:
    """The results of a fit."""

    model: TSKModel
    result: SolverResult
    start: Start
    redundant_rules: list[dict]
    robust_weights: np.ndarray | None = None
    validation_losses: np.ndarray | None = None
    constraints: dict | None = None
