r"""Several starts: the reduced problem has many minima, and no start is the right one for all data.

The first start is the structure's own; every further one is displaced at random, so much in every
direction as steps go without leaving one arrangement of the terms for another (see ``premise`` for
the units). What is best is the smallest leave-one-out error of the linear part,

    mean of (r_i / (1 - h_i))^2 ,    h_i = phi_i' (Phi' S Phi + W P)^-1 phi_i ,

(Allen 1974; a row of weight s counts as s rows, of which one is left out), not the training error:
of two minima that meet the data alike, it prefers the one whose rules each rest on many rows.
"""

import numpy as np
from joblib import Parallel, delayed

__all__ = ["displaced_starts", "learn_from_starts", "leave_one_out_error"]

# Standard deviation of a start's displacements.
_SPREAD = 0.3
# A row that a rule has to itself would have an error without bound.
_SMALLEST_FREEDOM = 1e-6


def displaced_starts(premise, first, n_starts, rng):
    """Displacements of ``n_starts`` starts, the first as given, within the premise's box."""
    starts = rng.normal(scale=_SPREAD, size=(n_starts, premise.size))
    starts[0] = 0.0 if first is None else first
    return np.clip(starts, premise.lower, premise.upper)


def leave_one_out_error(problem, evaluation):
    """Mean squared leave-one-out error of the consequents at fixed premises, per unit of weight."""
    solved = problem.evaluate(evaluation.antecedent.parameters, evaluation.coefficients)
    total = 0.0
    for part, residual, weight in problem.residuals(solved):
        leverage = problem.leverage(solved, part)
        squares = np.sum((residual / np.maximum(1.0 - leverage, _SMALLEST_FREEDOM)) ** 2, axis=0)
        total += squares.sum() if weight is None else weight @ squares
    return total / problem.rows.total_weight


def learn_from_starts(learn, premise, first, n_starts, rng, n_jobs, on_start=None):
    """The best of several runs, ``learn(displacement)``, whatever the number of workers.

    A single start is the run from it. Workers are threads: the passes over the data release
    Python's lock. ``on_start(learned)`` is told of every run in order, and what is true ends them.
    """
    if n_starts == 1 or premise.size == 0:
        return learn(None)
    starts = displaced_starts(premise, first, n_starts, rng)
    parallel = Parallel(n_jobs=n_jobs, backend="threading", return_as="generator")
    best, smallest = None, np.inf
    for error, learned in parallel(delayed(_with_error)(learn, start) for start in starts):
        if best is None or error < smallest:
            best, smallest = learned, error
        if on_start is not None and on_start(learned):
            break
    return best


def _with_error(learn, start):
    learned = learn(start)
    return leave_one_out_error(learned.problem, learned.result.evaluation), learned
