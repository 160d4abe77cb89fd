"""Rows held out are to be predicted, by a model too that refuses rows beyond its range."""

from collections.abc import Iterator
from contextlib import contextmanager

from sklearn.base import BaseEstimator
from sklearn.frozen import FrozenEstimator

__all__ = ["answering", "held_at_the_edge"]

# The policies of ANFISRegressor and of OpenLoopArcsineRegressor: what refuses, and what a fit
# itself judges such a model's rows left out by.
_REFUSING, _ANSWERING = "raise", "clip"


def held_at_the_edge(estimator):
    """A fitted estimator, all parts of which now hold the edge value where they would raise.

    Some row has the lowest input of all, and the model of the folds without it would refuse it;
    the model of all rows, of which the intervals are, does not.
    """
    for part in _refusing(estimator):
        part.out_of_bounds = _ANSWERING
    return estimator


@contextmanager
def answering(estimator):
    """The same for as long as rows held out are predicted."""
    parts = list(_refusing(estimator))
    held_at_the_edge(estimator)
    try:
        yield
    finally:
        for part in parts:
            part.out_of_bounds = _REFUSING


def _refusing(part) -> Iterator[BaseEstimator]:
    """Parts that refuse rows: steps, what a search has found, what a part is made of.

    Not what is frozen: that is the user's own, and so are the rows that it is given.
    """
    if isinstance(part, (list, tuple)):
        for one in part:
            yield from _refusing(one)
    elif isinstance(part, BaseEstimator) and not isinstance(part, FrozenEstimator):
        own = vars(part)
        if isinstance(own.get("out_of_bounds"), str) and own["out_of_bounds"] == _REFUSING:
            yield part
        yield from _refusing(list(own.values()))
