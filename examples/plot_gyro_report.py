"""
Pictures of a gyro's compensation
=================================

What ``python -m skanfis.gyro`` puts in its report, made by hand: a simulated gyro goes up and down
in temperature on a rate table, its error is learnt, and every picture shows runs that the model had
not seen. :doc:`/gyro_pictures` says how to read them, :doc:`/gyro_command` how to get them without
writing Python.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.model_selection import GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.gyro import (
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
    ThermalRate,
)

# %%
# A campaign, and a compensation checked on it
# --------------------------------------------
#
# Ten runs of two hours, each over another part of the chamber's ramp. Two by two they are
# compensated by a model trained on the other eight. A row outside their range gets NaN: it would be
# flagged on board, and is left out of the pictures.

log = make_ofog(n_devices=1, n_runs=10, profile="ramps", duration=7200.0, random_state=0)
thermal_rate = ThermalRate(30.0, time="time", run="run")
log["dT/dt"] = thermal_rate.fit_transform(log[["time", "temperature", "run"]])
X = log[["time", "temperature", "dT/dt", "output"]]

anfis = ANFISRegressor([2, 2, 1, 4], out_of_bounds="nan")
model = make_pipeline(StandardScaler(), anfis)
predicted = np.empty(len(log))
for train, test in GroupKFold(5).split(X, groups=log["run"]):
    predicted[test] = model.fit(X.iloc[train], log["error"].iloc[train]).predict(X.iloc[test])
rates = log["rate"], log["output"], log["output"] - predicted

# %%
# Error
# -----
#
# Against time and against temperature, before and after. The two panels have scales of their own.

figure = plt.figure(figsize=(11, 4.2), layout="constrained")
left, right = figure.subfigures(1, 2)
by_time = ErrorDisplay.from_predictions(
    *rates,
    position=log["time"],
    position_label="time since power-on [s]",
    ax=left.subplots(2, sharex=True),
)
by_temperature = ErrorDisplay.from_predictions(
    *rates,
    position=log["temperature"],
    position_label="temperature [°C]",
    ax=right.subplots(2, sharex=True),
)

# %%
# Scale factor and hysteresis
# ---------------------------

figure = plt.figure(figsize=(11, 4.4), layout="constrained")
left, right = figure.subfigures(1, 2)
ScaleFactorErrorDisplay.from_predictions(
    *rates, temperature=log["temperature"], ax=left.subplots(2, sharex=True)
)
HysteresisDisplay.from_predictions(
    *rates,
    temperature=log["temperature"],
    temperature_rate=60.0 * log["dT/dt"],
    ax=right.subplots(2, sharex=True),
)

# %%
# Hysteresis is a matter of bias, and shows best in a gyro at rest, where no rate disturbs it.

at_rest = make_ofog(
    n_devices=1, n_runs=8, profile="ramps", duration=7200.0, rates=[0.0], random_state=0
)
at_rest["dT/dt"] = thermal_rate.fit_transform(at_rest[["time", "temperature", "run"]])
old = at_rest["run"] < 6
inputs = at_rest[["time", "temperature", "dT/dt"]]
bias_model = ANFISRegressor([2, 2, 1], out_of_bounds="clip")
bias_model = bias_model.fit(inputs[old], at_rest["error"][old])
new = at_rest[~old]
HysteresisDisplay.from_predictions(
    new["rate"],
    new["output"],
    new["output"] - bias_model.predict(new[inputs.columns]),
    temperature=new["temperature"],
    temperature_rate=60.0 * new["dT/dt"],
)

# %%
# Where error is left
# -------------------

surface = ResidualSurfaceDisplay.from_predictions(*rates, temperature=log["temperature"])
groups = GroupResidualDisplay.from_predictions(*rates, groups=log["run"])

# %%
# Where it may be used
# --------------------
#
# The last picture is of the model itself, trained on all runs: outside the dashed line it flags.

coverage = CoverageDisplay.from_estimator(model.fit(X, log["error"]), X)

plt.show()
