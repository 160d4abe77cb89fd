"""Which inputs consequents have slopes by, where there are few rows for so many.

There is no room for two rules then with slopes by every input, and a line of all is mostly its
prior. Slopes by those of the lasso alone leave room. Its penalty is the largest whose error in the
folds is within one standard error of the least (Hastie, Tibshirani and Friedman 2009, 7.10): what
is fitted to its inputs afterwards is not drawn to zero any more.
"""

import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import Lasso, LassoCV

from ..learning.data import StandardisedData
from .judging import FOLDS, folds

# The least penalty that is tried, over that at which there are no slopes. Less is hardly ever
# chosen, and takes most of the time where columns go together.
_LEAST_PENALTY = 0.01


def lasso_inputs(rows: StandardisedData, inputs):
    """Those of some inputs by which the lasso has slopes, for any output."""
    if rows.n_rows < FOLDS or not inputs.size:
        return inputs
    X, weight, has_slope = rows.X[:, inputs], rows.weights, np.zeros(inputs.size, dtype=bool)
    parts = folds(rows)
    for target in rows.y.T:
        # Where there is hardly any noise, the least penalties do not arrive.
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            path = LassoCV(cv=parts, eps=_LEAST_PENALTY).fit(X, target, weight)
            errors = path.mse_path_.mean(axis=1)
            least = int(np.argmin(errors))
            chance = path.mse_path_[least].std() / np.sqrt(len(parts))
            penalty = path.alphas_[errors <= errors[least] + chance].max()
            has_slope |= Lasso(penalty).fit(X, target, weight).coef_ != 0.0
    return inputs[has_slope]
