"""Units that are a rate, or a rate per something: deg/s, deg/h/degC; not deg/sqrt(h)."""

__all__ = ["PER_HOUR", "RATE_UNITS", "in_rate_unit", "rate_unit_of"]

PER_HOUR = 3600.0  # 1 deg/s in deg/h
RATE_UNITS = {"deg/s": 1.0, "deg/h": PER_HOUR}  # of each in 1 deg/s


def rate_unit_of(unit):
    """The rate that a unit begins with, or None."""
    return next((rate for rate in RATE_UNITS if unit == rate or unit.startswith(f"{rate}/")), None)


def in_rate_unit(unit, wanted):
    """The unit with its rate as wanted, and what values are multiplied by; as it is without one."""
    own = rate_unit_of(unit)
    if own is None:
        return unit, 1.0
    return wanted + unit.removeprefix(own), RATE_UNITS[wanted] / RATE_UNITS[own]
