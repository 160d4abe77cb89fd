"""Compensations that are simpler than rules, held out on the same rows: rules must beat them."""

import warnings
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from sklearn.exceptions import ConvergenceWarning

from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from ._frozen import frozen, single_rule
from ._models import make_law, make_law_and_line, make_polynomial

NOTHING = "no compensation"
LAW_AND_LINE = "arcsine law and a line"
# By what the command's --write calls them.
NAMES = {
    "none": NOTHING,
    "constant": "constant",
    "line": "straight line",
    "law": "arcsine law",
    "law-line": LAW_AND_LINE,
    "cubic": "cubic polynomial",
}


@dataclass(frozen=True, eq=False)
class Simpler:
    """A simple compensation.

    ``after`` is the compensated rate of every row by a model that had not seen its group, ``model``
    the one fitted to all rows, and ``estimator`` that as it is written; ``fold_models`` are those
    of the folds. They are None where the log does not allow it, and ``missing`` says why.
    """

    name: str
    predicts: str = "error"
    after: np.ndarray | None = None
    model: Any = None
    estimator: Any = None
    missing: str = ""
    fold_models: list = field(default_factory=list)


def simpler_compensations(X, rate, before, folds, rows, policy="linear"):
    """Simple compensations from the simplest to the least simple, on the same rows and folds.

    ``folds`` are pairs of rows fitted to and rows predicted, ``rows`` those of the final fit.
    """
    with warnings.catch_warnings():
        # What it is worth is measured.
        for category in (ConvergenceWarning, ConstantInputWarning, OutOfBoundsWarning):
            warnings.simplefilter("ignore", category)
        fits = [(train, test) for train, test in folds] + [(rows, None)]
        rules = [single_rule(X.iloc[train], policy) for train, _ in fits]
        for name, fit, predicts in _kinds(list(X), policy):
            target, predicted = rate if predicts == "rate" else before - rate, np.full(len(X), 0.0)
            made = []
            try:
                for (train, test), rule in zip(fits, rules, strict=True):
                    model = fit(X.iloc[train], target[train])
                    estimator = frozen(model, rule)
                    made.append(estimator)
                    if test is not None:
                        predicted[test] = estimator.predict(X.iloc[test])
                        is_lost = rule.in_bounds(X.iloc[test]) & ~np.isfinite(predicted[test])
                        if is_lost.any():
                            n_lost = np.count_nonzero(is_lost)
                            raise ValueError(f"it has no finite prediction for {n_lost} rows")
            except ValueError as error:
                # Of the law alone: no rate changes, or too few rows tell its coefficients.
                yield Simpler(name, predicts, missing=str(error))
                continue
            after = predicted if predicts == "rate" else before - predicted
            yield Simpler(name, predicts, after, model, estimator, fold_models=made[:-1])


def _kinds(inputs, policy="linear"):
    """Name, what fits it to rows, and what that predicts."""

    def fit(make, X, y):
        return make().fit(X, y)

    yield NOTHING, lambda X, y: 0.0, "error"
    yield "constant", lambda X, y: float(np.mean(y)), "error"
    yield "straight line", partial(fit, partial(make_polynomial, 1)), "error"
    if "output" in inputs:
        yield "arcsine law", partial(fit, partial(make_law, inputs, 1, policy)), "rate"
        yield LAW_AND_LINE, partial(fit, partial(make_law_and_line, inputs, policy)), "rate"
    yield "cubic polynomial", partial(fit, partial(make_polynomial, 3)), "error"
