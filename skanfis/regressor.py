"""ANFISRegressor: the estimator."""

import warnings
from numbers import Integral, Real

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ._anfis import train
from ._sklearn import HasMethods, Interval, StrOptions, check_sample_weight, fit_context
from ._validation import check_finite, positive_weights
from .exceptions import OutOfBoundsWarning
from .membership import MEMBERSHIPS
from .model import OUT_OF_BOUNDS
from .solvers import SOLVERS

__all__ = ["ANFISRegressor"]


class ANFISRegressor(RegressorMixin, BaseEstimator):
    """DOC"""

    _parameter_constraints = {
        "n_mfs": [StrOptions({"auto"}), Integral, "array-like"],
        "partition": [StrOptions({"auto", "grid"}), HasMethods(["fit", "fit_predict"])],
        "mf": [StrOptions(set(MEMBERSHIPS))],
        "order": [Interval(Integral, 0, 1, closed="both")],
        "solver": [StrOptions(set(SOLVERS))],
        "alpha": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "stiffness": [Interval(Real, 0, None, closed="left")],
        "max_iter": [Interval(Integral, 1, None, closed="left")],
        "tol": [Interval(Real, 0, None, closed="left")],
        "out_of_bounds": [StrOptions(set(OUT_OF_BOUNDS))],
        "warn_out_of_bounds": ["boolean"],
        "random_state": ["random_state"],
        "n_jobs": [Integral, None],
    }

    def __init__(
        self,
        n_mfs="auto",
        *,
        partition="auto",
        mf="gaussian",
        order=1,
        solver="varpro",
        alpha="auto",
        stiffness=0.0,
        max_iter=200,
        tol=1e-4,
        out_of_bounds="clip",
        warn_out_of_bounds=True,
        random_state=None,
        n_jobs=None,
    ):
        self.n_mfs = n_mfs
        self.partition = partition
        self.mf = mf
        self.order = order
        self.solver = solver
        self.alpha = alpha
        self.stiffness = stiffness
        self.max_iter = max_iter
        self.tol = tol
        self.out_of_bounds = out_of_bounds
        self.warn_out_of_bounds = warn_out_of_bounds
        self.random_state = random_state
        self.n_jobs = n_jobs

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X, y, sample_weight=None):
        """Train the model.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs, in any units.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets, in any units.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive. A whole number counts as so many copies of the row, zero as
            the row's absence, in initialisation and scaling too.

        Returns
        -------
        self : ANFISRegressor
        """
        X, y = validate_data(
            self,
            X,
            y,
            dtype=(np.float64, np.float32),
            ensure_all_finite=False,
            ensure_min_samples=2,
            multi_output=True,
            y_numeric=True,
        )
        names = self._input_names()
        check_finite(X, "X", names)
        targets = y.reshape(-1, 1) if y.ndim == 1 else y
        check_finite(targets, "y", [f"y{k}" for k in range(targets.shape[1])])
        if sample_weight is not None:
            sample_weight = check_sample_weight(sample_weight, X, dtype=np.float64)
            keep = positive_weights(sample_weight, X.shape[0])
            if keep is not None:
                X, targets, sample_weight = X[keep], targets[keep], sample_weight[keep]
        training = train(self, X, targets, sample_weight, names)
        self.model_ = training.model
        self.n_iter_ = max(training.result.n_iter, 1)
        self.loss_curve_ = training.result.loss_curve
        self.status_ = training.result.message
        self._single_output = y.ndim == 1
        return self

    def predict(self, X):
        """Predict the target.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)

        Raises
        ------
        ValueError
            If X is not finite; or, with ``out_of_bounds="raise"``, lies outside the training data.

        Warns
        -----
        OutOfBoundsWarning
            If rows lie outside the training data, unless ``warn_out_of_bounds=False``.
        """
        X = self._check_inputs(X)
        inside = self.model_.in_bounds(X)
        outputs = self.model_.predict(X, inside)
        if self.warn_out_of_bounds and not inside.all():
            policy = self.model_.out_of_bounds
            warnings.warn(
                f"{self.model_.describe_out_of_bounds(X)} Policy: out_of_bounds={policy!r}.",
                OutOfBoundsWarning,
                stacklevel=2,
            )
        return outputs[:, 0] if self._single_output else outputs

    def coverage(self, X):
        """How well the training data cover each row, from 0 (not at all) to 1."""
        return self.model_.coverage(self._check_inputs(X))

    def strengths(self, X):
        return self.model_.strengths(self._check_inputs(X))

    @property
    def n_rules_(self):
        """Number of rules."""
        check_is_fitted(self)
        return self.model_.n_rules

    def _input_names(self):
        names = getattr(self, "feature_names_in_", None)
        return [f"x{j}" for j in range(self.n_features_in_)] if names is None else list(names)

    def _check_inputs(self, X):
        check_is_fitted(self)
        X = validate_data(
            self, X, reset=False, dtype=(np.float64, np.float32), ensure_all_finite=False
        )
        check_finite(X, "X", self.model_.input_names)
        return X
