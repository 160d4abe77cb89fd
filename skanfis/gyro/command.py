"""The command ``python -m skanfis.gyro``: from a calibration log to a checked compensator."""

import argparse
import sys
import time
from pathlib import Path

import joblib
import numpy as np
import pandas as pd

from ..export import export_c
from ._calibration import Recipe, calibrate
from ._split import KINDS, choose_split
from ._units import units_of
from .compensator import INPUTS, STATUS, GyroCompensator
from .html_report import report_page, rules_text
from .log import COLUMNS, QUANTITIES, LogError, check_log, declared_units, read_log

__all__ = ["main"]

_PROGRAM = "python -m skanfis.gyro"

DONE, FAILED, MISUSED, REFUSED, EXISTS = 0, 1, 2, 3, 4

_FILES = {
    "model": "compensator.joblib",
    "json": "compensator.json",
    "report": "report.html",
    "rules": "rules.txt",
}
_C_FILES = ("compensator.h", "compensator.c")

_DESCRIPTION = """\
Calibrate a gyro from logs in CSV: learn the error of its indicated rate (indicated minus true) from
what is known on board, its output, its temperature and how fast that changes, and the time since
power-on. The result is checked on whole runs, devices or rate levels that the model has not seen.

Written to a folder: the model (compensator.joblib, and without --physics compensator.json), a report
with tables and pictures for any browser (report.html), and the rules as text (rules.txt).
"""

_EPILOG = """\
examples:
  python -m skanfis.gyro log.csv
  python -m skanfis.gyro cold.csv warm.csv hot.csv --output gyro7
  python -m skanfis.gyro log.csv --columns time=t_ms temperature=temp output=counts rate=table \\
      --units time=ms output=counts
  python -m skanfis.gyro --apply gyro7/compensator.json flight.csv --output flight-rates.csv

status of a row in what --apply writes, the same bits as in the C code of skanfis.export:
  0  all is well
  1  an input lies outside the range of the calibration; the policy --outside was followed
  4  hardly any calibration data lie near the inputs (coverage below --min-coverage)
  8  the policy gives no rate

exit codes:
  0  done    1  failed, such as a disk that is full    2  options that make no sense
  3  the log was refused    4  a file exists already (--force replaces it)

security: a .joblib file can run any code when it is loaded. Apply only those that you, or someone
whom you trust, have written. The .json file is read as data, and runs nothing.
"""


def main(arguments=None):
    """Run the command; returns its exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    tell = _Progress(quiet=options.quiet)
    try:
        run = _apply if options.apply else _calibrate
        return run(options, tell)
    except _UsageError as error:
        parser.error(str(error))  # exits
    except LogError as error:
        return _say_error(error, REFUSED)
    except FileExistsError as error:
        return _say_error(error, EXISTS)
    except (OSError, ImportError) as error:
        return _say_error(error, FAILED)


class _UsageError(ValueError):
    """Options that make no sense."""


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
            sys.stderr.write(f"{self.seconds:7.1f} s  {text}\n")
            sys.stderr.flush()


def _parser():
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        usage=f"{_PROGRAM} LOG.csv [LOG.csv ...] [options]\n"
        f"       {_PROGRAM} --apply MODEL LOG.csv [LOG.csv ...] [options]",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("logs", nargs="+", metavar="LOG.csv", help="one log, or one file per run")
    reading = parser.add_argument_group("reading the log")
    reading.add_argument(
        "--columns",
        nargs="+",
        action="extend",
        default=[],
        metavar="PART=NAME",
        help=f"names of the columns; parts: {', '.join(COLUMNS)}. A part that is not named has its "
        "own name. Needed are temperature, output and rate (the truth); time for inputs that need "
        "it",
    )
    reading.add_argument(
        "--units",
        nargs="+",
        action="extend",
        default=[],
        metavar="PART=UNIT",
        help="units of the columns, by default s, degC and deg/s. "
        + "; ".join(f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES),
    )
    reading.add_argument("--separator", default=",", metavar="SIGN", help="between columns (,)")
    reading.add_argument("--decimal", default=".", metavar="SIGN", help="of decimal fractions (.)")
    reading.add_argument("--device", metavar="NAME", help="use the rows of this device only")
    reading.add_argument(
        "--at-rest",
        action="store_true",
        help="the gyro did not turn: the log needs no column for the rate, and the bias is learnt, "
        "the earth's rate included",
    )
    reading.add_argument(
        "--min-temperature-span",
        type=_positive,
        default=10.0,
        metavar="DEGC",
        help="smallest range of the temperature that is accepted (10)",
    )
    model = parser.add_argument_group("the model")
    model.add_argument(
        "--inputs",
        nargs="+",
        choices=INPUTS,
        metavar="INPUT",
        help=f"of {', '.join(INPUTS)}; by default all that the log has, and time (since power-on) "
        "only with three runs or more. temperature_rate is made from time and temperature. Without "
        "output, the bias alone is learnt",
    )
    model.add_argument(
        "--terms",
        type=_terms,
        default="search",
        metavar="N,N,...",
        help="fuzzy terms per input; 'search' (default) grows them on held-out groups, 'auto' "
        "leaves them to ANFISRegressor",
    )
    model.add_argument(
        "--physics",
        action="store_true",
        help="for open-loop fiber-optic gyros: fit the arcsine law first, and let the fuzzy rules "
        "learn what it leaves",
    )
    model.add_argument(
        "--outside",
        choices=("clip", "linear", "nan"),
        default="clip",
        help="policy for rows outside the range of the calibration, which are flagged in any case: "
        "hold the edge value (clip, default), go on linearly, or give no rate (nan)",
    )
    model.add_argument(
        "--min-coverage",
        type=_share,
        default=0.1,
        metavar="SHARE",
        help="rows that the data cover less are flagged (0.1)",
    )
    model.add_argument(
        "--time-constant",
        type=_positive,
        default=30.0,
        metavar="S",
        help="of the low-pass of the temperature's rate (30)",
    )
    model.add_argument(
        "--max-rules", type=_count, default=36, metavar="N", help="most rules of a search (36)"
    )
    model.add_argument(
        "--fit-rows",
        type=_count,
        default=100_000,
        metavar="N",
        help="fit to so many rows, chosen at random, of a longer log (100000); all rows are checked",
    )
    model.add_argument("--jobs", type=int, metavar="N", help="threads for a fit (1)")
    parser.add_argument(
        "--groups",
        choices=KINDS,
        default="auto",
        help="what to hold out in the check; by default (auto) devices where there are three or "
        "more, else runs, and rate levels where these could be learnt by heart",
    )
    output = parser.add_argument_group("output")
    output.add_argument(
        "--apply",
        metavar="MODEL",
        help="compensate the logs by this model (.json or .joblib) instead of calibrating; a "
        "column for the rate is not needed, and is compared with where it is there",
    )
    output.add_argument(
        "--output",
        type=Path,
        metavar="PATH",
        help="folder to write to (LOG-compensator); with --apply the file (LOG-compensated.csv)",
    )
    output.add_argument(
        "--c",
        choices=("c99", "c89"),
        metavar="STD",
        help="also write the model as C (compensator.h, compensator.c) by the standard c99 or c89",
    )
    output.add_argument("--force", action="store_true", help="replace files that exist")
    output.add_argument("--quiet", action="store_true", help="no progress on stderr")
    return parser


def _calibrate(options, tell):
    units = _pairs(options.units, "--units")
    folder = options.output or Path(f"{Path(options.logs[0]).stem}-compensator")
    files = [*_FILES.values(), *(_C_FILES if options.c else ())]
    _refuse_existing([folder / name for name in files], options.force)
    if options.c and options.physics:
        raise _UsageError("--c: the arcsine law of --physics is not exported as C.")
    _require_matplotlib()
    needed = ("temperature", "output") if options.at_rest else ("temperature", "output", "rate")
    log = _read(options, needed, tell)
    if options.at_rest:
        log = log.assign(rate=0.0)
    inputs = tuple(options.inputs or _default_inputs(log, options.at_rest))
    if options.physics and "output" not in inputs:
        raise _UsageError("--physics: the arcsine law needs the output among the inputs.")
    check_log(log, inputs=inputs, units=units, min_temperature_span=options.min_temperature_span)
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
        time_constant=options.time_constant,
        min_coverage=options.min_coverage,
        max_rules=options.max_rules,
        fit_rows=options.fit_rows,
        n_jobs=options.jobs,
    )
    split = choose_split(log, options.groups, uses_output="output" in inputs)
    tell(f"inputs: {', '.join(inputs)}")
    tell(f"check: {split.sentence}")
    calibration = calibrate(log, split, recipe, tell)
    tell("drawing the report")
    _write(calibration, options, folder)
    for message in calibration.warnings:
        tell(f"warning: {message}")
    _say(_summary(calibration, folder))
    tell("done")
    return DONE


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
    log = _read(options, sorted(needed), tell)
    check_log(log, inputs=(), units=_pairs(options.units, "--units"))
    tell("compensating")
    compensated = compensator.apply(log)
    labels = [name for name in ("device", "run", "time") if name in log]
    tell(f"writing {target}")
    # Twelve digits are beyond any gyro, and short beside the seventeen of a double.
    pd.concat([log[labels], compensated], axis=1).to_csv(target, index=False, float_format="%.12g")
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
    inputs = INPUTS
    if "time" not in log:
        inputs = ("temperature", "output")
    elif "run" not in log or log["run"].nunique() < 3:
        inputs = ("temperature", "temperature_rate", "output")
    return tuple(name for name in inputs if not (at_rest and name == "output"))


def _load(path):
    if path.endswith(".json"):
        try:
            return GyroCompensator.read_json(path)
        except ValueError as error:
            raise _UsageError(str(error)) from error
    loaded = joblib.load(path)
    if not isinstance(loaded, GyroCompensator):
        raise _UsageError(f"{path} holds a {type(loaded).__name__}, not a GyroCompensator.")
    return loaded


def _refuse_existing(paths, force):
    there = [str(path) for path in paths if path.exists()]
    if there and not force:
        raise FileExistsError(f"{there[0]} exists already: choose another --output, or --force.")


def _require_matplotlib():
    """A report without its pictures would be found out at the end only."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        message = "the report needs matplotlib: pip install 'skanfis[plot]'"
        raise ImportError(message) from error


def _write(calibration, options, folder):
    # First what takes long: nothing is written if it fails.
    page = report_page(calibration, _title(options.logs))
    compensator = calibration.compensator
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _FILES["report"]).write_text(page, encoding="utf-8")
    joblib.dump(compensator, folder / _FILES["model"])
    if calibration.recipe.physics:
        # One of before, which --force lets go, would be another model's.
        (folder / _FILES["json"]).unlink(missing_ok=True)
    else:
        compensator.write_json(folder / _FILES["json"])
    (folder / _FILES["rules"]).write_text(rules_text(calibration), encoding="utf-8")
    if options.c:
        coverage = compensator.min_coverage or None
        path = folder / "compensator"
        export_c(compensator.estimator, path, std=options.c, min_coverage=coverage)


def _title(logs):
    names = [Path(log).name for log in logs]
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


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
    ]
    return "\n".join(lines)


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
    return "\n".join(lines)


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


def _terms(text):
    if text in ("search", "auto"):
        return text
    try:
        terms = tuple(int(part) for part in text.split(","))
    except ValueError:
        terms = ()
    if not terms or min(terms) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} must be search, auto, or numbers such as 2,3,3")
    return terms


def _positive(text):
    return _number(text, float, lambda value: 0 < value < np.inf, "a positive number")


def _count(text):
    return _number(text, int, lambda value: value >= 1, "a whole number, 1 or more")


def _share(text):
    return _number(text, float, lambda value: 0 <= value <= 1, "a number from 0 to 1")


def _number(text, kind, is_valid, what):
    try:
        value = kind(text)
    except ValueError:
        value = None
    if value is None or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{text!r} must be {what}")
    return value


def _say(text):
    sys.stdout.write(text + "\n")


def _say_error(error, code):
    sys.stderr.write(f"{_PROGRAM}: {error}\n")
    return code
