"""
Reading a model
===============

What has the model learnt, from how much data, and why does it say what it says here? This page asks
a model of a gyro's error, behind a scaler as models usually are: rules, tables, explanations and
pictures all speak of °C and °/s. :doc:`/inspection` has the reference.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.inspection import (
    MembershipDisplay,
    ResponseSurfaceDisplay,
    explain,
    export_text,
    readability,
    rules_table,
)
from skanfis.learning import VariableProjection

# %%
# The model
# ---------
#
# A simulated gyro, switched on at twelve temperatures and turned at many rates. Some ``stiffness``
# keeps the terms near the places where they start, evenly over the range: it costs little here, and
# "low" and "high" mean what they say.

data = make_ofog(n_devices=1, n_runs=12, random_state=0)
X, error = data[["temperature", "output"]], data["error"]  # output: the indicated rate
model = make_pipeline(
    StandardScaler(), ANFISRegressor(n_mfs=[2, 4], solver=VariableProjection(stiffness=3e-3))
)
model.fit(X, error)
print(f"error {error.std():.3f} °/s, with the model {(error - model.predict(X)).std():.3f} °/s")

# %%
# Rules as text
# -------------
#
# First those that are the strongest on most rows. Each says what it is about where its own rows
# lie, and by how much that changes with an input, counting from there.

print(export_text(model, max_shown=4, output_names=["error"]))

# %%
# As a table
# ----------
#
# "weight" is the part of the data on which a rule fires, "rows" the number of rows on which it is
# the strongest, "at" where the rule says its value.

rules_table(model).round(3)

# %%
# Why this prediction?
# --------------------
#
# For one row: the rules that fired, and what each contributed. Contributions add up to the
# prediction.

row = X.iloc[[2000]]
explanation = explain(model, row)
print(row.round(2).to_string(index=False))
print(f"prediction {model.predict(row)[0]:.4f}, sum {explanation['contribution'].sum():.4f}")
explanation.drop(columns=["row", "output"]).round(4)

# %%
# Memberships
# -----------
#
# Before and after training, over the histogram of the data: how far training has moved the terms,
# and whether there are data under each.

MembershipDisplay.from_estimator(model, X)

# %%
# Which rules have data?
# ----------------------
#
# The gyro warms fast only for a while after power-on, so that a full grid over temperature and its
# rate of change has rules with few rows. What those without any say is extrapolation.

warming = make_pipeline(
    StandardScaler(), ANFISRegressor(n_mfs=[5, 5, 1], solver=VariableProjection(stiffness=0.1))
)
warming.fit(data[["temperature", "temperature_rate", "output"]], error)
rules_table(warming)["data"].plot.bar(subplots=True, legend=False, figsize=(5.6, 4.2))

# %%
# Can the rules be read one by one?
# ---------------------------------
#
# How many numbers there are to read, what the text as printed errs over the model, and what speaks
# against reading it. :doc:`/reading_rules` says what to believe of a rule.

print(readability(model, X, error))

# %%
# Response
# --------
#
# The prediction over two inputs. It is pale where the training data do not cover it.

ResponseSurfaceDisplay.from_estimator(model, X.iloc[::5])

# %%
# Contributions
# -------------
#
# Along one input, the other held: how the rules hand over to each other. Contributions add up to
# the prediction.

rates = np.linspace(X["output"].min(), X["output"].max(), 201)
told = explain(model, pd.DataFrame({"temperature": 40.0, "output": rates}))
parts = told.pivot(index="row", columns="rule", values="contribution").set_index(rates)
axes = parts.plot(xlabel="output [°/s]", ylabel="contribution [°/s]")
axes.legend(loc="lower left", ncols=2, title="rule")

# %%
# Training
# --------
#
# The training error by iteration, of three solvers. Of variable projection it is the last run,
# after the weights of the penalties were found.

figure, ax = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
for solver in ("varpro", "hybrid", "gradient"):
    model.set_params(anfisregressor__solver=solver)
    losses = model.fit(X, error)[-1].loss_curve_
    ax.loglog(np.arange(1, len(losses) + 1), losses, label=solver)
ax.set(xlabel="1 + iterations", ylabel="mean squared error, standardised target")
ax.legend()

plt.show()
