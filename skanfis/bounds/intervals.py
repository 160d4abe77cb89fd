"""Arithmetic on intervals, each a pair of arrays (low, high)."""

import numpy as np

__all__ = ["product", "size", "square"]


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
