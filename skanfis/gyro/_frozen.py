"""Simple compensations as estimators that are written, applied and exported as rules are.

Each goes with a single rule, whose box, coverage and policy are those of the rows that it was
fitted to: rows are flagged as by rules. A constant or a line is what that rule gives; beside the
arcsine law, or a polynomial, it gives zero or that line.
"""

from dataclasses import dataclass, replace

import numpy as np
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from .. import ANFISRegressor
from ..policies import SILENT
from .compose import FrozenRules, joined


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
    coefficients = np.append(line.intercept_, line.coef_)
    return FrozenPolynomial(
        held, rule.positions, scaler.mean_, scaler.scale_, coefficients, features.degree
    )


def _line(pipeline, rule):
    scaler, _, line = (step for _, step in pipeline.steps)
    slopes = line.coef_ / scaler.scale_
    return _giving(rule, line.intercept_ + slopes @ (rule.model.reference - scaler.mean_), slopes)


def _giving(rule, constant, slopes=()):
    """The single rule with another consequent, of slopes about its reference."""
    coefficients = np.array([constant, *slopes], dtype=float).reshape(1, -1, 1)
    model = replace(rule.model, coefficients=coefficients, target=None, posterior=None)
    return replace(rule, model=model)


@dataclass(frozen=True, eq=False)
class FrozenPolynomial(FrozenRules):
    """A polynomial in z = (x - center) / scale, with coefficients in the order of scikit-learn.

    Beyond the box of the single rule, which gives zero, the value at the edge is held, or there is
    none. All columns of X are inputs.
    """

    center: np.ndarray
    scale: np.ndarray
    coefficients: np.ndarray
    degree: int = 3

    @property
    def powers(self):
        """Of every term, by input."""
        return self._terms.powers_

    @property
    def _terms(self):
        return PolynomialFeatures(self.degree).fit(self.center[None])

    def predict(self, X):
        """What the polynomial gives."""
        X, model = np.asarray(X, dtype=float), self.model
        nearest = np.clip(X, model.minimum, model.maximum)
        found = self._terms.transform((nearest - self.center) / self.scale) @ self.coefficients
        if model.out_of_bounds in SILENT:
            found[(nearest != X).any(axis=1)] = np.nan
        return found

    def bounds(self, box):
        """Limits of what it gives in a box (n_inputs, 2): no term exceeds |c| max |z|^powers."""
        near = np.clip(box.T, self.model.minimum, self.model.maximum)
        sizes = np.abs(near - self.center).max(axis=0) / self.scale
        varies = self.powers.any(axis=1)
        most = np.prod(sizes**self.powers, axis=1) @ np.abs(self.coefficients * varies)
        return self.coefficients @ ~varies + np.array([-1.0, 1.0]) * (1.0 + 1e-12) * most
