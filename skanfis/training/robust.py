r"""Huber's loss by reweighting: rows far from the model count less, those near it as ever.

Huber's estimator (1964) minimises sum_i rho(r_i / s) with rho(u) = u^2 / 2 up to |u| = epsilon and
epsilon |u| - epsilon^2 / 2 beyond. Least squares with the weights

    w_i = min(1, epsilon s / |r_i|)

of the residuals before has the same minimum: weights and fit are found in turns, and one Gram
matrix serves as before. The scale s is the median of |r| over 0.6745, a robust standard deviation,
found anew in every turn. Of several outputs, r is the length of the row's residuals, over the root
of their number.

Before there is any model, rows far beyond all others already count less: by the residuals of a
linear model that scikit-learn's HuberRegressor finds, beyond ten robust standard deviations. The
target's own scale is found with these weights. A grid of many rules would otherwise spend a rule on
each outlier before it is known for one.

Weights change between runs of the solver and not inside one, whose steps compare costs: they are
costs of one and the same problem only so.
"""

import warnings
from dataclasses import replace

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import HuberRegressor

from .._validation import warn_user
from ..rows import column_statistics

__all__ = ["huber_weights", "learn_robustly", "resistant"]

# The median of |u| for a standard normal u.
_NORMAL_MEDIAN = 0.6744897501960817
# Of the linear model, robust standard deviations that no shape of a sound target leaves.
_FAR = 10.0
_MOST_STEPS, _TIGHT = 1000, 1e-9
# Digits of the first weights: more would only carry the minimiser's errors on.
_DIGITS = 2
_MOST_ROUNDS = 20
_MOST_STARTS = 4
# Rows of less weight have no part in where training starts.
_OUTLIER = 0.5
# Weights are settled when they change by less than this on average.
_SETTLED = 1e-3


def huber_weights(problem, evaluation, epsilon, sample_weight=None):
    """Weights (n_rows,) by the residuals at an evaluation; ``sample_weight`` is the rows' own."""
    sizes = np.empty(problem.rows.n_rows)
    for part, residual, _ in problem.residuals(evaluation):
        sizes[part] = np.sqrt(np.mean(residual**2, axis=0))
    scale = _weighted_median(sizes, sample_weight) / _NORMAL_MEDIAN
    if scale == 0.0:
        # Half of the rows are met exactly: what is not must not be the only one to count.
        return np.where(sizes == 0.0, 1.0, np.finfo(float).eps)
    return np.minimum(1.0, epsilon * scale / np.maximum(sizes, np.finfo(float).tiny))


def resistant(rows):
    """The rows with the target's scale as it is without what is far off, and their weights."""
    weights = np.ones(rows.n_rows)
    Z, target, own = rows.read(slice(None))
    sizes = np.zeros(rows.n_rows)
    for values in target:
        center = _weighted_median(values, own)
        spread = _weighted_median(np.abs(values - center), own)
        if spread == 0.0:
            return rows, weights
        linear = HuberRegressor(max_iter=_MOST_STEPS, tol=_TIGHT)
        scaled = (values - center) / spread
        with warnings.catch_warnings():
            # A rough line will do.
            warnings.simplefilter("ignore", ConvergenceWarning)
            try:
                linear.fit(Z.T, scaled, sample_weight=own)
            except ValueError:
                return rows, weights
        sizes += (scaled - linear.predict(Z.T)) ** 2
    sizes = np.sqrt(sizes / len(target))
    scale = _weighted_median(sizes, own) / _NORMAL_MEDIAN
    if scale == 0.0:
        return rows, weights
    weights = np.minimum(1.0, _FAR * scale / np.maximum(sizes, np.finfo(float).tiny))
    weights = np.maximum(np.round(weights, _DIGITS), 10.0**-_DIGITS)
    if (weights == 1.0).all():
        return rows, weights
    targets = column_statistics(rows.y, _reweighted(rows, weights**2).sample_weight)
    return replace(rows, targets=targets), weights


def _weighted_median(values, weight):
    """Half of the weight is below, half above; between two values, their mean."""
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(np.ones(values.size) if weight is None else weight[order])
    middle = np.searchsorted(upto, 0.5 * upto[-1])
    after = min(middle + int(upto[middle] == 0.5 * upto[-1]), values.size - 1)
    return 0.5 * float(values[order[middle]] + values[order[after]])


def learn_robustly(learn, start, rows, epsilon, weights):
    """Train and reweight until the weights settle.

    ``learn(rows, start, displacement)`` trains, ``start(rows)`` gives a start; ``weights`` are
    those of :func:`resistant`. The first start and what comes of it may have seen outliers: once
    the weights are settled, training starts afresh, from a start that sees no row of less than
    half its weight, and again for as long as that start comes out another one.

    Returns
    -------
    learned : Learned
    weights : ndarray of shape (n_rows,)
        Of the last turn, 1 where a row counts in full.
    """
    learned = learn(_reweighted(rows, weights), start(_without_outliers(rows, weights)), None)
    learned, weights = _settle(learn, learned, rows, weights, epsilon)
    for turn in range(_MOST_STARTS):
        again = start(_without_outliers(rows, weights))
        if turn > 0 and _is_same(again, learned.start):
            break
        learned = learn(_reweighted(rows, weights), again, None)
        learned, weights = _settle(learn, learned, rows, weights, epsilon)
    return learned, weights


def _settle(learn, learned, rows, weights, epsilon):
    """Weights and fit in turns, at one structure."""
    for _ in range(_MOST_ROUNDS):
        before = weights
        evaluation = learned.result.evaluation
        weights = huber_weights(learned.problem, evaluation, epsilon, rows.sample_weight)
        reweighted = _reweighted(rows, weights)
        learned = learn(reweighted, learned.start, learned.displacement)
        change = float(np.mean(np.abs(weights - before)))
        if change < _SETTLED:
            return learned, weights
    warn_user(
        f"loss='huber': the weights of the rows still change by {change:.2g} on average after "
        f"{_MOST_ROUNDS} turns. Use fewer rules, or loss=Huber(epsilon=...) with a larger one.",
        ConvergenceWarning,
    )
    return learned, weights


def _reweighted(rows, weights):
    own = rows.sample_weight
    return replace(rows, sample_weight=weights if own is None else own * weights)


def _without_outliers(rows, weights):
    kept = weights >= _OUTLIER
    # What is said of most rows is said of none.
    return rows.part(kept) if 2 * np.count_nonzero(kept) >= rows.n_rows else rows


def _is_same(one, other):
    """Whether two starts are of one size."""
    sizes = [(s.antecedent.n_rules, s.antecedent.n_terms) for s in (one, other)]
    return sizes[0] == sizes[1]
