"""One fit, from checked data to the frozen model, in the order in which things happen.

1. Rows are held out, where training is to stop early (``stopping``).
2. With Huber's loss, what is far off is found before there is any model (``robust``).
3. ``structure`` gives a start: the rules, the weights of the penalty, where the premises stand.
4. A solver runs from there, again where its rules cannot be read one by one.
5. With Huber's loss the rows are weighted anew by what that left, and 3 and 4 repeated.
6. The model is frozen in the user's units (``freezing``), and rules that do nothing are listed
   (``pruning``).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, clone
from sklearn.exceptions import ConvergenceWarning

from .._threads import map_in_threads
from .._validation import warn_user
from ..bounds.exchange import constrained
from ..learning import SOLVERS, LeastSquares, Solver, VariableProjection
from ..learning.covariance import posterior_of
from ..learning.data import StandardisedData
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from ..learning.sampling import is_many, with_sample
from ..model import TSKModel
from ..options import EarlyStopping, Huber, policy_of
from ..search import (
    SampleSize,
    Start,
    StructureRequest,
    effective_weight,
    report_constant,
)
from .data import ValidatedData
from .freezing import ModelBuilder, as_given
from .outermost import told_by_outermost
from .progress import Callbacks, Printer, watch_all
from .pruning import redundant_rules, rule_statistics
from .result import Fitted, SolverRun
from .robust import MANY_ROWS, huber_weights, resistant, reweighted, some_rows, without_outliers
from .stopping import ValidationLoss, hold_out

__all__ = ["fit_rules"]

# Part of tol that a sample of many rows is trained to: its iterations cost next to nothing, and
# what is left to do is done on all rows.
_THOROUGH = 0.1
# The way there begins on a part of the sample, an iteration of which costs as much less; but no
# fewer rows than so many per consequent.
_PART_OF_SAMPLE, _ROWS_EACH = 4, 20
# Huber's loss. Turns of weights and fit at one structure: with sound settings a handful settles
# them, and what has not after these goes to and fro.
_MOST_TURNS = 20
# Weights are settled when they change by less than this on average: a tenth of what the scale of
# the residuals, a median of some hundred rows, is uncertain by.
_SETTLED = 1e-3
# The first start, one that sees the outliers less, and further ones where that is of another size.
_MOST_STARTS = 5


def fit_rules(
    estimator: Any,
    data: ValidatedData,
    request: StructureRequest,
    callbacks: Callbacks | None = None,
) -> Fitted:
    """Fit the rules of an estimator, whose parameters say how, to data.

    Parameters
    ----------
    estimator : ANFISRegressor
    data : ValidatedData
    request : StructureRequest
    callbacks : Callbacks, optional
        scikit-learn's.
    """
    if estimator.max_iter == 0 and isinstance(request.partition, TSKModel):
        return as_given(estimator, data, request.partition)

    fit = _Fit(estimator, data, request, callbacks)
    report_constant(fit.rows, data.input_names)
    weights = None
    if fit.huber is None:
        run = fit.run_from(fit.rows, fit.start(fit.rows))
    else:
        run, row_weights = fit.robust_run(fit.huber.epsilon)
        weights = data.spread_over_rows(row_weights, fit.trained_on)
    fit.warn_unless_converged(run)
    robust = None if fit.huber is None else (row_weights, fit.huber.epsilon)
    fitted = fit.frozen(run, weights)
    return fit.sure(fitted, run, robust)


class _Fit:
    """What every step of one fit needs: the rows, what was asked for, and who watches."""

    def __init__(self, estimator, data, request, callbacks):
        self.estimator, self.data = estimator, data
        self.callbacks = callbacks
        self.printer = Printer(type(estimator).__name__) if estimator.verbose else None
        self.solver: Solver = _object_for(estimator.solver, SOLVERS)
        if estimator.max_iter == 0:
            self.solver = LeastSquares()
        self.huber = _object_for(estimator.loss, {"huber": Huber, "squared_error": None})
        self.stopping = _object_for(estimator.early_stopping, {True: EarlyStopping, False: None})
        self.rng = np.random.default_rng(request.seed)
        self.map_ordered = map_in_threads(estimator.n_jobs)
        self.rows, self.trained_on, self.held_out = data.rows(), slice(None), None
        if self.stopping is not None:
            seed = int(self.rng.integers(2**31 - 1))
            fraction = self.stopping.validation_fraction
            self.trained_on, validation = hold_out(self.rows, fraction, seed)
            held_out, self.rows = self.rows.part(validation), data.rows(self.trained_on)
            self.held_out = replace(held_out, inputs=self.rows.inputs, targets=self.rows.targets)
        elif is_many(self.rows) and self.huber is None:
            self.rows = with_sample(self.rows)
        self.size = SampleSize.of(self.rows.sample or self.rows)
        # A slope by a column that never changes is nothing that data could tell of.
        slopes, is_constant = request.consequent_inputs, self.rows.inputs.is_constant
        self.request = replace(request, consequent_inputs=slopes[~is_constant[slopes]])

    @property
    def builder(self) -> ModelBuilder:
        """What makes models of what is found on the rows as they are now."""
        return ModelBuilder(self.data, self.rows, self.request, self.estimator.out_of_bounds)

    def start(self, rows: StandardisedData) -> Start:
        """Where a run begins: rules, weights of the penalty, and the premises so far."""
        start = self.request.start(rows.sample or rows, self.size)
        if rows.sample is not None:
            start = self.request.for_all(start, rows.sample, rows)
        if not self.solver.goes_on_from_tuning:
            start = replace(start, displacement=None)
        if self.printer is not None:
            self.printer.tell_start(start)
        return start

    def run_from(self, rows: StandardisedData, start: Start) -> SolverRun:
        """The run from a start.

        Of many rows a sample decides on how much premises are held and rules agree, and where the
        premises are: what is left to do on all rows is a step or two.
        """
        if rows.sample is None:
            return self.run(rows, start)
        for part in self.parts_of_sample(rows.sample, start):
            # Iterations on a sample are not told.
            found = self.run(part, start, is_watched=False)
            start = found.start
            if self.is_projecting:
                start = replace(start, displacement=found.displacement)
        return self.run(rows, start)

    @property
    def is_projecting(self) -> bool:
        """Whether premises can be trained on a sample, and go on from there on all rows."""
        return isinstance(self.solver, VariableProjection)

    def parts_of_sample(self, sample: StandardisedData, start: Start) -> list[StandardisedData]:
        """What is trained on, one after the other: a part of the sample if that is enough, all."""
        n_basis = 1 + (self.request.consequent_inputs.size if self.estimator.order else 0)
        n_columns = start.antecedent.n_rules * n_basis
        few = max(sample.n_rows // _PART_OF_SAMPLE, _ROWS_EACH * n_columns)
        if not self.is_projecting or 2 * few > sample.n_rows:
            return [sample]
        # The first rows of a sample are a sample.
        return [sample.part(slice(few)), sample]

    def run(self, rows: StandardisedData, start: Start, is_watched=True) -> SolverRun:
        """One run of the solver from a start; its iterations are told where it is watched."""
        estimator, displacement = self.estimator, start.displacement
        problem, premise = self.problem(rows.sample or rows, start), _premise(rows, start)
        validation = None
        if self.held_out is not None:
            validation = ValidationLoss(
                self.held_out,
                self.request.consequent_inputs,
                self.stopping.n_iter_no_change,
                self.stopping.tol,
            )
        watchers: list[Callable | None] = [validation]
        if is_watched:
            watchers += [self.printer, self.iteration_watcher(start)]
        if displacement is not None:
            displacement = np.clip(displacement, premise.lower, premise.upper)
        solver = self.solver
        if rows.sample is not None:
            problem = problem.on_all(rows)
        elif self.rows.sample is not None and self.is_projecting:
            solver = clone(solver).set_params(tol=_THOROUGH * solver.tol)
        result = solver.solve(
            problem,
            premise,
            max_iter=estimator.max_iter,
            stiffness=start.penalty.stiffness,
            start=displacement,
            on_iteration=watch_all(*watchers),
        )
        if validation is None:
            return SolverRun(start, problem, premise, result)
        result = validation.restored(result)
        return SolverRun(start, problem, premise, result, tuple(validation.losses))

    def problem(self, rows: StandardisedData, start: Start) -> SeparableProblem:
        """The least-squares problem at a start."""
        return SeparableProblem(
            rows,
            start.antecedent,
            self.estimator.order,
            start.penalty,
            self.map_ordered,
            self.request.consequent_inputs,
        )

    def robust_run(self, epsilon: float) -> tuple[SolverRun, np.ndarray]:
        """Runs and weights in turns, until the weights settle.

        The first start and what comes of it may have seen outliers: once the weights are settled,
        training starts afresh, from a start that sees no row of less than half its weight, and
        again for as long as that start comes out another one.
        """
        self.rows, weights = resistant(self.rows)
        if self.held_out is not None:
            self.held_out = replace(self.held_out, targets=self.rows.targets)
        rows, n_starts = self.rows, _MOST_STARTS
        if rows.n_rows > MANY_ROWS:
            # Some rows show as well as all what a sound model leaves, and at a price that does not
            # grow with their number. One start from there is then as good as several.
            some = some_rows(rows.n_rows)
            run, _ = self.robust_turns(rows.part(some), weights[some], epsilon, n_starts)
            weights = huber_weights(
                self.problem(rows, run.start), run.evaluation, epsilon, rows.sample_weight
            )
            n_starts = 1
        return self.robust_turns(rows, weights, epsilon, n_starts)

    def robust_turns(self, rows, weights, epsilon, n_starts):
        """Starts, and from each of them turns of fit and weights until these settle."""
        run: SolverRun | None = None
        for turn in range(n_starts):
            start = self.start(without_outliers(rows, weights))
            if run is not None and turn > 1 and _is_of_one_size(start, run.start):
                break
            # What the first start makes of outliers need not be read.
            is_kept = turn > 0 or n_starts == 1
            first_run = self.run_from if is_kept else self.run
            run = first_run(reweighted(rows, weights), start)
            run, weights = self.settled(rows, run, weights, epsilon)
        assert run is not None
        return run, weights

    def settled(self, rows, run, weights, epsilon):
        """Weights and fit in turns, at one structure."""
        for _ in range(_MOST_TURNS):
            before, own = weights, rows.sample_weight
            weights = huber_weights(run.problem, run.evaluation, epsilon, own)
            start = replace(run.start, displacement=run.displacement)
            run = self.run(reweighted(rows, weights), start)
            change = float(np.mean(np.abs(weights - before)))
            if change < _SETTLED:
                return run, weights
        warn_user(
            f"loss='huber': the weights of the rows still change by {change:.2g} on average after "
            f"{_MOST_TURNS} turns. Use fewer rules, or loss=Huber(epsilon=...) with a larger one.",
            ConvergenceWarning,
        )
        return run, weights

    def iteration_watcher(self, start):
        """What tells scikit-learn's callbacks of every iteration; None where there are none."""
        if self.callbacks is None:
            return None
        callbacks = self.callbacks

        def watch(n_iter, evaluation):
            return callbacks.task("iteration", lambda: self.builder.model(start, evaluation))

        return watch

    def warn_unless_converged(self, run):
        """Warn where the solver would have gone on."""
        estimator, result = self.estimator, run.result
        if result.converged or estimator.max_iter == 0:
            return
        warn_user(
            f"solver={estimator.solver!r} with {run.start.antecedent.n_rules} rules on "
            f"{self.rows.n_rows} rows, max_iter={estimator.max_iter}: {result.message} The model "
            "is the best one found; increase max_iter or the solver's tol.",
            ConvergenceWarning,
        )

    def posterior(self, run, robust):
        """What standard deviations need; ``robust`` are the weights of rows and Huber's epsilon."""
        learnt = run.premise if self.solver.moves_premises else None
        n_rows = effective_weight(run.problem.rows)
        return posterior_of(run.problem, learnt, run.evaluation, n_rows, robust)

    def frozen(self, run, weights) -> Fitted:
        """What the run leaves, of which no deviations are known yet."""
        firing = self.builder.firing(run.evaluation)
        return Fitted(
            self.builder.model(run.start, run.evaluation, firing),
            run.result,
            run.start,
            redundant_rules(rule_statistics(self.rows, firing)),
            weights,
            run.validation_losses,
        )

    def sure(self, fitted, run, robust) -> Fitted:
        """The same with a posterior, and with what is known kept, and proven to be."""
        model = replace(fitted.model, posterior=self.posterior(run, robust))
        model = replace(model, told_extrapolation=told_by_outermost(model, self.rows))
        model = model.with_out_of_bounds(*policy_of(self.estimator.out_of_bounds))
        fitted = replace(fitted, model=model)
        return fitted if self.data.wishes is None else self.constrained(fitted, run)

    def constrained(self, fitted, run) -> Fitted:
        """The nearest model that keeps what is known, its result, and a report."""
        evaluation, model, wishes = run.evaluation, fitted.model, self.data.wishes
        if evaluation.normal is None:
            # Found by descent: the consequents are solved for first.
            evaluation = run.problem.evaluate(evaluation.antecedent.parameters)
        in_user_units = self.builder.in_user_units
        evaluation, report, solved = constrained(
            model, evaluation, run.problem, wishes, in_user_units
        )
        model = replace(model, coefficients=in_user_units(evaluation.coefficients))
        target = model.target.within(wishes.lower, wishes.upper, wishes.values)
        model = replace(model, target=target)
        if model.posterior is not None:
            model = replace(model, posterior=model.posterior.given(model, solved.known))
        return replace(
            fitted,
            model=model,
            result=replace(run.result, evaluation=evaluation),
            constraints=report,
        )


def _object_for(given, by_word):
    """The object that a word stands for, or that is given in its place; None for no object."""
    if isinstance(given, BaseEstimator):
        return given
    of_word = by_word[given]
    return None if of_word is None else of_word()


def _premise(rows: StandardisedData, start: Start) -> Premise:
    """What moves at a start, within the box of the data."""
    low, high = rows.inputs.box
    return Premise.of(start.antecedent, low, high, start.is_free)


def _is_of_one_size(one: Start, other: Start) -> bool:
    """Whether two starts have as many rules and terms."""
    sizes = [(s.antecedent.n_rules, s.antecedent.n_terms) for s in (one, other)]
    return sizes[0] == sizes[1]
