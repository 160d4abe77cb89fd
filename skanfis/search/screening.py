"""On which of many inputs terms may pay: those whose terms the linear model's residual asks for."""

import numpy as np

from .tuning import Tuned

__all__ = ["residual_asks_for"]


def residual_asks_for(tuned: Tuned, inputs: np.ndarray, centers: np.ndarray, overlap: float):
    """How much the residual of a linear model asks for two terms on each input, (n_inputs,).

    With w the share of the upper of two Gaussian terms on an input, at ``centers``, (n_inputs, 2),
    that cross at ``overlap``, and r the residual, the statistic is the sum over basis functions b
    of (sum s w b r)^2 / sum s (w b)^2.
    """
    problem, rows = tuned.problem, tuned.problem.rows
    weight, distance = rows.sample_weight, np.diff(centers, axis=1).ravel()
    assert weight is not None  # a search sample has them
    # The log of the ratio of two such Gaussians has this slope.
    slope = -8.0 * np.log(overlap) / distance
    shares = 1.0 / (1.0 + np.exp(-slope * (rows.X[:, inputs] - centers.mean(axis=1))))
    shares -= np.average(shares, axis=0, weights=weight)
    basis = np.column_stack([np.ones(rows.n_rows), rows.X[:, problem.consequent_inputs]])
    scale = (basis**2).T @ (weight[:, None] * shares**2)
    statistic = np.zeros(inputs.size)
    for part, residual, own in problem.residuals(tuned.evaluation):
        for one in residual:
            along = basis[part].T @ (shares[part] * (own * one)[:, None])
            statistic += np.sum(along**2 / np.maximum(scale, np.finfo(float).tiny), axis=0)
    return statistic
