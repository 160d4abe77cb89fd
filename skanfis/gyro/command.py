"""The command ``python -m skanfis.gyro``: from a calibration log to a checked compensator.

It writes all files, or none.
"""

import contextlib
import os
import shlex
import signal
import sys
import tempfile
import time
from datetime import datetime
from itertools import chain
from pathlib import Path

from ..digits import counted
from ..inspection.labels import printable
from ._calibration import Recipe, calibrate
from ._checks import LABELS, check_at_rest, check_log, columns_of
from ._columns import SIGNALS
from ._headline import errors_and_verdict, of_rates, rules_text
from ._options import PROGRAM, check_kind, check_once, make_parser, request_of
from ._results import Results
from ._split import choose_split
from .c_compensator import export_c_compensator
from .compensator import INPUTS, GyroCompensator
from .errors import ExistsError, LogError, UsageError
from .html_report import check_installed, report_page, specification
from .log import find_logs, read
from .targets.autopilots import NOTES
from .targets.write import FILES, axes_of, write_targets

DONE, FAILED, REFUSED, EXISTS = 0, 1, 3, 4  # 2 is argparse's own
INCOMPLETE = 5  # a target was refused; all else is written
NOT_KEPT = 6  # all is written; a limit is not kept, or not measured
INTERRUPTED, CLOSED = 130, 141  # a shell's codes for Ctrl-C, and for a pipe that nobody reads

# All files that a calibration may write.
_FILES = (
    *("compensator.json", "compensator.h", "compensator.c", "report.html", "report.pdf"),
    *("rules.txt", *chain.from_iterable(FILES.values())),
)
_STAGED = ".skanfis-"  # prefix of temporary folders that hold files until all are written


def main(arguments=None):
    """Run the command and return its exit code."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    tell = _progress(options.quiet)
    options.written = None
    try:
        check_kind(parser, options)
        options.typed = shlex.join(sys.argv[1:] if arguments is None else arguments)
        if arguments is None:
            # From here on Ctrl-C raises an exception; until now it ended the process (__main__).
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.default_int_handler)
        code = (_apply if options.apply else _calibrate)(options, tell)
        sys.stdout.flush()
        return code
    except UsageError as error:
        parser.error(printable(error))  # exits
    except BrokenPipeError:
        # As Python's "Note on SIGPIPE" advises: else what is left to flush fails again at the end.
        for stream in (sys.stdout, sys.stderr):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return CLOSED
    except (LogError, ExistsError) as error:
        return _say_error(error, REFUSED if isinstance(error, LogError) else EXISTS)
    except (OSError, ImportError, ValueError, ArithmeticError, MemoryError) as error:
        # Arithmetic errors come from odd logs: they too get one sentence.
        return _say_error(error, FAILED)
    except KeyboardInterrupt:
        told = f"all is written to {options.written}" if options.written else "nothing was written"
        return _say_error(f"interrupted; {told}.", INTERRUPTED)


def _calibrate(options, tell):
    folder, paths = _where_from_and_to(options)
    with _staged(folder, _FILES if options.force else ()) as written:
        reading, recipe = _read(options, paths, tell)
        split = choose_split(reading.log, options.groups, uses_output="output" in recipe.inputs)
        tell(f"inputs: {', '.join(recipe.inputs)}")
        tell(f"check: {split.sentence}")
        calibration = calibrate(reading.log, split, recipe, tell, reading.name_row)
        tell("drawing the report")
        checks = _write(calibration, options, reading.digests, written)
        targets = list(write_targets(calibration, options.target, written))
        # Before files are moved: until then Ctrl-C and errors leave nothing behind.
        summary = list(errors_and_verdict(calibration, reading.name_row))
        names = ", ".join(sorted(path.name for path in written.iterdir()))
    options.written = folder
    for message in calibration.warnings:
        tell(f"warning: {message}")
    _say(summary)
    _say([f"check          {split.sentence}", f"written to     {folder}: {names}"])
    _say(f"note           {note}" for note in reading.notes)
    cautions = calibration.cautions()
    _say(f"WARNING        {sentence}" for sentence in cautions)
    if checks:
        _say([f"specification  {specification(checks)}"])
    _say(
        f"{'target' if is_written else 'REFUSED':14} {name}: {told}"
        for name, told, is_written in targets
    )
    tell("done, but see the warnings" if cautions else "done")
    if not all(done for *_, done in targets):
        return INCOMPLETE
    return DONE if all(check.result == "pass" for check in checks) else NOT_KEPT


def _where_from_and_to(options):
    """Check the options; return the folder to write to and the paths of the logs."""
    check_once("--inputs", options.inputs or ())
    check_once("--target", [text.partition(":")[0] for text in options.target])
    paths = options.logs = find_logs(options.logs)
    folder = options.output or Path(f"{Path(paths[0]).stem or 'log'}-compensator")
    if folder.exists() and not folder.is_dir():
        raise ExistsError(f"{folder} is a file; --output is the folder to write to.")
    _refuse_existing([folder / name for name in _FILES], options.force, paths)
    check_installed(options.pdf)
    return folder, paths


def _read(options, paths, tell):
    """Read and check the log; return the reading and the recipe, and tell what was found."""
    required = dict.fromkeys(["temperature", "output", *columns_of(options.inputs or ())])
    request = request_of(options, required)
    reading = read(paths, request, tell=tell)
    if reading.assumed:
        reading.notes.append(f"units assumed: {'; '.join(reading.assumed.values())}")
    if "time" not in reading.log:
        reading.notes.append(
            "no column of the time is found, so neither it nor the temperature's rate is an input "
            "(--columns time=NAME)"
        )
    for note in reading.notes:
        tell(f"note: {note}")
    layout = reading.files[0].layout
    for text in options.target if layout.axis and "output" not in request.columns else ():
        kind, wanted, *_ = f"{text}:".split(":")
        if kind in NOTES and wanted != layout.axis:
            raise UsageError(
                f"--target {text}: the output was taken from {layout.name('output')!r}. Say which "
                f"column is that of the axis {wanted} (--columns output=NAME), this one or another."
            )
    numbers = {"row": len(reading.log)}
    numbers |= {name: reading.log[name].nunique() for name in LABELS if name in reading.log}
    tell(", ".join(counted(f"{n:,}", name) for name, n in numbers.items()))
    try:
        at_rest = _settle_rest(reading, tell)
        recipe = _recipe(options, reading, at_rest)
        # A scale factor that is not given is found from the rates, whatever the inputs.
        told = ("output",) if recipe.output_unit in SIGNALS and not options.scale_factor else ()
        check_log(reading.log, units=reading.units, inputs=recipe.inputs + told)
    except LogError as error:
        raise reading.located(error) from error
    return reading, recipe


def _settle_rest(reading, tell):
    """Find whether the gyro was at rest; if so, set a rate in the log that changes to zero."""
    log, layout = reading.log, reading.files[0].layout
    try:
        check_at_rest(log, reading.units["output"])
    except LogError as error:
        if "rate" in log:
            return False
        raise LogError(
            f"{layout.name('output')!r} is taken for the output, no column for the true rate is "
            f"found among {', '.join(map(repr, layout.header[:20]))}, and the output "
            f"{error.reason} Say which they are (--columns output=NAME rate=NAME)."
        ) from error
    rate, what = 0.0, "there is no column for the rate"
    if "rate" in log and log["rate"].nunique() == 1:
        rate = log["rate"].iloc[0]  # such as the earth's
        what = f"the rate of {layout.name('rate')!r} is {rate:.3g} deg/s throughout"
    elif "rate" in log:
        name, largest = layout.name("rate"), log["rate"].abs().max()
        own = f"(if it is the gyro's own: --columns 'output={name}')"
        what = f"the rate of {name!r} is {largest:.3g} deg/s at most and not used {own}"
    reading.notes.append(f"{what}, and the output does not move: taken as at rest")
    tell(f"note: {reading.notes[-1]}")
    reading.log = log.assign(rate=rate)
    return True


def _recipe(options, reading, at_rest):
    """The recipe from the options; UsageError if they do not fit the log."""
    unit = reading.units["output"]
    inputs = tuple(options.inputs or _default_inputs(reading.log, at_rest))
    asked = "--physics" if options.physics else f"--write {options.write}"
    if (options.physics or "law" in options.write) and "output" not in inputs:
        raise UsageError(f"{asked}: the arcsine law needs the output among the inputs.")
    for text in options.target:
        if set(inputs) != set(axes_of(text)):
            told = f"--target {text} needs --inputs {' '.join(axes_of(text))}"
            raise UsageError(f"{told}; the model would have {', '.join(inputs)}.")
    if not isinstance(options.terms, str) and len(options.terms) != len(inputs):
        raise UsageError(
            f"--terms has {counted(len(options.terms), 'number')} for "
            f"{counted(len(inputs), 'input')}: {', '.join(inputs)}."
        )
    is_open = unit in SIGNALS and reading.log["rate"].nunique() == 1
    if options.scale_factor is not None and not is_open:
        raise UsageError("--scale-factor is only for a raw signal at one rate. Leave it out.")
    if is_open and options.scale_factor is None:
        raise LogError(
            f"is in {unit}, and one rate, as at rest, does not tell its scale factor. Give that of "
            f"the data sheet (--scale-factor, {unit} per deg/s), or a unit (--units output=...).",
            "output",
        )
    return Recipe(
        inputs=inputs,
        output_unit=unit if unit in SIGNALS else "deg/s",
        scale_factor=options.scale_factor or 1.0,
        write=options.write,
        terms=options.terms,
        physics=options.physics,
        outside=options.outside,
        units=reading.units,
        assumed=reading.assumed,
    )


def _default_inputs(log, at_rest):
    """All inputs that the log has; time only if three runs separate its effect from others."""
    inputs: tuple[str, ...] = INPUTS
    if "time" not in log:
        inputs = ("temperature", "output")
    elif "run" not in log or log["run"].nunique() < 3:
        inputs = ("temperature", "temperature_rate", "output")
    return tuple(name for name in inputs if not (at_rest and name == "output"))


def _write(calibration, options, files, folder):
    """Write all files but the targets; return the checks of the limits."""
    more = f" and {len(files) - 1} more" if len(files) > 1 else ""
    results = Results(
        calibration,
        made=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M:%S %z"),
        serial=options.serial,
        operator=options.operator,
        files=files,
        typed=options.typed,
        limits=options.limits,
    )
    page = report_page(results, printable(f"{files[0][0]}{more}"))
    compensator = calibration.compensator
    (folder / "report.html").write_text(page, encoding="utf-8")
    if options.pdf:
        import weasyprint

        weasyprint.HTML(string=page).write_pdf(folder / "report.pdf")
    compensator.write_json(folder / "compensator.json")
    (folder / "rules.txt").write_text(rules_text(calibration), encoding="utf-8")
    if options.c:
        std, _, dtype = options.c.partition(":")
        export_c_compensator(compensator, folder / "compensator", std=std, dtype=dtype or "double")
    return results.checks


def _apply(options, tell):
    paths = find_logs(options.logs)
    if len(paths) > 1 and options.output is None:
        raise UsageError("--apply to several logs needs --output.")
    target = options.output or Path(f"{Path(paths[0]).stem}-compensated.csv")
    _refuse_existing([target], options.force, [*paths, options.apply])
    try:
        compensator = GyroCompensator.read_json(options.apply)
    except ValueError as error:
        raise UsageError(str(error)) from error
    needed = {"output", *columns_of(compensator.inputs)}
    units = dict(compensator.units)
    if units.get("output") in SIGNALS and "output" not in compensator.assumed:
        del units["output"]  # must be named again
    # The true rate is no input; if the log has it, the errors are reported.
    optional = tuple({"temperature", "rate"} - needed)
    reading = read(paths, request_of(options, sorted(needed), units, optional), tell=tell)
    unit, due = reading.units["output"], compensator.output_unit
    if (unit if unit in SIGNALS else "deg/s") != due:
        raise UsageError(
            f"the model was calibrated for an output in {due}; this is in {unit} "
            f"(--units output={due})."
        )
    reading.notes += [f"units as in the calibration: {text}" for text in reading.assumed.values()]
    for note in reading.notes:
        tell(f"note: {note}")
    log = reading.log
    if "time" in compensator.inputs:
        starts = log["power_on"].unique()
        first = f"{'' if starts.size == 1 else 'in each run, first '}at {starts[0]:.10g} s"
        reading.notes.append(f"power-on is taken to be where the clock begins, {first}")
    n_rows = counted(f"{len(log):,}", "row")
    tell(n_rows)
    rates = compensator.apply(log)
    labels = [name for name in ("device", "run", "time") if name in log]
    tell(f"writing {target}")
    with _staged(target.parent) as folder:
        # Twelve digits are more than any gyro resolves, and shorter than the 17 of a double.
        log[labels].join(rates).to_csv(folder / target.name, index=False, float_format="%.12g")
        summary = list(of_rates(compensator, log, rates))
    options.written = target
    _say([f"written        {target}: {n_rows}", *summary])
    _say(f"note           {note}" for note in reading.notes)
    tell("done")
    return DONE


def _progress(quiet):
    """A function that writes a line to stderr, with the time since the start."""
    start = time.monotonic()

    def tell(text):
        if not quiet:
            seconds = time.monotonic() - start
            sys.stderr.write(f"{seconds:7.1f} s  {printable(text)}\n")

    return tell


def _say(lines):
    """Write lines to stdout; characters that its encoding lacks are escaped, as stderr does."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    for line in lines:
        told = printable(line).encode(encoding, "backslashreplace").decode(encoding)
        sys.stdout.write(f"{told}\n")


def _say_error(error, code):
    told = str(error) or type(error).__name__
    if isinstance(error, OSError) and error.filename is not None and error.strerror is not None:
        told = f"{error.filename}: {error.strerror}."
    sys.stderr.write(f"{PROGRAM}: {printable(told)}\n")
    return code


def _refuse_existing(paths, force, read=()):
    """Refuse to replace existing files; with ``force`` only those that are ``read``."""
    for path in paths:
        if any(path.resolve() == Path(other).resolve() for other in read):
            raise ExistsError(f"{path} is read, and never replaced: choose another --output.")
        if path.is_dir():
            raise ExistsError(f"{path} is a folder: choose another --output.")
        if path.exists() and not force:
            raise ExistsError(f"{path} exists already: choose another --output, or --force.")


@contextlib.contextmanager
def _staged(folder, replaced=()):
    """A temporary folder to write to; at the end all its files are moved to ``folder``.

    Other files in ``folder`` with a name in ``replaced`` are from an earlier run, and are removed
    then. After an error, ``folder`` is as it was.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=_STAGED, dir=folder) as name:
            new, old = (Path(tempfile.mkdtemp(dir=name)) for _ in range(2))
            yield new
            _exchange({*replaced, *os.listdir(new)}, new, folder, old)
    except BaseException:
        for path in made:
            with contextlib.suppress(OSError):  # another program has put something there
                path.rmdir()
        raise


def _exchange(names, new, folder, old):
    """Move files from ``folder`` to ``old``, and from ``new`` to ``folder``: all, or none."""
    moves = []
    try:
        for name in sorted(names):
            for here, there in ((folder / name, old / name), (new / name, folder / name)):
                if here.exists():
                    moves.append((here, there))
                    os.replace(here, there)
    except BaseException:
        for here, there in reversed(moves):
            if there.exists():  # the last of them may not have been made
                os.replace(there, here)
        raise
