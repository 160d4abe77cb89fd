r"""Which leaf of a tree to split, on which input and where: what the residual of a model asks for.

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
from .sample import counting_weight, in_deviations, to_six_digits
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


def best_splits(tuned: Tuned, inputs, crossed, n_most):
    """Those that the residual asks for most, best first; one of every leaf and input.

    z_i are those of the inputs ``crossed``.
    """
    rows, residual = tuned.problem.rows, tuned.residual
    weight = counting_weight(rows)
    variance = np.average(residual**2, axis=0, weights=weight)
    crossed = rows.X[:, crossed if crossed.size <= _MOST_CROSSED else []]
    found = []
    for leaf, strength in enumerate(tuned.evaluation.antecedent.strengths(rows.X.T)):
        own = weight * strength
        center = np.average(crossed, axis=0, weights=own)
        basis = np.column_stack([np.ones(rows.n_rows), crossed - center])
        along = own[:, None, None] * basis[:, :, None] * residual[:, None]
        sums = np.column_stack([own, own[:, None] * basis**2, along.reshape(rows.n_rows, -1)])
        for j in inputs:
            cuts, statistics = _scored(rows.X[:, j], sums, basis.shape[1], variance)
            if cuts.size:
                best = int(statistics.argmax())
                log_width = np.log(_width(rows.X[:, j], own, cuts[best]))
                split = Split(leaf, int(j), float(cuts[best]), float(log_width))
                found.append((statistics[best], split))
    # Two inputs may part the rows alike: not the order of columns decides then.
    found.sort(key=lambda pair: (-to_six_digits(pair[0]), pair[1].cut))
    return [split for _, split in found[:n_most]]


def _scored(column, sums, n_basis, variance):
    """Cuts of an input, and the statistic at each; ``sums`` are what is summed over rows."""
    order = np.argsort(column, kind="stable")
    column, upto = column[order], np.cumsum(sums[order, 0])
    wanted = np.arange(1, _QUANTILES) / _QUANTILES * upto[-1]
    places = np.minimum(np.searchsorted(upto, wanted), column.size - 1)
    ends = np.unique(np.searchsorted(column, column[places], side="right"))
    ends = ends[ends < column.size]
    if not ends.size:
        return ends, ends
    below = np.add.reduceat(sums[order], np.append(0, ends), axis=0).cumsum(axis=0)
    below, whole = below[:-1], below[-1]
    part = below[:, :1] / whole[0]
    mass = slice(1, 1 + n_basis)
    norm = (1.0 - 2.0 * part) * below[:, mass] + part**2 * whole[mass]
    along = below[:, 1 + n_basis :] - part * whole[1 + n_basis :]
    squares = along.reshape(ends.size, n_basis, -1) ** 2
    squares /= np.maximum(norm[:, :, None] * variance, np.finfo(float).tiny)
    statistics = in_deviations(squares.sum(axis=(1, 2)), n_basis * variance.size)
    return 0.5 * (column[ends - 1] + column[ends]), statistics


def _width(column, own, cut):
    """At the start; of an input that has two values, next to nothing."""
    below, above = column[column < cut], column[column > cut]
    if np.ptp(below) == 0.0 and np.ptp(above) == 0.0:
        return min(0.5 * (above[0] - below[0]) / CRISP, 0.5 * LEAST_WIDTH)
    center = np.average(column, weights=own)
    spread = np.sqrt(np.average((column - center) ** 2, weights=own))
    return max(_WIDTH * spread, LEAST_WIDTH)
