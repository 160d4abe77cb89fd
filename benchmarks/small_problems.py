"""Problems that the defaults have failed on, or must not lose.

They are: tables in which inputs repeat, against the same with the inputs moved by next to nothing;
Friedman's first function; a function that saturates, with rows outside; simulated cold starts, one
left out; a run after three; the gyro-like surface; few rows of many inputs. All were chosen before
anything was fitted, and never changed.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from sklearn.datasets import make_friedman1
from sklearn.linear_model import BayesianRidge
from sklearn.model_selection import LeaveOneGroupOut

from skanfis.datasets import make_ofog

from . import gyro
from .cases import evaluate, fitted
from .compensation import cold_starts, polynomial
from .report import Measure, Results, Row
from .scores import median, rms, rms_error

__all__ = ["run"]

_N_TEST = 2000
_JITTER = 1e-9
_AT_REST = ("time", "temperature")
_RUNS = ("time", "temperature", "output")
_TURNING = ("output", "temperature", "time", "thermal_rate")


@dataclass(frozen=True)
class Problem:
    kind: str
    seed: int

    def __str__(self):
        return f"{self.kind}, seed {self.seed}"


# Tables in which each input comes many times ----------------------------------------------------


def levels_21(seed, options):
    """21 levels, 100 noisy rows of each."""
    x = np.repeat(np.linspace(-1, 1, 21), 100)[:, np.newaxis]
    fresh = np.linspace(-1, 1, 1001)[:, np.newaxis]
    return replicated(x, fresh, lambda X: np.sin(4 * X[:, 0]) + X[:, 0], seed, options)


def levels_7_9(seed, options):
    """A table of 7 by 9 levels, 50 noisy rows of each."""
    table = np.stack(np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 9)), axis=-1)
    X = np.repeat(table.reshape(-1, 2), 50, axis=0)
    fresh = np.random.default_rng(1).uniform(-1, 1, (_N_TEST, 2))
    return replicated(X, fresh, lambda X: np.sin(3 * X[:, 0]) * X[:, 1], seed, options)


def replicated(X, fresh, truth, seed, options):
    """RMSE to the truth, and that over what it is without exact repeats."""
    rng = np.random.default_rng(seed)
    y = truth(X) + 0.3 * rng.standard_normal(len(X))
    found = []
    for rows in (X, X + _JITTER * rng.standard_normal(X.shape)):
        model, seconds = fitted(rows, y, options)
        found.append((rms_error(model, fresh, truth(fresh)), seconds))
    (error, seconds), (without, _) = found
    return {"ratio": error / without, "error": error, "seconds": seconds}


# Friedman's first function ----------------------------------------------------------------------


def friedman(seed, n_rows, n_inputs, options):
    """Error on fresh rows with noise, of deviation one."""
    X, y = make_friedman1(n_rows, n_inputs, noise=1.0, random_state=seed)
    fresh, truth = make_friedman1(_N_TEST, n_inputs, noise=0.0, random_state=1000 + seed)
    model, seconds = fitted(X, y, options)
    return {"ratio": np.hypot(rms_error(model, fresh, truth), 1.0), "seconds": seconds}


# Rows outside the training data -----------------------------------------------------------------


def by_policy(model, X):
    """Predictions by the policy for rows outside; the default's are called "ratio"."""
    yield "ratio", model.predict(X)
    for policy in ("clip", "linear"):
        yield policy, model.set_params(out_of_bounds=policy).predict(X)


def saturating(seed, options):
    """Trained where it has nearly come to rest, tested up to three times as far.

    RMS error on the rows outside, in deviations of the target.
    """
    rng = np.random.default_rng(seed)
    X, fresh = rng.uniform(-1, 1, (500, 2)), rng.uniform(-3, 3, (_N_TEST, 2))

    def truth(X):
        return np.tanh(2.5 * X[:, 0]) + 0.5 * np.tanh(2.5 * X[:, 1] + 1.0)

    y = truth(X) + 0.05 * rng.standard_normal(len(X))
    model, seconds = fitted(X, y, options)
    beyond = (np.abs(fresh) > 1).any(axis=1)
    found = {
        policy: rms(prediction - truth(fresh[beyond])) / y.std()
        for policy, prediction in by_policy(model, fresh[beyond])
    }
    return {**found, "seconds": seconds}


# Cold starts, one left out ----------------------------------------------------------------------


def at_rest(seed):
    return make_ofog(n_devices=1, n_runs=12, max_residual_heat=0.0, rates=[0.0], random_state=seed)


def left_out(seed, make_log, inputs, grouped, options):
    """RMS of the error in the run left out, over the noise floor; by policy for rows outside."""
    log = make_log(seed)
    X, y, run = log[list(inputs)].to_numpy(), log["error"].to_numpy(), log["run"].to_numpy()
    left, times = {policy: np.empty(len(y)) for policy in ("ratio", "clip", "linear")}, []
    for train, test in LeaveOneGroupOut().split(X, y, run):
        groups = run[train] if grouped else None
        model, seconds = fitted(X[train], y[train], options, groups)
        times.append(seconds)
        for policy, prediction in by_policy(model, X[test]):
            left[policy][test] = prediction - y[test]
    found = {policy: rms(errors) / rms(log["noise"]) for policy, errors in left.items()}
    return {**found, "seconds": float(np.median(times))}


# Three runs of a gyro, and a fourth ---------------------------------------------------------------


def fourth_run(seed, grouped, options):
    """RMS of the error in a run after three, over a cubic polynomial's."""
    log = make_ofog(n_devices=1, n_runs=4, random_state=seed)
    X, y, run = log[list(_RUNS)].to_numpy(), log["error"].to_numpy(), log["run"].to_numpy()
    train, test = run < run.max(), run == run.max()
    model, seconds = fitted(X[train], y[train], options, run[train] if grouped else None)
    cubic = polynomial(3).fit(X[train], y[train])
    error, other = (rms_error(one, X[test], y[test]) for one in (model, cubic))
    return {
        "ratio": error / other,
        "error": error,
        "on the three": rms_error(model, X[train], y[train]),
        "seconds": seconds,
    }


# The gyro-like surface --------------------------------------------------------------------------


def surface(seed, options, with_product=False):
    """In the box and on all rows, in deviations of the noise; 1 is perfect.

    ``with_product``: temperature times rate is a column too.
    """
    X, y, fresh, truth = gyro.make_surface(seed)
    if with_product:
        X, fresh = (np.column_stack([Z, Z[:, 1] * Z[:, 2]]) for Z in (X, fresh))
    model, seconds = fitted(X, y, options)
    inside, everywhere = gyro.score(model, X, fresh, truth)
    return {"ratio": inside, "all rows": everywhere, "seconds": seconds}


# Many inputs ------------------------------------------------------------------------------------


def wide(seed, n_rows, options, n_inputs=200):
    """Four inputs matter; error on fresh rows with noise, over such a target's deviation."""
    rng = np.random.default_rng(seed)
    X, fresh = rng.standard_normal((n_rows, n_inputs)), rng.standard_normal((_N_TEST, n_inputs))
    noise = 0.3

    def truth(X):
        return np.sin(2 * X[:, 7]) + X[:, 50] * np.tanh(X[:, 120]) + 0.5 * X[:, 190]

    y = truth(X) + noise * rng.standard_normal(n_rows)
    model, seconds = fitted(X, y, options)
    error = np.hypot(rms_error(model, fresh, truth(fresh)), noise)
    return {"ratio": float(error / np.hypot(truth(fresh).std(), noise)), "seconds": seconds}


def few_rows(seed, n_rows, n_inputs, n_active, options):
    """A linear truth, half noise, or noise alone: error over that of Bayesian ridge regression."""
    rng = np.random.default_rng(seed)
    X, fresh = rng.standard_normal((n_rows, n_inputs)), rng.standard_normal((_N_TEST, n_inputs))
    noise = np.sqrt(max(n_active, 1))
    y = X[:, :n_active].sum(axis=1) + noise * rng.standard_normal(n_rows)
    model, seconds = fitted(X, y, options)
    errors = [
        np.hypot(rms_error(one, fresh, fresh[:, :n_active].sum(axis=1)), noise)
        for one in (model, BayesianRidge().fit(X, y))
    ]
    return {
        "ratio": float(errors[0] / errors[1]),
        "over the target's deviation": float(errors[0] / np.sqrt(noise**2 + n_active)),
        "seconds": seconds,
    }


# What is run ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """How it is measured, its seeds, what the figure is called, and the most it should be."""

    measure: object
    seeds: range
    figure: str
    bar: float | None = None
    aim: float | None = None
    summary: str = "median"  # or "worst", of the seeds
    further: tuple = ()  # names of figures that are told too


# Of further figures.
_BARS = {"seconds": 6.0}
_FLOOR = "over the noise floor"
_POLICIES = ("clip", "linear")
_COLD_STARTS = {
    f"cold starts {name}, one left out{', groups' if grouped else ''}": Kind(
        partial(left_out, make_log=make_log, inputs=inputs, grouped=grouped),
        seeds,
        _FLOOR,
        bar=5.0,
        aim=2.5,
        summary="worst",
        further=_POLICIES,
    )
    for name, make_log, inputs, seeds in (
        ("at rest", at_rest, _AT_REST, range(3)),
        ("turning", cold_starts, _TURNING, range(10, 12)),
    )
    for grouped in (False, True)
}
_REPLICATED = {
    name: Kind(
        measure,
        range(5),
        "RMSE to the truth over that without repeats",
        bar=1.05,
        summary="worst",
        further=("error",),
    )
    for name, measure in (("21 levels x 100", levels_21), ("7 x 9 levels x 50", levels_7_9))
}
_FEW_ROWS = {
    f"{n_rows} rows x {n_inputs} inputs, {n_active} of them linear": Kind(
        partial(few_rows, n_rows=n_rows, n_inputs=n_inputs, n_active=n_active),
        range(4),
        "error over Bayesian ridge regression's",
        bar=1.1,
        aim=1.02,
        further=("over the target's deviation",),
    )
    for n_rows, n_inputs in ((60, 20), (60, 50), (100, 200), (150, 200), (300, 200))
    for n_active in (0, 3)
}
_FOURTH_RUN = {
    f"three runs, a fourth{', groups' if grouped else ''}": Kind(
        partial(fourth_run, grouped=grouped),
        range(11, 31),
        "RMS in the fourth over a cubic's",
        further=("error", "on the three"),
    )
    for grouped in (False, True)
}
KINDS = {
    **_REPLICATED,
    **_FEW_ROWS,
    "Friedman 1, 100 x 5": Kind(
        partial(friedman, n_rows=100, n_inputs=5), range(10), "test RMSE", 1.5, 1.35
    ),
    "Friedman 1, 5,000 x 8": Kind(
        partial(friedman, n_rows=5000, n_inputs=8), range(3), "test RMSE", 1.02
    ),
    "gyro-like surface, 2,000 x 3": Kind(
        surface, range(10), "in the box [σ]", bar=1.05, further=("all rows",)
    ),
    "gyro-like surface, a product beside": Kind(
        partial(surface, with_product=True), range(10), "in the box [σ]"
    ),
    "saturating, rows outside": Kind(saturating, range(5), "RMS outside [sd]", further=_POLICIES),
    "200 inputs x 1,000 rows": Kind(
        partial(wide, n_rows=1000),
        range(2),
        "error over the target's deviation",
        further=("seconds",),
    ),
    **_FOURTH_RUN,
    **_COLD_STARTS,
}


def cases():
    return [Problem(kind, seed) for kind, of in KINDS.items() for seed in of.seeds]


def measure(problem, options):
    figures = KINDS[problem.kind].measure(seed=problem.seed, options=options)
    return {"case": str(problem), "kind": problem.kind, **figures}


def run(options):
    found, failed = evaluate("small_problems", measure, cases(), options)
    rows = [Row("small problems", [failed])]
    for name, kind in KINDS.items():
        some = [figures for figures in found if figures["kind"] == name]
        if some:
            rows.append(row(name, kind, some))
    return Results(rows)


def row(name, kind, some):
    summary = {"median": np.median, "worst": np.max}[kind.summary]

    def measured(key, label, *limits):
        value = float(summary([figures[key] for figures in some]))
        return Measure(f"{label}, {kind.summary}", value, "", *limits)

    measures = [measured("ratio", kind.figure, kind.bar, kind.aim)]
    measures += [measured(key, key, _BARS.get(key)) for key in kind.further]
    measures.append(Measure("median fit, CPU", median(some, "seconds"), "s"))
    return Row(f"{name}; {len(some)} seeds", measures)
