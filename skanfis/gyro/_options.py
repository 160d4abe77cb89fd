"""The options of the command, limits of a specification among them.

A limit is FIGURE=VALUE: bias=5deg/h says that the bias is 5 deg/h at most, without its sign.
"""

import argparse
import contextlib
import math
import re
from argparse import ArgumentTypeError
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..export.limits import shown
from ._calibration import Recipe
from ._checks import PARTS, QUANTITIES
from ._columns import RATE_UNITS, in_rate_unit, rate_unit_of, units_of
from ._guess import Request
from ._simpler import NAMES
from ._split import KINDS
from .compensator import INPUTS
from .displays import signs
from .errors import UsageError
from .metrics import ALLAN_FIGURES, figures_of_merit

PROGRAM = "python -m skanfis.gyro"
_MOST_RULES = 500  # a larger grid could be neither shown nor learnt
_FORM = re.compile(r"\s*(?P<value>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)\s*(?P<unit>.*?)\s*")
_UNITS = {figure.name: figure.unit for figure in figures_of_merit()} | ALLAN_FIGURES
_AT_LEAST = ("reduction_factor",)  # figures of which more is better

_TARGET = re.compile(
    r"(rate-)?table(:(float|double|q31|q15))?|px4:[xyz](:[0-3](:\d+)?)?|ardupilot:[xyz](:[1-3])?"
)
_TARGETS = (
    "table[:TYPE], in C over temperature; rate-table[:TYPE], in C over temperature and output; "
    "TYPE is float, double, q31 or q15; px4:AXIS[:INSTANCE[:DEVICE_ID]] or "
    "ardupilot:AXIS[:INSTANCE], parameters of one axis, x, y or z; INSTANCE is the number of the "
    "gyro, from 0 to 3 for PX4 and from 1 to 3 for ArduPilot"
)
_OF_OUTSIDE = (
    "what rows outside the range get, which are flagged: clip holds the value at the edge; linear "
    "(default) follows the tangent for a while, but holds a cubic; nan gives no rate"
)
_WHAT = """\
Calibrate a gyro from its logs. The command learns the error, indicated minus true rate, from what
is known on board: the output, the temperature, its rate of change, and the time since power-on. It
checks the result on whole runs, devices or rate levels that the model has not seen.

It writes a folder with the model (compensator.json), a report with tables and pictures for any
browser (report.html), and the rules as text (rules.txt).
"""
_EPILOG = """\
examples:
  python -m skanfis.gyro logs/*.csv --output gyro7
  python -m skanfis.gyro log.csv --columns time=t_ms temperature=temp output=counts rate=table \\
      --units time=ms output=counts
  python -m skanfis.gyro --apply gyro7/compensator.json flight.csv --output flight-rates.csv

exit codes:
  0  done    1  failed, such as a disk that is full    2  options that make no sense
  3  the log was refused    4  a file exists already (--force replaces it)
  5  a target was refused; all else is written
  6  all is written; a limit is not met, or could not be measured
  130  interrupted by Ctrl-C    141  nobody reads the output any more, as behind a pipe to head
"""


def make_parser():
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        usage=f"{PROGRAM} LOG [LOG ...] [options]\n"
        f"       {PROGRAM} --apply MODEL LOG [LOG ...] [options]",
        description=_WHAT,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    several = {"nargs": "+", "action": "extend", "default": []}
    units = "; ".join(f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES)
    parser.add_argument("--version", action="version", version=f"skanfis {__version__}")

    def add(name, told, **settings):
        group.add_argument(name, help=told, **settings)

    group = parser.add_argument_group("reading the log")
    told = "text with a header (CSV, .lvm), .mat, .xlsx or Parquet; one log, or one file a run"
    add("logs", told, nargs="+", metavar="LOG")
    told = f"the column of each part: {', '.join(PARTS)} (default: guessed from names and units)"
    add("--columns", told, metavar="PART=NAME", **several)
    told = f"the unit of each part (default: from the columns' names, or their values). {units}"
    add("--units", told, metavar="PART=UNIT", **several)
    told = "of a raw signal, as in counts per deg/s; needed only if the log has a single rate"
    add("--scale-factor", told, type=_scale_factor)
    group = parser.add_argument_group("the model")
    told = "inputs of the model (default: all in the log, but time only with three runs or more)"
    add("--inputs", told, nargs="+", choices=INPUTS)
    told = "fuzzy terms of each input, such as 2,1,3 (default: search, which finds the rules)"
    add("--terms", told, type=_terms, default="search")
    told = "first fit the arcsine law of open-loop fiber-optic gyros; rules learn what it leaves"
    add("--physics", told, action="store_true")
    group = parser.add_argument_group("where it holds, and how it is checked")
    add("--outside", _OF_OUTSIDE, choices=("clip", "linear", "nan"), default=Recipe.outside)
    told = "what is held out (default: auto, what suits the log)"
    add("--groups", told, choices=KINDS, default="auto")
    group = parser.add_argument_group("the report")
    add("--serial", "serial number of the gyro", default="")
    add("--operator", "who made the calibration", default="")
    told = "of the specification: residual_rms=0.01deg/s is the most, reduction_factor=10 the least"
    add("--limits", told, type=parse_limit, metavar="FIGURE=VALUE", **several)
    add("--pdf", "also write the report as report.pdf", action="store_true")
    group = parser.add_argument_group("output")
    told = "compensate the logs by this compensator.json instead of calibrating"
    add("--apply", told, metavar="MODEL")
    told = "folder to write (default: LOG-compensator); with --apply the file (LOG-compensated.csv)"
    add("--output", told, type=Path)
    told = "which compensation: the recommended one (default), the rules, or a simpler one"
    add("--write", told, choices=("recommended", "rules", *NAMES), default=Recipe.write)
    stds = ("c99", "c89", "c99:float", "c89:float")
    add("--c", "also write C code of this standard, in double or in float", choices=stds)
    told = f"also write a simple function in place of the model, if it is good enough: {_TARGETS}"
    add("--target", told, type=_target, **several)
    told = "replace files that exist, and remove those of an earlier run that are not written anew"
    add("--force", told, action="store_true")
    add("--quiet", "no progress on stderr", action="store_true")
    return parser


def check_kind(parser, options):
    """Raise UsageError for options that have no effect with --apply."""
    idle = vars(options).keys() - {"logs", "columns", "units", "output", "force", "quiet", "apply"}
    given = [name for name in sorted(idle) if getattr(options, name) != parser.get_default(name)]
    if options.apply and given:
        named = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise UsageError(f"{named}: for a calibration only. Leave this out with --apply.")


def request_of(options, require, assumed=None, optional=()):
    """What to read, as the options say; UsageError for an unknown part or unit.

    ``assumed`` are units of columns that name none; None leaves them to the values. Rows that lack
    a value of the ``optional`` parts are kept.
    """
    columns = _pairs(options.columns, "--columns", "NAME")
    units = _pairs(options.units, "--units", "UNIT")
    try:
        return Request(columns, units, tuple(require), True, assumed, optional)
    except ValueError as error:
        raise UsageError(str(error)) from error


def _pairs(texts, option, value):
    """Options of the form PART=NAME, or UNIT, as a dict."""
    pairs = [text.partition("=") for text in texts]
    for text, pair in zip(texts, pairs, strict=True):
        if not all(pair):
            raise UsageError(f"{option}: {text!r} must be of the form PART={value}.")
    check_once(option, [part for part, *_ in pairs])
    return {part: name for part, _, name in pairs}


def check_once(option, names):
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"{option}: {name} is given twice.")


def _target(text):
    if not _TARGET.fullmatch(text):
        raise ArgumentTypeError(f"{shown(text)} must be one of: {_TARGETS}")
    return text


def _scale_factor(text):
    value = math.nan
    with contextlib.suppress(ValueError):
        value = float(text)
    if not 1e-30 <= abs(value) <= 1e30:
        raise ArgumentTypeError(f"{shown(text)} must be a number of size 1e-30 to 1e30")
    return value


def _terms(text):
    if text == "search":
        return text
    numbers: tuple[int, ...] = ()
    with contextlib.suppress(ValueError):
        numbers = tuple(int(part) for part in text.split(","))
    if not numbers or min(numbers) < 1:
        raise ArgumentTypeError(f"{shown(text)} must be search, or numbers such as 2,3,3")
    n_rules = math.prod(numbers)
    if n_rules > _MOST_RULES:
        made = f"{n_rules:,}" if n_rules < 10**15 else "too many"
        raise ArgumentTypeError(f"{shown(text)} makes {made} rules; give at most {_MOST_RULES}")
    return numbers


class Limit(NamedTuple):
    """The largest, or smallest, size that a figure may have; ``number`` is the value as typed."""

    figure: str
    value: float
    unit: str
    number: str

    def keeps(self, value):
        return bool(value >= self.value if self.figure in _AT_LEAST else abs(value) <= self.value)


def parse_limit(text):
    """Parse a limit such as ``bias=5deg/h``; ArgumentTypeError if it is none."""
    figure, _, typed = text.partition("=")
    if figure not in _UNITS:
        raise ArgumentTypeError(f"{text!r} must be FIGURE=VALUE; figures: {', '.join(_UNITS)}.")
    usual, found = _UNITS[figure], _FORM.fullmatch(typed)
    if found is None:
        raise ArgumentTypeError(
            f"{text!r}: {typed!r} must be a number, not negative, and a unit, as in "
            f"{figure}=5{usual}."
        )
    wanted = dict.fromkeys(in_rate_unit(usual, rate)[0] for rate in RATE_UNITS)
    known = {signs(name): name for name in wanted}
    if rate_unit_of(usual) is None:
        # Also clear: no unit at all, or its first word, such as "ppm".
        known |= {"": usual, usual.partition(" ")[0]: usual}
    unit = known.get(signs(found["unit"]))
    if unit is None:
        takes = " or ".join(filter(None, wanted)) or "no unit"
        raise ArgumentTypeError(f"{text!r}: {figure} takes {takes}; found {found['unit']!r}.")
    return Limit(figure, float(found["value"]), unit, found["value"])


class Check(NamedTuple):
    """A limit, the figure in its unit, and "pass", "fail" or "not measured"."""

    limit: Limit
    value: float
    result: str
    remark: str


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
    # The smallest size in the interval is at an end, or zero.
    ends = (low, high, min(max(0.0, low), high))
    is_sure = math.isnan(low) or all(limit.keeps(end) == is_kept for end in ends)
    remark = "" if is_sure else "the limit is within its interval"
    return Check(limit, value, "pass" if is_kept else "fail", remark)
