"""A law plus rules: a base regressor, and a second one that learns the residual of the first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.linear_model import BayesianRidge
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from sklearn.utils.validation import check_is_fitted, check_scalar, column_or_1d, validate_data

from .. import ANFISRegressor
from ..export import fold_with_rows
from ..export.folding import final_step, found_by_search
from ._columns import ask
from .physics import OpenLoopArcsineRegressor, check_parameters


class ResidualRegressor(RegressorMixin, BaseEstimator):
    """A base regressor, and another that learns its residual: the prediction is their sum.

    With the physics of the sensor as the base, the residual model stays small, and far from the
    data the sum falls back to physics plus an edge value.

    Parameters
    ----------
    base : regressor, default=None
        Fitted to the target; None is ``OpenLoopArcsineRegressor()``. It must be stiff, such as a
        law of few coefficients, because its residual is taken on its own training rows.
    residual : regressor, default=None
        Fitted to the residual of the base; None is ``ANFISRegressor()``. A Pipeline will do.
    n_rounds : int, default=1
        How often both are fitted in turn (backfitting: Buja, Hastie and Tibshirani, Annals of
        Statistics 17, 1989); the base is then fitted to the target minus the residual model's
        prediction. Three are enough. The residual model must be too small to replace the base.

    Attributes
    ----------
    base_, residual_ : regressor
        The fitted parts, estimators like any other.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where X had names that are all strings.

    See Also
    --------
    OpenLoopArcsineRegressor : The law of an open-loop fiber-optic gyro.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> X, rate = log[["output", "temperature", "time"]], log["rate"]
    >>> physics = OpenLoopArcsineRegressor("output", "temperature")
    >>> compensator = ResidualRegressor(physics, ANFISRegressor(n_mfs=2)).fit(X, rate)
    >>> before, after = [model.predict(X) - rate for model in (compensator.base_, compensator)]
    >>> bool(after.std() < before.std() / 3)
    True
    """

    def __init__(self, base: Any = None, residual: Any = None, *, n_rounds: int = 1) -> None:
        self.base = base
        self.residual = residual
        self.n_rounds = n_rounds

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = self.base is None
        return tags

    def fit(self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Fit the base, then the residual model.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs of both.
        y : array-like of shape (n_samples,)
            Target.
        groups : array-like of shape (n_samples,), default=None
            The run, device or day of each row, given to the ``fit`` of the residual model; of a
            Pipeline to its last step.

        Raises
        ------
        ValueError
            If ``n_rounds`` is less than 1, or the base has no finite prediction for a training row.
        """
        check_scalar(self.n_rounds, "n_rounds", (int, np.integer), min_val=1)
        target: np.ndarray = column_or_1d(y, dtype=float, warn=True)
        base = OpenLoopArcsineRegressor() if self.base is None else self.base
        residual = ANFISRegressor() if self.residual is None else self.residual
        step = f"{residual.steps[-1][0]}__" if isinstance(residual, Pipeline) else ""
        given = {} if groups is None else {f"{step}groups": groups}
        learnt = np.zeros(target.size)
        for _ in range(self.n_rounds):
            fitted_base = clone(base).fit(X, target - learnt)
            left = target - fitted_base.predict(X)
            refused = ~np.isfinite(left)
            if refused.any():
                raise ValueError(
                    f"base has no finite prediction for {refused.sum()} of {refused.size} training "
                    "rows: nothing is left there for the residual model to learn. Drop these rows, "
                    "or give the base a policy that answers."
                )
            fitted_residual = clone(residual).fit(X, left, **given)
            learnt = fitted_residual.predict(X)
        # All at once: a fit that fails leaves what was there. The parts have checked X themselves.
        validate_data(self, X, skip_check_array=True)
        self.base_, self.residual_ = fitted_base, fitted_residual
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the target, as the sum of both parts."""
        check_is_fitted(self)
        return self.base_.predict(X) + self.residual_.predict(X)

    def in_bounds(self, X: ArrayLike) -> np.ndarray:
        """Tell which rows lie in the bounds of every part that has bounds, Pipelines included."""
        return np.logical_and.reduce(self._answers("in_bounds", X))

    def coverage(self, X: ArrayLike) -> np.ndarray:
        """Tell how well the training data cover each row, 0 to 1: the smallest of the parts."""
        return np.minimum.reduce(self._answers("coverage", X))

    def _answers(self, method, X):
        """The results of ``method`` from the parts that have it."""
        check_is_fitted(self)
        parts = [self.base_, self.residual_]
        able = [part for part in parts if hasattr(final_step(part)[0], method)]
        # If no part has the method, the residual model raises the error.
        return [ask(part, method, X) for part in able or parts[1:]]


@dataclass(frozen=True, eq=False)
class FrozenRules:
    """A model of rules on some columns of a table, as a fitted estimator.

    ``positions`` are those of the model's inputs among the columns of X.
    """

    model: Any
    positions: np.ndarray

    def predict(self, X):
        """The output of the rules."""
        return self.model.predict(self._rows(X))[:, 0]

    def in_bounds(self, X):
        """Tell which rows lie in the box of the training data."""
        return self.model.in_bounds(self._rows(X))

    def coverage(self, X):
        """Tell how well the training data cover each row."""
        return self.model.coverage(self._rows(X))

    def _rows(self, X):
        return np.asarray(X, dtype=float)[:, self.positions]

    @classmethod
    def of(cls, estimator, n_columns):
        """The rules of an estimator that takes ``n_columns``, with its scalers folded in."""
        if isinstance(estimator, cls):
            return estimator
        # A row that holds the number of every column tells which of them reach the model.
        model, places = fold_with_rows(estimator, np.arange(float(n_columns))[None])
        return cls(model, places[0].astype(int))


@cache
def cubic_powers(n_inputs):
    """Exponents of all terms up to the third degree, in the order of scikit-learn."""
    return PolynomialFeatures(3).fit(np.zeros((1, n_inputs))).powers_


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A cubic: sum_k c_k prod_j z_j^p_kj, z = (x - center) / scale, x held in a box; fitted.

    It takes all columns of X, and has all terms k up to the third degree, in scikit-learn's order,
    with coefficients c and powers p.
    """

    minimum_: np.ndarray
    maximum_: np.ndarray
    center: np.ndarray
    scale: np.ndarray
    coefficients: np.ndarray
    feature_names_in_: np.ndarray
    out_of_bounds = "clip"

    @classmethod
    def fitted(cls, X, y, box):
        """Fit to a table X; ``box`` holds the ends of its columns.

        The evidence shrinks the terms that the rows do not tell apart: in a sine of temperature,
        T and dT/dt lie on an ellipse, and least squares may give any value within it.
        """
        # The priors of BayesianRidge are for targets of about one.
        unit, scaler, line = float(np.std(y)) or 1.0, StandardScaler(), BayesianRidge()
        make_pipeline(scaler, PolynomialFeatures(3, include_bias=False), line).fit(X, y / unit)
        coefficients = unit * np.array([line.intercept_, *line.coef_])
        low, high = box
        names = np.array(X.columns, dtype=object)
        return cls(low, high, scaler.mean_, scaler.scale_, coefficients, names)

    powers = property(lambda self: cubic_powers(self.center.size))  # (n_terms, n_inputs)
    columns_ = property(lambda self: np.arange(self.center.size))
    n_features_in_ = property(lambda self: self.center.size)

    def predict(self, X):
        """The value of the polynomial."""
        z = np.clip(np.asarray(X, dtype=float), self.minimum_, self.maximum_) - self.center
        terms = np.tile(self.coefficients, (len(z), 1))
        for column, powers in zip((z / self.scale).T, self.powers.T, strict=True):
            terms *= np.vander(column, 4, increasing=True)[:, powers]
        return terms.sum(axis=1)


def law_and_rules(estimator):
    """Both parts of a fitted composition: the law, or a Polynomial in its place; FrozenRules."""
    found = found_by_search(estimator)
    if not isinstance(found, ResidualRegressor):
        raise TypeError(
            "estimator must be a fitted ResidualRegressor of the arcsine law and an ANFIS, or a "
            f"search over such; got {found!r}."
        )
    check_is_fitted(found)
    law = found.base_
    if isinstance(law, OpenLoopArcsineRegressor):
        check_parameters(law)
    elif not isinstance(law, Polynomial):
        raise TypeError(
            f"base must be an OpenLoopArcsineRegressor, whose law can be written; it is {law!r}. "
            "The law chooses its columns by its own parameters, and needs no Pipeline."
        )
    return law, FrozenRules.of(found.residual_, law.n_features_in_)


def rules_of(estimator):
    """The rules of a fitted estimator: the part that adds to a law, or else the whole."""
    return getattr(estimator, "residual_", estimator)


def joined(law, rules):
    """The fitted composition of a law and FrozenRules."""
    composition = ResidualRegressor(law)
    composition.base_, composition.residual_ = law, rules
    composition.n_features_in_ = law.n_features_in_
    composition.feature_names_in_ = law.feature_names_in_
    return composition
