r"""One rule of choice: of all candidates that are next to the best, the one that is read soonest.

With e^2 the squared error expected of new rows and v that of the mean, a candidate is within the
tolerance of ``simplicity`` s where

    e^2 - e_best^2  <=  ((1 + s)^2 - 1) min(e_best^2, v - e_best^2) :

s of the error where the signal is clear, and no more than that part of what the best explains where
it is weak. Of all within it the one that costs least to read is taken; of equal cost, that with the
smaller error. What is then left of the tolerance goes into agreement (``start``).
"""

from dataclasses import dataclass

import numpy as np

from .candidates import Candidate

_ERRORS = 1.0


@dataclass(frozen=True, eq=False)
class Judged:
    """A candidate, and what it left of rows that had no part in it.

    Parameters
    ----------
    candidate : Candidate
    squares : ndarray of shape (n_judged,)
        Squared errors, summed over outputs.
    squared_error : float
        Expected of new rows, once trained on all rows.
    cost : int
        To read it.
    """

    candidate: Candidate
    squares: np.ndarray
    squared_error: float
    cost: int


def is_better(candidate: Judged, than: Judged, weight) -> bool:
    """Whether it leaves less of the rows that judge, by more than one standard error."""
    gain = than.squares - candidate.squares
    mean = np.average(gain, weights=weight)
    error = np.sqrt(np.sum((weight * (gain - mean)) ** 2)) / np.sum(weight)
    return bool(mean > _ERRORS * error)


def best_of(judged, weight) -> Judged:
    """That of the smallest error; what is larger must be better by more than chance."""
    best, *others = sorted(judged, key=lambda one: one.cost)
    for one in others:
        best = one if is_better(one, best, weight) else best
    return best


def tolerated(least: float, variance: float, simplicity: float) -> float:
    """The largest squared error that is within the tolerance, ``least`` being the best's."""
    excess = (1.0 + simplicity) ** 2 - 1.0
    return least + excess * min(least, max(variance - least, 0.0))


def chosen(judged, most):
    """Of all whose error is at most so much, the one that costs least to read."""
    within = [one for one in judged if one.squared_error <= most]
    return min(within, key=lambda one: (one.cost, one.squared_error))
