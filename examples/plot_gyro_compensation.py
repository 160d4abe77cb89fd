"""
Compensating a fiber-optic gyro
===============================

An open-loop fiber-optic gyro does not indicate the rate at which it turns. Its output is a sine of
the rate, whose scale changes with temperature, beside a bias that depends on temperature and on the
time since power-on. This example calibrates such a gyro: it learns the error from runs on a rate
table and takes it off the indicated rate in runs that it has not seen. It ends with the 19 rows of
the paper that first used an ANFIS for this task, and with what they can prove.

Without options, this file runs from top to bottom on simulated data, as on this page. With options
it is a program, which does the same to a file of your own::

    python plot_gyro_compensation.py --csv my_gyro.csv --time seconds --temperature degC \\
        --rate counts --target table_rate --group run --output figures
"""

import argparse
import sys
import tempfile
import textwrap
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import joblib
import numpy as np
import pandas as pd
from sklearn.base import clone
from sklearn.dummy import DummyRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import LinearRegression
from sklearn.metrics import make_scorer
from sklearn.model_selection import GridSearchCV, GroupKFold, LeaveOneOut, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from threadpoolctl import threadpool_limits

from skanfis import ANFISRegressor
from skanfis.datasets import load_ofog, make_ofog
from skanfis.exceptions import UnderdeterminedWarning

SECONDS_PER_HOUR = 3600.0  # 1 °/s is 3600 °/h
PPM = 1e6

# %%
# A calibration campaign
# ----------------------
#
# A campaign is a table of measurements, taken in several *groups*: runs from power-on to power-off,
# each at another ambient temperature. The compensator may use the time since power-on, the
# temperature and the rate that the gyro indicates. It may not use the true rate: on a vehicle
# nobody knows it. The target is the error, indicated minus true rate.
#
# The rate table of this campaign turns at 401 levels. That matters. If it stopped at a dozen, the
# indicated rate would tell the level, and a flexible model would learn the list of levels by heart
# instead of the error of the gyro; it would then fail at every other rate.


@dataclass(frozen=True)
class Columns:
    """Names of the columns of a table, by the part that they play."""

    temperature: str
    rate: str  # as indicated, or raw counts
    target: str  # the true rate, in °/s
    time: str | None = None
    group: str | None = None

    @property
    def inputs(self):
        """What a compensator knows when it is at work."""
        return [name for name in (self.time, self.temperature, self.rate) if name is not None]


@dataclass(frozen=True)
class Campaign:
    """Measurements of one gyro, simulated or real."""

    inputs: pd.DataFrame
    true_rate: np.ndarray  # °/s
    error: np.ndarray  # indicated minus true rate, °/s
    scale_factor: float  # indicated rate = scale factor x column of the rate
    groups: np.ndarray
    columns: Columns
    units: dict = field(default_factory=dict)  # of the inputs, as far as they are known

    @property
    def full_scale(self):
        """Largest rate of the campaign, in °/s."""
        return np.abs(self.true_rate).max()

    def label(self, column):
        """An axis label."""
        return f"{column} [{self.units[column]}]" if column in self.units else column


SIMULATED = Columns("temperature", "output", "rate", time="time", group="run")
SIMULATED_UNITS = {"time": "s", "temperature": "°C", "output": "°/s"}


def simulate(n_devices=3, n_runs=12, sampling_interval=20.0):
    """Runs of several gyros of one type, as one table."""
    return make_ofog(
        n_devices=n_devices,
        n_runs=n_runs,
        sampling_interval=sampling_interval,
        n_rate_levels=401,
        random_state=0,
    )


def make_campaign(table, columns, groups, scale_factor=None, units=None):
    """A campaign from a table, with the indicated rate brought to °/s by the scale factor."""
    raw, true_rate = table[columns.rate].to_numpy(float), table[columns.target].to_numpy(float)
    if scale_factor is None:
        # Raw counts have no unit of rate: take the one factor that serves best.
        scale_factor = (raw @ true_rate) / (raw @ raw)
    error = scale_factor * raw - true_rate
    inputs = table[columns.inputs]
    return Campaign(inputs, true_rate, error, scale_factor, groups, columns, units or {})


def simulated_campaign(table, device):
    """The campaign of one of the simulated gyros."""
    table = table[table["device"] == device]
    groups = table[SIMULATED.group].to_numpy()
    return make_campaign(table, SIMULATED, groups, scale_factor=1.0, units=SIMULATED_UNITS)


def describe(campaign):
    """Print what was measured."""
    n_rows, n_groups = len(campaign.inputs), len(np.unique(campaign.groups))
    ranges = campaign.inputs.agg(["min", "max"])
    print(f"{n_rows} rows in {n_groups} groups, rates to ±{campaign.full_scale:.4g} °/s")
    for name in campaign.inputs:
        print(f"  {campaign.label(name)}: {ranges[name]['min']:.6g} to {ranges[name]['max']:.6g}")
    print(f"  indicated rate [°/s]: {campaign.scale_factor:.10g} x {campaign.columns.rate}")
    print(f"  error: {root_mean_square(campaign.error):.4g} °/s (RMS)")


def root_mean_square(values):
    """Root of the mean square."""
    return np.sqrt(np.mean(np.square(values)))


def say(text):
    """Print a paragraph."""
    print(textwrap.fill(text, 100))


# A program given options ends in `main`, below; without any, the steps are run one by one.
STEP_BY_STEP = __name__ == "__main__" and len(sys.argv) == 1

if STEP_BY_STEP:
    gyros = simulate()
    campaign = simulated_campaign(gyros, device=0)
    describe(campaign)

# %%
# Calibration
# -----------
#
# Every third group, in the order of their temperatures, is held out and takes no part in what
# follows; the coldest and the hottest stay, because a calibration has to reach the ends of the
# range. How many fuzzy sets each input gets is chosen by cross-validation on the rest, again by
# whole groups: a random split of rows would test on neighbours, seconds away, of what it had
# trained on.
#
# Outside the range of its data a calibration is a guess, and ``out_of_bounds="nan"`` makes the
# model say so. That happens all the time within the cross-validation, whenever the coldest or the
# hottest group is left out. The score then counts the rows that were answered, and the warnings are
# switched off: NaN has said it already.
#
# No scaler is needed for an ANFIS of this package, which standardises inside. It is part of the
# pipeline because the models to compare with need one.


def hold_out(campaign):
    """Rows of every third group in the order of temperature, the two outermost excepted."""
    temperature = campaign.inputs[campaign.columns.temperature].to_numpy()
    by_temperature = pd.Series(temperature).groupby(campaign.groups).mean().sort_values().index
    return np.isin(campaign.groups, by_temperature[1:-1:3])


def compensator():
    """A pipeline that learns the error; the names of the columns pass through its scaler."""
    anfis = ANFISRegressor(out_of_bounds="nan")
    return make_pipeline(StandardScaler(), anfis).set_output(transform="pandas")


def choices_of_terms(n_inputs, n_rows):
    """Numbers of fuzzy sets to try: equal for all inputs, or more for the rate, the last one."""
    others = n_inputs - 1
    choices = [2, 3, [2] * others + [3], [2] * others + [4], [2] * (others - 1) + [3, 4]]
    # Fewer than five rows per coefficient determine nothing.
    affordable = n_rows / 5 / (1 + n_inputs)
    return [choice for choice in choices if n_rules(choice, n_inputs) <= affordable] or choices[:1]


def n_rules(choice, n_inputs):
    """Rules of a full grid."""
    return int(np.prod(np.broadcast_to(choice, n_inputs)))


def residual_where_answered(error, correction):
    """RMS of what is left of the error over the rows that were answered; zero if none was."""
    return np.sqrt(np.nansum((error - correction) ** 2) / max(1, np.isfinite(correction).sum()))


def search_terms(campaign, rows):
    """Find the number of fuzzy sets by cross-validation over groups."""
    choices = choices_of_terms(campaign.inputs.shape[1], rows.sum())
    search = GridSearchCV(
        compensator(),
        {"anfisregressor__n_mfs": choices},
        scoring=make_scorer(residual_where_answered, greater_is_better=False),
        cv=GroupKFold(min(4, len(np.unique(campaign.groups[rows])))),
    )
    with warnings.catch_warnings():
        # A choice that does not settle is judged by its score like the others.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return search.fit(campaign.inputs[rows], campaign.error[rows], groups=campaign.groups[rows])


def describe_search(search):
    """Print what was tried."""
    print("Fuzzy sets per input, chosen by cross-validation over groups:")
    for choice, score in zip(
        search.cv_results_["param_anfisregressor__n_mfs"],
        search.cv_results_["mean_test_score"],
        strict=True,
    ):
        chosen = " <- chosen" if choice == search.best_params_["anfisregressor__n_mfs"] else ""
        rules = f"{n_rules(choice, search.n_features_in_)} rules"
        print(f"  {choice!s:<10} {rules:>9}   {-score * SECONDS_PER_HOUR:8.1f} °/h RMS{chosen}")


if STEP_BY_STEP:
    held_out = hold_out(campaign)
    search = search_terms(campaign, ~held_out)
    describe_search(search)

# %%
# What the compensation is worth
# ------------------------------
#
# The groups held out are the judge, and other models of the error are the measure: a straight line
# in every input, a cubic polynomial, and a Gaussian process, which is flexible but slow and so gets
# 400 of the rows. All learn the same error from the same groups. Rows outside the calibrated range,
# which the ANFIS refuses, are left out for all of them and counted.
#
# The residual is given in °/s, °/h, and ppm of full scale; *nonlinearity* is the scale factor's:
# the largest deviation of the compensated rate from its best straight line against the true rate,
# over all groups held out, so that what the temperature does to the scale factor counts, too.

N_ROWS_OF_GAUSSIAN_PROCESS = 400
UNCOMPENSATED, CHOSEN = "uncompensated", "ANFIS, terms chosen"


def models_to_compare(search):
    """Every model of the error by its name, not fitted."""
    return {
        "straight line": make_pipeline(StandardScaler(), LinearRegression()),
        "cubic polynomial": make_pipeline(
            StandardScaler(), PolynomialFeatures(3), LinearRegression()
        ),
        "Gaussian process": gaussian_process(search.n_features_in_),
        "ANFIS, as it comes": compensator(),
        CHOSEN: clone(search.best_estimator_),
    }


def gaussian_process(n_inputs):
    """A length scale per input, found by maximum likelihood."""
    kernel = ConstantKernel(10.0, (1e-2, 1e4)) * RBF(np.full(n_inputs, 3.0), (0.1, 100.0))
    kernel += WhiteKernel(1e-3, (1e-8, 1.0))
    return make_pipeline(StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True))


@dataclass(frozen=True)
class Study:
    """Models fitted to a part of a campaign, and what they say of the rest."""

    campaign: Campaign
    held_out: np.ndarray  # mask of rows
    search: GridSearchCV
    models: dict
    seconds: dict  # to fit each model
    residuals: dict  # of the rows held out, °/s; NaN where a model refused

    @property
    def judged(self):
        """Mask over the rows held out: where every model has answered."""
        return np.isfinite(list(self.residuals.values())).all(axis=0)


def compare(campaign, held_out, search):
    """Fit every model to the groups that are not held out, and judge it on those that are."""
    inputs, error = campaign.inputs[held_out], campaign.error[held_out]
    models = models_to_compare(search)
    seconds, residuals = {UNCOMPENSATED: 0.0}, {UNCOMPENSATED: error}
    for name, model in models.items():
        seconds[name] = fit(model, campaign, np.flatnonzero(~held_out))
        residuals[name] = error - model.predict(inputs)
    return Study(campaign, held_out, search, models, seconds, residuals)


def fit(model, campaign, rows):
    """Fit a model on one core, and return the seconds that it took."""
    if isinstance(model[-1], GaussianProcessRegressor):
        # Its cost grows with the cube of the number of rows.
        size = min(N_ROWS_OF_GAUSSIAN_PROCESS, rows.size)
        rows = np.random.default_rng(0).choice(rows, size, replace=False)
    start = time.perf_counter()
    # Threads of the linear algebra wait for one another wherever the cores have other work, too.
    with threadpool_limits(limits=1), warnings.catch_warnings():
        # The Gaussian process reports at length that its likelihood is flat near the maximum.
        warnings.filterwarnings("ignore", "lbfgs|The optimal value", ConvergenceWarning)
        model.fit(campaign.inputs.iloc[rows], campaign.error[rows])
    return time.perf_counter() - start


def table_of_merit(study):
    """Figures of merit on the rows held out, one row per model."""
    true_rate = study.campaign.true_rate[study.held_out][study.judged]
    rows = {
        name: merit(residual[study.judged], true_rate, study.campaign.full_scale)
        for name, residual in study.residuals.items()
    }
    table = pd.DataFrame.from_dict(rows, orient="index")
    table.insert(4, "reduction", table["RMS °/s"][UNCOMPENSATED] / table["RMS °/s"])
    return table.assign(**{"fit s": study.seconds})


def merit(residual, true_rate, full_scale):
    """Figures of merit of one model."""
    rms = root_mean_square(residual)
    return {
        "RMS °/s": rms,
        "RMS °/h": rms * SECONDS_PER_HOUR,
        "RMS ppm": rms / full_scale * PPM,
        "peak °/s": np.abs(residual).max(),
        "nonlinearity ppm": nonlinearity(true_rate + residual, true_rate) / full_scale * PPM,
    }


def nonlinearity(indicated_rate, true_rate):
    """Largest deviation from the best straight line, in °/s."""
    line = np.polynomial.Polynomial.fit(true_rate, indicated_rate, deg=1)
    return np.abs(indicated_rate - line(true_rate)).max()


def describe_study(study):
    """Print the table, and say who is best."""
    table = table_of_merit(study)
    decimals = {"RMS °/s": 5, "RMS °/h": 1, "RMS ppm": 1, "peak °/s": 4, "reduction": 1}
    formats = {name: f"{{:.{digits}f}}".format for name, digits in decimals.items()}
    formats |= {"nonlinearity ppm": "{:.0f}".format, "fit s": "{:.2f}".format}
    n_refused = np.count_nonzero(~study.judged)
    print(
        f"Residual error over the {study.held_out.sum()} rows held out, less {n_refused} outside "
        f"the calibrated range (full scale {study.campaign.full_scale:.4g} °/s):"
    )
    print(table.to_string(formatters=formats))
    say(f"The Gaussian process learnt from {N_ROWS_OF_GAUSSIAN_PROCESS} rows at most.")
    say(verdict(table["RMS °/h"]))


def verdict(residual):
    """One sentence on the order of the models."""
    better = residual.index[residual < residual[CHOSEN]]
    if better.empty:
        return f"{CHOSEN}, leaves the smallest residual."
    names = ", ".join(f"{name} ({residual[name]:.1f} °/h)" for name in better)
    return f"Better than {CHOSEN} ({residual[CHOSEN]:.1f} °/h): {names}."


if STEP_BY_STEP:
    study = compare(campaign, held_out, search)
    describe_study(study)

# %%
# In pictures
# -----------
#
# The residuals side by side:

# Told apart by those who do not see red or green; markers and styles of lines differ as well.
BEFORE, AFTER, TRUTH, DATA = "#D55E00", "#0072B2", "black", "0.82"


def plot_comparison(study):
    """The residual of every model, RMS and peak."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter

    table = table_of_merit(study).sort_values("RMS °/s", ascending=False)
    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    axes.hlines(table.index, table["RMS °/s"], table["peak °/s"], color=DATA, linewidth=2, zorder=1)
    axes.plot(table["RMS °/s"], table.index, "o", color=AFTER, markersize=9, label="RMS")
    axes.plot(table["peak °/s"], table.index, "|", color=BEFORE, markersize=14, mew=2, label="peak")
    for name, row in table.iterrows():
        digits = 1 if row["RMS °/h"] < 100 else 0
        axes.annotate(
            f"{row['RMS °/h']:,.{digits}f} °/h",
            (row["RMS °/s"], name),
            (0, 8),
            textcoords="offset points",
            ha="center",
            fontsize=9,
        )
    axes.set(xscale="log", xlabel="residual error in the groups held out [°/s]")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.08, y=0.15)
    axes.grid(axis="x", color="0.92")
    axes.set_axisbelow(True)
    figure.legend(loc="outside upper right", ncols=2)
    return figure


if STEP_BY_STEP:
    plot_comparison(study)

# %%
# The output of the gyro over one of the runs held out, with a closer look at the place of the
# largest error, where single dwells of the rate table can be seen. This is figure 2 of the paper,
# on data that the model has not seen.


def plot_output(study):
    """Output over one group held out, uncompensated and compensated."""
    import matplotlib.pyplot as plt

    run = output_of_group(study)
    error = run["uncompensated"] - run["true"]
    worst = np.abs(error).where(run["compensated"].notna()).argmax()
    closer = run.iloc[max(0, worst - 6) : worst + 7]
    figure, panels = plt.subplots(1, 2, figsize=(10, 4), width_ratios=(3, 2), layout="constrained")
    draw_output(panels[0], run, markersize=3)
    draw_output(panels[1], closer, markersize=6)
    panels[0].set(ylabel="rate [°/s]", title="Whole group")
    center, reach = run["true"].iloc[worst] + error.iloc[worst] / 2, np.abs(error).iloc[worst]
    panels[1].set(ylim=(center - reach, center + reach), title="Closer, at the largest error")
    for axes in panels:
        axes.set_xlabel(run.index.name)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def output_of_group(study):
    """True, uncompensated and compensated rate of a group held out; time, if known, as index."""
    campaign, residual = study.campaign, study.residuals[CHOSEN]
    groups = campaign.groups[study.held_out]
    rows = groups == groups[study.judged][0]
    true_rate = campaign.true_rate[study.held_out][rows]
    time_column = campaign.columns.time
    index = pd.RangeIndex(rows.sum(), name="row of the group")
    if time_column is not None:
        times = campaign.inputs[time_column][study.held_out][rows]
        index = pd.Index(times, name=campaign.label(time_column))
    columns = {
        "true": true_rate,
        "uncompensated": true_rate + study.residuals[UNCOMPENSATED][rows],
        "compensated": true_rate + residual[rows],
    }
    return pd.DataFrame({name: np.asarray(rate) for name, rate in columns.items()}, index=index)


def draw_output(axes, run, markersize):
    """The three rates of a group."""
    axes.plot(run["true"], color=TRUTH, drawstyle="steps-mid", linewidth=1, label="true")
    for name, color, marker in (("uncompensated", BEFORE, "x"), ("compensated", AFTER, "o")):
        axes.plot(run[name], marker, color=color, markersize=markersize, mfc="none", label=name)


if STEP_BY_STEP:
    plot_output(study)

# %%
# The error of all runs held out, before and after the compensation. Mind the scales.


def plot_errors(study):
    """Error before and after, against every input."""
    import matplotlib.pyplot as plt

    inputs = study.campaign.inputs[study.held_out]
    kinds = {"before": (UNCOMPENSATED, BEFORE), "after": (CHOSEN, AFTER)}
    figure, panels = plt.subplots(
        2, inputs.shape[1], figsize=(10, 5), sharex="col", sharey="row", layout="constrained"
    )
    for row, (kind, (name, color)) in zip(panels, kinds.items(), strict=True):
        row[0].set_ylabel(f"error {kind} [°/s]")
        for axes, column in zip(row, inputs, strict=True):
            axes.plot(inputs[column], study.residuals[name], ".", color=color, markersize=3)
            axes.axhline(0.0, color=TRUTH, linewidth=0.8)
    for axes, column in zip(panels[1], inputs, strict=True):
        axes.set_xlabel(study.campaign.label(column))
    return figure


if STEP_BY_STEP:
    plot_errors(study)

# %%
# What training has made of the fuzzy sets: figure 1 of the paper, over the data. The pipeline's
# model knows standardised inputs only, so that its fuzzy sets are brought back to your units. As in
# the paper, training widens and flattens most of them.
#
# What counts is how the memberships of one input compare: a set may be small everywhere and still
# describe the minutes after power-on, if it is less small there.


def plot_memberships(study):
    """Membership functions before and after training, over the data that they were trained on."""
    import matplotlib.pyplot as plt

    inputs = study.campaign.inputs[~study.held_out]
    figure, panels = plt.subplots(
        1, inputs.shape[1], figsize=(10, 3.4), sharey=True, layout="constrained"
    )
    for axes, name in zip(panels, inputs, strict=True):
        draw_histogram(axes, inputs[name])
        draw_memberships(axes, study.models[CHOSEN], inputs[name])
        axes.set(xlabel=study.campaign.label(name), ylim=(0, 1.05))
    panels[0].set_ylabel("membership")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def draw_histogram(axes, values):
    """A histogram, low enough to leave the curves alone."""
    counts, edges = np.histogram(values, bins=30)
    heights = 0.3 * counts / counts.max()
    axes.stairs(heights, edges, fill=True, color=DATA, label="data (not to scale)")


def draw_memberships(axes, pipeline, values):
    """The membership functions of one input, dashed before and solid after training."""
    grid = np.linspace(values.min(), values.max(), 400)
    for trained, style, color in ((False, "--", BEFORE), (True, "-", AFTER)):
        terms = memberships_in_units(pipeline, values.name, trained)
        curves = [np.exp(-0.5 * ((grid - center) / width) ** 2) for center, width in terms]
        label = "after training" if trained else "before"
        lines = axes.plot(grid, np.transpose(curves), style, color=color)
        lines[0].set_label(label)


def memberships_in_units(pipeline, name, trained):
    """Center and width of the Gaussian terms of one input, in the units of the data."""
    scaler, anfis = pipeline
    place = list(scaler.feature_names_in_).index(name)
    offset, scale = scaler.mean_[place], scaler.scale_[place]
    return [
        (offset + scale * term["center"], scale * term["width"])
        for term in anfis.model_.memberships(trained)
        if term["input"] == name
    ]


if STEP_BY_STEP:
    plot_memberships(study)

# %%
# Other gyros of the same type
# ----------------------------
#
# One gyro is an anecdote: which of two good models comes first changes from gyro to gyro, and with
# the runs that are held out. Here the same is done to two others, each calibrated by itself.
#
# The last line applies the compensation of the first gyro to the others. Much of the error is
# common to all gyros of a type, such as the sine, but the coefficients differ from unit to unit:
# calibrate every unit.


def describe_other_gyros(table, first):
    """Print the residuals of all gyros, and those that the model of the first gyro leaves."""
    columns = {"device 0": table_of_merit(first)["RMS °/h"]}
    for device in sorted(set(table["device"]) - {0}):
        study = judge(simulated_campaign(table, device))
        borrowed = pd.Series({"ANFIS of device 0": residual_of_other(first, study)})
        own = table_of_merit(study)["RMS °/h"]
        columns[f"device {device}"] = pd.concat([own, borrowed])
    print("Residual error of several gyros, RMS in °/h:")
    # One column per gyro; the first has no other's model to be tried with.
    print(pd.concat(columns, axis=1, sort=False).round(1).to_string(na_rep=""))


def judge(campaign):
    """Choose the number of fuzzy sets, and compare."""
    held_out = hold_out(campaign)
    return compare(campaign, held_out, search_terms(campaign, ~held_out))


def residual_of_other(first, study):
    """Residual in °/h where the model of another gyro compensates."""
    campaign, rows = study.campaign, study.held_out
    residual = campaign.error[rows] - first.models[CHOSEN].predict(campaign.inputs[rows])
    inside = study.judged & np.isfinite(residual)
    return SECONDS_PER_HOUR * root_mean_square(residual[inside])


if STEP_BY_STEP:
    describe_other_gyros(gyros, study)

# %%
# The model in a file
# -------------------
#
# A fitted pipeline is saved by joblib; what comes back from the file predicts the same to the last
# bit.


def save_model(study, path):
    """Save the model, load it again, print whether the two agree, and how to use the file."""
    model, campaign = study.models[CHOSEN], study.campaign
    joblib.dump(model, path)
    answers = [each.predict(campaign.inputs).tobytes() for each in (model, joblib.load(path))]
    agreement = "equal to the last bit" if answers[0] == answers[1] else "NOT EQUAL"
    print(f"Model: {path} ({path.stat().st_size / 1000:.1f} kB)")
    print(f"  predictions after loading: {agreement}")
    print(f"  use: rate = {campaign.scale_factor:.10g} * table[{campaign.columns.rate!r}] -")
    print(f"              joblib.load({path.name!r}).predict(table[{campaign.columns.inputs}])")


if STEP_BY_STEP:
    with tempfile.TemporaryDirectory() as folder:
        save_model(study, Path(folder) / "compensator.joblib")

# %%
# The table of the paper
# ----------------------
#
# The paper trains six fuzzy sets on the temperature and six on the rate, 36 rules with 3 consequent
# coefficients each, on 19 rows that lie within 1 °C. A fit to these rows is no evidence: nothing is
# left to test it on. Leaving out one row at a time shows what the model knows of a row that it has
# not seen.


def describe_paper():
    """Print fit and leave-one-out error on Table 1 of the paper."""
    table = load_ofog()
    inputs, output = table.data[["temperature", "rate"]], table.target
    print("Table 1 of the paper, RMS in °/s:  training  leave-one-out")
    for name, model in models_of_paper().items():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            trained = model.fit(inputs, output).predict(inputs)
            left_out = cross_val_predict(model, inputs, output, cv=LeaveOneOut())
        errors = [root_mean_square(output - predicted) for predicted in (trained, left_out)]
        print(f"  {name:<30}   {errors[0]:8.1e}  {errors[1]:13.4f}")
    # The first warning of the last model: from the fit to all rows.
    say(messages(caught, UnderdeterminedWarning)[0])


def models_of_paper():
    """The model of the paper, after two that anyone would try first."""
    return {
        "mean": DummyRegressor(),
        "straight line": LinearRegression(),
        "ANFIS, 6 x 6 rules": ANFISRegressor(n_mfs=[6, 6]),
    }


def messages(caught, category):
    """Texts of the warnings of one category."""
    return [f"{category.__name__}: {w.message}" for w in caught if w.category is category]


if STEP_BY_STEP:
    describe_paper()

# %%
# Your own gyro
# -------------
#
# The same steps on a CSV file. If you do not name a column of groups, the rows are cut into
# contiguous blocks. That is second best: the blocks of one run know much of each other, so that the
# residual comes out smaller than it will be in the next run. Number your runs. If your rate table
# turned at a few levels only, number the levels instead: the program warns you.

N_BLOCKS = 12
FEWEST_ROWS, FEWEST_GROUPS = 200, 4
MOST_LEVELS = 100
PLOTS = {
    "comparison": plot_comparison,
    "output": plot_output,
    "errors": plot_errors,
    "memberships": plot_memberships,
}


class InputError(Exception):
    """The user's options or file cannot be used; the message says why."""


def read_campaign(arguments):
    """The campaign in the user's file."""
    columns = Columns(
        arguments.temperature, arguments.rate, arguments.target, arguments.time, arguments.group
    )
    table = read_table(arguments.csv)
    check_columns(table, columns)
    check_values(table, columns)
    groups = groups_of(table, columns)
    campaign = make_campaign(table, columns, groups, arguments.scale_factor)
    warn_of_levels(campaign)
    return campaign


def read_table(path):
    """The file as a table."""
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:  # pandas' own errors are ValueErrors
        reason = getattr(error, "strerror", None) or str(error).strip().splitlines()[0]
        raise InputError(f"{path} cannot be read as a CSV file: {reason}") from error


def check_columns(table, columns):
    """Raise InputError unless all columns are there, each with one part to play."""
    named = [*columns.inputs, columns.target, *([columns.group] if columns.group else [])]
    missing = [name for name in named if name not in table]
    if missing:
        raise InputError(f"No column {listed(missing)}; the file has {listed(table.columns)}.")
    twice = sorted({name for name in named if named.count(name) > 1})
    if twice:
        raise InputError(f"Column {listed(twice)} was named for more than one purpose.")


def listed(names):
    """Names in quotation marks."""
    return ", ".join(repr(str(name)) for name in names)


def check_values(table, columns):
    """Raise InputError unless the numbers are numbers, finite, not constant, and enough."""
    if len(table) < FEWEST_ROWS:
        raise InputError(f"{len(table)} rows are too few; at least {FEWEST_ROWS} are needed.")
    for name in [*columns.inputs, columns.target]:
        if not pd.api.types.is_numeric_dtype(table[name]):
            raise InputError(f"Column {name!r} has entries that are not numbers.")
        bad = ~np.isfinite(table[name].to_numpy(float))
        if bad.any():
            # The first line of the file holds the names.
            where = f"the first in line {bad.argmax() + 2}"
            raise InputError(
                f"Column {name!r} has {bad.sum()} missing or infinite values, {where}."
            )
        if table[name].nunique() == 1:
            raise InputError(f"Column {name!r} never changes: nothing can be learnt from it.")


def groups_of(table, columns):
    """The groups that the user named, else contiguous blocks of rows."""
    if columns.group is None:
        say(
            f"No --group: {N_BLOCKS} contiguous blocks of rows serve as groups. They know much of "
            "each other, so that the residual below flatters; separate runs would not."
        )
        return np.arange(len(table)) * N_BLOCKS // len(table)
    if table[columns.group].isna().any():
        raise InputError(f"Column {columns.group!r} has missing values.")
    groups = pd.factorize(table[columns.group])[0]
    if groups.max() + 1 < FEWEST_GROUPS:
        raise InputError(
            f"Column {columns.group!r} has {groups.max() + 1} groups; at least {FEWEST_GROUPS} are "
            "needed to hold some out."
        )
    return groups


def warn_of_levels(campaign):
    """Print a warning where several groups share a few levels of the true rate."""
    levels = np.round(campaign.true_rate / campaign.full_scale, 3)
    groups_per_level = pd.Series(campaign.groups).groupby(levels).nunique()
    if len(groups_per_level) <= MOST_LEVELS and groups_per_level.max() > 1:
        say(
            f"Take care: {campaign.columns.target!r} has only {len(groups_per_level)} levels, "
            "which several groups share. A flexible model may learn the levels by heart, look good "
            "below, and fail between them. Try again with a column that numbers the levels as "
            "--group."
        )


def read_arguments(argv):
    """Options of the command line."""
    parser = argparse.ArgumentParser(description="Calibrate a gyro: simulated, or from a CSV file.")
    parser.add_argument("--output", default="figures", type=Path, help="folder for what is made")
    parser.add_argument("--csv", metavar="FILE", help="measurements of one gyro, in order of time")
    parser.add_argument("--temperature", metavar="COL", help="column of the temperature")
    parser.add_argument("--rate", metavar="COL", help="column of the indicated rate or raw output")
    parser.add_argument("--target", metavar="COL", help="column of the true rate in °/s")
    parser.add_argument("--time", metavar="COL", help="column of the time since power-on")
    parser.add_argument(
        "--group", metavar="COL", help="column that tells runs or rate levels apart"
    )
    parser.add_argument(
        "--scale-factor",
        metavar="NUMBER",
        type=float,
        help="°/s per unit of the column --rate; by default the factor that serves best",
    )
    return parser.parse_args(argv)


def check_arguments(arguments):
    """Raise InputError where options are missing or do nothing."""
    needed, optional = ("temperature", "rate", "target"), ("time", "group", "scale_factor")
    given = [name for name in (*needed, *optional) if getattr(arguments, name) is not None]
    if arguments.csv is None and given:
        raise InputError(f"{flags(given)} tells of a file: give it by --csv.")
    missing = [name for name in needed if name not in given]
    if arguments.csv is not None and missing:
        raise InputError(f"--csv needs {flags(missing)} too.")


def flags(names):
    """Options as they are written on the command line."""
    return ", ".join("--" + name.replace("_", "-") for name in names)


def prepare_output(folder):
    """Make the folder, and let matplotlib draw into files only."""
    try:
        import matplotlib
    except ImportError as error:
        raise InputError("The pictures need matplotlib: pip install matplotlib.") from error
    matplotlib.use("Agg")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"The folder {folder} cannot be made: {error.strerror}.") from error


def save_plots(study, folder):
    """Save all pictures."""
    for name, plot in PLOTS.items():
        path = folder / f"gyro_{name}.png"
        plot(study).savefig(path, dpi=150)
        print(f"Picture: {path}")


def calibrate(campaign):
    """Judge all models, and print what comes of it."""
    describe(campaign)
    study = judge(campaign)
    describe_search(study.search)
    if not study.judged.any():
        raise InputError(
            "All groups held out lie outside the range of the others: nothing to judge."
        )
    describe_study(study)
    return study


def run(arguments):
    """Run all steps, on the user's file or on the simulation."""
    check_arguments(arguments)
    simulated = arguments.csv is None
    campaign = simulated_campaign(simulate(), 0) if simulated else read_campaign(arguments)
    prepare_output(arguments.output)
    study = calibrate(campaign)
    if simulated:
        describe_other_gyros(simulate(), study)
        describe_paper()
    save_model(study, arguments.output.resolve() / "compensator.joblib")
    save_plots(study, arguments.output.resolve())


def main(argv=None):
    """Be a program; 0 for success, 2 where options or file cannot be used."""
    try:
        run(read_arguments(argv))
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    return 0


def show():
    """Open the pictures in windows."""
    import matplotlib.pyplot as plt

    plt.show()


if STEP_BY_STEP:
    show()
elif __name__ == "__main__":
    sys.exit(main())
