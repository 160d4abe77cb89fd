"""The options of the command, and its help."""

import argparse
import codecs
import math
from pathlib import Path

from .. import __version__
from ._calibration import Recipe
from ._checks import PARTS, QUANTITIES
from ._columns import units_of
from ._console import UsageError, usage_errors
from ._dossier import add_report_options
from ._guess import Request
from ._split import KINDS
from .compensator import INPUTS
from .errors import shortened
from .log import checked_request

__all__ = ["PROGRAM", "make_parser", "pairs", "request_of"]

PROGRAM = "python -m skanfis.gyro"
_MOST_RULES = 500  # a grid that could neither be told nor learnt
_MOST_JOBS = 1024  # more threads than any machine has cores for
_LONGEST_AXIS = 20  # it becomes part of file names

_DESCRIPTION = """\
Calibrate a gyro from its logs: learn the error of its indicated rate (indicated minus true) from
what is known on board, its output, its temperature and how fast that changes, and the time since
power-on. The result is checked on whole runs, devices or rate levels that the model has not seen.

Written to a folder: the model (compensator.json, and compensator.joblib as a Python object), a
report with tables and pictures for any browser (report.html), and the rules as text (rules.txt).
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

security: --apply reads every file as JSON first, that is as data, and runs nothing of it. Only a
file whose name ends in .joblib is unpickled where it is no JSON: unpickling runs whatever code the
file holds, with all your rights. Apply such a file only if you, or someone whom you trust, have
written it.
"""


def make_parser():
    """The parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        usage=f"{PROGRAM} LOG [LOG ...] [options]\n"
        f"       {PROGRAM} --apply MODEL LOG [LOG ...] [options]",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"skanfis {__version__}")
    parser.add_argument(
        "logs",
        nargs="+",
        metavar="LOG",
        help="text with a header, such as CSV, or Parquet: one log, or one file per run; a folder "
        "or a pattern such as 'logs/*.csv' stands for its files",
    )
    for title, options in _GROUPS.items():
        group = parser.add_argument_group(title)
        for name, settings in options.items():
            group.add_argument(name, **settings)
    add_report_options(parser)
    return parser


def pairs(texts, option):
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


def request_of(options, require, columns=None):
    """What the options ask of a reading; UsageError where they name an unknown part or unit."""
    request = Request(
        columns=pairs(options.columns, "--columns") | (columns or {}),
        units=pairs(options.units, "--units"),
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


def _encoding(text):
    try:
        is_text = isinstance(codecs.lookup(text).incrementaldecoder().decode(b""), str)
    except (LookupError, ValueError, TypeError):
        is_text = False
    if not is_text:
        raise argparse.ArgumentTypeError(f"{shortened(text)} is no encoding of text that is known")
    return text


def _axis(text):
    letter, equals, name = text.partition("=")
    # It becomes a folder's name.
    plain = letter.isascii() and letter.isalnum() and len(letter) <= _LONGEST_AXIS
    if not plain or bool(equals) != bool(name):
        raise argparse.ArgumentTypeError(f"{shortened(text)} must be such as x or x=NAME")
    return text


def _box(text):
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


_SEVERAL = {"nargs": "+", "action": "extend", "default": []}
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

_GROUPS: dict[str, dict[str, dict]] = {
    "reading the log": {
        "--columns": {
            **_SEVERAL,
            "metavar": "PART=NAME",
            "help": f"names of the columns; parts: {', '.join(PARTS)}. A part that is not named is "
            "guessed by names and units, and the guess is told. Needed are temperature and output; "
            "the rate (the truth) unless the gyro was at rest; time for inputs that need it",
        },
        "--units": {
            **_SEVERAL,
            "metavar": "PART=UNIT",
            "help": "units of the columns, by default those in their names, or s, degC and deg/s. "
            + "; ".join(f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES),
        },
        "--axes": {
            "nargs": "+",
            "type": _axis,
            "metavar": "AXIS[=NAME]",
            "help": "calibrate several axes, each by itself, into a folder of its own: letters, "
            "and the columns of their outputs where these are not guessed; by default all found",
        },
        "--encoding": {
            "type": _encoding,
            "metavar": "NAME",
            "help": "of the text, such as gbk; by default UTF-8, UTF-16 or Windows-1252",
        },
        "--device": {"metavar": "NAME", "help": "use the rows of this device only"},
        "--max-gap": {
            "type": _GAP,
            "default": "auto",
            "metavar": "S",
            "help": "a longer step of the time begins a new run, where no column tells runs apart; "
            "inf for none (auto: a minute, and 50 usual steps)",
        },
        "--average": {
            "type": _SECONDS,
            "metavar": "S",
            "help": "average the rows over so many seconds while they are read",
        },
        "--at-rest": {
            "action": "store_true",
            "help": "the gyro did not turn: the log needs no column for the rate, and the bias is "
            "learnt. Found out where there is no rate, or one of zero",
        },
        "--scale-factor": {
            "type": _FACTOR,
            "metavar": "K",
            "help": "of a raw signal at rest, which does not tell it: counts (V, mV) per deg/s",
        },
    },
    "the model": {
        "--inputs": {
            "nargs": "+",
            "choices": INPUTS,
            "metavar": "INPUT",
            "help": f"of {', '.join(INPUTS)}; by default all that the log has, and time (since "
            "power-on) only with three runs or more. Without output, the bias alone is learnt",
        },
        "--terms": {
            "type": _terms,
            "default": "search",
            "metavar": "N,N,...",
            "help": "fuzzy terms per input; 'search' (default) grows them on held-out groups, "
            "'auto' leaves them to ANFISRegressor",
        },
        "--physics": {
            "action": "store_true",
            "help": "for open-loop fiber-optic gyros: fit the arcsine law first, and let the fuzzy "
            "rules learn what it leaves",
        },
        "--jobs": {
            "type": _JOBS,
            "metavar": "N",
            "help": "threads for a fit (1); -1 is one per core",
        },
    },
    "where it holds, and how it is checked": {
        "--outside": {
            "choices": ("clip", "linear", "nan"),
            "default": Recipe.outside,
            "help": "policy for rows outside the range of the calibration, which are flagged in "
            "any case: hold the edge value (clip), go on along the tangent for a limited way "
            "(linear, default), or give no rate (nan)",
        },
        "--max-extrapolation": {
            "type": _EXTENT,
            "default": Recipe.max_extrapolation,
            "metavar": "SD",
            "help": "how far the rules follow the tangent beyond the range of an input, in its "
            "standard deviations; inf for without end; auto for as many as the outermost rows "
            f"speak for, half a one at least ({Recipe.max_extrapolation})",
        },
        "--min-coverage": {
            "type": _SHARE,
            "default": Recipe.min_coverage,
            "metavar": "SHARE",
            "help": f"rows that the data cover less are flagged ({Recipe.min_coverage:g})",
        },
        "--box": {
            **_SEVERAL,
            "type": _box,
            "metavar": "INPUT=LOW:HIGH",
            "help": "box of inputs, such as temperature=-40:85, over which the report proves how "
            "large the compensation can be; of others the range of the calibration. Units: s, "
            "degC, degC/s, and that of the output",
        },
        "--groups": {
            "choices": KINDS,
            "default": "auto",
            "help": "what to hold out in the check; by default (auto) devices where there are "
            "three or more, else runs, and rate levels where these could be memorised; of a single "
            "run legs of the temperature's cycles, or pieces of them",
        },
    },
    "output": {
        "--apply": {
            "metavar": "MODEL",
            "help": "compensate the logs by this model (compensator.json) instead of calibrating; "
            "a column for the rate is not needed, and is compared with where it is there. A "
            ".joblib file is taken too, and can run any code: see below",
        },
        "--output": {
            "type": Path,
            "metavar": "PATH",
            "help": "folder to write to (LOG-compensator); with --apply the file "
            "(LOG-compensated.csv)",
        },
        "--c": {
            "choices": ("c99", "c89"),
            "metavar": "STD",
            "help": "also write the model as C (compensator.h, compensator.c) by the standard c99 "
            "or c89",
        },
        "--saturate": {
            "action": "store_true",
            "help": "with --c: hold what the rules give between the limits that the report has "
            "proven for the box (--box)",
        },
        "--force": {"action": "store_true", "help": "replace files that exist"},
        "--quiet": {"action": "store_true", "help": "no progress on stderr"},
    },
}
