"""The constants of memberships as exports compute with them.

What can be worked out beforehand is. Inputs are about the model's reference, and so is the location
``theta[0]`` that these functions are given.
"""

import numpy as np

from ..membership import MEMBERSHIPS

__all__ = ["CONSTANTS_OF", "FLOOR", "KINKS_OF", "SMALLEST_LOG_SQUARE"]

# As in ``membership.profiles`` and ``membership.bell``.
FLOOR = 1e-10
SMALLEST_LOG_SQUARE = np.log(1e-300)

# Functions of theta (n_parameters, n_terms), as the model has it; the constants of one term are a
# row of what they stack.


def _gaussian(theta):
    location, log_width = theta
    return [location, np.sqrt(0.5) * np.exp(-log_width)]


def _bell(theta):
    location, log_width, log_slope = theta
    return [location, np.exp(-log_width), np.exp(log_slope)]


def _two_sided_gaussian(theta):
    location, log_left, log_right, log_plateau = theta
    return [location, 0.5 * np.exp(log_plateau), np.exp(-log_left), np.exp(-log_right)]


def _two_feet(theta):
    """The feet, one over the lengths of the flanks, and the location, a triangle's corner."""
    location, log_left, log_right, *log_plateau = theta
    left, right = np.exp(log_left), np.exp(log_right)
    half = 0.5 * np.exp(log_plateau[0]) if log_plateau else 0.0
    return [location - half - left, location + half + right, 1.0 / left, 1.0 / right, location]


def _one_foot(side):
    def constants(theta):
        shoulder, log_width = theta
        width = np.exp(log_width)
        return [shoulder + side * width, -side / width]

    return constants


def _sigmoid_difference(theta):
    location, log_width, log_flank = theta
    v = np.exp(log_width - log_flank)
    return [location, np.exp(-log_flank), v, np.log(-np.expm1(-2.0 * v))]


def _sigmoid_product(theta):
    location, log_width, *log_flanks = theta
    flanks = [np.exp(-log_flank) for log_flank in log_flanks]
    return [location, *flanks, *(np.exp(log_width - log_flank) for log_flank in log_flanks)]


_BY_NAME = {
    "gaussian": _gaussian,
    "bell": _bell,
    "triangular": _two_feet,
    "trapezoidal": lambda theta: _two_feet(theta)[:4],
    "two_sided_gaussian": _two_sided_gaussian,
    "pi_shaped": lambda theta: _two_feet(theta)[:4],
    "s_shaped": _one_foot(-1.0),
    "z_shaped": _one_foot(1.0),
    "sigmoid_difference": _sigmoid_difference,
    "sigmoid_product": _sigmoid_product,
}

# By the class, since another class may go by the same name.
CONSTANTS_OF = {MEMBERSHIPS[name]: constants for name, constants in _BY_NAME.items()}

# Which constants are places where the slope jumps.
KINKS_OF = {MEMBERSHIPS["triangular"]: (0, 1, 4), MEMBERSHIPS["trapezoidal"]: (0, 1)}
