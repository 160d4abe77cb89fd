"""The command ``python -m skanfis.gyro``: from a calibration log to a checked compensator."""

import sys
import time
from pathlib import Path

import joblib
import numpy as np
import pandas as pd

from ..export import export_c
from ..inspection.labels import printable
from ._calibration import Recipe, calibrate
from ._options import PROGRAM, make_parser
from ._split import choose_split
from ._staging import Staging
from .c_code import export_c_physics
from .compensator import INPUTS, STATUS, GyroCompensator
from .html_report import report_page, rules_text
from .log import (
    LogError,
    check_at_rest,
    check_log,
    declared_units,
    line_of,
    located,
    read_log,
)

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


def main(arguments=None):
    """Run the command; returns its exit code."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    tell = _Progress(quiet=options.quiet)
    try:
        run = _apply if options.apply else _calibrate
        return run(options, tell)
    except _UsageError as error:
        parser.error(printable(error))  # exits
    except LogError as error:
        return _say_error(error, REFUSED)
    except _ExistsError as error:
        return _say_error(error, EXISTS)
    except OSError as error:
        return _say_error(_told(error), FAILED)
    except (ImportError, ValueError, ArithmeticError, MemoryError) as error:
        # Of what the log made of the arithmetic: one sentence too.
        return _say_error(str(error) or type(error).__name__, FAILED)
    except KeyboardInterrupt:
        return _say_error("interrupted; nothing was written.", INTERRUPTED)


class _UsageError(ValueError):
    """Options that make no sense."""


class _ExistsError(Exception):
    """A file that would be replaced."""


class _Progress:
    """Lines on stderr, with the time since the start."""

    def __init__(self, quiet):
        self._quiet = quiet
        self._start = time.monotonic()

    @property
    def seconds(self):
        """Time since the start [s]."""
        return time.monotonic() - self._start

    def __call__(self, text):
        if not self._quiet:
            _write_to(sys.stderr, f"{self.seconds:7.1f} s  {printable(text)}\n")
            sys.stderr.flush()


def _calibrate(options, tell):
    units = _pairs(options.units, "--units")
    folder = options.output or Path(f"{Path(options.logs[0]).stem}-compensator")
    if folder.exists() and not folder.is_dir():
        raise _ExistsError(f"{folder} is a file; --output is the folder to write to.")
    files = [*_FILES.values(), *(_C_FILES if options.c else ())]
    _refuse_existing([folder / name for name in files], options.force)
    _refuse_twice(options.inputs or (), "--inputs: {} is given twice.")
    _require_matplotlib()
    with Staging(folder) as staging:
        calibration = _calibration(options, units, tell)
        tell("drawing the report")
        _write(calibration, options, staging.path)
        staging.publish()
    for message in calibration.warnings:
        tell(f"warning: {message}")
    _say(_summary(calibration, folder))
    tell("done, but see the warnings" if calibration.cautions else "done")
    return DONE


def _calibration(options, units, tell):
    needed = ("temperature", "output") if options.at_rest else ("temperature", "output", "rate")
    log = _read(options, needed, tell)
    if options.at_rest:
        _located(lambda: check_at_rest(log, declared_units(units).get("output", "deg/s")), options)
        log = log.assign(rate=0.0)
    inputs = tuple(options.inputs or _default_inputs(log, options.at_rest))
    if options.physics and "output" not in inputs:
        raise _UsageError("--physics: the arcsine law needs the output among the inputs.")
    _check(log, options, inputs=inputs, min_temperature_span=options.min_temperature_span)
    if not isinstance(options.terms, str) and len(options.terms) != len(inputs):
        raise _UsageError(
            f"--terms has {len(options.terms)} numbers for the {len(inputs)} inputs "
            f"{', '.join(inputs)}."
        )
    recipe = Recipe(
        inputs=inputs,
        output_unit=declared_units(units).get("output", "deg/s"),
        terms=options.terms,
        physics=options.physics,
        outside=options.outside,
        max_extrapolation=options.max_extrapolation,
        time_constant=options.time_constant,
        min_coverage=options.min_coverage,
        max_rules=options.max_rules,
        fit_rows=options.fit_rows,
        n_jobs=options.jobs,
    )
    split = choose_split(log, options.groups, uses_output="output" in inputs)
    tell(f"inputs: {', '.join(inputs)}")
    tell(f"check: {split.sentence}")
    return calibrate(log, split, recipe, tell, _name_row(log, options))


def _apply(options, tell):
    if len(options.logs) > 1 and options.output is None:
        raise _UsageError("--apply to several logs needs --output.")
    target = options.output or Path(f"{Path(options.logs[0]).stem}-compensated.csv")
    _refuse_existing([target], options.force)
    compensator = _load(options.apply)
    given = declared_units(_pairs(options.units, "--units")).get("output", "deg/s")
    if given != compensator.output_unit:
        raise _UsageError(
            f"the model was calibrated for an output in {compensator.output_unit}; this is in "
            f"{given} (--units output={compensator.output_unit})."
        )
    needed = {"output"} | set(compensator.inputs) - {"temperature_rate"}
    if "temperature_rate" in compensator.inputs:
        needed |= {"time", "temperature"}
    with Staging(target.parent) as staging:
        log = _read(options, sorted(needed), tell)
        _check(log, options, inputs=())
        tell("compensating")
        compensated = compensator.apply(log)
        labels = [name for name in ("device", "run", "time") if name in log]
        tell(f"writing {target}")
        table = pd.concat([log[labels], compensated], axis=1)
        # Twelve digits are beyond any gyro, and short beside the seventeen of a double.
        table.to_csv(staging.path / target.name, index=False, float_format="%.12g")
        staging.publish()
    _say(_summary_of_rows(log, compensated, compensator, target))
    tell("done")
    return DONE


def _read(options, require, tell):
    tell(f"reading {', '.join(options.logs)}")
    columns, units = _pairs(options.columns, "--columns"), _pairs(options.units, "--units")
    inputs = options.inputs or ()
    if {"time", "temperature_rate"} & set(inputs):
        require = (*require, "time")
    try:
        log = read_log(
            options.logs,
            columns=columns,
            units=units,
            require=require,
            separator=options.separator,
            decimal=options.decimal,
        )
    except LogError:
        raise
    except ValueError as error:
        # An unknown part or unit.
        raise _UsageError(str(error)) from error
    if options.device is not None:
        log = _of_device(log, options.device)
    tell(f"{len(log):,} rows{_counts(log)}")
    return log


def _check(log, options, **requirements):
    """As :func:`check_log`, with errors in the words of the file."""
    units = _pairs(options.units, "--units")
    _located(lambda: check_log(log, units=units, **requirements), options)


def _located(check, options):
    """Do a check, with errors in the words of the file."""
    try:
        check()
    except LogError as error:
        columns = _pairs(options.columns, "--columns")
        raise located(error, columns, _only_file(options), options.separator) from error


def _only_file(options):
    """The file whose rows are those of the log; None where there is no such file."""
    return options.logs[0] if len(options.logs) == 1 and options.device is None else None


def _name_row(log, options):
    """A function that says where a row of the log is found."""
    path = _only_file(options)
    if path is not None:
        return lambda row: f"{path}, line {line_of(path, row, options.separator)}"
    if "run" in log:
        return lambda row: f"row {row}, in run {log['run'].iloc[row]}"
    return "row {}".format


def _of_device(log, device):
    if "device" not in log:
        raise _UsageError("--device: the log has no column for the device.")
    names = list(log["device"].cat.categories)
    if device not in names:
        raise _UsageError(f"--device {device}: the log has {', '.join(names)}.")
    log = log[(log["device"] == device).to_numpy()].reset_index(drop=True)
    for name in ("run", "device"):
        if name in log:
            log[name] = log[name].cat.remove_unused_categories()
    return log


def _counts(log):
    parts = [
        f", {log[name].nunique():,} {name}{'s' if log[name].nunique() > 1 else ''}"
        for name in ("run", "device")
        if name in log
    ]
    return "".join(parts)


def _default_inputs(log, at_rest):
    """All that the log has; the time only where several runs can tell it from all else."""
    inputs: tuple[str, ...] = INPUTS
    if "time" not in log:
        inputs = ("temperature", "output")
    elif "run" not in log or log["run"].nunique() < 3:
        inputs = ("temperature", "temperature_rate", "output")
    return tuple(name for name in inputs if not (at_rest and name == "output"))


def _load(path):
    """The compensator of a file: of JSON, or else by its name a pickle, which may run any code."""
    try:
        return GyroCompensator.read_json(path)
    except ValueError as error:
        if Path(path).suffix.lower() != ".joblib":
            raise _UsageError(str(error)) from error
    try:
        loaded = joblib.load(path)
    except Exception as error:
        # A damaged pickle may raise anything.
        raise _UsageError(
            f"{path} cannot be loaded ({type(error).__name__}: {error}): it is damaged, or no "
            "compensator. Use compensator.json."
        ) from error
    if not isinstance(loaded, GyroCompensator):
        raise _UsageError(f"{path} holds a {type(loaded).__name__}, not a GyroCompensator.")
    return loaded


def _refuse_existing(paths, force):
    for path in paths:
        if path.is_dir():
            raise _ExistsError(f"{path} is a folder: choose another --output.")
        if path.exists() and not force:
            raise _ExistsError(f"{path} exists already: choose another --output, or --force.")


def _refuse_twice(names, sentence):
    for place, name in enumerate(names):
        if name in names[:place]:
            raise _UsageError(sentence.format(name))


def _require_matplotlib():
    """A report without its pictures would be found out at the end only."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        message = "the report needs matplotlib: pip install matplotlib"
        raise ImportError(message) from error
    except ValueError as error:
        # Of its settings; MPLBACKEND is one.
        reason = printable(str(error).partition(";")[0])
        raise ImportError(f"matplotlib cannot be imported: {reason}.") from error


def _write(calibration, options, folder):
    page = report_page(calibration, _title(options.logs))
    compensator = calibration.compensator
    (folder / _FILES["report"]).write_text(page, encoding="utf-8")
    joblib.dump(compensator, folder / _FILES["model"])
    compensator.write_json(folder / _FILES["json"])
    (folder / _FILES["rules"]).write_text(rules_text(calibration), encoding="utf-8")
    if options.c:
        coverage = compensator.min_coverage or None
        path = folder / "compensator"
        export = export_c_physics if calibration.recipe.physics else export_c
        export(compensator.estimator, path, std=options.c, min_coverage=coverage)


def _title(logs):
    names = [Path(log).name for log in logs]
    return printable(names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")


def _summary(calibration, folder):
    before = _rms(calibration.before - calibration.rate)
    errors = calibration.after - calibration.rate
    inside = calibration.inside & np.isfinite(errors)
    outside = ~calibration.inside & np.isfinite(errors)
    lines = [
        f"error before   {before:.4g} deg/s RMS",
        f"error after    {_rms(errors[inside]):.4g} deg/s RMS, peak "
        f"{np.abs(errors[inside]).max():.4g}, on {inside.sum():,} held-out rows in range",
    ]
    if outside.any():
        lines.append(
            f"out of range   {_rms(errors[outside]):.4g} deg/s RMS on {outside.sum():,} held-out "
            "rows, all of them flagged"
        )
    lines += [
        f"check          {calibration.split.sentence}",
        f"written to     {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}",
        *(f"WARNING        {sentence}" for sentence in calibration.cautions),
    ]
    return lines


def _summary_of_rows(log, compensated, compensator, target):
    flagged = compensated["status"].to_numpy() != 0
    lines = [f"written        {target}: {len(log):,} rows, {flagged.sum():,} flagged"]
    for name, bit in STATUS.items():
        count = int(np.count_nonzero(compensated["status"].to_numpy() & bit))
        if count:
            lines.append(f"status {bit}       {count:,} rows {name.lower().replace('_', ' ')}")
    if "rate" in log:
        for label, rows in (("all is well", ~flagged), ("flagged", flagged)):
            before, after = (
                (compensated[name] - log["rate"]).to_numpy()[rows]
                for name in ("rate_indicated", "rate_compensated")
            )
            if np.isfinite(after).any():
                lines.append(
                    f"RMS error      {_rms(before):.4g} deg/s before, "
                    f"{_rms(after[np.isfinite(after)]):.4g} after ({label})"
                )
    return lines


def _rms(errors):
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def _pairs(texts, option):
    pairs = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not (key and equals and value):
            raise _UsageError(f"{option}: {text!r} must be of the form PART=...")
        if key in pairs:
            raise _UsageError(f"{option}: {key} is given twice.")
        pairs[key] = value
    return pairs


def _told(error):
    """An error of the system in one sentence."""
    if error.filename is None or error.strerror is None:
        return error
    return f"{error.filename}: {error.strerror}."


def _say(lines):
    for line in lines:
        _write_to(sys.stdout, f"{printable(line)}\n")


def _say_error(error, code):
    _write_to(sys.stderr, f"{PROGRAM}: {printable(error)}\n")
    return code


def _write_to(stream, text):
    """Text to a stream, with escapes for what its encoding lacks."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
