r"""How many rows there are, and which of them a search looks at.

A criterion counts rows by *weight* (``StandardisedData.effective_weight``). *Distinct inputs* limit
what can be learnt of the curve: calibration tables repeat their inputs, and a repeat tells of the
noise alone.
"""

import numpy as np

from ..learning.data import Scale, StandardisedData, fingerprint, place_in_sample
from ..learning.sampling import SAMPLE_ROWS

# Decimals of standardised values that stay the same, whatever the units of the columns.
DIGITS = 9


def counting_weight(rows: StandardisedData):
    """The weights of a search sample, scaled so that they sum to the effective number of rows."""
    return rows.weights * (rows.effective_weight / rows.total_weight)


def representative_rows(rows: StandardisedData, most=SAMPLE_ROWS):
    """Distinct standardised rows [z, y] of each group, sorted by values; weights and positions.

    Beyond ``most`` rows, a sample: rows are ordered by ``place_in_sample``, and those at evenly
    spaced quantiles of the weight are taken. The order of rows or columns makes no difference, nor
    whether a row is repeated or weighted.
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
    table, n_inputs = rows.table(distinct), rows.X.shape[1]
    # Constant columns, and the order of columns, do not count.
    parts = table[:, :n_inputs][:, ~rows.inputs.is_constant], table[:, n_inputs:]
    values = np.hstack([np.sort(part, axis=1)[:, ::-1] for part in parts])
    order = np.lexsort(np.round(values, DIGITS).T)
    return table[order], weight[order], distinct[order]


def to_six_digits(value):
    """Round to six digits, so that rounding errors do not choose between columns that are alike."""
    return float(f"{value:.6g}")


def in_deviations(squares, n_free):
    """Deviations by which a sum of squares exceeds that of ``n_free`` standard normal numbers."""
    return (squares - n_free) / np.sqrt(2.0 * n_free)


def weighted_quantile(column, weight, part, side):
    """The first value, from below (side 1) or above (-1), with ``part`` of the weight up to it."""
    order = np.argsort(column, kind="stable")[::side]
    upto = np.cumsum(weight[order])
    # A little less than the part: rounding of the sum must not make the two sides differ.
    return column[order[np.searchsorted(upto, (1.0 - 1e-9) * part * upto[-1])]]


def unit_scale(values):
    """The scale of values that are already standardised: no shift, unit one."""
    n_columns = values.shape[1]
    return Scale(np.zeros(n_columns), np.ones(n_columns), values.min(axis=0), values.max(axis=0))


def search_sample(rows: StandardisedData, most=SAMPLE_ROWS):
    """At most ``most`` representative rows, in the standardised units of all rows."""
    table, weight, indices = representative_rows(rows, most)
    n_inputs = rows.X.shape[1]
    X, y = table[:, :n_inputs], table[:, n_inputs:]
    return StandardisedData(X, y, weight, unit_scale(X), unit_scale(y), rows.part(indices).groups)
