"""What every ANFIS estimator shares: validate, partition, solve, and hand out the frozen model."""

import warnings
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed, effective_n_jobs
from sklearn import get_config
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils import check_random_state
from sklearn.utils.validation import has_fit_parameter
from threadpoolctl import threadpool_limits

from .antecedent import Antecedent
from .exceptions import ConstantInputWarning, UnderdeterminedWarning
from .membership import MEMBERSHIPS
from .model import TSKModel
from .objective import SeparableProblem
from .partition import (
    GridSize,
    automatic_counts,
    automatic_n_rules,
    clustered_antecedent,
    count_distinct_inputs,
    grid_antecedent,
    term_counts,
)
from .premise import Premise
from .rows import Rows
from .solvers import SOLVERS, SolverResult

__all__ = ["Training", "train"]

# Neighbouring terms of a grid cross at this membership at the start. Wider than the customary 0.5:
# training from there meets fewer bad minima (benchmarks/start.py).
_OVERLAP = 0.6
_MIB = 2**20
# Distinct rows are counted up to here: more make no difference to any decision.
_ENOUGH_ROWS = 20_000
_READ_ROWS = 4096
# alpha="auto": as small as rounding allows where the data determine the consequents well; rounding
# errors grow by 1 / alpha along directions that the data leave open, so more where they do not.
_ALPHA, _ALPHA_FEW_ROWS = 1e-12, 1e-8


@dataclass(frozen=True, eq=False)
class Training:
    """A finished training."""

    model: TSKModel
    result: SolverResult


def train(estimator, X, y, sample_weight, names):
    """Train on validated data.

    Parameters
    ----------
    estimator : object
        Where the parameters are read from.
    X : ndarray of shape (n_rows, n_inputs)
    y : ndarray of shape (n_rows, n_outputs)
    sample_weight : ndarray of shape (n_rows,) or None
        Positive.
    names : sequence of str
        Names of the inputs.
    """
    # One BLAS thread per worker: threads come from n_jobs, and sums do not depend on how many.
    with threadpool_limits(limits=1, user_api="blas"):
        rows = Rows.standardised(X, y, sample_weight)
        antecedent, alpha, n_distinct = _initial_antecedent(estimator, rows, names)
        problem = SeparableProblem(
            rows, antecedent, estimator.order, alpha, _ordered_map(estimator.n_jobs)
        )
        low, high = (
            _standardised(rows, edge) for edge in (rows.inputs.minimum, rows.inputs.maximum)
        )
        result = SOLVERS[estimator.solver](
            problem,
            Premise.of(antecedent, low, high),
            max_iter=estimator.max_iter,
            tol=estimator.tol,
            stiffness=estimator.stiffness,
        )
    if not result.converged:
        warnings.warn(
            f"solver={estimator.solver!r} with {antecedent.n_rules} rules on {rows.n_rows} rows "
            f"stopped at max_iter={estimator.max_iter} before the cost settled to "
            f"tol={estimator.tol:g}. The model is the best one found; increase max_iter or tol.",
            ConvergenceWarning,
            stacklevel=4,
        )
    model = _frozen(rows, antecedent, result, n_distinct, names, estimator.out_of_bounds)
    return Training(model, result)


def _standardised(rows, values):
    return (values - rows.inputs.offset) / rows.inputs.scale


def _ordered_map(n_jobs):
    """``map`` over worker threads; results in order, and no more of them held than workers."""
    if effective_n_jobs(n_jobs) == 1:
        return map

    def map_ordered(function, items):
        if len(items) == 1:
            return map(function, items)
        parallel = Parallel(n_jobs=n_jobs, backend="threading", return_as="generator")
        return parallel(delayed(function)(item) for item in items)

    return map_ordered


def _initial_antecedent(estimator, rows, names) -> tuple[Antecedent, float, int]:
    """The rule base that training starts from, in standardised units, and the ridge that it needs.

    With them, the number of distinct rows of X, as far as it has been counted.
    """
    _check_combination(estimator)
    constant = rows.inputs.is_constant
    _report_constant(constant, rows, names)
    family = MEMBERSHIPS[estimator.mf]
    n_inputs = int(np.count_nonzero(~constant))
    n_basis = 1 + n_inputs if estimator.order == 1 else 1
    n_distinct = count_distinct_inputs(rows, _ENOUGH_ROWS)

    counts = _grid_counts(estimator, rows, names, n_basis, n_distinct)
    if counts is not None:
        GridSize(counts, n_basis, rows.y.shape[1]).check_fits(
            estimator.n_mfs, get_config()["working_memory"] * _MIB, names
        )
        low, high = (
            _standardised(rows, edge) for edge in (rows.inputs.minimum, rows.inputs.maximum)
        )
        antecedent = grid_antecedent([family] * len(names), counts, low, high, _OVERLAP)
    elif isinstance(estimator.partition, str):
        n_premise = len(family.parameters)
        n_rules = automatic_n_rules(n_inputs, n_basis, n_premise, n_distinct)
        # random_state=None stands for one fixed seed: the same data give the same model.
        seed = 0 if estimator.random_state is None else check_random_state(estimator.random_state)
        clusterer = KMeans(n_clusters=n_rules, n_init=3, random_state=seed)
        antecedent = clustered_antecedent(family, rows, _labeller(clusterer, weighted=True))
    else:
        weighted = rows.sample_weight is not None
        antecedent = clustered_antecedent(family, rows, _labeller(estimator.partition, weighted))
    n_columns = antecedent.n_rules * n_basis
    if n_distinct == _ENOUGH_ROWS < 2 * n_columns:
        n_distinct = count_distinct_inputs(rows, 2 * n_columns)
    if n_columns > n_distinct:
        _report_underdetermined(antecedent.n_rules, n_basis, n_distinct)
    if not isinstance(estimator.alpha, str):
        return antecedent, estimator.alpha, n_distinct
    alpha = _ALPHA if n_distinct >= 2 * n_columns else _ALPHA_FEW_ROWS
    return antecedent, alpha, n_distinct


def _check_combination(estimator):
    """Raise ValueError where two parameters contradict each other."""
    if isinstance(estimator.n_mfs, str) or isinstance(estimator.partition, str):
        return
    raise ValueError(
        f"n_mfs={estimator.n_mfs!r} asks for a grid, partition={estimator.partition!r} for "
        "scattered rules: leave n_mfs at 'auto', or use partition='grid'."
    )


def _grid_counts(estimator, rows, names, n_basis, n_distinct):
    """Terms per input where there is to be a grid, else None."""
    constant = rows.inputs.is_constant
    if not isinstance(estimator.n_mfs, str):
        counts = term_counts(estimator.n_mfs, names)
        if np.ndim(estimator.n_mfs) == 0:
            return [1 if flat else count for flat, count in zip(constant, counts, strict=True)]
        for name, flat, count in zip(names, constant, counts, strict=True):
            if flat and count > 1:
                raise ValueError(
                    f"n_mfs={estimator.n_mfs!r} asks for {count} terms on column {name!r}, which "
                    "is constant in the training data: give it 1, or drop the column."
                )
        return counts
    if not isinstance(estimator.partition, str):
        return None
    counts = automatic_counts(constant, n_basis, n_distinct)
    if counts is None and estimator.partition == "grid":
        return [1 if flat else 2 for flat in constant]
    return counts


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


def _report_constant(constant, rows, names):
    flat = [
        f"{name!r} (always {value:.6g})"
        for name, value, is_flat in zip(names, rows.inputs.offset, constant, strict=True)
        if is_flat
    ]
    if flat:
        warnings.warn(
            f"Constant in the training data: column {', '.join(flat)}. Nothing can be learnt from "
            "it: it gets no fuzzy terms and no slope. Drop it, or train on data where it varies.",
            ConstantInputWarning,
            stacklevel=6,
        )


def _report_underdetermined(n_rules, n_basis, n_distinct):
    warnings.warn(
        f"{n_rules} rules with {n_basis} coefficients each are {n_rules * n_basis} consequent "
        f"parameters for {n_distinct} distinct training rows: the model can pass through every "
        "row and mean nothing between them. Judge it on rows held out, use fewer rules, or "
        "raise alpha.",
        UnderdeterminedWarning,
        stacklevel=6,
    )


def _parts_strongest(rows, antecedent):
    """Part of the data's weight on which each rule is the strongest."""
    parts = np.zeros(antecedent.n_rules)
    for chunk in rows.chunks(_READ_ROWS):
        for part in chunk:
            Z, _, weight = rows.read(part)
            strongest = antecedent.strengths(Z).argmax(axis=0)
            parts += np.bincount(strongest, weights=weight, minlength=parts.size)
    return parts / rows.total_weight


def _frozen(rows, antecedent, result, n_distinct, names, out_of_bounds) -> TSKModel:
    """The model in the user's units."""
    evaluation = result.evaluation
    offset, scale = rows.inputs.offset, rows.inputs.scale
    n_rules, n_outputs = antecedent.n_rules, rows.y.shape[1]
    coefficients = evaluation.coefficients.reshape(n_rules, -1, n_outputs) * rows.targets.scale
    coefficients[:, 1:] /= scale[:, None][: coefficients.shape[1] - 1]
    coefficients[:, 0] += rows.targets.offset
    return TSKModel(
        antecedent=evaluation.antecedent.change_units(offset, scale),
        initial_antecedent=antecedent.change_units(offset, scale),
        coefficients=coefficients,
        reference=offset,
        spread=scale,
        minimum=rows.inputs.minimum,
        maximum=rows.inputs.maximum,
        rule_weights=evaluation.masses,
        rule_rows=n_distinct * _parts_strongest(rows, evaluation.antecedent),
        input_names=tuple(map(str, names)),
        out_of_bounds=out_of_bounds,
    )
