"""What it costs to ask what a structure knows between the rows.

Functions of clustered inputs, of normal ones with one or three rows thirty deviations off, and of
uniform ones of which the product of two is a column too: the search as it is over the same search
that does not ask. Beside it searches that ask half-way to the nearest of fewer others, by another
limit, and whatever the smaller model errs by. What is saved is the other side: ``small_problems
--only 'three runs'``. An error is over 1,500 or 2,000 fresh rows of the same distribution, the far
rows left out. Chosen before anything was fitted, and never changed; the first half of the clustered
ones is what the number of others was chosen by.
"""

from contextlib import nullcontext
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np

from skanfis.search import between, trials

from .cases import evaluate, fitted, geometric_mean
from .random_functions import Case, Data, make_data
from .report import Measure, Results, Row, Table

__all__ = ["cases", "run"]

_CLUSTERS = ("clusters, chosen by", "clusters, others")
_FAR = ("one far", "three far")
_DEPENDENT = "a product beside its factors"
_N_CASES, _N_DEPENDENT, _N_TEST = 48, 24, 1500
# The seeds of the battery and of the blow-ups are below.
_FIRST_FAR, _FIRST_DEPENDENT = 2000, 3000
# The question asked otherwise: what takes the place of what, in which module.
_UNASKED = (between, "_MOST_UNKNOWN", 1.0)
_OTHERWISE = {
    "3 others": (between, "_OTHERS", 3),
    "10 others": (between, "_OTHERS", 10),
    "5 %": (between, "_MOST_UNKNOWN", 0.05),
    "whatever the smaller one errs by": (
        trials,
        "unknown_between",
        lambda tuned, places, to_beat: between.unknown_between(tuned, places),
    ),
}


@dataclass(frozen=True)
class Clustered:
    """Waves across two to five clusters of one to three inputs."""

    seed: int

    @property
    def inputs(self):
        return _CLUSTERS[self.seed // _N_CASES]

    def __str__(self):
        return f"{self.seed}: waves, {self.inputs}"

    def data(self):
        rng = np.random.default_rng(self.seed)
        n_inputs, n_clusters = 1 + self.seed % 3, 2 + self.seed % 4
        n_rows = int(rng.integers(60, 500))
        centers = rng.uniform(-1, 1, (n_clusters, n_inputs)) * rng.uniform(2, 12)
        widths = rng.uniform(0.2, 1.0, (n_clusters, n_inputs))
        waves = rng.normal(size=(3, n_inputs)) * rng.uniform(0.5, 3)
        phases = rng.uniform(0, 6, 3)

        def inputs(n):
            of = rng.integers(n_clusters, size=n)
            return centers[of] + widths[of] * rng.standard_normal((n, n_inputs))

        def truth(X):
            return np.sin(X @ waves.T + phases).sum(axis=1) + 0.3 * X[:, 0]

        X, fresh = inputs(n_rows), inputs(_N_TEST)
        noise = rng.choice([0.001, 0.05, 0.3])
        y = truth(X) + noise * rng.standard_normal(n_rows)
        return Data(X, y, fresh, truth(fresh), noise)


@dataclass(frozen=True)
class Far:
    """A smooth function of one to three normal inputs, and rows far off."""

    case: Case

    @property
    def inputs(self):
        return self.case.inputs

    def __str__(self):
        return str(self.case)

    def data(self):
        return make_data(self.case)


@dataclass(frozen=True)
class Dependent:
    """Ten times the product of two of three uniform inputs, and half a wave or more along each.

    As a scale factor by temperature, beside a drift: the product is given as a column too.
    """

    seed: int
    inputs = _DEPENDENT

    def __str__(self):
        return f"{self.seed}: {_DEPENDENT}"

    def data(self):
        rng = np.random.default_rng(self.seed)
        n_rows, noise = int(rng.integers(200, 1000)), rng.choice([0.001, 0.01, 0.1])
        frequencies, phases = rng.uniform(1.5, 5.0, 3), rng.uniform(0.0, 6.0, 3)

        def truth(X):
            return 10.0 * X[:, 0] * X[:, 1] + np.sin(frequencies * X[:, :3] + phases).sum(axis=1)

        X, fresh = (rng.uniform(-1.0, 1.0, (n, 3)) for n in (n_rows, _N_TEST))
        X, fresh = (np.column_stack([Z, Z[:, 0] * Z[:, 1]]) for Z in (X, fresh))
        y = truth(X) + noise * rng.standard_normal(n_rows)
        return Data(X, y, fresh, truth(fresh), noise)


def cases():
    """As many of each kind; those with rows far off have 60 to 500, noise of 0.1, 5 or 30 %."""
    rng = np.random.default_rng(_FIRST_FAR)
    n_inputs, noises, kinds, functions = (
        rng.permutation(np.resize(values, _N_CASES)).tolist()
        for values in ((1, 2, 3), (0.001, 0.05, 0.3), _FAR, ("fourier", "additive", "ridges"))
    )
    rows = np.exp(rng.uniform(np.log(60.0), np.log(500.0), _N_CASES)).round().astype(int).tolist()
    drawn = zip(n_inputs, rows, noises, kinds, functions, strict=True)
    far = [Far(Case(_FIRST_FAR + k, *case)) for k, case in enumerate(drawn)]
    dependent = [Dependent(_FIRST_DEPENDENT + k) for k in range(_N_DEPENDENT)]
    return [Clustered(seed) for seed in range(2 * _N_CASES)] + far + dependent


def measure(case, options):
    data = case.data()
    asked, rules, seconds = error(data, options)
    unasked, unasked_rules, _ = error(data, options, _UNASKED)
    otherwise = {name: error(data, options, how)[0] for name, how in _OTHERWISE.items()}
    return {
        "case": str(case),
        "inputs": case.inputs,
        "ratio": asked / unasked,
        "error": asked,
        "rules": rules,
        "rules unasked": unasked_rules,
        "seconds": seconds,
        **{name: found / unasked for name, found in otherwise.items()},
    }


def error(data, options, otherwise=None):
    """Of a fit that asks so or otherwise, in deviations of the truth; rules; seconds."""
    with nullcontext() if otherwise is None else patch.object(*otherwise):
        model, seconds = fitted(data.X, data.y, options)
    errors = model.predict(data.X_test) - data.truth
    found = float(np.sqrt(np.mean(errors**2)) / data.truth.std())
    return found, int(model.n_rules_), seconds


def run(options):
    found, failed = evaluate("between", measure, cases(), options)
    rows = [Row("clustered inputs, rows far off, products beside their factors", [failed])]
    for inputs in (*_CLUSTERS, *_FAR, _DEPENDENT):
        some = [figures for figures in found if figures["inputs"] == inputs]
        if some:
            rows.append(row(inputs, some))
    changed = sorted((f for f in found if f["ratio"] != 1.0), key=lambda f: -f["ratio"])
    keys = ("case", "ratio", "error", "rules", "rules unasked")
    head = ["case", "over unasked", "error [sd]", "rules", "rules unasked"]
    lines = [[figures[key] for key in keys] for figures in changed]
    return Results(rows, [Table("Between rows: where it changes anything", head, lines)])


def row(inputs, some):
    def mean(key):
        return geometric_mean([figures[key] for figures in some])

    return Row(
        f"{len(some)} functions, {inputs}: error over that of a search that does not ask",
        [
            Measure("geometric mean", mean("ratio")),
            Measure("worst", max(figures["ratio"] for figures in some)),
            *(Measure(f"with {name}", mean(name)) for name in _OTHERWISE),
            Measure("mean error [sd]", mean("error")),
            Measure("median fit, CPU", float(np.median([f["seconds"] for f in some])), "s"),
        ],
    )
