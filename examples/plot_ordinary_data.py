"""
A table, from the file to the rules
===================================

What a data scientist does with any regressor, and what is different with this one: the model can be
read. The table is that of Friedman's second problem with names: the impedance of a circuit,
measured with noise, from its resistance, the frequency, its inductance and capacitance, and the
maker of its coil. :doc:`/quickstart` comes before.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.compose import make_column_transformer
from sklearn.datasets import make_friedman2
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import RidgeCV
from sklearn.model_selection import GridSearchCV, cross_val_score, train_test_split
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import OneHotEncoder, StandardScaler

from skanfis import ANFISRegressor
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.inspection import (
    MembershipDisplay,
    ResponseSurfaceDisplay,
    StructureDisplay,
    explain,
    export_text,
)

# %%
# The table
# ---------
#
# Four columns of numbers, some of which are a thousand times as large as others, and one of text.

values, impedance = make_friedman2(n_samples=500, noise=20.0, random_state=0)
X = pd.DataFrame(values, columns=["resistance", "frequency", "inductance", "capacitance"])
X["maker"] = np.random.default_rng(0).choice(["Arens", "Bohm"], len(X))
y = (impedance + 60.0 * (X["maker"] == "Bohm")).rename("impedance")
X.head()

# %%
# A pipeline
# ----------
#
# Text is encoded in front, and names are handed on. Numbers need no scaler; one would do no harm.
# Of two makers one column is enough.

encode = make_column_transformer(
    (OneHotEncoder(drop="if_binary", sparse_output=False), ["maker"]),
    remainder="passthrough",
    verbose_feature_names_out=False,
).set_output(transform="pandas")
model = make_pipeline(encode, ANFISRegressor())

# %%
# Is it any good?
# ---------------
#
# Beside what anyone would try first, in five folds. Noise of 20 is the least that could be left.
# Folds leave out rows at the ends of the range; the model's warning of these is not wanted here.

ridge = make_pipeline(
    make_column_transformer((OneHotEncoder(), ["maker"]), remainder=StandardScaler()), RidgeCV()
)
boosting = make_pipeline(encode, HistGradientBoostingRegressor(random_state=0))
for name, candidate in {"ridge": ridge, "boosted trees": boosting, "ANFIS": model}.items():
    with warnings.catch_warnings(action="ignore", category=OutOfBoundsWarning):
        scores = cross_val_score(candidate, X, y, scoring="neg_root_mean_squared_error", cv=5)
    print(f"{name:14} RMSE {-scores.mean():6.1f}, folds {np.sort(-scores).round(1)}")

# %%
# What was compared
# -----------------
#
# Grids, trees and scattered rules, from one rule on: the error expected of new rows, and how many
# numerals there would be to read. Of those below the dashed line, within 5 % of the best
# (``simplicity``), the one farthest to the left was taken. :doc:`/choosing` has more.

X_train, X_test, y_train, y_test = train_test_split(X, y, test_size=0.2, random_state=0)
model.fit(X_train, y_train)
StructureDisplay.from_estimator(model)

# %%
# May they be read?
# -----------------
#
# The report measures how far the strongest rule alone is from what all say together. Where rules
# mean nothing alone, it says so, and so does ``export_text``. :doc:`/reading_rules` says what may
# be believed of a rule, and when.

print(model[-1].readability_)

# %%
# So few rules have to compensate one another here. Rules that must agree are more, and each is a
# plane that holds where its terms are true.

model.set_params(anfisregressor__agreement=0.003).fit(X_train, y_train)
print(model[-1].readability_)

# %%
# The rules
# ---------
#
# In the names and units of the table: the encoder is folded in.

print(export_text(model, max_shown=4, show_terms=False))

# %%
# Which inputs bend, and where? Terms before training are dashed, the data grey.

MembershipDisplay.from_estimator(model, X_train)

# %%
# Why this prediction?
# --------------------
#
# For one row: the rules that fired, and what each contributed.

row = X_test.iloc[[0]]
explanation = explain(model, row)
print(row.round(3).to_string(index=False))
print(f"measured {y_test.iloc[0]:.0f}, predicted {model.predict(row)[0]:.0f}")
explanation[["rule", "if", "strength", "value", "contribution"]].head(8).round(2)

# %%
# The prediction over two inputs, pale where no data cover it:

ResponseSurfaceDisplay.from_estimator(model, X_train, features=["frequency", "inductance"])

# %%
# Is there a better setting?
# --------------------------
#
# Mostly not: structure and penalties come from the data. A search is for what you would rather
# have. What that costs in error it can tell beside what there is to read, and how far the strongest
# rule alone is off: the error alone would always have the smallest ``simplicity``.

told = {
    "error": "neg_root_mean_squared_error",
    "numerals": lambda fitted, X, y: fitted[-1].readability_.reading_cost,
    "alone": lambda fitted, X, y: fitted[-1].readability_.summary["strongest_alone"],
}
settings = {"anfisregressor__agreement": ["auto", 0.003], "anfisregressor__max_rules": [1, 2, 4, 8]}
search = GridSearchCV(model, settings, scoring=told, refit="error", cv=3)
with warnings.catch_warnings(action="ignore", category=OutOfBoundsWarning):
    search.fit(X_train, y_train)
found = pd.DataFrame(search.cv_results_)
found.filter(regex="param_|mean_test_").round(2)

# %%

plt.show()
