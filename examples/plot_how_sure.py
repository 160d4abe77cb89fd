"""
How sure a prediction is
========================

A standard deviation that comes with the fit, intervals that are measured on rows held out, and why
runs have to be held out whole. :doc:`/how_sure` says what each of them promises, and what not.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

from skanfis import ANFISRegressor
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.intervals import ConformalRegressor

# %%
# A band around a curve
# ---------------------
#
# Rows are missing between 4 and 5.5, and noise grows to the right. The deviation widens where there
# are no rows, and grows beyond the range of the data, where the prediction follows its tangent. It
# takes the noise for the same everywhere: on the left, and at 8, the band is not what the rows
# show. The interval is the band made as wide as rows held out ask for: nine in ten of *all* rows
# are in it.

rng = np.random.default_rng(3)


def curve(x):
    return np.sin(1.2 * x) + 0.1 * x


x = rng.uniform(0.0, 9.0, size=260)
x = x[(x < 4.0) | (x > 5.5)]
y = curve(x) + (0.08 + 0.03 * x) * rng.standard_normal(x.size)
rules = ANFISRegressor(n_mfs=6)

model = rules.fit(x[:, None], y)
sure = ConformalRegressor(rules).fit(x[:, None], y)
line = np.linspace(-1.5, 10.5, 481)
with warnings.catch_warnings(action="ignore", category=OutOfBoundsWarning):
    mean, std = model.predict(line[:, None], return_std=True)
    lower, upper = sure.predict_interval(line[:, None], coverage=0.9)

figure, panel = plt.subplots(figsize=(7, 4), layout="constrained")
panel.fill_between(line, lower, upper, color="tab:blue", alpha=0.15, label="90 % interval")
panel.fill_between(line, mean - std, mean + std, color="tab:blue", alpha=0.35, label="± std")
panel.plot(line, mean, color="tab:blue", label="prediction")
panel.plot(line, curve(line), "--", color="black", linewidth=1, label="truth")
panel.plot(x, y, ".", color="black", markersize=3, label="rows")
for edge in (x.min(), x.max()):
    panel.axvline(edge, color="grey", linewidth=0.8, linestyle=":")
panel.set(xlabel="x", ylabel="y", ylim=(-3.0, 4.0))
panel.legend(ncols=3, loc="upper left", fontsize="small")

# %%
# A new run is not a new row
# --------------------------
#
# Sixty runs, each with an offset of its own: a bias that does not repeat from one power-on to the
# next. Twelve are there to learn from. With an input that tells the runs apart, such as the
# temperature that each was made at, rules learn the offsets of these runs with the rest, and
# intervals by rows, which come from rows of the same runs, know nothing of those of new ones. Held
# out by whole runs, the intervals are for a new run as a whole.

run = np.repeat(np.arange(60), 25)
temperature = rng.uniform(-40.0, 80.0, size=60)[run] + rng.normal(scale=0.2, size=run.size)
rate = rng.uniform(-1.0, 1.0, size=run.size)
offset = rng.normal(scale=0.3, size=60)[run]
error = 0.5 * rate**2 + 0.01 * temperature + offset + 0.05 * rng.standard_normal(run.size)
X, known = np.column_stack([temperature, rate]), run < 12

rules = ANFISRegressor(n_mfs=[6, 2])
coverages = {}
for label, groups in (("by row", None), ("by run", run[known])):
    sure = ConformalRegressor(rules, cv=12).fit(X[known], error[known], groups=groups)
    with warnings.catch_warnings(action="ignore", category=OutOfBoundsWarning):
        lower, upper = sure.predict_interval(X[~known], coverage=0.9)
    inside = (lower <= error[~known]) & (error[~known] <= upper)
    coverages[label] = [inside[run[~known] == r].mean() for r in range(12, 60)]

figure, panel = plt.subplots(figsize=(7, 3.2), layout="constrained")
for label, values in coverages.items():
    panel.plot(np.sort(values), "o-", markersize=3, label=f"{label}: mean {np.mean(values):.0%}")
panel.axhline(0.9, color="grey", linewidth=0.8, linestyle="--")
panel.set(xlabel="new runs, sorted", ylabel="rows in their 90 % interval", ylim=(-0.02, 1.02))
panel.legend()
plt.show()
