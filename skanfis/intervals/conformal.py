"""ConformalRegressor: intervals that cover as often as was asked, around any regressor."""

import inspect
import warnings
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike
from sklearn import get_config
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin, clone
from sklearn.frozen import FrozenEstimator
from sklearn.model_selection import GroupKFold, GroupShuffleSplit, KFold, ShuffleSplit, check_cv
from sklearn.pipeline import Pipeline
from sklearn.utils import check_array, indexable
from sklearn.utils.metadata_routing import MetadataRouter, MethodMapping, process_routing
from sklearn.utils.validation import check_is_fitted, has_fit_parameter

from .._sklearn import (
    HasMethods,
    Interval,
    StrOptions,
    check_sample_weight,
    fit_context,
    safe_indexing,
)
from .._validation import check_finite, group_numbers, named_refusals, positive_weights
from ..exceptions import OutOfBoundsWarning
from ..regressor import ANFISRegressor
from ._quantiles import cross_bounds, is_enough, n_needed, row_masses, score_quantile

__all__ = ["ConformalRegressor"]

# An exact fit has no deviation to divide by: of the target's range, what rounding leaves.
_LEAST_DEVIATION = 1e-12
# Rows whose bounds are found at one time.
_MOST_ROWS = 16_384
# Of a row that a model has to itself.
_SMALLEST_FREEDOM = 1e-6


class ConformalRegressor(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    r"""Prediction intervals that cover, around any regressor.

    How far rows that a model has not seen lie from its predictions says how far a new row will:
    conformal prediction [1]_. With scores :math:`s_i = |y_i - \hat y(x_i)| / \sigma(x_i)` of such
    rows, where :math:`\sigma` is the model's own standard deviation, the interval is
    :math:`\hat y(x) \pm q\, \sigma(x)`, q the smallest score that as many rows as asked do not
    exceed. If the new row is one like the others, it is covered as often as asked, whatever the
    model and however wrong its deviation.

    Parameters
    ----------
    estimator : regressor, default=None
        What predicts; a Pipeline for example. None is ``ANFISRegressor()``.
    method : {"cross", "split", "loo"}, default="cross"
        Which rows give the scores. "split": rows held out, on which the model is never trained.
        Covers at least as often as asked. "cross": every row, by a model of the folds without it,
        and intervals by all of these models (CV+ [2]_; of as many folds as rows, jackknife+).
        Covers as often as asked up to small differences, surely 2 coverage - 1. "loo": every row,
        by what the model would be without it: exact in the consequents, to first order in the
        premises, without a further fit. No guarantee, for the structure has seen every row; for a
        fitted :class:`~skanfis.ANFISRegressor` alone, or at the end of a Pipeline.
    scaled : bool, default=True
        Whether intervals are as wide as the model's own standard deviation says, row by row, by
        ``predict(X, return_std=True)``; else all have one width ("cross": nearly).
    cv : int, splitter or iterable of splits, default=10
        Of "cross": the number of folds, at most; no more than rows, or groups. A splitter of
        scikit-learn, or splits, must hold out every row once.
    calibration_fraction : float, default=0.25
        Of "split": part of the rows, or of the groups, held out. 1 takes all rows given, for a
        model that is fitted already, as ``FrozenEstimator(model)``.
    random_state : int, RandomState instance or None, default=None
        Seed of the folds and of the rows held out. None stands for one fixed seed.
    n_jobs : int, default=None
        Processes for the fits of "cross".

    Attributes
    ----------
    estimator_ : regressor
        What ``predict`` asks: trained on all rows, but for "split", which holds some out.
    estimators_ : list of regressor
        The models of "cross", each without its fold; else empty.
    scores_ : ndarray of shape (n_calibration,) or (n_calibration, n_outputs)
        Sorted. NaN where the model gave NaN, which counts as infinite.
    n_units_ : float
        How many rows, or with ``groups`` groups, the scores come from; of weighted rows, how many
        of one weight would say as much.
    n_features_in_ : int
        Number of inputs, if the regressor knows it.
    feature_names_in_ : ndarray of shape (n_features,)
        Names of the inputs, if the regressor knows them.

    See Also
    --------
    skanfis.ANFISRegressor : ``predict(X, return_std=True)`` gives the deviation alone.

    Notes
    -----
    With ``groups`` (runs, devices, days) whole groups are held out, every group counts as much as
    any other, and what is covered is a row of a *new* group [3]_, which with intervals by row it
    would not be. A group is one unit, however many rows it has: 90 % takes 9 groups.

    References
    ----------
    .. [1] V. Vovk, A. Gammerman and G. Shafer, "Algorithmic learning in a random world", Springer,
       2005.
    .. [2] R. F. Barber, E. J. Candès, A. Ramdas and R. J. Tibshirani, "Predictive inference with
       the jackknife+", Annals of Statistics 49 (2021) 486-507.
    .. [3] Y. Lee, R. F. Barber and R. Willett, "Distribution-free inference with hierarchical
       data", arXiv:2306.06342 (2023).

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.intervals import ConformalRegressor
    >>> rng = np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, size=(400, 1))
    >>> y = np.sin(3 * X[:, 0]) + 0.1 * rng.standard_t(3, size=400)
    >>> rules = ANFISRegressor(n_mfs=3)
    >>> model = ConformalRegressor(rules, cv=5).fit(X[:200], y[:200])
    >>> lower, upper = model.predict_interval(X[200:], coverage=0.9)
    >>> bool(0.85 < np.mean((lower <= y[200:]) & (y[200:] <= upper)) < 0.95)
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "estimator": [HasMethods(["fit", "predict"]), None],
        "method": [StrOptions({"cross", "split", "loo"})],
        "scaled": ["boolean"],
        "cv": [Interval(Integral, 2, None, closed="left"), HasMethods(["split"]), Iterable],
        "calibration_fraction": [Interval(Real, 0, 1, closed="right")],
        "random_state": ["random_state"],
        "n_jobs": [Integral, None],
    }

    def __init__(
        self,
        estimator: Any = None,
        *,
        method: str = "cross",
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
            Weights, zero or positive: those of the regressor's ``fit``, and how much each row's
            score counts. For a Pipeline turn scikit-learn's metadata routing on.
        groups : array-like of shape (n_samples,), default=None
            The run, device or day that each row belongs to: whole groups are held out, and the
            intervals are for a row of a new group. Passed to the regressor's ``fit`` if that takes
            groups (a Pipeline with metadata routing).

        Returns
        -------
        self : ConformalRegressor

        Raises
        ------
        ValueError
            If the targets or weights are not finite or of the wrong length; if there are fewer than
            two groups; if ``cv`` does not hold out every row once; if ``method="loo"`` is given
            groups; if the regressor has no standard deviation.
        """
        X, y, sample_weight, groups = indexable(X, y, sample_weight, groups)
        targets, weight, numbers = self._checked(y, sample_weight, groups)
        params = self._fit_params(sample_weight, groups)
        data = _Data(X, y, targets, params)
        self._single_output, self._is_by_group = targets.ndim == 1, numbers is not None
        self._floor = _LEAST_DEVIATION * np.atleast_1d(np.ptp(targets, axis=0))
        held_out = np.arange(len(targets))
        self.estimators_: list[Any] = []
        self._folds: list[np.ndarray] = []
        if self.method == "split":
            training, held_out = self._split(len(targets), numbers)
            self.estimator_ = data.fitted(self._regressor(), training)
            scores = self._scores(self.estimator_, data, held_out)
        else:
            self.estimator_ = data.fitted(self._regressor(), None)
            if self.method == "loo":
                scores = self._leave_one_out(data, weight)
        part = None if numbers is None else numbers[held_out]
        own = None if weight is None else weight[held_out]
        self._masses, self.n_units_ = row_masses(held_out.size, own, part)
        if self.method == "cross":
            scores = self._cross(data, numbers)
        self._scores_by_row = scores
        found = np.sort(scores, axis=0)
        self.scores_ = found[:, 0] if self._single_output else found
        for name in ("n_features_in_", "feature_names_in_"):
            if hasattr(self.estimator_, name):
                setattr(self, name, getattr(self.estimator_, name))
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the target by ``estimator_``.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)
        """
        check_is_fitted(self)
        return self.estimator_.predict(X)

    def predict_interval(
        self, X: ArrayLike, coverage: float = 0.9
    ) -> tuple[np.ndarray, np.ndarray]:
        """Predict intervals that cover the target as often as asked.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
        coverage : float, default=0.9
            How often a new row's target is to lie in its interval, between 0 and 1; of several
            outputs, each by itself.

        Returns
        -------
        lower, upper : ndarray of shape (n_samples,) or (n_samples, n_outputs)
            NaN where the prediction is. Infinite where more than 1 - coverage of the rows held out
            were predicted as NaN.

        Raises
        ------
        ValueError
            If there are too few rows, or groups, for such a coverage: K give K / (K + 1) at most.
        """
        check_is_fitted(self)
        coverage = self._checked_coverage(coverage)
        centers, deviations = self._predicted(self.estimator_, X)
        if self.method == "cross":
            lower, upper = self._cross_intervals(X, centers, coverage)
        else:
            width = deviations * self._quantiles(coverage)
            lower, upper = centers - width, centers + width
        return (lower[:, 0], upper[:, 0]) if self._single_output else (lower, upper)

    def half_width(self, coverage: float = 0.9) -> float | np.ndarray:
        """How far intervals reach to either side of the prediction, by ``method`` "split" or "loo".

        Parameters
        ----------
        coverage : float, default=0.9
            As of :meth:`predict_interval`.

        Returns
        -------
        q : float or ndarray of shape (n_outputs,)
            In standard deviations of ``predict(X, return_std=True)``; with ``scaled=False`` in the
            target's units.

        Raises
        ------
        ValueError
            As :meth:`predict_interval` does; of ``method="cross"``, whose intervals are those of
            several models.
        """
        check_is_fitted(self)
        if self.method == "cross":
            raise ValueError(
                "method='cross' has no one half width: its intervals are by the models of all "
                "folds. Use method='split' or 'loo'."
            )
        found = self._quantiles(self._checked_coverage(coverage))
        return float(found[0]) if self._single_output else found

    def _quantiles(self, coverage):
        scores = self._scores_by_row.T
        return np.array([score_quantile(one, self._masses, coverage) for one in scores])

    def _regressor(self):
        return ANFISRegressor() if self.estimator is None else self.estimator

    def _checked(self, y, sample_weight, groups):
        """Targets as an array, positive weights or None, numbers of groups or None."""
        if y is None:
            name = type(self).__name__
            raise ValueError(f"{name} requires y to be passed, but the target y is None.")
        with named_refusals(y=y):
            targets = check_array(
                y, ensure_2d=False, dtype=np.float64, ensure_all_finite=False, input_name="y"
            )
        names = [f"y{k}" for k in range(targets.reshape(len(targets), -1).shape[1])]
        check_finite(targets.reshape(len(targets), -1), "y", names)
        if sample_weight is not None:
            sample_weight = check_sample_weight(sample_weight, targets, dtype=np.float64)
            positive_weights(sample_weight, len(targets))
        if groups is None:
            return targets, sample_weight, None
        if self.method == "loo":
            raise ValueError(
                "method='loo' leaves out rows, not groups: a row's group would stay, and tell. Use "
                "method='cross' or 'split', or leave groups at None."
            )
        numbers = group_numbers(groups)
        if numbers.max() == 0:
            raise ValueError("groups has a single group; at least 2 are needed to hold one out.")
        return targets, sample_weight, numbers

    def _fit_params(self, sample_weight, groups):
        given = {"sample_weight": sample_weight, "groups": groups}
        given = {name: value for name, value in given.items() if value is not None}
        if get_config()["enable_metadata_routing"]:
            return dict(process_routing(self, "fit", **given).estimator.fit)
        regressor = self._regressor()
        if "sample_weight" in given and not has_fit_parameter(regressor, "sample_weight"):
            raise ValueError(
                f"sample_weight was given, but the fit of {type(regressor).__name__} does not take "
                "it. For a Pipeline turn on sklearn.set_config(enable_metadata_routing=True), and "
                "call set_fit_request(sample_weight=True) on the step that is to have it."
            )
        if "groups" in given and not has_fit_parameter(regressor, "groups"):
            del given["groups"]
        return given

    def _seed(self):
        return 0 if self.random_state is None else self.random_state

    def _split(self, n_rows, groups):
        fraction = float(self.calibration_fraction)
        every = np.arange(n_rows)
        if fraction == 1.0:
            if not isinstance(self._regressor(), FrozenEstimator):
                raise ValueError(
                    "calibration_fraction=1 leaves no row to train on: give the fitted model as "
                    "sklearn.frozen.FrozenEstimator(model), or a smaller fraction."
                )
            return every, every
        kind = ShuffleSplit if groups is None else GroupShuffleSplit
        splitter = kind(1, test_size=fraction, random_state=self._seed())
        try:
            training, held_out = next(splitter.split(every, groups=groups))
        except ValueError as error:
            raise ValueError(
                f"method='split' with calibration_fraction={fraction:g} leaves nothing to train on "
                f"of {n_rows} rows: use a smaller fraction, or method='cross'."
            ) from error
        return np.sort(training), np.sort(held_out)

    def _cross(self, data, groups):
        """Scores of every row by the models of the folds without it."""
        n_rows = len(data.targets)
        if not isinstance(self.cv, Integral):
            splitter = check_cv(self.cv)
        elif groups is None:
            splitter = KFold(min(int(self.cv), n_rows), shuffle=True, random_state=self._seed())
        else:
            splitter = GroupKFold(min(int(self.cv), int(groups.max()) + 1))
        folds = list(splitter.split(np.empty((n_rows, 0)), data.targets, groups))
        counts = np.bincount(np.concatenate([held_out for _, held_out in folds]), minlength=n_rows)
        if not (counts == 1).all():
            row = int(np.argmax(counts != 1))
            raise ValueError(
                f"cv={splitter!r} holds out row {row} {counts[row]} times; every row must be held "
                "out once, as KFold, GroupKFold and LeaveOneGroupOut do."
            )
        regressor = self._regressor()
        self.estimators_ = Parallel(n_jobs=self.n_jobs)(
            delayed(data.fitted)(regressor, training) for training, _ in folds
        )
        scores = np.empty((n_rows, data.targets.reshape(n_rows, -1).shape[1]))
        for estimator, (_, held_out) in zip(self.estimators_, folds, strict=True):
            scores[held_out] = self._scores(estimator, data, held_out)
        self._folds = [held_out for _, held_out in folds]
        return scores

    def _scores(self, estimator, data, rows):
        centers, deviations = self._predicted(estimator, safe_indexing(data.X, rows), warn=False)
        targets = data.targets[rows].reshape(centers.shape)
        return np.abs(targets - centers) / deviations

    def _leave_one_out(self, data, weight):
        """Studentised residuals: |y - y_(-i)| over the deviation of y_(-i)."""
        final = _final(self.estimator_)
        noise = getattr(final, "noise_std_", None)
        if noise is None:
            raise ValueError(
                f"method='loo' needs a fitted ANFISRegressor, alone or at the end of a Pipeline; "
                f"{type(final).__name__} tells nothing of its noise (noise_std_). Use "
                "method='cross' or 'split'."
            )
        centers, deviations = _with_deviation(self.estimator_, data.X)
        targets = data.targets.reshape(len(data.targets), -1)
        noise = np.maximum(np.atleast_1d(noise), self._floor)
        leverage = (deviations.reshape(targets.shape) / noise) ** 2 - 1.0
        if weight is not None:
            leverage *= (weight / np.mean(weight[weight > 0.0]))[:, None]
        freedom = np.clip(1.0 - leverage, _SMALLEST_FREEDOM, 1.0)
        residual = np.abs(targets - centers.reshape(targets.shape))
        return residual / (np.sqrt(freedom) * noise) if self.scaled else residual / freedom

    def _predicted(self, estimator, X, warn=True):
        """Predictions and deviations, (n_rows, n_outputs); deviations of one where not scaled."""
        with warnings.catch_warnings():
            if not warn:
                # That a row held out lies beyond the others is what is to be measured.
                warnings.simplefilter("ignore", OutOfBoundsWarning)
            if not self.scaled:
                centers = np.asarray(estimator.predict(X), dtype=float)
                centers = centers.reshape(len(centers), -1)
                return centers, np.ones(centers.shape)
            centers, deviations = _with_deviation(estimator, X)
        centers = centers.reshape(len(centers), -1)
        floor = np.where(self._floor > 0.0, self._floor, np.finfo(float).tiny)
        return centers, np.maximum(deviations.reshape(centers.shape), floor)

    def _cross_intervals(self, X, centers, coverage):
        found = [self._predicted(estimator, X, warn=False) for estimator in self.estimators_]
        lower, upper = np.empty(centers.shape), np.empty(centers.shape)
        for k in range(centers.shape[1]):
            folds = [(self._scores_by_row[rows, k], self._masses[rows]) for rows in self._folds]
            for start in range(0, len(centers), _MOST_ROWS):
                part = slice(start, start + _MOST_ROWS)
                own = np.array([(one[part, k], other[part, k]) for one, other in found])
                bounds = cross_bounds(folds, own[:, 0], own[:, 1], coverage)
                lower[part, k], upper[part, k] = bounds
        return lower, upper

    def _checked_coverage(self, coverage):
        if not (isinstance(coverage, Real) and 0.0 < float(coverage) < 1.0):
            raise ValueError(f"coverage={coverage!r} must be a number between 0 and 1.")
        coverage = float(coverage)
        needed = n_needed(coverage)
        total = self.n_units_ / (self.n_units_ + 1.0)
        if not is_enough(total, coverage):
            what = "groups" if self._is_by_group else "rows"
            held_out = " held out" if self.method == "split" else ""
            more = ", or a larger calibration_fraction" if self.method == "split" else ""
            raise ValueError(
                f"coverage={coverage:g} needs {needed} {what}{held_out} or more; there are "
                f"{self.n_units_:.4g}, enough for coverage={np.floor(1e3 * total) / 1e3:g}. Ask "
                f"for less, or give more {what}{more}."
            )
        return coverage


class _Data:
    """What a regressor is trained on, in the user's own tables."""

    def __init__(self, X, y, targets, params):
        self.X, self.y, self.targets, self.params = X, y, targets, params

    def fitted(self, regressor, rows):
        """A clone of the regressor, trained on some rows, or on all of None."""
        estimator = clone(regressor)
        if rows is None:
            return estimator.fit(self.X, self.y, **self.params)
        params = {name: safe_indexing(value, rows) for name, value in self.params.items()}
        return estimator.fit(safe_indexing(self.X, rows), safe_indexing(self.y, rows), **params)


def _final(estimator):
    """What predicts: behind what freezes it, the last step of a Pipeline."""
    if isinstance(estimator, FrozenEstimator):
        return _final(estimator.estimator)
    return _final(estimator.steps[-1][1]) if isinstance(estimator, Pipeline) else estimator


def _with_deviation(estimator, X):
    """Prediction and standard deviation, of a Pipeline by its last step."""
    if isinstance(estimator, FrozenEstimator):
        return _with_deviation(estimator.estimator, X)
    if isinstance(estimator, Pipeline):
        # By itself: with metadata routing a Pipeline would have to be told of return_std.
        for _, step in estimator.steps[:-1]:
            X = X if step is None or step == "passthrough" else step.transform(X)
        return _with_deviation(estimator.steps[-1][1], X)
    if "return_std" not in inspect.signature(estimator.predict).parameters:
        raise ValueError(
            "scaled=True needs predict(X, return_std=True), which "
            f"{type(estimator).__name__} does not have: use scaled=False, for intervals of one "
            "width."
        )
    found = estimator.predict(X, return_std=True)
    return tuple(np.asarray(one, dtype=float) for one in found)
