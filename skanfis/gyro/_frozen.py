"""A law and rules as they are written and read: fitted for good, in the units of their columns."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.utils.validation import check_is_fitted

from ..export import fold_with_rows, found_by_search
from .compose import ResidualRegressor
from .physics import OpenLoopArcsineRegressor, check_parameters

__all__ = ["FrozenRules", "joined", "law_and_rules"]


@dataclass(frozen=True, eq=False)
class FrozenRules:
    """A model of rules on some columns of a table, as a fitted estimator.

    ``positions`` are those of the model's inputs among the columns of X.
    """

    model: Any
    positions: np.ndarray

    def predict(self, X):
        return self.model.predict(self._rows(X))[:, 0]

    def in_bounds(self, X):
        return self.model.in_bounds(self._rows(X))

    def coverage(self, X):
        return self.model.coverage(self._rows(X))

    def _rows(self, X):
        return np.asarray(X, dtype=float)[:, self.positions]

    @classmethod
    def of(cls, estimator, n_columns):
        """The rules of an estimator that takes so many columns, its scalers folded in."""
        if isinstance(estimator, cls):
            return estimator
        # A row that holds the number of every column tells which of them reach the model.
        model, places = fold_with_rows(estimator, np.arange(float(n_columns))[None])
        return cls(model, places[0].astype(int))


def law_and_rules(estimator):
    """Both parts of a fitted composition: OpenLoopArcsineRegressor, FrozenRules."""
    found = found_by_search(estimator)
    if not isinstance(found, ResidualRegressor):
        raise TypeError(
            "estimator must be a fitted ResidualRegressor of the arcsine law and an ANFIS, or a "
            f"search over such; got {found!r}."
        )
    check_is_fitted(found)
    law = found.base_
    if not isinstance(law, OpenLoopArcsineRegressor):
        raise TypeError(
            f"base must be an OpenLoopArcsineRegressor, whose law can be written; it is {law!r}. "
            "The law chooses its columns by its own parameters, and needs no Pipeline."
        )
    check_parameters(law)
    rules = FrozenRules.of(found.residual_, law.n_features_in_)
    if rules.model.n_outputs != 1:
        raise ValueError(f"residual has {rules.model.n_outputs} outputs; the rate is one.")
    return law, rules


def joined(law, rules):
    """The fitted composition of a law and FrozenRules."""
    composition = ResidualRegressor(law)
    composition.base_, composition.residual_ = law, rules
    composition.n_features_in_ = law.n_features_in_
    composition.feature_names_in_ = law.feature_names_in_
    return composition
