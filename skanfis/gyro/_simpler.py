"""Simpler compensations, judged on the same held-out rows as the rules, which must beat them.

Each has a single rule, so that it is written, applied and exported as rules are, with the box,
coverage and policy of its training rows. A constant or a line is that rule itself. Beside the
arcsine law or a cubic the rule adds a line or zero.
"""

import warnings
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .. import ANFISRegressor
from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from .compose import FrozenRules, Polynomial, ResidualRegressor, joined, law_and_rules
from .physics import OpenLoopArcsineRegressor

# Law and rules are fitted in turn: a law fitted once is bent by the transient after power-on.
ROUNDS = 2
NOTHING = "no compensation"
LAW_AND_LINE = "arcsine law and a line"
# Compensations by their value of the command's option --write.
NAMES = {
    "none": NOTHING,
    "constant": "constant",
    "line": "straight line",
    "law": "arcsine law",
    "law-line": LAW_AND_LINE,
    "cubic": "cubic polynomial",
}


@dataclass(frozen=True, eq=False)
class Compensation:
    """A compensation: a simple one, or the model that must beat it.

    ``after`` is the compensated rate of every row, by the model of ``fold_models`` that had not
    seen its group; ``estimator`` is fitted to all rows. Both are None if the log does not allow
    this compensation: ``missing`` says why.
    """

    name: str
    predicts: str
    after: np.ndarray | None = None
    estimator: Any = None
    missing: str = ""
    fold_models: list = field(default_factory=list)


def simpler_compensations(X, rate, before, folds, rows, judged, policy):
    """Simple compensations from the simplest to the least simple, on the same rows and folds.

    ``folds`` are pairs of rows fitted to and rows predicted, ``rows`` those of the final fit. The
    rows ``judged`` need a prediction: without one, even by ``policy``, nothing can be compared.
    """
    parts = [train for train, _ in folds] + [rows]
    with warnings.catch_warnings():
        # Warnings are not needed: the worth of each compensation is measured.
        for category in (ConvergenceWarning, ConstantInputWarning, OutOfBoundsWarning):
            warnings.simplefilter("ignore", category)
        for name, predicts, fit in kinds(list(X), policy):
            target, predicted = (rate if predicts == "rate" else before - rate), np.zeros(len(X))
            try:
                *made, whole = (fit(X.iloc[part], target[part]) for part in parts)
                for estimator, (_, test) in zip(made, folds, strict=True):
                    predicted[test] = estimator.predict(X.iloc[test])
                if n_lost := np.count_nonzero(judged & ~np.isfinite(predicted)):
                    raise ValueError(f"it has no finite prediction for {n_lost} rows")
            except ValueError as error:
                # Only the law fails: the rate never changes, rows are too few, or the output is
                # beyond its sine.
                yield Compensation(name, predicts, missing=str(error))
                continue
            after = predicted if predicts == "rate" else before - predicted
            yield Compensation(name, predicts, after, whole, fold_models=made)


def kinds(inputs, policy):
    """Yield the name of each compensation, what it predicts, and the function that fits it."""

    def zero(X, y):
        return fitted_rule(X, np.zeros(len(X)), 0, policy)

    def law(X, y):
        fitted = make_law(inputs, 1, policy).fit(X, y)
        places = np.sort(fitted.columns_)  # the law's inputs, which alone flag rows
        return joined(fitted, replace(zero(X.iloc[:, places], y), positions=places))

    def law_and_line(X, y):
        both = make_law(inputs, 1, policy), _unfitted_rule(1, policy)
        return joined(*law_and_rules(ResidualRegressor(*both, n_rounds=ROUNDS).fit(X, y)))

    def cubic(X, y):
        # Held beyond the box: the tangent of a cubic soon leads far away.
        rule = fitted_rule(X, np.zeros(len(X)), 0, "clip" if policy == "linear" else policy)
        return joined(Polynomial.fitted(X, y, (rule.model.minimum, rule.model.maximum)), rule)

    yield NOTHING, "error", zero
    yield "constant", "error", lambda X, y: fitted_rule(X, y, 0, policy)
    yield "straight line", "error", lambda X, y: fitted_rule(X, y, 1, policy)
    if "output" in inputs:
        yield "arcsine law", "rate", law
        yield LAW_AND_LINE, "rate", law_and_line
    yield "cubic polynomial", "error", cubic


def make_law(inputs, degree, outside):
    """The arcsine law on the inputs that it can use."""
    knows_lag = {"temperature", "temperature_rate"} <= set(inputs)
    return OpenLoopArcsineRegressor(
        "output",
        "temperature" if "temperature" in inputs else None,
        # The thermometer lag is part of the law if the inputs allow to fit it.
        temperature_rate="temperature_rate" if knows_lag else None,
        amplitude_degree=degree,
        bias_degree=degree,
        out_of_bounds=outside,
    )


def _unfitted_rule(order, policy):
    """A single rule, which is a constant or a line, by plain least squares."""
    rule = ANFISRegressor(n_mfs=1, order=order, alpha=0.0, out_of_bounds=policy)
    return make_pipeline(StandardScaler(), rule)


def fitted_rule(X, y, order, policy):
    return FrozenRules.of(_unfitted_rule(order, policy).fit(X, y), X.shape[1])
