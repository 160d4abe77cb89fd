"""Families of membership functions; ``base`` has the conventions that all of them follow."""

from .base import Membership, Parameter
from .bell import Bell
from .flanked import PiShaped, SShaped, Trapezoidal, Triangular, TwoSidedGaussian, ZShaped
from .gaussian import Gaussian
from .sigmoid import SigmoidDifference, SigmoidProduct

__all__ = [
    "MEMBERSHIPS",
    "Bell",
    "Gaussian",
    "Membership",
    "Parameter",
    "PiShaped",
    "SShaped",
    "SigmoidDifference",
    "SigmoidProduct",
    "Trapezoidal",
    "Triangular",
    "TwoSidedGaussian",
    "ZShaped",
]

# By the name that a user gives.
MEMBERSHIPS: dict[str, type[Membership]] = {
    family.name: family
    for family in (
        Gaussian,
        Bell,
        Triangular,
        Trapezoidal,
        TwoSidedGaussian,
        PiShaped,
        SShaped,
        ZShaped,
        SigmoidDifference,
        SigmoidProduct,
    )
}
