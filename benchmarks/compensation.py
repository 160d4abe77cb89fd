"""A compensated gyro in simulated cold starts, where the truth is known.

Whole runs are held out. The law is that of an open-loop fibre-optic gyro; rules learn what is left
of it by output, time and thermal rate. The real campaign is in ``campaign``.
"""

from functools import partial

import numpy as np
from sklearn.compose import make_column_transformer
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneGroupOut
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from sklearn.utils.validation import has_fit_parameter

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor, ThermalRate

from .report import Measure, Results, Row, Table
from .scores import rms
from .timing import timed

__all__ = ["cold_starts", "polynomial", "run", "with_thermal_rate"]

_SEEDS = range(10, 13)  # others than those that the method was tried on
_INPUTS = ["output", "temperature", "time", "thermal_rate"]


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


def law_and_rules():
    left = make_column_transformer(("passthrough", ["output", "time", "thermal_rate"]))
    rules = make_pipeline(left, ANFISRegressor())
    return ResidualRegressor(law(), rules, n_rounds=3)


def polynomial(degree):
    return make_pipeline(StandardScaler(), PolynomialFeatures(degree), LinearRegression())


# What learns the rate by a law, and what learns the error.
OF_RATE = {"arcsine law + ANFIS, 3 rounds": law_and_rules, "arcsine law": law}
OF_ERROR = {
    "straight line": LinearRegression,
    "cubic": partial(polynomial, 3),
    "gradient boosting": HistGradientBoostingRegressor,
    "ANFIS as it comes": ANFISRegressor,
}


def residual(make_estimator, log, target):
    """RMS over all rows of the error of models that have not seen their run; seconds of a fit.

    Models that take groups are told which rows belong to one run.
    """
    X, y, run = log[_INPUTS], log[target].to_numpy(), log["run"].to_numpy()
    left, seconds = np.empty(len(log)), []
    for train, test in LeaveOneGroupOut().split(X, y, run):
        model = make_estimator()
        told = {"groups": run[train]} if has_fit_parameter(model, "groups") else {}
        _, spent = timed(model.fit, X.iloc[train], y[train], **told)
        seconds.append(spent)
        left[test] = model.predict(X.iloc[test]) - y[test]
    return rms(left), float(np.mean(seconds))


def run(options):
    found = {}
    for seed in _SEEDS:
        log = cold_starts(seed)
        for target, models in (("rate", OF_RATE), ("error", OF_ERROR)):
            for name, make in models.items():
                left, seconds = residual(make, log, target)
                found.setdefault(name, []).append((left / rms(log["noise"]), seconds))
    lines = []
    for name, figures in found.items():
        ratios, seconds = zip(*figures, strict=True)
        lines.append([name, float(np.median(ratios)), max(ratios), float(np.mean(seconds))])
    ours = lines[0]
    work = f"simulated cold starts, 12 temperatures, one left out, {len(_SEEDS)} devices"
    measures = [
        Measure("median over the noise floor", ours[1], "", 1.3),
        Measure("worst", ours[2], "", 1.3),
    ]
    head = ["model", "over the noise floor, median", "worst", "CPU/fit [s]"]
    return Results([Row(work, measures)], [Table("Simulated cold starts", head, lines)])
