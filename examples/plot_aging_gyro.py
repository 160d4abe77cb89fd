"""
A gyro that ages, and a compensation that follows
=================================================

A fiber-optic gyro is calibrated once, over its whole range of temperatures, and then serves for a
year, in which its light source and its coil age. On some minutes of every third day a reference
says how wrong it is: a vehicle stands still, an antenna is turned by known angles. This page
compares what can be done with those rows: nothing, :meth:`~skanfis.ANFISRegressor.partial_fit` as
they come, or a new fit to the month that has passed. :doc:`/streaming` says how it works.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog

INPUTS = ["time", "temperature", "temperature_rate", "output"]
DEGREES_PER_HOUR = 3600.0
DAYS, EVERY = 365, 3

# %%
# A year of a simulated gyro
# --------------------------
#
# Over the year the scale factor falls by 0.3 %, in the manner of most ageing fast at first; the
# bias rises by 15 degrees per hour, and its temperature coefficient triples. The seasons change the
# temperatures at which it is seen: in summer nothing is learnt about the cold.


def gyro(day, **settings):
    """Rows of one day, or of the calibration before the first."""
    age = np.log1p(day / 60.0) / np.log1p(DAYS / 60.0)
    aged = {
        "scale_factor": -3000.0 * age,
        "bias": 15.0 * day / DAYS,
        "bias_temperature": 0.5 * (1.0 + 2.0 * age),
    }
    return make_ofog(
        n_devices=1,
        device_spread=0.0,
        coefficients=aged,
        sampling_interval=30.0,
        max_rate=20.0,
        random_state=day,
        **settings,
    )


def season(day):
    """Range of the temperatures of a day, coldest in the middle of the winter."""
    middle = 12.0 - 16.0 * np.cos(2.0 * np.pi * day / DAYS)
    return middle - 6.0, middle + 6.0


calibration = gyro(0, n_runs=14, duration=1800.0)
days = np.arange(EVERY, DAYS + 1, EVERY)
seen = [
    gyro(int(day), n_runs=1, duration=1200.0, dwell_time=60.0, ambient_range=season(day))
    for day in days
]

# %%
# Three ways to go on
# -------------------
#
# All begin with the same calibration. ``partial_fit`` keeps its rules, and of all rows no more than
# sums of fixed size; with every row it forgets a little of the older ones, so that about the last
# 670 count, some seven weeks. Every day is compensated before it is learnt.

X, error = calibration[INPUTS], calibration["error"]
settings = {"n_mfs": [2, 2, 1, 3], "out_of_bounds": "clip"}
frozen = ANFISRegressor(**settings).fit(X, error)
following = ANFISRegressor(**settings).partial_fit(X, error)
monthly = frozen

left = {"frozen": [], "partial_fit, every third day": [], "fit to the last month, every month": []}
floor = []
for number, rows in enumerate(seen, start=1):
    for name, model in zip(left, (frozen, following, monthly), strict=True):
        residual = rows["error"] - model.predict(rows[INPUTS])
        left[name].append(DEGREES_PER_HOUR * np.sqrt(np.mean(residual**2)))
    floor.append(DEGREES_PER_HOUR * np.sqrt(np.mean(rows["noise"] ** 2)))
    following.partial_fit(rows[INPUTS], rows["error"], forgetting=0.9985)
    if number % 10 == 0:
        month = pd.concat(seen[number - 10 : number])
        monthly = ANFISRegressor(**settings).fit(month[INPUTS], month["error"])

# %%
# Error against time
# ------------------
#
# Refitting to a month forgets all that the calibration knew of other temperatures: as the season
# moves on, it answers where it has seen nothing. The sums know both.

smooth = pd.DataFrame({**left, "what no model can foresee": floor}).rolling(3, min_periods=1)
smooth = smooth.apply(lambda values: np.sqrt(np.mean(values**2)))
figure, axes = plt.subplots(figsize=(8, 4.6), layout="constrained")
for (name, values), color in zip(smooth.items(), ["C3", "C0", "C1", "0.5"], strict=True):
    style = "--" if color == "0.5" else "-"
    axes.plot(days, values, style, color=color, label=name)
axes.set(
    xlabel="day since the calibration",
    ylabel="error left, RMS of three days [°/h]",
    yscale="log",
    xlim=(EVERY, DAYS),
)
figure.legend(loc="outside upper center", ncols=2)
axes.grid(which="both", alpha=0.3)

for name, values in left.items():
    print(f"{name}: {np.sqrt(np.mean(np.square(values))):.0f} °/h over the year")
print(f"rows seen: {following.n_samples_seen_}")

plt.show()
