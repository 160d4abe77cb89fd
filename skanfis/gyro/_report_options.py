"""What the command is told for its report: whose gyro, in which unit, and limits to be kept.

bias=5deg/h             the size of the bias is at most 5 deg/h
bias=-2:5deg/h          it lies from -2 to 5 deg/h
reduction_factor=10     it is 10 or more: of this figure more is better
residual_rms=:0.01deg/s it is at most 0.01 deg/s
"""

import argparse
import hashlib
import math
import re
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from ._rate_units import RATE_UNITS, in_rate_unit, rate_unit_of
from .allan import ALLAN_FIGURES
from .report import figures_of_merit

__all__ = [
    "Check",
    "Limit",
    "ReportOptions",
    "add_report_options",
    "check_limit",
    "parse_limit",
    "report_options",
]

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FORM = re.compile(rf"(?P<low>{_NUMBER})?(?P<colon>:)?(?P<high>{_NUMBER})?(?P<unit>[^\d.:+-].*)?")
_SPELLINGS = (("°C", "degC"), ("°", "deg"), ("√h", "sqrt(h)"))
_UNITS = {figure.name: figure.unit for figure in figures_of_merit()} | ALLAN_FIGURES
# Of these more is better.
_AT_LEAST = ("reduction_factor",)


class Limit(NamedTuple):
    """From ``low`` to ``high``, both kept; ``text`` is what was typed, ``unit`` that of both."""

    figure: str
    low: float
    high: float
    unit: str
    text: str

    def keeps(self, value):
        """Whether a value in the limit's unit keeps it."""
        return bool(self.low <= value <= self.high)


class Check(NamedTuple):
    """A limit and the figure after compensation, in one unit: "pass", "fail" or "not measured"."""

    limit: Limit
    value: float
    result: str
    remark: str


class ReportOptions(NamedTuple):
    """All may be missing. ``unit`` is that of all errors, or "auto"; ``options`` are pairs.

    ``files`` have a name without folders, a size [bytes] and the SHA-256 of their bytes.
    """

    made: str = ""
    serial: str = ""
    operator: str = ""
    files: tuple[tuple[str, int, str], ...] = ()
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
        type=_limit_of_option,
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


def report_options(options, paths):
    """Those of the command's options and logs, with the files as they are now."""
    told = [
        (name.replace("_", "-"), _as_typed(value))
        for name, value in sorted(vars(options).items())
        if value is not None and value is not False and value not in ([], "")
    ]
    files = []
    for path in map(Path, paths):
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            files.append((path.name, file.tell(), digest))
    return ReportOptions(
        made=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M:%S %z"),
        serial=options.serial,
        operator=options.operator,
        files=tuple(files),
        options=tuple(told),
        limits=tuple(options.limits),
        unit=options.report_unit,
    )


def parse_limit(text):
    """A limit such as ``bias=5deg/h``; ValueError where it is none."""
    figure, equals, typed = text.partition("=")
    if not equals or figure not in _UNITS:
        raise ValueError(
            f"{text!r} must be FIGURE=LIMIT, with a figure of merit of: {', '.join(_UNITS)}."
        )
    found = _FORM.fullmatch(typed.strip())
    if found is None or (found["low"] is None and found["high"] is None):
        raise ValueError(
            f"{text!r}: {typed!r} must be a number, or LOW:HIGH of which one may be missing, and a "
            f"unit, as in {figure}=-2:5{_UNITS[figure]}."
        )
    low = -math.inf if found["low"] is None else float(found["low"])
    high = math.inf if found["high"] is None else float(found["high"])
    if found["colon"] and not low <= high:
        raise ValueError(f"{text!r}: the lower limit {low:g} is above the upper one, {high:g}.")
    if not found["colon"]:
        if found["high"] is not None:
            raise ValueError(f"{text!r}: two numbers need a colon between them, as in -2:5.")
        if low < 0:
            raise ValueError(f"{text!r}: one number limits the size, and must not be negative.")
        low, high = (low, math.inf) if figure in _AT_LEAST else (-low, low)
    return Limit(figure, low, high, _unit(text, figure, found["unit"]), typed.strip())


def check_limit(limit, lines):
    """Whether a figure keeps its limit, by the lines of a table of :func:`gyro_report`."""
    if limit.figure not in lines.index:
        return Check(limit, math.nan, "not measured", "the log does not give this figure")
    line = lines.loc[limit.figure]
    unit, wanted = line["unit"], rate_unit_of(line["unit"])
    factor = 1.0 if wanted is None else in_rate_unit(limit.unit, wanted)[1]
    limit = limit._replace(low=factor * limit.low, high=factor * limit.high, unit=unit)
    value, low, high = (line[name] for name in ("after", "after_low", "after_high"))
    if math.isnan(value):
        return Check(limit, value, "not measured", line["note"])
    is_kept = limit.keeps(value)
    is_sure = math.isnan(low) or limit.keeps(low) == limit.keeps(high) == is_kept
    remark = "" if is_sure else "its interval reaches over the limit"
    return Check(limit, value, "pass" if is_kept else "fail", remark)


def _unit(text, figure, typed):
    usual = _UNITS[figure]
    typed = "" if typed is None else typed.strip()
    for sign, name in _SPELLINGS:
        typed = typed.replace(sign, name)
    if rate_unit_of(usual) is not None:
        known = [in_rate_unit(usual, name)[0] for name in RATE_UNITS]
    else:
        known = [usual, "", "ppm"] if usual.startswith("ppm of") else [usual, ""]
    if typed in known:
        return typed if rate_unit_of(usual) is not None else usual
    wanted = " or ".join(filter(None, known))
    wanted = f"is in {wanted}" if wanted else "has no unit"
    raise ValueError(f"{text!r}: {figure} {wanted}; found {typed!r}.")


def _limit_of_option(text):
    try:
        return parse_limit(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _as_typed(value):
    if isinstance(value, Limit):
        return f"{value.figure}={value.text}"
    if isinstance(value, Path):
        return value.name
    if isinstance(value, list | tuple):
        return " ".join(map(_as_typed, value))
    return str(value)
