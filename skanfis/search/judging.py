r"""What is expected of new rows: the error on rows that had no part in anything.

A sequence of candidates is grown anew without some of the rows, and its members are judged on
these, size by size. With few rows in five folds; with many, half of the rows are enough to grow and
half to judge, once. Rows that come in groups, runs of an instrument say, are left out in whole
groups, and of few groups each alone: the more runs are left out together, the wider the gaps. Rows
beyond the range that a fold grows on do not judge, unless most are.

Rows are dealt in the order of their target, so that neither the order in which they come nor that
of the columns makes a difference; what is equal in all columns is one row with a weight.
"""

import numpy as np
from sklearn.model_selection import GroupKFold

from ..learning.data import StandardisedData
from .sample import DIGITS, search_sample

# Of few groups each is left out alone; of more, and of rows, a fifth at a time.
FOLDS, FEW_GROUPS = 5, 10
# Rows, and groups, that are enough to judge on.
ENOUGH, ENOUGH_GROUPS = 200, 40


def dealt_rows(rows: StandardisedData) -> StandardisedData:
    """Distinct rows in an order that is random and depends on their values alone."""
    sample = search_sample(rows)
    # What is constant, and in which column a value stands, are no part of it.
    parts = sample.X[:, ~rows.inputs.is_constant], sample.y
    values = np.hstack([np.sort(part, axis=1)[:, ::-1] for part in parts])
    order = np.lexsort(np.round(values, DIGITS).T)
    return sample.part(order[np.random.default_rng(0).permutation(order.size)])


def n_groups(rows: StandardisedData) -> int:
    """Number of groups; one where none are given, for a single group says as little."""
    return 1 if rows.groups is None else np.unique(rows.groups).size


def folds(rows: StandardisedData):
    """Positions of the other rows and of its own, of every fold; whole groups, if there are any."""
    found = n_groups(rows)
    if found > 1:
        n_folds = found if found <= FEW_GROUPS else FOLDS
        return list(GroupKFold(n_folds).split(rows.X, groups=rows.groups))
    every, n_folds = np.arange(rows.n_rows), min(FOLDS, rows.n_rows)
    return [(every[every % n_folds != k], every[k::n_folds]) for k in range(n_folds)]


def judging_folds(rows: StandardisedData):
    """Positions to grow on and positions to judge on, of every fold that is needed.

    Then whether there are so many rows that half of them, the fold, are enough to grow on for good.
    """
    n_rows, every = rows.n_rows, np.arange(rows.n_rows)
    if n_rows == 1:
        return [(every, every)], True
    is_grouped = n_groups(rows) > 1
    is_half = not is_grouped and n_rows >= FOLDS * ENOUGH
    found = [(every[1::2], every[::2])] if is_half else folds(rows)
    times_enough = n_groups(rows) / ENOUGH_GROUPS if is_grouped else n_rows / ENOUGH
    found = found[: int(np.ceil(len(found) / times_enough))]
    inside = [(grow, _in_range(rows.X, grow, judge)) for grow, judge in found]
    left_out, in_range = (sum(judge.size for _, judge in part) for part in (found, inside))
    if 2 * in_range >= left_out:
        found = [part for part in inside if part[1].size]
    return found, is_half


def _in_range(X, grow, judge):
    """Those of the rows to judge that are within the range of the others.

    The model of all rows has seen their like; to this fold they are beyond the data.
    """
    X = np.round(X, DIGITS)
    low, high = X[grow].min(axis=0), X[grow].max(axis=0)
    return judge[((X[judge] >= low) & (X[judge] <= high)).all(axis=1)]
