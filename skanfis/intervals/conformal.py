"""ConformalRegressor: prediction intervals with a given coverage, around any regressor."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin
from sklearn.utils import indexable
from sklearn.utils.metadata_routing import MetadataRouter, MethodMapping
from sklearn.utils.validation import check_is_fitted

from .._sklearn import HasMethods, Interval, StrOptions, fit_context
from .._threads import N_JOBS
from ..regressor import ANFISRegressor
from . import _scores


class ConformalRegressor(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    r"""Prediction intervals with a given coverage, around any regressor.

    Conformal prediction [1]_: errors on rows that a model has not seen, in its own standard
    deviations, show how far off a new row may be, for any model. See :doc:`/how_sure`.

    Parameters
    ----------
    estimator : regressor, default=None
        A Pipeline or a search, for example. None is ``ANFISRegressor()``.
    method : {"folds", "split", "loo"}, default="folds"
        Which rows give the scores. "folds": every row, by the fold's model that has not seen it.
        "split": held-out rows; the coverage is at least the one asked for. "loo": every row, by
        first-order leave-one-out, for an :class:`~skanfis.ANFISRegressor`, alone or in a Pipeline.
    scaled : bool, default=True
        Whether widths are proportional to the deviation of ``predict(X, return_std=True)``, or
        all equal.
    cv : int, splitter or iterable of splits, default=10
        For "folds": their largest number, or splits that hold out every row once.
    calibration_fraction : float, default=0.25
        For "split": fraction of the rows, or groups, held out. 1, all rows, is for a fitted model,
        given as ``FrozenEstimator(model)``.
    random_state : int, RandomState instance or None, default=None
        Seed of the folds and of the held-out rows. None is a fixed seed.
    n_jobs : int, default=None
        Processes for the fits of the folds.

    Attributes
    ----------
    estimator_ : regressor
        The regressor of ``predict``: trained on all rows, or, for "split", on those not held out.
    estimators_ : list of regressor
        For "folds": the models, each trained without its fold; else empty.
    scores_ : ndarray of shape (n_calibration,) or (n_calibration, n_outputs)
        Sorted scores. NaN where the model gave NaN, which counts as infinite.
    n_units_ : float
        How many rows, or groups, the scores come from; for weighted rows, the effective sample
        size.
    n_features_in_ : int
    feature_names_in_ : ndarray of shape (n_features,)
        Both if the regressor knows them.

    References
    ----------
    .. [1] V. Vovk, A. Gammerman and G. Shafer, "Algorithmic learning in a random world", 2005.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.intervals import ConformalRegressor
    >>> rng = np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, size=(400, 1))
    >>> y = np.sin(3 * X[:, 0]) + 0.1 * rng.standard_t(3, size=400)
    >>> model = ConformalRegressor(ANFISRegressor(n_mfs=3), cv=5).fit(X[:200], y[:200])
    >>> lower, upper = model.predict_interval(X[200:], coverage=0.9)
    >>> bool(0.85 < np.mean((lower <= y[200:]) & (y[200:] <= upper)) < 0.95)
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "estimator": [HasMethods(["fit", "predict"]), None],
        "method": [StrOptions({"folds", "split", "loo"})],
        "scaled": ["boolean"],
        "cv": [Interval(Integral, 2, None, closed="left"), HasMethods(["split"]), Iterable],
        "calibration_fraction": [Interval(Real, 0, 1, closed="right")],
        "random_state": ["random_state"],
        "n_jobs": N_JOBS,
    }

    def __init__(
        self,
        estimator: Any = None,
        *,
        method: str = "folds",
        scaled: bool = True,
        cv: Any = 10,
        calibration_fraction: float = 0.25,
        random_state: int | np.random.RandomState | None = None,
        n_jobs: int | None = None,
    ) -> None:
        self.estimator = estimator
        self.method = method
        self.scaled = scaled
        self.cv = cv
        self.calibration_fraction = calibration_fraction
        self.random_state = random_state
        self.n_jobs = n_jobs

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        inner = self._regressor().__sklearn_tags__()
        tags.input_tags, tags.target_tags = inner.input_tags, inner.target_tags
        tags.regressor_tags = inner.regressor_tags
        return tags

    def get_metadata_routing(self) -> MetadataRouter:
        """Say which metadata go where: groups and weights are used here and passed to ``fit``."""
        mapping = MethodMapping().add(caller="fit", callee="fit")
        router = MetadataRouter(owner=type(self).__name__).add_self_request(self)
        return router.add(estimator=self._regressor(), method_mapping=mapping)

    @fit_context(prefer_skip_nested_validation=False)
    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        groups: ArrayLike | None = None,
    ) -> Self:
        """Train the regressor, and find the scores of rows that it has not seen.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Whatever the regressor takes.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive, for the regressor's ``fit`` and for the scores.
        groups : array-like of shape (n_samples,), default=None
            Run, device or day of each row: whole groups are held out, and intervals are for rows of
            a new group. Passed, as numbers, to the regressor's ``fit`` if that takes groups.

        Raises
        ------
        ValueError
            If the data are not finite, ``cv`` does not hold out every row once and groups as a
            whole, one group alone has weight, or "loo" has groups or a frozen regressor; if
            ``scaled`` is asked of a regressor without ``return_std``.
        """
        X, y, sample_weight = indexable(X, y, sample_weight)
        targets, weight, numbers = _scores.checked_targets(y, sample_weight, groups)
        if numbers is not None and self.method == "loo":
            raise ValueError("method='loo' leaves out rows, not groups: use 'folds' or 'split'.")
        params = _scores.fit_params(self, self._regressor(), sample_weight, numbers)
        data = _scores.TrainingSet(X, y, targets, params)
        least = _scores.least_deviations(targets) if self.scaled else None
        estimator, estimators, held_out, scores = self._calibrated(data, weight, numbers, least)
        own_groups = None if numbers is None else numbers[held_out]
        own_weight = None if weight is None else weight[held_out]
        masses, n_units = _scores.row_masses(held_out.size, own_weight, own_groups)
        # All attributes are set together: an interrupted fit leaves the earlier ones.
        for name in ("n_features_in_", "feature_names_in_"):
            self.__dict__.pop(name, None)
            if hasattr(estimator, name):
                setattr(self, name, getattr(estimator, name))
        self.estimator_, self.estimators_ = estimator, estimators
        self._least, self._scores_by_row = least, scores
        self._groups, self._masses, self.n_units_ = own_groups, masses, n_units
        self._single_output = targets.ndim == 1
        self.scores_ = np.sort(scores[:, 0] if self._single_output else scores, axis=0)
        return self

    def _calibrated(self, data, weight, groups, least):
        """The regressor, those of the folds, the held-out rows, and their scores."""
        regressor, every = self._regressor(), np.arange(len(data.targets))
        seed = 0 if self.random_state is None else self.random_state
        if self.method == "loo":
            estimator = data.fitted(regressor)
            scores = _scores.leave_one_out_scores(estimator, data, weight, least)
            return estimator, [], every, scores
        if self.method == "split":
            fraction = float(self.calibration_fraction)
            training, held_out = _scores.one_part(
                regressor, every.size, weight, groups, fraction, seed
            )
            estimator = data.fitted(regressor, training)
            scores = _scores.held_out_scores(estimator, data, held_out, least)
            return estimator, [], held_out, scores
        parts = _scores.folds(self.cv, data.targets, groups, seed)
        estimator = data.fitted(regressor)
        estimators = Parallel(n_jobs=self.n_jobs)(
            delayed(data.fitted)(regressor, training) for training, _ in parts
        )
        scores = np.empty(data.targets.reshape(every.size, -1).shape)
        for one, (_, rows) in zip(estimators, parts, strict=True):
            scores[rows] = _scores.held_out_scores(one, data, rows, least)
        return estimator, estimators, every, scores

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the target by ``estimator_``, (n_samples,) or (n_samples, n_outputs)."""
        check_is_fitted(self)
        return self.estimator_.predict(X)

    def predict_interval(
        self, X: ArrayLike, coverage: float = 0.9, confidence: float | str | None = "auto"
    ) -> tuple[np.ndarray, np.ndarray]:
        """Predict intervals that contain the target with the given coverage.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
        coverage : float, default=0.9
            Probability that a new row's target lies in its interval; for several outputs, that of
            each alone.
        confidence : float, "auto" or None, default="auto"
            With groups: the probability that ``coverage`` or more of a new group's rows lie in
            their intervals. "auto" takes the value of ``coverage``; None promises the coverage on
            average over new groups.

        Returns
        -------
        lower, upper : ndarray of shape (n_samples,) or (n_samples, n_outputs)
            NaN where the prediction is NaN. Infinite if too many held-out rows were predicted as
            NaN.

        Raises
        ------
        ValueError
            If there are too few rows or groups: K of them allow K / (K + 1) at most; if a
            confidence is asked for without groups.
        """
        check_is_fitted(self)
        coverage, confidence = self._checked_levels(coverage, confidence)
        centers, deviations = _scores.predicted(self.estimator_, X, self._least)
        width = deviations * self._quantiles(coverage, confidence)
        lower, upper = centers - width, centers + width
        return (lower[:, 0], upper[:, 0]) if self._single_output else (lower, upper)

    def _quantiles(self, coverage, confidence):
        masses, groups, columns = self._masses, self._groups, self._scores_by_row.T
        if groups is None:
            return [_scores.score_quantile(one, masses, coverage) for one in columns]
        if confidence is None:
            return [_scores.one_row_per_group(one, masses, groups, coverage) for one in columns]
        by_group = [_scores.group_scores(one, masses, groups, coverage) for one in columns]
        return [_scores.score_quantile(own, mass, confidence) for own, mass in by_group]

    def _regressor(self):
        return ANFISRegressor() if self.estimator is None else self.estimator

    def _checked_levels(self, coverage, confidence):
        """Coverage, and confidence or None; ValueError if there are too few rows or groups."""
        asked = "coverage" if confidence in (None, "auto") else "confidence"
        if asked == "confidence" and self._groups is None:
            raise ValueError(
                "confidence is of whole groups, and fit was given none: fit with groups, or leave "
                "confidence at 'auto'."
            )
        if confidence == "auto":
            confidence = None if self._groups is None else coverage
        for name, level in (("coverage", coverage), ("confidence", confidence)):
            is_number = isinstance(level, Real) and 0.0 < float(level) < 1.0
            if not is_number and (name == "coverage" or level is not None):
                raise ValueError(f"{name}={level!r} must be a number between 0 and 1.")
        level = coverage if confidence is None else confidence
        total = self.n_units_ / (self.n_units_ + 1.0)
        if total < level - _scores.ROUNDING:
            needed = int(np.ceil(level / (1.0 - level) - _scores.ROUNDING))
            what = "rows" if self._groups is None else "groups"
            held_out = " held out" if self.method == "split" else ""
            more = ", or a larger calibration_fraction" if self.method == "split" else ""
            raise ValueError(
                f"{asked}={level:g} needs {needed} {what}{held_out} or more; there are "
                f"{self.n_units_:.4g}, enough for {asked}={np.floor(1e3 * total) / 1e3:g}. Ask for "
                f"less, or give more {what}{more}."
            )
        return float(coverage), None if confidence is None else float(confidence)
