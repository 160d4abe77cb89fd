"""Fits the rivals of benchmarks that keep them: ``python -m benchmarks.remember real_sets``."""

import argparse
import sys
from importlib import import_module
from itertools import product


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.remember")
    parser.add_argument("names", nargs="+", choices=("real_sets", "battery"))
    for name in parser.parse_args().names:
        module = import_module(f"benchmarks.{name}")
        for rivals, case in product(module.REMEMBERED, module.cases()):
            found = module.rivals(case, rivals)
            print(f"{name}: {case}: {found}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
