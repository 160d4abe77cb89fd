"""The constants of memberships as exports compute with them.

A term has locations on the input's axis, where it is the distance from them that counts, and
further constants; what can be worked out beforehand is. A location that the type of number cannot
hold is held as the sum of two. It matters to single precision, and to the foot of a flank in
either: log mu falls steeply there, and rows in a gap between all terms have nothing else to go by.
"""

import numpy as np

from ..membership import MEMBERSHIPS

__all__ = ["CONSTANTS_OF", "FLOOR", "SMALLEST_LOG_SQUARE"]

# As in ``membership.profiles`` and ``membership.bell``.
FLOOR = 1e-10
SMALLEST_LOG_SQUARE = np.log(1e-300)

# Functions of theta (n_parameters, n_terms), as the model has it. They return a list of locations
# and a list of further constants; a location is a tuple of arrays whose exact sum it is.


def _gaussian(theta):
    location, log_width = theta
    return [(location,)], [np.sqrt(0.5) * np.exp(-log_width)]


def _bell(theta):
    location, log_width, log_slope = theta
    return [(location,)], [np.exp(-log_width), np.exp(log_slope)]


def _two_sided_gaussian(theta):
    location, log_left, log_right, log_plateau = theta
    flanks = [np.exp(-log_left), np.exp(-log_right)]
    return [(location,)], [0.5 * np.exp(log_plateau), *flanks]


def _two_feet(theta):
    location, log_left, log_right, *log_plateau = theta
    left, right = np.exp(log_left), np.exp(log_right)
    half = 0.5 * np.exp(log_plateau[0]) if log_plateau else np.zeros_like(location)
    feet = [(location, -half, -left), (location, half, right)]
    return [*feet, *([] if log_plateau else [(location,)])], [1.0 / left, 1.0 / right]


def _one_foot(side):
    def constants(theta):
        shoulder, log_width = theta
        width = np.exp(log_width)
        return [(shoulder, side * width)], [-side / width]

    return constants


def _sigmoid_difference(theta):
    location, log_width, log_flank = theta
    v = np.exp(log_width - log_flank)
    return [(location,)], [np.exp(-log_flank), v, np.log(-np.expm1(-2.0 * v))]


def _sigmoid_product(theta):
    location, log_width, *log_flanks = theta
    flanks = [np.exp(-log_flank) for log_flank in log_flanks]
    return [(location,)], [*flanks, *(np.exp(log_width - log_flank) for log_flank in log_flanks)]


_BY_NAME = {
    "gaussian": _gaussian,
    "bell": _bell,
    "triangular": _two_feet,
    "trapezoidal": _two_feet,
    "two_sided_gaussian": _two_sided_gaussian,
    "pi_shaped": _two_feet,
    "s_shaped": _one_foot(-1.0),
    "z_shaped": _one_foot(1.0),
    "sigmoid_difference": _sigmoid_difference,
    "sigmoid_product": _sigmoid_product,
}

# By the class, since another class may go by the same name.
CONSTANTS_OF = {MEMBERSHIPS[name]: constants for name, constants in _BY_NAME.items()}
