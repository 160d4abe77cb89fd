r"""The interface of families of membership functions: how strongly a value belongs to a term.

Conventions
-----------
A family works on many terms at once. ``x`` has shape (n_terms, n_rows), or anything that
broadcasts to it; ``theta`` has shape (n_parameters, n_terms), its rows in the order of
:attr:`Membership.parameters`. Every parameter is unconstrained, so that no step of a solver can
leave the set of valid memberships: a positive number is held as its logarithm, and corners in order
as a point and the logarithms of distances.

Each parameter has a *kind*, which says how it changes when the unit of the input changes,
x -> offset + scale * x:

* ``"location"``: a point on the input's axis, a -> offset + scale * a;
* ``"log_width"``: the logarithm of a length on it, s -> s + log(scale);
* ``"log_shape"``: the logarithm of a number without unit, unchanged.

A family has one location, its first parameter, and at least one width. Terms of scattered rules
shift in units of the first of their widths (see ``premise``).

Everything is in log space, because normalised firing strengths are a softmax of log mu. So they are
defined, and sum to one, however far a row lies from every term. This needs a finite log mu
everywhere, also for families whose mu is zero beyond a foot (see ``profiles``).
"""

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np

# exp(-u^2 / 2) = 1/2 at this u.
_HALF_HEIGHT = np.sqrt(2.0 * np.log(2.0))


class Parameter(NamedTuple):
    """One unconstrained parameter of a membership family."""

    name: str  # its name in the user's units: "center", "width", ...
    kind: str  # "location", "log_width" or "log_shape"


class Membership(ABC):
    """A family of membership functions; see the module's conventions.

    docs/add_a_membership.rst says how to add one, and which places beyond its class know of it.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    # mu(x), and its floor, in the names of the parameters, for texts; not printed if empty.
    formula: ClassVar[str] = ""
    # Whether the slope of mu jumps anywhere.
    has_corners: ClassVar[bool] = False

    @staticmethod
    @abstractmethod
    def value(x, theta) -> np.ndarray:
        """mu(x) by the textbook formula, which tests compare the rest with.

        ``theta`` may be complex; between corners of the formula it is analytic in theta, so that
        the imaginary part at a complex step gives a derivative.
        """

    @classmethod
    def log_value(cls, x, theta):
        """log mu(x), shape (n_terms, n_rows), finite, without overflow or underflow."""
        return cls.log_value_and_gradient(x, theta)[0]

    @staticmethod
    @abstractmethod
    def log_value_and_gradient(x, theta):
        """log mu(x) and its derivatives by theta, shape (n_parameters, n_terms, n_rows)."""

    @staticmethod
    @abstractmethod
    def start(center, spacing, overlap):
        """Theta of terms at ``center``, ``spacing`` apart; neighbours cross at mu = ``overlap``.

        The arguments have one common shape; theta has one more axis in front.
        """

    @classmethod
    def from_center_and_width(cls, center, width):
        """Theta of terms at ``center`` as wide at half height as a Gaussian of deviation ``width``.

        The arguments have one common shape; theta has one more axis in front.
        """
        return cls.start(center, 2.0 * _HALF_HEIGHT * width, 0.5)

    @classmethod
    def change_units(cls, theta, offset, scale):
        """Theta after a change of the inputs' units, x -> offset + scale * x, per term."""
        moved = np.array(theta, dtype=float)
        for row, parameter in zip(moved, cls.parameters, strict=True):
            if parameter.kind == "location":
                row[:] = offset + scale * row
            elif parameter.kind == "log_width":
                row += np.log(scale)
        return moved

    @classmethod
    def natural(cls, theta):
        """Theta with every logarithm undone, for people to read."""
        natural = np.array(theta, dtype=float)
        is_log = [parameter.kind != "location" for parameter in cls.parameters]
        natural[is_log] = np.exp(natural[is_log])
        return natural
