"""Certain bounds: how tight, in what time, checked by rows and an optimiser; constrained fits.

Twelve tables have one to four inputs with which the truth rises or falls: seven real ones (five
folds; signs by what columns mean, chosen before anything was fitted) and five planted functions
(five draws, noise on the new rows too). Told fits are compared with free ones, with histogram
boosting, free and told the same, and with pyGAM, told the same, where it is installed.
"""

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from scipy.optimize import minimize
from sklearn.cluster import KMeans
from sklearn.ensemble import HistGradientBoostingRegressor

from skanfis import ANFISRegressor
from skanfis.bounds import bounds, gradient_bounds, monotonicity
from skanfis.membership import MEMBERSHIPS
from skanfis.options import LinearExtrapolation

from .cases import folds
from .gyro import make_surface
from .real_sets import SETS, RealSet, load_frame
from .report import Measure, Results, Row, Table
from .structure import borehole, friedman
from .timing import timed

__all__ = ["run"]

# Rows that are held against the bounds of every model; of a family, a million.
_ROWS = 250_000
_BLOCK = 50_000
_STARTS = 8
# Of the gyro-like models, and rows that the bounds of every slope are held against.
_INPUTS, _SLOPES = ("time", "temperature", "rate"), 1_000_000
_POLICIES = ("linear", "clip", LinearExtrapolation(2.0))
# Rules of a proof, terms of a grid of so many, and seconds that it may take.
_PROOFS = ((12, [3, 2, 2], 1.0), (36, [3, 3, 4], 5.0))

_DIAMONDS = next(one for one in SETS if one.item == "diamonds")
_CARSEATS = next(one for one in SETS if one.item == "Carseats")
# What the target rises (1) and falls (-1) with.
_REAL = (
    (RealSet("MASS", "Boston", "medv"), {"rm": 1, "lstat": -1, "crim": -1, "ptratio": -1}),
    (_CARSEATS, {"Price": -1, "CompPrice": 1, "Advertising": 1, "ShelveLoc": 1}),
    (
        RealSet("ISLR", "Auto", "mpg", dropped=("name", "origin")),
        {"weight": -1, "horsepower": -1, "year": 1},
    ),
    (RealSet("AER", "HousePrices", "price"), {"lotsize": 1, "bathrooms": 1, "aircon_yes": 1}),
    (
        RealSet("modeldata", "concrete", "compressive_strength"),
        {"cement": 1, "water": -1, "age": 1},
    ),
    (RealSet("ISLR", "Credit", "Balance", dropped=("ID", "Rating")), {"Limit": 1, "Income": -1}),
    (
        replace(_DIAMONDS, dropped=("x", "y", "z"), n_rows=2000),
        {"carat": 1, "color": 1, "clarity": 1},
    ),
)


def _enzyme(u):
    return u[:, 0] / (0.2 + u[:, 0]) * np.exp(-u[:, 1]) + 0.2 * np.sin(3.0 * u[:, 2])


def _scale_factor(u):
    rate, temperature = 2.0 * u[:, 0] - 1.0, 2.0 * u[:, 1] - 1.0
    bias = 0.3 * np.sin(3.0 * temperature)
    return rate * (1.0 + 0.1 * temperature) + bias + 0.1 * np.sin(6.0 * rate)


def _eight_inputs(u):
    x = 4.0 * u - 2.0
    step = (1.0 + 0.5 * np.tanh(x[:, 2])) / (1.0 + np.exp(-4.0 * x[:, 1]))
    return np.tanh(1.5 * x[:, 0]) + step + 0.3 * x[:, 3] ** 2 - 0.5 * np.minimum(x[:, 4], 0.5)


# The function, signs of its inputs on [0, 1], rows, and noise in deviations.
_PLANTED = {
    "Friedman 1": (friedman, [0, 0, 0, 1, 1, 0, 0, 0, 0, 0], 200, 0.2),
    "enzyme": (_enzyme, [1, -1, 0], 200, 0.3),
    "scale factor": (_scale_factor, [1, 0], 200, 0.2),
    "borehole": (borehole, [1, 0, 0, 1, 0, -1, -1, 0], 300, 0.1),
    "eight inputs": (_eight_inputs, [1, 1, 0, 0, -1, 0, 0, 0], 1000, 0.3),
}


def run(options):
    rows, tight = _gyro_like()
    checked, families = _checked(options)
    known, table = _known_to_rise(options)
    details = [tight, families] if options.details else []
    return Results([*rows, checked, _proofs(), known], [table, *details])


def _gyro_like():
    """Time and boxes of bounds of 36 rules, by tightness; the bounds of slopes against rows."""
    X, y, _, _ = make_surface(seed=0)
    rows, lines, beyond, rng = [], [], 0, np.random.default_rng(0)
    for n_mfs in ([1, 6, 6], [4, 3, 3]):
        model = ANFISRegressor(n_mfs=n_mfs).fit(X, y)
        name = " x ".join(str(n) for n in n_mfs if n > 1) + " terms"
        found = {}
        for what, job in _jobs().items():
            one, seconds = found[what] = timed(job, model)
            tightness = f"{one.tightness[0]:.2g}"
            lines.append([f"{name}, {what}", f"{seconds:.2f}", one.n_boxes, tightness])
        one, seconds = found["outputs to 0.01"]
        measures = [Measure("time", seconds, "s", 1.0), Measure("boxes", one.n_boxes, "")]
        rows.append(Row(f"bounds of {name}, to 1 % of the range", measures))
        for j, what in enumerate(map(_slope, _INPUTS)):
            beyond += _slopes_beyond(model.model_, j, found[what][0], rng)
        if n_mfs[0] > 1:
            what = _slope("time")
            one, seconds = found[what]
            measures = [Measure("time", seconds, "s", 2.0)]
            gap = np.maximum(one.upper - one.highest, one.lowest - one.lower)
            tightness = float((gap / np.maximum(-one.lowest, one.highest))[0])
            measures.append(Measure("tightness", tightness, "", 0.01))
            rows.append(Row(f"{what} of the largest, {name}", measures))
    measures = [Measure("rows and optima beyond", beyond, "", 0)]
    measures.append(Measure("rows", 6 * _SLOPES, ""))
    rows.append(Row("bounds of slopes against random rows and L-BFGS-B", measures))
    return rows, Table("Bounds of 36 rules", ["what", "s", "boxes", "tightness"], lines)


def _jobs():
    """What is bounded of a model, by what it is called."""
    jobs = {f"outputs to {tol:g}": partial(bounds, tol=tol) for tol in (0.01, 1e-3)}
    jobs["outputs anywhere to 0.01"] = partial(bounds, box=[(-np.inf, np.inf)] * 3)
    slopes = {_slope(name): partial(gradient_bounds, feature=j) for j, name in enumerate(_INPUTS)}
    return jobs | slopes


def _slope(name):
    return f"slope by {name} to 0.01"


def _slopes_beyond(model, j, found, rng):
    """How many rows of many, and optima, have a slope by input j beyond its bounds."""
    lower, upper = found.lower[0], found.upper[0]
    scale = max(-lower, upper)

    def scaled(X):
        return model.gradient(X)[:, j, 0] / scale

    beyond, *_ = _against(scaled, found.box, lower / scale, upper / scale, _SLOPES, rng)
    return beyond


def _against(function, box, lower, upper, n_rows, rng):
    """How many random rows and optima in a box are beyond the bounds; the least and the largest.

    An optimum is the best that L-BFGS-B finds from several starts.
    """
    low, width = box[:, 0], box[:, 1] - box[:, 0]
    beyond = 0
    for _ in range(n_rows // _BLOCK):
        values = function(rng.uniform(low, box[:, 1], (_BLOCK, len(box))))
        beyond += int(np.sum((values < lower) | (values > upper)))

    def optimum(sign):
        starts = rng.uniform(size=(_STARTS, len(box)))
        found = [
            minimize(
                lambda u: sign * function((low + u * width)[None])[0],
                start,
                bounds=[(0.0, 1.0)] * len(box),
                method="L-BFGS-B",
            )
            for start in starts
        ]
        return sign * min(each.fun for each in found)

    largest, least = optimum(-1.0), optimum(1.0)
    return beyond + int(largest > upper) + int(least < lower), least, largest


def _models(options):
    X, y, _, _ = make_surface(seed=1, n_rows=300)
    kinds = {"grid": {"n_mfs": [2, 3, 2]}, "scattered": {"partition": KMeans(5, random_state=0)}}
    combinations = product(MEMBERSHIPS, kinds.items(), (0, 1))
    for i, (mf, (kind, given), order) in enumerate(list(combinations)[:: options.every]):
        policy = _POLICIES[i % len(_POLICIES)]
        model = ANFISRegressor(mf=mf, order=order, max_iter=5, out_of_bounds=policy, **given)
        frozen = model.fit(X, y).model_
        yield f"{mf}, {kind}, order {order}, {frozen.policy}", frozen


def _checked(options):
    """Bounds in and out of the range against random rows and an optimiser."""
    rng, lines, beyond, missed = np.random.default_rng(0), [], 0, []
    for label, model in _models(options):
        width = model.maximum - model.minimum
        box = np.stack([model.minimum - 0.4 * width, model.maximum + 0.4 * width], axis=1)
        found, seconds = timed(bounds, model, box)
        lower, upper = found.lower[0], found.upper[0]
        n_beyond, least, largest = _against(
            lambda X, model=model: model.predict(X)[:, 0], box, lower, upper, _ROWS, rng
        )
        beyond += n_beyond
        gap = max(upper - largest, least - lower)
        missed.append(gap / (found.highest[0] - found.lowest[0]))
        lines.append([label, f"{seconds:.2f}", found.n_boxes, f"{found.tightness[0]:.2g}"])
    measures = [
        Measure("rows and optima beyond", beyond, "", 0),
        Measure("rows", _ROWS * len(lines), ""),
        Measure("models", len(lines), ""),
        Measure("bound less optimum, worst", max(missed), "of the range"),
    ]
    table = Table("Bounds of every family", ["model", "s", "boxes", "tightness"], lines)
    return Row("bounds against random rows and L-BFGS-B", measures), table


def _proofs():
    """Seconds until two signs of ten inputs are proven, the worst of three kinds."""
    rng, signs, measures = np.random.default_rng(0), [1, 1] + [0] * 8, []
    X = rng.uniform(size=(1000, 10))
    y = _eight_inputs(X) + 0.3 * rng.standard_normal(1000)
    for n_rules, terms, most in _PROOFS:
        kinds = (
            {"n_mfs": [*terms, *[1] * 7]},
            {"partition": "tree", "max_rules": n_rules, "simplicity": 0.0},
            {"partition": KMeans(n_rules, random_state=0)},
        )
        times = []
        for params in kinds:
            model = ANFISRegressor(**params, max_iter=10, monotonic_cst=signs).fit(X, y)
            proven, seconds = timed(_rises, model)
            if not proven:
                raise AssertionError(f"{params}: what a fit certifies is not proven.")
            times.append(seconds)
        measures.append(Measure(f"{n_rules} rules, worst kind", max(times), "s", most))
    return Row("proof that two of ten inputs rise: a grid, a tree, scattered rules", measures)


def _rises(model):
    return all(monotonicity(model, j)[0] == 1 for j in (0, 1))


def _tables(options):
    """Name, signs, and rows to learn from and new rows of every part."""
    found = []
    for real_set, signs in _REAL:
        X, y = load_frame(real_set)
        ways = [signs.get(name, 0) for name in X.columns]
        X = X.to_numpy()
        parts = [(X[old], y[old], X[new], y[new]) for old, new in folds(X)]
        found.append((real_set.name, ways, parts))
    for name, (truth, signs, n_rows, noise) in _PLANTED.items():
        parts = []
        for seed in range(5):
            rng = np.random.default_rng(seed)
            X = rng.uniform(size=(n_rows, len(signs)))
            X_new = rng.uniform(0.02, 0.98, (2000, len(signs)))
            scale = noise * truth(X_new).std()
            y = truth(X) + scale * rng.standard_normal(n_rows)
            parts.append((X, y, X_new, truth(X_new) + scale * rng.standard_normal(2000)))
        found.append((name, signs, parts))
    return [one for one in found if options.only in one[0]][:: options.every]


def _known_to_rise(options):
    """Errors on new rows and seconds of fits that are told signs that are true."""
    lines, ratios, times, certified = [], [], [], 0
    for name, signs, parts in _tables(options):
        errors, seconds, told = {}, {}, []
        for what, make in _fits(signs).items():
            squares, spent = [], []
            for X, y, X_new, y_new in parts:
                model, each = timed(make().fit, X, y)
                spent.append(each)
                squares.append(np.mean((model.predict(X_new) - y_new) ** 2))
                if what == "told":
                    told.append(model.constraints_["certified"])
            errors[what], seconds[what] = np.sqrt(np.mean(squares)), np.median(spent)
        certified += all(told)
        ratios.append(errors["told"] / errors["free"])
        times.append(seconds["told"] / max(3.0 * seconds["free"], 1.0))
        others = [
            f"{error / errors['free']:.3f}" for what, error in errors.items() if what != "free"
        ]
        others += ["-"] * (4 - len(others))
        spent = [f"{seconds['free']:.2g}", f"{seconds['told']:.2g}"]
        n_rows, n_inputs = parts[0][0].shape
        lines.append([f"{name}, {n_rows} x {n_inputs}", np.count_nonzero(signs), *others, *spent])
    head = ["table, rows x inputs", "signs", "told", "boosting", "boosting, told", "pyGAM, told"]
    table = Table("Errors on new rows over the free fit's", [*head, "free [s]", "told [s]"], lines)
    measures = [
        Measure("tables certified", certified, f"of {len(lines)}", None),
        Measure("error, median", float(np.median(ratios)), "x", 1.0),
        Measure("error, worst", max(ratios), "x", 1.02),
        Measure("time over 3 free fits or 1 s, worst", max(times), "x", 1.0),
    ]
    return Row("known to rise or fall, over the free fit on new rows", measures), table


def _fits(signs):
    """What is compared, free or told the signs; pyGAM has splines of every input."""
    fits = {
        "free": ANFISRegressor,
        "told": partial(ANFISRegressor, monotonic_cst=signs),
        "boosting": partial(HistGradientBoostingRegressor, random_state=0),
        "boosting, told": partial(
            HistGradientBoostingRegressor, random_state=0, monotonic_cst=signs
        ),
    }
    try:
        import pygam
    except ImportError:
        return fits
    ways = {1: "monotonic_inc", -1: "monotonic_dec", 0: None}
    terms = [pygam.s(j, constraints=ways[sign]) for j, sign in enumerate(signs)]
    return fits | {"pyGAM, told": partial(pygam.LinearGAM, sum(terms[1:], terms[0]))}
