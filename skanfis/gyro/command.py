"""The command ``python -m skanfis.gyro``: from a calibration log to a checked compensator."""

import contextlib
import os
from pathlib import Path

import joblib
import numpy as np

from ..export import export_c
from ..inspection.labels import printable
from ._apply import apply
from ._calibration import Recipe, calibrate
from ._certain import certain_of
from ._console import ExistsError, Progress, UsageError, refuse_existing, say, say_error
from ._files import check_different, find_logs
from ._formulas import rules_text
from ._headline import errors_and_verdict
from ._logs import find_tasks, read_task
from ._options import PROGRAM, make_parser
from ._report_options import report_options
from ._split import choose_split
from ._staging import Staging
from ._units import SIGNALS
from .c_code import export_c_physics
from .errors import LogError
from .html_report import check_installed, report_page
from .metrics import hysteresis

__all__ = ["main"]

DONE, FAILED, MISUSED, REFUSED, EXISTS = 0, 1, 2, 3, 4
INTERRUPTED = 130  # as a shell says of Ctrl-C

_FILES = {
    "model": "compensator.joblib",
    "json": "compensator.json",
    "report": "report.html",
    "rules": "rules.txt",
}
_C_FILES = ("compensator.h", "compensator.c")
# Of several logs a summary names so many, and counts the rest.
_MOST_NAMED = 3
_PER_MINUTE = 60.0


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
    with Staging(folder) as staging:
        tell(f"reading {_named(paths)}")
        tasks = find_tasks(options, paths)
        for task in tasks[: len(tasks) if len(tasks) > 1 or tasks[0].axis else 0]:
            _refuse_overwriting(folder / task.axis, options)
        done, left_out = [], []
        for task in tasks:
            if task.axis:
                tell(f"axis {task.axis}: {', '.join(task.columns.values())}")
            try:
                reading, inputs = read_task(options, paths, task, tell)
            except LogError as error:
                if len(tasks) == 1 or not _did_not_turn(task, error):
                    raise
                left_out.append(f"axis {task.axis} is left out: {error}")
                tell(f"note: {left_out[-1]}")
                continue
            recipe = _recipe(options, inputs, reading.units["output"])
            split = choose_split(reading.log, options.groups, uses_output="output" in inputs)
            tell(f"inputs: {', '.join(inputs)}")
            tell(f"check: {split.sentence}")
            calibration = calibrate(
                reading.log,
                split,
                recipe,
                tell,
                reading.name_row,
                made=reading.made,
                n_rows=reading.n_rows,
            )
            tell("drawing the report")
            target = staging.path / task.axis
            target.mkdir(exist_ok=True)
            _write(calibration, options, paths, target, task.axis)
            done.append((task, calibration, reading.notes))
        if not done:
            raise LogError(f"no axis follows the rate: {'; '.join(left_out)}")
        staging.publish()
    _say_what_was_found(done, left_out, folder, tell)


def _where_from_and_to(options):
    """The folder to write to and the logs, once the options are found to make sense."""
    _refuse_twice(options.inputs or (), "--inputs: {} is given twice.")
    for name in ("deviation", "saturate"):
        if getattr(options, name) and not options.c:
            raise UsageError(f"--{name} is of the model in C: give --c c99 or --c c89 with it.")
    _refuse_twice([name for name, *_ in options.box], "--box: {} is given twice.")
    folder = options.output or Path(f"{Path(options.logs[0]).stem or 'log'}-compensator")
    paths = options.logs = find_logs(options.logs)
    if folder.exists() and not folder.is_dir():
        raise ExistsError(f"{folder} is a file; --output is the folder to write to.")
    _refuse_overwriting(folder, options)
    check_installed()
    check_different(paths)
    return folder, paths


def _did_not_turn(task, error):
    """Whether the table did not turn about an axis that was guessed."""
    return task.is_guessed and "does not follow the rate" in error.reason


def _say_what_was_found(done, left_out, folder, tell):
    for task, calibration, notes in done:
        for message in calibration.warnings:
            tell(f"warning: {message}")
        if task.axis:
            say([f"axis {task.axis:<10}{', '.join(task.columns.values())}"])
        say(_summary(calibration, folder / task.axis, notes))
    say(f"note           {sentence}" for sentence in left_out)
    cautions = any(calibration.cautions for _, calibration, _ in done)
    tell("done, but see the warnings" if cautions else "done")


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
        max_extrapolation=options.max_extrapolation,
        time_constant=options.time_constant,
        min_coverage=options.min_coverage,
        max_rules=options.max_rules,
        fit_rows=options.fit_rows,
        n_jobs=options.jobs,
        box=tuple(options.box),
    )


def _named(paths):
    """Some files, in few words."""
    if len(paths) <= _MOST_NAMED:
        return ", ".join(map(str, paths))
    return f"{paths[0]} to {paths[-1]}, {len(paths):,} files"


def _refuse_overwriting(folder, options):
    names = [*_FILES.values(), *(_C_FILES if options.c else ())]
    refuse_existing([folder / name for name in names], options.force)


def _refuse_twice(names, sentence):
    for place, name in enumerate(names):
        if name in names[:place]:
            raise UsageError(sentence.format(name))


def _write(calibration, options, paths, folder, axis=""):
    title = _title(options.logs) + (f", axis {axis}" if axis else "")
    page = report_page(calibration, title, report_options(options, paths))
    compensator = calibration.compensator
    (folder / _FILES["report"]).write_text(page, encoding="utf-8")
    joblib.dump(compensator, folder / _FILES["model"])
    compensator.write_json(folder / _FILES["json"])
    (folder / _FILES["rules"]).write_text(rules_text(calibration), encoding="utf-8")
    if options.c:
        coverage = compensator.min_coverage or None
        path = folder / "compensator"
        export = export_c_physics if calibration.recipe.physics else export_c
        export(
            compensator.estimator,
            path,
            std=options.c,
            min_coverage=coverage,
            deviation=options.deviation,
            saturate=certain_of(calibration).found if options.saturate else None,
        )


def _title(logs):
    names = [Path(log).name for log in logs]
    return printable(names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")


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
    warming = _PER_MINUTE * calibration.X["temperature_rate"].to_numpy()[rows]
    errors = [(rates - calibration.rate)[rows] for rates in (calibration.before, calibration.after)]
    try:
        before, after = (hysteresis(error, temperature, warming) for error in errors)
    except ValueError:
        return []  # never warmed and cooled at one temperature
    return [
        f"hysteresis     {before:.4g} deg/h between warming and cooling before, {after:.4g} after"
    ]
