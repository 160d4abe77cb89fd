"""A compensated gyro beside its bars: simulated, where the truth is known, and real.

The real campaign is no part of the project: --campaign PATH. Splits hold out whole runs, or whole
levels of the rate's size; numbers of terms are chosen by cross-validation within the training part,
by the same kind of groups.
"""

from functools import partial

import numpy as np
from sklearn.compose import TransformedTargetRegressor, make_column_transformer
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import GridSearchCV, GroupKFold, LeaveOneGroupOut
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor, ThermalRate

from . import campaign
from .report import Measure, Results, Row, Table
from .timing import best_of

__all__ = ["run"]

_SEEDS = range(10, 13)  # others than those that the method was tried on
_INPUTS = ["output", "temperature", "time", "thermal_rate"]
_WARM_UP = (["temperature"], ["time", "temperature", "thermal_rate"])
_GP_ROWS = 400  # its cost grows with the cube
_SLOW = 65.0  # deg/s; trained on rates up to it, tested above
_SECONDS_PER_HOUR = 3600.0


def search(estimator, grid, n_splits):
    """The estimator with parameters from a search over groups."""
    cv = GroupKFold(n_splits)
    return GridSearchCV(estimator, grid, cv=cv, scoring="neg_mean_squared_error")


def plain(choices, n_splits, prefix="anfisregressor__"):
    """The default example: scaling and an ANFIS."""
    pipeline = make_pipeline(StandardScaler(), ANFISRegressor())
    return search(pipeline, {f"{prefix}n_mfs": choices}, n_splits)


# Simulated cold starts ------------------------------------------------------------------------


def cold_starts(seed):
    """Twelve cold starts of one gyro, each at a temperature of its own."""
    log = make_ofog(n_devices=1, n_runs=12, max_residual_heat=0.0, random_state=seed)
    return with_thermal_rate(log)


def with_thermal_rate(log):
    causal = ThermalRate(10.0, time="time", run="power_up")
    rates = causal.fit_transform(log[["time", "temperature", "power_up"]])
    return log.assign(thermal_rate=np.asarray(rates)[:, -1])


def law():
    """What an open-loop gyro obeys; the thermometer's lag is fitted with it."""
    return OpenLoopArcsineRegressor(
        "output",
        "temperature",
        temperature_rate="thermal_rate",
        amplitude_degree=2,
        bias_degree=2,
    )


def physics_and_anfis():
    """The law, and rules on output, time and thermal rate for what dies away after power-on."""
    left = make_column_transformer(("passthrough", ["output", "time", "thermal_rate"]))
    rules = make_pipeline(left, ANFISRegressor())
    compensator = ResidualRegressor(law(), rules, n_rounds=3)
    choices = [[1, 2, 1], [1, 3, 1], [2, 3, 1], [2, 2, 2]]
    return search(compensator, {"residual__anfisregressor__n_mfs": choices}, n_splits=4)


def polynomial(degree):
    return make_pipeline(StandardScaler(), PolynomialFeatures(degree), LinearRegression())


class _FewRows(GaussianProcessRegressor):
    """A Gaussian process that learns from evenly chosen rows."""

    def fit(self, X, y):
        step = max(1, len(X) // _GP_ROWS)
        return super().fit(X[::step], y[::step])


def gaussian_process():
    kernel = ConstantKernel(10.0, (1e-3, 1e5)) * RBF([3.0] * len(_INPUTS), (0.1, 1e3))
    kernel += WhiteKernel(1e-4, (1e-9, 1.0))
    return make_pipeline(StandardScaler(), _FewRows(kernel, normalize_y=True))


def perceptron():
    network = MLPRegressor(hidden_layer_sizes=(64, 64), max_iter=500, random_state=0)
    scaled = TransformedTargetRegressor(network, transformer=StandardScaler())
    return make_pipeline(StandardScaler(), scaled)


RIVALS = {
    "straight line": LinearRegression,
    "cubic": partial(polynomial, 3),
    "quintic": partial(polynomial, 5),
    f"Gaussian process ({_GP_ROWS} rows)": gaussian_process,
    "MLP, 64 + 64": perceptron,
    "gradient boosting": HistGradientBoostingRegressor,
    "ANFIS as it comes": lambda: ANFISRegressor(),
    "scaling + ANFIS, terms by search": lambda: plain([2, [3, 2, 2, 2], [4, 2, 2, 2]], 4),
}


def residual(make_estimator, log, inputs, target):
    """Error on every row by a model that has not seen its run; the last model; seconds per fit."""
    X, y, run = log[inputs], log[target].to_numpy(), log["run"].to_numpy()
    left, seconds = np.empty(len(log)), []
    for train, test in LeaveOneGroupOut().split(X, y, run):

        def fit(train=train):
            estimator = make_estimator()
            groups = {"groups": run[train]} if isinstance(estimator, GridSearchCV) else {}
            return estimator.fit(X.iloc[train], y[train], **groups)

        spent, model = best_of(fit, rounds=1)
        seconds.append(spent)
        left[test] = model.predict(X.iloc[test]) - y[test]
    return left, model, float(np.mean(seconds))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def n_rules(model):
    model = getattr(model, "best_estimator_", model)
    model = getattr(model, "residual_", model)
    model = model[-1] if hasattr(model, "steps") else model
    return getattr(model, "n_rules_", "")


def simulated():
    """The first row, and its table."""
    over_floor, under_line, rules, lines = [], [], [], []
    for seed in _SEEDS:
        log = cold_starts(seed)
        floor = rms(log["noise"])
        left, model, seconds = residual(physics_and_anfis, log, _INPUTS, "rate")
        line = residual(LinearRegression, log, _INPUTS, "error")[0]
        over_floor.append(rms(left) / floor)
        under_line.append(rms(line) / rms(left))
        rules.append(n_rules(model))
        if seed == _SEEDS[0]:
            lines = [line_of("arcsine law + ANFIS, 3 rounds", left, model, seconds, floor)]
    log = cold_starts(_SEEDS[0])
    left, model, seconds = residual(law, log, _INPUTS, "rate")
    lines.append(line_of("arcsine law with thermometer lag", left, model, seconds, floor_of(log)))
    for name, make in RIVALS.items():
        left, model, seconds = residual(make, log, _INPUTS, "error")
        lines.append(line_of(name, left, model, seconds, floor_of(log)))
    measures = [
        Measure("median over the noise floor", float(np.median(over_floor)), "", 1.3),
        Measure("worst", max(over_floor), "", 1.3),
        Measure("over a straight line's, worst", 1.0 / min(under_line), "", 0.05),
        Measure("rules, most", float(max(rules)), ""),
    ]
    work = f"simulated cold starts, 12 temperatures, one left out, {len(_SEEDS)} devices"
    head = ["model", "rules", "RMS [deg/s]", "over the noise floor", "peak [deg/s]", "CPU/fit [s]"]
    title = "Simulated cold starts: the run left out, first device"
    return Results([Row(work, measures)], [Table(title, head, lines)])


def floor_of(log):
    return rms(log["noise"])


def line_of(name, left, model, seconds, floor):
    peak = float(np.abs(left).max())
    return [name, n_rules(model), rms(left), rms(left) / floor, peak, seconds]


# Simulated warm-up at rest --------------------------------------------------------------------


def warm_up():
    """Temperature alone against time, temperature and thermal rate: runs of three power-ups."""
    factors, lines = [], []
    for seed in _SEEDS:
        log = with_thermal_rate(
            make_ofog(
                n_devices=1,
                n_runs=12,
                n_power_ups=3,
                off_time=900.0,
                rates=[0.0],
                sampling_interval=30.0,
                random_state=seed,
            )
        )
        make = partial(plain, [1, 2, 3], 4)
        alone, all_three = (rms(residual(make, log, inputs, "error")[0]) for inputs in _WARM_UP)
        factors.append(alone / all_three)
        figures = [log["error"].std(), alone, all_three, floor_of(log)]
        lines.append([seed, *(float(_SECONDS_PER_HOUR * f) for f in figures), factors[-1]])
    measures = [
        # What falls, as a ratio to what it was: at most.
        Measure("left, over temperature alone, median", float(1 / np.median(factors)), "", 0.5),
        Measure("worst", 1 / min(factors), ""),
    ]
    head = ["device", "raw", "temperature", "time, temperature, thermal rate", "floor", "factor"]
    title = "Simulated warm-up at rest, RMS of the bias in the run left out [deg/h]"
    work = f"simulated warm-up at rest, 12 runs of 3 power-ups, {len(_SEEDS)} devices"
    return Results([Row(work, measures)], [Table(title, head, lines)])


# The real campaign ----------------------------------------------------------------------------


def campaign_law():
    return OpenLoopArcsineRegressor()


def campaign_compensator():
    compensator = ResidualRegressor(campaign_law(), ANFISRegressor())
    choices = [1, [2, 1], [3, 1], [4, 1], 2, [3, 2], [4, 2]]
    return search(compensator, {"residual__n_mfs": choices}, n_splits=10)


def linear_anfis():
    return ANFISRegressor(out_of_bounds="linear")


CAMPAIGN = {
    "arcsine law + ANFIS, terms by search": campaign_compensator,
    "arcsine law + ANFIS, 3 rules": lambda: ResidualRegressor(
        campaign_law(), ANFISRegressor([3, 1])
    ),
    "arcsine law": campaign_law,
    "ANFIS as it comes": lambda: ANFISRegressor(),
    'ANFIS, out_of_bounds="linear"': linear_anfis,
    "scaling + ANFIS, terms by search": lambda: plain([2, [3, 2], [4, 2], [5, 2]], 10),
    "cubic": partial(polynomial, 3),
    "Gaussian process": partial(campaign.gaussian_process, n_inputs=2),
}


def fit_levels(make_estimator, X, rate, level):
    estimator = make_estimator()
    groups = {"groups": level} if isinstance(estimator, GridSearchCV) else {}
    return estimator.fit(X, rate, **groups)


def held_out(make_estimator, X, rate, level):
    """RMS over interleaved groups of levels without the top one, and the most rules."""
    errors, rules = [], []
    for group in range(5):
        test = level % 5 == group
        model = fit_levels(make_estimator, X[~test], rate[~test], level[~test])
        scored = test & (level < level.max())
        errors.append(model.predict(X[scored]) - rate[scored])
        rules.append(n_rules(model))
    return rms(np.concatenate(errors)), rules


def above(make_estimator, X, rate, level):
    """RMS above the rates trained on, and the part of these rows that is flagged."""
    slow = np.abs(rate) <= _SLOW
    model = fit_levels(make_estimator, X[slow], rate[slow], level[slow])
    left = rms(model.predict(X[~slow]) - rate[~slow])
    model = getattr(model, "best_estimator_", model)
    if hasattr(model, "steps"):
        inside = (
            model[-1].in_bounds(model[:-1].transform(X[~slow])) if has_flags(model[-1]) else None
        )
    else:
        inside = model.in_bounds(X[~slow]) if has_flags(model) else None
    return left, "" if inside is None else float(np.mean(~inside))


def has_flags(model):
    return hasattr(model, "in_bounds")


def real(options):
    """The second and third row."""
    held = "campaign, rate levels held out"
    faster = f"campaign, fitted on |rate| ≤ {_SLOW:g} deg/s and tested above"
    if options.campaign is None:
        missing = [Measure("RMS", None, "deg/s")]
        return Results([Row(f"{work}, --campaign PATH", missing) for work in (held, faster)])
    data = campaign.read(options.campaign)
    lines, found = [], {}
    for name, make in CAMPAIGN.items():
        error, rules = held_out(make, *data)
        extrapolated, flagged = above(make, *data)
        found[name] = error, rules, extrapolated, flagged
        lines.append([name, "-".join(map(str, sorted(set(rules)))), error, extrapolated, flagged])
    ours = found["arcsine law + ANFIS, terms by search"]
    alone = found["ANFIS as it comes"]
    rows = [
        Row(
            held,
            [
                Measure("ANFIS as it comes", alone[0], "deg/s", 0.048),
                Measure("rules", float(max(alone[1])), "", 12),
                Measure("arcsine law + ANFIS", ours[0], "deg/s", 0.048),
                Measure("rules", float(max(ours[1])), "", 12),
            ],
        ),
        Row(
            faster,
            [
                Measure("arcsine law + ANFIS", ours[2], "deg/s", 0.085),
                Measure("part of rows not flagged", 1.0 - ours[3], "", 0.0),
                Measure("ANFIS as it comes", alone[2], "deg/s"),
            ],
        ),
    ]
    head = ["model", "rules", "levels held out [deg/s]", "above 65 deg/s [deg/s]", "flagged"]
    return Results(rows, [Table("Rate-table campaign, compensators", head, lines)])


def run(options):
    return simulated() + real(options) + warm_up()
