r"""Profiles: how a flank falls from one, as a function of t, the distance in lengths of the flank.

t is zero on the plateau. Straight and S-shaped flanks reach zero at their foot, t = 1, where log mu
would be minus infinity, and rows that lie on no term would have no strengths. The logarithm of
these two therefore has a floor,

    log mu = log[(1 - e) mu + e exp(-t^2 / 2)] ,    e = 1e-10 .

It mixes the family's shape with 1e-10 of a Gaussian of the same place and flank.

* Normalised strengths equal the textbook's up to 1e-10 over the largest membership at the row.
* Where all memberships are zero, strengths are those of the Gaussians: the nearest term, in lengths
  of its flank, wins, and strengths change over such a length, not at once.
* Mu stays one at the shoulder; log mu falls from there on without end, as smooth as the profile.

e is so small that the least ridge, 1e-12, outweighs its square. So consequents cannot be bent to
make use of a rule where it fires by its floor alone.
"""

from typing import Any, ClassVar

import numpy as np

# Share of the Gaussian in the mixture, e.
_FLOOR = 1e-10


class GaussianProfile:
    """exp(-t^2 / 2)."""

    formula = "exp(-t^2 / 2)"

    @staticmethod
    def value(t):
        """Mu, for real and complex t >= 0."""
        return np.exp(-0.5 * t**2)

    @staticmethod
    def log_value_and_slope(t):
        """Log mu and its derivative by t, which is zero at t = 0."""
        return -0.5 * t**2, -t

    @staticmethod
    def reach(mu):
        """The t at which the profile has come down to ``mu``, between zero and one."""
        return np.sqrt(-2.0 * np.log(mu))


class _ProfileWithFoot:
    """A ``value`` with a ``slope`` that is zero from t = 1 on; its logarithm gets the floor."""

    value: ClassVar[Any]
    slope: ClassVar[Any]

    @classmethod
    def log_value_and_slope(cls, t):
        near = np.minimum(t, 1.0)
        gaussian, mu = np.exp(-0.5 * near**2), cls.value(t)
        mixture = mu + _FLOOR * (gaussian - mu)
        slope = (1.0 - _FLOOR) * cls.slope(t) - _FLOOR * near * gaussian
        # Beyond the foot, the mixture is that of t = 1, and the last term continues -t^2 / 2.
        log_mu = np.log(mixture) - 0.5 * (t - near) * (t + near)
        return log_mu, slope / mixture - (t - near)


class LinearProfile(_ProfileWithFoot):
    """1 - t."""

    formula = "max(1 - t, 1e-10 * exp(-t^2 / 2))"

    @staticmethod
    def value(t):
        return np.where(np.real(t) < 1.0, 1.0 - t, 0.0)

    @staticmethod
    def slope(t):
        return np.where((t > 0.0) & (t < 1.0), -1.0, 0.0)

    @staticmethod
    def reach(mu):
        return 1.0 - mu


class SplineProfile(_ProfileWithFoot):
    """Two parabolas that meet at one half: 1 - 2 t^2, then 2 (1 - t)^2."""

    formula = "max(2 * max(0, 1 - t)^2 - 4 * max(0, 0.5 - t)^2, 1e-10 * exp(-t^2 / 2))"

    @staticmethod
    def value(t):
        upper = np.real(t) < 0.5
        s = np.where(upper, t, np.where(np.real(t) < 1.0, 1.0 - t, 0.0))
        return np.where(upper, 1.0 - 2.0 * s**2, 2.0 * s**2)

    @staticmethod
    def slope(t):
        return -4.0 * np.minimum(t, np.maximum(1.0 - t, 0.0))

    @staticmethod
    def reach(mu):
        return np.where(mu > 0.5, np.sqrt(0.5 * (1.0 - mu)), 1.0 - np.sqrt(0.5 * mu))
