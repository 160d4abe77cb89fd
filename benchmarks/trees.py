"""Trees of soft splits and few rules beside models that people read; functions that are planted.

All were chosen before anything was fitted. Real sets are judged in the folds of ``real_sets``,
planted functions on 2,000 new rows. Errors include the noise that new targets would have.
"""

from dataclasses import dataclass

import numpy as np

from . import real_sets
from .cases import evaluate, fitted, fitted_in_folds
from .report import Measure, Results, Row, Table
from .rivals import GLASS_BOXES, rival_in_folds
from .scores import geometric_mean, in_deviations, median, rms_error

__all__ = ["run"]

# What is fitted to the real sets, and the most that it may be over each rival.
MODELS = {
    "tree, 6 rules": {"partition": "tree", "max_rules": 6},
    "auto, 6 rules": {"max_rules": 6},
    "default": {},
}
BARS = {
    ("tree, 6 rules", "EBM"): (1.15, 1.05),
    ("auto, 6 rules", "EBM"): (1.10, 1.0),
    ("tree, 6 rules", "FIGS"): (0.85, 0.75),
    ("tree, 6 rules", "cubist"): (0.98, 0.9),
}
_STEP = 0.02
KINDS = ("auto", "grid", "scattered", "tree")
_N_ROWS, _N_TEST, _SEEDS = 800, 2000, 10


@dataclass(frozen=True)
class Planted:
    """A function of the first of some inputs between -1 and 1, and the noise over its deviation."""

    name: str
    function: object
    n_inputs: int
    noise: float
    seed: int

    def __str__(self):
        return f"planted: {self.name}, seed {self.seed}"

    def drawn(self):
        """Rows to train on, fresh ones, their truth, and the deviation of the noise."""
        rng = np.random.default_rng([self.seed, self.n_inputs])
        Z = rng.uniform(-1.0, 1.0, (_N_ROWS + _N_TEST, self.n_inputs))
        truth = np.asarray(self.function(Z), dtype=float)
        noise = self.noise * (truth.std() or 1.0)
        y = truth[:_N_ROWS] + noise * rng.standard_normal(_N_ROWS)
        return Z[:_N_ROWS], y, Z[_N_ROWS:], truth[_N_ROWS:], noise


def chessboard(Z):
    return np.floor(2.0 * (Z[:, :2] + 1.0)).sum(axis=1) % 2


PLANTED = {
    "two products": (lambda Z: Z[:, 0] * Z[:, 1] + Z[:, 2] * Z[:, 3], 4, 0.2),
    "step": (lambda Z: Z[:, 0] > 0.2, 4, 0.2),
    "ridge at 45 degrees": (lambda Z: np.tanh(4.0 * (Z[:, 0] + Z[:, 1])), 4, 0.2),
    "chessboard of 4 x 4": (chessboard, 4, 0.2),
    "noise only": (lambda Z: 0.0 * Z[:, 0], 4, 1.0),
    "product beside 8": (lambda Z: Z[:, 0] * Z[:, 1], 10, 0.2),
}


def cases():
    yield from real_sets.SETS
    for name, given in PLANTED.items():
        yield from (Planted(name, *given, seed) for seed in range(_SEEDS))


def measure(case, options):
    return of_planted(case, options) if isinstance(case, Planted) else of_set(case, options)


def of_set(case, options):
    """Errors of five folds in deviations of the target, and what else there is of each model."""
    X, y = real_sets.load(case)
    squares = {}
    for name in GLASS_BOXES:
        parts = rival_in_folds(name, "real_sets", case.name, X, y, fit=not options.quick)
        squares[name] = [part and part[0] for part in parts]
    figures = {"case": str(case)}
    for name, params in MODELS.items():
        left, parts, jumps = [], [], []
        for model, seconds, _, errors in fitted_in_folds(X, y, options, **params):
            left.append(errors @ errors)
            cost = model.readability_.reading_cost
            parts.append({"rules": model.n_rules_, "cost": cost, "seconds": seconds})
            jumps.append(jump(model, X, y))
        figures[name] = {key: median(parts, key) for key in parts[0]} | {
            "squares": left,
            "error": in_deviations(left, y),
            "jump": max(jumps),
            "over": {rival: over(left, of) for rival, of in squares.items()},
        }
    return figures | {"folds": {rival: sum(map(bool, of)) for rival, of in squares.items()}}


def over(ours, theirs):
    """Error over a rival's, on the folds in which the rival's is known; None if in none."""
    known = [pair for pair in zip(ours, theirs, strict=True) if pair[1] is not None]
    return float(np.sqrt(np.divide(*np.sum(known, axis=0)))) if known else None


def jump(model, X, y):
    """Largest change over a fiftieth of a deviation of one input, in the target's deviations."""
    before, most = model.predict(X), 0.0
    for j, column in enumerate(X.T):
        if np.unique(column).size > 2:
            moved = X.copy()
            moved[:, j] += _STEP * column.std()
            most = max(most, float(np.abs(model.predict(moved) - before).max()))
    return most / y.std()


def of_planted(case, options):
    X, y, fresh, truth, noise = case.drawn()
    figures = {"case": str(case), "name": case.name}
    for kind in KINDS:
        model, _ = fitted(X, y, options, partition=kind)
        left = rms_error(model, fresh, truth)
        figures[kind] = {"error": float(np.hypot(left, noise)) / noise, "left": left / noise}
    return figures


def run(options):
    found, failed = evaluate("trees", measure, cases(), options)
    sets = [figures for figures in found if "folds" in figures]
    planted = [figures for figures in found if "name" in figures]
    rows, tables = [Row("trees: cases", [failed])], []
    if sets:
        is_known = {rival for rival in GLASS_BOXES if any(one["folds"][rival] for one in sets)}
        rows += [beside(sets, *pair, *bars) for pair, bars in BARS.items() if pair[1] in is_known]
        rows.append(largest_jumps(sets))
        tables.append(one_by_one(sets))
    for name in dict.fromkeys(figures["name"] for figures in planted):
        rows.append(of_kinds(name, [one for one in planted if one["name"] == name]))
    return Results(rows, tables)


def beside(sets, name, rival, bar, aim):
    known = [figures for figures in sets if figures["folds"][rival]]
    ratios = {figures["case"]: figures[name]["over"][rival] for figures in known}
    worst = max(ratios, key=ratios.get)
    n_folds = sum(figures["folds"][rival] for figures in known)
    return Row(
        f"{name}, over {rival}, {len(known)} real sets, {n_folds} folds",
        [
            Measure("geometric mean", geometric_mean(list(ratios.values())), "", bar, aim),
            Measure(f"worst ({worst})", ratios[worst]),
        ],
    )


def largest_jumps(sets):
    measures = []
    for name in MODELS:
        found = [figures[name]["jump"] for figures in sets]
        median, worst = (0.07, 0.3) if name.startswith("tree") else (None, None)
        measures.append(Measure(f"{name}, median", float(np.median(found)), "", median))
        measures.append(Measure("worst", max(found), "", worst))
    return Row(f"largest change over {_STEP:g} sd of an input [sd of the target]", measures)


def one_by_one(sets):
    head = ["data"]
    for name in MODELS:
        head += [f"{name}: error", *(f"over {rival}" for rival in GLASS_BOXES)]
        head += ["rules", "numerals", "jump", "fit [s]"]
    lines = []
    for figures in sets:
        line = [figures["case"]]
        for name in MODELS:
            own = figures[name]
            line += [own["error"], *own["over"].values()]
            line += [own[key] for key in ("rules", "cost", "jump", "seconds")]
        lines.append(line)
    return Table("Few rules on real sets", head, lines)


def of_kinds(name, some):
    """ "auto" over the best of the kinds; of the product beside useless inputs, tree over grid."""
    if name == "product beside 8":
        pairs, bar, label = [(one["tree"], one["grid"]) for one in some], 1.5, "tree over grid"
    else:
        alone = [[one[kind] for kind in KINDS[1:]] for one in some]
        best = [min(kinds, key=lambda figures: figures["error"]) for kinds in alone]
        pairs = list(zip((one["auto"] for one in some), best, strict=True))
        bar, label = 1.05, "auto over the best kind alone"
    ratios = [ours["error"] / other["error"] for ours, other in pairs]
    truth = geometric_mean([ours["left"] / other["left"] for ours, other in pairs])
    measures = [
        Measure(f"{label}, geometric mean", geometric_mean(ratios), "", bar),
        Measure("worst", max(ratios)),
        Measure("noise left out", truth),
    ]
    for kind in KINDS:
        error = geometric_mean([one[kind]["error"] for one in some])
        measures.append(Measure(f"{kind}: error over the noise", error))
    return Row(f"planted, {len(some)} seeds: {name}", measures)
