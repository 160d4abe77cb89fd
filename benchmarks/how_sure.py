"""Intervals that were promised to cover 90 %: how often they do, and how wide they are.

The data are real sets (a third left out, at most 500 rows to train on), every fourth function of
the battery, and cold starts of simulated gyros at rest, thirty to train on and thirty new ones of
each. Intervals come from the deviation alone, taken for normal, from ``ConformalRegressor``, and
from a Gaussian process of at most 400 rows. Coverage is counted on rows that no model has seen.
Before widths are compared, intervals are stretched about their centres until they cover 90 %.
"""

import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.intervals import ConformalRegressor

from . import battery, real_sets
from .cases import evaluate, folds
from .compensation import with_thermal_rate
from .random_functions import make_data
from .report import Measure, Results, Row
from .rivals import gaussian_process
from .scores import geometric_mean

__all__ = ["run"]

COVERAGE = 0.9
_NORMAL = 1.6448536269514722
_EVERY = 4
_MOST_ROWS, _GP_ROWS = 500, 400
_SEEDS = tuple(range(20, 32))
_N_RUNS, _EVERY_ROW = 60, 12
_N_TERMS = (2, 2, 2)
_STARTS = ["time", "temperature", "thermal_rate"]


class Start:
    """A gyro's cold starts at rest, each at a temperature of its own; half of them to train on."""

    def __init__(self, seed):
        self.seed = seed

    def __str__(self):
        return f"cold starts {self.seed}"

    def data(self):
        log = make_ofog(
            n_devices=1, n_runs=_N_RUNS, max_residual_heat=0.0, rates=[0.0], random_state=self.seed
        )
        log = with_thermal_rate(log).iloc[::_EVERY_ROW]
        return log[_STARTS].to_numpy(), log["error"].to_numpy(), log["run"].to_numpy()


def cases():
    starts = [Start(seed) for seed in _SEEDS]
    return [*starts, *battery.cases()[::_EVERY], *real_sets.SETS]


def parts(case):
    """Training and test rows: X, y, groups or None, X_test, y_test, groups of the test rows."""
    if isinstance(case, Start):
        X, y, run = case.data()
        test = run >= _N_RUNS // 2
        return X[~test], y[~test], run[~test], X[test], y[test], run[test]
    if isinstance(case, real_sets.RealSet):
        X, y = real_sets.load(case)
        train, test = next(folds(X, 3))
        train = np.random.default_rng(0).permutation(train)[:_MOST_ROWS]
        return X[train], y[train], None, X[test], y[test], None
    data = make_data(case)
    noise = data.noise * np.random.default_rng(case.seed + 1).standard_normal(len(data.truth))
    return data.X[:_MOST_ROWS], data.y[:_MOST_ROWS], None, data.X_test, data.truth + noise, None


def normal(model, new):
    mean, std = model.predict(new, return_std=True)
    return mean - _NORMAL * std, mean + _NORMAL * std


def intervals(X, y, groups, new):
    """Lower and upper bound by each method."""
    # With runs the default would compare structures by runs left out, once more in every fold.
    regressor = ANFISRegressor() if groups is None else ANFISRegressor(_N_TERMS)
    fitted = regressor.fit(X, y)
    given = {} if groups is None else {"groups": groups}

    def conformal(method, confidence=None):
        model = ConformalRegressor(regressor, method=method)
        if method == "split" and groups is not None:
            model.set_params(calibration_fraction=0.5)
        return model.fit(X, y, **given).predict_interval(new, COVERAGE, confidence)

    found = {"std": normal(fitted, new), "folds": conformal("folds")}
    if groups is not None:
        found["run"] = conformal("folds", 0.9)
    found["split"] = conformal("split")
    if groups is None:
        found["loo"] = conformal("loo")
    rows = np.random.default_rng(0).permutation(len(X))[:_GP_ROWS]
    process = gaussian_process(X.shape[1]).fit(X[rows], y[rows])
    return {**found, "Gaussian process": normal(process, new)}


def measure(case, options):
    X, y, groups, new, truth, test_groups = parts(case)
    kinds = {Start: "cold starts", real_sets.RealSet: "real sets"}
    result = {"case": str(case), "kind": kinds.get(type(case), "battery")}
    result |= {"by run": {}, "coverage": {}, "width": {}}
    for name, (low, high) in intervals(X, y, groups, new).items():
        inside = (low <= truth) & (truth <= high)
        half = np.maximum(0.5 * (high - low), 1e-12 * np.std(truth))
        stretch = np.quantile(np.abs(truth - 0.5 * (low + high)) / half, COVERAGE)
        result["coverage"][name] = float(np.mean(inside))
        result["width"][name] = float(stretch * np.mean(2.0 * half) / np.std(truth))
        if test_groups is not None:
            runs = np.unique(test_groups)
            result["by run"][name] = [float(np.mean(inside[test_groups == run])) for run in runs]
    return result


def run(options):
    found, failed = evaluate("how_sure", measure, cases(), options)
    rows = [Row("90 % intervals", [failed])]
    for kind in ("real sets", "battery", "cold starts"):
        own = [figures for figures in found if figures["kind"] == kind]
        if own:
            rows += [row(kind, own, method) for method in own[0]["coverage"]]
    return Results(rows)


def row(kind, found, method):
    coverage = np.array([figures["coverage"][method] for figures in found])
    widths = geometric_mean(
        [figures["width"][method] / figures["width"]["Gaussian process"] for figures in found]
    )
    runs = [c for figures in found for c in figures["by run"].get(method, [])]
    off = 100 * abs(float(coverage.mean()) - COVERAGE)
    ours = method in ("folds", "split", "loo")
    return Row(
        f"90 % intervals, {kind}, {len(found)} cases: {method}",
        [
            Measure("mean off 90 %", off, "points", 2.0 if ours else None),
            Measure("mean coverage", 100 * float(coverage.mean()), "%"),
            Measure("least", 100 * float(np.min(coverage)), "%"),
            Measure("runs below 80 %", float(np.sum(np.array(runs) < 0.8)), f"of {len(runs)}"),
            Measure("width over the Gaussian process's at equal coverage", widths),
        ],
    )
