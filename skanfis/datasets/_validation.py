"""Checks of the parameters of this subpackage, in the words of scikit-learn's own."""

from math import isfinite
from numbers import Integral, Real

from sklearn.utils.validation import check_scalar

__all__ = ["check_choice", "check_count", "check_real"]


def check_real(value, name, *, min_val=None, max_val=None, include_boundaries="both"):
    """Return ``value`` as a float if it is a finite real number within its bounds.

    Raises
    ------
    TypeError
        If it is not a real number (a bool is none).
    ValueError
        If it is infinite, NaN, or out of bounds.
    """
    _refuse_bool(value, name, "float")
    check_scalar(
        value, name, Real, min_val=min_val, max_val=max_val, include_boundaries=include_boundaries
    )
    # NaN passes every comparison of check_scalar, because each of them is false.
    if not isfinite(value):
        raise ValueError(f"{name} == {value}, must be finite.")
    return float(value)


def check_count(value, name, *, min_val):
    """Return ``value`` as an int if it is an integer of at least ``min_val``.

    Raises
    ------
    TypeError
        If it is not an integer (a bool is none).
    ValueError
        If it is too small.
    """
    _refuse_bool(value, name, "int")
    return int(check_scalar(value, name, Integral, min_val=min_val))


def check_choice(value, name, choices):
    """Return ``value`` if it is one of the strings ``choices``.

    Raises
    ------
    ValueError
        If it is not.
    """
    if value not in choices:
        listed = ", ".join(map(repr, choices))
        raise ValueError(f"{name} must be one of {listed}; got {value!r}.")
    return value


def _refuse_bool(value, name, wanted):
    # bool is a subclass of int, but True as a number of devices or a duration is a mistake.
    if isinstance(value, bool):
        raise TypeError(f"{name} must be an instance of {wanted}, not bool.")
