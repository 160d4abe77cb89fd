"""The command ``python -m skanfis.gyro``: from a calibration log to a checked compensator."""

import contextlib
import os
from pathlib import Path

import numpy as np

from ..export import export_c
from ..inspection.labels import printable
from ._apply import apply
from ._budget import proven_bounds
from ._calibration import Recipe, calibrate
from ._checks import LABELS, check_at_rest, check_log
from ._columns import SIGNALS
from ._console import Progress, refuse_existing, say, say_error, staged, usage_errors
from ._formulas import rules_text
from ._headline import errors_and_verdict
from ._options import PROGRAM, make_parser, request_of
from ._report_options import report_options
from ._split import choose_split
from .c_code import export_c_physics
from .compensator import INPUTS
from .errors import ExistsError, LogError, UsageError
from .html_report import check_installed, report_page
from .log import find_logs, read
from .metrics import hysteresis

__all__ = ["main"]

DONE, FAILED, MISUSED, REFUSED, EXISTS = 0, 1, 2, 3, 4
INTERRUPTED = 130  # as a shell says of Ctrl-C

_FILES = ("compensator.json", "report.html", "rules.txt")
_C_FILES = ("compensator.h", "compensator.c")
_MOST_ROWS = 1_000_000  # that are held


def main(arguments=None):
    """Run the command; returns its exit code."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    tell = Progress(quiet=options.quiet)
    try:
        run = apply if options.apply else _calibrate
        run(options, tell)
        return DONE
    except UsageError as error:
        parser.error(printable(error))  # exits
    except LogError as error:
        return say_error(PROGRAM, error, REFUSED)
    except ExistsError as error:
        return say_error(PROGRAM, error, EXISTS)
    except BrokenPipeError:
        # Whoever read the summary has seen enough; nothing more is to be flushed there at the end.
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return FAILED
    except (OSError, ImportError, ValueError, ArithmeticError, MemoryError) as error:
        # Of what the log made of the arithmetic: one sentence too.
        return say_error(PROGRAM, error, FAILED)
    except KeyboardInterrupt:
        return say_error(PROGRAM, "interrupted; nothing was written.", INTERRUPTED)


def _calibrate(options, tell):
    folder, paths = _where_from_and_to(options)
    with staged(folder) as written:
        tell(f"reading {paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))
        reading, inputs = _read(options, paths, tell)
        recipe = _recipe(options, inputs, reading.units["output"])
        split = choose_split(reading.log, options.groups, uses_output="output" in inputs)
        tell(f"inputs: {', '.join(inputs)}")
        tell(f"check: {split.sentence}")
        calibration = calibrate(
            reading.log, split, recipe, tell, reading.name_row, n_rows=reading.n_rows
        )
        tell("drawing the report")
        _write(calibration, options, paths, written)
    for message in calibration.warnings:
        tell(f"warning: {message}")
    say(_summary(calibration, folder, reading.notes))
    tell("done, but see the warnings" if calibration.cautions else "done")


def _where_from_and_to(options):
    """The folder to write to and the logs, once the options are found to make sense."""
    for option, names in (
        ("--inputs", options.inputs or ()),
        ("--box", [name for name, *_ in options.box]),
    ):
        for name in names:
            if names.count(name) > 1:
                raise UsageError(f"{option}: {name} is given twice.")
    if options.saturate and not options.c:
        raise UsageError("--saturate is of the model in C: give --c c99 or --c c89 with it.")
    folder = options.output or Path(f"{Path(options.logs[0]).stem or 'log'}-compensator")
    paths = options.logs = find_logs(options.logs)
    if folder.exists() and not folder.is_dir():
        raise ExistsError(f"{folder} is a file; --output is the folder to write to.")
    names = (*_FILES, *(_C_FILES if options.c else ()))
    refuse_existing([folder / name for name in names], options.force)
    check_installed()
    return folder, paths


def _read(options, paths, tell):
    """The checked log; returns its reading and the inputs. What was found out is told."""
    required = ["temperature", "output"]
    if {"time", "temperature_rate"} & set(options.inputs or ()):
        required.append("time")
    request = request_of(options, required)
    with usage_errors():
        reading = read(paths, request, by_clock=True, tell=tell, most_rows=_MOST_ROWS, check=True)
    for note in reading.notes:
        tell(f"note: {note}")
    numbers = {"row": reading.n_rows}
    numbers |= {name: reading.log[name].nunique() for name in LABELS if name in reading.log}
    tell(", ".join(f"{n:,} {name}{'s' if n > 1 else ''}" for name, n in numbers.items()))
    try:
        at_rest = _settle_rest(reading, tell)
        inputs = tuple(options.inputs or _default_inputs(reading.log, at_rest))
        _check_options(options, inputs, reading.units["output"], at_rest)
        check_log(reading.log, units=reading.units, inputs=inputs)
    except LogError as error:
        raise reading.located(error) from error
    return reading, inputs


def _settle_rest(reading, tell):
    """Whether the gyro was at rest; the log then has a rate of zero."""
    log = reading.log
    try:
        check_at_rest(log, reading.units["output"])
    except LogError as error:
        if "rate" in log:
            return False
        raise LogError(
            f"there is no column 'rate' for the true rate among "
            f"{', '.join(map(repr, reading.files[0].layout.header[:20]))}, and the output "
            f"{error.reason} Say which it is (--columns rate=NAME)."
        ) from error
    what = "the rate is zero throughout" if "rate" in log else "there is no column for the rate"
    reading.notes.append(f"{what}, and the output does not move: taken as at rest")
    tell(f"note: {reading.notes[-1]}")
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


def _recipe(options, inputs, unit):
    """What the options ask for, of a log whose output is in a unit."""
    for name, *_ in options.box:
        if name not in inputs:
            raise UsageError(f"--box: {name!r} is no input; these are {', '.join(inputs)}.")
    return Recipe(
        inputs=inputs,
        output_unit=unit if unit in SIGNALS else "deg/s",
        scale_factor=options.scale_factor or 1.0,
        terms=options.terms,
        physics=options.physics,
        outside=options.outside,
        min_coverage=options.min_coverage,
        box=tuple(options.box),
    )


def _write(calibration, options, paths, folder):
    names = [Path(path).name for path in paths]
    title = printable(names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")
    page = report_page(calibration, title, report_options(options, paths))
    compensator = calibration.compensator
    (folder / "report.html").write_text(page, encoding="utf-8")
    compensator.write_json(folder / "compensator.json")
    (folder / "rules.txt").write_text(rules_text(calibration), encoding="utf-8")
    if options.c:
        coverage = compensator.min_coverage or None
        path = folder / "compensator"
        export = export_c_physics if calibration.recipe.physics else export_c
        export(
            compensator.estimator,
            path,
            std=options.c,
            min_coverage=coverage,
            saturate=proven_bounds(calibration).found if options.saturate else None,
        )


def _summary(calibration, folder, notes):
    lines = errors_and_verdict(calibration)
    if not np.ptp(calibration.rate):
        inside = calibration.inside & np.isfinite(calibration.after)
        lines += _hysteresis_line(calibration, inside)
    lines += [
        f"check          {calibration.split.sentence}",
        f"written to     {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}",
        *(f"note           {note}" for note in notes),
        *(f"WARNING        {sentence}" for sentence in calibration.cautions),
    ]
    return lines


def _hysteresis_line(calibration, rows):
    """The gap between warming and cooling of a gyro at rest; none where there is no such gap."""
    if "temperature_rate" not in calibration.X:
        return []
    temperature = calibration.log["temperature"].to_numpy()[rows]
    warming = 60.0 * calibration.X["temperature_rate"].to_numpy()[rows]
    errors = [(rates - calibration.rate)[rows] for rates in (calibration.before, calibration.after)]
    try:
        before, after = (hysteresis(error, temperature, warming) for error in errors)
    except ValueError:
        return []  # never warmed and cooled at one temperature
    return [
        f"hysteresis     {before:.4g} deg/h between warming and cooling before, {after:.4g} after"
    ]
