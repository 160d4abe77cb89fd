r"""Slopes bounded by what they are at the corners of a box.

Between two points a function lies above its chord by (x - l)(u - x) / 2 times what its second
derivative is below zero, somewhere between. One input after the other, S = dP/dx_j lies on a box
below

    max over corners of S  +  sum_i (u_i - l_i)^2 / 8  max(0, - min d^2 S / dx_i^2) ,

for interpolation is a mean with weights that are not negative. The excess has an eighth in front,
and no part in which two inputs go together: a box may be several times as wide along every input as
with the mean value theorem. With E, D, c and b as in ``enclosure``, c' the third derivative of the
log-strength, Q_i = D_i^2 + c_i - E[D_i^2 + c_i], so that w Q_i is the second derivative of w, and
i on another factor of the rule base than j,

    d^2 S / dx_i^2 = E [ D_j Q_i (f - phi) + 2 D_i D_j b_i + Q_i b_j ] ,

    d^2 S / dx_j^2 = E [ R_j (f - phi) + 3 Q_j b_j ] ,

    R = r - E r ,    r = D^3 + 3 D (c - E[D^2 + c]) + c' ,

with phi any function that is the same for all terms of input j, or for all of input i.
"""

from math import prod

import numpy as np

from .intervals import product, size, square
from .shares import largest_mean, smallest_mean
from .terms import EPS

__all__ = ["slope_by_corners"]

# Roundings of a bend, in EPS, with room to spare: of products of two slopes, each with as many as
# in ``enclosure``.
_ROUNDINGS = 64.0
# Boxes with more sides have too many corners.
_MOST_SIDES = 5


def slope_by_corners(enclosure, parts, low, high, j):
    """Bounds of dP/dx_j on boxes in the range, by their corners.

    Returns
    -------
    bound : ndarray of shape (n_boxes,)
        Infinite where there is none.
    points : ndarray of shape (n_inputs, n_boxes)
        The corner of the largest slope.
    attained : ndarray of shape (n_boxes,)
        The slope there, at the least.
    gain : ndarray of shape (n_inputs, n_boxes)
        What the width along each input adds.
    """
    sides = np.flatnonzero((high > low).any(axis=1))
    if sides.size > _MOST_SIDES or len(enclosure.factors) != len(enclosure.place):
        nothing = np.full(low.shape[1], np.inf)
        return nothing, low, -nothing, np.zeros_like(low)
    gain = np.zeros_like(low)
    for i in sides:
        least = _least_bend(enclosure, parts, i, j)
        gain[i] = (high[i] - low[i]) ** 2 / 8.0 * np.maximum(-least, 0.0)
    points, slopes = _steepest_corner(enclosure, low, high, sides, j)
    slack = 4.0 * parts.slope_slack[j]
    bound = slopes + gain.sum(axis=0) * (1.0 + EPS * (_ROUNDINGS + low.shape[0])) + slack
    return np.where(np.isnan(bound), np.inf, bound), points, slopes - slack, gain


def _steepest_corner(enclosure, low, high, sides, j):
    """The corners (n_inputs, n_boxes) of the largest slope by input j, and this as computed."""
    corners = []
    for chosen in np.ndindex(*(2,) * sides.size):
        corner = low.copy()
        upper = sides[np.array(chosen, dtype=bool)]
        corner[upper] = high[upper]
        corners.append(corner)
    every = np.stack(corners)
    rows = every.transpose(0, 2, 1).reshape(-1, len(low))
    slopes = enclosure.sign * enclosure.rules.gradient(rows)[:, j, enclosure.output]
    slopes = slopes.reshape(len(corners), -1)
    best, boxes = slopes.argmax(axis=0), np.arange(low.shape[1])
    return every[best, :, boxes].T, slopes[best, boxes]


def _least_bend(enclosure, parts, i, j):
    """Lower bound of the second derivative by input i of dP/dx_j, (n_boxes,); NaN for none."""
    if i not in parts.departure:
        # Consequents are linear, and strengths do not change.
        return np.zeros(parts.half.shape[1])
    zero = np.zeros(parts.middle.shape)
    curved, place = _second(parts, enclosure, i), enclosure.place[i]
    by_j = enclosure.centred_slopes(parts, j, place)
    if i == j:
        third = product(_third(parts, enclosure, i), enclosure.centred(parts, place))
        found = [third, product(curved, (3.0 * by_j, 3.0 * by_j))]
    else:
        found = [product(curved, (by_j, by_j))]
        if j in parts.departure:
            other = enclosure.place[j]
            by_i = 2.0 * enclosure.centred_slopes(parts, i, place, other)
            both = product(parts.departure[i], parts.departure[j])
            steep = product(parts.departure[j], curved)
            found += [product(steep, enclosure.centred(parts, place, other))]
            found += [product(both, (by_i, by_i))]
    low = zero + sum(one[0] for one in found)
    largest = sum(size(one).max(axis=tuple(range(zero.ndim - 1))) for one in found)
    return smallest_mean(low, parts.shares) - EPS * _ROUNDINGS * prod(enclosure.counts) * largest


def _curve(parts, i):
    """Range of D^2 + c."""
    squares, curvature = square(parts.departure[i]), parts.curvature[i]
    return squares[0] + curvature[0], squares[1] + curvature[1]


def _less_mean(parts, enclosure, place, values):
    """Range of values less their mean over the shares of one factor, whatever these are."""
    mean = _mean(parts, enclosure, place, values)
    return values[0] - mean[1], values[1] - mean[0]


def _mean(parts, enclosure, place, values):
    """Range of the mean over one factor's shares of values along its axis, the axis kept."""
    axis, shares = place - len(enclosure.counts) - 1, [parts.shares[place]]
    ends = []
    for mean, end in zip((smallest_mean, largest_mean), values, strict=True):
        found = mean(np.moveaxis(end, axis, -2), shares)
        # Sums of as many numbers as the factor has shares, and a few roundings each.
        slack = EPS * _ROUNDINGS * end.shape[axis] * np.abs(end).max(axis=axis)
        ends.append(np.expand_dims(found + (slack if mean is largest_mean else -slack), axis))
    return ends


def _second(parts, enclosure, i):
    """Range of Q."""
    return _less_mean(parts, enclosure, enclosure.place[i], _curve(parts, i))


def _third(parts, enclosure, i):
    """Range of R."""
    place, departure = enclosure.place[i], parts.departure[i]
    mean = _mean(parts, enclosure, place, _curve(parts, i))
    curvature, third = parts.curvature[i], parts.third[i]
    off = curvature[0] - mean[1], curvature[1] - mean[0]
    tilted = product(departure, off)
    low = departure[0] ** 3 + 3.0 * tilted[0] - third
    high = departure[1] ** 3 + 3.0 * tilted[1] + third
    return _less_mean(parts, enclosure, place, (low, high))
