"""What a fitted estimator tells of its rules: where they hold, how they fire, what they say."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from .model import TSKModel
from .naming import given_term_names
from .training import model_without_rules

__all__ = ["TellsOfRulesMixin"]


class TellsOfRulesMixin:
    """Adds to the estimator what can be asked of its ``model_``."""

    # What the estimator brings.
    model_: TSKModel
    redundant_rules_: list[dict]
    _single_output: Any
    _check_inputs: Any

    def in_bounds(self, X: ArrayLike) -> np.ndarray:
        """Tell which rows lie in the range of the training data, input by input.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        inside : ndarray of bool of shape (n_samples,)

        Raises
        ------
        ValueError
            If X is not finite, or has other columns than in training.
        """
        X = self._check_inputs(X)
        return self.model_.in_bounds(X)

    def coverage(self, X: ArrayLike) -> np.ndarray:
        """Tell how well the training data cover each row.

        The sum over rules of strength times support, where a rule's support is the number of
        distinct training inputs on which it is the strongest over the number of its coefficients,
        at most one, and falls with the distance from the rows on which it fires, in the measure of
        their covariance; times exp(-delta^2 / 2) with delta the distance from the training range in
        standard deviations. Training rows of rules that have enough of them are near one; an empty
        corner of the range is near zero.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        coverage : ndarray of shape (n_samples,)
            From 0, where no data speak, to 1.

        Raises
        ------
        ValueError
            If X is not finite, or has other columns than in training.
        """
        X = self._check_inputs(X)
        return self.model_.coverage(X)

    def strengths(self, X: ArrayLike) -> np.ndarray:
        """Tell how strongly each rule fires on each row, normalised.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        strengths : ndarray of shape (n_samples, n_rules)
            Positive, with sum one in every row. Rows outside the training range are taken at its
            edge.

        Raises
        ------
        ValueError
            If X is not finite, or has other columns than in training.
        """
        X = self._check_inputs(X)
        return self.model_.strengths(X)

    def rename_terms(self, names: Sequence[str] | Mapping[str, Sequence[str]]) -> Self:
        """Give the terms other names, in the rules and wherever they are shown.

        Parameters
        ----------
        names : sequence of str or dict
            One per term, for every input alike or by input, ``{"temperature": ["cold", "hot"]}``,
            in the order of ``memberships_``; terms of other inputs get their default names: "low"
            to "high", NL to PL (negative large to positive large) where there are six or seven,
            "near 21.3" for scattered rules.

        Returns
        -------
        self : ANFISRegressor

        Raises
        ------
        ValueError
            If there are more or fewer names than an input has terms, or one twice.
        """
        model = self._fitted_model()
        renamed = given_term_names(model.antecedent, model.input_names, names)
        self.model_ = replace(model, term_names=renamed)
        return self

    def without_rules(self, rules: ArrayLike | None = None) -> TSKModel:
        """Give the model without some of its rules, to go on from.

        What is left fires as before, in proportion. Its consequents were learnt beside those that
        are gone: ``ANFISRegressor(partition=model.without_rules()).fit(X, y)`` trains them again.

        Parameters
        ----------
        rules : array-like of int, default=None
            The numbers of the rules; None is those of ``redundant_rules_``.

        Returns
        -------
        model : skanfis.model.TSKModel

        Raises
        ------
        ValueError
            If there is no such rule, or none would be left.
        """
        model = self._fitted_model()
        if rules is None:
            rules = [entry["rule"] for entry in self.redundant_rules_]
        return model_without_rules(model, np.asarray(rules, dtype=int))

    @property
    def n_rules_(self) -> int:
        """Number of rules."""
        return self._fitted_model().n_rules

    @property
    def rules_(self) -> np.ndarray:
        """The terms of each rule, as positions in ``memberships_``."""
        return self._fitted_model().antecedent.rule_terms

    @property
    def memberships_(self) -> list[dict]:
        """Every term after training, in the user's units."""
        return self._fitted_model().memberships()

    @property
    def initial_memberships_(self) -> list[dict]:
        """Every term before training, in the user's units."""
        return self._fitted_model().memberships(trained=False)

    @property
    def consequents_(self) -> np.ndarray:
        """p0, p1, ..., pd of every rule, in the user's units."""
        consequents = self._fitted_model().consequents
        return consequents[:, :, 0] if self._single_output else consequents

    def _fitted_model(self) -> TSKModel:
        check_is_fitted(self)
        return self.model_
