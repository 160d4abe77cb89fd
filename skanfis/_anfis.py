"""What every ANFIS estimator shares: from validated data to the frozen model.

The order of things: rows may be held out for early stopping; the partition gives a start; the
solver runs from it, once or from several starts; the ridge may be chosen and the rows reweighted
between runs; rules that do nothing may be pruned; what is left is frozen in the user's units. Each
is a module of ``training``.
"""

import inspect
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from joblib import Parallel, delayed, effective_n_jobs
from sklearn.exceptions import ConvergenceWarning
from threadpoolctl import ThreadpoolController

from ._validation import warn_user
from .antecedent import GridAntecedent
from .model import TSKModel
from .naming import default_term_names, given_term_names
from .penalty import Penalty
from .rows import Rows, check_scales
from .solvers import SOLVERS, SolverResult
from .structure import SampleSize, Start, StructureRequest, imported_antecedent, report_constant
from .support import RuleSupport
from .training import (
    EarlyStopping,
    Keeper,
    Learned,
    Learner,
    Printer,
    hold_out,
    learn_from_starts,
    learn_robustly,
    redundant_rules,
    resistant,
    rule_statistics,
    watch_all,
    without_rules,
)

__all__ = ["Training", "TrainingData", "train"]


@dataclass(frozen=True, eq=False)
class TrainingData:
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
    """

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None
    groups: np.ndarray | None
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    kept: np.ndarray | None = None

    def rows(self, indices=slice(None)):
        """Some of the rows, on scales of their own."""
        weight = None if self.sample_weight is None else self.sample_weight[indices]
        groups = None if self.groups is None else self.groups[indices]
        rows = Rows.standardised(self.X[indices], self.y[indices], weight, groups)
        check_scales(rows.inputs, rows.targets, self.input_names, self.output_names)
        return rows

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
class Training:
    """A finished training."""

    model: TSKModel
    result: SolverResult
    start: Start
    redundant_rules: list[dict]
    pruning: dict | None = None
    robust_weights: np.ndarray | None = None
    validation_losses: tuple[float, ...] | None = None


def train(estimator, data: TrainingData, request: StructureRequest, bridge=None) -> Training:
    """Train an estimator.

    Parameters
    ----------
    estimator : object
        Where the parameters are read from.
    data : TrainingData
    request : StructureRequest
    bridge : CallbackBridge, optional
        To scikit-learn's callbacks.
    """
    # One BLAS thread per worker: threads come from n_jobs, and sums do not depend on how many. One
    # OpenMP thread for the small clusterings, which more would only slow down.
    with _thread_pools().limit(limits=1):
        if estimator.max_iter == 0 and isinstance(request.partition, TSKModel):
            return _as_given(estimator, data, request.partition)
        return _Trainer(estimator, data, request, bridge).train()


def _as_given(estimator, data, model) -> Training:
    """The imported model itself, with its error on the data."""
    if model.n_outputs != data.y.shape[1]:
        raise ValueError(
            f"partition is a model of {model.n_outputs} outputs, but y has {data.y.shape[1]}: with "
            "max_iter=0 the model is taken as it is."
        )
    names = model.term_names
    if estimator.term_names is not None:
        names = given_term_names(model.antecedent, data.input_names, estimator.term_names)
    model = replace(
        model,
        initial_antecedent=model.antecedent,
        input_names=data.input_names,
        output_names=data.output_names,
        term_names=names,
        out_of_bounds=estimator.out_of_bounds,
        max_extrapolation=estimator.max_extrapolation,
    )
    rows = Rows.standardised(data.X, data.y, data.sample_weight)
    # Rows beyond the model's range count as they are predicted, or where that is not at all, held.
    answering = model if model.out_of_bounds == "linear" else model.with_out_of_bounds("clip")
    residual = (data.y - answering.predict(data.X)) / rows.targets.scale
    loss = np.average(np.sum(residual**2, axis=1), weights=data.sample_weight)
    redundant = redundant_rules(rule_statistics(rows, imported_antecedent(model, rows)))
    result = SolverResult(None, np.full(2, loss), 0, "as_given")
    return Training(model, result, Start(model.antecedent, Penalty()), redundant)


@lru_cache(maxsize=1)
def _thread_pools():
    """The process's thread pools; looking for them takes as long as a small fit."""
    return ThreadpoolController()


class _Trainer:
    """One training: the data, the settings, and who watches."""

    def __init__(self, estimator, data, request, bridge):
        self.estimator, self.data, self.request, self.bridge = estimator, data, request, bridge
        self.rng = np.random.default_rng(request.seed)
        self.training, self.held_out = slice(None), None
        self.rows = data.rows()
        if estimator.early_stopping:
            self.training, validation = hold_out(
                self.rows, estimator.validation_fraction, int(self.rng.integers(2**31 - 1))
            )
            self.rows, every = data.rows(self.training), self.rows
            held_out = every.part(validation)
            self.held_out = replace(held_out, inputs=self.rows.inputs, targets=self.rows.targets)
        self.size = SampleSize.of(self.rows)
        self.learner = Learner(
            "lse" if estimator.max_iter == 0 else estimator.solver,
            estimator.order,
            request.consequent_inputs,
            estimator.max_iter,
            estimator.tol,
            _solver_options(estimator),
            _ordered_map(estimator.n_jobs if estimator.n_init == 1 else 1),
        )
        self._counted = None
        self.keeper = Keeper() if estimator.on_interrupt == "stop" else None
        self.printer = Printer(type(estimator).__name__) if estimator.verbose else None

    def train(self) -> Training:
        report_constant(self.rows, self.data.input_names)
        weights = None
        try:
            if self.estimator.loss == "huber":
                self.rows, weights = resistant(self.rows)
                if self.held_out is not None:
                    self.held_out = replace(self.held_out, targets=self.rows.targets)
                learned, weights = learn_robustly(
                    self._learn, self._start, self.rows, self.estimator.epsilon, weights
                )
            else:
                learned = self._learn(self.rows, self._start(self.rows), None)
            learned, redundant, pruning = self._prune(learned)
            start, result = learned.start, learned.result
            losses = learned.validation_losses if self.held_out is not None else None
        except KeyboardInterrupt:
            if self.keeper is None or self.keeper.best is None:
                raise
            start, result = self.keeper.end()
            redundant, pruning, losses = self._redundant(result), None, None
        self._report(start, result)
        model = self.freeze(start, result.evaluation)
        if weights is not None:
            weights = self.data.spread_over_rows(weights, self.training)
        return Training(model, result, start, redundant, pruning, weights, losses)

    def freeze(self, start, evaluation) -> TSKModel:
        """The model in the user's units."""
        rows, antecedent = self.rows, start.antecedent
        offset, scale = rows.inputs.offset, rows.inputs.scale
        n_rules, n_outputs = antecedent.n_rules, rows.y.shape[1]
        solved = evaluation.coefficients.reshape(n_rules, -1, n_outputs) * rows.targets.scale
        solved[:, 0] += rows.targets.offset
        coefficients = solved
        if self.estimator.order == 1:
            inputs = self.request.consequent_inputs
            coefficients = np.zeros((n_rules, 1 + offset.size, n_outputs))
            coefficients[:, 0] = solved[:, 0]
            coefficients[:, 1 + inputs] = solved[:, 1:] / scale[inputs, None]
        trained = evaluation.antecedent.change_units(offset, scale)
        strongest = self._statistics(evaluation).strongest
        return TSKModel(
            antecedent=trained,
            initial_antecedent=antecedent.change_units(offset, scale),
            coefficients=coefficients,
            reference=offset,
            spread=scale,
            minimum=rows.inputs.minimum,
            maximum=rows.inputs.maximum,
            rule_weights=evaluation.masses,
            rule_rows=rows.n_rows * strongest,
            input_names=self.data.input_names,
            out_of_bounds=self.estimator.out_of_bounds,
            max_extrapolation=self.estimator.max_extrapolation,
            support=RuleSupport.of(
                rows,
                evaluation.antecedent,
                1 + int(np.sum(~rows.inputs.is_constant[self.request.consequent_inputs])),
            ).change_units(offset, scale),
            term_names=start.term_names,
            output_names=self.data.output_names,
        )

    def _start(self, rows):
        start = self.request.start(rows, self.size)
        if self.learner.solver != "varpro":
            # Where the evidence was sought, variable projection has moved the premises already.
            start = replace(start, displacement=None)
        if self.estimator.term_names is not None:
            antecedent = start.antecedent.change_units(rows.inputs.offset, rows.inputs.scale)
            start = replace(
                start,
                term_names=given_term_names(
                    antecedent, self.data.input_names, self.estimator.term_names
                ),
            )
        if self.printer is not None:
            candidates = start.candidates
            found = f"{len(candidates)} candidates compared, " if candidates else ""
            self.printer.note(
                f"{found}{start.antecedent.n_rules} rules, "
                f"agreement {start.penalty.agreement:.3g}, "
                f"alpha {start.penalty.alpha:.3g}, stiffness {start.penalty.stiffness:.3g}"
            )
        return start

    def _learn(self, rows, start, displacement):
        """Train on some rows, from several starts unless there is a displacement already."""
        run = partial(self._run, self.learner, rows, start)
        if displacement is not None or self.estimator.n_init == 1:
            return run(displacement, is_alone=True)
        return learn_from_starts(
            partial(run, is_alone=False),
            self.learner.premise(rows, start),
            start.displacement,
            self.estimator.n_init,
            self.rng,
            self.estimator.n_jobs,
            self._tell_of_start,
        )

    def _run(self, learner, rows, start, displacement, is_alone) -> Learned:
        """One run of the solver, watched."""
        stopper = None
        if self.held_out is not None:
            stopper = EarlyStopping(
                self.held_out,
                self.request.consequent_inputs,
                self.estimator.n_iter_no_change,
                self.estimator.tol,
            )
        keep = None if self.keeper is None else self.keeper.of(start)
        printer = self.printer if is_alone else None
        bridge = None
        if self.bridge is not None and is_alone:

            def bridge(n_iter, evaluation):
                return self.bridge.task("iteration", self, start, evaluation)

        watch = watch_all(stopper, keep, printer, bridge)
        learned = learner.run(rows, start, displacement, watch)
        if stopper is None:
            return learned
        return replace(
            learned,
            result=stopper.restored(learned.result),
            validation_losses=tuple(stopper.losses),
        )

    def _tell_of_start(self, learned):
        result = learned.result
        if self.printer is not None:
            loss = result.evaluation.mean_squared_error
            self.printer.note(f"a start: loss {loss:.6g} after {result.n_iter} iterations")
        if self.bridge is None:
            return False
        return self.bridge.task("start", self, learned.start, result.evaluation)

    def _redundant(self, result):
        return redundant_rules(self._statistics(result.evaluation))

    def _statistics(self, evaluation):
        """How the rules fire at an evaluation; a pass over the rows, for the last one kept."""
        if self._counted is None or self._counted[0] is not evaluation:
            self._counted = evaluation, rule_statistics(self.rows, evaluation.antecedent)
        return self._counted[1]

    def _prune(self, learned):
        """The redundant rules, and the training without them where that is asked for."""
        redundant = self._redundant(learned.result)
        if not (self.estimator.prune and redundant):
            return learned, redundant, None
        rules = [entry["rule"] for entry in redundant]
        trained = learned.result.evaluation.antecedent
        left, terms = without_rules(trained, rules)
        names = learned.start.term_names
        if not names and isinstance(trained, GridAntecedent):
            names = default_term_names(trained)
        start = replace(
            learned.start,
            antecedent=left,
            term_names=tuple(names[t] for t in terms) if names else (),
        )
        rows = learned.problem.rows
        as_it_is = np.zeros(self.learner.premise(rows, start).size)
        again = self._learn(rows, start, as_it_is)
        pruning = {
            "rules": redundant,
            "loss_before": learned.result.evaluation.mean_squared_error,
            "loss_after": again.result.evaluation.mean_squared_error,
        }
        initial, _ = without_rules(learned.start.antecedent, rules)
        again = replace(again, start=replace(again.start, antecedent=initial))
        return again, redundant, pruning

    def _report(self, start, result):
        estimator = self.estimator
        if result.converged or estimator.max_iter == 0:
            return
        hint = "" if result.status == "interrupted" else "; increase max_iter or tol"
        warn_user(
            f"solver={estimator.solver!r} with {start.antecedent.n_rules} rules on "
            f"{self.rows.n_rows} rows, max_iter={estimator.max_iter}, tol={estimator.tol:g}: "
            f"{result.message} The model is the best one found{hint}.",
            ConvergenceWarning,
        )


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
    return {} if estimator.max_iter == 0 else options


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
