"""Limits of a specification, as they are typed, and whether a figure of merit keeps them.

bias=5deg/h             the size of the bias is at most 5 deg/h
bias=-2:5deg/h          it lies from -2 to 5 deg/h
reduction_factor=10     it is 10 or more: of this figure more is better
residual_rms=:0.01deg/s it is at most 0.01 deg/s
"""

import math
import re
from dataclasses import dataclass, replace

from ._columns import RATE_UNITS, in_rate_unit, rate_unit_of
from ._figures_of_merit import figures_of_merit

__all__ = ["Limit", "parse_limit"]

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FORM = re.compile(rf"(?P<low>{_NUMBER})?(?P<colon>:)?(?P<high>{_NUMBER})?(?P<unit>[^\d.:+-].*)?")
_SPELLINGS = (("°C", "degC"), ("°", "deg"), ("√h", "sqrt(h)"))
# Of these more is better.
_AT_LEAST = ("reduction_factor",)


@dataclass(frozen=True)
class Limit:
    """From ``low`` to ``high``, both kept; ``text`` is what was typed, ``unit`` that of both."""

    figure: str
    low: float
    high: float
    unit: str
    text: str

    def keeps(self, value):
        """Whether a value in the limit's unit keeps it."""
        return bool(self.low <= value <= self.high)

    def in_unit(self, unit):
        """The same limit in another unit, of rates where this is one."""
        wanted = rate_unit_of(unit)
        factor = 1.0 if wanted is None else in_rate_unit(self.unit, wanted)[1]
        return replace(self, low=factor * self.low, high=factor * self.high, unit=unit)


def parse_limit(text):
    """A limit such as ``bias=5deg/h``; ValueError where it is none."""
    figure, equals, typed = text.partition("=")
    if not equals or figure not in _UNITS:
        raise ValueError(
            f"{text!r} must be FIGURE=LIMIT, with a figure of merit of: {', '.join(_UNITS)}."
        )
    found = _FORM.fullmatch(typed.strip())
    if found is None or (found["low"] is None and found["high"] is None):
        raise ValueError(
            f"{text!r}: {typed!r} must be a number, or LOW:HIGH of which one may be missing, and a "
            f"unit, as in {figure}=-2:5{_UNITS[figure]}."
        )
    low, high = _ends(text, figure, found)
    return Limit(figure, low, high, _unit(text, figure, found["unit"]), typed.strip())


def _ends(text, figure, found):
    low = -math.inf if found["low"] is None else float(found["low"])
    high = math.inf if found["high"] is None else float(found["high"])
    if found["colon"]:
        if not low <= high:
            raise ValueError(f"{text!r}: the lower limit {low:g} is above the upper one, {high:g}.")
        return low, high
    if found["high"] is not None:
        raise ValueError(f"{text!r}: two numbers need a colon between them, as in -2:5.")
    if low < 0:
        raise ValueError(f"{text!r}: one number limits the size, and must be zero or positive.")
    return (low, math.inf) if figure in _AT_LEAST else (-low, low)


def _unit(text, figure, typed):
    usual = _UNITS[figure]
    typed = "" if typed is None else typed.strip()
    for sign, name in _SPELLINGS:
        typed = typed.replace(sign, name)
    is_rate = rate_unit_of(usual) is not None
    known = [in_rate_unit(usual, name)[0] for name in RATE_UNITS] if is_rate else [usual, ""]
    if usual.startswith("ppm"):
        known.append(usual.partition(" ")[0])
    if typed not in known:
        wanted = " or ".join(filter(None, known))
        raise ValueError(
            f"{text!r}: {figure} is in {wanted}; found {typed!r}."
            if wanted
            else f"{text!r}: {figure} has no unit; found {typed!r}."
        )
    return typed if is_rate else usual


_UNITS = {
    figure.name: figure.unit
    for figure in figures_of_merit(1.0, 1.0, averaging_times=(10.0, 100.0), allan=True)
}
