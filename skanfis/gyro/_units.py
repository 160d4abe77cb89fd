"""Find the units that no name gives, from the values, if only one reading is plausible.

The evidence: how warm a chamber gets, and that a log reaches room temperature; the full scales of
gyros; the earth's rate; levels of a rate table, which are round numbers in its own unit; how fast a
chamber heats; and that the output of a gyro, if it is a rate, changes as the true rate does.
"""

import numpy as np

from ..digits import range_in_digits
from ._columns import CANONICAL, SIGNALS, convert, convert_back, units_of
from .errors import UsageError

_NO_TEMPERATURE = 500.0  # marks of no value, such as 9999, are beyond it in any unit
_COLDEST_IN_KELVIN = 150.0  # no log in degrees is above it throughout
# A log always above the first, or reaching the second, may be in degF; beyond the third it is.
_WARM, _HOT, _HOTTEST = 30.0, 86.0, 130.0
_SINCE_1970 = 9e8, 4.1e9  # s, of clocks that tell a date from 1998 to 2099
_STEPS = 1e-4, 600.0  # s, from one row to the next
_HEATING = 5e-4, 60.0  # degC/min over a run: the range in which a time may be in s
_CHAMBER = 0.02, 60.0  # the same for other units: as fast as a chamber or a warm-up heats
_FAST = 10.0  # degC/min if in s, beyond which it may be in min or h: hardly any chamber is as fast
_LEAST_HEATING = 1.0  # degC; less heating tells nothing
_SMALLEST_SCALE, _LARGEST_SCALE = 1.0, 2_200.0  # deg/s: the largest rate of a log that turns
_LARGEST_BIAS = 20.0  # deg/s
_EARTH_RATE = 15.041 / 3600.0  # deg/s
_RATES = ("deg/s", "rad/s", "deg/h")
_LARGEST_RATE = 1000  # larger whole numbers at rest are taken for counts
_MOST_LEVELS, _ROUND = 100, 0.5  # most levels of a rate table; their step, in its unit
_AS_THE_RATE = 0.7, 1.4  # slope of an output that is a rate


def settle_units(values, units, *, is_all=True):
    """Find the units of the parts that ``units`` lacks, from the values of all (NaN: missing).

    If several readings are plausible, UsageError gives the options to copy; unless ``is_all`` is
    false, when later values may still decide, and the first reading is returned.
    """
    heat = values.get("temperature", np.empty(0))
    values = values | {"temperature": np.where(np.abs(heat) < _NO_TEMPERATURE, heat, np.nan)}
    values = {part: column for part, column in values.items() if np.isfinite(column).any()}
    readings: list[dict] = [{}]
    for part, find in (("temperature", _of_temperature), ("time", _of_time)):
        if part in values and part not in units:
            ways = find(values, units)
            readings = [known | {part: unit} for known in readings for unit in ways]
    readings = [known | more for known in readings for more in _of_rates(values, units)]
    # More values would not help for the time: its unit is found from the first run.
    if len(readings) > 1 and (is_all or len({each.get("time") for each in readings}) > 1):
        raise UsageError(_question(values, readings))
    return readings[0]


def settle_by_all(log, layout):
    """What :func:`settle_units` finds by all rows of a log that was read in this layout."""
    units = layout.units
    parts = [part for part in ("temperature", "output", "rate") if part in log]
    values = {part: convert_back(log[part].to_numpy(), units[part]) for part in parts}
    told = {part: units[part] for part in units if part == "time" or part not in layout.assumed}
    return settle_units(values, told)


def assumed_text(values, part, layout):
    """The assumed unit of a part in words, with its range and another unit; values as in a log."""
    name, unit = layout.name(part), layout.units[part]
    values = convert_back(np.array([values.min(), values.max()]), unit)
    if unit in SIGNALS:
        return f"{name!r} has no unit, taken as a raw signal ({_range(values)})"
    other = {"temperature": "degF", "time": "ms"}.get(part, "rad/s")
    other = CANONICAL[part] if unit in (other, "deg/h") else other
    return (
        f"{name!r} has no unit, taken as {unit} ({_range(values)}; {other}? give --units "
        f"{part}={other})"
    )


def _range(values):
    return range_in_digits(np.nanmin(values), np.nanmax(values), 4) if values.size else "no values"


def _question(values, readings):
    parts = [part for part in readings[0] if len({each[part] for each in readings}) > 1]
    told = []
    for part in parts:
        ways = dict.fromkeys(each[part] for each in readings)
        shown = " or ".join(
            unit if unit in SIGNALS else
            f"{unit} ({_range(convert(values[part], unit))} {CANONICAL[part]})"
            for unit in ways
        )  # fmt: skip
        told.append(f"{part}, {_range(values[part])}, may be in {shown}")
    options = [" ".join(f"{part}={each[part]}" for part in parts) for each in readings]
    return (
        f"units: the file names none, and the values leave it open: {'; '.join(told)}. Nothing was "
        f"written. Say which: --units {' or --units '.join(options)}"
    )


def _of_temperature(values, units):
    low, high = np.nanquantile(values["temperature"], [0.001, 0.999])  # without glitches
    if low > _COLDEST_IN_KELVIN:
        return ["K"]
    if high > _HOTTEST:
        return ["degF"]
    return ["degC"] if low <= _WARM and high < _HOT else ["degC", "degF"]


def _of_time(values, units):
    known = np.isfinite(values["time"])
    time = values["time"][known]
    heat = values.get("temperature", np.zeros(known.size))[known]
    for unit in ("s", "ms", "us", "ns"):
        if _SINCE_1970[0] < convert(time.min(), unit) < _SINCE_1970[1]:
            return [unit]
    if time.size > 1 and np.median(np.diff(time)) < 0.0:  # the last row comes first
        time, heat = time[::-1], heat[::-1]
    steps = np.diff(time)
    # Only the first run, if the clock restarts after it; a few rows are a glitch, not a run.
    ends = np.flatnonzero(steps < 0.0)
    end = ends[0] + 1 if ends.size and ends[0] > 10 else time.size
    if not (steps > 0.0).any() or not np.isfinite(heat[:end]).any():
        return ["s"]
    degrees = convert(heat[:end], units.get("temperature", "degC"))
    heating = np.nanmax(degrees) - np.nanmin(degrees)
    step, duration = np.median(steps[steps > 0.0]), max(np.ptp(time[:end]), 1e-300)

    def is_plausible(unit, heat_limits):
        second = convert(1.0, unit)
        per_minute = 60.0 * heating / (second * duration)
        fits = heating < _LEAST_HEATING or heat_limits[0] <= per_minute <= heat_limits[1]
        return fits and _STEPS[0] <= step * second <= _STEPS[1]

    ways = ["s"] if is_plausible("s", _HEATING) else []
    if heating >= _LEAST_HEATING:
        is_fast = 60.0 * heating > _FAST * duration
        others = ["ms", "us", "ns"] + ["min", "h"] * int(is_fast)
        ways += [unit for unit in others if is_plausible(unit, _CHAMBER)]
    return ways or ["s"]


def _of_rates(values, units):
    """Units of the output and the rate; if the gyro turns, each is evidence for the other."""
    output, rate = (values.get(part, np.empty(0)) for part in ("output", "rate"))
    own, true = units.get("output"), units.get("rate")
    lacking = [part for part in ("output", "rate") if part in values and part not in units]
    if not lacking:
        return [{}]
    known = np.isfinite(output) & np.isfinite(rate) if output.size and rate.size else []
    turns = np.any(known) and np.ptp(rate[known]) > 0.0
    rates = [true] if true else _of_rate(rate)
    if not output.size or own in SIGNALS or not turns:
        outputs = [own] if own or not output.size else _of_rest(output)
        pairs = [(each, other) for each in outputs for other in rates]
    else:
        slope = abs(np.polyfit(rate[known], output[known], 1)[0])
        outputs = [own] if own else units_of("rate") if true else _RATES
        ways, size = rates, np.abs(rate[known]).max()
        if own and not true:
            ways = [each for each in units_of("rate") if convert(size, each) <= _LARGEST_SCALE]
        pairs = [
            (each, other)
            for each in outputs
            for other in ways
            if _AS_THE_RATE[0] < slope * convert(1.0, each) / convert(1.0, other) < _AS_THE_RATE[1]
        ]
        pairs = pairs or [(own or "counts", other) for other in rates]
    readings = [{"output": each, "rate": other} for each, other in pairs]
    return [{part: reading[part] for part in lacking} for reading in readings]


def _of_rate(rate):
    """Plausible units of a true rate."""
    size = np.nanmax(np.abs(rate)) if rate.size else 0.0
    if size == 0.0:
        return ["deg/s"]
    sizes = {unit: convert(size, unit) for unit in _RATES}
    earth = [unit for unit in _RATES if abs(sizes[unit] / _EARTH_RATE - 1.0) < 0.02]
    ways = [unit for unit in _RATES if _SMALLEST_SCALE <= sizes[unit] <= _LARGEST_SCALE]
    levels = np.unique(np.abs(rate[np.isfinite(rate)]).round(9))
    if len(ways) > 1 and 3 <= levels.size <= _MOST_LEVELS and 3 * levels.size <= rate.size:
        ways = [unit for unit in ways if _are_round(convert(levels, unit))] or ways
    return earth or ways or ["deg/s"]


def _are_round(levels):
    off = np.abs(levels - _ROUND * np.round(levels / _ROUND))
    return bool((off < 2e-3 + 2e-5 * levels).all())


def _of_rest(output):
    """Plausible units of the output of a gyro at rest."""
    found = output[np.isfinite(output)]
    size = np.abs(found).max(initial=0.0)
    is_whole = found.size > 0 and not (found % 1.0).any()
    if is_whole and size > _LARGEST_RATE:
        return ["counts"]
    ways = ["deg/s"] if size <= _LARGEST_BIAS else []
    ways += ["rad/s"] if convert(size, "rad/s") <= _LARGEST_BIAS else []
    ways += ["deg/h"] if size >= 1.0 else []
    return ways + (["counts"] if is_whole else [])
