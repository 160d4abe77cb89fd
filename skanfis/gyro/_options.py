"""The options of the command, and its help."""

import argparse
import math
from pathlib import Path

from ._calibration import MAX_EXTRAPOLATION
from ._dossier import add_report_options
from ._split import KINDS
from ._units import units_of
from .compensator import INPUTS
from .log import COLUMNS, QUANTITIES

__all__ = ["PROGRAM", "make_parser"]

PROGRAM = "python -m skanfis.gyro"

_DESCRIPTION = """\
Calibrate a gyro from logs in CSV: learn the error of its indicated rate (indicated minus true) from
what is known on board, its output, its temperature and how fast that changes, and the time since
power-on. The result is checked on whole runs, devices or rate levels that the model has not seen.

Written to a folder: the model (compensator.json, and compensator.joblib as a Python object), a
report with tables and pictures for any browser (report.html), and the rules as text (rules.txt).
"""

# A grid that could neither be told nor learnt: the search takes 36.
_MOST_RULES = 500

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

security: --apply reads every file as JSON first, that is as data, and runs nothing of it. Only a
file whose name ends in .joblib is unpickled where it is no JSON: unpickling runs whatever code the
file holds, with all your rights. Apply such a file only if you, or someone whom you trust, have
written it.
"""


def make_parser():
    """The parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        usage=f"{PROGRAM} LOG.csv [LOG.csv ...] [options]\n"
        f"       {PROGRAM} --apply MODEL LOG.csv [LOG.csv ...] [options]",
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
    reading.add_argument(
        "--separator",
        type=_sign,
        default=",",
        metavar="SIGN",
        help=r"between columns (,); \t for a tab",
    )
    reading.add_argument(
        "--decimal", type=_sign, default=".", metavar="SIGN", help="of decimal fractions (.)"
    )
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
        default="linear",
        help="policy for rows outside the range of the calibration, which are flagged in any case: "
        "hold the edge value (clip), go on along the tangent for a limited way (linear, default), "
        "or give no rate (nan)",
    )
    model.add_argument(
        "--max-extrapolation",
        type=_extent,
        default=MAX_EXTRAPOLATION,
        metavar="SD",
        help="how far the rules follow the tangent beyond the range of an input, in its standard "
        f"deviations; inf for without end ({MAX_EXTRAPOLATION:g})",
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
        type=_seconds,
        default=30.0,
        metavar="S",
        help="of the low-pass of the temperature's rate (30)",
    )
    model.add_argument(
        "--max-rules",
        type=_rules,
        default=36,
        metavar="N",
        help=f"most rules of a search (36); {_MOST_RULES} at most",
    )
    model.add_argument(
        "--fit-rows",
        type=_count,
        default=100_000,
        metavar="N",
        help="fit to so many rows, chosen at random, of a longer log (100000); all are checked",
    )
    model.add_argument(
        "--jobs", type=_jobs, metavar="N", help="threads for a fit (1); -1 is one per core"
    )
    parser.add_argument(
        "--groups",
        choices=KINDS,
        default="auto",
        help="what to hold out in the check; by default (auto) devices where there are three or "
        "more, else runs, and rate levels where these could be learnt by heart",
    )
    add_report_options(parser)
    output = parser.add_argument_group("output")
    output.add_argument(
        "--apply",
        metavar="MODEL",
        help="compensate the logs by this model (compensator.json) instead of calibrating; a "
        "column for the rate is not needed, and is compared with where it is there. A .joblib file "
        "is taken too, and can run any code: see below",
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


def _terms(text):
    if text in ("search", "auto"):
        return text
    try:
        terms = tuple(int(part) for part in text.split(","))
    except ValueError:
        terms = ()
    if not terms or min(terms) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} must be search, auto, or numbers such as 2,3,3")
    n_rules = math.prod(terms)
    if n_rules > _MOST_RULES:
        raise argparse.ArgumentTypeError(
            f"{text} makes {n_rules:,} rules; at most {_MOST_RULES} are learnt. Use fewer terms"
        )
    return terms


def _sign(text):
    sign = "\t" if text == r"\t" else text
    if (
        len(sign) != 1
        or sign.isalnum()
        or not (sign.isprintable() or sign == "\t")
        or sign in "\"'+-"
    ):
        raise argparse.ArgumentTypeError(
            f"{text!r} must be one sign, such as a comma, and neither letter, digit, quote, + nor -"
        )
    return sign


def _positive(text):
    return _number(text, float, lambda value: 0 < value < math.inf, "a positive number")


def _extent(text):
    return _number(text, float, lambda value: value >= 0, "a number, zero or positive, or inf")


def _seconds(text):
    return _number(text, float, lambda value: 1e-9 <= value <= 1e9, "a number from 1e-9 to 1e9")


def _rules(text):
    what = f"a whole number from 1 to {_MOST_RULES}"
    return _number(text, int, lambda value: 1 <= value <= _MOST_RULES, what)


def _jobs(text):
    what = "a whole number, 1 or more, or -1 for one per core"
    return _number(text, int, lambda value: value >= 1 or value == -1, what)


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
