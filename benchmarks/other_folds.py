"""The real sets in folds drawn otherwise: ``python -m benchmarks.other_folds SEED ...``.

What a ratio of ``real_sets`` owes to how its rows fell into folds. Sets of at most 1,000 rows, on
which the rivals take minutes and not an hour, without Davis, which one row decides.
"""

import argparse
import sys

import numpy as np

from skanfis import ANFISRegressor

from . import real_sets
from .cases import geometric_mean
from .report import Results, Table, markdown
from .rivals import BEST_OF, fitted_rival

_MOST_ROWS = 1000
_DECIDED_BY_ONE_ROW = "carData Davis"


def data_sets():
    for name, X, y in real_sets.data_sets():
        if X.shape[0] <= _MOST_ROWS and name != _DECIDED_BY_ONE_ROW:
            yield name, X, y


def ratio(X, y, seed):
    """Error of five folds over that of the best rival."""
    squares = {name: [] for name in (*BEST_OF, "own")}
    for train, test in real_sets.folds(X, seed):
        models = {name: fitted_rival(name, X[train], y[train])[0] for name in BEST_OF}
        models["own"] = ANFISRegressor().fit(X[train], y[train])
        for name, model in models.items():
            squares[name].append((model.predict(X[test]) - y[test]) ** 2)
    errors = {name: real_sets.in_deviations(parts, y) for name, parts in squares.items()}
    return errors["own"] / min(errors[name] for name in BEST_OF)


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.other_folds", description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+", metavar="SEED", help="0 are the usual folds")
    seeds = parser.parse_args().seeds
    lines = []
    for name, X, y in data_sets():
        lines.append([name, *(ratio(X, y, seed) for seed in seeds)])
        print(lines[-1], file=sys.stderr, flush=True)
    means = [geometric_mean(column) for column in np.array([line[1:] for line in lines]).T]
    lines.append(["geometric mean", *means])
    head = ["data", *(f"folds of seed {seed}" for seed in seeds)]
    title = "Real sets: error of five folds over that of the best of " + ", ".join(BEST_OF)
    print(markdown(Results(tables=[Table(title, head, lines)]), []))


if __name__ == "__main__":
    main()
