"""The logs of a calibration as the command reads them: axes, rest, checks in the file's words."""

from dataclasses import dataclass

import numpy as np

from ._checks import LARGEST_AT_REST, check_at_rest, check_log
from ._columns import SIGNALS
from ._console import UsageError, check_device, pairs, usage_errors
from ._layout import Request
from ._table import LogFile
from ._thinned import read_thinned
from .compensator import INPUTS
from .errors import LogError
from .log import checked_request, read

__all__ = ["Task", "find_tasks", "read_task", "request_of"]


@dataclass(frozen=True)
class Task:
    """One axis to calibrate: its letter, and what its columns are called where that is settled."""

    axis: str = ""
    columns: dict | None = None
    is_guessed: bool = False


def find_tasks(options, paths):
    """The axes that are asked for, or else those of the first file's columns; at least one."""
    columns = pairs(options.columns, "--columns")
    if options.axes is None and "output" in columns:
        return [Task()]
    told = dict(text.partition("=")[::2] for text in options.axes or ())
    if options.axes is not None and len(told) < len(options.axes):
        raise UsageError("--axes: an axis is given twice.")
    with usage_errors():
        layout = LogFile.open(paths[0], request_of(options, ())).layout
    found = layout.axes
    tasks = []
    for axis, name in (told or dict.fromkeys(found, "")).items():
        own = found.get(axis, (None, None))
        if not name and own[0] is None:
            known = f"; found were {', '.join(found)}" if found else ""
            raise UsageError(
                f"--axes {axis}: no column for the output of this axis is found{known}. Say which "
                f"it is: {axis}=NAME."
            )
        settled = {"output": name or own[0]}
        if own[1] is not None and "rate" not in columns:
            settled["rate"] = own[1]
        tasks.append(Task(axis, settled, is_guessed=not told))
    return tasks if len(tasks) > 1 or told else [Task()]


def request_of(options, require, columns=None):
    request = Request(
        columns=pairs(options.columns, "--columns") | (columns or {}),
        units=pairs(options.units, "--units"),
        require=tuple(require),
        separator=options.separator,
        decimal=options.decimal,
        encoding=options.encoding,
        guess=True,
        drop_missing=options.missing == "drop",
        average=options.average,
    )
    with usage_errors():  # an unknown part or unit
        return checked_request(request)


def read_task(options, paths, task, tell):
    """The checked log of one axis; returns its reading and the inputs.

    What was found out is told. Of too many rows to be held, some are.
    """
    required = ["temperature", "output"]
    if {"time", "temperature_rate"} & set(options.inputs or ()) or options.average is not None:
        required.append("time")
    with usage_errors():  # characters that do not go together
        request = request_of(options, required, task.columns)
        max_gap, most_rows = options.max_gap, options.check_rows
        reading = read(paths, request, max_gap=max_gap, tell=tell, most_rows=most_rows)
        if reading is None:
            tell(f"more than {most_rows:,} rows: not all are held")
            reading = read_thinned(
                paths,
                request,
                max_gap=max_gap,
                most_rows=most_rows,
                time_constant=options.time_constant,
                tell=tell,
                device=options.device,
            )
        elif options.device is not None:
            labels = reading.log.get("device")
            check_device(options.device, None if labels is None else list(labels.cat.categories))
            reading = reading.of_device(options.device)
    for note in reading.notes:
        tell(f"note: {note}")
    tell(f"{reading.n_rows:,} rows{_counts(reading.log)}")
    try:
        at_rest = _settle_rest(options, reading, tell)
        inputs = tuple(options.inputs or _default_inputs(reading.log, at_rest))
        _check_options(options, inputs, reading.units["output"], at_rest)
        check_log(
            reading.log,
            units=reading.units,
            inputs=inputs,
            min_temperature_span=options.min_temperature_span,
        )
    except LogError as error:
        raise reading.located(error) from error
    return reading, inputs


def _settle_rest(options, reading, tell):
    """Whether the gyro was at rest, as told or as found; the log then has a rate of zero."""
    log, unit = reading.log, reading.units["output"]
    has_rate = "rate" in log
    still = has_rate and np.abs(log["rate"]).max() <= LARGEST_AT_REST
    if not options.at_rest:
        if has_rate and not still:
            return False
        try:
            check_at_rest(log, unit)
        except LogError as error:
            if has_rate:
                return False
            raise LogError(
                f"there is no column 'rate' for the true rate among "
                f"{', '.join(map(repr, reading.files[0].layout.header[:20]))}, and the output "
                f"{error.reason} Say which it is (--columns rate=NAME)."
            ) from error
        what = "the rate is zero throughout" if has_rate else "there is no column for the rate"
        note = f"{what}, and the output does not move: taken as at rest (--at-rest)"
        reading.notes.append(note)
        tell(f"note: {note}")
    else:
        check_at_rest(log, unit)
    reading.log = log.assign(rate=0.0)
    return True


def _check_options(options, inputs, unit, at_rest):
    if options.physics and "output" not in inputs:
        raise UsageError("--physics: the arcsine law needs the output among the inputs.")
    if not isinstance(options.terms, str) and len(options.terms) != len(inputs):
        raise UsageError(
            f"--terms has {len(options.terms)} numbers for the {len(inputs)} inputs "
            f"{', '.join(inputs)}."
        )
    if options.scale_factor is not None and not (at_rest and unit in SIGNALS):
        raise UsageError("--scale-factor is for a raw signal at rest: else the rate tells it.")
    if at_rest and unit in SIGNALS and options.scale_factor is None:
        raise LogError(
            f"is in {unit}, and a gyro at rest does not tell its scale factor. Give that of the "
            f"data sheet (--scale-factor, {unit} per deg/s), or another unit (--units output=...).",
            "output",
        )


def _default_inputs(log, at_rest):
    """All that the log has; the time only where several runs can tell it from all else."""
    inputs: tuple[str, ...] = INPUTS
    if "time" not in log:
        inputs = ("temperature", "output")
    elif "run" not in log or log["run"].nunique() < 3:
        inputs = ("temperature", "temperature_rate", "output")
    return tuple(name for name in inputs if not (at_rest and name == "output"))


def _counts(log):
    parts = [
        f", {log[name].nunique():,} {name}{'s' if log[name].nunique() > 1 else ''}"
        for name in ("run", "device")
        if name in log
    ]
    return "".join(parts)
