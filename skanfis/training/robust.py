r"""Huber's loss by reweighting: rows far from the model count less, all others in full.

Least squares with the weights

    w_i = min(1, epsilon s / |r_i|)

of the last residuals, repeated, ends at the minimum of Huber's estimator (1964). Weights and fit
take turns, and each fit is least squares with one Gram matrix, as without weights. The scale s is
the median of |r| over 0.6745, a robust standard deviation, found again in every turn. With several
outputs, r is the root mean square of the row's residuals.

Before there is any model, rows beyond ten robust standard deviations of a linear model already
count less; scikit-learn's HuberRegressor fits it. The target's own scale is found with these
weights. Otherwise, a grid of many rules would spend a rule on each outlier before it is known as
one.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import HuberRegressor

from .._threads import without
from ..learning.data import column_statistics
from ..learning.sampling import SAMPLE_ROWS, with_sample
from ..search import weighted_quantile

# The median of |u| for a standard normal u.
_NORMAL_MEDIAN = ndtri(0.75)
# Robust standard deviations from the linear model that no sound target exceeds, however it bends.
_FAR = 10.0
# Steps and tolerance of the linear fit: so tight that the order of rows does not matter.
_MOST_STEPS, _TIGHT = 1000, 1e-9
# A residual of rounding errors alone, in standard deviations of the target.
_EXACT = 1e-12
# Decimals of the first weights: more would only carry errors of the linear fit on.
_DIGITS = 2
# Rows that keep less of their weight are left out of a start: with the default epsilon, those
# beyond 2.7 standard deviations.
_OUTLIER = 0.5


def huber_weights(problem, evaluation, epsilon, own):
    """Weights (n_rows,) by the residuals at an evaluation; ``own`` are the rows' own weights."""
    sizes = np.empty(problem.rows.n_rows)
    for part, residual, _ in problem.residuals(evaluation):
        sizes[part] = np.sqrt(np.mean(residual**2, axis=0))
    # If at least half of the rows are met to rounding, the others count next to nothing.
    scale = max(_weighted_median(sizes, own) / _NORMAL_MEDIAN, _EXACT)
    return np.minimum(1.0, epsilon * scale / np.maximum(sizes, np.finfo(float).tiny))


def robust_start(rows):
    """The rows, with the target's scale free of outliers, and the first weights."""
    weights = np.ones(rows.n_rows)
    is_large = rows.n_rows > SAMPLE_ROWS
    lines = _robust_lines(with_sample(rows, SAMPLE_ROWS).sample if is_large else rows)
    if lines is None:
        return rows, weights
    sizes = np.empty(rows.n_rows)
    for part, Z, _, _ in rows.blocks():
        squares = [
            ((values - center) / spread - line.predict(Z.T)) ** 2
            for values, (center, spread, line) in zip(rows.y[part].T, lines, strict=True)
        ]
        sizes[part] = np.sqrt(np.mean(squares, axis=0))
    scale = _weighted_median(sizes, rows.weights) / _NORMAL_MEDIAN
    if scale == 0.0:
        return rows, weights
    weights = np.minimum(1.0, _FAR * scale / np.maximum(sizes, np.finfo(float).tiny))
    weights = 10.0 ** np.round(np.log10(weights), _DIGITS)
    if (weights == 1.0).all():
        return rows, weights
    # With the weight squared, no row adds more than one at ten deviations would.
    targets = column_statistics(rows.y, rows.weights * weights**2)
    return replace(rows, targets=targets), weights


def _robust_lines(rows):
    """Centre, spread and robust line of every output; None if one output has none."""
    Z, _, _ = rows.read(slice(None))
    lines = []
    # In the user's units: on the scale of an outlier, all other targets may be one number.
    for values in rows.y.T:
        center = _weighted_median(values, rows.weights)
        spread = _weighted_median(np.abs(values - center), rows.weights)
        if spread == 0.0:
            return None
        linear = HuberRegressor(max_iter=_MOST_STEPS, tol=_TIGHT)
        # A rough line suffices: it need not converge.
        with without(ConvergenceWarning):
            try:
                linear.fit(Z.T, (values - center) / spread, sample_weight=rows.sample_weight)
            except ValueError:
                return None
        lines.append((center, spread, linear))
    return lines


def _weighted_median(values, weight):
    """The value with half of the weight on either side; between two values, their mean."""
    return 0.5 * sum(float(weighted_quantile(values, weight, 0.5, side)) for side in (1, -1))


def reweighted(rows, weights):
    """The rows with weights by Huber's loss, on top of their own."""
    return replace(rows, sample_weight=rows.weights * weights)


def without_outliers(rows, weights):
    """The rows that keep at least half of their weight; all rows if these are the minority."""
    kept = weights >= _OUTLIER
    # If most rows look like outliers, none counts as one.
    return rows.part(kept) if 2.0 * rows.weights[kept].sum() >= rows.weights.sum() else rows


def silenced(weights):
    """The weights, but next to nothing for rows that keep less than half of theirs."""
    return np.where(weights < _OUTLIER, np.finfo(float).eps * weights, weights)
