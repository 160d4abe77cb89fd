r"""Which leaves of a tree to split, on which inputs and where: what a model's residual asks for.

For a leaf and an input, cuts are tried between values next to the leaf's quantiles. Let s w be a
row's weight times the strength of the leaf, h one below the cut and zero above, p the mean of h
over the leaf, b a basis function, 1 or z_i less its mean in the leaf, and r the residual over its
deviation. The statistic of a cut is the sum over all b and outputs of

    (sum s w (h - p) b r)^2 / sum s w (h - p)^2 b^2 ,

in deviations from its mean under noise alone.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent.tree import CRISP, LEAST_WIDTH
from .sample import DIGITS, counting_weight, in_deviations, to_six_digits
from .tuning import Tuned

# Cuts are tried at the quantiles that divide a leaf into this many parts.
_QUANTILES = 8
# Width of a new cut, in standard deviations of the input in the leaf.
_WIDTH = 0.5
# Beyond this many inputs, z_i are left out of b: the work grows with their square.
_MOST_CROSSED = 200


@dataclass(frozen=True)
class Split:
    """Two leaves in the place of one, in standardised units."""

    leaf: int
    input: int
    cut: float
    log_width: float


def best_splits(tuned: Tuned, inputs, crossed):
    """The best split of every leaf and input, those that the residual asks for most first.

    The z_i are the inputs ``crossed``.
    """
    rows, residual = tuned.problem.rows, tuned.residual
    weight = counting_weight(rows)
    variance = np.average(residual**2, axis=0, weights=weight)
    crossed = rows.X[:, crossed if crossed.size <= _MOST_CROSSED else []]
    # Values that differ by rounding alone are one.
    columns = {j: np.round(rows.X[:, j], DIGITS) for j in inputs}
    orders, found = {j: np.argsort(columns[j], kind="stable") for j in inputs}, []
    for leaf, strength in enumerate(tuned.evaluation.antecedent.strengths(rows.X.T)):
        own = weight * strength
        center = np.average(crossed, axis=0, weights=own)
        basis = np.column_stack([np.ones(rows.n_rows), crossed - center])
        along = own[:, None, None] * basis[:, :, None] * residual[:, None]
        sums = np.column_stack([own, own[:, None] * basis**2, along.reshape(rows.n_rows, -1)])
        for j in inputs:
            cuts, statistics = _scored(columns[j], orders[j], sums, basis.shape[1], variance)
            if cuts.size:
                best = int(statistics.argmax())
                log_width = np.log(_width(columns[j], own, cuts[best]))
                split = Split(leaf, int(j), float(cuts[best]), float(log_width))
                found.append((statistics[best], split))
    # Two inputs may split the rows alike. Then the cut decides, not the order of columns.
    found.sort(key=lambda pair: (-to_six_digits(pair[0]), pair[1].cut))
    return [split for _, split in found]


def together(splits, n_more, n_tried):
    """Lists of splits to be tried: each has the ``n_more`` best, and one of the next best.

    ``splits`` are in order. No list splits a leaf twice, and one leaf is left for the last split.
    """
    best: dict[int, Split] = {}
    for split in splits:
        best.setdefault(split.leaf, split)
    taken = dict(list(best.items())[: min(n_more, len(best) - 1)])
    rest = [split for split in splits if split.leaf not in taken]
    return [[*taken.values(), one] for one in rest[:n_tried]]


def _scored(column, order, sums, n_basis, variance):
    """Cuts of an input, and the statistic at each; ``sums`` are the terms of the sums over rows.

    ``order`` sorts the rows by the input.
    """
    cuts = _cuts(column[order], sums[order, 0])
    is_below = (column < cuts[:, None]).astype(float)
    # Both sides are summed: if one is nearly empty, a difference would leave rounding errors alone.
    below, above = is_below @ sums, (1.0 - is_below) @ sums
    whole = below[:, :1] + above[:, :1]
    part, rest = below[:, :1] / whole, above[:, :1] / whole
    mass, moment = slice(1, 1 + n_basis), slice(1 + n_basis, None)
    norm = rest**2 * below[:, mass] + part**2 * above[:, mass]
    along = rest * below[:, moment] - part * above[:, moment]
    squares = along.reshape(cuts.size, n_basis, variance.size) ** 2
    squares /= np.maximum(norm[:, :, None] * variance, np.finfo(float).tiny)
    return cuts, in_deviations(squares.sum(axis=(1, 2)), n_basis * variance.size)


def _cuts(values, own):
    """Cuts half-way between values next to the quantiles of a leaf; ``values`` are sorted."""
    upto = np.cumsum(own)
    wanted = np.arange(1, _QUANTILES) / _QUANTILES * upto[-1]
    places = np.minimum(np.searchsorted(upto, wanted), values.size - 1)
    ends = np.unique(np.searchsorted(values, values[places], side="right"))
    ends = ends[ends < values.size]
    return 0.5 * (values[ends - 1] + values[ends])


def _width(column, own, cut):
    """Width of a new cut; on an input with two values, next to nothing."""
    below, above = column[column < cut], column[column > cut]
    if np.ptp(below) == 0.0 and np.ptp(above) == 0.0:
        return min(0.5 * (above[0] - below[0]) / CRISP, 0.5 * LEAST_WIDTH)
    center = np.average(column, weights=own)
    spread = np.sqrt(np.average((column - center) ** 2, weights=own))
    return max(_WIDTH * spread, LEAST_WIDTH)
