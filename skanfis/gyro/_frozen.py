"""Simple compensations as estimators that are written, applied and exported as rules are.

Each goes with a single rule, whose box, coverage and policy are those of the rows that it was
fitted to: rows are flagged as by rules. A constant or a line is what that rule gives; beside the
arcsine law, or a polynomial, it gives zero or that line.
"""

from dataclasses import dataclass, replace

import numpy as np
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .. import ANFISRegressor
from ..policies import MAX_EXTRAPOLATION, SILENT
from .compose import FrozenRules, joined


def single_rule(X, policy):
    """FrozenRules of one rule that gives zero, with what it knows of these rows."""
    rule = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=1, out_of_bounds=policy))
    # What it is fitted to does not matter.
    found = FrozenRules.of(rule.fit(X, np.arange(float(len(X)))), X.shape[1])
    return _giving(found, 0.0)


def frozen(model, X, policy, rule=None):
    """A fitted simple compensation of the rows X as an estimator that flags rows.

    ``model`` is a number; a Pipeline of a scaler, PolynomialFeatures and a line; the arcsine law;
    or a ResidualRegressor of that and such a Pipeline.
    """
    rule = single_rule(X, policy) if rule is None else rule
    if isinstance(model, float):
        return _giving(rule, model)
    if hasattr(model, "residual_"):
        return joined(model.base_, _line(model.residual_, rule))
    if not hasattr(model, "steps"):
        return joined(model, rule)
    scaler, features, line = (step for _, step in model.steps)
    if features.degree == 1:
        return _line(model, rule)
    # Beyond the box a polynomial of some degree is no line, which may go on for long.
    shorter = replace(rule.model, max_extrapolation=MAX_EXTRAPOLATION)
    powers = np.vstack([np.zeros_like(features.powers_[:1]), features.powers_])
    coefficients = np.append(line.intercept_, line.coef_)
    return FrozenPolynomial(
        replace(rule, model=shorter), scaler.mean_, scaler.scale_, powers, coefficients
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
class FrozenPolynomial:
    """The sum of coefficients c times products of powers of z = (x - center) / scale.

    ``powers`` (n_terms, n_inputs). Beyond the box of the single ``rule``, which gives zero, its
    policy holds: the tangent, as of rules. All columns of X are inputs.
    """

    rule: FrozenRules
    center: np.ndarray
    scale: np.ndarray
    powers: np.ndarray
    coefficients: np.ndarray

    def predict(self, X):
        """What the polynomial gives."""
        X, model = np.asarray(X, dtype=float), self.rule.model
        nearest = np.clip(X, model.minimum, model.maximum)
        Z = (nearest - self.center) / self.scale
        found = self._products(Z, self.powers) @ self.coefficients
        outside = (nearest != X).any(axis=1)
        if model.out_of_bounds in SILENT:
            found[outside] = np.nan
        elif model.out_of_bounds == "linear" and outside.any():
            way = model.way_out(X[outside]) / self.scale
            for j, step in enumerate(way.T):
                found[outside] += step * self._slope(Z[outside], j)
        return found

    def _slope(self, Z, j):
        """Derivative by z_j."""
        lower = self.powers - (np.arange(self.center.size) == j) * (self.powers > 0)
        return self._products(Z, lower) @ (self.coefficients * self.powers[:, j])

    @staticmethod
    def _products(Z, powers):
        found = np.ones((len(Z), len(powers)))
        for j, column in enumerate(Z.T):
            table = np.stack([column**k for k in range(powers[:, j].max(initial=0) + 1)], axis=1)
            found *= table[:, powers[:, j]]
        return found

    def in_bounds(self, X):
        """Tell which rows lie in the box of the rows fitted to."""
        return self.rule.in_bounds(X)

    def coverage(self, X):
        """Tell how well the rows fitted to cover each row."""
        return self.rule.coverage(X)

    def bounds(self, box=None):
        """Limits of what it gives in a box (n_inputs, 2), and the box.

        Beside the constant no term, its tangent included, is larger than |c| (|z| + |dz|)^powers.
        """
        model = self.rule.model
        own = np.stack([model.minimum, model.maximum], axis=1)
        box = own if box is None else np.asarray(box, dtype=float)
        near = np.clip(box.T, model.minimum, model.maximum)
        reach = np.abs(model.way_out(box.T)).max(axis=0) * (model.out_of_bounds == "linear")
        sizes = (np.abs(near - self.center).max(axis=0) + reach) / self.scale
        varies = self.powers.any(axis=1)
        most = np.prod(sizes**self.powers, axis=1) @ (np.abs(self.coefficients) * varies)
        middle, rounding = self.coefficients @ ~varies, 1.0 + 1e-12
        return np.array([middle - rounding * most, middle + rounding * most]), box
