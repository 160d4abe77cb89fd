"""Formulas of all membership families for export, written once for all target languages.

A family has the constants p of its terms, computed from theta (n_parameters, n_terms) with the
location relative to the reference. Its formula takes an input x, relative to the reference, and
gives two functions, for log mu and its derivative by x. A language supplies its own x and p, such
as nodes of a graph or parts of an expression in C. They support +, -, *, /, < and >, and the
methods ``exp``, ``log``, ``abs``, ``at_most`` and ``at_least``; a comparison has ``where``, with
the values if it holds and if not. Numbers stand to the right of them.

log(1 + exp(-|u|)) replaces Python's log1p, which some languages lack. It is exact enough, because
an absolute error of log mu is only a relative error of the strengths.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..membership import FAMILIES, PRODUCTS

# As in ``membership.profiles`` and ``membership.bells``.
_FLOOR, _SMALLEST_LOG_SQUARE = 1e-10, float(np.log(1e-300))
# Sizes up to this count as zero: single precision has hardly any smaller numbers.
_ZERO = 1e-37


class Formula(NamedTuple):
    """Function from theta to the constants, one row of numbers each; function of x and these."""

    constants: Callable
    of: Callable


def _log_sigmoid(u):
    return u.at_most(0.0) - ((-u.abs()).exp() + 1.0).log()


def _sigmoid(u):
    small = (-u.abs()).exp()
    return (u < 0.0).where(small, 1.0) / (small + 1.0)


def _gaussian(x, p):
    t = (x - p[0]) * p[1]
    return lambda: -(t * t), lambda: t * p[1] * -2.0


def _bell(x, p):
    u = (x - p[0]) * p[1]
    far = u.abs() > _ZERO
    # log |u| has a floor, as in Python. Where u is zero, so is the slope.
    safe = far.where(u, 1.0)
    log_square = far.where(safe.abs().log() * 2.0, _SMALLEST_LOG_SQUARE)
    exponent = log_square.at_least(_SMALLEST_LOG_SQUARE) * p[2]

    def slope():
        return far.where(_sigmoid(exponent) / safe * p[1] * p[2] * -2.0, 0.0)

    return lambda: _log_sigmoid(-exponent), slope


# Flanks: t, the distance from the shoulder in lengths of the flank, and its derivative by x; then
# log mu and its derivative by t, as in ``membership.profiles``.


def _two_sided_constants(theta):
    location, log_left, log_right, *log_plateau = theta
    half = 0.5 * np.exp(log_plateau[0]) if log_plateau else 0.0 * location
    return [location, half, np.exp(-log_left), np.exp(-log_right)]


def _two_sided(x, p):
    d = x - p[0]
    on_left = d < 0.0
    t = (d.abs() - p[1]).at_least(0.0) * on_left.where(p[2], p[3])
    return t, lambda: on_left.where(-p[2], p[3])


def _one_sided(x, p):
    return ((x - p[0]) * p[1]).at_least(0.0), lambda: p[1]


def _gaussian_profile(t):
    return lambda: t * t * -0.5, lambda: -t


def _linear(t):
    return -(t - 1.0), lambda: (t > 0.0).where((t < 1.0).where(-1.0, 0.0), 0.0)


def _spline(t):
    """Value of two parabolas, 1 - 2 t^2 and 2 (1 - t)^2, for t between 0 and 1; and slope."""
    s = -(t - 1.0)
    return (t < 0.5).where(-(t * t * 2.0 - 1.0), s * s * 2.0), lambda: t.at_most(s) * -4.0


def _with_foot(profile):
    """A profile that is zero from t = 1 on, with a floor added so that its log is finite."""

    def of(t):
        near = t.at_most(1.0)
        mu, mu_slope = profile(near)
        gaussian = (near * near * -0.5).exp()
        mixture = mu + (gaussian - mu) * _FLOOR

        def slope():
            # A factor 1 - _FLOOR would be dropped by onnxruntime, which takes it for one.
            steep = mu_slope()
            return (steep - (near * gaussian + steep) * _FLOOR) / mixture - (t - near)

        return lambda: mixture.log() - (t - near) * (t + near) * 0.5, slope

    return of


def _flanked(place, profile):
    def formula(x, p):
        t, way = place(x, p)
        value, slope = profile(t)
        return value, lambda: slope() * way()

    return formula


def _sigmoid_difference_constants(theta):
    location, log_width, log_flank = theta
    per_flank, v = np.exp(-log_flank), np.exp(log_width - log_flank)
    return [location, per_flank, per_flank, v, v, np.log(-np.expm1(-2.0 * v))]


def _sigmoid_product_constants(first, second):
    """Constants of two sigmoids, left and right; ``first``, ``second`` are their slopes' signs."""

    def constants(theta):
        location, log_width, *log_flanks = theta
        left, right = (np.exp(-log_flank) for log_flank in log_flanks)
        width = np.exp(log_width)
        slopes = [first * left, -second * right]
        return [location, *slopes, *(width * slope for slope in slopes)]

    return constants


def _two_sigmoids(x, p):
    center, per_left, per_right, at_left, at_right, *log_gain = p
    d = x - center
    rise, fall = d * per_left + at_left, -(d * per_right - at_right)

    def value():
        log_mu = _log_sigmoid(rise) + _log_sigmoid(fall)
        return log_mu + log_gain[0] if log_gain else log_mu

    return value, lambda: _sigmoid(-rise) * per_left - _sigmoid(-fall) * per_right


def _one_sided_constants(sign):
    return lambda theta: [theta[0], sign * np.exp(-theta[1])]


def _side(x, p):
    u = (x - p[0]) * p[1]
    return lambda: _log_sigmoid(u), lambda: _sigmoid(-u) * p[1]


_BY_NAME = {
    "gaussian": (lambda theta: [theta[0], np.sqrt(0.5) * np.exp(-theta[1])], _gaussian),
    "bell": (lambda theta: [theta[0], np.exp(-theta[1]), np.exp(theta[2])], _bell),
    "triangular": (_two_sided_constants, _flanked(_two_sided, _with_foot(_linear))),
    "trapezoidal": (_two_sided_constants, _flanked(_two_sided, _with_foot(_linear))),
    "two_sided_gaussian": (_two_sided_constants, _flanked(_two_sided, _gaussian_profile)),
    "pi_shaped": (_two_sided_constants, _flanked(_two_sided, _with_foot(_spline))),
    "s_shaped": (_one_sided_constants(-1.0), _flanked(_one_sided, _with_foot(_spline))),
    "z_shaped": (_one_sided_constants(1.0), _flanked(_one_sided, _with_foot(_spline))),
    "sigmoid_difference": (_sigmoid_difference_constants, _two_sigmoids),
    **{
        one.name: (_sigmoid_product_constants(*signs), _two_sigmoids)
        for signs, one in PRODUCTS.items()
    },
    "sigmoid_rising": (_one_sided_constants(1.0), _side),
    "sigmoid_falling": (_one_sided_constants(-1.0), _side),
}

FORMULAS = {FAMILIES[name]: Formula(*pair) for name, pair in _BY_NAME.items()}


def check_own(family):
    """Raise ValueError for a family without a formula here, even if one here has the same name."""
    if family not in FORMULAS:
        raise ValueError(
            f"Memberships of the class {family.__name__!r} cannot be exported; those of skanfis' "
            f"own classes can: {', '.join(one.__name__ for one in FORMULAS)}."
        )
