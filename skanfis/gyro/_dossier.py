"""What a report says beside the figures: whose gyro, which files, by which options, what limits."""

import argparse
import hashlib
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from ._columns import RATE_UNITS
from ._limits import Limit, parse_limit

__all__ = ["Dossier", "LogFile", "add_report_options", "dossier_of"]


@dataclass(frozen=True)
class LogFile:
    """A file of a log, by its name without folders, its size [bytes] and the hash of its bytes."""

    name: str
    n_bytes: int
    sha256: str


@dataclass(frozen=True)
class Dossier:
    """All may be missing. ``unit`` is that of all errors, or "auto"; ``options`` are pairs."""

    made: str = ""
    serial: str = ""
    operator: str = ""
    files: tuple[LogFile, ...] = ()
    options: tuple[tuple[str, str], ...] = ()
    limits: tuple[Limit, ...] = ()
    unit: str = "auto"


def add_report_options(parser):
    """Options of the command for the report."""
    group = parser.add_argument_group("the report")
    group.add_argument("--serial", default="", metavar="TEXT", help="serial number of the gyro")
    group.add_argument("--operator", default="", metavar="TEXT", help="who made the calibration")
    group.add_argument(
        "--limits",
        nargs="+",
        action="extend",
        type=_limit,
        default=[],
        metavar="FIGURE=LIMIT",
        help="limits of the specification for figures of merit after compensation, with units: "
        "residual_rms=0.01deg/s (at most), bias=-2:5deg/h (from, to), reduction_factor=10 (at "
        "least); the report says of each whether it is kept",
    )
    group.add_argument(
        "--report-unit",
        choices=("auto", *RATE_UNITS),
        default="auto",
        help="unit of all errors and biases in the report; auto (default) takes deg/h where errors "
        "are small",
    )


def dossier_of(options, paths):
    """The dossier of the command's options and logs, with the files as they are now."""
    told = [
        (name.replace("_", "-"), _shown(value))
        for name, value in sorted(vars(options).items())
        if value is not None and value is not False and value not in ([], "")
    ]
    return Dossier(
        made=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M:%S %z"),
        serial=options.serial,
        operator=options.operator,
        files=tuple(_log_file(Path(path)) for path in paths),
        options=tuple(told),
        limits=tuple(options.limits),
        unit=options.report_unit,
    )


def _log_file(path):
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return LogFile(path.name, file.tell(), digest)


def _shown(value):
    if isinstance(value, Limit):
        return f"{value.figure}={value.text}"
    if isinstance(value, Path):
        return value.name
    if isinstance(value, list | tuple):
        return " ".join(_shown(part) for part in value)
    return str(value)


def _limit(text):
    try:
        return parse_limit(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
