"""ANFISRegressor() on 240 random functions, beside quadratic ridge and a Gaussian process.

Chosen before anything was fitted, and never changed. An error is over 2,000 fresh rows of the same
distribution, those outside the box of the training rows among them, and has the noise in it that a
fresh target would have: sqrt(mean((prediction - truth)^2) + noise^2).
"""

from time import perf_counter

import numpy as np

from .cases import evaluate, fitted, geometric_mean, remembered
from .random_functions import OTHERS, SMOOTH, Case, make_data, outside
from .readable import readability
from .report import Measure, Results, Row, Table
from .rivals import fitted_rival

__all__ = ["REMEMBERED", "cases", "rivals", "run"]

N_CASES = 240
_SEED = 9
_INPUTS = ("uniform", "correlated", "clusters", "integer", "t3", "lognormal")
BEST_OF = ("quadratic ridge", "Gaussian process")
REMEMBERED = (BEST_OF,)
_GP_ROWS = 1000
# Beyond the training target's range by so much of it.
_BEYOND = 0.25
_WORSE_THAN_MEAN = 1.02


def cases():
    """As many of each dimension, of each kind of inputs; half the functions smooth.

    Rows from 30 to 2,000, equally spread in their logarithm, and noise from 0 to 50 %.
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
        np.resize(_INPUTS, N_CASES),
        np.array(functions),
    )
    shuffled = [rng.permutation(column).tolist() for column in columns]
    return [Case(seed, *case) for seed, case in enumerate(zip(*shuffled, strict=True))]


def error(prediction, data):
    return float(np.sqrt(np.mean((prediction - data.truth) ** 2) + data.noise**2))


def rival_figures(name, data):
    model, seconds = fitted_rival(name, data.X, data.y, _GP_ROWS)
    prediction = model.predict(data.X_test)
    return [error(prediction, data), seconds, n_beyond(prediction, data)]


def n_beyond(prediction, data):
    """Rows in the box that are predicted beyond the target where the truth is not."""
    beyond = outside(prediction, data.y, _BEYOND) & ~outside(data.truth, data.y, _BEYOND)
    return int(np.sum(beyond & data.in_box))


def rivals(case, names=BEST_OF, fit=True):
    """Error, seconds and rows beyond the target, of each rival."""
    data = make_data(case)
    found = {}
    for name in names:
        key = f"battery/{case.seed:03} {name}".replace(" ", "_")
        found[name] = remembered(
            key,
            lambda *_, name=name: rival_figures(name, data),
            data.X,
            data.y,
            data.X_test,
            data.truth,
            fit=fit,
        )
    if None in found.values():
        raise LookupError("its rivals are not remembered yet")
    return found


def measure(case, options):
    data = make_data(case)
    start = perf_counter()
    found = rivals(case, fit=not options.quick)
    rivals_wall = perf_counter() - start
    model, seconds = fitted(data.X, data.y, options)
    prediction = model.predict(data.X_test)
    ours = error(prediction, data)
    best = min(found, key=lambda name: found[name][0])
    inside, span = data.in_box, np.ptp(data.y)
    excess = np.maximum(data.y.min() - prediction, prediction - data.y.max()) / span
    return {
        "case": str(case),
        "ratio": ours / found[best][0],
        "best": best,
        "over mean": ours / error(data.y.mean(), data),
        "error": ours / np.std(data.truth),
        "beyond": n_beyond(prediction, data),
        "furthest": float(excess[inside].max(initial=-np.inf)) if inside.any() else 0.0,
        "inside": float(inside.mean()),
        "seconds": seconds,
        **readability(model, data.X, data.y),
        "inputs": case.inputs,
        "function": case.function,
        "rivals": {name: figures[0] / np.std(data.truth) for name, figures in found.items()},
        "rivals_seconds": {name: figures[1] for name, figures in found.items()},
        "rivals_beyond": {name: figures[2] for name, figures in found.items()},
        "rivals_wall": rivals_wall,
    }


def run(options):
    found, failed = evaluate("battery", measure, cases(), options)
    if not found:
        return Results([Row("random functions", [failed])])
    ratios = np.array([figures["ratio"] for figures in found])
    worse = sum(figures["over mean"] > _WORSE_THAN_MEAN for figures in found)
    beyond = sum(figures["beyond"] > 0 for figures in found)
    terms = sum(figures["false"] + figures["alike"] for figures in found)
    seconds = float(np.median([figures["seconds"] for figures in found]))
    work = f"{len(found)} random functions, defaults, all rows"
    rows = [
        Row(
            f"{work}: over the better of {' and '.join(BEST_OF)}, noise included",
            [
                Measure("geometric mean", geometric_mean(ratios), "", 1.06, 1.03),
                Measure("95th percentile", float(np.quantile(ratios, 0.95)), "", 1.8, 1.5),
                Measure("worst", float(ratios.max()), ""),
                Measure("median fit, CPU", seconds, "s"),
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
    return Results(
        rows, [worst(found), beside(found), *(by(found, key) for key in ("inputs", "function"))]
    )


def worst(found):
    ordered = sorted(found, key=lambda figures: -figures["ratio"])[:10]
    keys = ("case", "ratio", "best", "over mean", "beyond", "furthest", "rules", "strongest")
    head = ["case", "ratio", "better rival", "over the mean's", "rows beyond", "furthest [ranges]"]
    return Table(
        "Battery: the worst ten",
        [*head, "rules", "strongest alone [sd]"],
        [[figures[key] for key in keys] for figures in ordered],
    )


def beside(found):
    """The same counts for the rivals."""
    lines = []
    for name in BEST_OF:
        to_best = [f["rivals"][name] * f["ratio"] / f["error"] for f in found]
        to_mean = [f["rivals"][name] * f["over mean"] / f["error"] for f in found]
        lines.append(
            [
                name,
                geometric_mean(to_best),
                float(np.quantile(to_best, 0.95)),
                sum(ratio > _WORSE_THAN_MEAN for ratio in to_mean),
                sum(f["rivals_beyond"][name] > 0 for f in found),
                float(np.median([f["rivals_seconds"][name] for f in found])),
            ]
        )
    head = ["rival", "geometric mean", "95th percentile", "worse than the mean", "beyond", "CPU"]
    return Table("Battery: the rivals over the better of them", head, lines)


def by(found, key):
    """Figures by a property of the cases."""
    lines = []
    for kind in dict.fromkeys(figures[key] for figures in found):
        some = [figures for figures in found if figures[key] == kind]
        ratios = [figures["ratio"] for figures in some]
        lines.append(
            [
                kind,
                len(some),
                geometric_mean(ratios),
                max(ratios),
                sum(figures["over mean"] > _WORSE_THAN_MEAN for figures in some),
                sum(figures["beyond"] > 0 for figures in some),
                float(np.median([figures["seconds"] for figures in some])),
            ]
        )
    head = [key, "cases", "geometric mean", "worst", "worse than the mean", "beyond", "CPU [s]"]
    return Table(f"Battery, by {key}", head, lines)
