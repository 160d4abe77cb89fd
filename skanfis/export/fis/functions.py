"""Convert membership functions between the .fis format and the families of skanfis.

Every function equals a family's textbook mu, with other parameters. Those of a family are the
natural ones here: widths, not their logarithms. A function that no family can represent raises
ValueError.
"""

from collections.abc import Callable
from functools import partial
from math import log
from operator import itemgetter

import numpy as np

from ...membership import FAMILIES, PRODUCTS, SIDES
from .._families import check_own
from ..limits import LARGEST_NUMBER, SMALLEST_NUMBER, shown

# Width for a plateau that is a point, if the family must have one; relative to the shorter flank.
_POINT = 1e-12


def function_of(family, natural):
    """Name and parameters in the file for a term with these natural parameters."""
    check_own(family)
    name, to_file = _TO_FILE[family.name]
    return name, to_file(*map(float, natural))


def theta_of(name, parameters, low, high):
    """Family and theta of a membership function in a file; [low, high] is its input's Range."""
    if name not in _FROM_FILE:
        raise ValueError(
            f"the membership function {shown(name)} is not supported; {', '.join(_FROM_FILE)} are."
        )
    n_parameters, from_file = _FROM_FILE[name]
    if len(parameters) != n_parameters:
        raise ValueError(f"{name} takes {n_parameters} parameters, found {len(parameters)}.")
    if name in ("trimf", "trapmf", "pimf"):
        parameters = _open_flanks(name, parameters, low, high)
    family, *natural = from_file(*parameters)
    theta = []
    for parameter, value in zip(FAMILIES[family].parameters, natural, strict=True):
        if parameter.kind == "location":
            theta.append(value)
        elif SMALLEST_NUMBER <= value <= LARGEST_NUMBER:
            theta.append(log(value))
        else:
            raise ValueError(
                f"{name} {parameters} is a {family} membership of {parameter.name} {value:g}, "
                f"which must be between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}."
            )
    return FAMILIES[family], np.array(theta)


def _open_flanks(name, corners, low, high):
    """Corners without vertical flanks; those at or outside the ends of the Range are replaced.

    A term at the edge is often given as trimf [0 0 5] on Range [0 10]. Any other left flank gives
    the same values within the Range.
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


def _from_corners(family, foot, shoulder, other_shoulder, other_foot):
    left, right = shoulder - foot, other_foot - other_shoulder
    return family, *_about_middle(left, shoulder, right, other_shoulder)


def _about_middle(left, shoulder, right, other_shoulder):
    left, right = abs(left), abs(right)
    plateau = other_shoulder - shoulder or _POINT * min(left, right)
    return 0.5 * (shoulder + other_shoulder), left, right, plateau


def _sigmoids(*numbers):
    """One or two sigmoids, given by slope and place in turn; signs of slopes decide the family."""
    pairs = sorted(zip(numbers[::2], numbers[1::2], strict=True), key=itemgetter(1))
    slopes, places = np.transpose(pairs)
    if not slopes.all():
        raise ValueError("a sigmoid of slope 0 is one half everywhere: leave it out.")
    signs, widths = np.sign(slopes), [1.0 / abs(slope) for slope in slopes.tolist()]
    if len(pairs) == 1:
        return SIDES[signs[0]].name, *places, *widths
    left, right = places
    return PRODUCTS[tuple(signs)].name, 0.5 * (left + right), 0.5 * (right - left), *widths


def _difference(slope, place, other_slope, other_place):
    if slope != other_slope:
        raise ValueError(
            f"dsigmf with slopes {slope:g} and {other_slope:g} is not supported: they must be the "
            "same and not zero. With two slopes the difference is below zero in one tail; use "
            "psigmf."
        )
    # Only the size of the difference counts: neither sign of the slope nor order matters.
    _, center, width, flank, _ = _sigmoids(slope, place, other_slope, other_place)
    return "sigmoid_difference", center, width, flank


def _product_to_file(first, second):
    return lambda c, width, left, right: [first / left, c - width, second / right, c + width]


# By family: the function's name, and what turns the parameters of the family into its own.
_TO_FILE: dict[str, tuple[str, Callable]] = {
    "gaussian": ("gaussmf", lambda c, width: [width, c]),
    "bell": ("gbellmf", lambda c, width, slope: [width, slope, c]),
    "triangular": ("trimf", lambda c, left, right: [c - left, c, c + right]),
    "trapezoidal": ("trapmf", _corners),
    "pi_shaped": ("pimf", _corners),
    "two_sided_gaussian": (
        "gauss2mf",
        lambda c, left, right, plateau: [left, c - 0.5 * plateau, right, c + 0.5 * plateau],
    ),
    "s_shaped": ("smf", lambda top, width: [top - width, top]),
    "z_shaped": ("zmf", lambda top, width: [top, top + width]),
    "sigmoid_difference": (
        "dsigmf",
        lambda c, width, flank: [1.0 / flank, c - width, 1.0 / flank, c + width],
    ),
    "sigmoid_rising": ("sigmf", lambda cut, width: [1.0 / width, cut]),
    "sigmoid_falling": ("sigmf", lambda cut, width: [-1.0 / width, cut]),
    **{one.name: ("psigmf", _product_to_file(*signs)) for signs, one in PRODUCTS.items()},
}
# By function: how many parameters it has, and what turns them into a family and its own.
_FROM_FILE: dict[str, tuple[int, Callable]] = {
    "gaussmf": (2, lambda width, c: ("gaussian", c, abs(width))),
    "gbellmf": (3, lambda width, slope, c: ("bell", c, abs(width), slope)),
    "trimf": (3, lambda left, peak, right: ("triangular", peak, peak - left, right - peak)),
    "trapmf": (4, partial(_from_corners, "trapezoidal")),
    "pimf": (4, partial(_from_corners, "pi_shaped")),
    "gauss2mf": (4, lambda *numbers: ("two_sided_gaussian", *_about_middle(*numbers))),
    "smf": (2, lambda foot, top: ("s_shaped", top, top - foot)),
    "zmf": (2, lambda top, foot: ("z_shaped", top, foot - top)),
    "dsigmf": (4, _difference),
    "sigmf": (2, _sigmoids),
    "psigmf": (4, _sigmoids),
}
