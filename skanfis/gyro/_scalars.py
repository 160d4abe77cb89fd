"""Parameters that are one number."""

from math import isfinite
from numbers import Real

__all__ = ["check_number"]


def check_number(value, name, *, zero=False):
    """Return a finite positive number as a float, or raise ValueError; ``zero`` lets zero pass."""
    wanted = "zero or a positive" if zero else "a positive"
    number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else -1.0
    if not isfinite(number) or number < 0 or (number == 0 and not zero):
        raise ValueError(f"{name}={value!r} must be {wanted} number.")
    return number
