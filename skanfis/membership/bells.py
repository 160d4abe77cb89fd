"""The Gaussian, and Jang's bell."""

import numpy as np

from .base import Membership, Parameter

# Below this, (x - c)^2 / a^2 counts as zero: its logarithm stays finite, mu is exactly one.
_SMALLEST_SQUARE = 1e-300
# b of a bell at the start of training, as in Jang's examples.
_FIRST_SLOPE = 2.0


class Gaussian(Membership):
    r"""mu(x) = exp(-(x - c)^2 / (2 sigma^2)), with theta = (c, log sigma)."""

    name = "gaussian"
    parameters = (Parameter("center", "location"), Parameter("width", "log_width"))
    formula = "exp(-((x - center) / width)^2 / 2)"

    @staticmethod
    def value(x, theta):
        center, log_width = theta[:, :, None]
        return np.exp(-0.5 * ((x - center) * np.exp(-log_width)) ** 2)

    @staticmethod
    def log_value(x, theta):
        center, log_width = theta[:, :, None]
        log_mu = x - center
        log_mu *= np.exp(-log_width)
        log_mu *= log_mu
        log_mu *= -0.5
        return log_mu

    @staticmethod
    def log_value_and_gradient(x, theta):
        center, log_width = theta[:, :, None]
        inverse_width = np.exp(-log_width)
        distance = (x - center) * inverse_width
        gradient = np.empty((2, *distance.shape))
        np.multiply(distance, inverse_width, out=gradient[0])
        np.multiply(distance, distance, out=gradient[1])
        return -0.5 * gradient[1], gradient

    @staticmethod
    def start(center, spacing, overlap):
        # exp(-(spacing / 2)^2 / (2 sigma^2)) = overlap
        width = 0.5 * spacing / np.sqrt(-2.0 * np.log(overlap))
        return np.stack([center, np.log(width)])


class Bell(Membership):
    r"""Jang's bell, mu(x) = 1 / (1 + ((x - c)^2 / a^2)^b), with theta = (c, log a, log b)."""

    name = "bell"
    parameters = (
        Parameter("center", "location"),
        Parameter("width", "log_width"),
        Parameter("slope", "log_shape"),
    )
    formula = "1 / (1 + abs((x - center) / width)^(2 * slope))"

    @staticmethod
    def value(x, theta):
        center, log_width, log_slope = theta[:, :, None]
        return 1.0 / (1.0 + ((x - center) ** 2 * np.exp(-2.0 * log_width)) ** np.exp(log_slope))

    @staticmethod
    def log_value_and_gradient(x, theta):
        center, log_width, log_slope = theta[:, :, None]
        slope, inverse_width = np.exp(log_slope), np.exp(-log_width)
        distance = (x - center) * inverse_width
        square = np.maximum(distance**2, _SMALLEST_SQUARE)
        exponent = slope * np.log(square)
        log_mu = -np.logaddexp(0.0, exponent)
        beyond = -np.expm1(log_mu)  # 1 - mu = u^b / (1 + u^b)
        gradient = np.empty((3, *distance.shape))
        np.multiply(beyond, 2.0 * slope, out=gradient[1])
        np.multiply(gradient[1], distance / square * inverse_width, out=gradient[0])
        np.multiply(beyond, -exponent, out=gradient[2])
        return log_mu, gradient

    @staticmethod
    def start(center, spacing, overlap):
        # 1 / (1 + ((spacing / 2) / a)^(2 b)) = overlap
        width = 0.5 * spacing / (1.0 / overlap - 1.0) ** (0.5 / _FIRST_SLOPE)
        return np.stack([center, np.log(width), np.full_like(width, np.log(_FIRST_SLOPE))])
