r"""Huber's loss by reweighting: rows far from the model count less, those near it as ever.

Huber's estimator (1964) minimises sum_i rho(r_i / s) with rho(u) = u^2 / 2 up to |u| = epsilon and
epsilon |u| - epsilon^2 / 2 beyond. Least squares with the weights

    w_i = min(1, epsilon s / |r_i|)

of the residuals before has the same minimum: weights and fit are found in turns, and one Gram
matrix serves as before. The scale s is the median of |r| over 0.6745, a robust standard deviation,
found anew in every turn. Of several outputs, r is the length of the row's residuals, over the root
of their number.

Weights change between runs of the solver and not inside one, whose steps compare costs: they are
costs of one and the same problem only so.
"""

from dataclasses import replace

import numpy as np

__all__ = ["huber_weights", "learn_robustly"]

# The median of |u| for a standard normal u.
_NORMAL_MEDIAN = 0.6744897501960817
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


def _weighted_median(values, weight):
    if weight is None:
        return float(np.median(values))
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(upto, 0.5 * upto[-1])]])


def learn_robustly(learn, start, rows, epsilon):
    """Train and reweight until the weights settle.

    ``learn(rows, start, displacement)`` trains, ``start(rows)`` gives a start. The first
    start and what comes of it have seen the outliers in full: once the weights are settled,
    training starts afresh, from a start that sees no row of less than half its weight, and again
    for as long as that start comes out another one.

    Returns
    -------
    learned : Learned
    weights : ndarray of shape (n_rows,)
        Of the last turn, 1 where a row counts in full.
    """
    learned = learn(rows, start(rows), None)
    learned, weights = _settle(learn, learned, rows, np.ones(rows.n_rows), epsilon)
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
        if np.mean(np.abs(weights - before)) < _SETTLED:
            break
    return learned, weights


def _reweighted(rows, weights):
    own = rows.sample_weight
    return replace(rows, sample_weight=weights if own is None else own * weights)


def _without_outliers(rows, weights):
    return rows.part(weights >= _OUTLIER)


def _is_same(one, other):
    """Whether two starts are of one size."""
    sizes = [(s.antecedent.n_rules, s.antecedent.n_terms) for s in (one, other)]
    return sizes[0] == sizes[1]
