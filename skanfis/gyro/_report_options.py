"""What the command is told for its report: whose gyro, in which unit, and limits to be kept.

A limit is FIGURE=VALUE: bias=5deg/h says that the bias is 5 deg/h at most, without its sign.
"""

import hashlib
import math
import re
from argparse import ArgumentTypeError
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from ._columns import RATE_UNITS, in_rate_unit, rate_unit_of
from .metrics import ALLAN_FIGURES, figures_of_merit

__all__ = [
    "Check",
    "Limit",
    "ReportOptions",
    "add_report_options",
    "check_limit",
    "parse_limit",
    "report_options",
]

_FORM = re.compile(r"\s*(?P<value>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*")
_SPELLINGS = (("°C", "degC"), ("°", "deg"), ("√h", "sqrt(h)"))
_UNITS = {figure.name: figure.unit for figure in figures_of_merit()} | ALLAN_FIGURES
_AT_LEAST = ("reduction_factor",)  # of this more is better


class Limit(NamedTuple):
    """The size that a figure may have at most, or at least; ``text`` is what was typed of it."""

    figure: str
    value: float
    unit: str
    text: str

    def keeps(self, value):
        """Whether a value in the limit's unit keeps it."""
        return bool(value >= self.value if self.figure in _AT_LEAST else abs(value) <= self.value)


class Check(NamedTuple):
    """A limit, the figure in its unit, and "pass", "fail" or "not measured"."""

    limit: Limit
    value: float
    result: str
    remark: str


class ReportOptions(NamedTuple):
    """All may be missing. ``files`` have a name, a size [bytes] and the SHA-256 of their bytes."""

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
        type=parse_limit,
        default=[],
        metavar="FIGURE=VALUE",
        help="limits of the specification for figures of merit after compensation, with units, as "
        "in residual_rms=0.01deg/s (at most), reduction_factor=10 (at least)",
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
    """A limit such as ``bias=5deg/h``; ArgumentTypeError where it is none."""
    figure, _, typed = text.partition("=")
    if figure not in _UNITS:
        raise ArgumentTypeError(
            f"{text!r} must be FIGURE=VALUE, with a figure of merit of: {', '.join(_UNITS)}."
        )
    usual, found = _UNITS[figure], _FORM.fullmatch(typed)
    if found is None:
        raise ArgumentTypeError(
            f"{text!r}: {typed!r} must be a number, not negative, and a unit, as in "
            f"{figure}=5{usual}."
        )
    unit = found["unit"]
    for sign, name in _SPELLINGS:
        unit = unit.replace(sign, name)
    known = [in_rate_unit(usual, name)[0] for name in RATE_UNITS]
    if rate_unit_of(usual) is None:
        # Without its unit, and "ppm" alone, it is clear as well.
        known = [usual, "", usual.partition(" ")[0]]
    if unit not in known:
        wanted = " or ".join(filter(None, dict.fromkeys(known)))
        wanted = f"is in {wanted}" if wanted else "has no unit"
        raise ArgumentTypeError(f"{text!r}: {figure} {wanted}; found {unit!r}.")
    unit = unit if rate_unit_of(usual) else usual
    return Limit(figure, float(found["value"]), unit, typed.strip())


def check_limit(limit, lines):
    """Whether a figure keeps its limit, by the lines of a table of :func:`gyro_report`."""
    if limit.figure not in lines.index:
        return Check(limit, math.nan, "not measured", "the log does not give this figure")
    line, wanted = lines.loc[limit.figure], rate_unit_of(limit.unit)
    factor = 1.0 if wanted is None else in_rate_unit(line["unit"], wanted)[1]
    value, low, high = (factor * line[name] for name in ("after", "after_low", "after_high"))
    if math.isnan(value):
        return Check(limit, value, "not measured", line["note"])
    is_kept = limit.keeps(value)
    is_sure = math.isnan(low) or limit.keeps(low) == limit.keeps(high) == is_kept
    remark = "" if is_sure else "its interval reaches over the limit"
    return Check(limit, value, "pass" if is_kept else "fail", remark)


def _as_typed(value):
    if isinstance(value, Limit):
        return f"{value.figure}={value.text}"
    if isinstance(value, Path):
        return value.name
    if isinstance(value, list | tuple):
        return " ".join(map(_as_typed, value))
    return str(value)
