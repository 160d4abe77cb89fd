"""The options of the command, and its help."""

import argparse
from pathlib import Path

from .. import __version__
from ._calibration import Recipe
from ._checks import QUANTITIES
from ._layout import COLUMNS
from ._option_types import (
    MOST_RULES,
    axis,
    box,
    count,
    encoding,
    extent,
    factor,
    gap,
    jobs,
    positive,
    rules,
    seconds,
    share,
    sign,
    terms,
)
from ._report_options import add_report_options
from ._split import KINDS
from ._units import units_of
from .compensator import INPUTS

__all__ = ["PROGRAM", "make_parser"]

PROGRAM = "python -m skanfis.gyro"

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
    _add_reading(parser.add_argument_group("reading the log"))
    _add_rows(parser.add_argument_group("rows"))
    _add_model(parser.add_argument_group("the model"))
    _add_range(parser.add_argument_group("where it holds, and how it is checked"))
    add_report_options(parser)
    _add_output(parser.add_argument_group("output"))
    return parser


def _add_reading(group):
    group.add_argument(
        "--columns",
        nargs="+",
        action="extend",
        default=[],
        metavar="PART=NAME",
        help=f"names of the columns; parts: {', '.join(COLUMNS)}. A part that is not named is "
        "guessed by names, units and values, and the guess is told. Needed are temperature and "
        "output; the rate (the truth) unless the gyro was at rest; time for inputs that need it",
    )
    group.add_argument(
        "--units",
        nargs="+",
        action="extend",
        default=[],
        metavar="PART=UNIT",
        help="units of the columns, by default those in their names, or s, degC and deg/s. "
        + "; ".join(f"{part}: {', '.join(units_of(part))}" for part in QUANTITIES),
    )
    group.add_argument(
        "--axes",
        nargs="+",
        type=axis,
        metavar="AXIS[=NAME]",
        help="calibrate several axes, each by itself, into a folder of its own: letters, and the "
        "columns of their outputs where these are not guessed; by default all that are found",
    )
    group.add_argument(
        "--separator",
        type=sign,
        metavar="SIGN",
        help=r"between columns, \t for a tab; by default found out",
    )
    group.add_argument(
        "--decimal", type=sign, metavar="SIGN", help="of decimal fractions; by default found out"
    )
    group.add_argument(
        "--encoding",
        type=encoding,
        metavar="NAME",
        help="of the text, such as gbk; by default UTF-8, UTF-16 or Windows-1252, as found out",
    )


def _add_rows(group):
    group.add_argument("--device", metavar="NAME", help="use the rows of this device only")
    group.add_argument(
        "--missing",
        choices=("drop", "refuse"),
        default="drop",
        help="rows that lack a value: leave them out, counted and told (drop, default), or refuse "
        "the log",
    )
    group.add_argument(
        "--max-gap",
        type=gap,
        default="auto",
        metavar="S",
        help="a longer step of the time begins a new run, where no column tells runs apart; inf "
        "for none (auto: a minute, and 50 usual steps)",
    )
    group.add_argument(
        "--average",
        type=seconds,
        metavar="S",
        help="average the rows over so many seconds while they are read: memory then grows with "
        "the means only",
    )
    group.add_argument(
        "--at-rest",
        action="store_true",
        help="the gyro did not turn: the log needs no column for the rate, and the bias is learnt, "
        "the earth's rate included. Found out where there is no rate, or one of zero",
    )
    group.add_argument(
        "--scale-factor",
        type=factor,
        metavar="K",
        help="of a raw signal at rest, which does not tell it: counts (V, mV) per deg/s",
    )
    group.add_argument(
        "--min-temperature-span",
        type=positive,
        default=10.0,
        metavar="DEGC",
        help="smallest range of the temperature that is accepted (10)",
    )


def _add_model(group):
    group.add_argument(
        "--inputs",
        nargs="+",
        choices=INPUTS,
        metavar="INPUT",
        help=f"of {', '.join(INPUTS)}; by default all that the log has, and time (since power-on) "
        "only with three runs or more. temperature_rate is made from time and temperature. Without "
        "output, the bias alone is learnt",
    )
    group.add_argument(
        "--terms",
        type=terms,
        default="search",
        metavar="N,N,...",
        help="fuzzy terms per input; 'search' (default) grows them on held-out groups, 'auto' "
        "leaves them to ANFISRegressor",
    )
    group.add_argument(
        "--physics",
        action="store_true",
        help="for open-loop fiber-optic gyros: fit the arcsine law first, and let the fuzzy rules "
        "learn what it leaves",
    )
    group.add_argument(
        "--time-constant",
        type=seconds,
        default=Recipe.time_constant,
        metavar="S",
        help=f"of the low-pass of the temperature's rate ({Recipe.time_constant:g})",
    )
    group.add_argument(
        "--max-rules",
        type=rules,
        default=Recipe.max_rules,
        metavar="N",
        help=f"most rules of a search ({Recipe.max_rules}); {MOST_RULES} at most",
    )
    group.add_argument(
        "--fit-rows",
        type=count,
        default=Recipe.fit_rows,
        metavar="N",
        help=f"fit to so many rows, chosen at random, of a longer log ({Recipe.fit_rows}); all are "
        "checked",
    )
    group.add_argument(
        "--check-rows",
        type=count,
        default=1_000_000,
        metavar="N",
        help="hold so many rows of a longer log, drawn evenly from every run, for fit, check and "
        "report (1000000): memory does not grow beyond. All rows are read and checked for errors",
    )
    group.add_argument(
        "--jobs", type=jobs, metavar="N", help="threads for a fit (1); -1 is one per core"
    )


def _add_range(group):
    group.add_argument(
        "--outside",
        choices=("clip", "linear", "nan"),
        default=Recipe.outside,
        help="policy for rows outside the range of the calibration, which are flagged in any case: "
        "hold the edge value (clip), go on along the tangent for a limited way (linear, default), "
        "or give no rate (nan)",
    )
    group.add_argument(
        "--max-extrapolation",
        type=extent,
        default=Recipe.max_extrapolation,
        metavar="SD",
        help="how far the rules follow the tangent beyond the range of an input, in its standard "
        "deviations; inf for without end; auto for as many as the outermost rows speak for, "
        f"half a one at least ({Recipe.max_extrapolation})",
    )
    group.add_argument(
        "--min-coverage",
        type=share,
        default=Recipe.min_coverage,
        metavar="SHARE",
        help=f"rows that the data cover less are flagged ({Recipe.min_coverage:g})",
    )
    group.add_argument(
        "--box",
        nargs="+",
        type=box,
        action="extend",
        default=[],
        metavar="INPUT=LOW:HIGH",
        help="box of inputs, such as temperature=-40:85, over which the report proves how large "
        "the compensation can be; of others the range of the calibration. Units: s, degC, degC/s, "
        "and that of the output",
    )
    group.add_argument(
        "--groups",
        choices=KINDS,
        default="auto",
        help="what to hold out in the check; by default (auto) devices where there are three or "
        "more, else runs, and rate levels where these could be memorised; of a single run "
        "legs of the temperature's cycles, or pieces of them",
    )


def _add_output(group):
    group.add_argument(
        "--apply",
        metavar="MODEL",
        help="compensate the logs by this model (compensator.json) instead of calibrating; a "
        "column for the rate is not needed, and is compared with where it is there. A .joblib file "
        "is taken too, and can run any code: see below",
    )
    group.add_argument(
        "--output",
        type=Path,
        metavar="PATH",
        help="folder to write to (LOG-compensator); with --apply the file (LOG-compensated.csv)",
    )
    group.add_argument(
        "--c",
        choices=("c99", "c89"),
        metavar="STD",
        help="also write the model as C (compensator.h, compensator.c) by the standard c99 or c89",
    )
    group.add_argument(
        "--deviation",
        action="store_true",
        help="with --c: write the standard deviation too, compensator_deviation(x, deviation)",
    )
    group.add_argument(
        "--saturate",
        action="store_true",
        help="with --c: hold what the rules give between the limits that the report has proven for "
        "the box (--box)",
    )
    group.add_argument("--force", action="store_true", help="replace files that exist")
    group.add_argument("--quiet", action="store_true", help="no progress on stderr")
