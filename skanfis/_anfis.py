"""What every ANFIS estimator shares: validate, partition, solve, and hand out the frozen model."""

import inspect
import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from joblib import Parallel, delayed, effective_n_jobs
from sklearn import get_config
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils import check_random_state
from sklearn.utils.validation import has_fit_parameter
from threadpoolctl import ThreadpoolController

from ._automatic import Structure, StructureSearch
from .exceptions import ConstantInputWarning, UnderdeterminedWarning
from .membership import MEMBERSHIPS
from .model import TSKModel
from .objective import SeparableProblem
from .partition import (
    GridSize,
    clustered_antecedent,
    count_distinct_inputs,
    grid_antecedent,
    term_counts,
)
from .premise import Premise
from .rows import Rows
from .solvers import SOLVERS, SolverResult

__all__ = ["Training", "train"]

# Neighbouring terms of a grid cross at this membership at the start. From the customary 0.5, Jang's
# sinc gets stuck; elsewhere it makes little difference (benchmarks/start.py).
_OVERLAP = 0.6
_MIB = 2**20
# Distinct rows are counted up to here: more make no difference to any decision.
_ENOUGH_ROWS = 20_000
_READ_ROWS = 4096
# alpha="auto": as small as rounding allows where the data determine the consequents well; rounding
# errors grow by 1 / alpha along directions that the data leave open, so more where they do not.
_ALPHA, _ALPHA_FEW_ROWS = 1e-12, 1e-7


@dataclass(frozen=True, eq=False)
class Training:
    """A finished training."""

    model: TSKModel
    result: SolverResult
    start: Structure


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
    # One BLAS thread per worker: threads come from n_jobs, and sums do not depend on how many. One
    # OpenMP thread for the small clusterings, which more would only slow down.
    with _thread_pools().limit(limits=1):
        rows = Rows.standardised(X, y, sample_weight)
        n_distinct = count_distinct_inputs(rows, _ENOUGH_ROWS)
        start = _start(estimator, rows, names, n_distinct)
        problem = SeparableProblem(
            rows, start.antecedent, estimator.order, start.alpha, _ordered_map(estimator.n_jobs)
        )
        result = SOLVERS[estimator.solver](
            problem,
            Premise.of(start.antecedent, *_box(rows)),
            max_iter=estimator.max_iter,
            tol=estimator.tol,
            stiffness=start.stiffness,
            **_solver_options(estimator),
        )
    if not result.converged:
        warnings.warn(
            f"solver={estimator.solver!r} with {start.antecedent.n_rules} rules on {rows.n_rows} "
            f"rows, max_iter={estimator.max_iter}, tol={estimator.tol:g}: {result.message} The "
            "model is the best one found; increase max_iter or tol.",
            ConvergenceWarning,
            stacklevel=4,
        )
    model = _frozen(rows, start.antecedent, result, n_distinct, names, estimator.out_of_bounds)
    return Training(model, result, start)


@lru_cache(maxsize=1)
def _thread_pools():
    """The process's thread pools; looking for them takes as long as a small fit."""
    return ThreadpoolController()


def _solver_options(estimator):
    """What the solver takes beyond what all take; ValueError for what it does not take."""
    takes = inspect.signature(SOLVERS[estimator.solver]).parameters
    options = {}
    for name in ("step_size", "error_goal"):
        value = getattr(estimator, name)
        if value is not None and name not in takes:
            raise ValueError(
                f"{name}={value!r} means nothing to solver={estimator.solver!r}: leave it at None, "
                "or use solver='hybrid' or 'gradient'."
            )
        if value is not None:
            options[name] = value
    return options


def _box(rows):
    """Lowest and highest values of the inputs, standardised."""
    scale = rows.inputs
    return tuple((edge - scale.offset) / scale.scale for edge in (scale.minimum, scale.maximum))


def _ordered_map(n_jobs):
    """``map`` over worker threads, with the results in order."""
    if effective_n_jobs(n_jobs) == 1:
        return map

    def map_ordered(function, items):
        if len(items) == 1:
            return map(function, items)
        parallel = Parallel(n_jobs=n_jobs, backend="threading", return_as="generator")
        return parallel(delayed(function)(item) for item in items)

    return map_ordered


def _start(estimator, rows, names, n_distinct) -> Structure:
    """The rule base that training starts from, in standardised units, and its regularisation."""
    _check_combination(estimator)
    _report_constant(rows, names)
    family = MEMBERSHIPS[estimator.mf]
    alpha = None if isinstance(estimator.alpha, str) else estimator.alpha
    stiffness = None if isinstance(estimator.stiffness, str) else estimator.stiffness
    if isinstance(estimator.n_mfs, str) and isinstance(estimator.partition, str):
        # random_state=None stands for one fixed seed: the same data give the same model.
        state = estimator.random_state
        seed = 0 if state is None else check_random_state(state).randint(2**31 - 1)
        search = StructureSearch(
            rows, family, estimator.order, n_distinct, seed, alpha, stiffness, _OVERLAP
        )
        return search.run(grids_only=estimator.partition == "grid")
    if isinstance(estimator.n_mfs, str):
        weighted = rows.sample_weight is not None
        antecedent = clustered_antecedent(family, rows, _labeller(estimator.partition, weighted))
    else:
        counts = _grid_counts(estimator.n_mfs, rows, names)
        n_basis = 1 + len(names) if estimator.order == 1 else 1
        GridSize(counts, n_basis, rows.y.shape[1]).check_fits(
            estimator.n_mfs, get_config()["working_memory"] * _MIB, names
        )
        low, high = _box(rows)
        antecedent = grid_antecedent([family] * len(names), counts, low, high, _OVERLAP)
    is_poor = _report_underdetermined(antecedent.n_rules, estimator.order, rows, n_distinct)
    if alpha is None:
        alpha = _ALPHA_FEW_ROWS if is_poor else _ALPHA
    return Structure(antecedent, alpha, stiffness or 0.0, [])


def _check_combination(estimator):
    """Raise ValueError where two parameters contradict each other."""
    if isinstance(estimator.n_mfs, str) or isinstance(estimator.partition, str):
        return
    raise ValueError(
        f"n_mfs={estimator.n_mfs!r} asks for a grid, partition={estimator.partition!r} for "
        "scattered rules: leave n_mfs at 'auto', or use partition='grid'."
    )


def _grid_counts(n_mfs, rows, names):
    """Terms per input; none on an input that never changes."""
    constant = rows.inputs.is_constant
    counts = term_counts(n_mfs, names)
    if np.ndim(n_mfs) == 0:
        return [1 if flat else count for flat, count in zip(constant, counts, strict=True)]
    for name, flat, count in zip(names, constant, counts, strict=True):
        if flat and count > 1:
            raise ValueError(
                f"n_mfs={n_mfs!r} asks for {count} terms on column {name!r}, which is constant in "
                "the training data: give it 1, or drop the column."
            )
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


def _report_constant(rows, names):
    scale = rows.inputs
    flat = [
        f"{name!r} (always {value:.6g})"
        for name, value, is_flat in zip(names, scale.offset, scale.is_constant, strict=True)
        if is_flat
    ]
    if flat:
        warnings.warn(
            f"Constant in the training data: column {', '.join(flat)}. Nothing can be learnt from "
            "it: it gets no fuzzy terms and no slope. Drop it, or train on data where it varies.",
            ConstantInputWarning,
            stacklevel=6,
        )


def _report_underdetermined(n_rules, order, rows, n_distinct):
    """Warn of more parameters than rows; whether there are fewer than two rows for each."""
    n_basis = 1 + np.count_nonzero(~rows.inputs.is_constant) if order == 1 else 1
    n_columns = n_rules * n_basis
    if n_distinct == _ENOUGH_ROWS < 2 * n_columns:
        n_distinct = count_distinct_inputs(rows, 2 * n_columns)
    if n_columns > n_distinct:
        warnings.warn(
            f"{n_rules} rules with {n_basis} coefficients each are {n_columns} consequent "
            f"parameters for {n_distinct} distinct training rows: the model can pass through every "
            "row and mean nothing between them. Judge it on rows held out, use fewer rules, or "
            "raise alpha.",
            UnderdeterminedWarning,
            stacklevel=6,
        )
    return n_distinct < 2 * n_columns


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
