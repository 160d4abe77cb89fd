"""Checks that refuse a log unfit for calibration."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..digits import counted
from ._columns import CANONICAL, SECONDS, SIGNALS, convert, convert_back, declared_units, units_of
from ._oddities import (
    ALONE,
    FEWEST_ROWS,
    LEAST_CORRELATION,
    find_glitches,
    stretches_of,
    whole_delay,
)
from .errors import LogError

QUANTITIES = ("time", "temperature", "output", "rate")
LABELS = ("run", "device")
PARTS = (*QUANTITIES, *LABELS)

_PLAUSIBLE = {
    "temperature": (-100.0, 200.0),  # degC, wider than any gyro is specified for
    "rate": (-20_000.0, 20_000.0),  # deg/s, beyond any rate table
    "output": (-20_000.0, 20_000.0),
}
_LARGEST_SIGNAL = 1e30  # counts or volts, beyond any converter
_LONGEST_RUN = 31 * 86_400.0  # s
_FASTEST_CHANGE = 100.0 / 60.0  # degC/s over a whole run: no chamber does that
_LEAST_SPAN = 10.0  # degC, the least to learn from
_NOISE = 5.0  # degC by which a few rows may differ
_FEWEST_ROWS_PER_RUN = 3
LARGEST_AT_REST = 0.1  # deg/s, the earth's rate and the noise of a rate table's encoder included
_WIDEST_AT_REST = 10.0  # deg/s, a coarse gyro's bias from cold to hot
# Steps of 20 times the usual one are not noise; if they are not rare, they are not glitches.
_JUMP, _FEWEST_JUMPS, _RARE = 20.0, 5, 2e-3
# An output is saturated if at least this many rows have its largest or smallest value, at rates
# that differ by more than this part of their range.
_FEWEST_SATURATED, _SATURATED = 3, 0.02
# An output at rest is stuck if it keeps one value in so many rows on end, and noise turns back by
# two steps of its resolution in such a share of all: chance alone gives 15 rows at most in 400,000.
_FEWEST_AT_REST, _NOISY = 50, 0.2
# Placeholder in messages: if a file was read, ``LogFile.located`` puts in the column's name.
RATE_COLUMN = "column of the rate"


def check_log(
    log: pd.DataFrame,
    *,
    inputs: Sequence[str] = ("temperature", "output"),
    units: dict[str, Any] | None = None,
) -> pd.DataFrame:
    """Check that a log is fit for calibrating a compensator, and refuse it otherwise.

    Parameters
    ----------
    log : DataFrame of shape (n_rows, n_parts)
        As :func:`read_log` returns it. Without a column "run" all rows are one run.
    inputs : sequence of str, default=("temperature", "output")
        Of "time", "temperature", "temperature_rate" and "output"; they must change enough, the
        temperature by 10 degC.
    units : dict of str to str, default=None
        Units of the file, as for :func:`read_log`, which tell a raw signal from a rate.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        The same log.

    Raises
    ------
    LogError
        If a column of the inputs or a value is missing, a value is implausible, time does not
        increase within a run, a range is too small, or the output is stuck or off the rate.

    Examples
    --------
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import check_log
    >>> log = make_ofog(n_devices=1, n_runs=3, random_state=0).round({"temperature": 1})
    >>> check_log(log) is log
    True
    >>> check_log(log.assign(temperature=log["temperature"] + 273.15))
    Traceback (most recent call last):
        ...
    skanfis.gyro.errors.LogError: column 'temperature', row 0: ... degC is not plausible ...
    """
    units = CANONICAL | declared_units(units)
    if len(log) < FEWEST_ROWS:
        raise LogError(f"the log has {counted(len(log), 'row')}; it takes {FEWEST_ROWS}.")
    for part in columns_of(inputs):
        if part not in log:
            raise LogError(f"the log has no {part}.")
    for part in LABELS:
        if part in log:
            check_values(log[part], part)
    runs = log["run"] if "run" in log else np.zeros(len(log))
    check_rows(log, units, pd.factorize(runs)[0])
    n_runs = log["run"].nunique() if "run" in log else 1
    if n_runs * _FEWEST_ROWS_PER_RUN > len(log):
        raise LogError(
            f"{n_runs} runs in {len(log)} rows are too many; is it a counter of rows? A run lasts "
            f"from one power-on to the next; at least {_FEWEST_ROWS_PER_RUN} rows of each are due.",
            "run",
        )
    if {"temperature", "temperature_rate"} & set(inputs):
        low, high = log["temperature"].min(), log["temperature"].max()
        if high - low < _LEAST_SPAN:
            raise LogError(
                f"the temperature spans {high - low:.3g} degC only ({low:.4g} to {high:.4g}); "
                f"at least {_LEAST_SPAN:g} degC are needed to learn from it. Log over a "
                "wider range, or leave temperature and temperature_rate out of the inputs.",
                "temperature",
            )
    if "output" in inputs and "rate" in log:
        _check_output_follows_rate(log, units)
    if "output" in log and ("rate" not in log or log["rate"].nunique() == 1):
        _check_stuck_at_rest(log["output"].to_numpy())
    return log


def columns_of(inputs):
    """Columns of a log from which the inputs of a compensator are computed."""
    made = {"temperature_rate": ("time", "temperature")}
    return dict.fromkeys(part for name in inputs for part in made.get(name, (name,)))


def check_rows(log, units, runs, may_lack=()):
    """Raise LogError for the first bad row; ``runs`` has the number of each row's run."""
    for part in QUANTITIES:
        if part not in log:
            continue
        check_values(log[part], part, part in may_lack)
        if part in _PLAUSIBLE and units[part] not in SIGNALS:
            _check_plausible(log[part].to_numpy(), part, units[part])
    if "output" in log and units["output"] in SIGNALS:
        largest = np.abs(log["output"]).max()
        if not 1.0 / _LARGEST_SIGNAL < largest < _LARGEST_SIGNAL:
            raise LogError(
                f"signals up to {largest:.3g} {units['output']} are not plausible.", "output"
            )
    if "time" in log:
        _check_time(log, units["time"], runs)


def _check_time(log, unit, runs):
    by_run = log.groupby(runs)
    time, before = log["time"].to_numpy(), by_run["time"].shift().to_numpy()
    bad = np.flatnonzero(time <= before)
    if bad.size:
        row = int(bad[0])
        name = f"run {str(log['run'].iloc[row])!r}" if "run" in log else "a run"
        raise LogError(
            f"time does not increase within {name}: {time[row]:.13g} s after {before[row]:.13g} s "
            f"({counted(bad.size, 'such row')}). Rows must be in the order of time, each with a "
            "time of its own. Runs that follow each other, also if a counter begins again between "
            "them, need different labels in a column. If none was found, add one, or say which "
            "column tells them apart (run=NAME).",
            "time",
            row,
        )
    duration = by_run["time"].last() - by_run["time"].first()
    if duration.max() > _LONGEST_RUN:
        raise LogError(
            f"a run of {duration.max() / 86_400:.3g} days is not plausible; is time in a "
            f"smaller unit than {unit}?",
            "time",
        )
    if "temperature" not in log:
        return
    heating = by_run["temperature"].max() - by_run["temperature"].min()
    fast = (heating > _FASTEST_CHANGE * duration) & (heating > _NOISE)
    if fast.any():
        first = fast.idxmax()
        raise LogError(
            f"the temperature changes by {heating[first]:.3g} degC within "
            f"{duration[first]:.3g} s, which is not plausible; is time in a larger unit than "
            f"{unit}?",
            "time",
        )


def check_at_rest(log, unit):
    """Refuse a log of a gyro that has turned; ``unit`` is that of the output.

    The scale of a raw signal is not known: only the jumps of a rate table show that it turned.
    """
    if "rate" in log:
        rate = log["rate"].to_numpy()
        row = int(np.argmax(np.abs(rate)))
        if abs(rate[row]) > LARGEST_AT_REST:
            raise LogError(f"{rate[row]:.4g} deg/s: the gyro was not at rest.", "rate", row)
    output = log["output"].to_numpy()
    if np.ptp(output) == 0.0:
        raise LogError(f"is {output[0]:g} throughout: no gyro gives that.", "output")
    if unit not in SIGNALS:
        low, high = np.quantile(output, [0.01, 0.99])
        if high - low > _WIDEST_AT_REST:
            raise LogError(
                f"spans {low:.4g} to {high:.4g} deg/s: no bias does, the gyro was not at rest.",
                "output",
            )
    runs = log["run"].to_numpy() if "run" in log else np.zeros(len(log))
    steps = log["output"].groupby(runs).diff().dropna().abs().to_numpy()
    if not steps.any():
        return
    usual = max(np.median(steps), steps[steps > 0.0].min())
    jumps = np.count_nonzero(steps > _JUMP * usual)
    if jumps > max(_FEWEST_JUMPS, _RARE * steps.size):
        raise LogError(
            f"jumps {jumps} times by more than {_JUMP:g} times its usual step: the gyro was not at "
            "rest, or moved from level to level.",
            "output",
        )


def check_values(values, part, allow_missing=False):
    """Raise LogError for the first value of a part that is missing or infinite, or no number."""
    if part not in LABELS and not pd.api.types.is_numeric_dtype(values):
        advice = f" {SECONDS}" if part == "time" else ""
        raise LogError(f"is of type {values.dtype}; it must hold numbers.{advice}", part)
    values = np.asarray(values)
    missing = np.asarray(pd.isna(values))
    bad = np.zeros_like(missing) if allow_missing else missing
    if part not in LABELS:
        bad = bad | np.isinf(values)
    if not bad.any():
        return
    row = int(np.argmax(bad))
    if part in LABELS:
        rows = counted(bad.sum(), "such row")
        raise LogError(f"the label is missing ({rows}); fill it in.", part, row)
    kind = "is missing" if missing[row] else "is infinite"
    raise LogError(f"the value {kind} ({bad.sum()} of {bad.size} rows); drop them.", part, row)


def _check_plausible(values, part, unit):
    low, high = _PLAUSIBLE[part]
    bad = (values < low) | (values > high)
    if not bad.any():
        return
    advice = "; leave cells that hold no value empty"
    ends = convert_back(np.array([values.min(), values.max()]), unit)
    ranges = {other: convert(ends, other) for other in units_of(part) if other not in SIGNALS}
    others = [other for other, (least, most) in ranges.items() if low <= least and most <= high]
    # If more than half are implausible, the unit is wrong; if few are, they are glitches.
    if others and bad.mean() > 0.5:
        advice = f"; is it in {' or '.join(others)}? Say so by units: {part}={others[0]}"
    row = int(np.argmax(bad))
    told = f"{values[row]:.1f} {CANONICAL[part]}"
    told += "" if unit == CANONICAL[part] else f" ({convert_back(values[row], unit):g} in {unit})"
    raise LogError(
        f"{told} is not plausible ({bad.sum()} of {bad.size} rows outside {low:g} to "
        f"{high:g}){advice}.",
        part,
        row,
    )


def _check_output_follows_rate(log, units):
    output, rate = log["output"].to_numpy(), log["rate"].to_numpy()
    several = "Log at several rates"
    # At any other rate than zero the scale factor error would be learnt as bias.
    several += ", or learn the bias: leave output out of the inputs." if not rate.any() else "."
    other = "Is another column the gyro's (--columns output=NAME)?"
    for part, values, advice in (("rate", rate, several), ("output", output, other)):
        if values.max() == values.min():
            told = f"all values are {values[0]:g}, which tells no scale factor. {advice}"
            raise LogError(told, part)
    if np.array_equal(output, rate):
        raise LogError(f"equals the {RATE_COLUMN}: one of them is not that.", "output")
    _check_stuck(output, rate)
    correlation = np.corrcoef(output, rate)[0, 1]
    if abs(correlation) < LEAST_CORRELATION:
        glitches = dict(find_glitches(log, output)) if "temperature" in log else {}
        more = f" No other row supports {', '.join(glitches.values())}." if glitches else ""
        if late := whole_delay(output, rate):
            rows = f"{counted(abs(late), 'row')} {'before' if late > 0 else 'after'}"
            more = f" It follows that of {rows}: align the columns."
        raise LogError(
            f"does not follow the rate (correlation {correlation:.3f}); is it, or the "
            f"{RATE_COLUMN}, the wrong one?{more}",
            "output",
            next(iter(glitches), None),
        )
    _check_saturation(output, rate)
    slope = np.polyfit(rate, output, 1)[0]
    if units["output"] in SIGNALS or 0.5 < slope < 2.0:
        return
    # A slope far from 1 shows a reversed sign or a wrong unit.
    told = "its sign is reversed." if -2.0 < slope < -0.5 else "are the units right?"
    for part, power in (("rate", -1), ("output", 1)):
        for unit in units_of("rate"):
            ratio = convert(1.0, unit) / convert(1.0, units[part])
            if 0.7 < slope * ratio**power < 1.4:
                told = f"is the {part} in {unit}?"
    raise LogError(
        f"changes by {slope:.4g} deg/s per deg/s of rate: {told} If it is a raw signal, say so "
        "(units: output=counts): then its scale factor and sign are found.",
        "output",
    )


def _check_saturation(output, rate):
    """Raise LogError if the output stays at its largest or smallest while the rate changes.

    At one rate of a table it is saturated if it has no noise there, and noise at all others.
    """
    ends = [np.flatnonzero(output == value) for value in (output.min(), output.max())]
    _check_standing(output, rate, ends, "rows", "saturated")
    order = np.argsort(rate, kind="stable")
    starts, lengths = stretches_of(output[order])
    if not _is_noisy(output[order[lengths[0] : -lengths[-1]]]):
        return
    for place, is_away in ((0, rate.min() < 0.0), (-1, rate.max() > 0.0)):
        if is_away and lengths[place] > max(FEWEST_ROWS, ALONE * lengths[1:-1].max()):
            row = int(order[starts[place]])
            told = f"stands at {output[row]:.6g} in {lengths[place]} rows at {rate[row]:.4g} deg/s,"
            reason = f"{told} and has noise at other rates: it is saturated. Leave these rows out."
            raise LogError(reason, "output", row)


def _check_stuck(output, rate):
    """Raise LogError if the output keeps one value, row after row, while the rate changes.

    Its largest and smallest value do not count: there it is saturated, or not the gyro's column.
    """
    starts, lengths = stretches_of(output)
    is_between = (output.min() < output[starts]) & (output[starts] < output.max())
    long = (lengths >= FEWEST_ROWS) & is_between
    stretches = map(np.arange, starts[long], (starts + lengths)[long])
    _check_standing(output, rate, stretches, "rows on end", "stuck")


def _check_stuck_at_rest(output):
    """Raise LogError if the output keeps one value, row after row, and its noise is far larger."""
    starts, lengths = stretches_of(output)
    row, n_rows = int(starts[lengths.argmax()]), lengths.max()
    if n_rows >= _FEWEST_AT_REST and _is_noisy(output):
        told = f"stands at {output[row]:.6g} in {n_rows} rows on end, and has noise in "
        raise LogError(f"{told}the others: it is stuck. Leave these rows out.", "output", row)


def _is_noisy(output):
    """Whether noise turns back by two steps of the output's resolution in many rows."""
    steps = np.diff(output)
    smallest = np.abs(steps[steps != 0.0]).min(initial=np.inf)
    is_noise = (steps[1:] * steps[:-1] < 0.0) & (np.abs(steps[1:]) > 1.5 * smallest)
    return is_noise.sum() > _NOISY * is_noise.size


def _check_standing(output, rate, places, rows, what):
    # One output may belong to a range of rates, by its resolution and by noise.
    step = np.ptp(rate) * max(_SATURATED, 3.0 / np.unique(output).size)
    for at in places:
        low, high = rate[at].min(), rate[at].max()
        if at.size >= _FEWEST_SATURATED and high - low > step:
            told = f"stands at {output[at[0]]:.6g} in {at.size} {rows}, at rates from {low:.4g}"
            reason = f"{told} to {high:.4g} deg/s: it is {what}. Leave these rows out."
            raise LogError(reason, "output", int(at[0]))
