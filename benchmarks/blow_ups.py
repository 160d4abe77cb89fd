"""Predictions far beyond the target where the training data are said to cover a row.

Smooth functions of inputs of six distributions: 480 by default, and 400 with two or three terms per
input. Counted are fits in which a test row in the box of the training rows, with a coverage of a
tenth or more, is predicted beyond the training target's range by more than one range of it, and the
truth is not. Chosen before anything was fitted, and never changed.
"""

from dataclasses import dataclass

import numpy as np

from .cases import evaluate, fitted
from .random_functions import SMOOTH, Case, make_data, outside
from .readable import readability
from .report import Measure, Results, Row, Table

__all__ = ["cases", "run"]

_INPUTS = ("uniform", "clusters", "correlated", "normal", "t3", "lognormal")
_N_DEFAULT, _N_GIVEN = 480, 400
# The first of those with terms given: three normal inputs, three terms.
_N_GRIDS = 20
_COVERED = 0.1
_BEYOND = 1.0
# The seeds of the battery are below.
_FIRST_SEED = 1000


@dataclass(frozen=True)
class Fit:
    """A case, and the terms per input that are asked for."""

    data: Case
    n_mfs: int | str

    def __str__(self):
        return f"{self.data}, n_mfs={self.n_mfs!r}"


def cases():
    """80 of each distribution by default, then those with terms given."""
    rng = np.random.default_rng(_FIRST_SEED)
    drawn = _draw(rng, _N_DEFAULT, most_inputs=6)
    by_default = [Fit(Case(_FIRST_SEED + k, *case), "auto") for k, case in enumerate(drawn)]
    first, given = _FIRST_SEED + _N_DEFAULT, []
    for k, case in enumerate(_draw(rng, _N_GIVEN, most_inputs=4)):
        n_mfs = int(rng.integers(2, 4))
        if k < _N_GRIDS:
            case, n_mfs = (3, 432, 0.1, "normal", case[-1]), 3
        given.append(Fit(Case(first + k, *case), n_mfs))
    # Every N-th case is then a fair part of all.
    return [case for some in (by_default, given) for case in some]


def _draw(rng, n_cases, most_inputs):
    """What a case consists of: 50 to 1,000 rows, noise up to 20 %."""
    n_inputs = rng.integers(2, most_inputs + 1, n_cases).tolist()
    rows = np.exp(rng.uniform(np.log(50.0), np.log(1000.0), n_cases)).round().astype(int).tolist()
    noises = rng.uniform(0, 0.2, n_cases).tolist()
    inputs = rng.permutation(np.resize(_INPUTS, n_cases)).tolist()
    functions = rng.permutation(np.resize(list(SMOOTH), n_cases)).tolist()
    return list(zip(n_inputs, rows, noises, inputs, functions, strict=True))


def measure(fit, options):
    data = make_data(fit.data)
    given = {} if fit.n_mfs == "auto" else {"n_mfs": fit.n_mfs}
    model, seconds = fitted(data.X, data.y, options, **given)
    prediction, covered = model.predict(data.X_test), model.coverage(data.X_test) >= _COVERED
    inside = data.in_box
    wrong = outside(prediction, data.y, _BEYOND) & ~outside(data.truth, data.y, _BEYOND)
    excess = np.maximum(data.y.min() - prediction, prediction - data.y.max()) / np.ptp(data.y)
    judged = inside & covered
    level = np.sqrt(np.mean((prediction - data.truth)[inside] ** 2)) / np.std(data.truth)
    return {
        "case": str(fit),
        "inputs": fit.data.inputs,
        "n_mfs": fit.n_mfs,
        "wrong": int(np.sum(wrong & judged)),
        "wrong, not covered": int(np.sum(wrong & inside & ~covered)),
        "furthest": float(excess[judged].max(initial=0.0)),
        "covered": float(np.mean(covered[inside])) if inside.any() else 0.0,
        "error inside": float(level),
        "seconds": seconds,
        **readability(model, data.X, data.y),
    }


def run(options):
    found, failed = evaluate("blow_ups", measure, cases(), options)
    rows, tables = [Row("smooth functions", [failed])], []
    for title, given in (("defaults", False), ("n_mfs of 2 or 3", True)):
        some = [figures for figures in found if (figures["n_mfs"] != "auto") == given]
        if some:
            rows.append(row(title, some))
            tables.append(by_inputs(title, some))
    worst = sorted(found, key=lambda figures: -figures["furthest"])[:10]
    keys = ("case", "wrong", "furthest", "rules", "strongest", "error inside")
    head = ["case", "rows", "furthest [ranges]", "rules", "strongest alone [sd]", "error [sd]"]
    lines = [[figures[key] for key in keys] for figures in worst]
    return Results(rows, [*tables, Table("Blow-ups: the furthest ten", head, lines)])


def row(title, some):
    n_wrong = sum(figures["wrong"] > 0 for figures in some)
    uncovered = sum(figures["wrong, not covered"] > 0 for figures in some)
    terms = sum(figures["false"] + figures["alike"] for figures in some)
    return Row(
        f"{len(some)} smooth functions, {title}: fits with rows in the box beyond the target by "
        "over one range where the truth is not",
        [
            Measure("covered", float(n_wrong), "", 0),
            Measure("not covered", float(uncovered)),
            Measure("terms never true, or alike", float(terms), "", 0),
            Measure("median fit, CPU", float(np.median([f["seconds"] for f in some])), "s"),
        ],
    )


def by_inputs(title, some):
    lines = []
    for inputs in _INPUTS:
        of = [figures for figures in some if figures["inputs"] == inputs]
        if of:
            lines.append(
                [
                    inputs,
                    len(of),
                    sum(figures["wrong"] > 0 for figures in of),
                    sum(figures["wrong, not covered"] > 0 for figures in of),
                    max(figures["furthest"] for figures in of),
                    float(np.median([figures["error inside"] for figures in of])),
                    float(np.mean([figures["covered"] for figures in of])),
                ]
            )
    head = ["inputs", "fits", "beyond, covered", "beyond, not covered", "furthest [ranges]"]
    return Table(f"Blow-ups, {title}", [*head, "median error [sd]", "part covered"], lines)
