"""Units of a log's columns, and what they are converted to: s, degC, deg/s.

A raw signal (counts, volts) keeps its unit: a scale factor turns it into a rate later.
"""

import math

import numpy as np

from ._names import unit_in

__all__ = [
    "CANONICAL",
    "SIGNALS",
    "convert",
    "declared_units",
    "plausible_units",
    "unit_named",
    "units_of",
]

_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
_RATE = {
    "deg/s": 1.0,
    "deg/h": 1 / 3600.0,
    "rad/s": 180.0 / math.pi,
    "mrad/s": 0.18 / math.pi,
    "rpm": 6.0,
}
_TEMPERATURE = {"degC": 1.0, "K": 1.0, "degF": 5.0 / 9.0}
_ZERO = {"K": -273.15, "degF": -160.0 / 9.0}  # of each scale, in degC
SIGNALS = ("counts", "V", "mV")

_UNITS = {
    "time": _TIME,
    "temperature": _TEMPERATURE,
    "rate": _RATE,
    "output": {**_RATE, **dict.fromkeys(SIGNALS, 1.0)},
}
CANONICAL = {"time": "s", "temperature": "degC", "rate": "deg/s", "output": "deg/s"}


def units_of(quantity):
    """Names of the units that a quantity may be given in."""
    return tuple(_UNITS[quantity])


def unit_named(quantity, name):
    """The unit's usual name; ValueError where the quantity has no such unit."""
    _, unit = unit_in(str(name)) or (None, name)
    if not isinstance(name, str) or unit not in _UNITS[quantity]:
        raise ValueError(
            f"{quantity} has no unit {name!r}: it may be in {', '.join(units_of(quantity))}."
        )
    return unit


def convert(values, quantity, unit):
    """Values in the canonical unit; those of a raw signal as they are."""
    return values * _UNITS[quantity][unit] + _ZERO.get(unit, 0.0)


def plausible_units(values, quantity, unit, low, high):
    """Other units in which the values, already converted from ``unit``, would be plausible."""
    given = (np.array([values.min(), values.max()]) - _ZERO.get(unit, 0.0)) / _UNITS[quantity][unit]
    found = []
    for other in units_of(quantity):
        smallest, largest = convert(given, quantity, other)
        if other not in (unit, *SIGNALS) and low <= smallest and largest <= high:
            found.append(other)
    return found


def declared_units(units):
    """``units`` with the usual name of each; ValueError where there is no such unit."""
    for quantity in units or {}:
        if quantity not in CANONICAL:
            known = ", ".join(CANONICAL)
            raise ValueError(f"units: there is no {quantity!r}; it may be one of {known}.")
    return {quantity: unit_named(quantity, unit) for quantity, unit in (units or {}).items()}
