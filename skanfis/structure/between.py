r"""What is known between the rows.

A model can be right on every row and say nothing between them. Rows that lie on a few curves do
that, as those of a gyro's runs, each at a temperature of its own: rules that divide time and
temperature both are told by one curve each, and what they say on the way to the next is anything
that their penalty lets them say. No criterion on the rows themselves sees it.

The leverage of a place z, h = phi(z)' (Phi' S Phi + n P)^-1 phi(z), is the variance of the
prediction there, in units of the noise's. On a row it is one at most, which is what is left when
that row alone decides. A model that knows less than this half-way between its rows, in the mean, is
not told by them.
"""

import numpy as np
from scipy.spatial.distance import cdist

from ..data import StandardisedData
from .tuning import Tuned

__all__ = ["is_known_between", "leverage_between", "places_between"]

_MOST_PLACES = 300
_SEED = 0
# Of other rows, by their distance: between the farther ones lies what hardly any new row comes to.
_NEARER = 0.5
_MOST_LEVERAGE = 1.0


def places_between(rows: StandardisedData) -> np.ndarray:
    """Places half-way between rows and others of the nearer half, (n_inputs, n_places)."""
    rng = np.random.default_rng(_SEED)
    X = rows.X
    own = rng.permutation(len(X))[:_MOST_PLACES]
    nearest = np.argsort(cdist(X[own], X), axis=1, kind="stable")
    # The nearest is the row itself.
    rank = 1 + rng.integers(max(1, int(_NEARER * (len(X) - 1))), size=own.size)
    other = nearest[np.arange(own.size), np.minimum(rank, len(X) - 1)]
    return np.ascontiguousarray(0.5 * (X[own] + X[other]).T)


def leverage_between(tuned: Tuned, places: np.ndarray) -> float:
    """The mean leverage of some places, the premises being held."""
    problem = tuned.problem
    solved = problem.solved_again(tuned.evaluation)
    return float(np.mean(problem.leverage_at(solved, places, tuned.posterior.n_rows)))


def is_known_between(tuned: Tuned, places: np.ndarray) -> bool:
    """Whether there are rows enough for these rules; of a single one it is not asked."""
    if tuned.problem.antecedent.n_rules == 1:
        return True
    return leverage_between(tuned, places) <= _MOST_LEVERAGE
