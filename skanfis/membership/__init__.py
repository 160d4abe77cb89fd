"""Families of membership functions; ``base`` has the conventions that all of them follow."""

from .base import Membership, Parameter
from .bells import Bell, Gaussian
from .flanked import PiShaped, SShaped, Trapezoidal, Triangular, TwoSidedGaussian, ZShaped
from .sigmoid import (
    BothFalling,
    BothRising,
    FallingRising,
    SigmoidDifference,
    SigmoidFalling,
    SigmoidProduct,
    SigmoidRising,
)

__all__ = [
    "FAMILIES",
    "MEMBERSHIPS",
    "NAMES_IN_MATLAB",
    "PRODUCTS",
    "SIDES",
    "Bell",
    "Gaussian",
    "Membership",
    "Parameter",
    "PiShaped",
    "SShaped",
    "SigmoidDifference",
    "SigmoidFalling",
    "SigmoidProduct",
    "SigmoidRising",
    "Trapezoidal",
    "Triangular",
    "TwoSidedGaussian",
    "ZShaped",
    "membership_families",
]

# The families by the names that users give.
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

# Sides of a cut, above and below it, and products of two: conditions on the paths of a tree.
SIDES = {side.side: side for side in (SigmoidRising, SigmoidFalling)}
PRODUCTS = {
    product.signs: product for product in (SigmoidProduct, BothRising, BothFalling, FallingRising)
}
# All families. Those of a tree are left out of MEMBERSHIPS, as they do not suit a whole input.
FAMILIES = MEMBERSHIPS | {one.name: one for one in (*SIDES.values(), *PRODUCTS.values())}

# The names in MATLAB's Fuzzy Logic Toolbox, for error messages and the pages on files.
NAMES_IN_MATLAB = {
    "gaussmf": "gaussian",
    "gbellmf": "bell",
    "trimf": "triangular",
    "trapmf": "trapezoidal",
    "gauss2mf": "two_sided_gaussian",
    "pimf": "pi_shaped",
    "smf": "s_shaped",
    "zmf": "z_shaped",
    "dsigmf": "sigmoid_difference",
    "psigmf": "sigmoid_product",
}


def membership_families(mf, input_names) -> list[type[Membership]]:
    """One family per input, from a name, a class, or a sequence of these."""
    given = [mf] * len(input_names) if isinstance(mf, str | type) else list(mf)
    if len(given) != len(input_names):
        raise ValueError(
            f"mf={mf!r} has the length {len(given)}, and the columns of X are "
            f"{', '.join(input_names)}: give one family for all of them, or one for each."
        )
    families = []
    for entry in given:
        if isinstance(entry, type) and issubclass(entry, Membership):
            families.append(entry)
        elif isinstance(entry, str) and entry in MEMBERSHIPS:
            families.append(MEMBERSHIPS[entry])
        elif isinstance(entry, str) and entry in NAMES_IN_MATLAB:
            raise ValueError(
                f"mf={entry!r} is MATLAB's name of the family: use mf={NAMES_IN_MATLAB[entry]!r}."
            )
        else:
            raise ValueError(
                f"mf holds {entry!r}: it must be one of {', '.join(map(repr, MEMBERSHIPS))}, or a "
                "subclass of skanfis.membership.Membership."
            )
    return families
