r"""How many rows there are, and which of them a search looks at.

*Weight* is what a criterion counts (``StandardisedData.effective_weight``). *Distinct inputs* bound
what can be told apart: calibration tables repeat their inputs, and each repeat is information on
the noise alone.
"""

import numpy as np

from ..learning.data import Scale, StandardisedData, fingerprint, place_in_sample
from ..learning.sampling import SAMPLE_ROWS

# Of standardised rows, digits that rounding leaves alone where units change.
DIGITS = 9


def counting_weight(rows: StandardisedData):
    """The weights of a search sample in rows, of which the sum is the effective weight."""
    return rows.weights * (rows.effective_weight / rows.total_weight)


def representative_rows(rows: StandardisedData, most=SAMPLE_ROWS):
    """Distinct rows [z, y] of each group, standardised, their weights and places; in lexical order.

    Beyond ``most`` rows, those at evenly spaced quantiles of the weight, by ``place_in_sample``.
    Neither the order of the rows, nor that of the columns, nor whether a row is repeated or
    weighted makes any difference.
    """
    groups = np.zeros(rows.n_rows) if rows.groups is None else rows.groups
    numbers = rows.numbers(lambda *block: fingerprint(np.round(np.concatenate(block), DIGITS)))
    keys = np.stack([groups, numbers, rows.numbers(place_in_sample)])
    order = np.lexsort(keys)
    first = np.flatnonzero(np.diff(keys[:2, order], prepend=-np.inf).any(axis=0))
    distinct, weight = order[first], np.add.reduceat(rows.weights[order], first)
    if distinct.size > most:
        upto = np.cumsum(weight)
        wanted = (np.arange(most) + 0.5) * (upto[-1] / most)
        chosen, times = np.unique(np.searchsorted(upto, wanted), return_counts=True)
        distinct, weight = distinct[chosen], times.astype(float)
    table = rows.table(distinct)
    order = np.lexsort(table.T[::-1])
    return table[order], weight[order], distinct[order]


def to_six_digits(value):
    """Of columns that are alike, rounding is not to choose."""
    return float(f"{value:.6g}")


def in_deviations(squares, n_free):
    """A sum of squares by how many deviations it exceeds so many of standard normal numbers'."""
    return (squares - n_free) / np.sqrt(2.0 * n_free)


def weighted_quantile(column, weight, part, side):
    """The first value, from below (side 1) or above (-1), with a part of the weight up to it."""
    order = np.argsort(column, kind="stable")[::side]
    upto = np.cumsum(weight[order])
    # From either side alike, whatever the last bit of a sum.
    return column[order[np.searchsorted(upto, (1.0 - 1e-9) * part * upto[-1])]]


def unit_scale(values):
    """The scale of values that are standardised already."""
    n_columns = values.shape[1]
    return Scale(np.zeros(n_columns), np.ones(n_columns), values.min(axis=0), values.max(axis=0))


def search_sample(rows: StandardisedData, most=SAMPLE_ROWS):
    """At most so many representative rows, already in the standardised units of all rows."""
    table, weight, indices = representative_rows(rows, most)
    n_inputs = rows.X.shape[1]
    X, y = table[:, :n_inputs], table[:, n_inputs:]
    return StandardisedData(X, y, weight, unit_scale(X), unit_scale(y), rows.part(indices).groups)
