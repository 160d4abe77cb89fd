r"""What a term can be on an interval: the ranges of log mu and of its slope, for every family.

Over x in [l, u], arrays of shape (n_terms, n_boxes):

* log mu rises up to the term's place and falls from there on, so that its smallest value is at an
  end, its largest at the place or at the end next to it. The product of two sigmoids has its top
  elsewhere; it is log-concave, and lies below its tangents at the ends.
* The slope a = d log mu / dx of a log-concave family falls: it lies in [a(u), a(l)]. Gaussians,
  one-sided or two-sided, and both families of sigmoids are such.
* Of the bell, |a| = (2b / w) t^(2b - 1) / (1 + t^(2b)), t = |x - c| / w, rises up to
  t = (2b - 1)^(1 / 2b) and falls from there on. With 2b < 1 it has no bound at the centre.
* A flank with a foot falls ever faster up to its foot, where the floor catches it (see
  ``membership.profiles``), and as that Gaussian from there on.

What a computer makes of log mu at x is what log mu exactly is at a place next to it, but for a few
units in the last place (x - c is one rounding; of a plateau, a few). Ranges are therefore taken
over [l - e, u + e] with

    e = 32 eps (|x| + |c| + plateau) ,

which leaves room for c and x having been brought to other units too, and are then widened by 32 eps
and by 32 eps of themselves. They hold of log mu as it is, and of log mu as it is computed.
"""

from dataclasses import dataclass

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
_WITH_FEET = (Triangular, Trapezoidal, PiShaped, *_ONE_SIDED)


def is_known(family):
    """Whether the ranges of a family of memberships are known."""
    return family in (*_LOG_CONCAVE, *_WITH_FEET, Bell)


@dataclass(frozen=True, eq=False)
class TermRanges:
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
    slope_lo, slope_hi = -by_lo[0], -by_hi[0]
    bottom = np.minimum(at_lo, at_hi)
    if family is SigmoidProduct:
        width = hi - lo
        rising, falling = np.maximum(slope_lo, 0.0), np.maximum(-slope_hi, 0.0)
        top = np.minimum(at_lo + rising * width, at_hi + falling * width)
    else:
        top = family.log_value(np.clip(place, lo, hi), theta)
    if family is Bell:
        slope = _bell_slope(theta, lo, hi)
    elif family in _WITH_FEET:
        slope = _footed_slope(group, lo, hi)
    else:
        slope = slope_hi, slope_lo
    bottom, top = widened(bottom, top)
    bottom, top = bottom - ROUNDINGS * EPS, top + ROUNDINGS * EPS
    slope_low, slope_high = widened(*slope)
    with np.errstate(invalid="ignore"):
        error = reach * size((slope_low, slope_high)) + ROUNDINGS * EPS * np.abs(bottom)
    curve_low, curve_high = widened(*_curvature(group, lo, hi))
    return TermRanges(bottom, top, slope_low, slope_high, curve_low, curve_high, error)


def _plateau(group):
    """The distance from each term's place to its shoulders, (n_terms, 1); else zero."""
    if group.family in (Trapezoidal, PiShaped, TwoSidedGaussian):
        return 0.5 * np.exp(group.theta[3])[:, None]
    if group.family in (SigmoidDifference, SigmoidProduct):
        return np.exp(group.theta[1])[:, None]
    return 0.0


def _bell_slope(theta, lo, hi):
    center, log_width, log_slope = theta[:, :, None]
    b, width = np.exp(log_slope), np.exp(log_width)
    # |a| is largest here; below 2b = 1 at the centre, where it has no bound.
    peak = np.maximum(2.0 * b - 1.0, 0.0) ** (0.5 / b)

    def steepness(t):
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            log_t = np.log(t)
            log_size = (2.0 * b - 1.0) * log_t - np.logaddexp(0.0, 2.0 * b * log_t)
            found = 2.0 * b / width * np.exp(log_size)
        # 0 log 0, of 2b = 1 at the centre.
        return np.where(np.isnan(found), 2.0 * b / width, found)

    def part(near, far):
        """Range of |a| over t in [near, far]."""
        return np.minimum(steepness(near), steepness(far)), steepness(np.clip(peak, near, far))

    left_near, left_far = np.maximum(center - hi, 0.0) / width, np.maximum(center - lo, 0.0) / width
    right_near, right_far = (
        np.maximum(lo - center, 0.0) / width,
        np.maximum(hi - center, 0.0) / width,
    )
    left, right = part(left_near, left_far), part(right_near, right_far)
    return _of_sides(left_far > 0.0, left, right_far > 0.0, right, np.full(lo.shape, False))


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
    center, log_width, log_slope = theta
    b, width = np.exp(log_slope), np.exp(log_width)
    ends = np.abs(lo - center) / width, np.abs(hi - center) / width
    far = np.maximum(*ends)
    near = np.where((lo <= center) & (center <= hi), 0.0, np.minimum(*ends))
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        powers = near ** (2.0 * b - 2.0), far ** (2.0 * b - 2.0)
        power = np.minimum(*powers), np.maximum(*powers)

        def bend(p):
            return (2.0 * b - 1.0 - p) / (1.0 + p) ** 2

        # Falls up to p = 4b - 1, and rises to zero from there on.
        p = near ** (2.0 * b), far ** (2.0 * b)
        at_ends = bend(p[0]), bend(p[1])
        low, high = bend(np.clip(4.0 * b - 1.0, *p)), np.maximum(*at_ends)
        low = np.minimum(low, np.minimum(*at_ends))
        corners = [-2.0 * b / width**2 * f * g for f in power for g in (low, high)]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _footed_slope(group, lo, hi):
    theta, profile = group.theta[:, :, None], group.family.profile
    if group.family in _ONE_SIDED:
        flanks = {group.family.side: np.exp(theta[1])}
        shoulders = {group.family.side: theta[0]}
    else:
        half = 0.5 * np.exp(theta[3]) if theta.shape[0] > 3 else 0.0
        flanks = {-1.0: np.exp(theta[1]), 1.0: np.exp(theta[2])}
        shoulders = {-1.0: theta[0] - half, 1.0: theta[0] + half}
    parts, touches_top = {}, np.full(lo.shape, True)
    for side, flank in flanks.items():
        ends = side * (lo - shoulders[side]) / flank, side * (hi - shoulders[side]) / flank
        near, far = np.minimum(*ends), np.maximum(*ends)
        least, most = _fall(profile, np.maximum(near, 0.0), np.maximum(far, 0.0))
        parts[side] = far > 0.0, (least / flank, most / flank)
        touches_top &= near <= 0.0
    nothing = np.full(lo.shape, False), (np.zeros(lo.shape), np.zeros(lo.shape))
    left, right = parts.get(-1.0, nothing), parts.get(1.0, nothing)
    return _of_sides(*left, *right, touches_top)


def _of_sides(is_left, left, is_right, right, touches_top):
    """Range of the slope from ranges of its size on the rising and on the falling side."""
    low = np.where(is_right, -right[1], np.inf)
    high = np.where(is_right, -right[0], -np.inf)
    low = np.where(is_left, np.minimum(low, left[0]), low)
    high = np.where(is_left, np.maximum(high, left[1]), high)
    neither = ~is_left & ~is_right
    low, high = np.where(neither, 0.0, low), np.where(neither, 0.0, high)
    both = (is_left & is_right) | touches_top
    return np.where(both, np.minimum(low, 0.0), low), np.where(both, np.maximum(high, 0.0), high)


def _fall(profile, near, far):
    """Range of -d log mu / dt of a profile with a foot over t in [near, far], t >= 0.

    It grows up to a top just before the foot, t = 1, is one beyond the foot at the least, and t
    from there on. A straight flank has its top at the foot, and drops from it to one at once.
    """
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


# Where the logarithm of a floored flank is steepest: of the straight one as the foot is reached;
# of two parabolas where 2 s^2 is as large as the floor, s = 1 - t = 5.5e-6, to a thousandth.
_STEEPEST_LINEAR = (np.nextafter(1.0, 0.0),)
_STEEPEST_SPLINE = tuple(1.0 - 5.507e-6 * np.array([1.5, 1.0, 0.5]))
