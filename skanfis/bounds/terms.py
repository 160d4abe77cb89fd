r"""What a term can be on an interval: the ranges of log mu and of its slope, for every family.

log mu rises up to the term's place and falls from there on. Slopes of log-concave families
(Gaussians, sigmoids) fall; those of bells and of flanks with a foot are looked at piece by piece.
Ranges are taken over a box wider by what rounding x and the term's numbers may amount to, and are
then widened by rounding themselves: they hold of log mu as it is, and as it is computed.
"""

from typing import NamedTuple

import numpy as np

from ..antecedent import TermGroup
from ..membership import (
    Bell,
    Gaussian,
    PiShaped,
    SigmoidDifference,
    SigmoidProduct,
    SShaped,
    Trapezoidal,
    Triangular,
    TwoSidedGaussian,
    ZShaped,
)
from ..membership.profiles import LinearProfile
from .arithmetic import EPS, ROUNDINGS, size, widened

__all__ = ["TermRanges", "is_known", "ranges"]

_LOG_CONCAVE = (Gaussian, TwoSidedGaussian, SigmoidDifference, SigmoidProduct)
_ONE_SIDED = (SShaped, ZShaped)
_BY_SIDES = (Triangular, Trapezoidal, PiShaped, *_ONE_SIDED, Bell)


def is_known(family):
    """Whether the ranges of a family of memberships are known."""
    return family in (*_LOG_CONCAVE, *_BY_SIDES)


class TermRanges(NamedTuple):
    """Of every term in every box, (n_terms, n_boxes) each."""

    low: np.ndarray  # of log mu
    high: np.ndarray
    slope_low: np.ndarray
    slope_high: np.ndarray
    curve_low: np.ndarray  # of d^2 log mu / dx^2; NaN where it has no bound
    curve_high: np.ndarray
    error: np.ndarray  # of log mu as it is computed, at most


def ranges(group: TermGroup, low, high):
    """The :class:`TermRanges` of a group of terms over boxes (n_inputs, n_boxes)."""
    family, theta = group.family, group.theta
    lo, hi = low[group.inputs], high[group.inputs]
    place = theta[0][:, None]
    off = np.abs(place) + _plateau(group)
    reach = ROUNDINGS * EPS * (np.maximum(np.abs(lo), np.abs(hi)) + off)
    lo, hi = lo - reach, hi + reach
    at_lo, by_lo = family.log_value_and_gradient(lo, theta)
    at_hi, by_hi = family.log_value_and_gradient(hi, theta)
    # Memberships depend on x - location: the slope is minus the derivative by the location.
    slope = -by_hi[0], -by_lo[0]
    if family is SigmoidProduct:
        # Its top is not at its place: it lies below its tangents at the ends.
        rising, falling = np.maximum(slope[1], 0.0), np.maximum(-slope[0], 0.0)
        top = np.minimum(at_lo + rising * (hi - lo), at_hi + falling * (hi - lo))
    else:
        top = family.log_value(np.clip(place, lo, hi), theta)
    if family in _BY_SIDES:
        slope = _slope_by_sides(group, lo, hi)
    bottom, top = widened(np.minimum(at_lo, at_hi), top)
    bottom, top = bottom - ROUNDINGS * EPS, top + ROUNDINGS * EPS
    slope = widened(*slope)
    with np.errstate(invalid="ignore"):
        error = reach * size(slope) + ROUNDINGS * EPS * np.abs(bottom)
    curve_low, curve_high = widened(*_curvature(group, lo, hi))
    return TermRanges(bottom, top, slope[0], slope[1], curve_low, curve_high, error)


def _plateau(group):
    """The distance from each term's place to its shoulders, (n_terms, 1); else zero."""
    if group.family in (Trapezoidal, PiShaped, TwoSidedGaussian):
        return 0.5 * np.exp(group.theta[3])[:, None]
    if group.family in (SigmoidDifference, SigmoidProduct):
        return np.exp(group.theta[1])[:, None]
    return 0.0


def _slope_by_sides(group, lo, hi):
    """Range of the slope from that of its size on each flank, t flank lengths off the shoulder."""
    family, theta = group.family, group.theta[:, :, None]
    widths = np.exp(theta[1:])
    if family in _ONE_SIDED:
        flanks = {family.side: widths[0]}
    else:
        flanks = {-1.0: widths[0], 1.0: widths[0] if family is Bell else widths[1]}
    low, high = np.full(lo.shape, np.inf), np.full(lo.shape, -np.inf)
    touches_top = np.full(lo.shape, True)
    for side, flank in flanks.items():
        begin = theta[0] + side * _plateau(group)
        ends = side * (lo - begin) / flank, side * (hi - begin) / flank
        near, far = np.minimum(*ends), np.maximum(*ends)
        t = np.maximum(near, 0.0), np.maximum(far, 0.0)
        size_low, size_high = _fall_of_bell(theta, *t) if family is Bell else _fall(family, *t)
        found = -side * size_low / flank, -side * size_high / flank
        low = np.where(far > 0.0, np.minimum(low, np.minimum(*found)), low)
        high = np.where(far > 0.0, np.maximum(high, np.maximum(*found)), high)
        touches_top &= near <= 0.0
    touches_top |= low > high
    low = np.where(touches_top, np.minimum(low, 0.0), low)
    return low, np.where(touches_top, np.maximum(high, 0.0), high)


def _fall_of_bell(theta, near, far):
    """Range of |d log mu / dt| = 2b t^(2b - 1) / (1 + t^(2b)), which rises to one peak."""
    b = np.exp(theta[2])
    # Below 2b = 1 it is at the centre, and has no bound.
    peak = np.maximum(2.0 * b - 1.0, 0.0) ** (0.5 / b)

    def steepness(t):
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            log_t = np.log(t)
            log_size = (2.0 * b - 1.0) * log_t - np.logaddexp(0.0, 2.0 * b * log_t)
            found = 2.0 * b * np.exp(log_size)
        # 0 log 0, of 2b = 1 at the centre.
        return np.where(np.isnan(found), 2.0 * b, found)

    return np.minimum(steepness(near), steepness(far)), steepness(np.clip(peak, near, far))


def _fall(family, near, far):
    """Range of -d log mu / dt of a profile with a foot: it is largest just before it, t = 1."""
    profile = family.profile
    top = _STEEPEST_LINEAR if profile is LinearProfile else _STEEPEST_SPLINE
    at_near, at_far = (-profile.log_value_and_slope(t)[1] for t in (near, far))
    steepest = max(-float(profile.log_value_and_slope(np.array(t))[1]) for t in top)
    rises = far <= top[0]
    crosses = ~rises & (near <= top[-1])
    most = np.where(crosses, np.maximum(steepest * (1.0 + 1e-3), far), np.maximum(at_near, at_far))
    least = np.minimum(at_near, at_far)
    # Past the top the size may be less in between: never below one.
    least = np.where(rises | (near >= 1.0), least, np.minimum(least, 1.0))
    return np.where(near <= 0.0, 0.0, least), most


def _curvature(group, lo, hi):
    """Range of d^2 log mu / dx^2; NaN for flanks with a foot, whose slope jumps or nearly so."""
    family, theta = group.family, group.theta[:, :, None]
    if family is Gaussian:
        curve = np.broadcast_to(-np.exp(-2.0 * theta[1]), lo.shape)
        return curve, curve
    if family is TwoSidedGaussian:
        half = 0.5 * np.exp(theta[3])
        on_left, on_right = lo < theta[0] - half, hi > theta[0] + half
        on_top = (hi >= theta[0] - half) & (lo <= theta[0] + half)
        left, right = (np.broadcast_to(-np.exp(-2.0 * log), lo.shape) for log in theta[1:3])
        low = np.minimum(np.where(on_left, left, 0.0), np.where(on_right, right, 0.0))
        high = np.maximum(np.where(on_left, left, -np.inf), np.where(on_right, right, -np.inf))
        return low, np.where(on_top, 0.0, high)
    if family in (SigmoidDifference, SigmoidProduct):
        left = np.exp(-theta[2])
        right = np.exp(-theta[3]) if family is SigmoidProduct else left
        width = np.exp(theta[1])
        rise = _sigmoid_curve((lo - theta[0] + width) * left, (hi - theta[0] + width) * left)
        fall = _sigmoid_curve((theta[0] + width - hi) * right, (theta[0] + width - lo) * right)
        return tuple(-a * left**2 - b * right**2 for a, b in zip(rise, fall, strict=True))
    if family is Bell:
        return _bell_curve(theta, lo, hi)
    nothing = np.full(lo.shape, np.nan)
    return nothing, nothing


def _sigmoid_curve(lo, hi):
    """Largest and smallest s(u) (1 - s(u)) over [lo, hi], which falls with |u|."""

    def bend(u):
        small = np.exp(-np.abs(u))
        return small / (1.0 + small) ** 2

    return bend(np.clip(0.0, lo, hi)), np.minimum(bend(lo), bend(hi))


def _bell_curve(theta, lo, hi):
    r"""Of l = -log(1 + p), p = t^(2b): l'' = -(2b / w^2) t^(2b - 2) (2b - 1 - p) / (1 + p)^2."""
    center, b, width = theta[0], np.exp(theta[2]), np.exp(theta[1])
    ends = np.abs(lo - center) / width, np.abs(hi - center) / width
    far = np.maximum(*ends)
    near = np.where((lo <= center) & (center <= hi), 0.0, np.minimum(*ends))

    def bend(p):
        return (2.0 * b - 1.0 - p) / (1.0 + p) ** 2

    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        power = near ** (2.0 * b - 2.0), far ** (2.0 * b - 2.0)
        # The bend falls up to p = 4b - 1, and rises to zero from there on.
        p = near ** (2.0 * b), far ** (2.0 * b)
        at_ends = bend(p[0]), bend(p[1])
        low = np.minimum(bend(np.clip(4.0 * b - 1.0, *p)), np.minimum(*at_ends))
        high = np.maximum(*at_ends)
        corners = [-2.0 * b / width**2 * f * g for f in power for g in (low, high)]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


# Where the logarithm of a floored flank is steepest: of the straight one as the foot is reached;
# of two parabolas where 2 s^2 is as large as the floor, s = 1 - t = 5.5e-6, to a thousandth.
_STEEPEST_LINEAR = (np.nextafter(1.0, 0.0),)
_STEEPEST_SPLINE = tuple(1.0 - 5.507e-6 * np.array([1.5, 1.0, 0.5]))
