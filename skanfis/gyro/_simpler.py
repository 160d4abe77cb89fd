"""Compensations that are simpler than rules, held out on the same rows: rules must beat them.

They are written, applied and exported as rules are: each goes with a single rule, whose box,
coverage and policy are those of the rows that it was fitted to. A constant or a line is what that
rule gives; beside the arcsine law, or a cubic, it gives that line or zero.
"""

import warnings
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .. import ANFISRegressor
from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from ._models import make_law, make_law_and_line, make_polynomial
from .compose import FrozenRules, Polynomial, joined

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


def single_rule(X, policy):
    """FrozenRules of one rule that gives zero, with what it knows of these rows."""
    rule = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=1, out_of_bounds=policy))
    # What it is fitted to does not matter.
    found = FrozenRules.of(rule.fit(X, np.arange(float(len(X)))), X.shape[1])
    return _giving(found, 0.0)


def frozen(model, rule):
    """A fitted simple compensation as an estimator that flags rows as the single rule does.

    ``model`` is a number; a Pipeline of a scaler, PolynomialFeatures and a line; the arcsine law;
    or a ResidualRegressor of that and such a Pipeline.
    """
    if isinstance(model, float):
        return _giving(rule, model)
    if hasattr(model, "residual_"):
        return joined(model.base_, _line(model.residual_, rule))
    if not hasattr(model, "steps"):
        return joined(model, rule)
    scaler, features, line = (step for _, step in model.steps)
    if features.degree == 1:
        return _line(model, rule)
    # Beyond the box it is held: there the tangent of a cubic leads far away soon.
    policy = rule.model.out_of_bounds
    held = rule.model.with_out_of_bounds("clip" if policy == "linear" else policy)
    powers = np.vstack([np.zeros(scaler.mean_.size, dtype=int), features.powers_])
    coefficients = np.append(line.intercept_, line.coef_)
    box = held.minimum, held.maximum
    names = np.array(held.input_names, dtype=object)
    base = Polynomial(*box, scaler.mean_, scaler.scale_, powers, coefficients, names)
    return joined(base, replace(rule, model=held))


def _line(pipeline, rule):
    scaler, _, line = (step for _, step in pipeline.steps)
    slopes = line.coef_ / scaler.scale_
    return _giving(rule, line.intercept_ + slopes @ (rule.model.reference - scaler.mean_), slopes)


def _giving(rule, constant, slopes=()):
    """The single rule with another consequent, of slopes about its reference."""
    coefficients = np.array([constant, *slopes], dtype=float).reshape(1, -1, 1)
    model = replace(rule.model, coefficients=coefficients, target=None, posterior=None)
    return replace(rule, model=model)
