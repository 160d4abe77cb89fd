"""ANFISRegressor() on 240 random functions, beside quadratic ridge and a Gaussian process.

The functions were chosen before anything was fitted, and never changed. An error is that of 2,000
new rows from the same distribution, some of them outside the box of the training rows. It includes
the noise that a new target would have: sqrt(mean((prediction - truth)^2) + noise^2).
"""

from functools import partial

import numpy as np

from .cases import evaluate, fitted, remembered
from .random_functions import INPUTS, OTHERS, SMOOTH, Case, make_data, outside
from .readable import readability
from .report import Measure, Results, Row, Table
from .rivals import fitted_rival
from .scores import geometric_mean, in_box, median

__all__ = ["cases", "run"]

N_CASES = 240
_SEED = 9
BEST_OF = ("quadratic ridge", "Gaussian process")
_GP_ROWS = 1000
# What counts as beyond the training target's range, in parts of it.
_BEYOND = 0.25
_WORSE_THAN_MEAN = 1.02


def cases():
    """All numbers of inputs and all kinds of inputs equally often; half of the functions smooth.

    There are 30 to 2,000 rows, equally spread in their logarithm, and noise from 0 to 50 %.
    """
    rng = np.random.default_rng(_SEED)
    functions = [f for f in SMOOTH for _ in range(N_CASES // 8)]
    functions += [f for f in OTHERS for _ in range(N_CASES // 6)]
    levels = (np.arange(N_CASES) + rng.random(N_CASES)) / N_CASES
    rows = 30.0 * (2000.0 / 30.0) ** levels
    noises = 0.5 * (np.arange(N_CASES) + rng.random(N_CASES)) / N_CASES
    columns = (
        np.arange(N_CASES) % 8 + 1,
        rows.round().astype(int),
        noises,
        np.resize(list(INPUTS), N_CASES),
        np.array(functions),
    )
    shuffled = [rng.permutation(column).tolist() for column in columns]
    return [Case(seed, *case) for seed, case in enumerate(zip(*shuffled, strict=True))]


def error(prediction, data):
    return float(np.sqrt(np.mean((prediction - data.truth) ** 2) + data.noise**2))


def rival_error(name, data, *_):
    model, _ = fitted_rival(name, data.X, data.y, _GP_ROWS)
    return error(model.predict(data.X_test), data)


def rivals(case, data, fit=True):
    """The error of each rival."""
    found = {}
    for name in BEST_OF:
        file = f"{case.seed:03} {name} error"
        rows = data.X, data.y, data.X_test, data.truth
        error_of = partial(rival_error, name, data)
        found[name] = remembered("battery", file, error_of, *rows, fit=fit)
    if None in found.values():
        raise LookupError("its rivals are not remembered yet")
    return found


def measure(case, options):
    data = make_data(case)
    found = rivals(case, data, fit=not options.quick)
    model, seconds = fitted(data.X, data.y, options)
    prediction = model.predict(data.X_test)
    ours = error(prediction, data)
    best = min(found, key=found.get)
    inside = in_box(data.X_test, data.X)
    excess = np.maximum(data.y.min() - prediction, prediction - data.y.max()) / np.ptp(data.y)
    # Where the truth is beyond that range too, a prediction may be.
    beyond = outside(prediction, data.y, _BEYOND) & ~outside(data.truth, data.y, _BEYOND)
    return {
        "case": str(case),
        "ratio": ours / found[best],
        "best": best,
        "over mean": ours / error(data.y.mean(), data),
        "beyond": int(np.sum(beyond & inside)),
        "furthest": float(excess[inside].max()) if inside.any() else 0.0,
        "seconds": seconds,
        **readability(model, data.X, data.y),
    }


def run(options):
    found, failed = evaluate("battery", measure, cases(), options)
    if not found:
        return Results([Row("random functions", [failed])])
    ratios = np.array([figures["ratio"] for figures in found])
    worse = sum(figures["over mean"] > _WORSE_THAN_MEAN for figures in found)
    beyond = sum(figures["beyond"] > 0 for figures in found)
    terms = sum(figures["false"] + figures["alike"] for figures in found)
    work = f"{len(found)} random functions, defaults, all rows"
    rows = [
        Row(
            f"{work}: over the better of {' and '.join(BEST_OF)}, noise included",
            [
                Measure("geometric mean", geometric_mean(ratios), "", 1.06, 1.03),
                Measure("95th percentile", float(np.quantile(ratios, 0.95)), "", 1.8, 1.5),
                Measure("worst", float(ratios.max()), ""),
                Measure("median fit, CPU", median(found, "seconds"), "s"),
            ],
        ),
        Row(
            f"{work}: cases",
            [
                Measure("worse than the target's mean by over 2 %", float(worse), "", 0),
                Measure(
                    "in the box, but beyond the target by over a quarter", float(beyond), "", 0
                ),
                Measure("terms never true, or alike", float(terms), "", 0),
                failed,
            ],
        ),
    ]
    return Results(rows, [worst(found)])


def worst(found):
    ordered = sorted(found, key=lambda figures: -figures["ratio"])[:10]
    keys = ("case", "ratio", "best", "over mean", "beyond", "furthest", "rules", "strongest")
    head = ["case", "ratio", "better rival", "over the mean's", "rows beyond", "furthest [ranges]"]
    return Table(
        "Battery: the worst ten",
        [*head, "rules", "strongest alone [sd]"],
        [[figures[key] for key in keys] for figures in ordered],
    )
