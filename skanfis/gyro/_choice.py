"""The choice of law and terms: on all folds for the final model, and within each for its check.

Figures of folds on which the structure was chosen flatter it. For every fold the structure is
therefore chosen a second time, from the rows that the fold trains on alone: some of the other folds
are held out there in turn. The terms are those that the regressor's own search finds; beside the
law, in what the law leaves.
"""

import math
import warnings
from dataclasses import dataclass

import numpy as np

from ..search import search_terms
from ._models import make_estimator

__all__ = ["Choice", "choose", "choose_in_folds", "some_rows"]

# For comparing structures; what neighbours in time say twice is left out.
_SEARCH_ROWS = 6_000
# Of the other folds, so many are held out within one at least.
_N_INNER_FOLDS = 2


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
    rows = some_rows(np.arange(len(X)), _SEARCH_ROWS, X, rng)
    if recipe.terms == "search":
        tell(f"choosing the terms on {len(folds)} folds of {rows.size:,} rows")
    choice = _choose(X.iloc[rows], target[rows], _within(rows, folds, len(X)), recipe)
    if choice.tried:
        error = dict(choice.tried)[choice.terms]
        tell(f"terms {','.join(map(str, choice.terms))}: held-out RMS {error:.4g} deg/s")
    if recipe.physics:
        tell(f"law of the open loop with coefficients of degree {choice.degree} in temperature")
    return choice


def choose_in_folds(X, target, folds, recipe, tell):
    """A choice for each fold from its training rows alone; None where nothing is to be chosen."""
    if recipe.terms != "search" and not recipe.physics:
        return None
    choices = []
    for number, (train, _) in enumerate(folds):
        tell(f"choosing the terms within fold {number + 1} of {len(folds)}")
        rows = some_rows(train, _SEARCH_ROWS, X, np.random.default_rng(0))
        others = _within(rows, _nearest(folds, number), len(X))
        part = X.iloc[rows]
        choices.append(_choose(part, target[rows], _enough(part, others), recipe))
    return choices


def _choose(X, target, folds, recipe):
    """The degree by the error of linear rules, then the terms.

    Where no fold holds out a row in range, nothing can be compared: the law is of the least degree,
    and the terms are left to the estimator, which compares them on the rows that it is given.
    """
    linear, degree = (1,) * len(recipe.inputs), 1
    with warnings.catch_warnings():
        # What a candidate warns of, it is judged by.
        warnings.simplefilter("ignore")
        if recipe.physics:
            degree = min((1, 2), key=lambda d: _held_out_rms(recipe, (d, linear), X, target, folds))
        if recipe.terms not in ("search", "auto"):
            return Choice(degree, recipe.terms, ())
        if recipe.terms == "auto" or not any(_in_range(X, *fold).any() for fold in folds):
            return Choice(degree, None, ())
        left = target
        if recipe.physics:
            law = make_estimator(recipe, (degree, linear)).fit(X, target).base_
            left = target - law.predict(X)
    found = search_terms(X.to_numpy(dtype=float), left, folds, recipe.max_rules)
    return Choice(degree, found.terms, found.tried)


def _held_out_rms(recipe, structure, X, target, folds):
    """RMS over the held-out rows of all folds that were in the range of what was trained on."""
    squares, count = 0.0, 0
    for train, test in folds:
        estimator = make_estimator(recipe, structure).fit(X.iloc[train], target[train])
        errors = estimator.predict(X.iloc[test]) - target[test]
        inside = _in_range(X, train, test) & np.isfinite(errors)
        squares += float(np.sum(errors[inside] ** 2))
        count += int(inside.sum())
    return math.sqrt(squares / count) if count else math.inf


def _in_range(X, train, test):
    """Which of the rows held out are in the range of those trained on."""
    low, high, tested = X.iloc[train].min(), X.iloc[train].max(), X.iloc[test]
    return ((tested >= low) & (tested <= high)).all(axis=1).to_numpy()


def _enough(X, folds):
    """The first folds, until as many rows are held out in range as a fold has; two at least.

    A fold of the coldest run may hold out none in range, and judges nothing.
    """
    wanted = np.mean([test.size for _, test in folds]) if folds else 0.0
    taken: list[tuple] = []
    n_judged = 0
    for fold in folds:
        if len(taken) >= _N_INNER_FOLDS and n_judged >= wanted:
            break
        n_in_range = int(_in_range(X, *fold).sum())
        if n_in_range:
            taken.append(fold)
            n_judged += n_in_range
    return taken


def _nearest(folds, number):
    """The other folds: the next one, the one before, and so on."""
    steps = sorted(range(1, len(folds)), key=lambda step: min(step, len(folds) - step))
    return [folds[(number + step) % len(folds)] for step in steps]


def _within(rows, folds, n_rows):
    """Folds as positions in ``rows``, which are some of so many; those with rows on both sides."""

    def positions(part):
        mask = np.zeros(n_rows, dtype=bool)
        mask[part] = True
        return np.flatnonzero(mask[rows])

    inner = [(positions(train), positions(test)) for train, test in folds]
    return [fold for fold in inner if all(part.size for part in fold)]


def some_rows(rows, n_rows, X, rng):
    """At most so many of the rows in their order, with those at the ends of every input's range."""
    if rows.size <= n_rows:
        return rows
    values = X.to_numpy()[rows]
    ends = np.concatenate([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = rng.choice(rows.size, n_rows, replace=False)
    return rows[np.unique(np.concatenate([chosen, ends]))]
