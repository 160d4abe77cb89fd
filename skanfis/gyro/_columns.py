"""Columns and their units: checks of columns and numbers, and units with their spellings.

A log is in s, degC and deg/s. A raw signal (counts, volts) keeps its unit.
"""

import math

import numpy as np

from ..export.folding import final_step

SECONDS = "Give times as numbers of seconds."
# For each unit: its factor to the canonical unit, and spellings in lower case without blanks.
_TABLE = {
    "time": {
        "s": (1.0, "sec secs second seconds"),
        "ms": (1e-3, "msec millis millisecond milliseconds"),
        "us": (1e-6, "µs μs usec micros microsecond microseconds"),
        "ns": (1e-9, "nsec nanos nanosecond nanoseconds"),
        "min": (60.0, "minute minutes"),
        "h": (3600.0, "hr hrs hour hours"),
    },
    "temperature": {
        "degC": (1.0, "°c ℃ c celsius deg_c cel"),
        "K": (1.0, "kelvin degk °k"),
        "degF": (5.0 / 9.0, "°f ℉ f fahrenheit deg_f"),
    },
    "rate": {
        "deg/s": (
            1.0,
            "°/s dps deg_s degps deg/sec °/sec deg_sec degs deg_per_s deg_per_sec °_per_s °_s",
        ),
        "deg/h": (
            1 / 3600.0,
            "°/h dph deg_h deg/hr °/hr deg_hr degph deg_per_h deg_per_hr deg/hour",
        ),
        "rad/s": (180.0 / math.pi, "rad_s rads radps rad/sec rad_sec rad_per_s"),
        "mdeg/s": (1e-3, "mdps mdeg_s mdegps"),
        "mrad/s": (0.18 / math.pi, "mrad_s mradps"),
        "rpm": (6.0, ""),
    },
    "signal": {
        "counts": (1.0, "count cnts cnt lsb lsbs digits raw adc codes"),
        "V": (1.0, "volt volts"),
        "mV": (1.0, "millivolt millivolts"),
    },
}
_MEANT = {
    spelling: (quantity, unit)
    for quantity, units in _TABLE.items()
    for unit, (_, spellings) in units.items()
    for spelling in (unit.casefold(), *spellings.split())
}
_FACTORS = {unit: factor for units in _TABLE.values() for unit, (factor, _) in units.items()}
SIGNALS = tuple(_TABLE["signal"])
_ZERO = {"K": -273.15, "degF": -160.0 / 9.0}  # zero of each scale, in degC
CANONICAL = {"time": "s", "temperature": "degC", "rate": "deg/s", "output": "deg/s"}
PER_HOUR = 3600.0  # 1 deg/s in deg/h
RATE_UNITS = {"deg/s": 1.0, "deg/h": PER_HOUR}  # of each in 1 deg/s


def unit_in(text):
    """Quantity and unit that a text names, or None."""
    return _MEANT.get("".join(text.split()).casefold())


def units_of(quantity):
    return (*_TABLE["rate"], *SIGNALS) if quantity == "output" else tuple(_TABLE[quantity])


def convert(values, unit):
    """Convert values to the canonical unit; a raw signal stays as it is."""
    return values * _FACTORS[unit] + _ZERO.get(unit, 0.0)


def convert_back(values, unit):
    return (values - _ZERO.get(unit, 0.0)) / _FACTORS[unit]


def declared_units(units):
    """``units`` with the usual name of each unit; ValueError if there is no such unit."""
    found = {}
    for quantity, name in (units or {}).items():
        if quantity not in CANONICAL:
            known = ", ".join(CANONICAL)
            raise ValueError(f"units: there is no {quantity!r}; it may be one of {known}.")
        found[quantity] = (unit_in(str(name)) or (None, name))[1]
        if not isinstance(name, str) or found[quantity] not in units_of(quantity):
            known = ", ".join(units_of(quantity))
            raise ValueError(f"{quantity} has no unit {name!r}: it may be in {known}.")
    return found


def rate_unit_of(unit):
    """The unit of rate that a unit such as "deg/h/degC" begins with, or None."""
    return next((rate for rate in RATE_UNITS if unit == rate or unit.startswith(f"{rate}/")), None)


def in_rate_unit(unit, wanted):
    """A unit such as "deg/h/degC" with the wanted unit of rate, and the factor to convert to it."""
    own = rate_unit_of(unit)
    if own is None:
        return unit, 1.0
    return wanted + unit.removeprefix(own), RATE_UNITS[wanted] / RATE_UNITS[own]


def check_column(values, name, n_rows=None, *, may_lack=False) -> np.ndarray:
    """``values`` as a float array of shape (n_rows,), or ValueError; ``may_lack`` admits NaN."""
    if getattr(getattr(values, "dtype", None), "kind", "") in ("m", "M"):
        raise ValueError(f"{name} must hold numbers, not {values.dtype}. {SECONDS}")
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must hold numbers: {error}.") from error
    column = check_labels(numbers, name, n_rows)
    bad = np.isinf(column) if may_lack else ~np.isfinite(column)
    if bad.any():
        raise ValueError(
            f"{name} must be finite; {bad.sum()} of its {column.size} values are not, the first at "
            f"row {bad.argmax()}. Drop these rows in all columns."
        )
    return column


def check_labels(values, name, n_rows) -> np.ndarray:
    """``values`` as an array of shape (n_rows,) of whatever type, or ValueError."""
    column = np.asarray(values)
    if column.ndim != 1:
        raise ValueError(f"{name} must have one dimension; its shape is {column.shape}.")
    if column.size == 0:
        raise ValueError(f"{name} is empty.")
    if n_rows is not None and column.size != n_rows:
        raise ValueError(f"{name} has {column.size} rows where the other columns have {n_rows}.")
    return column


def column_position(names, role, given) -> int:
    """Position of a column given by position or name; ``names`` are those of X, or positions."""
    places = range(-len(names), len(names))
    is_place = isinstance(given, int | np.integer) and not isinstance(given, bool)
    if given not in (places if is_place else [name for name in names if isinstance(name, str)]):
        named = f": {names}" if any(isinstance(name, str) for name in names) else ""
        raise ValueError(
            f"{role}={given!r} is no column of X, which has {len(names)} feature(s){named}."
        )
    return int(given) % len(names) if is_place else names.index(given)


def evenly_chosen(n_rows, most) -> np.ndarray:
    """At most ``most`` evenly spaced positions of rows, with the first and the last."""
    return np.unique(np.linspace(0, n_rows - 1, min(n_rows, most)).astype(int))


def ask(estimator, method, X):
    """``estimator.method(X)``; for a Pipeline, of its last step, on X as transformed before it."""
    final, X = final_step(estimator, X)
    if not hasattr(final, method):
        raise ValueError(f"{type(final).__name__} has no method {method!r}.")
    return getattr(final, method)(X)
