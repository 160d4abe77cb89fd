"""Arithmetic on intervals, each a pair of arrays (low, high), and what rounding may add to them."""

import numpy as np

__all__ = ["EPS", "ROUNDINGS", "product", "size", "square", "widened"]

EPS = float(np.finfo(float).eps)
# Roundings of a membership, a share, a rule's output or its slope, in EPS, with room to spare: of
# a dozen operations one after another, beside those of sums, which are counted.
ROUNDINGS = 32.0


def product(one, other):
    """Range of a product from the ranges of both; NaN, for unknown, of zero times infinity."""
    corners = [a * b for a in one for b in other]
    low = np.minimum(np.minimum(corners[0], corners[1]), np.minimum(corners[2], corners[3]))
    high = np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3]))
    return low, high


def square(ends):
    """Range of a square from that of its root."""
    low, high = np.minimum(*np.abs(ends)), np.maximum(*np.abs(ends))
    return np.where((ends[0] <= 0.0) & (ends[1] >= 0.0), 0.0, low**2), high**2


def size(ends):
    """The largest absolute value in an interval."""
    return np.maximum(np.abs(ends[0]), np.abs(ends[1]))


def widened(low, high):
    """The interval, wider by rounding errors of its ends."""
    slack = ROUNDINGS * EPS * size((low, high))
    return low - slack, high + slack
