"""What every ANFIS estimator shares: from validated data to the frozen model.

The order of things: rows may be held out for early stopping; the partition gives a start; the
solver runs from it, once or from several starts; the rows may be reweighted between runs; the rules
are frozen in the user's units. Each is a module of ``training``.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.exceptions import ConvergenceWarning

from ._threads import map_in_threads, one_blas_thread
from ._validation import warn_user
from .model import TSKModel
from .options import EarlyStopping, Huber, policy_of
from .penalty import Penalty
from .rows import Rows, check_scales
from .solvers import SOLVERS, LeastSquares, SolverResult
from .structure import SampleSize, Start, StructureRequest, imported_antecedent, report_constant
from .support import RuleSupport
from .training import (
    Learned,
    Learner,
    Printer,
    ValidationLoss,
    hold_out,
    learn_from_starts,
    learn_robustly,
    redundant_rules,
    resistant,
    rule_statistics,
    watch_all,
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
    with one_blas_thread():
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
    policy, limit = policy_of(estimator.out_of_bounds)
    model = replace(
        model,
        initial_antecedent=model.antecedent,
        input_names=data.input_names,
        output_names=data.output_names,
        out_of_bounds=policy,
        max_extrapolation=limit,
    )
    rows = Rows.standardised(data.X, data.y, data.sample_weight)
    # Rows beyond the model's range count as they are predicted, or where that is not at all, held.
    answering = model if model.out_of_bounds == "linear" else model.with_out_of_bounds("clip")
    residual = (data.y - answering.predict(data.X)) / rows.targets.scale
    loss = np.average(np.sum(residual**2, axis=1), weights=data.sample_weight)
    redundant = redundant_rules(rule_statistics(rows, imported_antecedent(model, rows)))
    result = SolverResult(None, np.full(2, loss), 0, "as_given")
    return Training(model, result, Start(model.antecedent, Penalty()), redundant)


class _Trainer:
    """One training: the data, the settings, and who watches."""

    def __init__(self, estimator, data, request, bridge):
        self.estimator, self.data, self.request, self.bridge = estimator, data, request, bridge
        self.rng = np.random.default_rng(request.seed)
        self.training, self.held_out = slice(None), None
        self.rows = data.rows()
        self.stopping = _option(estimator.early_stopping, {True: EarlyStopping, False: None})
        self.huber = _option(estimator.loss, {"huber": Huber, "squared_error": None})
        if self.stopping is not None:
            self.training, validation = hold_out(
                self.rows, self.stopping.validation_fraction, int(self.rng.integers(2**31 - 1))
            )
            self.rows, every = data.rows(self.training), self.rows
            held_out = every.part(validation)
            self.held_out = replace(held_out, inputs=self.rows.inputs, targets=self.rows.targets)
        self.size = SampleSize.of(self.rows)
        self.learner = Learner(
            LeastSquares() if estimator.max_iter == 0 else _option(estimator.solver, SOLVERS),
            estimator.order,
            request.consequent_inputs,
            estimator.max_iter,
            map_in_threads(estimator.n_jobs if estimator.n_init == 1 else 1),
        )
        self._counted = None
        self.printer = Printer(type(estimator).__name__) if estimator.verbose else None

    def train(self) -> Training:
        report_constant(self.rows, self.data.input_names)
        weights = None
        if self.huber is not None:
            self.rows, weights = resistant(self.rows)
            if self.held_out is not None:
                self.held_out = replace(self.held_out, targets=self.rows.targets)
            learned, weights = learn_robustly(
                self._learn, self._start, self.rows, self.huber.epsilon, weights
            )
        else:
            learned = self._learn(self.rows, self._start(self.rows), None)
        start, result = learned.start, learned.result
        losses = learned.validation_losses if self.held_out is not None else None
        redundant = redundant_rules(self._statistics(result.evaluation))
        self._report(start, result)
        model = self.freeze(start, result.evaluation)
        if weights is not None:
            weights = self.data.spread_over_rows(weights, self.training)
        return Training(model, result, start, redundant, weights, losses)

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
        policy, limit = policy_of(self.estimator.out_of_bounds)
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
            out_of_bounds=policy,
            max_extrapolation=limit,
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
        if not self.learner.solver.goes_on_from_tuning:
            # Where the evidence was sought, variable projection has moved the premises already.
            start = replace(start, displacement=None)
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
            stopper = ValidationLoss(
                self.held_out,
                self.request.consequent_inputs,
                self.stopping.n_iter_no_change,
                self.stopping.tol,
            )
        printer = self.printer if is_alone else None
        bridge = None
        if self.bridge is not None and is_alone:

            def bridge(n_iter, evaluation):
                return self.bridge.task("iteration", self, start, evaluation)

        watch = watch_all(stopper, printer, bridge)
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

    def _statistics(self, evaluation):
        """How the rules fire at an evaluation; a pass over the rows, for the last one kept."""
        if self._counted is None or self._counted[0] is not evaluation:
            self._counted = evaluation, rule_statistics(self.rows, evaluation.antecedent)
        return self._counted[1]

    def _report(self, start, result):
        estimator = self.estimator
        if result.converged or estimator.max_iter == 0:
            return
        warn_user(
            f"solver={estimator.solver!r} with {start.antecedent.n_rules} rules on "
            f"{self.rows.n_rows} rows, max_iter={estimator.max_iter}: {result.message} The model "
            "is the best one found; increase max_iter or the solver's tol.",
            ConvergenceWarning,
        )


def _option(given, by_word):
    """The object that a word stands for, or that is given in its place; None for no object."""
    if isinstance(given, BaseEstimator):
        return given
    of_word = by_word[given]
    return None if of_word is None else of_word()
