"""
What a calibration cannot know
==============================

Two things to know before a compensation is believed: how much of it belongs to the type of gyro and
how much to the unit, and how many rows prove anything. :doc:`plot_gyro_compensation` comes before.
"""

import warnings

import numpy as np
import pandas as pd
from sklearn.dummy import DummyRegressor
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneOut, cross_val_predict

from skanfis import ANFISRegressor
from skanfis.datasets import load_ofog, make_ofog
from skanfis.exceptions import OutOfBoundsWarning, UnderdeterminedWarning


def rms(values):
    """Root of the mean square."""
    return np.sqrt(np.mean(values**2))


# %%
# Other gyros of the type
# -----------------------
#
# Three gyros of one type, each calibrated by itself on eight of twelve runs, and judged on the
# others; the last column applies the compensation of gyro 0 to all. Much of the error is common to
# the type, such as the sine, but its coefficients differ from unit to unit: calibrate every unit.

log = make_ofog(n_devices=3, n_runs=12, sampling_interval=60.0, random_state=0)
log["error"] = log["output"] - log["rate"]
inputs = ["time", "temperature", "output"]
models, rows = {}, []
for device, own in log.groupby("device"):
    by_temperature = own.groupby("run")["temperature"].mean().sort_values().index
    new = own["run"].isin(by_temperature[1:-1:3])
    models[device] = ANFISRegressor(n_mfs=[2, 2, 4])
    models[device].fit(own.loc[~new, inputs], own.loc[~new, "error"])
    left = [own.loc[new, "error"]]
    with warnings.catch_warnings():
        # The coldest and hottest of another gyro's runs may be beyond the range of this one.
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        left += [left[0] - models[one].predict(own.loc[new, inputs]) for one in (device, 0)]
    rows.append([3600 * rms(values) for values in left])
columns = ["uncompensated", "its own compensation", "that of gyro 0"]
pd.DataFrame(rows, columns=columns).rename_axis("gyro").round(0)

# %%
# Nineteen rows
# -------------
#
# The paper that first used an ANFIS for this task trained six terms on temperature and six on rate,
# 36 rules of three coefficients, on 19 rows within 1 °C. A model of 108 coefficients can pass
# through all of them, and that is no evidence: nothing is left to test it on. Leaving out one row
# at a time shows what it knows of a row that it has not seen: no more than their mean. The rules of
# skanfis have to agree where they fire together, and have found as much by themselves.

table = load_ofog()
X, y = table.data[["temperature", "rate"]], table.target
candidates = {
    "mean": DummyRegressor(),
    "straight line": LinearRegression(),
    "ANFIS, 6 x 6 rules": ANFISRegressor(n_mfs=[6, 6]),
}
found = {}
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    for name, model in candidates.items():
        trained = model.fit(X, y).predict(X)
        found[name] = [rms(y - trained), rms(y - cross_val_predict(model, X, y, cv=LeaveOneOut()))]
pd.DataFrame(found, index=["training RMS [°/s]", "leave-one-out RMS [°/s]"]).T.round(4)

# %%
# The model itself says so when it is trained:

print(next(w.message for w in caught if w.category is UnderdeterminedWarning))
