r"""The rows that judge a candidate: those that neither its growth nor its training has seen.

A sequence of candidates is grown again without some of the rows, and judged on these, size by size.
With few rows this is done in five folds. With many, half of the rows grow the candidates and half
judge them, once. Rows that come in groups, say runs of an instrument, are left out in whole groups,
in ten folds: leaving out several runs of a dozen together would tear wider gaps. Rows beyond the
range that a fold grows on do not judge, unless most are beyond it.

Rows are dealt in a random order that depends on their values alone: neither the order of rows nor
that of columns makes a difference. Equal rows are one row with a weight.
"""

import numpy as np
from sklearn.model_selection import GroupKFold

from ..learning.data import StandardisedData
from .sample import DIGITS, search_sample

# Number of folds of rows, and the largest number of folds of groups.
FOLDS, FOLDS_OF_GROUPS = 5, 10
# Rows, and groups, that are enough to judge on: further folds are not needed.
ENOUGH, ENOUGH_GROUPS = 200, 40


def dealt_rows(rows: StandardisedData) -> StandardisedData:
    """Distinct rows in an order that is random and depends on their values alone."""
    sample = search_sample(rows)
    return sample.part(np.random.default_rng(0).permutation(sample.n_rows))


def n_groups(rows: StandardisedData) -> int:
    """Number of groups; one if none are given."""
    return 1 if rows.groups is None else np.unique(rows.groups).size


def folds(rows: StandardisedData):
    """For every fold, positions of the rows outside and inside it; a fold holds whole groups."""
    found = n_groups(rows)
    if found > 1:
        cv = GroupKFold(min(found, FOLDS_OF_GROUPS))
        return list(cv.split(rows.X, groups=rows.groups))
    every, n_folds = np.arange(rows.n_rows), min(FOLDS, rows.n_rows)
    return [(every[every % n_folds != k], every[k::n_folds]) for k in range(n_folds)]


def judging_folds(rows: StandardisedData):
    """For every fold that is needed, positions to grow on and positions to judge on.

    Also whether there are enough rows to grow the final candidates on half of them, the only fold.
    """
    n_rows, every = rows.n_rows, np.arange(rows.n_rows)
    if n_rows == 1:
        return [(every, every)], True
    n_apart = n_groups(rows)
    is_half = n_apart == 1 and n_rows >= FOLDS * ENOUGH
    found = [(every[1::2], every[::2])] if is_half else folds(rows)
    times_enough = n_apart / ENOUGH_GROUPS if n_apart > 1 else n_rows / ENOUGH
    found = found[: int(np.ceil(len(found) / times_enough))]
    inside = [(grow, _in_range(rows.X, grow, judge)) for grow, judge in found]
    left_out, in_range = (sum(judge.size for _, judge in part) for part in (found, inside))
    if 2 * in_range >= left_out:
        found = [part for part in inside if part[1].size]
    return found, is_half


def _in_range(X, grow, judge):
    """The rows to judge that lie within the range of the rows to grow on.

    The others are beyond the data for this fold, but not for the final model, which sees all rows.
    """
    X = np.round(X, DIGITS)
    low, high = X[grow].min(axis=0), X[grow].max(axis=0)
    return judge[((X[judge] >= low) & (X[judge] <= high)).all(axis=1)]
