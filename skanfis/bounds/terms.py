r"""Ranges of terms on a box, for every family; of shares of strengths; and of means by shares.

log mu rises up to the term's place and falls from there on. Its slope decreases for log-concave
families (Gaussians, sigmoids); that of bells and of flanks with a foot is enclosed piece by piece.
Boxes are first widened by the rounding errors of x and the term's numbers, then ranges by their
own. So they hold both for the exact log mu, and for log mu as computed.

Strengths are products of shares, one of each factor. Shares are a softmax of sums l_k of log mu,
enclosed from the ranges of all l_k. Weak duality bounds means sum_k nu_k v_k: see docs/bounds.rst.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import softmax

from ..antecedent import Antecedent, TermGroup
from ..membership import (
    PRODUCTS,
    SIDES,
    Bell,
    Gaussian,
    PiShaped,
    SigmoidDifference,
    SShaped,
    Trapezoidal,
    Triangular,
    TwoSidedGaussian,
    ZShaped,
)
from ..membership.profiles import LinearProfile, SplineProfile

EPS = float(np.finfo(float).eps)
# Rounding error, in EPS, of a membership, a share, a rule's output or its slope: a dozen steps,
# with room to spare. Errors of sums over terms and rules are added.
ROUNDINGS = 32.0
_SIDES, _PRODUCTS = tuple(SIDES.values()), tuple(PRODUCTS.values())
_ONE_SIDED = (SShaped, ZShaped)
# Families that are not log-concave. All others count as such, also those that no line here names.
_TURNING = (Triangular, Trapezoidal, PiShaped, *_ONE_SIDED, Bell)
# The t at which the logarithm of a floored flank is steepest, to the last bit: for the straight one
# just before the foot; for two parabolas where 2 (1 - t)^2 is about as large as the floor.
_STEEPEST = {LinearProfile: np.nextafter(1.0, 0.0), SplineProfile: 1.0 - 5.506937986e-6}


class TermRanges(NamedTuple):
    """Ranges over every box for every term, (2, n_terms, n_boxes), and the error of log mu."""

    log_mu: np.ndarray
    slope: np.ndarray
    curve: np.ndarray  # d^2 log mu / dx^2; NaN where it has no bound
    error: np.ndarray  # largest rounding error of log mu as computed


def ranges(group: TermGroup, low, high):
    """The :class:`TermRanges` of a group of terms over boxes (n_inputs, n_boxes)."""
    family, theta = group.family, group.theta
    lo, hi = low[group.inputs], high[group.inputs]
    off = np.abs(theta[0])
    # Size of the term's numbers. A shoulder matters only for an x beyond it, whose size covers it.
    # The cuts of sigmoids, at center -+ width, matter everywhere.
    if family in (SigmoidDifference, *_PRODUCTS):
        off = off + np.exp(theta[1])
    reach = ROUNDINGS * EPS * (np.maximum(np.abs(lo), np.abs(hi)) + off[:, None])
    lo, hi = lo - reach, hi + reach
    at_lo, by_lo = family.log_value_and_gradient(lo, theta)
    at_hi, by_hi = family.log_value_and_gradient(hi, theta)
    # Memberships depend on x - location: the slope is minus the derivative by the location.
    slope = np.sort([-by_hi[0], -by_lo[0]], axis=0)
    if family in _TURNING:
        slope = _with_turns(group, lo, hi, slope)
    rising, falling = np.maximum(slope[1], 0.0), np.maximum(-slope[0], 0.0)
    top = np.minimum(at_lo + rising * (hi - lo), at_hi + falling * (hi - lo))
    top = np.minimum(top, 0.0)
    log_mu = widened([np.minimum(at_lo, at_hi), top], ROUNDINGS * EPS)
    slope, curve = widened(slope), widened(_curvature(group, lo, hi))
    with np.errstate(invalid="ignore"):
        error = reach * size(slope) + ROUNDINGS * EPS * np.abs(log_mu[0])
    return TermRanges(log_mu, slope, np.broadcast_to(curve, slope.shape), error)


def _with_turns(group, lo, hi, slope):
    """Range of slopes that are not monotonic: from the ends, and the extremes on each flank.

    For a bell, the extreme is at the peak of |d log mu / dt| = 2b t^(2b - 1) / (1 + t^(2b)), t in
    lengths of the flank; with 2b < 1 it is at the centre, and unbounded. For a flank with a foot,
    extremes are where it is steepest, and at t = 1, from where on it falls as a Gaussian does.
    """
    family, theta = group.family, group.theta[:, :, None]
    widths = np.exp(theta[1:])
    if family in _ONE_SIDED:
        flanks = {family.side: widths[0]}
    else:
        flanks = {-1.0: widths[0], 1.0: widths[0] if family is Bell else widths[1]}
    if family is Bell:
        double = 2.0 * np.exp(theta[2])
        over = np.maximum(double - 1.0, 0.0)
        with np.errstate(divide="ignore"):
            turns = [(over ** (1.0 / double), over ** (1.0 - 1.0 / double))]
    else:
        top = _STEEPEST[family.profile]
        # The extreme may lie between floats: allow a little more.
        turns = [(top, -(1.0 + 1e-3) * family.profile.log_value_and_slope(top)[1]), (1.0, 1.0)]
    half = 0.5 * widths[2] if family in (Trapezoidal, PiShaped) else 0.0
    for side, flank in flanks.items():
        for t, size_there in turns:
            place, there = theta[0] + side * (half + t * flank), -side * size_there / flank
            is_met = (lo <= place) & (place <= hi)
            least, most = np.minimum(slope[0], there), np.maximum(slope[1], there)
            slope = np.where(is_met, [least, most], slope)
    return slope


def _curvature(group, lo, hi):
    """Range of d^2 log mu / dx^2; NaN where it has no bound.

    It has none for flanks with a foot, whose slope jumps or nearly so, and for pointed bells,
    b < 1. Only for sigmoids does the range depend on the box.
    """
    family, theta = group.family, group.theta[:, :, None]
    if family in (Gaussian, TwoSidedGaussian):
        curve = -np.exp(-2.0 * theta[1:3].min(axis=0))
        return curve, curve if family is Gaussian else 0.0
    if family in (SigmoidDifference, *_PRODUCTS, *_SIDES):
        cuts = [(theta[0], theta[1])]
        if family not in _SIDES:
            width = np.exp(theta[1])
            cuts = [(theta[0] - width, theta[2]), (theta[0] + width, theta[-1])]
        found = 0.0
        for cut, log_length in cuts:
            # For each sigmoid s it is -s (1 - s) / length^2, largest in size next to the cut.
            length, furthest = np.exp(log_length), np.maximum(np.abs(lo - cut), np.abs(hi - cut))
            odds = np.exp(-np.stack([np.abs(np.clip(cut, lo, hi) - cut), furthest]) / length)
            found = found - odds / (length * (1.0 + odds)) ** 2
        return found
    if family is Bell:
        # With p = t^(2b) it is -(2b / w^2) p^(1 - 1/b) (2b - 1 - p) / (1 + p)^2.
        b = np.exp(theta[2])
        most = np.where(b >= 1.0, 2.0 * b * (2.0 * b - 1.0) * np.exp(-2.0 * theta[1]), np.nan)
        return -most, most
    return np.full((2, *theta[0].shape), np.nan)


def _along(factor, by_term):
    """By input, sums of ``by_term`` over the terms of each share."""
    return {j: by_term[..., places, :].sum(axis=-2) for j, places in factor.items()}


def _total(factor, by_term):
    """Sums of ``by_term`` over the terms of each share on all inputs."""
    return sum(_along(factor, by_term).values())


@dataclass(frozen=True, eq=False)
class Shares:
    """The shares of one factor in every box.

    Arrays have an axis for each factor, all of length one but its own, and one of boxes at the end;
    ranges have both ends in front.
    """

    axis: int  # the factor's own, counted from the end
    middle: np.ndarray  # shares at the middle of the box
    low: np.ndarray
    high: np.ndarray
    error: np.ndarray  # largest rounding error of the logarithm of a share
    steepness: dict[int, np.ndarray]  # largest |d l / dx_j|
    curvature: dict[int, np.ndarray]  # range of d^2 l / dx_j^2
    departure: dict[int, np.ndarray]  # range of D_j, d l / dx_j less its mean by the shares


def term_ranges(antecedent: Antecedent, low, high):
    """Ranges of all terms over boxes (n_inputs, n_boxes), with a row of zeros at the end."""
    parts = [ranges(group, low, high) for group in antecedent.groups]
    nothing = np.zeros((2, 1, low.shape[1]))
    parts.append(TermRanges(nothing, nothing, nothing, nothing[0]))
    return TermRanges(*(np.concatenate(one, axis=-2) for one in zip(*parts, strict=True)))


def enclosed(factor: dict, axis: int, terms: TermRanges, at_middle: TermRanges, half):
    """The :class:`Shares` of a factor, from the ranges of its terms over boxes and at the middles.

    ``factor`` holds, by input, the positions of the terms of each share along the last axis; the
    last position, of the row of zeros, means no term.
    """
    middle = softmax(_total(factor, at_middle.log_mu.mean(axis=0)), axis=axis)
    least, most = _by_range(_total(factor, terms.log_mu), axis)
    error = _total(factor, terms.error)
    # The sum in the softmax adds the mean error of all shares.
    mean = (most * error).sum(axis=axis, keepdims=True)
    mean = np.minimum(mean, error.max(axis=axis, keepdims=True))
    error = error + mean + EPS * (ROUNDINGS + least.shape[axis])
    slopes, curvature = _along(factor, terms.slope), _along(factor, terms.curve)
    steepness = {j: size(ends) for j, ends in slopes.items()}
    shares = Shares(axis, middle, least, most, error, steepness, curvature, {})
    departure = _departures(shares, slopes)
    away = np.exp(4.0 * error)
    there = _departures(
        replace(shares, low=middle / away, high=middle * away), _along(factor, at_middle.slope)
    )
    for _ in range(2):
        departure = _by_mean_value(departure, there, shares, half)
        away = np.exp(sum(size(ends) * half[j] for j, ends in departure.items()) + 4.0 * error)
        least, most = np.fmax(least, middle / away), np.fmin(most, middle * away)
        shares = replace(shares, low=least, high=most, departure=departure)
    return shares


def _by_range(logarithms, axis):
    """Ranges of shares from the ranges of their logarithms alone."""
    down, up = np.exp(logarithms - logarithms[1].max(axis=axis, keepdims=True))
    slack = (down.shape[axis] + ROUNDINGS) * EPS
    all_up, all_down = (one.sum(axis=axis, keepdims=True) for one in (up, down))
    # Add what the subtraction may have lost to rounding.
    least = down / (down + np.maximum(all_up - up, 0.0) + 2.0 * slack * all_up)
    spare = np.maximum(all_down - down - 2.0 * slack * all_down, 0.0)
    most = np.minimum(up / (up + spare) * (1.0 + slack), 1.0)
    # 0 / 0: nothing is known of the share, but that it lies from 0 to 1.
    return np.nan_to_num(least * (1.0 - slack), nan=0.0), np.nan_to_num(most, nan=1.0)


def _departures(shares, slopes):
    found = {}
    for j, ends in slopes.items():
        total = (shares.high * size(ends)).sum(axis=shares.axis, keepdims=True)
        # Rounding errors of the slope, and of its mean, a sum.
        slack = EPS * (5.0 * ROUNDINGS + ends.shape[shares.axis]) * total
        slack = slack + 4.0 * ROUNDINGS * EPS * size(ends)
        found[j] = widened(ends - mean_range(ends, [shares])[::-1], slack)
    return found


def _by_mean_value(departure, at_middle, shares, half):
    """Ranges of D, narrowed by d D_j / dx_i = [i = j] (c_j - E c_j) - E D_i D_j."""
    found = {}
    for j, ends in departure.items():
        change = 0.0
        for i, others in departure.items():
            both = square(ends) if i == j else product(ends, others)
            curve = shares.curvature[j] if i == j else np.zeros_like(ends)
            largest = (size(both) + size(curve)).max(axis=shares.axis, keepdims=True)
            slack = EPS * (ROUNDINGS + ends.shape[shares.axis]) * largest
            rate = size(curve - mean_range(both + curve, [shares])[::-1]) + 2.0 * slack
            change = change + half[i] * rate
        low, high = widened(at_middle[j], change)
        # An unknown curvature gives NaN, which fmax and fmin ignore.
        found[j] = np.stack([np.fmax(ends[0], low), np.fmin(ends[1], high)])
    return found


def mean_range(ends, every):
    """Range of the mean, under any shares of all factors in their ranges, of values by share."""
    most = np.stack([-ends[0], ends[1]])
    for shares in reversed(every):
        middle = (shares.middle * most).sum(axis=shares.axis, keepdims=True)
        off = most - middle
        beyond = np.where(off > 0.0, shares.high * off, shares.low * off)
        most = middle + beyond.sum(axis=shares.axis, keepdims=True)
    return np.stack([-most[0], most[1]])


def product(one, other):
    """Range of a product from the ranges of both; NaN, for unknown, if zero meets infinity."""
    corners = np.stack([a * b for a in one for b in other])
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def square(ends):
    """Range of a square from that of its root."""
    sides = np.abs(ends)
    least = np.where((ends[0] <= 0.0) & (ends[1] >= 0.0), 0.0, sides.min(axis=0))
    return np.stack([least, sides.max(axis=0)]) ** 2


def size(ends):
    """The largest absolute value in an interval."""
    return np.maximum(np.abs(ends[0]), np.abs(ends[1]))


def widened(ends, by=0.0):
    """The interval, widened to either side by ``by`` and by rounding errors of its ends."""
    slack = ROUNDINGS * EPS * size(ends) + by
    return np.stack([ends[0] - slack, ends[1] + slack])
