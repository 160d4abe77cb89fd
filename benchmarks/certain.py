"""Certain bounds: how tight in what time, held against rows and an optimiser; constrained fits."""

import warnings
from functools import partial
from itertools import product
from time import process_time

import numpy as np
from scipy.optimize import minimize
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.bounds import bounds, gradient_bounds, monotonicity
from skanfis.membership import MEMBERSHIPS
from skanfis.options import LinearExtrapolation

from .cases import geometric_mean
from .gyro import make_surface
from .report import Measure, Results, Row, Table

__all__ = ["run"]

# Rows that are held against the bounds of every model; of a family, a million.
_ROWS = 250_000
_BLOCK = 50_000
_STARTS = 8
# Of the gyro-like models, and rows that the bounds of every slope are held against.
_INPUTS, _SLOPES = ("time", "temperature", "rate"), 1_000_000
_POLICIES = ("linear", "clip", LinearExtrapolation(2.0))
_SEEDS = range(10)
# Truths that rise with the first input, on [-1, 1]^2.
_TRUTHS = {
    "tanh": lambda x, z: np.tanh(3.0 * x) + 0.3 * z**2,
    "step": lambda x, z: 1.0 / (1.0 + np.exp(-8.0 * x)) + 0.5 * z,
    "saturated": lambda x, z: np.minimum(x, 0.2) + 0.2 * np.sin(3.0 * z),
    "cubic": lambda x, z: x**3 * (1.0 + 0.5 * z),
    "exponential": lambda x, z: np.exp(x * (1.2 + z)),
    "scale factor": lambda x, z: x * (1.0 + 0.1 * z) + 0.02 * np.sin(6.0 * x),
}
_STRUCTURES = {"default": {}, "3 x 3 terms": {"n_mfs": 3}, "6 x 3 terms": {"n_mfs": [6, 3]}}


def run(options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows, tight = _gyro_like()
        checked = _checked(options)
        rows += [checked[0], _constrained(options)]
    return Results(rows, [tight, *checked[1]] if options.details else [])


def _gyro_like():
    """Time and boxes of bounds of 36 rules, by tightness."""
    X, y, _, _ = make_surface(seed=0)
    rows, lines, beyond, rng = [], [], 0, np.random.default_rng(0)
    for n_mfs in ([1, 6, 6], [4, 3, 3]):
        model = ANFISRegressor(n_mfs=n_mfs).fit(X, y)
        name = " x ".join(str(n) for n in n_mfs if n > 1) + " terms"
        for what, job in _jobs().items():
            start = process_time()
            found = job(model)
            seconds = process_time() - start
            tightness = f"{found.tightness[0]:.2g}"
            lines.append([f"{name}, {what}", f"{seconds:.2f}", found.n_boxes, tightness])
            if what == "outputs to 0.01":
                time = Measure("time", seconds, "s", 1.0)
                measures = [time, Measure("boxes", found.n_boxes, "")]
                rows.append(Row(f"bounds of {name}, to 1 % of the range", measures))
            elif what.startswith("slope"):
                beyond += _slopes_beyond(model.model_, what, found, rng)
                if "time" in what and n_mfs[0] > 1:
                    time = Measure("time", seconds, "s", 2.0)
                    tight = Measure("tightness", found.tightness[0], "", 0.01)
                    rows.append(Row(f"{what} of the largest, {name}", [time, tight]))
    measures = [Measure("rows and optima beyond", beyond, "", 0)]
    measures.append(Measure("rows", 6 * _SLOPES, ""))
    rows.append(Row("bounds of slopes against random rows and L-BFGS-B", measures))
    return rows, Table("Bounds of 36 rules", ["what", "s", "boxes", "tightness"], lines)


def _slopes_beyond(model, what, found, rng):
    """How many rows of many, and optima, have a slope beyond its bounds."""
    j = [f"slope by {name} to 0.01" for name in _INPUTS].index(what)
    low, high, beyond = found.box[:, 0], found.box[:, 1], 0
    for _ in range(_SLOPES // _BLOCK):
        slopes = model.gradient(rng.uniform(low, high, (_BLOCK, 3)))[:, j, 0]
        beyond += int(np.sum((slopes < found.lower[0]) | (slopes > found.upper[0])))
    scale = max(-found.lower[0], found.upper[0])
    for sign, bound in ((1.0, found.upper[0]), (-1.0, -found.lower[0])):

        def cost(u, sign=sign):
            return -sign * model.gradient((low + u * (high - low))[None])[0, j, 0] / scale

        for u in rng.uniform(size=(_STARTS, 3)):
            best = minimize(cost, u, bounds=[(0.0, 1.0)] * 3, method="L-BFGS-B")
            beyond += int(-best.fun * scale > bound)
    return beyond


def _jobs():
    """What is bounded of a model, by what it is called."""
    jobs = {f"outputs to {tol:g}": partial(bounds, tol=tol) for tol in (0.01, 1e-3)}
    jobs["outputs anywhere to 0.01"] = partial(bounds, box=[(-np.inf, np.inf)] * 3)
    for j, name in enumerate(_INPUTS):
        jobs[f"slope by {name} to 0.01"] = partial(gradient_bounds, feature=j)
    return jobs


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
    rng, lines, beyond, missed, n_rows = np.random.default_rng(0), [], 0, [], 0
    for label, model in _models(options):
        width = model.maximum - model.minimum
        box = np.stack([model.minimum - 0.4 * width, model.maximum + 0.4 * width], axis=1)
        start = process_time()
        found = bounds(model, box)
        seconds = process_time() - start
        for _ in range(_ROWS // _BLOCK):
            y = model.predict(rng.uniform(box[:, 0], box[:, 1], (_BLOCK, 3)))[:, 0]
            beyond += int(np.sum((y < found.lower[0]) | (y > found.upper[0])))
            n_rows += _BLOCK
        best = [_optimised(model, box, sign, rng) for sign in (1.0, -1.0)]
        beyond += int(best[0] > found.upper[0]) + int(-best[1] < found.lower[0])
        gap = max(found.upper[0] - best[0], -best[1] - found.lower[0])
        missed.append(gap / (found.highest[0] - found.lowest[0]))
        lines.append([label, f"{seconds:.2f}", found.n_boxes, f"{found.tightness[0]:.2g}"])
    measures = [
        Measure("rows and optima beyond", beyond, "", 0),
        Measure("rows", n_rows, ""),
        Measure("models", len(lines), ""),
        Measure("bound less optimum, worst", max(missed), "of the range"),
    ]
    table = Table("Bounds of every family", ["model", "s", "boxes", "tightness"], lines)
    return Row("bounds against random rows and L-BFGS-B", measures), [table]


def _optimised(model, box, sign, rng):
    """The largest sign times output that L-BFGS-B finds from several starts."""

    def cost(u):
        return -sign * model.predict((box[:, 0] + u * (box[:, 1] - box[:, 0]))[None])[0, 0]

    starts = rng.uniform(size=(_STARTS, 3))
    return max(-minimize(cost, u, bounds=[(0.0, 1.0)] * 3, method="L-BFGS-B").fun for u in starts)


def _constrained(options):
    """Errors and times of fits that know that the truth rises, over those that do not."""
    measures = []
    for name, params in _STRUCTURES.items():
        errors, times, is_proven = [], [], []
        for truth, seed in list(product(_TRUTHS.values(), _SEEDS))[:: options.every]:
            rng = np.random.default_rng(seed)
            X, X_test = rng.uniform(-1.0, 1.0, (100, 2)), rng.uniform(-0.95, 0.95, (2000, 2))
            exact = truth(*X_test.T)
            y = truth(*X.T) + 0.3 * exact.std() * rng.standard_normal(100)
            found = []
            for known in ({}, {"monotonic_cst": [1, 0]}):
                start = process_time()
                model = ANFISRegressor(**params, **known).fit(X, y)
                seconds = process_time() - start
                found.append((np.sqrt(np.mean((model.predict(X_test) - exact) ** 2)), seconds))
            errors.append(found[1][0] / found[0][0])
            times.append(found[1][1] / found[0][1])
            is_proven.append(model.constraints_["certified"] and monotonicity(model, 0)[0] == 1)
        measures += [
            Measure(f"error, {name}", geometric_mean(errors), "x"),
            Measure(f"time, {name}, median", float(np.median(times)), "x"),
            Measure(f"proven, {name}", 100.0 * float(np.mean(is_proven)), "%"),
        ]
    return Row("rising truths, 100 rows, noise 0.3: known to rise, over not known", measures)
