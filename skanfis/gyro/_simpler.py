"""Compensations that are simpler than rules, held out on the same rows: rules must beat them."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from sklearn.dummy import DummyRegressor
from sklearn.exceptions import ConvergenceWarning

from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from ._models import make_law, make_law_and_line, make_polynomial

__all__ = ["LAW_AND_LINE", "NOTHING", "Simpler", "options_for", "simpler_compensations"]

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


@dataclass(frozen=True)
class _Kind:
    """A kind of simple compensation: what is fitted, and what that predicts."""

    name: str
    make: Callable
    predicts: str = "error"


def simpler_compensations(X, rate, before, folds, rows):
    """Simple compensations from the simplest to the least simple, on the same rows and folds.

    ``folds`` are pairs of rows fitted to and rows predicted, ``rows`` those of the final fit.
    """
    yield Simpler(NOTHING, after=before)
    for kind in _kinds(list(X)):
        try:
            yield _fitted(kind, X, rate, before, folds, rows)
        except ValueError as error:
            # Of the law alone: no rate changes, or too few rows tell its coefficients.
            yield Simpler(kind.name, kind.predicts, missing=str(error))


def _kinds(inputs):
    yield _Kind("constant", DummyRegressor)
    yield _Kind("straight line", partial(make_polynomial, 1))
    if "output" in inputs:
        yield _Kind("arcsine law", partial(make_law, inputs, 1, "linear"), "rate")
        yield _Kind(LAW_AND_LINE, partial(make_law_and_line, inputs), "rate")
    yield _Kind("cubic polynomial", partial(make_polynomial, 3))


def _fitted(kind, X, rate, before, folds, rows):
    target = rate if kind.predicts == "rate" else before - rate
    predicted = np.full(len(X), np.nan)
    with warnings.catch_warnings():
        # What it is worth is measured.
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", ConstantInputWarning)
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        for train, test in folds:
            predicted[test] = kind.make().fit(X.iloc[train], target[train]).predict(X.iloc[test])
        model = kind.make().fit(X.iloc[rows], target[rows])
    if not np.isfinite(predicted).all():
        n_lost = np.count_nonzero(~np.isfinite(predicted))
        raise ValueError(f"it has no finite prediction for {n_lost} rows")
    after = predicted if kind.predicts == "rate" else before - predicted
    return Simpler(kind.name, kind.predicts, after, model)


def options_for(name, n_inputs):
    """Options of the command that make the files of a simple compensation; None where none do."""
    return _OPTIONS[name].format(ones=",".join("1" * n_inputs)) if name in _OPTIONS else None
