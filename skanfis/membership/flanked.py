r"""Families with flanks: mu is one on a plateau, which may be a point, and falls to its sides.

A family is a geometry and a profile. b and c are the shoulders, and the profile is a function of t,
the distance from the nearer shoulder in lengths of the flank on that side,

    mu(x) = profile(t) ,    t = (b - x) / left   for x < b ,
                            t = 0                for b <= x <= c ,
                            t = (x - c) / right  for x > c .

The feet are at a = b - left and d = c + right. The parameters are the center and the logarithms of
the lengths, the plateau c - b among them. So a <= b <= c <= d holds for all of their values.
"""

from typing import Any, ClassVar

import numpy as np

from .base import Membership, Parameter
from .profiles import GaussianProfile, LinearProfile, SplineProfile

# t of two flanks without a plateau, and with one.
_TO_POINT = " where t = max((center - x) / left, (x - center) / right)"
_TO_PLATEAU = (
    " where t = max(0, (center - plateau / 2 - x) / left, (x - center - plateau / 2) / right)"
)
# The plateau at the start of training, as part of the spacing of terms.
_FIRST_PLATEAU = 0.25


class _Flanked(Membership):
    """A ``profile`` and a geometry.

    ``_distance(x, theta)`` gives t and details. From these and ``slope``, the derivative by t,
    ``_chain(slope, t, *details)`` gives the derivatives by theta.
    """

    profile: ClassVar[Any]
    _distance: ClassVar[Any]
    _chain: ClassVar[Any]

    @classmethod
    def value(cls, x, theta):
        return cls.profile.value(cls._distance(x, theta)[0])

    @classmethod
    def log_value(cls, x, theta):
        return cls.profile.log_value_and_slope(cls._distance(x, theta)[0])[0]

    @classmethod
    def log_value_and_gradient(cls, x, theta):
        t, *details = cls._distance(x, theta)
        log_mu, slope = cls.profile.log_value_and_slope(t)
        return log_mu, cls._chain(slope, t, *details)


class _TwoSided(_Flanked):
    """theta = (center, log left, log right) and, with a plateau, its logarithm."""

    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("center", "location"),
        Parameter("left", "log_width"),
        Parameter("right", "log_width"),
        Parameter("plateau", "log_width"),
    )

    @classmethod
    def _distance(cls, x, theta):
        center, log_left, log_right, *log_plateau = theta[:, :, None]
        half = 0.5 * np.exp(log_plateau[0]) if log_plateau else 0.0
        on_left = x < np.real(center)
        side = np.where(on_left, -1.0, 1.0)
        flank = np.where(on_left, np.exp(log_left), np.exp(log_right))
        beyond = side * (x - center) - half
        t = np.where(np.real(beyond) > 0.0, beyond, 0.0) / flank
        return t, side, flank, half

    @classmethod
    def _chain(cls, slope, t, side, flank, half):
        gradient = np.empty((len(cls.parameters), *t.shape))
        by_length = slope / flank
        np.multiply(-side, by_length, out=gradient[0])
        by_log_flank = -slope * t
        np.multiply(by_log_flank, side < 0.0, out=gradient[1])
        np.multiply(by_log_flank, side > 0.0, out=gradient[2])
        if len(gradient) > 3:
            np.multiply(-half, by_length, out=gradient[3])
        return gradient

    @classmethod
    def start(cls, center, spacing, overlap):
        plateau = _FIRST_PLATEAU * spacing if len(cls.parameters) > 3 else 0.0
        # plateau / 2 + flank * reach(overlap) = spacing / 2
        log_flank = np.log(0.5 * (spacing - plateau) / cls.profile.reach(overlap))
        theta = [center, log_flank, log_flank]
        return np.stack([*theta, np.log(plateau)] if len(cls.parameters) > 3 else theta)


class Triangular(_TwoSided):
    r"""mu(x) = 1 - (c - x) / left for x < c, 1 - (x - c) / right for x > c, never below zero."""

    name = "triangular"
    parameters = _TwoSided.parameters[:3]
    profile = LinearProfile
    has_corners = True
    formula = LinearProfile.formula + _TO_POINT


class Trapezoidal(_TwoSided):
    """Straight flanks on either side of a plateau."""

    name = "trapezoidal"
    profile = LinearProfile
    has_corners = True
    formula = LinearProfile.formula + _TO_PLATEAU


class PiShaped(_TwoSided):
    """Flanks of two parabolas each on either side of a plateau."""

    name = "pi_shaped"
    profile = SplineProfile
    formula = SplineProfile.formula + _TO_PLATEAU


class TwoSidedGaussian(_TwoSided):
    """Flanks of Gaussians, each of a deviation of its own, on either side of a plateau."""

    name = "two_sided_gaussian"
    profile = GaussianProfile
    formula = GaussianProfile.formula + _TO_PLATEAU


class _OneSided(_Flanked):
    """Mu is one to one side of a shoulder and falls on the other; theta = (shoulder, log width)."""

    parameters = (Parameter("shoulder", "location"), Parameter("width", "log_width"))
    side: ClassVar[float]  # on which the flank lies: -1 left, 1 right

    @classmethod
    def _distance(cls, x, theta):
        shoulder, log_width = theta[:, :, None]
        beyond = cls.side * (x - shoulder)
        inverse_width = np.exp(-log_width)
        return np.where(np.real(beyond) > 0.0, beyond, 0.0) * inverse_width, inverse_width

    @classmethod
    def _chain(cls, slope, t, inverse_width):
        return np.stack([-cls.side * inverse_width * slope, -slope * t])

    @classmethod
    def start(cls, center, spacing, overlap):
        # The flank reaches ``overlap`` half-way to its neighbour, as in other families.
        return np.stack([center, np.log(0.5 * spacing / cls.profile.reach(overlap))])


class SShaped(_OneSided):
    """One from the shoulder on: "at least". The flank of two parabolas lies to its left."""

    name = "s_shaped"
    profile = SplineProfile
    formula = f"{SplineProfile.formula} where t = max(0, (shoulder - x) / width)"
    side = -1.0


class ZShaped(_OneSided):
    """One up to the shoulder: "at most". The flank of two parabolas lies to its right."""

    name = "z_shaped"
    profile = SplineProfile
    formula = f"{SplineProfile.formula} where t = max(0, (x - shoulder) / width)"
    side = 1.0
