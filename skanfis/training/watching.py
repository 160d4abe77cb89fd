"""Watchers of a training: held-out rows, printed lines, scikit-learn's callbacks."""

import sys
import time
from dataclasses import replace

import numpy as np
from sklearn.model_selection import GroupShuffleSplit

from ..consequent import basis, outputs_of_rules
from ..learning.data import StandardisedData, place_in_sample
from ..options import EarlyStopping


def watch_all(*watchers):
    """Several watchers as one: each sees every iteration, and any of them can end the run."""
    present = [watcher for watcher in watchers if watcher is not None]

    def watch(n_iter, evaluation):
        asked_to_stop = [watcher(n_iter, evaluation) for watcher in present]
        return any(asked_to_stop)

    return watch if present else None


class Printer:
    """Writes a line to the standard output per candidate and iteration, for ``verbose``."""

    def __init__(self, name):
        self._name, self._start = name, time.perf_counter()

    def tell_start(self, start):
        """Write the structure and the weights of the start."""
        penalty, n_candidates = start.penalty, len(start.candidates)
        found = f"{n_candidates} candidates compared, " if n_candidates > 1 else ""
        self.write(
            f"{found}{start.antecedent.n_rules} rules, agreement {penalty.agreement:.3g}, "
            f"alpha {penalty.alpha:.3g}, stiffness {penalty.stiffness:.3g}"
        )

    def write(self, text):
        sys.stdout.write(f"[{self._name}] {text}\n")
        sys.stdout.flush()

    def __call__(self, n_iter, evaluation):
        seconds = time.perf_counter() - self._start
        loss = evaluation.mean_squared_error
        self.write(f"iteration {n_iter}: loss {loss:.6g}, {seconds:.1f} s")
        return False


class Callbacks:
    """scikit-learn's callbacks: they see every iteration, and may end the run.

    ``context`` is scikit-learn's callback context of the fit. ``data`` holds "X", "y" and
    "metadata", as the user gave them.
    """

    def __init__(self, estimator, context, data):
        self.context, self.given = context, {"estimator": estimator, **data}

    def begin(self):
        self.context.call_on_fit_task_begin(**self.given)

    def iteration(self, make_model):
        """Tell the callbacks of an iteration; return whether one of them wants to stop.

        ``make_model`` makes the current model, if a callback asks for it.
        """
        context = self.context.subcontext(task_name="iteration")
        context.call_on_fit_task_begin(**self.given)
        return self._end(context, make_model)

    def end(self, model):
        self._end(self.context, lambda: model)

    def _end(self, context, make_model):
        return context.call_on_fit_task_end(
            reconstruction_attributes=lambda: {"model_": make_model()}, **self.given
        )


def hold_out(rows: StandardisedData, validation_fraction, seed):
    """Indices to train on and to hold out, each in order; groups are not split.

    Without groups, or in a single one, rows with equal inputs form one: so repeats are never on
    both sides, and a weight acts like repeats. ValueError where either part would have fewer than
    two rows.
    """
    what, groups = f"{rows.n_rows} rows", rows.groups
    if groups is None or np.ptp(groups) == 0:
        # By the inputs alone, in any order of columns.
        groups = rows.numbers(lambda Z, _: place_in_sample(Z, Z[:0]))
        n_distinct = np.unique(groups).size
        what += f" ({n_distinct} of them distinct)" if n_distinct < rows.n_rows else ""
    else:
        what += f" in {np.unique(groups).size} groups"
    splitter = GroupShuffleSplit(1, test_size=validation_fraction, random_state=seed)
    try:
        training, validation = next(splitter.split(np.empty((rows.n_rows, 0)), groups=groups))
    except ValueError:
        training, validation = np.arange(0), np.arange(rows.n_rows)
    if min(training.size, validation.size) < 2:
        raise ValueError(
            f"early_stopping with validation_fraction={validation_fraction} leaves, of {what}, "
            f"{training.size} to train on and {validation.size} to hold out: at least 2 of each "
            "are needed. Use EarlyStopping(validation_fraction=...), more rows or groups, or "
            "early_stopping=False."
        )
    return training, validation


class ValidationLoss:
    """Watches a run: the mean squared error of held-out rows after every iteration.

    ``rows`` are the held-out ones, on the scales of the training rows; ``stopping`` says when the
    run ends.
    """

    def __init__(self, rows: StandardisedData, consequent_inputs, stopping: EarlyStopping):
        self.rows, self.consequent_inputs, self.stopping = rows, consequent_inputs, stopping
        self.losses: list[float] = []
        self.best = None
        self._best_loss = self._last_counted = np.inf
        self._without_change = 0

    def __call__(self, n_iter, evaluation):
        loss = held_out_loss(self.rows, self.consequent_inputs, evaluation)
        self.losses.append(loss)
        if loss < self._best_loss:
            self._best_loss, self.best = loss, evaluation
        if loss < (1.0 - self.stopping.tol) * self._last_counted:
            self._last_counted, self._without_change = loss, 0
        else:
            self._without_change += 1
        return self._without_change >= self.stopping.n_iter_no_change

    def restored(self, result):
        """The result with the parameters of the smallest held-out error."""
        if not self.losses:  # the run ended without an iteration
            self(0, result.evaluation)
        return result if self.best is None else replace(result, evaluation=self.best)


def held_out_loss(rows: StandardisedData, consequent_inputs, evaluation):
    """Mean squared error of rows that were not trained on, standardised, summed over outputs.

    Rows beyond the training range are moved to its nearest point, whatever the policy.
    """
    low, high = (edge[:, None] for edge in rows.inputs.box)
    coefficients = evaluation.coefficients
    by_rule = coefficients.reshape(evaluation.antecedent.n_rules, -1, coefficients.shape[1])
    total = 0.0
    for _, Z, target, weight in rows.blocks():
        np.clip(Z, low, high, out=Z)
        strengths, basis_rows = evaluation.antecedent.strengths(Z), basis(Z[consequent_inputs])
        residual = target - outputs_of_rules(by_rule.transpose(2, 0, 1), strengths, basis_rows)
        total += weight @ np.sum(residual**2, axis=0)
    return total / rows.total_weight
