r"""Means and standard deviations of all rows so far, and moments carried over to them.

Two sets of rows of weights W1, W2, means m1, m2 and variances v1, v2 have together (Chan, Golub and
LeVeque 1979)

    m = m1 + W2 / W (m2 - m1) ,    v = (W1 v1 + W2 v2) / W + W1 W2 / W^2 (m2 - m1)^2 .

Sums over rows of products of [1, z] are carried from one standardisation to another exactly, since
[1, z'] = T [1, z] with z'_j = t_j + g_j z_j. They are so kept about the mean of the rows that they
are of, wherever the first of these lay: no digits are lost as a sensor drifts away from its start.
"""

from dataclasses import dataclass

import numpy as np

from ..learning.data import Scale

__all__ = ["Change", "merged_scale"]


def merged_scale(one: Scale, weight: float, other: Scale, other_weight: float) -> Scale:
    """The scale of two sets of rows together, by their weights."""
    minimum = np.minimum(one.minimum, other.minimum)
    maximum = np.maximum(one.maximum, other.maximum)
    total = weight + other_weight
    share, other_share = weight / total, other_weight / total
    is_constant = minimum == maximum
    # In parts of the range, whose squares neither overflow nor vanish.
    span = np.where(is_constant, 1.0, maximum - minimum)
    between = (other.offset - one.offset) / span
    variance = share * _variance(one, span) + other_share * _variance(other, span)
    scale = span * np.sqrt(variance + share * other_share * between**2)
    # From the heavier side: what little is added to it costs no digits.
    offset = np.where(
        share >= other_share,
        one.offset + other_share * span * between,
        other.offset - share * span * between,
    )
    return Scale(
        np.where(is_constant, minimum, offset),
        np.where(is_constant | (scale == 0.0), 1.0, scale),
        minimum,
        maximum,
    )


def _variance(scale, span):
    return np.where(scale.is_constant, 0.0, scale.scale / span) ** 2


@dataclass(frozen=True, eq=False)
class Change:
    """z' = shift + factor * z, per column."""

    shift: np.ndarray
    factor: np.ndarray

    @classmethod
    def of(cls, old: Scale, new: Scale):
        """From one standardisation to another."""
        return cls((old.offset - new.offset) / new.scale, old.scale / new.scale)

    def only(self, columns):
        """The change of some of the columns."""
        return Change(self.shift[columns], self.factor[columns])

    def of_rows(self, matrix):
        """T M for a matrix whose rows are sums of [1, z] times something, rule by rule."""
        blocks = matrix.reshape(-1, 1 + self.shift.size, matrix.shape[-1]).copy()
        blocks[:, 1:] *= self.factor[:, None]
        blocks[:, 1:] += self.shift[:, None] * blocks[:, :1]
        return blocks.reshape(matrix.shape)

    def of_square(self, matrix):
        """T M T' for a symmetric matrix of sums of [1, z] by [1, z]."""
        return self.of_rows(np.ascontiguousarray(self.of_rows(matrix).T))
