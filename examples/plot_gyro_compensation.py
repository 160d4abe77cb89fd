"""
Compensating a fiber-optic gyro
===============================

An open-loop fiber-optic gyro does not indicate the rate at which it turns. Its output is a sine of
the rate, whose scale changes with temperature, beside a bias that depends on temperature and on the
time since power-on. This example learns the error from runs on a rate table, takes it off in runs
that the model has not seen, and asks whether anything simpler would have done.

For a log of your own there is a command, which asks for no Python: :doc:`/gyro_command`. What other
gyros of the type and a published table of 19 rows have to say: :doc:`plot_gyro_limits`.
"""

import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.inspection import MembershipDisplay, export_text

# %%
# A calibration campaign
# ----------------------
#
# Twelve runs from power-on to power-off, each at another temperature of the chamber. The model may
# use what is known on board: time since power-on, temperature, and the rate that the gyro
# indicates. The true rate is never an input: on a vehicle nobody knows it. What is learnt is the
# error, indicated minus true rate.

rates = np.linspace(-100.0, 100.0, 401)
log = make_ofog(n_devices=1, n_runs=12, sampling_interval=20.0, rates=rates, random_state=0)
X = log[["time", "temperature", "output"]]
error = log["output"] - log["rate"]
run = log["run"]

# %%
# Every third run, in the order of their temperatures, is held out and takes no part in what
# follows. The coldest and the hottest stay: a calibration has to reach the ends of the range. Rows
# are not held out one by one: those of one run are alike, and the neighbours, seconds away, of a
# row held out would be among those trained on.

by_temperature = log.groupby("run")["temperature"].mean().sort_values().index
new = run.isin(by_temperature[1:-1:3])

# %%
# Calibration
# -----------
#
# As it comes, the regressor finds out which inputs need terms, and how many. ``groups`` tells it
# that the rows come in runs, so that it compares structures on whole runs that are left out. A
# sensor computes and does not read: ``simplicity=0`` gives up no error for fewer rules. Who would
# rather fix the terms gives their numbers, which takes a tenth of a second: a second model is there
# to be read, with rules that have to agree.

anfis = ANFISRegressor(simplicity=0).fit(X[~new], error[~new], groups=run[~new])
readable = ANFISRegressor(n_mfs=[1, 2, 5], agreement=1e-3).fit(X[~new], error[~new])
(chosen,) = [one for one in anfis.structures_ if one["chosen"]]
print(f"{chosen['structure']}; to be read: {readable.n_rules_} rules")

# %%
# What it is worth
# ----------------
#
# The runs held out are the judge, and other models of the error are the measure: a straight line in
# every input, a cubic polynomial, and a Gaussian process, which is flexible but slow, and so gets
# 400 of the rows. Rows beyond the calibrated range would be flagged on board: they are counted, and
# left out for all models alike.

kernel = ConstantKernel(10.0) * RBF(np.full(3, 3.0), (0.1, 100.0)) + WhiteKernel(1e-3, (1e-8, 1.0))
few = log[~new].sample(400, random_state=0).index
others = {
    "straight line": (LinearRegression(), X[~new].index),
    "cubic polynomial": (make_pipeline(PolynomialFeatures(3), LinearRegression()), X[~new].index),
    "Gaussian process": (GaussianProcessRegressor(kernel, normalize_y=True), few),
}
with warnings.catch_warnings():
    # The Gaussian process says at length that its likelihood is flat near the maximum.
    warnings.simplefilter("ignore", ConvergenceWarning)
    models = {
        name: make_pipeline(StandardScaler(), model).fit(X.loc[rows], error[rows])
        for name, (model, rows) in others.items()
    }
models |= {"ANFIS, to be read": readable, "ANFIS": anfis}

# %%
# Rules that a process teaches
# ----------------------------
#
# A Gaussian process knows what is smooth, but keeps every row that it has learnt from: too much for
# a sensor. Rules can learn from it as from a table, with as many rows as one likes and no noise.
# They go to the sensor's processor as any others do: :doc:`plot_c_export`. (What such rules say of
# their own noise is of the process, and not of the gyro.)

process, rng = models["Gaussian process"], np.random.default_rng(0)
drawn = pd.DataFrame(rng.uniform(X[~new].min(), X[~new].max(), (2000, 3)), columns=X.columns)
rows = pd.concat([X[~new], drawn])
taught = ANFISRegressor(simplicity=0).fit(rows, process.predict(rows))
models["ANFIS, taught by the process"] = taught

# %%
# Now all of them, in the runs held out.

known = new & anfis.in_bounds(X)
print(f"{known.sum()} rows held out, less {(new & ~known).sum()} beyond the calibrated range")
left = {"uncompensated": error[known]}
left |= {name: error[known] - model.predict(X[known]) for name, model in models.items()}

rms = {name: np.sqrt(np.mean(values**2)) for name, values in left.items()}
for name, value in rms.items():
    print(f"{name:28} {3600 * value:7.1f} °/h RMS   {np.abs(left[name]).max():7.4f} °/s at most")

# %%
# In pictures
# -----------
#
# What training has made of the terms of the model to be read, dashed before and solid after, over
# the histogram of the data; and what every model leaves of the error. Mind the scale.

figure = plt.figure(figsize=(10, 8), layout="constrained")
upper, lower = figure.subfigures(2, 1, height_ratios=(4, 5))
units = {"time": "s", "temperature": "°C", "output": "°/s"}
with_terms = {term["input"] for term in readable.memberships_}
panels = upper.subplots(1, len(with_terms), sharey=True)
MembershipDisplay.from_estimator(readable, X[~new], ax=panels)
note = "terms of the rules to be read; dashed: before training; grey: data"
upper.supxlabel(note, fontsize="small", color="0.4")
for panel in panels:
    panel.set_xlabel(f"{panel.get_xlabel()} [{units[panel.get_xlabel()]}]")
    panel.label_outer()

axes = lower.subplots()
names = sorted(rms, key=rms.get, reverse=True)
peaks = [np.abs(left[name]).max() for name in names]
axes.hlines(names, [rms[name] for name in names], peaks, color="0.82", linewidth=2, zorder=1)
axes.plot([rms[name] for name in names], names, "o", color="#0072B2", markersize=9, label="RMS")
axes.plot(peaks, names, "|", color="#D55E00", markersize=14, markeredgewidth=2, label="peak")
for name in names:
    axes.annotate(
        f"{3600 * rms[name]:,.0f} °/h",
        (rms[name], name),
        (0, 8),
        textcoords="offset points",
        ha="center",
    )
axes.set(xscale="log", xlabel="residual error in the runs held out [°/s]")
axes.margins(x=0.08, y=0.15)
axes.grid(axis="x", color="0.92")
axes.xaxis.set_major_formatter("{x:g}")
axes.legend(loc="upper right")

# %%
# The rules
# ---------
#
# How far is the strongest rule alone from what all say together? Rules that have to agree more come
# nearer, and leave more of the error. Here are the three of these that are the strongest on most
# rows. What may be believed of a rule: :doc:`/reading_rules`.

for name in ("ANFIS", "ANFIS, to be read"):
    apart = models[name].readability_.summary["strongest_alone"]
    print(f"{name:18}{3600 * rms[name]:4.0f} °/h; strongest rule alone {apart:.2f} deviations off")
print(export_text(readable, max_shown=3, output_names=["error"]))

# %%
# ``make demo`` gives this script a folder, for the picture; otherwise it is shown.

if len(sys.argv) == 2:
    path = Path(sys.argv[1]).resolve() / "gyro.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    print(f"Picture: {path}")
plt.show()
