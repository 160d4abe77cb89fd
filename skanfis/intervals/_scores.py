"""Scores: how many standard deviations rows that a model has not seen lie from its predictions."""

import inspect
import warnings
from dataclasses import dataclass

import numpy as np
from sklearn.frozen import FrozenEstimator
from sklearn.pipeline import Pipeline

from .._sklearn import safe_indexing
from ..exceptions import OutOfBoundsWarning

__all__ = ["Scorer", "final_step"]

# An exact fit has no deviation to divide by: of the target's range, what rounding leaves.
_LEAST_DEVIATION = 1e-12
# Of a row that a model has to itself.
_SMALLEST_FREEDOM = 1e-6


@dataclass(frozen=True, eq=False)
class Scorer:
    """Scores of the rows of one set.

    Parameters
    ----------
    scaled : bool
        Whether by the model's own deviation; else deviations are one.
    floor : ndarray of shape (n_outputs,)
        What no deviation is below.
    """

    scaled: bool
    floor: np.ndarray

    @classmethod
    def of(cls, targets, scaled):
        """A Scorer of targets (n_rows,) or (n_rows, n_outputs)."""
        return cls(scaled, _LEAST_DEVIATION * np.atleast_1d(np.ptp(targets, axis=0)))

    def predicted(self, estimator, X, warn=True):
        """Predictions and deviations, (n_rows, n_outputs)."""
        # That a row held out lies beyond the others is what is to be measured.
        with warnings.catch_warnings():
            if not warn:
                warnings.simplefilter("ignore", OutOfBoundsWarning)
            if not self.scaled:
                centers = np.asarray(estimator.predict(X), dtype=float)
                centers = centers.reshape(len(centers), -1)
                return centers, np.ones(centers.shape)
            centers, deviations = _with_deviation(estimator, X)
        centers = centers.reshape(len(centers), -1)
        floor = np.where(self.floor > 0.0, self.floor, np.finfo(float).tiny)
        return centers, np.maximum(deviations.reshape(centers.shape), floor)

    def held_out(self, estimator, data, rows):
        """Scores of rows that an estimator has not seen, (n_rows, n_outputs)."""
        centers, deviations = self.predicted(estimator, safe_indexing(data.X, rows), warn=False)
        return np.abs(data.targets[rows].reshape(centers.shape) - centers) / deviations

    def leave_one_out(self, estimator, data, weight):
        """Studentised residuals: |y - y_(-i)| over the deviation of y_(-i)."""
        final = final_step(estimator)
        noise = getattr(final, "noise_std_", None)
        if noise is None:
            raise ValueError(
                f"method='loo' needs a fitted ANFISRegressor, alone or at the end of a Pipeline; "
                f"{type(final).__name__} tells nothing of its noise (noise_std_). Use "
                "another method; with scaled=False where predict has no return_std."
            )
        centers, deviations = _with_deviation(estimator, data.X)
        targets = data.targets.reshape(len(data.targets), -1)
        noise = np.maximum(np.atleast_1d(noise), self.floor)
        leverage = (deviations.reshape(targets.shape) / noise) ** 2 - 1.0
        own = 1.0 if weight is None else _row_weights(weight)[:, None]
        freedom = np.clip(1.0 - own * leverage, _SMALLEST_FREEDOM, 1.0)
        residual = np.abs(targets - centers.reshape(targets.shape)) / freedom
        # The leverage of the row in the model without it is h / (1 - w h).
        return residual / (np.sqrt(1.0 + leverage / freedom) * noise) if self.scaled else residual


def final_step(estimator):
    """What predicts: behind what freezes it or found it, the last step of a Pipeline."""
    if isinstance(estimator, FrozenEstimator):
        return final_step(estimator.estimator)
    if hasattr(estimator, "best_estimator_"):
        return final_step(estimator.best_estimator_)
    return final_step(estimator.steps[-1][1]) if isinstance(estimator, Pipeline) else estimator


def _row_weights(weight):
    """Rows that each row counts as in a fit; see ``structure.sample.effective_weight``."""
    total = weight.sum()
    return weight * max(1.0, total / np.sum(weight**2))


def _with_deviation(estimator, X):
    """Prediction and standard deviation, of a Pipeline its last step's, of a search its best."""
    if isinstance(estimator, FrozenEstimator):
        return _with_deviation(estimator.estimator, X)
    if hasattr(estimator, "best_estimator_"):
        return _with_deviation(estimator.best_estimator_, X)
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
