"""Intervals that were promised to cover 90 %: how often they do, and how wide they are.

Real sets (a third left out, at most 500 rows to train on), every fourth function of the battery,
and cold starts of a dozen simulated gyros at rest, thirty to train on and thirty new ones of each:
by so few runs the mean coverage of one gyro is uncertain by 4 %. Beside the deviation alone, taken
for normal, and the intervals of ``ConformalRegressor``, a Gaussian process (of at most 400 rows)
and gradient boosting of two quantiles, conformalised (Romano, Patterson and Candes 2019). Of "run",
the default where runs are given, 90 % of a new run's rows are to be covered with a probability of
90 %; of the others 90 % of rows on average. Beside the runs that an interval leaves short stands
how many are to be expected, new runs being like the old (``new_runs``). Coverages are of rows that
nothing has seen. Widths are beside one another at equal coverage: each method's intervals are
stretched or shrunk about their centres until they cover 90 % of these rows.
"""

from time import process_time

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.frozen import FrozenEstimator
from sklearn.model_selection import KFold, train_test_split

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.intervals import ConformalRegressor

from . import battery, real_sets, structure
from .cases import evaluate, geometric_mean
from .compensation import with_thermal_rate
from .new_runs import expected_short, run_scores, scores_of_rows
from .random_functions import make_data
from .report import Measure, Results, Row, Table

__all__ = ["cases", "run"]

COVERAGE = 0.9
_NORMAL = 1.6448536269514722
_EVERY = 4
_MOST_ROWS, _GP_ROWS = 500, 400
_SEEDS = tuple(range(20, 32))
_N_RUNS, _EVERY_ROW = 60, 12
_N_TERMS = (2, 2, 2)
_STARTS = ["time", "temperature", "thermal_rate"]
# Of a run's rows, with what probability: what can be asked of thirty runs.
_REQUESTS = (
    (0.9, None),
    (0.8, 0.8),
    (0.8, 0.9),
    (0.85, 0.9),
    (0.9, 0.8),
    (0.9, 0.85),
    (0.9, 0.9),
    (0.8, 0.967),
    (0.95, 0.9),
    (0.9, 0.95),
)
METHODS = (
    "std",
    "folds",
    "run",
    "cross",
    "split",
    "loo",
    "Gaussian process",
    "quantile boosting",
)


class Start:
    """A gyro's cold starts at rest, each at a temperature of its own; half of them to train on."""

    def __init__(self, seed):
        self.seed = seed

    def __str__(self):
        return f"cold starts {self.seed}"

    def data(self):
        log = make_ofog(
            n_devices=1,
            n_runs=_N_RUNS,
            max_residual_heat=0.0,
            rates=[0.0],
            random_state=self.seed,
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
        yield X[~test], y[~test], run[~test], X[test], y[test], run[test]
    elif isinstance(case, real_sets.RealSet):
        X, y = real_sets.load(case)
        train, test = next(KFold(3, shuffle=True, random_state=0).split(X))
        train = np.random.default_rng(0).permutation(train)[:_MOST_ROWS]
        yield X[train], y[train], None, X[test], y[test], None
    else:
        data = make_data(case)
        noise = data.noise * np.random.default_rng(case.seed + 1).standard_normal(len(data.truth))
        X, y = data.X[:_MOST_ROWS], data.y[:_MOST_ROWS]
        yield X, y, None, data.X_test, data.truth + noise, None


def intervals(X, y, groups, new):
    """Lower and upper bound by each method, seconds, bounds by each request of whole runs, and the
    regressor of intervals by folds that gave these.
    """
    found, seconds, asked, by_folds = {}, {}, {}, None

    def add(name, bounds):
        start = process_time()
        found[name] = bounds()
        seconds[name] = process_time() - start

    # With runs the default would compare structures by runs left out, once more in every fold.
    regressor = ANFISRegressor() if groups is None else ANFISRegressor(_N_TERMS)
    fitted = regressor.fit(X, y)

    def deviation():
        mean, std = fitted.predict(new, return_std=True)
        return mean - _NORMAL * std, mean + _NORMAL * std

    given, kept = {} if groups is None else {"groups": groups}, []

    def conformal(method):
        own = FrozenEstimator(fitted) if method == "loo" else regressor
        model = ConformalRegressor(own, method=method)
        if method == "split" and groups is not None:
            model.set_params(calibration_fraction=0.5)
        kept[:] = [model.fit(X, y, **given)]
        return model.predict_interval(new, COVERAGE, confidence=None)

    def gaussian_process():
        rows = np.random.default_rng(0).permutation(len(X))[:_GP_ROWS]
        model = structure.gaussian_process(X.shape[1]).fit(X[rows], y[rows])
        mean, std = model.predict(new, return_std=True)
        return mean - _NORMAL * std, mean + _NORMAL * std

    add("std", deviation)
    add("folds", lambda: conformal("folds"))
    if groups is not None:
        add("run", lambda: kept[0].predict_interval(new, COVERAGE))
        asked = {request: kept[0].predict_interval(new, *request) for request in _REQUESTS}
        by_folds = kept[0]
    # Of the same fits.
    add("cross", lambda: kept[0].set_params(method="cross").predict_interval(new, COVERAGE, None))
    add("split", lambda: conformal("split"))
    if groups is None:
        add("loo", lambda: conformal("loo"))
    add("Gaussian process", gaussian_process)
    add("quantile boosting", lambda: quantile_boosting(X, y, groups, new))
    return found, seconds, asked, by_folds


def quantile_boosting(X, y, groups, new):
    """Two quantiles, moved together by as much as rows held out ask for; by rows, or by runs."""
    if groups is None:
        train, held_out = train_test_split(np.arange(len(X)), test_size=0.25, random_state=0)
    else:
        held_out = np.flatnonzero(groups >= _N_RUNS // 4)
        train = np.flatnonzero(groups < _N_RUNS // 4)
    edges = (0.5 * (1.0 - COVERAGE), 0.5 * (1.0 + COVERAGE))
    models = [
        HistGradientBoostingRegressor(
            loss="quantile", quantile=q, min_samples_leaf=min(20, max(2, len(train) // 10))
        ).fit(X[train], y[train])
        for q in edges
    ]
    low, high = (model.predict(X[held_out]) for model in models)
    scores = np.sort(np.maximum(low - y[held_out], y[held_out] - high))
    place = int(np.ceil((scores.size + 1) * COVERAGE)) - 1
    excess = scores[min(place, scores.size - 1)]
    low, high = (model.predict(new) for model in models)
    return low - excess, high + excess


def measure(case, options):
    covered = {name: [] for name in METHODS}
    stretch, widths, runs = ({name: [] for name in METHODS} for _ in range(3))
    spent, spreads, n_rows, by_run = dict.fromkeys(METHODS, 0.0), [], 0, {}
    for X, y, groups, new, truth, test_groups in parts(case):
        n_rows, n_inputs = X.shape
        spreads.append(np.std(truth))
        found, seconds, asked, by_folds = intervals(X, y, groups, new)
        if asked:
            scores = scores_of_rows(by_folds, X, y, groups, new, truth)
        requests = [
            (
                *request,
                *_of_runs(low, high, truth, test_groups),
                *_by_chance(*request, *scores, groups, test_groups),
            )
            for request, (low, high) in asked.items()
        ]
        for name, (low, high) in found.items():
            inside = (low <= truth) & (truth <= high)
            covered[name].append(inside)
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            half = np.maximum(half, 1e-12 * spreads[-1])
            stretch[name].append(np.abs(truth - middle) / half)
            widths[name].append(2.0 * half / spreads[-1])
            spent[name] += seconds[name]
            if test_groups is not None:
                runs[name] = [
                    float(np.mean(inside[test_groups == r])) for r in np.unique(test_groups)
                ]
    by_run = {name: values for name, values in runs.items() if values}
    result = {"case": str(case), "rows": n_rows, "inputs": n_inputs, "by run": by_run}
    result["requests"] = requests
    result["kind"] = (
        "cold starts"
        if isinstance(case, Start)
        else "real sets"
        if isinstance(case, real_sets.RealSet)
        else "battery"
    )
    present = [name for name in METHODS if covered[name]]
    result["coverage"] = {n: float(np.mean(np.concatenate(covered[n]))) for n in present}
    result["width"] = {n: float(np.mean(np.concatenate(widths[n]))) for n in present}
    result["equal"] = {
        n: float(
            np.quantile(np.concatenate(stretch[n]), COVERAGE) * np.mean(np.concatenate(widths[n]))
        )
        for n in present
    }
    result["seconds"] = {name: spent[name] for name in present}
    return result


def _of_runs(low, high, truth, groups):
    """Part of the rows covered, runs covered by less than 90 and 80 %, and the mean width."""
    inside = (low <= truth) & (truth <= high)
    of_run = np.array([np.mean(inside[groups == r]) for r in np.unique(groups)])
    width = float(np.mean(high - low))
    return float(np.mean(inside)), int(sum(of_run < COVERAGE)), int(sum(of_run < 0.8)), width


def _by_chance(coverage, confidence, old, new, groups, test_groups):
    """How many runs are to be expected below 90 and 80 %; nothing where rows are asked for."""
    if confidence is None:
        return None, None
    parts = (coverage, COVERAGE), (coverage, 0.8)
    return tuple(
        expected_short(
            [run_scores(old, groups, part) for part in pair],
            [run_scores(new, test_groups, part) for part in pair],
            confidence,
        )
        for pair in parts
    )


def requested(found):
    """What each request of whole runs gives, over all cold starts."""
    by_request = zip(*[one["requests"] for one in found if one["requests"]], strict=True)
    lines = []
    for own in by_request:
        coverage, confidence = own[0][:2]
        _, _, covered, short, far, widths, *chance = zip(*own, strict=True)
        expected = ["" if confidence is None else round(sum(one), 1) for one in chance]
        counts = [sum(short), expected[0], sum(far), expected[1]]
        lines.append([coverage, confidence or "", np.mean(covered), *counts, widths])
    for line in lines[::-1]:
        line[-1] = geometric_mean(np.divide(line[-1], lines[0][-1]))
    head = ["of a run's rows", "with probability", "covered"]
    head += ["below 90 %", "expected", "below 80 %", "expected", "width"]
    return Table("How sure: requests of whole runs, by folds", head, lines)


def run(options):
    found, failed = evaluate("how_sure", measure, cases(), options)
    rows = []
    for kind in ("real sets", "battery", "cold starts"):
        own = [figures for figures in found if figures["kind"] == kind]
        if own:
            rows += [row(kind, own, method) for method in METHODS if method in own[0]["coverage"]]
    rows[-1:] = [Row(rows[-1].work, [*rows[-1].measures, failed])]
    return Results(rows, [table(found), table(found, "equal"), by_run(found), requested(found)])


def row(kind, found, method):
    coverage = np.array([figures["coverage"][method] for figures in found])
    widths = geometric_mean(
        [figures["equal"][method] / figures["equal"]["Gaussian process"] for figures in found]
    )
    groups = [c for figures in found for c in figures["by run"].get(method, [])] or coverage
    ours = method in ("folds", "cross", "split", "loo")
    return Row(
        f"90 % intervals, {kind}, {len(found)} cases: {method}",
        [
            Measure(
                "mean off 90 %",
                100 * abs(float(coverage.mean()) - COVERAGE),
                "points",
                2.0 if ours else None,
            ),
            Measure("mean coverage", 100 * float(coverage.mean()), "%"),
            Measure(
                "least short of 90 %",
                100 * (COVERAGE - float(np.min(groups))),
                "points",
                10.0 if ours else None,
            ),
            Measure("width over the Gaussian process's at equal coverage", widths),
        ],
    )


def table(found, key="coverage"):
    title = {
        "coverage": "How sure: part of new rows in 90 % intervals",
        "equal": "How sure: mean width at 90 % coverage, in deviations of the target",
    }[key]
    lines = [
        [
            f"{figures['case']}, {figures['rows']} x {figures['inputs']}",
            *(figures[key].get(method, "") for method in METHODS),
        ]
        for figures in found
    ]
    return Table(title, ["data", *METHODS], lines)


def by_run(found):
    lines = []
    for figures in found:
        for method, values in figures["by run"].items():
            lines.append(
                [
                    figures["case"],
                    method,
                    min(values),
                    float(np.median(values)),
                    sum(value < COVERAGE for value in values),
                    sum(value < 0.8 for value in values),
                    len(values),
                ]
            )
    head = ["data", "method", "least", "median", "runs below 90 %", "below 80 %", "runs"]
    return Table("How sure: coverage of each run left out", head, lines)
