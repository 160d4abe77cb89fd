r"""Membership functions of the .fis format and the families of skanfis that they are.

Every function of the table is the family's textbook mu, with other parameters:

=============  =====================  ============================================================
.fis           family                 parameters in the file
=============  =====================  ============================================================
``gaussmf``    gaussian               width, center
``gbellmf``    bell                   width, slope, center
``trimf``      triangular             feet and peak, in order
``trapmf``     trapezoidal            feet and shoulders, in order
``pimf``       pi_shaped              feet and shoulders, in order
``gauss2mf``   two_sided_gaussian     deviation and shoulder of the left flank, of the right flank
``smf``        s_shaped               foot, shoulder
``zmf``        z_shaped               shoulder, foot
``dsigmf``     sigmoid_difference     slope and place of the rise, the same of the fall
``psigmf``     sigmoid_product        slope and place of the rise, slope (negative) of the fall
=============  =====================  ============================================================

The functions that turn parameters take and give lists of floats; on the side of skanfis these are
natural parameters (widths, not their logarithms). What a family cannot be raises ValueError.
"""

from collections.abc import Callable
from math import log
from typing import NamedTuple

import numpy as np

from ...membership import MEMBERSHIPS
from ..limits import LARGEST_NUMBER, shown

__all__ = ["function_of", "theta_of"]

# A plateau that is a point, of a family that always has one, as part of the shorter flank.
_POINT = 1e-12


def function_of(family, natural):
    """Name and parameters in the file of a term with these natural parameters."""
    if family.name not in _TABLE:
        raise ValueError(
            f"the membership {family.name!r} has no function in the .fis format; "
            f"{', '.join(_TABLE)} have."
        )
    function = _TABLE[family.name]
    return function.name, function.to_file(*map(float, natural))


def theta_of(name, parameters, low, high):
    """Family and theta of a membership function in a file; [low, high] is its input's Range."""
    if name not in _FAMILIES:
        raise ValueError(
            f"the membership function {shown(name)} is not supported; {', '.join(_FAMILIES)} are."
        )
    function = _TABLE[_FAMILIES[name]]
    if len(parameters) != function.n_parameters:
        raise ValueError(
            f"{name} takes {function.n_parameters} parameters, found {len(parameters)}."
        )
    family = MEMBERSHIPS[_FAMILIES[name]]
    if name in _WITH_CORNERS:
        parameters = _open_flanks(name, parameters, low, high)
        if name == "trapmf" and parameters[1] == parameters[2]:
            family, function = MEMBERSHIPS["triangular"], _TABLE["triangular"]
            del parameters[1]
    return family, _theta(family, function.from_file(*parameters), f"{name} {parameters}")


def _theta(family, natural, what):
    theta = []
    for parameter, value in zip(family.parameters, natural, strict=True):
        if parameter.kind == "location":
            theta.append(value)
        elif 1.0 / LARGEST_NUMBER <= value <= LARGEST_NUMBER:
            theta.append(log(value))
        else:
            raise ValueError(
                f"{what} is a {family.name} membership of {parameter.name} {value:g}, which must "
                f"be between {1.0 / LARGEST_NUMBER:g} and {LARGEST_NUMBER:g}."
            )
    return np.array(theta)


def _open_flanks(name, corners, low, high):
    """Corners in which no flank is vertical; those out of sight may be.

    A term at the edge is often given as trimf [0 0 5] on Range [0 10]. Within the Range any flank
    to the left is as good as this one.
    """
    if sorted(corners) != corners:
        raise ValueError(f"the corners of {name} {corners} must be in ascending order.")
    left_foot, *shoulders, right_foot = corners
    if left_foot == shoulders[0] <= low:
        left_foot -= high - low
    if right_foot == shoulders[-1] >= high:
        right_foot += high - low
    if left_foot == shoulders[0] or right_foot == shoulders[-1]:
        raise ValueError(
            f"{name} {corners} has a vertical flank within its input's Range [{low:g} {high:g}]; "
            "move the foot away from the shoulder."
        )
    return [left_foot, *shoulders, right_foot]


def _corners(center, left, right, plateau):
    shoulder, other_shoulder = center - 0.5 * plateau, center + 0.5 * plateau
    return [shoulder - left, shoulder, other_shoulder, other_shoulder + right]


def _from_corners(foot, shoulder, other_shoulder, other_foot):
    left, right = shoulder - foot, other_foot - other_shoulder
    plateau = other_shoulder - shoulder or _POINT * min(left, right)
    return [0.5 * (shoulder + other_shoulder), left, right, plateau]


def _two_sided_to_file(center, left, right, plateau):
    return [left, center - 0.5 * plateau, right, center + 0.5 * plateau]


def _two_sided_from_file(left, shoulder, right, other_shoulder):
    if shoulder > other_shoulder:
        raise ValueError(
            f"gauss2mf with its right shoulder {other_shoulder:g} left of the left one "
            f"{shoulder:g} is not supported: it does not reach 1."
        )
    left, right = abs(left), abs(right)
    plateau = other_shoulder - shoulder or _POINT * min(left, right)
    return [0.5 * (shoulder + other_shoulder), left, right, plateau]


def _difference_from_file(slope, place, other_slope, other_place):
    if slope != other_slope or slope == 0.0:
        raise ValueError(
            f"dsigmf with slopes {slope:g} and {other_slope:g} is not supported: they must be the "
            "same and not zero. With two slopes the difference is below zero in one tail; use "
            "psigmf."
        )
    # s(-u) = 1 - s(u): with both slopes negative the rise is the second sigmoid.
    rise, fall = (place, other_place) if slope > 0.0 else (other_place, place)
    return [*_middle_and_half("dsigmf", rise, fall), 1.0 / abs(slope)]


def _product_to_file(center, width, left, right):
    return [1.0 / left, center - width, -1.0 / right, center + width]


def _product_from_file(slope, place, other_slope, other_place):
    if slope < 0.0 < other_slope:
        slope, place, other_slope, other_place = other_slope, other_place, slope, place
    if not slope > 0.0 > other_slope:
        raise ValueError(
            f"psigmf with slopes {slope:g} and {other_slope:g} is not supported: one must be "
            "positive and one negative."
        )
    return [*_middle_and_half("psigmf", place, other_place), 1.0 / slope, -1.0 / other_slope]


def _middle_and_half(name, rise, fall):
    if rise >= fall:
        raise ValueError(f"{name} that rises at {rise:g}, not before it falls at {fall:g}.")
    return [0.5 * (rise + fall), 0.5 * (fall - rise)]


def _bell_from_file(width, slope, center):
    if slope <= 0.0:
        raise ValueError(f"gbellmf with b = {slope:g} is not supported: b must be positive.")
    return [center, abs(width), slope]


def _flank(name, left, right):
    if left >= right:
        raise ValueError(f"the corners of {name} [{left:g} {right:g}] must be in ascending order.")
    return right - left


class _Function(NamedTuple):
    """A function of the format, and its parameters from and to those of the family."""

    name: str
    n_parameters: int
    to_file: Callable
    from_file: Callable


# By family.
_TABLE = {
    "gaussian": _Function(
        "gaussmf",
        2,
        lambda center, width: [width, center],
        lambda width, center: [center, abs(width)],
    ),
    "bell": _Function(
        "gbellmf", 3, lambda center, width, slope: [width, slope, center], _bell_from_file
    ),
    "triangular": _Function(
        "trimf",
        3,
        lambda center, left, right: [center - left, center, center + right],
        lambda foot, peak, other_foot: [peak, peak - foot, other_foot - peak],
    ),
    "trapezoidal": _Function("trapmf", 4, _corners, _from_corners),
    "pi_shaped": _Function("pimf", 4, _corners, _from_corners),
    "two_sided_gaussian": _Function("gauss2mf", 4, _two_sided_to_file, _two_sided_from_file),
    "s_shaped": _Function(
        "smf",
        2,
        lambda shoulder, width: [shoulder - width, shoulder],
        lambda foot, shoulder: [shoulder, _flank("smf", foot, shoulder)],
    ),
    "z_shaped": _Function(
        "zmf",
        2,
        lambda shoulder, width: [shoulder, shoulder + width],
        lambda shoulder, foot: [shoulder, _flank("zmf", shoulder, foot)],
    ),
    "sigmoid_difference": _Function(
        "dsigmf",
        4,
        lambda center, width, flank: [1.0 / flank, center - width, 1.0 / flank, center + width],
        _difference_from_file,
    ),
    "sigmoid_product": _Function("psigmf", 4, _product_to_file, _product_from_file),
}
_FAMILIES = {function.name: family for family, function in _TABLE.items()}
_WITH_CORNERS = {"trimf", "trapmf", "pimf"}
