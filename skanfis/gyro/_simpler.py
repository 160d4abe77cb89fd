"""Compensations that are simpler than rules, held out on the same rows: rules must beat them."""

import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from sklearn.dummy import DummyRegressor
from sklearn.exceptions import ConvergenceWarning

from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from ._models import make_law, make_law_and_line, make_polynomial

NOTHING = "no compensation"
LAW_AND_LINE = "arcsine law and a line"
# Options by which the command writes the files of one: a single rule is a straight line.
_OPTIONS = {
    "straight line": "--terms {ones}",
    "arcsine law": "--physics --terms {ones}",
    LAW_AND_LINE: "--physics --terms {ones}",
}


@dataclass(frozen=True, eq=False)
class Simpler:
    """A simple compensation.

    ``after`` is the compensated rate of every row by a model that had not seen its group, ``model``
    the one fitted to all rows. Both are None where the log does not allow it, and ``missing`` says
    why.
    """

    name: str
    predicts: str = "error"
    after: np.ndarray | None = None
    model: Any = None
    missing: str = ""


def simpler_compensations(X, rate, before, folds, rows):
    """Simple compensations from the simplest to the least simple, on the same rows and folds.

    ``folds`` are pairs of rows fitted to and rows predicted, ``rows`` those of the final fit.
    """
    yield Simpler(NOTHING, after=before)
    for name, make, predicts in _kinds(list(X)):
        target = rate if predicts == "rate" else before - rate
        predicted = np.full(len(X), np.nan)
        try:
            with warnings.catch_warnings():
                # What it is worth is measured.
                for category in (ConvergenceWarning, ConstantInputWarning, OutOfBoundsWarning):
                    warnings.simplefilter("ignore", category)
                for train, test in folds:
                    predicted[test] = make().fit(X.iloc[train], target[train]).predict(X.iloc[test])
                model = make().fit(X.iloc[rows], target[rows])
            if n_lost := np.count_nonzero(~np.isfinite(predicted)):
                raise ValueError(f"it has no finite prediction for {n_lost} rows")
        except ValueError as error:
            # Of the law alone: no rate changes, or too few rows tell its coefficients.
            yield Simpler(name, predicts, missing=str(error))
            continue
        yield Simpler(
            name, predicts, predicted if predicts == "rate" else before - predicted, model
        )


def _kinds(inputs):
    """Name, what makes the estimator, and what that predicts."""
    yield "constant", DummyRegressor, "error"
    yield "straight line", partial(make_polynomial, 1), "error"
    if "output" in inputs:
        yield "arcsine law", partial(make_law, inputs, 1, "linear"), "rate"
        yield LAW_AND_LINE, partial(make_law_and_line, inputs), "rate"
    yield "cubic polynomial", partial(make_polynomial, 3), "error"


def options_for(name, n_inputs):
    """Options of the command that make the files of a simple compensation; None where none do."""
    return _OPTIONS[name].format(ones=",".join("1" * n_inputs)) if name in _OPTIONS else None
