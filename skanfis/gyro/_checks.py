"""Refusing a log that no compensator should learn from."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ._columns import CANONICAL, SIGNALS, convert, declared_units, plausible_units, units_of
from .errors import LogError

__all__ = [
    "LABELS",
    "LARGEST_AT_REST",
    "QUANTITIES",
    "check_at_rest",
    "check_finite",
    "check_label",
    "check_log",
]

QUANTITIES = ("time", "temperature", "output", "rate")
LABELS = ("run", "device")

_PLAUSIBLE = {
    "temperature": (-100.0, 200.0),  # degC, wider than any gyro is specified for
    "rate": (-20_000.0, 20_000.0),  # deg/s, beyond any rate table
    "output": (-20_000.0, 20_000.0),
}
_LONGEST_RUN = 31 * 86_400.0  # s
_FASTEST_CHANGE = 100.0  # degC/min over a whole run: no chamber does that
# Fewer tell neither a line in every input nor what is left of it; of a run, no way it goes.
_FEWEST_ROWS = 20
_FEWEST_ROWS_PER_RUN = 3
# At rest, the earth's rate included.
LARGEST_AT_REST = 0.1  # deg/s, with the noise of a rate table's encoder
_WIDEST_AT_REST = 10.0  # deg/s, a coarse gyro's bias from cold to hot
# Noise in 20 times its usual step is none; glitches are rare.
_JUMP, _FEWEST_JUMPS, _RARE = 20.0, 5, 2e-3
_LARGEST_SIGNAL = 1e30  # counts or volts, beyond any converter
_FOLLOWS = 0.9  # correlation of output with rate below which one of them is something else


def check_log(
    log: pd.DataFrame,
    *,
    inputs: Sequence[str] = ("temperature", "output"),
    units: dict[str, Any] | None = None,
    min_temperature_span: float = 10.0,
) -> pd.DataFrame:
    """Check that a log is fit for calibrating a compensator, and refuse it otherwise.

    Parameters
    ----------
    log : DataFrame of shape (n_rows, n_parts)
        As :func:`read_log` returns it. A column "run" tells power-ups apart; without it all rows
        are one run.
    inputs : sequence of str, default=("temperature", "output")
        What the compensator is to learn from: of "time", "temperature", "temperature_rate" and
        "output". They must change enough. Without any, the log is not to be learnt from, and its
        ranges do not matter.
    units : dict of str to str, default=None
        Units that the file was declared to be in, as for :func:`read_log`. They tell a raw signal
        from a rate, and serve the messages.
    min_temperature_span : float, default=10.0
        Smallest range of the temperature [degC], if it is an input.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        The same log.

    Raises
    ------
    LogError
        If values are missing, infinite or implausible in their unit; if time does not increase
        within a run; if the temperature's or the rate's range is too small; if the output does not
        follow the rate, or by a factor that tells of a wrong unit. The message names column and
        row, what was found, and what would do.

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
    if len(log) < (_FEWEST_ROWS if len(inputs) else 1):
        rows = "1 row is" if len(log) == 1 else f"{len(log)} rows are"
        raise LogError(f"{rows} too few; at least {_FEWEST_ROWS} are needed.")
    for part in QUANTITIES:
        if part in log:
            check_finite(log[part], part)
    for part in _PLAUSIBLE:
        if part in log and units[part] not in SIGNALS:
            _check_plausible(log[part].to_numpy(), part, units[part])
    if "output" in log and units["output"] in SIGNALS:
        _check_signal(log["output"].to_numpy(), units["output"])
    if "run" in log and len(inputs):
        _check_runs(log["run"])
    if "time" in log:
        _check_time(log, units["time"])
    if {"temperature", "temperature_rate"} & set(inputs):
        _check_temperature_span(log["temperature"], min_temperature_span)
    if "output" in inputs and "rate" in log:
        _check_output_follows_rate(log, units)
    return log


def check_at_rest(log, unit):
    """Refuse a log of a gyro that has turned; ``unit`` is that of the output.

    A raw signal, whose scale is not known, is told by its jumps alone, those of a rate table.
    """
    if "rate" in log:
        rate = log["rate"].to_numpy()
        row = int(np.argmax(np.abs(rate)))
        if abs(rate[row]) > LARGEST_AT_REST:
            raise LogError(f"{rate[row]:.4g} deg/s: the gyro was not at rest.", "rate", row)
    output = log["output"].to_numpy()
    if unit not in SIGNALS:
        low, high = np.quantile(output, [0.01, 0.99])
        if high - low > _WIDEST_AT_REST:
            raise LogError(
                f"spans {low:.4g} to {high:.4g} deg/s: no bias does, the gyro was not at rest.",
                "output",
            )
    steps = np.abs(np.diff(output))
    if "run" in log:
        run = log["run"].to_numpy()
        steps = steps[run[1:] == run[:-1]]
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


def check_finite(values, part):
    """LogError for the first value that is missing or infinite."""
    values = np.asarray(values)
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        kind = "is missing" if np.isnan(values[row]) else "is infinite"
        raise LogError(
            f"the value {kind} ({bad.sum()} such in {bad.size} rows); drop these rows.", part, row
        )


def check_label(bad, part):
    """LogError for the first row that has no label; ``bad`` is whether it has none."""
    if bad.any():
        raise LogError(f"no label ({bad.sum()} such rows).", part, int(np.argmax(bad)))


def _check_plausible(values, part, unit):
    low, high = _PLAUSIBLE[part]
    bad = (values < low) | (values > high)
    if bad.any():
        row = int(np.argmax(bad))
        others = plausible_units(values, part, unit, low, high)
        # More than half: the unit; few: glitches of the measurement.
        is_unit = others and bad.mean() > 0.5
        advice = (
            f"; is it in {' or '.join(others)}? Say so by units: {part}={others[0]}"
            if is_unit
            else ""
        )
        raise LogError(
            f"{values[row]:.1f} {CANONICAL[part]} is not plausible ({bad.sum()} of {bad.size} rows "
            f"are outside {low:g} to {high:g}){advice}.",
            part,
            row,
        )


def _check_signal(values, unit):
    largest = np.abs(values).max()
    if not 1.0 / _LARGEST_SIGNAL < largest < _LARGEST_SIGNAL:
        raise LogError(f"signals up to {largest:.3g} {unit} are not plausible.", "output")


def _check_runs(run):
    n_runs = run.nunique()
    if n_runs * _FEWEST_ROWS_PER_RUN > len(run):
        raise LogError(
            f"{n_runs} runs in {len(run)} rows are too many; is it a counter of rows? A run lasts "
            f"from one power-on to the next; at least {_FEWEST_ROWS_PER_RUN} rows of each are due.",
            "run",
        )


def _check_time(log, unit):
    time = log["time"].to_numpy()
    runs = log["run"] if "run" in log else pd.Series(np.zeros(len(log), dtype=int), log.index)
    by_run = log.groupby(runs.to_numpy(), observed=True)
    step = by_run["time"].diff().to_numpy()
    bad = step <= 0
    if bad.any():
        row = int(np.argmax(bad))
        cure = (
            "Rows must be in the order of time."
            if "run" in log
            else "If several runs follow each other, say which column tells them apart (run=NAME)."
        )
        raise LogError(
            f"time does not increase within a run: {time[row]:.10g} s after "
            f"{time[row] - step[row]:.10g} s ({bad.sum()} such rows). {cure}",
            "time",
            row,
        )
    spans = by_run[["time", "temperature"]].agg(["min", "max"])
    duration = (spans["time"]["max"] - spans["time"]["min"]).to_numpy()
    heating = (spans["temperature"]["max"] - spans["temperature"]["min"]).to_numpy()
    if duration.max() > _LONGEST_RUN:
        raise LogError(
            f"a run of {duration.max() / 86_400:.3g} days is not plausible; is time in a smaller "
            f"unit than {unit}?",
            "time",
        )
    fast = heating > _FASTEST_CHANGE / 60.0 * duration
    # A rest of a few rows may change by the thermometer's noise.
    fast &= heating > 5.0
    if fast.any():
        first = int(np.argmax(fast))
        raise LogError(
            f"the temperature changes by {heating[first]:.3g} degC within {duration[first]:.3g} s, "
            f"which is not plausible; is time in a larger unit than {unit}?",
            "time",
        )


def _check_temperature_span(temperature, least):
    low, high = temperature.min(), temperature.max()
    if high - low < least:
        raise LogError(
            f"the temperature spans {high - low:.3g} degC only ({low:.4g} to {high:.4g}); "
            f"at least {least:g} degC are needed to learn from it. Log over a wider range, or "
            "leave temperature and temperature_rate out of the inputs.",
            "temperature",
        )


def _check_output_follows_rate(log, units):
    output, rate = log["output"].to_numpy(), log["rate"].to_numpy()
    for part, values in (("rate", rate), ("output", output)):
        if values.max() == values.min():
            raise LogError(
                f"all values are {values[0]:g}; a scale factor cannot be learnt from a log at one "
                "rate. Log at several rates, or learn the bias alone: leave output out of the "
                "inputs.",
                part,
            )
    if np.array_equal(output, rate):
        raise LogError("equals the column of the rate: one of them is the wrong one.", "output")
    correlation = np.corrcoef(output, rate)[0, 1]
    if abs(correlation) < _FOLLOWS:
        raise LogError(
            f"does not follow the rate (correlation {correlation:.3f}); is it, or that of the "
            "rate, the wrong column?",
            "output",
        )
    slope = np.polyfit(rate, output, 1)[0]
    if units["output"] not in SIGNALS and not 0.5 < slope < 2.0:
        raise LogError(
            f"changes by {slope:.4g} deg/s per deg/s of rate: {_diagnosis(slope, units)} A raw "
            "signal with a scale factor of its own is declared as counts.",
            "output",
        )


def _diagnosis(slope, units):
    """What a slope far from 1 tells."""
    if -2.0 < slope < -0.5:
        return "its sign is reversed."
    found = []
    for part, power in (("output", 1), ("rate", -1)):
        for unit in units_of("rate"):
            ratio = convert(1.0, part, unit) / convert(1.0, part, units[part])
            if 0.7 < slope * ratio**power < 1.4:
                found.append(f"the {part} in {unit}")
    return f"is {' or '.join(found)}?" if found else "are the units right?"
