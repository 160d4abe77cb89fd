"""Where training starts: the partition that was asked for, in standardised units."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn import get_config
from sklearn.base import clone
from sklearn.utils.validation import has_fit_parameter

from .._validation import warn_user
from ..exceptions import ConstantInputWarning, UnderdeterminedWarning
from ..membership import Membership
from ..model import TSKModel
from ..partition import (
    GridSize,
    clustered_antecedent,
    count_distinct_inputs,
    grid_antecedent,
    imported_antecedent,
    term_counts,
)
from ..rows import Rows
from .automatic import SEARCHED, StructureSearch
from .structure import Structure

__all__ = ["ENOUGH_ROWS", "Partition", "report_constant"]

# Neighbouring terms of a grid cross at this membership at the start. From the customary 0.5, Jang's
# sinc gets stuck; elsewhere it makes little difference (benchmarks/start.py).
_OVERLAP = 0.6
_MIB = 2**20
# Distinct rows are counted up to here: more make no difference to any decision.
ENOUGH_ROWS = 20_000
# alpha="auto", from so many distinct rows per consequent parameter on: as small as rounding allows
# where the data determine the consequents well; rounding errors grow by 1 / alpha along directions
# that the data leave open, so more where they do not.
_ALPHAS = ((2.0, 1e-12), (1.0, 1e-7), (0.0, 1e-4))


@dataclass(frozen=True, eq=False)
class Partition:
    """What was asked for.

    Parameters
    ----------
    n_mfs, partition : object
        As given to the estimator; a model in place of the estimator that holds it.
    families : sequence of type of Membership
        One per input.
    order : {0, 1}
    premise_inputs, consequent_inputs : ndarray of int
    alpha, stiffness : float or str
        A str leaves it open.
    seed : int
        Of clusterings that have none of their own.
    names : sequence of str
        Of the inputs.
    """

    n_mfs: Any
    partition: Any
    families: Sequence[type[Membership]]
    order: int
    premise_inputs: np.ndarray
    consequent_inputs: np.ndarray
    alpha: Any
    stiffness: Any
    seed: int
    names: Sequence[str]

    @property
    def is_searched(self):
        """Whether the data decide on the structure."""
        return (
            isinstance(self.n_mfs, str)
            and isinstance(self.partition, str)
            and self.partition in SEARCHED
        )

    def structure(self, rows: Rows, n_distinct) -> Structure:
        """Where to start from, for these rows."""
        self._check_combination()
        alpha = None if isinstance(self.alpha, str) else self.alpha
        stiffness = None if isinstance(self.stiffness, str) else self.stiffness
        if self.is_searched:
            return StructureSearch(
                rows,
                self.families,
                self.order,
                self.premise_inputs,
                self.consequent_inputs,
                n_distinct,
                self.seed,
                alpha,
                stiffness,
                _OVERLAP,
            ).run(self.partition)
        names: tuple[str, ...] = ()
        if isinstance(self.partition, TSKModel):
            antecedent = imported_antecedent(self.partition, rows)
            names = self.partition.term_names
        elif isinstance(self.n_mfs, str):
            label = _labeller(self.partition, rows.sample_weight is not None)
            antecedent = clustered_antecedent(self.families, rows, label, self.premise_inputs)
        else:
            antecedent = self._grid(rows)
        rows_each = self._rows_per_parameter(antecedent.n_rules, rows, n_distinct)
        if alpha is None:
            alpha = next(value for enough, value in _ALPHAS if rows_each >= enough)
        return Structure(antecedent, alpha, stiffness or 0.0, term_names=names)

    def _check_combination(self):
        """Raise ValueError where two parameters contradict each other."""
        is_grid = isinstance(self.partition, str) and self.partition in ("auto", "grid")
        if isinstance(self.n_mfs, str) or is_grid:
            return
        what = "the imported rules" if isinstance(self.partition, TSKModel) else "scattered rules"
        raise ValueError(
            f"n_mfs={self.n_mfs!r} asks for a grid, partition={self.partition!r} for {what}: "
            "leave n_mfs at 'auto', or use partition='grid'."
        )

    def _grid(self, rows):
        counts = self._grid_counts(rows)
        n_basis = 1 + self.consequent_inputs.size
        GridSize(counts, n_basis, rows.y.shape[1]).check_fits(
            self.n_mfs, get_config()["working_memory"] * _MIB, self.names
        )
        low, high = rows.inputs.box
        return grid_antecedent(self.families, counts, low, high, _OVERLAP)

    def _grid_counts(self, rows):
        """Terms per input; none on an input that never changes or has no part in the premises."""
        has_terms = ~rows.inputs.is_constant
        has_terms[np.setdiff1d(np.arange(has_terms.size), self.premise_inputs)] = False
        counts = term_counts(self.n_mfs, self.names)
        if np.ndim(self.n_mfs) == 0:
            return [count if has else 1 for has, count in zip(has_terms, counts, strict=True)]
        for j, (name, count) in enumerate(zip(self.names, counts, strict=True)):
            if has_terms[j] or count == 1:
                continue
            why = (
                "is constant in the training data: give it 1, or drop the column"
                if rows.inputs.is_constant[j]
                else "is not among premise_features: give it 1, or name it there"
            )
            raise ValueError(
                f"n_mfs={self.n_mfs!r} asks for {count} terms on column {name!r}, which {why}."
            )
        return counts

    def _rows_per_parameter(self, n_rules, rows, n_distinct):
        """Distinct rows per consequent parameter; a warning where there is less than one."""
        n_basis = 1 + np.count_nonzero(~rows.inputs.is_constant[self.consequent_inputs])
        n_columns = n_rules * n_basis
        if n_distinct == ENOUGH_ROWS < 2 * n_columns:
            n_distinct = count_distinct_inputs(rows, 2 * n_columns)
        if n_columns > n_distinct:
            warn_user(
                f"{n_rules} rules with {n_basis} coefficients each are {n_columns} consequent "
                f"parameters for {n_distinct} distinct training rows: the model can pass through "
                "every row and mean nothing between them. Judge it on rows held out, use fewer "
                "rules, or raise alpha.",
                UnderdeterminedWarning,
            )
        return n_distinct / n_columns


def _labeller(clusterer, weighted):
    """Labels of weighted rows by a scikit-learn clusterer; ValueError if it takes no weights."""

    def label(table, weight):
        if has_fit_parameter(clusterer, "sample_weight"):
            return clone(clusterer).fit(table, sample_weight=weight).labels_
        if weighted:
            raise ValueError(
                f"partition={clusterer!r} takes no sample_weight, but fit was given one: use a "
                "clusterer that does, such as KMeans, or partition='grid'."
            )
        repeated = np.repeat(np.arange(weight.size), weight.astype(int))
        labels = np.empty(weight.size, dtype=int)
        labels[repeated] = clone(clusterer).fit_predict(table[repeated])
        return labels

    return label


def report_constant(rows, names):
    """Warn of inputs that never change."""
    scale = rows.inputs
    flat = [
        f"{name!r} (always {value:.6g})"
        for name, value, is_flat in zip(names, scale.offset, scale.is_constant, strict=True)
        if is_flat
    ]
    if flat:
        warn_user(
            f"Constant in the training data: column {', '.join(flat)}. Nothing can be learnt from "
            "it: it gets no fuzzy terms and no slope. Drop it, or train on data where it varies.",
            ConstantInputWarning,
        )
