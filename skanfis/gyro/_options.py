"""The options of the command, and its help."""

import argparse
import math
from pathlib import Path

from .. import __version__
from ._calibration import Recipe
from ._checks import PARTS, QUANTITIES
from ._columns import units_of
from ._console import usage_errors
from ._guess import Request
from ._report_options import add_report_options
from ._split import KINDS
from .compensator import INPUTS
from .errors import UsageError, shortened
from .log import checked_request

__all__ = ["PROGRAM", "make_parser", "parse_box", "request_of"]

PROGRAM = "python -m skanfis.gyro"
_MOST_RULES = 500  # a grid that could neither be told nor learnt

_UNITS_OF_PARTS = ("\n" + 28 * " ").join(
    f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES
)
_HELP = f"""\
Calibrate a gyro from its logs: learn the error of its indicated rate (indicated minus true) from
what is known on board, its output, its temperature and how fast that changes, and the time since
power-on. The result is checked on whole runs, devices or rate levels that the model has not seen.

Written to a folder: the model (compensator.json), a report with tables and pictures for any browser
(report.html), and the rules as text (rules.txt).

LOG: text with a header, such as CSV, or Parquet: one log, or one file per run

reading the log:
  --columns PART=NAME ...   names of the columns; parts: {", ".join(PARTS)}.
                            Parts that are not named are guessed by names and units
  --units PART=UNIT ...     units, by default those in the names, or s, degC and deg/s
                            {_UNITS_OF_PARTS}
  --scale-factor K          of a raw signal at rest, which does not tell it: counts per deg/s

the model:
  --inputs INPUT ...        of {", ".join(INPUTS)} (all that the log
                            has; time, since power-on, with three runs or more)
  --terms N,N,...           fuzzy terms per input; 'search' (default) grows them on held-out groups,
                            'auto' leaves them to ANFISRegressor
  --physics                 fit the arcsine law of open-loop fiber-optic gyros first, and let the
                            fuzzy rules learn what it leaves

where it holds, and how it is checked:
  --outside POLICY          beyond the range of the calibration: hold the value at its edge (clip),
                            go on along the tangent for a while (linear, default), or give no rate
                            (nan); such rows are flagged in any case
  --min-coverage SHARE      rows that the data cover less are flagged ({Recipe.min_coverage:g})
  --box INPUT=LOW:HIGH ...  where the report proves how large the compensation can be
  --groups KIND             what to hold out: {", ".join(KINDS)}

output:
  --apply MODEL             compensate the logs by this compensator.json instead of calibrating
  --output PATH             folder to write to (LOG-compensator); with --apply the file
                            (LOG-compensated.csv)
  --c STD                   also write the model as C, compensator.h and .c, by c99 or c89
  --saturate                with --c: hold what the rules give between the proven limits
  --force                   replace files that exist
  --quiet                   no progress on stderr
  --version, --help         the version; this page
"""

_EPILOG = """\
examples:
  python -m skanfis.gyro log.csv
  python -m skanfis.gyro cold.csv warm.csv hot.csv --output gyro7
  python -m skanfis.gyro logs/*.csv --output gyro7
  python -m skanfis.gyro log.csv --columns time=t_ms temperature=temp output=counts rate=table \\
      --units time=ms output=counts
  python -m skanfis.gyro --apply gyro7/compensator.json flight.csv --output flight-rates.csv

exit codes:
  0  done    1  failed, such as a disk that is full    2  options that make no sense
  3  the log was refused    4  a file exists already (--force replaces it)
"""


def _pairs(texts, option):
    """Options of the form PART=NAME as a dict."""
    found = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not (key and equals and value):
            raise UsageError(f"{option}: {text!r} must be of the form PART=...")
        if key in found:
            raise UsageError(f"{option}: {key} is given twice.")
        found[key] = value
    return found


def request_of(options, require):
    """What the options ask of a reading; UsageError where they name an unknown part or unit."""
    request = Request(
        columns=_pairs(options.columns, "--columns"),
        units=_pairs(options.units, "--units"),
        require=tuple(require),
        guess=True,
    )
    with usage_errors():
        return checked_request(request)


def _number(is_valid, what):
    """A type of option: a number for which ``is_valid`` holds."""

    def parse(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not is_valid(value):
            raise argparse.ArgumentTypeError(f"{shortened(text)} must be {what}")
        return value

    return parse


def _terms(text):
    if text in ("search", "auto"):
        return text
    try:
        numbers = tuple(int(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or min(numbers) < 1:
        raise argparse.ArgumentTypeError(
            f"{shortened(text)} must be search, auto, or numbers such as 2,3,3"
        )
    n_rules = math.prod(numbers)
    if n_rules > _MOST_RULES:
        made = f"{n_rules:,}" if n_rules < 10**15 else "too many"
        raise argparse.ArgumentTypeError(
            f"{shortened(text, str)} makes {made} rules; at most {_MOST_RULES} are learnt. Use "
            "fewer terms"
        )
    return numbers


def parse_box(text):
    name, _, ends = text.partition("=")
    try:
        low, high = map(float, ends.split(":"))
    except ValueError:
        low = high = math.nan
    if not (name and -math.inf < low <= high < math.inf):
        raise argparse.ArgumentTypeError(
            f"{shortened(text)} must be INPUT=LOW:HIGH, two numbers, such as temperature=-40:85"
        )
    return name, low, high


_SHARE = _number(lambda s: 0 <= s <= 1, "a number from 0 to 1")
_FACTOR = _number(
    lambda k: 1e-30 <= abs(k) <= 1e30, "a number from 1e-30 to 1e30, or such a negative one"
)


def make_parser():
    """The parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        usage=f"{PROGRAM} LOG [LOG ...] [options]\n"
        f"       {PROGRAM} --apply MODEL LOG [LOG ...] [options]",
        description=_HELP,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )

    def add(name, **settings):
        parser.add_argument(name, help=argparse.SUPPRESS, **settings)

    several = {"nargs": "+", "action": "extend", "default": []}
    parser.add_argument("-h", "--help", action="help", help=argparse.SUPPRESS)
    add("--version", action="version", version=f"skanfis {__version__}")
    add("logs", nargs="+", metavar="LOG")
    add("--columns", **several)
    add("--units", **several)
    add("--scale-factor", type=_FACTOR)
    add("--inputs", nargs="+", choices=INPUTS)
    add("--terms", type=_terms, default="search")
    add("--outside", choices=("clip", "linear", "nan"), default=Recipe.outside)
    add("--min-coverage", type=_SHARE, default=Recipe.min_coverage)
    add("--box", type=parse_box, **several)
    add("--groups", choices=KINDS, default="auto")
    add("--apply")
    add("--output", type=Path)
    add("--c", choices=("c99", "c89"))
    for flag in ("--physics", "--saturate", "--force", "--quiet"):
        add(flag, action="store_true")
    add_report_options(parser)
    return parser
