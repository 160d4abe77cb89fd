"""One fit, from checked data to the frozen model, in the order in which things happen.

1. If training may stop early, rows are held out (``watching``).
2. With Huber's loss, outliers are weighted down before there is any model (``robust``).
3. ``search`` gives a start: the rules, the weights of the penalty, the premises so far.
4. A solver runs from there; if there are many rows, on a sample first.
5. With Huber's loss, the residuals give the rows new weights, and the solver runs again until
   these settle; then 3 to 5 are repeated without the outliers.
6. The model is frozen in the user's units (``freezing``), and redundant rules are listed
   (``pruning``).
"""

from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning

from .._threads import map_in_threads
from .._validation import warn_user
from ..bounds.fitting import held_in_search, proven_consequents
from ..inspection.anova import input_marginals
from ..learning import LeastSquares, VariableProjection
from ..learning.covariance import posterior_of
from ..learning.data import StandardisedData
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from ..learning.sampling import is_many, with_sample
from ..model import TSKModel
from ..options import EarlyStopping, Huber, policy_of
from ..search import Start, StructureRequest, report_constant
from .data import Fitted, SolverRun, ValidatedData
from .freezing import as_given, frozen_model
from .robust import huber_weights, reweighted, robust_start, silenced, without_outliers
from .settings import solver_of
from .watching import Callbacks, Printer, ValidationLoss, hold_out, watch_all

# A sample is trained to this part of tol. Its iterations cost next to nothing, and the fewer are
# left to do on all rows.
_THOROUGH = 0.1
# Turns of weights and fit with Huber's loss. With sound settings the weights settle after a few;
# those that have not settled after this many oscillate.
_MOST_TURNS = 20
# Weights are settled when they change by less than this on average: a tenth of the uncertainty of
# the residuals' scale, a median of some hundred rows.
_SETTLED = 1e-3


def fit_rules(
    estimator: Any,
    data: ValidatedData,
    request: StructureRequest,
    callbacks: Callbacks | None = None,
) -> Fitted:
    """Fit the rules of an estimator to data; its parameters say how."""
    if estimator.max_iter == 0 and isinstance(request.partition, TSKModel):
        return as_given(estimator, data, request.partition)
    fit = _Fit(estimator, data, request, callbacks)
    report_constant(fit.rows, data.input_names)
    weights = None
    if fit.huber is None:
        run = fit.run(fit.rows, fit.start(fit.rows))
    else:
        run, weights = fit.robust_run()
    fit.warn_unless_converged(run)
    fitted = fit.frozen(run, weights)
    return fitted if data.constraints is None else fit.constrained(fitted, run, weights)


class _Fit:
    """All that the steps of one fit share: the rows, the request, the solver, and the watchers."""

    def __init__(self, estimator, data, request, callbacks):
        self.estimator, self.data, self.callbacks = estimator, data, callbacks
        self.printer = Printer(type(estimator).__name__) if estimator.verbose else None
        self.solver = solver_of(estimator) if estimator.max_iter > 0 else LeastSquares()
        self.huber, self.stopping = estimator.loss, estimator.early_stopping
        if not isinstance(self.huber, Huber):
            self.huber = Huber() if self.huber == "huber" else None
        if not isinstance(self.stopping, EarlyStopping):
            self.stopping = EarlyStopping() if self.stopping else None
        self.map_ordered = map_in_threads(estimator.n_jobs)
        self.rows, self.trained_on, self.held_out = data.rows(), slice(None), None
        if self.stopping is not None:
            seed = int(np.random.default_rng(request.seed).integers(2**31 - 1))
            fraction = self.stopping.validation_fraction
            self.trained_on, validation = hold_out(self.rows, fraction, seed)
            held_out, self.rows = self.rows.part(validation), data.rows(self.trained_on)
            self.held_out = replace(held_out, inputs=self.rows.inputs, targets=self.rows.targets)
        elif is_many(self.rows) and self.huber is None:
            self.rows = with_sample(self.rows)
        # A slope by a constant column cannot be learnt.
        inputs, is_constant = request.consequent_inputs, self.rows.inputs.is_constant
        self.request = replace(
            request,
            consequent_inputs=inputs[~is_constant[inputs]],
            held=held_in_search(data.constraints),
            tell=self.printer and self.printer.write,
        )

    def start(self, rows: StandardisedData) -> Start:
        """The start of a run: rules, weights of the penalty, and the premises so far."""
        start = self.request.start(rows.sample or rows)
        if rows.sample is not None:
            start = self.request.for_all(start, rows.sample, rows)
        if not self.solver.goes_on_from_tuning:
            # Descents begin afresh, and every rule has slopes of its own.
            penalty = replace(start.penalty, common=(), absent=())
            start = replace(start, displacement=None, penalty=penalty)
        if self.printer is not None:
            self.printer.tell_start(start)
        return start

    def run(self, rows: StandardisedData, start: Start) -> SolverRun:
        """Run the solver from a start; a sample of many rows leaves a step or two for all rows."""
        if rows.sample is None or not isinstance(self.solver, VariableProjection):
            return self._solved(rows, start, self.solver)
        thorough = clone(self.solver).set_params(tol=_THOROUGH * self.solver.tol)
        # Watchers only see the iterations on all rows.
        found = self._solved(rows.sample, start, thorough, is_watched=False)
        return self._solved(rows, replace(start, displacement=found.displacement), self.solver)

    def _solved(self, rows, start, solver, is_watched=True):
        low, high = rows.inputs.box
        premise = Premise.of(start.antecedent, low, high, start.is_unbounded)
        problem = SeparableProblem(
            rows.sample or rows,
            start.antecedent,
            start.penalty,
            self.map_ordered,
            start.consequent_inputs,
        )
        if rows.sample is not None:
            problem = problem.on_all(rows)
        validation = None
        if self.held_out is not None:
            validation = ValidationLoss(self.held_out, start.consequent_inputs, self.stopping)

        def tell_callbacks(n_iter, evaluation):
            now = self.data, self.rows, self.request, start, evaluation
            return self.callbacks.iteration(lambda: self._answering(frozen_model(*now)[0]))

        watchers = [self.printer, self.callbacks and tell_callbacks] if is_watched else []
        displacement = start.displacement
        if displacement is not None:
            displacement = np.clip(displacement, premise.lower, premise.upper)
        result = solver.solve(
            problem,
            premise,
            max_iter=self.estimator.max_iter,
            stiffness=start.penalty.stiffness,
            start=displacement,
            on_iteration=watch_all(validation, *watchers),
        )
        if validation is None:
            return SolverRun(start, problem, premise, result)
        result = validation.restored(result)
        return SolverRun(start, problem, premise, result, np.array(validation.losses))

    def robust_run(self) -> tuple[SolverRun, np.ndarray]:
        """Runs and weights in turns, until the weights settle; twice.

        Outliers have shaped the first start, and so its result. Once the weights have settled,
        training starts afresh without the rows that keep less than half their weight.
        """
        self.rows, weights = robust_start(self.rows)
        if self.held_out is not None:
            self.held_out = replace(self.held_out, targets=self.rows.targets)
        _, weights = self._robust_turns(weights)
        return self._robust_turns(weights)

    def _robust_turns(self, weights):
        rows, epsilon = self.rows, self.huber.epsilon
        start = self.start(without_outliers(rows, weights))
        # Outliers count next to nothing in the first run, so that no rule moves to them.
        run = self.run(reweighted(rows, silenced(weights)), start)
        for _ in range(_MOST_TURNS):
            before = weights
            weights = huber_weights(run.problem, run.evaluation, epsilon, rows.weights)
            start = replace(run.start, displacement=run.displacement)
            run = self.run(reweighted(rows, weights), start)
            change = float(np.average(np.abs(weights - before), weights=rows.sample_weight))
            if change < _SETTLED:
                return run, weights
        warn_user(
            f"loss='huber' did not converge: after {_MOST_TURNS} rounds, the weights of the rows "
            f"still change by {change:.2g} on average. Use fewer rules, or loss=Huber(epsilon=...) "
            "with a larger epsilon.",
            ConvergenceWarning,
        )
        return run, weights

    def warn_unless_converged(self, run):
        """Warn where the solver stopped before it converged."""
        estimator, result = self.estimator, run.result
        if result.converged or estimator.max_iter == 0:
            return
        warn_user(
            f"solver={estimator.solver!r} did not converge with {run.start.antecedent.n_rules} "
            f"rules on {self.rows.n_rows} rows and max_iter={estimator.max_iter}: {result.message} "
            "The model is the best one found; increase max_iter or the solver's tol.",
            ConvergenceWarning,
        )

    def _answering(self, model):
        """The model with the policy out of bounds that the user asked for."""
        return model.with_out_of_bounds(*policy_of(self.estimator.out_of_bounds))

    def _posterior(self, run, weights, held=None):
        """That of a run; ``held`` are the consequents of the model, if constraints hold them."""
        robust = None if weights is None else (weights, self.huber.epsilon)
        learnt = run.premise if self.solver.moves_premises else None
        effective_weight = self.rows.effective_weight
        if weights is not None:
            # Kish's effective number of rows, from the part of its weight that each row keeps.
            share, square = (np.average(weights**k, weights=self.rows.weights) for k in (1, 2))
            effective_weight *= share**2 / square
        return posterior_of(run.problem, learnt, run.evaluation, effective_weight, robust, held)

    def frozen(self, run: SolverRun, weights: np.ndarray | None) -> Fitted:
        """The results of a run, with the posterior; ``weights`` are those of Huber's loss."""
        rows, posterior = self.rows, self._posterior(run, weights)
        model, redundant = frozen_model(self.data, rows, self.request, run.start, run.evaluation)
        assert model.support is not None
        marginals = input_marginals(rows, run.evaluation.antecedent)
        support = replace(model.support, marginals=marginals)
        model = self._answering(replace(model, posterior=posterior, support=support))
        if weights is not None:
            every = np.full(len(self.data.X), np.nan)
            every[self.trained_on] = weights
            weights = self.data.over_all(every, np.nan)
        return Fitted(model, run.result, run.start, redundant, weights, run.validation_losses)

    def constrained(self, fitted, run, weights):
        """The same with the nearest consequents that satisfy the constraints, and a report."""
        evaluation, constraints = run.evaluation, self.data.constraints
        if evaluation.normal is None:
            # A descent does not solve for the consequents: do so first.
            evaluation = run.problem.evaluate(evaluation.antecedent.parameters)
        # Rows on a cluster of machines have no numbers.
        is_here = isinstance(self.data, ValidatedData)
        rows = self.data.numbered(self.trained_on) if is_here else None
        given = fitted.model, evaluation, run.problem, constraints, rows
        coefficients, free, held, points, report = proven_consequents(*given)
        run = replace(run, result=replace(run.result, evaluation=free))
        if free is not evaluation:
            fitted = self.frozen(run, weights)  # its premises are others
        model = replace(fitted.model, coefficients=coefficients)
        target, posterior = model.target, self._posterior(run, weights, held)
        return replace(
            fitted,
            model=replace(
                model,
                target=target.within(constraints.lower, constraints.upper, constraints.values),
                posterior=posterior and posterior.given(model, points),
            ),
            constraints=report,
        )
