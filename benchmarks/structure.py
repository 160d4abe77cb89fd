"""The structure that is chosen, with simplicity=0 and by default: error, cost, expected error.

All cases were chosen before any was fitted. What they are compared with:

* real sets and tables, in folds: the best of quadratic ridge, SVR and a Gaussian process;
* few rows of tables, judged by the other rows: the better of the lasso and a Gaussian process;
* formulas of physics, by the error to the truth: a Gaussian process;
* smooth functions of inputs that all act together, by the error to the truth: the best of SVR, a
  neural network and a Gaussian process.

Errors in tables below 0.02 of the target's deviation count as 0.02 of it.
"""

import math
from dataclasses import dataclass

import numpy as np
from sklearn.base import clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import StandardScaler

from . import real_sets
from .cases import evaluate, fitted, fitted_in_folds, remembered
from .every_table import part
from .report import Measure, Results, Row
from .rivals import fitted_rival, rival_errors
from .scores import geometric_mean, in_deviations, median, rms_error

__all__ = ["borehole", "friedman", "run"]

SIMPLICITIES = (0.0, 0.05)
_EXACT, _N_TEST, _TUNED_ON = 0.02, 2000, 4000
# Of the kinds that are not judged in folds.
_RIVALS = {
    "smooth": ("SVR", "neural network", "Gaussian process"),
    "formula": ("Gaussian process",),
    "few rows": ("lasso", "Gaussian process"),
}
# Few rows: how many for each column, and in tables of how many columns at least.
_FEW, _MANY_COLUMNS = (1.5, 3.0, 5.0), 10
# Bars of the errors over the best rival's, with simplicity=0 and by default.
_BARS = {"real set": (0.98, 1.03), "table": (1.0, 1.03), "smooth": (1.15, None)}
# Rows of smooth functions.
_SMOOTH_ROWS = (250, 1000, 4000, 16000)
# One row decides.
_APART = "carData Davis"


@dataclass(frozen=True)
class Case:
    """Its kind, the function or table, and for functions rows and noise."""

    kind: str
    name: str
    n_rows: int = 0
    noise: float = 0.0

    def __str__(self):
        figures = f", {self.n_rows} rows, noise {self.noise:.0%}" if self.n_rows else ""
        return f"{self.kind}: {self.name}{figures}"


# Functions of inputs between -1 and 1 ------------------------------------------------------------


def robot_arm(Z):
    angles, lengths = np.cumsum(0.5 * np.pi * Z[:, :4], axis=1), 0.75 + 0.25 * Z[:, 4:8]
    return np.hypot(np.sum(lengths * np.cos(angles), 1), np.sum(lengths * np.sin(angles), 1))


def linkage(Z):
    return np.sum((0.6 + 0.4 * Z[:, 3:6]) * np.cos(np.cumsum(1.2 * Z[:, :3], axis=1)), axis=1)


def product(Z):
    return np.prod(1.0 + 0.5 * Z, axis=1)


def borehole(u):
    """Flow of water through a borehole (Harper and Gupta 1983)."""
    low = np.array([0.05, 100.0, 63070.0, 990.0, 63.1, 700.0, 1120.0, 9855.0])
    high = np.array([0.15, 50000.0, 115600.0, 1110.0, 116.0, 820.0, 1680.0, 12045.0])
    well, radius, upper, head, lower, below, length, conductivity = (low + (high - low) * u).T
    ratio = np.log(radius / well)
    leak = 2.0 * length * upper / (ratio * well**2 * conductivity)
    return 2.0 * np.pi * upper * (head - below) / (ratio * (1.0 + leak + upper / lower))


def network(seed, n_inputs):
    rng = np.random.default_rng(seed)
    inner = 1.5 / np.sqrt(n_inputs) * rng.standard_normal((n_inputs, 12))
    shift, outer = rng.standard_normal((2, 12))
    return lambda Z: np.tanh(Z @ inner + shift) @ outer


def friedman(U):
    """Friedman's function (1991) of the first five inputs, which are between 0 and 1."""
    peaks = 10.0 * np.sin(np.pi * U[:, 0] * U[:, 1]) + 20.0 * (U[:, 2] - 0.5) ** 2
    return peaks + 10.0 * U[:, 3] + 5.0 * U[:, 4]


def wave(Z):
    return np.sin(3.0 * Z[:, 0]) + Z[:, 1] * Z[:, 2]


FUNCTIONS = {
    "robot arm": (robot_arm, 8),
    "linkage": (linkage, 6),
    "product": (product, 7),
    "borehole": (lambda Z: borehole(0.5 * (Z + 1.0)), 8),
    "network of 6": (network(1, 6), 6),
    "network of 10": (network(2, 10), 10),
    "Friedman": (lambda Z: friedman(0.5 * (Z + 1.0)), 50),
    "wave": (wave, 4),
    "nothing, 10": (lambda Z: 0.0 * Z[:, 0], 10),
    "nothing, 50": (lambda Z: 0.0 * Z[:, 0], 50),
}


# From Feynman's lectures, for numbers from 1 to 5: products and quotients, with long tails.
FORMULAS = {
    "gravity": (lambda m, n, x, y: m * n / (x**2 + y**2), 4),
    "Coulomb": (lambda p, q, e, r: p * q / (e * r**2), 4),
    "potential": (lambda m, n, r, s: m * n * (1.0 / r - 1.0 / s), 4),
    "Lorentz": (lambda q, e, b, v, a: q * (e + b * v * np.sin(a)), 5),
    "Planck": (lambda h, w, k, t: h * w**3 / np.expm1(h * w / (k * t)), 4),
    "expansion": (lambda n, t, a, b: n * t * np.log(b / a), 4),
    "drag": (lambda c, r, a, v: 0.5 * c * r * a * v**2, 4),
    "lens": (lambda a, b, n: 1.0 / (1.0 / a + n / b), 3),
}
FUNCTIONS |= {
    name: (lambda Z, of=of: of(*(3.0 + 2.0 * Z).T), n_inputs)
    for name, (of, n_inputs) in FORMULAS.items()
}


def drawn(case, seed=0):
    """Rows to train on and fresh ones with the truth; noise over the truth's deviation."""
    if case.kind == "few rows":
        X, y = _loaded(case)
        order = np.random.default_rng(seed).permutation(len(y))
        train, test = order[: case.n_rows], order[case.n_rows :]
        return X[train], y[train], X[test], y[test], 0.0
    function, n_inputs = FUNCTIONS[case.name]
    rng = np.random.default_rng([seed, case.n_rows, round(1000 * case.noise), n_inputs])
    Z = rng.uniform(-1.0, 1.0, (case.n_rows + _N_TEST, n_inputs))
    truth = function(Z)
    noise = case.noise * (truth[case.n_rows :].std() or 1.0)
    y = truth + noise * rng.standard_normal(len(truth))
    train, test = slice(case.n_rows), slice(case.n_rows, None)
    return Z[train], y[train], Z[test], truth[test], noise


# What is measured --------------------------------------------------------------------------------


def of_functions(case, options, n_seeds=1):
    """Error to the truth in its deviations; what was expected of a new row over what it has."""
    found = {}
    for simplicity in SIMPLICITIES:
        parts = []
        for seed in range(n_seeds):
            X, y, fresh, truth, noise = drawn(case, seed)
            model, _ = fitted(X, y, options, simplicity=simplicity)
            left = rms_error(model, fresh, truth)
            figures = figures_of(model, y.std() / math.hypot(left, noise))
            parts.append(figures | {"error": left / (truth.std() or noise)})
        found[simplicity] = parts
    return found


def figures_of(model, unit):
    """Reading cost; expected over true error, of the chosen and of the best of several rules."""
    chosen = next(each for each in model.structures_ if each["chosen"])
    several = [each for each in model.structures_ if each["rules"] > 1]
    return {
        "rules": model.n_rules_,
        "cost": chosen["reading_cost"],
        "true": chosen["expected_error"] * unit,
        "several": several[0]["expected_error"] * unit if several else None,
    }


def of_folds(X, y, n_folds, options):
    """The same of every fold, by simplicity; the error is one of all rows."""
    found = {}
    for simplicity in SIMPLICITIES:
        parts, squares = [], []
        folds = fitted_in_folds(X, y, options, n_folds, simplicity=simplicity)
        for model, _, train, left in folds:
            squares.append(left @ left)
            parts.append(figures_of(model, y[train].std() / y.std()))
        error = max(in_deviations(squares, y), _EXACT)
        found[simplicity] = [
            each | {"error": error, "true": each["true"] / error} for each in parts
        ]
    return found


def rivals_of(case):
    X, y, fresh, truth, _ = drawn(case)
    found = {}
    for name in _RIVALS[case.kind]:
        rival, _ = fitted_rival(name, X[:_TUNED_ON], y[:_TUNED_ON])
        if case.n_rows > _TUNED_ON and name != "Gaussian process":
            best = clone(rival.regressor_.best_estimator_)
            rival = TransformedTargetRegressor(best, transformer=StandardScaler()).fit(X, y)
        found[name] = rms_error(rival, fresh, truth) / truth.std()
    return found


def measure(case, options):
    """Everything of one case."""
    rivals = {}
    if case.kind in ("real set", "table"):
        folder, n_folds = ("real_sets", 5) if case.kind == "real set" else ("tables", 3)
        X, y = _loaded(case)
        found = of_folds(X, y, n_folds, options)
        if not options.quick:
            rivals = rival_errors(folder, case.name, X, y, n_folds)
    else:
        found = of_functions(case, options, 1 if case.kind in _RIVALS else 5)
        if case.kind in _RIVALS and not options.quick:
            rows = drawn(case)[:2]
            rivals = remembered("structure", str(case), lambda *_: rivals_of(case), *rows)
    least = 0.0 if case.kind in ("smooth", "formula") else _EXACT
    best = max(min(rivals.values(), default=np.nan), least)
    figures = {"case": str(case), "kind": case.kind}
    for simplicity, parts in found.items():
        middle = {name: median(parts, name) for name in ("error", "cost")}
        middle["over the rivals"] = max(middle["error"], least) / best
        figures[f"{simplicity:g}"] = middle | {"parts": parts}
    return figures


def _loaded(case):
    if case.kind == "real set":
        return real_sets.load(next(one for one in real_sets.SETS if one.name == case.name))
    return part(0)[case.name]


def cases():
    """All of them, quick ones first."""
    yield from (
        Case("noise", f"nothing, {d}", n, 1.0) for d in (10, 50) for n in (100, 300, 1000, 2000)
    )
    yield from (Case("weak", "wave", 5000, noise) for noise in (3.0, 4.4, 7.0))
    yield from (Case("Friedman", "Friedman", n, 0.2) for n in (500, 1000))
    yield from (Case("real set", one.name) for one in real_sets.SETS)
    yield from (Case("table", name) for name in part(0))
    yield from (Case("formula", name, n, 0.01) for n in (150, 600) for name in FORMULAS)
    yield from (
        Case("few rows", name, int(each * X.shape[1]))
        for name, (X, y) in part(0).items()
        if X.shape[1] >= _MANY_COLUMNS and len(y) >= 60 + (2 + _FEW[-1]) * X.shape[1]
        for each in _FEW
    )
    yield from (
        Case("smooth", name, n, noise)
        for n in _SMOOTH_ROWS
        for noise in (0.05, 0.2)
        for name in list(FUNCTIONS)[:6]
    )


def run(options):
    found, failed = evaluate("structure", measure, cases(), options)
    rows = [Row("structure: all cases", [failed])]
    for kind in dict.fromkeys(one["kind"] for one in found):
        some = [one for one in found if one["kind"] == kind and _APART not in one["case"]]
        if kind == "smooth":
            rows += _smooth(some)
        else:
            rows.append(_row(kind, some))
    return Results(rows)


def _over_the_rivals(kind, some):
    """Errors over the best rival's, by simplicity."""
    ratios = ([one[f"{s:g}"]["over the rivals"] for one in some] for s in SIMPLICITIES)
    names, bars = ("simplicity=0", "default"), _BARS.get(kind, (None, None))
    parts = zip(names, ratios, bars, strict=True)
    return [Measure(name, geometric_mean(own), "", bar) for name, own, bar in parts]


def _row(kind, some):
    zero, default = ([one[f"{s:g}"] for one in some] for s in SIMPLICITIES)
    parts = [each for one in zero for each in one["parts"]]
    measures = []
    if kind in ("real set", "table", "formula", "few rows"):
        measures += _over_the_rivals(kind, some)
        costs = [b["cost"] / a["cost"] for a, b in zip(zero, default, strict=True)]
        measures.append(Measure("reading cost, default over 0, median", float(np.median(costs))))
    elif kind == "noise":
        alone = np.mean([each["rules"] == 1 for each in parts])
        near = np.mean([abs(np.log(each["true"])) < np.log(1.15) for each in parts])
        several = [each["several"] for each in parts if each["several"] is not None]
        measures += [Measure("one rule", float(alone)), Measure("within 15 %", float(near))]
        measures.append(Measure("expected over true, several rules", float(np.median(several))))
    elif kind == "weak":
        kept = [_explained(b) / _explained(a) for a, b in zip(zero, default, strict=True)]
        measures.append(Measure("explained, default over 0", float(np.mean(kept))))
    else:
        noisy = [(1.0 - each["error"] ** 2) / (1.0 + 0.2**2) for each in parts]
        measures.append(Measure("R2 on new rows", float(np.mean(noisy))))
    measures.append(Measure("expected over true, median", median(parts, "true")))
    return Row(f"structure: {len(some)} x {kind}", measures)


def _explained(one):
    """The part of the truth's variance that is explained."""
    return np.mean([1.0 - each["error"] ** 2 for each in one["parts"]])


def _smooth(some):
    for n_rows in _SMOOTH_ROWS:
        own = [one for one in some if f", {n_rows} rows" in one["case"]]
        if own:
            work = f"structure: smooth functions, {n_rows:,} rows, over the best rival"
            yield Row(work, _over_the_rivals("smooth", own))
