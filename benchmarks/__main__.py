"""The command line: ``python -m benchmarks --help``."""

import argparse
import json
import sys
from shlex import join

from .fresh import run_alone
from .report import Results, machine, markdown

ALWAYS = ("jang", "gyro", "one_pass", "one_row", "command")
ON_REQUEST = (
    "structure",
    "beyond",
    "trees",
    "real_sets",
    "battery",
    "small_problems",
    "how_sure",
    "certain",
    "compensation",
    "campaign",
    "c_code",
    "large_data",
)


def parse():
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Run the benchmarks.")
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"which: {', '.join(ALWAYS)} (without a name, these); {', '.join(ON_REQUEST)}",
    )
    parser.add_argument(
        "--campaign",
        metavar="PATH",
        help="for campaign: a CSV with the columns gyro_counts, temp_c, rate_true_deg_s",
    )
    parser.add_argument("--details", action="store_true", help="certain: also bounds, one by one")
    many = parser.add_argument_group("structure, trees, and what else has many cases")
    many.add_argument("--every", type=int, default=1, metavar="N", help="every N-th case only")
    many.add_argument("--only", default="", metavar="TEXT", help="cases with this in their names")
    many.add_argument("--jobs", type=int, default=1, metavar="N", help="processes")
    many.add_argument(
        "--estimator-params",
        type=json.loads,
        default={},
        metavar="JSON",
        help="parameters of ANFISRegressor, such as '{\"alpha\": 0.1}'",
    )
    many.add_argument(
        "--quick",
        action="store_true",
        help="fit no rivals: of those remembered, battery and real_sets need all, trees takes what "
        "there is; structure uses none",
    )
    many.add_argument(
        "--keep",
        metavar="NAME",
        help="keep the results of all cases in .cache/NAME, for benchmarks.compare (default: last)",
    )
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in ALWAYS + ON_REQUEST]
    if unknown:
        parser.error(f"no such benchmark: {', '.join(unknown)}")
    if "campaign" in options.names and not options.campaign:
        parser.error("campaign needs --campaign PATH")
    return options


def command(options):
    """How to run this again; the campaign's path is nobody's business."""
    words = ["python", "-m", "benchmarks", *options.names]
    words += ["--campaign", "PATH"] if options.campaign else []
    words += ["--details"] if options.details else []
    words += [f"--every={options.every}"] if options.every > 1 else []
    words += [f"--only={options.only}"] if options.only else []
    words += ["--quick"] if options.quick else []
    if options.estimator_params:
        words.append(f"--estimator-params={json.dumps(options.estimator_params)}")
    return join(words)


def main():
    options = parse()
    results = Results()
    for name in options.names or ALWAYS:
        print(f"{name} ...", file=sys.stderr, flush=True)
        results += run_alone(name, options)
    print(markdown(results, [*machine(), f"command: `{command(options)}`"]))


if __name__ == "__main__":
    main()
