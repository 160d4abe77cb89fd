"""
Simulated gyros, and how to split their data
============================================

:func:`~skanfis.datasets.make_ofog` simulates the calibration of open-loop fiber-optic gyros. This
page looks at its campaigns, shows why the temperature alone does not determine the error, and sets
the trap into which most published splits fall. :doc:`/gyro_data` and :doc:`/gyro_splits` say more.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.ensemble import RandomForestRegressor
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import GroupKFold, KFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.gyro import ThermalRate, group_by_rate_level

# %%
# Campaigns
# ---------
#
# Power-ups at different temperatures, several in a row, soaks, or ramps: in each, the gyro heats
# itself, and its thermometer follows late.

campaigns = {
    "power-ups at four temperatures": {"n_runs": 4},
    "three power-ups in a row": {"n_runs": 4, "n_power_ups": 3, "off_time": 900.0},
    "soaks": {"n_runs": 1, "profile": "soaks", "duration": 28_800.0},
    "ramps": {"n_runs": 1, "profile": "ramps", "duration": 28_800.0},
}
figure, panels = plt.subplots(1, 4, figsize=(11, 3.2), sharey=True, layout="constrained")
for panel, (title, settings) in zip(panels, campaigns.items(), strict=True):
    campaign = make_ofog(n_devices=1, random_state=0, **settings)
    for _, power_up in campaign.groupby("power_up"):
        hours = power_up["time"] / 3600 + 1.25 * (
            power_up["power_up"] % settings.get("n_power_ups", 1)
        )
        panel.plot(hours, power_up["ambient"], color="0.6")
        panel.plot(hours, power_up["temperature"], color="C1")
    panel.set_title(title, fontsize="medium")
    panel.set_xlabel("time [h]")
panels[0].set_ylabel("temperature [°C]")
figure.legend(panels[0].lines[:2], ["chamber", "thermometer"], loc="outside lower center", ncols=2)

# %%
# One temperature, many errors
# ----------------------------
#
# A gyro that turns at 100 °/s while the chamber goes up and down. At one indicated temperature the
# error is further from zero while it warms than while it cools: the coil is ahead of the
# thermometer. Add the rate of the temperature times the lag of the thermometer, 180 s in this gyro,
# and the loop closes.

ramps = make_ofog(
    n_devices=1,
    device_spread=0.0,
    n_runs=1,
    profile="ramps",
    duration=14_400.0,
    rates=[100.0],
    random_state=0,
)
rate_of_temperature = ThermalRate(20.0, time="time", run="run").fit_transform(
    ramps[["time", "temperature", "run"]]
)
figure, panels = plt.subplots(1, 2, figsize=(8, 3.4), sharey=True, layout="constrained")
settled = ramps["time"] > 1800
for panel, temperature, label in (
    (panels[0], ramps["temperature"], "indicated temperature [°C]"),
    (
        panels[1],
        ramps["temperature"] + 180 * rate_of_temperature.ravel(),
        "+ 180 s × its rate [°C]",
    ),
):
    points = panel.scatter(
        temperature[settled],
        ramps["error"][settled],
        c=60 * ramps["temperature_rate"][settled],
        s=4,
        cmap="coolwarm",
    )
    panel.set_xlabel(label)
panels[0].set_ylabel("error at 100 °/s [°/s]")
figure.colorbar(points, label="rate of temperature [°C/min]")

# %%
# Which effect weighs how much
# ----------------------------
#
# Every part of the error is a column of its own.

data = make_ofog(n_devices=1, n_runs=12, max_residual_heat=0.0, random_state=0)
parts = np.sqrt((data.loc[:, "nonlinearity":] ** 2).mean()).sort_values()
figure, panel = plt.subplots(figsize=(6, 3.8), layout="constrained")
panel.barh(parts.index, 3600 * parts)
panel.axvline(3600 * np.sqrt((data["noise"] ** 2).mean()), color="C1", label="noise floor")
panel.set(xscale="log", xlabel="RMS [°/h]")
panel.legend()

# %%
# The trap
# --------
#
# A rate table turns at some dozens of levels, here 57 of them, 3.57 °/s apart. Three models learn
# the true rate from output, temperature and time. Whether rows are held out at random or whole
# runs, the forest seems to be a fine compensator. It has learnt the list of levels: hold out the
# levels, and it is wrong by as much as they are apart. The other two did not fall for it.

table = make_ofog(
    n_devices=1,
    n_runs=12,
    rates=np.linspace(-100.0, 100.0, 57),
    dwell_time=60.0,
    sampling_interval=60.0,
    max_residual_heat=0.0,
    random_state=0,
)
inputs, rate = table[["output", "temperature", "time"]], table["rate"]
splits = {
    "rows at random": {"cv": KFold(5, shuffle=True, random_state=0)},
    "runs": {"cv": GroupKFold(6), "groups": table["run"]},
    "rate levels": {"cv": GroupKFold(5), "groups": group_by_rate_level(rate)},
}
models = {
    "random forest": RandomForestRegressor(100, random_state=0),
    "cubic": make_pipeline(StandardScaler(), PolynomialFeatures(3), LinearRegression()),
    "ANFIS": ANFISRegressor(n_mfs=[5, 2, 2], out_of_bounds="linear"),
}
# The largest rate, and the coldest and the hottest run, are extrapolations when they are held out.
cold, hot = table["ambient"].min(), table["ambient"].max()
judged = (rate.abs() < 100) & (table["ambient"] > cold) & (table["ambient"] < hot)


def residual(model, split):
    """RMS residual in °/s of what was held out."""
    with warnings.catch_warnings():
        # Of rows that are not judged.
        warnings.simplefilter("ignore", OutOfBoundsWarning)
        left = rate - cross_val_predict(model, inputs, rate, **split)
    return np.sqrt(np.mean(left[judged] ** 2))


held_out = pd.DataFrame(
    {
        name: {title: residual(model, split) for title, split in splits.items()}
        for name, model in models.items()
    }
)
held_out.round(4)

# %%

figure, panel = plt.subplots(figsize=(6, 3.2), layout="constrained")
held_out.T.plot.bar(ax=panel, rot=0, color=["0.7", "C0", "C1"])
panel.set(yscale="log", ylabel="residual RMS [°/s]")
panel.legend(title="held out")

# %%

plt.show()
