r"""Membership families: how strongly an input value belongs to a linguistic term.

Conventions
-----------
A family works on many terms at once. ``x`` has shape (n_terms, n_rows), or anything that
broadcasts to it; ``theta`` has shape (n_parameters, n_terms), its rows in the order of
:attr:`Membership.parameters`. Every parameter is unconstrained, so that no step of a solver can
leave the set of valid memberships: what must be positive is held as its logarithm.

Each parameter has a *kind*, which says how it changes when the unit of the input changes,
x -> offset + scale * x:

* ``"location"``: a point on the input's axis, a -> offset + scale * a;
* ``"log_width"``: the logarithm of a length on it, s -> s + log(scale);
* ``"log_shape"``: the logarithm of a number without unit, unchanged.

Everything is in log space, because normalised firing strengths are a softmax of log mu: it is then
defined, and its sum is one, however far a row lies from every term.
"""

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np

__all__ = ["MEMBERSHIPS", "Bell", "Gaussian", "Membership", "Parameter"]

# Below this, (x - c)^2 / a^2 counts as zero: its logarithm stays finite, mu is exactly one.
_SMALLEST_SQUARE = 1e-300
# b of a bell at the start of training, as in Jang's examples.
_FIRST_SLOPE = 2.0


class Parameter(NamedTuple):
    """One unconstrained parameter of a membership family."""

    name: str  # its name in the user's units: "center", "width", ...
    kind: str  # "location", "log_width" or "log_shape"


class Membership(ABC):
    """A family of membership functions; see the module's conventions.

    To add one, write a subclass with the members below and list it in ``MEMBERSHIPS``.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]

    @staticmethod
    @abstractmethod
    def value(x, theta):
        """mu(x) by the textbook formula, analytic in every argument: the oracle of the rest."""

    @staticmethod
    @abstractmethod
    def log_value(x, theta):
        """log mu(x), shape (n_terms, n_rows), without overflow or underflow."""

    @staticmethod
    @abstractmethod
    def log_value_and_gradient(x, theta):
        """log mu(x) and its derivatives by theta, shape (n_parameters, n_terms, n_rows)."""

    @staticmethod
    @abstractmethod
    def start(center, spacing, overlap):
        """Theta of terms at ``center``, ``spacing`` apart; neighbours cross at mu = ``overlap``."""

    @staticmethod
    @abstractmethod
    def from_center_and_width(center, width):
        """Theta of terms at ``center`` that fall as a Gaussian of standard deviation ``width``.

        The two may have any one shape; theta has one axis more in front.
        """

    @classmethod
    def change_units(cls, theta, offset, scale):
        """Theta after the inputs' change of unit x -> offset + scale * x (per term)."""
        moved = np.array(theta, dtype=float)
        for row, parameter in zip(moved, cls.parameters, strict=True):
            if parameter.kind == "location":
                row[:] = offset + scale * row
            elif parameter.kind == "log_width":
                row += np.log(scale)
        return moved

    @classmethod
    def natural(cls, theta):
        """Theta with every logarithm undone: what a person reads."""
        natural = np.array(theta, dtype=float)
        for row, parameter in zip(natural, cls.parameters, strict=True):
            if parameter.kind != "location":
                np.exp(row, out=row)
        return natural


class Gaussian(Membership):
    r"""mu(x) = exp(-(x - c)^2 / (2 sigma^2)), with theta = (c, log sigma)."""

    name = "gaussian"
    parameters = (Parameter("center", "location"), Parameter("width", "log_width"))

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

    @staticmethod
    def from_center_and_width(center, width):
        return np.stack([center, np.log(width)])


class Bell(Membership):
    r"""Jang's bell, mu(x) = 1 / (1 + ((x - c)^2 / a^2)^b), with theta = (c, log a, log b)."""

    name = "bell"
    parameters = (
        Parameter("center", "location"),
        Parameter("width", "log_width"),
        Parameter("slope", "log_shape"),
    )

    @staticmethod
    def value(x, theta):
        center, log_width, log_slope = theta[:, :, None]
        return 1.0 / (1.0 + ((x - center) ** 2 * np.exp(-2.0 * log_width)) ** np.exp(log_slope))

    @staticmethod
    def log_value(x, theta):
        center, log_width, log_slope = theta[:, :, None]
        square = ((x - center) * np.exp(-log_width)) ** 2
        return -np.logaddexp(0.0, np.exp(log_slope) * np.log(np.maximum(square, _SMALLEST_SQUARE)))

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

    @staticmethod
    def from_center_and_width(center, width):
        # The two fall to one half at the same distance: a^2 = 2 log(2) width^2.
        half = np.log(width) + 0.5 * np.log(2.0 * np.log(2.0))
        return np.stack([center, half, np.full_like(half, np.log(_FIRST_SLOPE))])


MEMBERSHIPS: dict[str, type[Membership]] = {family.name: family for family in (Gaussian, Bell)}
