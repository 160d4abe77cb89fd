"""The choice of law and terms: on all folds for the final model, and within each for its check.

Figures of folds on which the structure was chosen flatter it. For every fold the structure is
therefore chosen a second time, from the rows that the fold trains on alone: two of the other folds
are held out there in turn. One fit without two folds serves the choice of both.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ._models import make_estimator
from ._structure import errors_of_fold, grow_terms, held_out_rms

__all__ = ["Choice", "choose", "choose_in_folds", "some_rows"]

# For comparing structures; what neighbours in time say twice is left out.
_SEARCH_ROWS = 6_000


@dataclass(frozen=True)
class Choice:
    """Degree of the law in temperature and terms of each input, None if left to the estimator.

    ``tried`` is all that was compared, (terms, RMS [deg/s]).
    """

    degree: int
    terms: tuple[int, ...] | None
    tried: tuple

    @property
    def structure(self):
        """What :func:`make_estimator` needs."""
        return self.degree, self.terms


def choose(X, target, folds, recipe, rng, tell):
    """The choice over all folds, for the model that is fitted to all rows."""
    folds = [tuple(some_rows(rows, _SEARCH_ROWS, X, rng) for rows in fold) for fold in folds]

    def score(terms, degree):
        make = partial(make_estimator, recipe, (degree, terms))
        return held_out_rms(partial(errors_of_fold, make, X, target), folds)

    if recipe.terms == "search":
        tell(f"choosing the terms on {len(folds)} folds of {folds[0][0].size:,} rows")
    choice = _choose(score, recipe, tell)
    if recipe.physics:
        tell(f"law of the open loop with coefficients of degree {choice.degree} in temperature")
    return choice


def choose_in_folds(X, target, folds, recipe, tell):
    """A choice for each fold from its training rows alone; None where nothing is to be chosen."""
    if recipe.terms != "search" and not recipe.physics:
        return None
    inner = _InnerFolds(X, target, folds, recipe)
    choices = []
    for fold in range(len(folds)):
        tell(f"choosing the terms within fold {fold + 1} of {len(folds)}")
        choices.append(_choose(partial(inner.score, fold), recipe, lambda text: None))
    return choices


def _choose(score, recipe, tell):
    """By ``score(terms, degree)``: the degree on linear rules, then the terms."""
    degree = 1
    if recipe.physics:
        linear = (1,) * len(recipe.inputs)
        degree = min((1, 2), key=lambda d: score(linear, d))
    if recipe.terms == "search":
        grown = partial(score, degree=degree)
        terms, tried = grow_terms(grown, len(recipe.inputs), recipe.max_rules, tell)
        return Choice(degree, tuple(terms), tuple(tried))
    terms = None if recipe.terms == "auto" else recipe.terms
    return Choice(degree, terms, ())


class _InnerFolds:
    """Scores of structures within the training rows of each fold."""

    def __init__(self, X, target, folds, recipe):
        self._X, self._target, self._recipe = X, target, recipe
        self._rows = [tuple(_mask(rows, len(X)) for rows in fold) for fold in folds]
        self._partners = [self._partners_of(fold) for fold in range(len(folds))]
        self._errors: dict = {}

    def score(self, fold, terms, degree):
        """RMS over the inner folds of a fold."""
        structure = (degree, tuple(terms))
        found = [self._of_pair(fold, other, structure) for other in self._partners[fold]]
        squares, count = (sum(parts) for parts in zip(*found, strict=True)) if found else (0.0, 0)
        return float(np.sqrt(squares / count)) if count else np.inf

    def _partners_of(self, fold):
        """The next fold and the one before with rows to hold out within this one's training."""
        n_folds = len(self._rows)
        train = self._rows[fold][0]
        found = []
        for step in (1, -1):
            for distance in range(1, n_folds):
                other = (fold + step * distance) % n_folds
                if (train & self._rows[other][1]).any() and (train & self._rows[other][0]).any():
                    found.append(other)
                    break
        return sorted(set(found))

    def _of_pair(self, fold, other, structure):
        """Sum of squares and number of the other's test rows, by a model that saw neither's."""
        pair = tuple(sorted((fold, other)))
        key = (pair, structure)
        if key not in self._errors:
            self._errors[key] = self._fitted(pair, structure)
        return self._errors[key][pair.index(fold)]

    def _fitted(self, pair, structure):
        trains, tests = zip(*(self._rows[fold] for fold in pair), strict=True)
        rng = np.random.default_rng(0)
        train = some_rows(np.flatnonzero(trains[0] & trains[1]), _SEARCH_ROWS, self._X, rng)
        held_out = [np.flatnonzero(trains[0] & tests[1]), np.flatnonzero(trains[1] & tests[0])]
        both = [some_rows(rows, _SEARCH_ROWS, self._X, rng) for rows in held_out]
        make = partial(make_estimator, self._recipe, structure)
        errors, inside = errors_of_fold(
            make, self._X, self._target, train, np.concatenate(both), quiet=True
        )
        parts = np.split(np.where(inside, errors, 0.0), [both[0].size])
        counts = [part.sum() for part in np.split(inside, [both[0].size])]
        return [(float(np.sum(part**2)), int(n)) for part, n in zip(parts, counts, strict=True)]


def _mask(rows, n_rows):
    mask = np.zeros(n_rows, dtype=bool)
    mask[rows] = True
    return mask


def some_rows(rows, n_rows, X, rng):
    """At most so many of the rows in their order, with those at the ends of every input's range."""
    if rows.size <= n_rows:
        return rows
    values = X.to_numpy()[rows]
    ends = np.concatenate([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = rng.choice(rows.size, n_rows, replace=False)
    return rows[np.unique(np.concatenate([chosen, ends]))]
