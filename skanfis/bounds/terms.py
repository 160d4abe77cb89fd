r"""What terms can be on a box, for every family; shares of strengths, and means by them.

log mu rises up to the term's place and falls from there on. Slopes of log-concave families
(Gaussians, sigmoids) fall; those of bells and of flanks with a foot are looked at piece by piece.
The box is first widened by what rounding x and the term's numbers may amount to, then the ranges by
their own rounding: they hold of log mu as it is, and as it is computed.

Strengths are products of shares, one of each factor: a softmax of sums l_k of log mu, enclosed from
the ranges of all l_k. Means sum_k nu_k v_k are bounded by weak duality: see docs/bounds.rst.
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
# Rounding errors, in EPS, of a membership, a share, a rule's output or its slope: of a dozen steps,
# with room to spare. Those of sums are counted beside.
ROUNDINGS = 32.0
_SIDES, _PRODUCTS = tuple(SIDES.values()), tuple(PRODUCTS.values())
_ONE_SIDED = (SShaped, ZShaped)
_TURNING = (Triangular, Trapezoidal, PiShaped, *_ONE_SIDED, Bell)
# Where the logarithm of a floored flank is steepest, to the last bit: of the straight one as the
# foot is reached; of two parabolas where 2 s^2 is about as large as the floor, s = 1 - t.
_STEEPEST = {LinearProfile: np.nextafter(1.0, 0.0), SplineProfile: 1.0 - 5.506937986e-6}


class TermRanges(NamedTuple):
    """Ranges over every box for every term, (2, n_terms, n_boxes), and an error."""

    log_mu: np.ndarray
    slope: np.ndarray
    curve: np.ndarray  # d^2 log mu / dx^2; NaN where it has no bound
    error: np.ndarray  # of log mu as it is computed, at most


def ranges(group: TermGroup, low, high):
    """The :class:`TermRanges` of a group of terms over boxes (n_inputs, n_boxes)."""
    family, theta = group.family, group.theta
    lo, hi = low[group.inputs], high[group.inputs]
    off = np.abs(theta[0])
    # A shoulder is off by no more than the x at which flanks are felt; a sigmoid is felt anywhere.
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
    """Range of slopes that turn between the ends: at these, and where they turn, a flank each.

    Of a bell they do where |d log mu / dt| = 2b t^(2b - 1) / (1 + t^(2b)) has its peak, t flank
    lengths off the shoulder; with 2b < 1 it is at the centre, and has no bound. With a foot they do
    where a flank is steepest, and at t = 1, from where on it falls as a Gaussian does.
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
        # The top may lie between floats.
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

    That is of flanks with a foot, whose slope jumps or nearly so, and of pointed bells, b < 1. Of
    families but sigmoids it is the range wherever x is.
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
            # Of each it is -s (1 - s) / length^2: the larger, the nearer x is to the cut.
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
    """By input, sums over the terms of each share."""
    return {j: by_term[..., places, :].sum(axis=-2) for j, places in factor.items()}


def _total(factor, by_term):
    """Sums over the terms of each share on all inputs."""
    return sum(_along(factor, by_term).values())


@dataclass(frozen=True, eq=False)
class Shares:
    """The shares of one factor in every box.

    Arrays have an axis for each factor, all of length one but its own, and one of boxes at the end;
    ranges have both ends in front.
    """

    axis: int  # its own, from the end
    middle: np.ndarray  # at the middle of the box
    low: np.ndarray
    high: np.ndarray
    error: np.ndarray  # of the logarithm of a share as it is computed, at most
    steepness: dict[int, np.ndarray]  # size of d l / dx_j
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

    A factor has, by input, the terms whose log mu add up to that of a share, along the last axis;
    the last place is none.
    """
    middle = softmax(_total(factor, at_middle.log_mu.mean(axis=0)), axis=axis)
    least, most = _by_range(_total(factor, terms.log_mu), axis)
    error = _total(factor, terms.error)
    # The mean error of all counts for each: the sum of the softmax.
    mean, largest = (most * error).sum(axis=axis, keepdims=True), _largest(error, axis)
    error = error + np.minimum(mean, largest) + EPS * (ROUNDINGS + least.shape[axis])
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
    """Ranges of shares from those of their logarithms alone."""
    down, up = np.exp(logarithms - _largest(logarithms[1], axis))
    slack = (down.shape[axis] + ROUNDINGS) * EPS
    all_up, all_down = (one.sum(axis=axis, keepdims=True) for one in (up, down))
    # What the subtraction has lost counts as being there.
    least = down / (down + np.maximum(all_up - up, 0.0) + 2.0 * slack * all_up)
    spare = np.maximum(all_down - down - 2.0 * slack * all_down, 0.0)
    most = np.minimum(up / (up + spare) * (1.0 + slack), 1.0)
    # 0 / 0: all that is known of the share is that it lies from 0 to 1.
    return np.nan_to_num(least * (1.0 - slack), nan=0.0), np.nan_to_num(most, nan=1.0)


def _departures(shares, slopes):
    found = {}
    for j, ends in slopes.items():
        total = (shares.high * size(ends)).sum(axis=shares.axis, keepdims=True)
        # A slope is off by so many roundings, and its mean by those of the sum besides.
        slack = EPS * (5.0 * ROUNDINGS + ends.shape[shares.axis]) * total
        slack = slack + 4.0 * ROUNDINGS * EPS * size(ends)
        found[j] = widened(ends - mean_range(ends, [shares])[::-1], slack)
    return found


def _by_mean_value(departure, at_middle, shares, half):
    """Ranges of D, narrower by d D_j / dx_i = [i = j] (c_j - E c_j) - E D_i D_j."""
    found = {}
    for j, ends in departure.items():
        change = 0.0
        for i, others in departure.items():
            both = square(ends) if i == j else product(ends, others)
            curve = shares.curvature[j] if i == j else np.zeros_like(ends)
            largest = _largest(size(both) + size(curve), shares.axis)
            slack = EPS * (ROUNDINGS + ends.shape[shares.axis]) * largest
            rate = size(curve - mean_range(both + curve, [shares])[::-1]) + 2.0 * slack
            change = change + half[i] * rate
        low, high = widened(at_middle[j], change)
        # Where the curvature is not known neither is a change: NaN.
        found[j] = np.stack([np.fmax(ends[0], low), np.fmin(ends[1], high)])
    return found


def mean_range(ends, every):
    """Range of the mean, under all factors' shares, of values with an axis for each factor."""
    return np.stack([-largest_mean(-ends[0], every), largest_mean(ends[1], every)])


def largest_mean(values, every):
    """Upper bound of the mean of values under all factors' shares."""
    for shares in reversed(every):
        middle = (shares.middle * values).sum(axis=shares.axis, keepdims=True)
        off = values - middle
        beyond = np.where(off > 0.0, shares.high * off, shares.low * off)
        values = middle + beyond.sum(axis=shares.axis, keepdims=True)
    return values


def _largest(values, axis):
    return values.max(axis=axis, keepdims=True)


def product(one, other):
    """Range of a product from the ranges of both; NaN, for unknown, of zero times infinity."""
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
    """The interval, wider to either side, and by rounding errors of its ends."""
    slack = ROUNDINGS * EPS * size(ends) + by
    return np.stack([ends[0] - slack, ends[1] + slack])
