"""What the user asked for, and the start that it leads to: by a search, or from given rules."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import prod
from typing import Any

import numpy as np
from sklearn.base import clone
from sklearn.utils.validation import has_fit_parameter

from .._validation import warn_user
from ..exceptions import ConstantInputWarning, UnderdeterminedWarning
from ..learning.data import StandardisedData, fingerprint
from ..membership import Gaussian
from ..model import TSKModel
from ..naming import default_term_names
from .candidates import KINDS
from .clusters import clustered_antecedent
from .grid import Spacing, grid_antecedent
from .search import StructureSearch
from .size import check_columns_fit, check_grid_fits, check_rules_fit, term_counts
from .start import Start, imported_antecedent, tuned_start
from .trials import Plan
from .tuning import scaled

# A warning names this many columns at most, and counts the others.
_MOST_NAMED = 10


@dataclass(frozen=True, eq=False, kw_only=True)
class StructureRequest(Plan):
    """What the user asked for; as a ``Plan``, the part of it that trainings of candidates need."""

    n_mfs: Any
    partition: Any  # as given; for an estimator, the model that it holds
    names: Sequence[str]  # of the inputs
    simplicity: float  # tolerated relative rise of the error, for a model that is easier to read

    def __post_init__(self):
        """Raise ValueError where two parameters contradict each other."""
        if isinstance(self.n_mfs, str) or self.partition in ("auto", "grid"):
            return
        what = "the imported rules" if isinstance(self.partition, TSKModel) else "other rules"
        raise ValueError(
            f"n_mfs={self.n_mfs!r} asks for a grid, but partition={self.partition!r} asks for "
            f"{what}: leave n_mfs at 'auto', or use partition='grid'."
        )

    def start(self, rows: StandardisedData) -> Start:
        """The start that the request leads to on these rows."""
        check_columns_fit(len(self.names))
        if isinstance(self.n_mfs, str) and isinstance(self.partition, str):
            return StructureSearch(rows, self._plan(rows), self.simplicity).run(self._kinds())
        if isinstance(self.partition, TSKModel):
            model = self.partition
            antecedent = imported_antecedent(model, rows)
            # Default names tell where terms stand: they are made again after training moves terms.
            names = () if model.term_names == default_term_names(model) else model.term_names
            return replace(self._tuned(antecedent, rows), term_names=names)
        return self._tuned(self._antecedent(rows), rows)

    def _kinds(self):
        """The kinds that are searched; a tree only for Gaussian terms: its cuts have no family."""
        if self.partition != "auto":
            return (self.partition,)
        left_out = ["tree"] if any(family is not Gaussian for family in self.families) else []
        if self.held is not None:
            # Scattered rules fire all over the range, so a monotonic constraint binds them hard.
            left_out.append("scattered")
        return [kind for kind in KINDS if kind not in left_out]

    def _plan(self, rows):
        """The same for these rows: constant inputs get no terms."""
        varying = self.premise_inputs[~rows.inputs.is_constant[self.premise_inputs]]
        # Fixed premises need no stiffness.
        weights = self.weights if self.premises_move else {"stiffness": 0.0} | self.weights
        n_all = rows.effective_weight
        return replace(self, premise_inputs=varying, weights=weights, n_all=n_all)

    def _antecedent(self, rows):
        """The rule base that the user asked for: of a clusterer, or a grid."""
        if isinstance(self.n_mfs, str):
            label = partial(self._label, rows.y.shape[1])
            return clustered_antecedent(self.families, rows, label, self.premise_inputs)
        counts = self._grid_counts(rows)
        self._check_number(prod(counts))
        check_grid_fits(self.n_mfs, counts, 1 + self.consequent_inputs.size, rows.y.shape[1])
        return grid_antecedent(self.families, counts, Spacing(rows))

    def _tuned(self, antecedent, rows):
        self._warn_if_underdetermined(antecedent.n_rules, rows)
        return tuned_start(antecedent, rows, self._plan(rows), self.simplicity)

    def for_all(self, start: Start, sample: StandardisedData, rows: StandardisedData) -> Start:
        """A start found on a sample, with its free weights scaled to the number of all rows."""
        ratio = sample.effective_weight / rows.effective_weight
        penalty = scaled(start.penalty, self.free, ratio, start.agreement_is_raised)
        return replace(start, penalty=penalty)

    def _check_number(self, n_rules):
        """Raise ValueError where the given rules are more than ``max_rules``."""
        if self.max_rules is not None and n_rules > self.max_rules:
            is_word = isinstance(self.n_mfs, str)
            given = f"partition={self.partition!r}" if is_word else f"n_mfs={self.n_mfs!r}"
            raise ValueError(
                f"{given} makes {n_rules:,} rules, more than max_rules={self.max_rules}: ask "
                "for fewer, or leave max_rules at None."
            )

    def _label(self, n_outputs, table, weight):
        """Labels by the clusterer; too many clusters raise before any rule is made of them."""
        try:
            labels = np.asarray(_labels(self.partition, self.seed, table, weight))
        except ValueError as error:
            raise ValueError(
                f"partition={self.partition!r} does not suit the training data (distinct rows "
                f"that count: {len(table)}): {error}"
            ) from error
        n_rules = np.unique(labels[labels >= 0]).size
        self._check_number(n_rules)
        check_rules_fit(
            f"partition={self.partition!r} makes",
            n_rules,
            n_rules * self.premise_inputs.size,
            1 + self.consequent_inputs.size,
            n_outputs,
            "Use fewer clusters, or constant consequents (order=0).",
        )
        return labels

    def _grid_counts(self, rows):
        """Terms per input; none on an input that never changes or has no part in the premises."""
        has_terms = ~rows.inputs.is_constant
        has_terms &= np.isin(np.arange(has_terms.size), self.premise_inputs)
        counts = term_counts(self.n_mfs, self.names)
        if np.ndim(self.n_mfs) == 0:
            return [count if has else 1 for has, count in zip(has_terms, counts, strict=True)]
        for j, (name, count) in enumerate(zip(self.names, counts, strict=True)):
            if has_terms[j] or count == 1:
                continue
            why = (
                "is constant in the training data: ask for 1 there, or drop the column"
                if rows.inputs.is_constant[j]
                else "is not in premise_features: ask for 1 there, or add it to premise_features"
            )
            raise ValueError(
                f"n_mfs={self.n_mfs!r} asks for {count} terms on column {name!r}, which {why}."
            )
        return counts

    def _warn_if_underdetermined(self, n_rules, rows):
        """Warn where distinct rows are fewer than consequent parameters."""
        n_basis = 1 + self.consequent_inputs.size
        n_columns = n_rules * n_basis
        n_distinct = np.unique(rows.numbers(lambda Z, _: fingerprint(Z))).size
        if n_distinct < n_columns:
            each = f"with {n_basis} coefficients"
            rules = f"{n_rules} rules {each} each have" if n_rules > 1 else f"1 rule {each} has"
            warn_user(
                f"{rules} {n_columns} consequent parameters for {n_distinct} distinct training "
                "rows. Between these rows, predictions follow the prior more than the data. Test "
                f"the model on held-out rows, or use fewer {'rules' if n_rules > 1 else 'inputs'}.",
                UnderdeterminedWarning,
            )


def _labels(clusterer, seed, table, weight):
    """Labels of weighted rows by a scikit-learn clusterer, seeded unless it has a seed."""
    seeded = clone(clusterer)
    for key, value in clusterer.get_params().items():
        if value is None and key.endswith("random_state"):
            seeded.set_params(**{key: seed})
    if has_fit_parameter(clusterer, "sample_weight"):
        return seeded.fit(table, sample_weight=weight).labels_
    repeated = np.repeat(np.arange(weight.size), weight.astype(int))
    labels = np.empty(weight.size, dtype=int)
    labels[repeated] = seeded.fit_predict(table[repeated])
    return labels


def report_constant(rows, names):
    """Warn of inputs that never change."""
    flat = [
        f"{names[j]!r} (always {rows.inputs.offset[j] + 0.0:.6g})"  # 0, not -0
        for j in np.flatnonzero(rows.inputs.is_constant)
    ]
    if flat:
        more = f", and {len(flat) - _MOST_NAMED:,} more" if len(flat) > _MOST_NAMED else ""
        names_them = f"{', '.join(flat[:_MOST_NAMED])}{more}"
        warn_user(
            f"Column {names_them} is constant in the training data. Nothing can be learnt from it, "
            "so it gets no fuzzy terms and no slope. Drop it, or train on data where it varies."
            if len(flat) == 1
            else f"Columns {names_them} are constant in the training data. Nothing can be learnt "
            "from them, so they get no fuzzy terms and no slopes. Drop them, or train on data "
            "where they vary.",
            ConstantInputWarning,
        )
