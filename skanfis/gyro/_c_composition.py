"""The law and the rules that one C function is of, rounded to its type; and answers to compare."""

import warnings
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.polynomial import Polynomial
from scipy.stats import qmc

from ..exceptions import OutOfBoundsWarning
from ..export.c.builder import ROWS, STATUS, TOLERANCE, size_of_sum
from ..policies import SILENT
from .compose import FrozenRules
from .physics import OpenLoopArcsineRegressor

__all__ = ["Composition", "known_answers"]


@dataclass(frozen=True, eq=False)
class Composition:
    """Both parts, and what of the law is rounded to the type.

    ``columns`` are the positions in X of the function's inputs.
    """

    law: Any
    rules: FrozenRules
    columns: np.ndarray
    dtype: np.dtype

    def rounded(self, values):
        values = np.asarray(values, dtype=float)
        largest = np.abs(values).max()
        if not largest <= float(np.finfo(self.dtype).max):
            raise ValueError(
                f"Single precision cannot hold {largest:g}, a constant of the arcsine law. Scale "
                "the output, or export in double precision."
            )
        return values.astype(self.dtype)

    @property
    def law_inputs(self):
        return np.searchsorted(self.columns, self.law.columns_)

    @property
    def rules_inputs(self):
        return np.searchsorted(self.columns, self.rules.positions)

    @property
    def low(self):
        return self.rounded(self.law.minimum_)

    @property
    def high(self):
        return self.rounded(self.law.maximum_)

    @property
    def reference(self):
        return self.rounded(self.law.reference_temperature_)

    def polynomial(self, coefficients):
        """Coefficients about the reference as it is rounded, of no less than one number."""
        shift = float(self.reference) - self.law.reference_temperature_
        moved = np.zeros(coefficients.size)
        found = Polynomial(coefficients)(Polynomial([shift, 1.0])).coef
        moved[: found.size] = found
        return self.rounded(moved)

    @property
    def polynomials(self):
        return {
            "amplitude": self.polynomial(self.law.amplitude_),
            "sagnac": self.polynomial(self.law.sagnac_factor_),
            "bias": self.polynomial(self.law.bias_),
        }

    @property
    def box(self):
        """Of every input, within which both parts know it."""
        low, high = np.full(self.columns.size, -np.inf), np.full(self.columns.size, np.inf)
        parts = [
            (self.law_inputs, self.low, self.high),
            (
                self.rules_inputs,
                self.rounded(self.rules.model.minimum),
                self.rounded(self.rules.model.maximum),
            ),
        ]
        for places, least, most in parts:
            low[places] = np.maximum(low[places], least)
            high[places] = np.minimum(high[places], most)
        return low, high

    @property
    def names(self):
        given = getattr(self.law, "feature_names_in_", None)
        return [f"x{j}" if given is None else given[j] for j in self.columns]

    def table(self, X):
        """Rows as both parts take them, out of rows of the function's inputs."""
        whole = np.zeros((len(X), self.law.n_features_in_))
        whole[:, self.columns] = X
        names = getattr(self.law, "feature_names_in_", None)
        return whole if names is None else pd.DataFrame(whole, columns=names)


def known_answers(composition, part):
    """Rows, rates, status and tolerance, as for rules alone; some rows lie far up the sine.

    Rows so near to the largest phase or the coverage asked for that rounding decides are left out.
    """
    law, rules = composition.law, composition.rules
    rules, min_coverage = replace(rules, model=part.model), part.min_coverage
    low, high = composition.box
    points = qmc.Halton(low.size, scramble=False).random(4 * ROWS)
    kind = np.arange(len(points)) % 4
    reach = np.where(kind % 2, 1.0, 2.0)[:, None]
    X = low + (high - low) * (0.5 + reach * (points - 0.5))
    output = composition.law_inputs[0]
    swing = 3.0 * law.amplitude_[0] * (points[:, output] - 0.5)
    X[:, output] = np.where(kind == 3, law.offset_ + swing, X[:, output])
    X = np.vstack([low, high, X]).astype(composition.dtype)
    whole = composition.table(X.astype(float))
    # NaN past the amplitude.
    phase, coverage = np.abs(law.phase(whole)), rules.coverage(whole)
    sure = ~(np.abs(phase - law.max_phase) < 1e-3)
    if min_coverage is not None:
        sure &= np.abs(coverage - min_coverage) > 1e-3 * min_coverage
    chosen = np.flatnonzero(sure)[:ROWS]
    X, coverage, beyond = X[chosen], coverage[chosen], ~(phase <= law.max_phase)[chosen]
    whole = composition.table(X.astype(float))

    def outside(inputs, least, most):
        return ((X[:, inputs] < least) | (X[:, inputs] > most)).any(axis=1)

    beside = outside(composition.rules_inputs, part.low, part.high)
    out = beside | beyond | outside(composition.law_inputs, composition.low, composition.high)
    silent = beyond & (law.out_of_bounds in SILENT)
    silent |= beside & (rules.model.out_of_bounds in SILENT)
    with warnings.catch_warnings():
        # The status tells, row by row.
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        of_law = _answering(law).predict(whole)
    model, rows = _answering(rules.model), np.asarray(whole)[:, rules.positions]
    of_rules = model.predict(rows)
    if part.limits is not None:
        of_rules = np.clip(of_rules, *part.limits.T.astype(float))
    silent |= ~np.isfinite(of_law.astype(composition.dtype))
    status = STATUS["OUT_OF_RANGE"] * out | STATUS["NO_OUTPUT"] * silent
    if min_coverage is not None:
        status |= STATUS["UNCOVERED"] * (~silent & (coverage < min_coverage))
    y = np.where(silent, 0.0, of_law + of_rules[:, 0])[:, None]
    # What rounding of the sine is magnified by, too.
    steepest = np.abs(of_law[~silent]).max(initial=0.0)
    steepest = max(steepest, np.tan(law.max_phase) / np.abs(law.sagnac_factor_[0]))
    size = size_of_sum(model, rows, of_rules) + steepest
    tolerance = TOLERANCE[composition.dtype] * size
    return X, y.astype(composition.dtype), status, tolerance.astype(composition.dtype)


def _answering(part):
    """A part that answers everywhere: by its own policy, or the nearest where that gives none."""
    policy = "linear" if part.out_of_bounds == "linear" else "clip"
    if isinstance(part, OpenLoopArcsineRegressor):
        return copy(part).set_params(out_of_bounds=policy)
    return part.with_out_of_bounds(policy)
