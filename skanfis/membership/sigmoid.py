r"""Families of two sigmoids, s(u) = 1 / (1 + exp(-u)).

One rises at center - width, the other falls at center + width, over lengths called flanks. With
one length for both, u = (x - center) / flank and v = width / flank,

    s(u + v) - s(u - v) = [1 - exp(-2 v)] s(u + v) s(v - u) ,

so that difference and product differ by a factor that does not depend on x. With two lengths, the
product is still a membership, steeper on one side than on the other. The difference is not: it is
negative in the tail on the less steep side. So the difference has one flank, the product two.

The top, at u = 0, is below one: tanh(v / 2) for the difference, s(v)^2 for the product.
"""

from typing import ClassVar

import numpy as np

from .base import Membership, Parameter

_WHERE = " where s(u) = 1 / (1 + exp(-u))"


def _log_sigmoid(u):
    # This takes a quarter of the time of -logaddexp(0, -u).
    return np.minimum(u, 0.0) - np.log1p(np.exp(-np.abs(u)))


def _first_ratio(overlap):
    """The v of the start: a shape like that of a bell of slope 2, a top well above ``overlap``."""
    return 3.0 + np.log((1.0 + overlap) / (1.0 - overlap))


class SigmoidDifference(Membership):
    r"""mu(x) = s((x - c + a) / h) - s((x - c - a) / h), with theta = (c, log a, log h)."""

    name = "sigmoid_difference"
    parameters = (
        Parameter("center", "location"),
        Parameter("width", "log_width"),
        Parameter("flank", "log_width"),
    )
    formula = "s((x - center + width) / flank) - s((x - center - width) / flank)" + _WHERE

    @staticmethod
    def value(x, theta):
        center, log_width, log_flank = theta[:, :, None]
        u = (x - center) * np.exp(-log_flank)
        v = np.exp(log_width - log_flank)
        # The difference itself would lose its digits in the tails.
        return (1.0 - np.exp(-2.0 * v)) / ((1.0 + np.exp(-u - v)) * (1.0 + np.exp(u - v)))

    @staticmethod
    def log_value_and_gradient(x, theta):
        # The product with equal flanks, times a factor.
        log_mu, by = SigmoidProduct.log_value_and_gradient(x, theta[[0, 1, 2, 2]])
        v = np.exp(theta[1] - theta[2])[:, None]
        gain = -np.expm1(-2.0 * v)
        by_log_v = 2.0 * v * (1.0 - gain) / gain
        return log_mu + np.log(gain), np.stack([by[0], by[1] + by_log_v, by[2] + by[3] - by_log_v])

    @staticmethod
    def start(center, spacing, overlap):
        # sinh(v) / (cosh(v) + cosh(u)) = overlap at u = spacing / (2 flank)
        v = _first_ratio(overlap)
        flank = 0.5 * spacing / np.arccosh(np.sinh(v) / overlap - np.cosh(v))
        return np.stack([center, np.log(v * flank), np.log(flank)])


class SigmoidProduct(Membership):
    r"""mu(x) = s((x - c + a) / left) s((c + a - x) / right): theta = (c, log a, log of both)."""

    name = "sigmoid_product"
    parameters = (
        Parameter("center", "location"),
        Parameter("width", "log_width"),
        Parameter("left", "log_width"),
        Parameter("right", "log_width"),
    )
    formula = "s((x - center + width) / left) * s((center + width - x) / right)" + _WHERE
    signs: ClassVar[tuple[float, float]] = (1.0, -1.0)  # 1 rising, -1 falling, from left to right

    @classmethod
    def value(cls, x, theta):
        center, log_width, log_left, log_right = theta[:, :, None]
        width = np.exp(log_width)
        first = cls.signs[0] * (x - center + width) * np.exp(-log_left)
        second = cls.signs[1] * (x - center - width) * np.exp(-log_right)
        return 1.0 / ((1.0 + np.exp(-first)) * (1.0 + np.exp(-second)))

    @classmethod
    def log_value_and_gradient(cls, x, theta):
        center, log_width, log_left, log_right = theta[:, :, None]
        offset, width = x - center, np.exp(log_width)
        per_left, per_right = cls.signs[0] * np.exp(-log_left), cls.signs[1] * np.exp(-log_right)
        first, second = (offset + width) * per_left, (offset - width) * per_right
        log_first, log_second = _log_sigmoid(first), _log_sigmoid(second)
        # d log s(u) / du = 1 - s(u)
        by_first, by_second = -np.expm1(log_first), -np.expm1(log_second)
        gradient = np.empty((4, *offset.shape))
        np.multiply(by_first, -first, out=gradient[2])
        np.multiply(by_second, -second, out=gradient[3])
        by_first *= per_left
        by_second *= per_right
        np.subtract(-by_first, by_second, out=gradient[0])
        np.multiply(by_first - by_second, width, out=gradient[1])
        return log_first + log_second, gradient

    @staticmethod
    def start(center, spacing, overlap):
        # exp(v) / 2 / (cosh(v) + cosh(u)) = overlap at u = spacing / (2 flank)
        v = _first_ratio(overlap)
        flank = 0.5 * spacing / np.arccosh(0.5 * np.exp(v) / overlap - np.cosh(v))
        return np.stack([center, np.log(v * flank), np.log(flank), np.log(flank)])


class BothRising(SigmoidProduct):
    """Above both cuts, c - a and c + a, each over a length of its own."""

    name = "sigmoids_rising"
    formula = "s((x - center + width) / left) * s((x - center - width) / right)" + _WHERE
    signs = (1.0, 1.0)


class BothFalling(SigmoidProduct):
    """Below both cuts."""

    name = "sigmoids_falling"
    formula = "s((center - width - x) / left) * s((center + width - x) / right)" + _WHERE
    signs = (-1.0, -1.0)


class FallingRising(SigmoidProduct):
    """Below the lower cut and above the upper one: not zero only because cuts have widths."""

    name = "sigmoids_apart"
    formula = "s((center - width - x) / left) * s((x - center - width) / right)" + _WHERE
    signs = (-1.0, 1.0)


class _Side(Membership):
    """One side of a cut."""

    parameters = (Parameter("center", "location"), Parameter("width", "log_width"))
    side: ClassVar[float]  # where mu is near one: 1 right of the cut, -1 left

    @classmethod
    def value(cls, x, theta):
        cut, log_width = theta[:, :, None]
        return 1.0 / (1.0 + np.exp(-cls.side * (x - cut) * np.exp(-log_width)))

    @classmethod
    def log_value(cls, x, theta):
        cut, log_width = theta[:, :, None]
        return _log_sigmoid(cls.side * (x - cut) * np.exp(-log_width))

    @classmethod
    def log_value_and_gradient(cls, x, theta):
        cut, log_width = theta[:, :, None]
        inverse_width = cls.side * np.exp(-log_width)
        u = (x - cut) * inverse_width
        log_mu = _log_sigmoid(u)
        # d log s(u) / du = 1 - s(u)
        by_u = -np.expm1(log_mu)
        return log_mu, np.stack([-inverse_width * by_u, -u * by_u])

    @classmethod
    def start(cls, center, spacing, overlap):
        # Over half a spacing, the log odds fall by three to those of the overlap.
        width, odds = spacing / 6.0, 3.0 + np.log(overlap / (1.0 - overlap))
        return np.stack([center - cls.side * odds * width, np.log(width)])


class SigmoidRising(_Side):
    """mu(x) = s((x - c) / h), with theta = (c, log h): "above c"."""

    name = "sigmoid_rising"
    formula = "1 / (1 + exp((center - x) / width))"
    side = 1.0


class SigmoidFalling(_Side):
    """mu(x) = s((c - x) / h), with theta = (c, log h): "below c"."""

    name = "sigmoid_falling"
    formula = "1 / (1 + exp((x - center) / width))"
    side = -1.0
