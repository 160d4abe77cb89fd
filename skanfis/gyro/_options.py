"""The options of the command, and its help."""

import argparse
import math
from pathlib import Path

from .. import __version__
from ._calibration import Recipe
from ._checks import PARTS, QUANTITIES
from ._columns import units_of
from ._console import UsageError, usage_errors
from ._guess import Request
from ._report_options import add_report_options
from ._split import KINDS
from .compensator import INPUTS
from .errors import shortened
from .log import checked_request

__all__ = ["PROGRAM", "make_parser", "parse_box", "request_of"]

PROGRAM = "python -m skanfis.gyro"
_MOST_RULES = 500  # a grid that could neither be told nor learnt
_MOST_JOBS = 1024  # more threads than any machine has cores for

_UNITS_OF_PARTS = ("\n" + 28 * " ").join(
    f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES
)
_HELP = f"""\
Calibrate a gyro from its logs: learn the error of its indicated rate (indicated minus true) from
what is known on board, its output, its temperature and how fast that changes, and the time since
power-on. The result is checked on whole runs, devices or rate levels that the model has not seen.

Written to a folder: the model (compensator.json), a report with tables and pictures for any browser
(report.html), and the rules as text (rules.txt).

LOG: text with a header, such as CSV, or Parquet: one log, or one file per run; a folder or a
pattern such as 'logs/*.csv' stands for its files

reading the log:
  --columns PART=NAME ...   names of the columns; parts: {", ".join(PARTS)}.
                            Parts that are not named are guessed by names and units. Needed are
                            temperature and output, and the rate (the truth) unless at rest
  --units PART=UNIT ...     units, by default those in the names, or s, degC and deg/s
                            {_UNITS_OF_PARTS}
  --encoding NAME           of the text, such as gbk (UTF-8, UTF-16 or Windows-1252)
  --device NAME             use the rows of this device only
  --max-gap S               a longer step of the time begins a new run, where no column tells runs
                            apart; inf for none (auto: a minute, and 50 usual steps)
  --average S               average the rows over so many seconds while they are read
  --at-rest                 the gyro did not turn: learn the bias; no rate is needed
  --scale-factor K          of a raw signal at rest, which does not tell it: counts per deg/s

the model:
  --inputs INPUT ...        of {", ".join(INPUTS)} (all that the log
                            has; time, since power-on, with three runs or more)
  --terms N,N,...           fuzzy terms per input; 'search' (default) grows them on held-out groups,
                            'auto' leaves them to ANFISRegressor
  --physics                 fit the arcsine law of open-loop fiber-optic gyros first, and let the
                            fuzzy rules learn what it leaves
  --jobs N                  threads for a fit (1); -1 is one per core

where it holds, and how it is checked:
  --outside POLICY          for rows outside the range of the calibration, which are flagged in any
                            case: hold the edge value (clip), go on along the tangent for a limited
                            way (linear, default), or give no rate (nan)
  --max-extrapolation SD    how far the rules follow the tangent beyond the range of an input, in
                            standard deviations; inf for without end (auto)
  --min-coverage SHARE      rows that the data cover less are flagged ({Recipe.min_coverage:g})
  --box INPUT=LOW:HIGH ...  box, such as temperature=-40:85, over which the report proves how large
                            the compensation can be, in s, degC, degC/s, and the output's unit
  --groups KIND             what to hold out in the check:
                            {", ".join(KINDS)}

output:
  --apply MODEL             compensate the logs by this compensator.json instead of calibrating
  --output PATH             folder to write to (LOG-compensator); with --apply the file
                            (LOG-compensated.csv)
  --c STD                   also write the model as C, compensator.h and .c, by c99 or c89
  --saturate                with --c: hold what the rules give between the limits that the report
                            has proven for the box (--box)
  --force                   replace files that exist
  --quiet                   no progress on stderr
  --version, --help         the version; this page
"""

_EPILOG = """\
examples:
  python -m skanfis.gyro log.csv
  python -m skanfis.gyro cold.csv warm.csv hot.csv --output gyro7
  python -m skanfis.gyro logs/ --average 1 --output gyro7
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
        encoding=options.encoding,
        guess=True,
        drop_missing=True,
        average=options.average,
        device=options.device,
    )
    with usage_errors():
        return checked_request(request)


def _number(kind, is_valid, what, *words):
    """A type of option: a number for which ``is_valid`` holds, or one of the words."""

    def parse(text):
        if text in words:
            return text
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not is_valid(value):
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


_SECONDS = _number(float, lambda s: 1e-9 <= s <= 1e9, "a number from 1e-9 to 1e9")
_SHARE = _number(float, lambda s: 0 <= s <= 1, "a number from 0 to 1")
_GAP = _number(float, lambda s: s > 0, "auto, a positive number, or inf", "auto")
_EXTENT = _number(float, lambda s: s >= 0, "a number, zero or positive, or inf, or auto", "auto")
_JOBS = _number(
    int,
    lambda n: 1 <= n <= _MOST_JOBS or n == -1,
    f"a whole number, 1 or more, or -1 for one per core; at most {_MOST_JOBS}",
)
_FACTOR = _number(
    float, lambda k: 1e-30 <= abs(k) <= 1e30, "a number from 1e-30 to 1e30, or such a negative one"
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
    add("--encoding")
    add("--device")
    add("--max-gap", type=_GAP, default="auto")
    add("--average", type=_SECONDS)
    add("--scale-factor", type=_FACTOR)
    add("--inputs", nargs="+", choices=INPUTS)
    add("--terms", type=_terms, default="search")
    add("--jobs", type=_JOBS)
    add("--outside", choices=("clip", "linear", "nan"), default=Recipe.outside)
    add("--max-extrapolation", type=_EXTENT, default=Recipe.max_extrapolation)
    add("--min-coverage", type=_SHARE, default=Recipe.min_coverage)
    add("--box", type=parse_box, **several)
    add("--groups", choices=KINDS, default="auto")
    add("--apply")
    add("--output", type=Path)
    add("--c", choices=("c99", "c89"))
    for flag in ("--at-rest", "--physics", "--saturate", "--force", "--quiet"):
        add(flag, action="store_true")
    add_report_options(parser)
    return parser
