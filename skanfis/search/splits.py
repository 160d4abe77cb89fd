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
from ..blocks import BLOCK_BYTES, row_blocks
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
    inputs, found = np.asarray(inputs), []
    # Values that differ by rounding alone are one.
    columns = np.round(rows.X.T[inputs], DIGITS)
    orders = np.argsort(columns, axis=1, kind="stable")
    # Many inputs at once, as some three arrays of them fit into a block: for few rows, calls of
    # NumPy would take longer than its work.
    blocks = row_blocks(inputs.size, max(BLOCK_BYTES // (3 * 8 * _QUANTILES * rows.n_rows), 1))
    for leaf, strength in enumerate(tuned.evaluation.antecedent.strengths(rows.X.T)):
        own = weight * strength
        if not own.any():  # where all other rows weigh next to nothing, a leaf may have none
            continue
        center = np.average(crossed, axis=0, weights=own)
        basis = np.column_stack([np.ones(rows.n_rows), crossed - center])
        along = own[:, None, None] * basis[:, :, None] * residual[:, None]
        sums = np.column_stack([own, own[:, None] * basis**2, along.reshape(rows.n_rows, -1)])
        for block in blocks:
            some = columns[block]
            cuts, statistics = _scored(some, orders[block], sums, basis.shape[1], variance)
            best, is_cut = statistics.argmax(axis=1), np.isfinite(cuts).any(axis=1)
            log_widths = np.log(_widths(some[is_cut], own))
            for k, log_width in zip(np.flatnonzero(is_cut), log_widths, strict=True):
                place, j = (k, best[k]), inputs[block][k]
                split = Split(leaf, int(j), float(cuts[place]), float(log_width))
                found.append((statistics[place], split))
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


def _scored(columns, orders, sums, n_basis, variance):
    """Cuts of inputs, NaN where there are fewer, and the statistic at each, minus infinity there.

    ``columns`` has an input in each row, ``orders`` sort its values; ``sums`` are the terms of the
    sums over rows.
    """
    cuts = _cuts(np.take_along_axis(columns, orders, axis=1), sums[:, 0][orders])
    is_cut, statistics = np.isfinite(cuts), np.full(cuts.shape, -np.inf)
    is_below = (columns[:, None] < cuts[:, :, None])[is_cut].astype(float)
    # Both sides are summed: if one is nearly empty, a difference would leave rounding errors alone.
    below, above = is_below @ sums, (1.0 - is_below) @ sums
    whole = below[:, :1] + above[:, :1]
    part, rest = below[:, :1] / whole, above[:, :1] / whole
    mass, moment = slice(1, 1 + n_basis), slice(1 + n_basis, None)
    norm = rest**2 * below[:, mass] + part**2 * above[:, mass]
    along = rest * below[:, moment] - part * above[:, moment]
    squares = along.reshape(len(along), n_basis, variance.size) ** 2
    squares /= np.maximum(norm[:, :, None] * variance, np.finfo(float).tiny)
    statistics[is_cut] = in_deviations(squares.sum(axis=(1, 2)), n_basis * variance.size)
    return cuts, statistics


def _cuts(values, own):
    """Cuts half-way between values next to the quantiles of a leaf, the same one only once.

    Of each input, a row of sorted ``values`` and of the weights ``own`` in the leaf.
    """
    upto = np.cumsum(own, axis=1)
    wanted = np.arange(1, _QUANTILES) / _QUANTILES * upto[:, -1:]
    last = values.shape[1] - 1
    # Counting does for all inputs what a search does for one.
    places = np.minimum(np.sum(upto[:, None] < wanted[:, :, None], axis=2), last)
    nearest = np.take_along_axis(values, places, axis=1)
    ends = np.sum(values[:, None] <= nearest[:, :, None], axis=2)
    is_cut = (ends <= last) & (np.diff(ends, axis=1, prepend=0) > 0)
    ends = np.minimum(ends, last)
    low, high = (np.take_along_axis(values, at, axis=1) for at in (ends - 1, ends))
    return np.where(is_cut, 0.5 * (low + high), np.nan)


def _widths(columns, own):
    """Widths of new cuts of inputs; on an input with two values, next to nothing."""
    low, high = columns.min(axis=1), columns.max(axis=1)
    has_two = np.all((columns == low[:, None]) | (columns == high[:, None]), axis=1)
    center = np.average(columns, axis=1, weights=own)
    spread = np.sqrt(np.average((columns - center[:, None]) ** 2, axis=1, weights=own))
    between = np.minimum(0.5 * (high - low) / CRISP, 0.5 * LEAST_WIDTH)
    return np.where(has_two, between, np.maximum(_WIDTH * spread, LEAST_WIDTH))
