"""Which inputs the consequents have slopes by, where rows are few for the number of inputs.

There are then too few rows for two rules with slopes by every input, and a line in all of them is
mostly its prior. So only inputs that the lasso selects have slopes. Its penalty is the largest
whose error in the folds is within one standard error of the least (Hastie, Tibshirani and Friedman
2009, 7.10). Such a penalty shrinks slopes too much, but they are fitted again without it.
"""

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import Lasso, LassoCV

from .._threads import without
from ..learning.data import StandardisedData, fingerprint
from .judging import FOLDS, folds
from .sample import DIGITS


def lasso_inputs(rows: StandardisedData, inputs):
    """Those of ``inputs`` that the lasso selects, for any output."""
    if rows.n_rows < FOLDS or not inputs.size:
        return inputs
    # Between columns that are equal, or opposite, rounding errors would divide the slope: the first
    # stands for all.
    numbers = np.abs(fingerprint(np.round(rows.X[:, inputs], DIGITS)))
    inputs = inputs[np.sort(np.unique(numbers, return_index=True)[1])]
    X, weight, has_slope = rows.X[:, inputs], rows.weights, np.zeros(inputs.size, dtype=bool)
    parts = folds(rows)
    for target in rows.y.T:
        # With hardly any noise, the lasso does not converge at the least penalties.
        with without(ConvergenceWarning):
            path = LassoCV(cv=parts).fit(X, target, weight)
            errors = path.mse_path_.mean(axis=1)
            least = int(np.argmin(errors))
            chance = path.mse_path_[least].std() / np.sqrt(len(parts))
            penalty = path.alphas_[errors <= errors[least] + chance].max()
            has_slope |= Lasso(penalty).fit(X, target, weight).coef_ != 0.0
    return inputs[has_slope]
