"""Scores: how many standard deviations rows that a model has not seen lie from its predictions."""

import inspect
import warnings

import numpy as np
from sklearn.frozen import FrozenEstimator
from sklearn.pipeline import Pipeline

from .._sklearn import safe_indexing
from ..exceptions import OutOfBoundsWarning

__all__ = ["held_out_scores", "last_step", "least_deviations", "leave_one_out_scores", "predicted"]

# An exact fit has no deviation to divide by: of the target's range, what rounding leaves.
_LEAST_DEVIATION = 1e-12
# Of a row that a model has to itself.
_SMALLEST_FREEDOM = 1e-6


def least_deviations(targets):
    """What no deviation of targets (n_rows,) or (n_rows, n_outputs) is below, (n_outputs,)."""
    least = _LEAST_DEVIATION * np.atleast_1d(np.ptp(targets, axis=0))
    return np.where(least > 0.0, least, np.finfo(float).tiny)


def predicted(estimator, X, least):
    """Predictions and deviations, (n_rows, n_outputs); deviations are one where ``least`` is None.

    The deviation of a Pipeline is its last step's, of a search its best estimator's.
    """
    if least is None:
        centers = np.asarray(estimator.predict(X), dtype=float)
        centers = centers.reshape(len(centers), -1)
        return centers, np.ones(centers.shape)
    # By itself: with metadata routing a Pipeline would have to be told of return_std.
    final, X = last_step(estimator, X)
    if "return_std" not in inspect.signature(final.predict).parameters:
        raise ValueError(
            f"scaled=True needs predict(X, return_std=True), which {type(final).__name__} does not "
            "have: use scaled=False, for intervals of one width."
        )
    mean, deviation = (np.asarray(one, float) for one in final.predict(X, return_std=True))
    centers = mean.reshape(len(mean), -1)
    return centers, np.maximum(deviation.reshape(centers.shape), least)


def held_out_scores(estimator, data, rows, least):
    """Scores of rows that an estimator has not seen, (n_rows, n_outputs)."""
    is_frozen = isinstance(estimator, FrozenEstimator)
    if not is_frozen and getattr(last_step(estimator)[0], "out_of_bounds", None) == "raise":
        raise ValueError(
            "out_of_bounds='raise' refuses rows held out that lie beyond the range of the others, "
            "as some always do. Give the regressor out_of_bounds='clip' or 'linear', or a fitted "
            "one as sklearn.frozen.FrozenEstimator(model), with method='split'."
        )
    with warnings.catch_warnings():
        # That a row held out lies beyond the others is what is to be measured.
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        centers, deviations = predicted(estimator, safe_indexing(data.X, rows), least)
    return np.abs(data.targets[rows].reshape(centers.shape) - centers) / deviations


def leave_one_out_scores(estimator, data, weight, least):
    """Studentised residuals: |y - y_(-i)| over the deviation of y_(-i)."""
    final = last_step(estimator)[0]
    noise = getattr(final, "noise_std_", None)
    if noise is None:
        raise ValueError(
            f"method='loo' needs a fitted ANFISRegressor, alone or at the end of a Pipeline; "
            f"{type(final).__name__} tells nothing of its noise (noise_std_). Use "
            "another method; with scaled=False where predict has no return_std."
        )
    floor = least_deviations(data.targets)
    centers, deviations = predicted(estimator, data.X, floor)
    noise = np.maximum(np.atleast_1d(noise), floor)
    leverage = (deviations / noise) ** 2 - 1.0
    # Rows that each row counts as in a fit.
    own = np.ones((1, 1)) if weight is None else weight[:, None] * _rows_per_weight(weight)
    freedom = np.clip(1.0 - own * leverage, _SMALLEST_FREEDOM, 1.0)
    residual = np.abs(data.targets.reshape(centers.shape) - centers) / freedom
    # The leverage of the row in the model without it is h / (1 - w h).
    return residual if least is None else residual / (np.sqrt(1.0 + leverage / freedom) * noise)


def last_step(estimator, X=None):
    """What predicts, behind what freezes or found it, and X, if given, as it takes it."""
    if isinstance(estimator, FrozenEstimator):
        return last_step(estimator.estimator, X)
    if hasattr(estimator, "best_estimator_"):
        return last_step(estimator.best_estimator_, X)
    if not isinstance(estimator, Pipeline):
        return estimator, X
    for _, step in estimator.steps[:-1] if X is not None else ():
        X = X if step is None or step == "passthrough" else step.transform(X)
    return last_step(estimator.steps[-1][1], X)


def _rows_per_weight(weight):
    return max(1.0, weight.sum() / np.sum(weight**2))
