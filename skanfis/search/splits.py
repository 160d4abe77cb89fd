r"""Which leaves of a tree to split, on which inputs and where: what a model's residual asks for.

Of a leaf and an input, cuts are looked at between values next to the leaf's quantiles. With p the
part of the leaf below the cut, h one there and zero above, s w the weight of the rows times the
strength of the leaf, b the functions 1 and z_i about the centre of the leaf, and r the residual,
the statistic is the sum over b of

    (sum s w (h - p) b r)^2 / sum s w (h - p)^2 b^2 ,

in deviations from what noise alone would give it.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent.tree import CRISP, LEAST_WIDTH
from .sample import DIGITS, counting_weight, in_deviations, to_six_digits
from .tuning import Tuned

# Cuts that are looked at are next to so many quantiles of a leaf.
_QUANTILES = 8
# A new cut is as wide as this part of the leaf's deviation.
_WIDTH = 0.5
# Beyond so many inputs, slopes are not looked at: the work goes with their square.
_MOST_CROSSED = 200


@dataclass(frozen=True)
class Split:
    """Two leaves in the place of one, in standardised units."""

    leaf: int
    input: int
    cut: float
    log_width: float


def best_splits(tuned: Tuned, inputs, crossed):
    """Those that the residual asks for most, best first; one of every leaf and input.

    z_i are those of the inputs ``crossed``.
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
    # Two inputs may part the rows alike: not the order of columns decides then.
    found.sort(key=lambda pair: (-to_six_digits(pair[0]), pair[1].cut))
    return [split for _, split in found]


def together(splits, n_more, n_tried):
    """Each of the next best splits, beside so many more of other leaves that are taken as they are.

    ``splits`` are in order; where leaves are too few, one of them is left to be tried on.
    """
    best: dict[int, Split] = {}
    for split in splits:
        best.setdefault(split.leaf, split)
    taken = dict(list(best.items())[: min(n_more, len(best) - 1)])
    rest = [split for split in splits if split.leaf not in taken]
    return [[*taken.values(), one] for one in rest[:n_tried]]


def _scored(column, order, sums, n_basis, variance):
    """Cuts of an input, and the statistic at each; ``sums`` are what is summed over rows.

    ``order`` is that of the rows by the input.
    """
    cuts = _cuts(column[order], sums[order, 0])
    is_below = (column < cuts[:, None]).astype(float)
    # Each summed by itself: of what is next to nothing, a difference would leave rounding errors.
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
    """Half-way between values next to the quantiles of a leaf, the values being in order."""
    upto = np.cumsum(own)
    wanted = np.arange(1, _QUANTILES) / _QUANTILES * upto[-1]
    places = np.minimum(np.searchsorted(upto, wanted), values.size - 1)
    ends = np.unique(np.searchsorted(values, values[places], side="right"))
    ends = ends[ends < values.size]
    return 0.5 * (values[ends - 1] + values[ends])


def _width(column, own, cut):
    """At the start; of an input that has two values, next to nothing."""
    below, above = column[column < cut], column[column > cut]
    if np.ptp(below) == 0.0 and np.ptp(above) == 0.0:
        return min(0.5 * (above[0] - below[0]) / CRISP, 0.5 * LEAST_WIDTH)
    center = np.average(column, weights=own)
    spread = np.sqrt(np.average((column - center) ** 2, weights=own))
    return max(_WIDTH * spread, LEAST_WIDTH)
