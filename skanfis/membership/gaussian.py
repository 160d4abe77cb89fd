"""The Gaussian."""

import numpy as np

from .base import Membership, Parameter


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
