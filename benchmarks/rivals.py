"""The regressors that ANFISRegressor is compared with on many data sets."""

import numpy as np
import pandas as pd
from sklearn.compose import TransformedTargetRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import LassoCV, RidgeCV
from sklearn.model_selection import GridSearchCV
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, PolynomialFeatures, StandardScaler
from sklearn.svm import SVR

from .cases import folds, remembered
from .scores import in_deviations
from .timing import timed

__all__ = [
    "BEST_OF",
    "GLASS_BOXES",
    "fitted_rival",
    "gaussian_process",
    "rival_errors",
    "rival_in_folds",
]

# The ratios are to the best of these.
BEST_OF = ("quadratic ridge", "SVR", "Gaussian process")
# Most rows that the Gaussian process learns from: its cost grows with the cube.
GP_ROWS = 1500


def quadratic_ridge(n_inputs):
    alphas = np.logspace(-3, 3, 13)
    return make_pipeline(StandardScaler(), PolynomialFeatures(2), StandardScaler(), RidgeCV(alphas))


def lasso(n_inputs):
    return make_pipeline(StandardScaler(), LassoCV())


def support_vectors(n_inputs):
    grid = {"C": [1, 10, 100], "gamma": [0.03, 0.1, 0.3], "epsilon": [0.01, 0.1]}
    return tuned(SVR(), {f"svr__{name}": values for name, values in grid.items()})


def gaussian_process(n_inputs):
    kernel = ConstantKernel() * RBF([2.0] * n_inputs) + WhiteKernel(0.1)
    return make_pipeline(StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True))


def network(n_inputs):
    """One hidden layer or two."""
    grid = {"hidden_layer_sizes": [(50,), (50, 50)], "alpha": [1e-4, 1e-2]}
    model = MLPRegressor(solver="lbfgs", max_iter=500, random_state=0)
    return tuned(model, {f"mlpregressor__{name}": values for name, values in grid.items()})


def tuned(model, grid):
    """The best of a grid in three folds, inputs and target standardised."""
    pipeline = make_pipeline(StandardScaler(), model)
    search = GridSearchCV(pipeline, grid, scoring="neg_mean_squared_error", cv=3)
    return TransformedTargetRegressor(search, transformer=StandardScaler())


def explainable_boosting(n_inputs):
    from interpret.glassbox import ExplainableBoostingRegressor

    return ExplainableBoostingRegressor(random_state=0, n_jobs=1)


def cubist(n_inputs):
    from cubist import Cubist

    # It wants names of columns.
    named = FunctionTransformer(lambda X: pd.DataFrame(X).add_prefix("x"))
    return make_pipeline(named, Cubist(random_state=0))


def figs(n_inputs):
    from imodels import FIGSRegressor

    return FIGSRegressor(max_rules=12, random_state=0)


RIVALS = {
    "quadratic ridge": quadratic_ridge,
    "lasso": lasso,
    "SVR": support_vectors,
    "Gaussian process": gaussian_process,
    "neural network": network,
    "EBM": explainable_boosting,
    "cubist": cubist,
    "FIGS": figs,
}
# Models that people read; and the packages they are in.
GLASS_BOXES = {"EBM": "interpret-core", "FIGS": "imodels", "cubist": "cubist"}


def fitted_rival(name, X, y, gp_rows=GP_ROWS):
    """A rival, and seconds of its fit; a Gaussian process learns from ``gp_rows`` rows at most."""
    if name == "Gaussian process" and X.shape[0] > gp_rows:
        chosen = np.random.default_rng(0).choice(X.shape[0], gp_rows, replace=False)
        X, y = X[chosen], y[chosen]
    return timed(RIVALS[name](X.shape[1]).fit, X, y)


def rival_in_folds(name, folder, case, X, y, n_folds=5, fit=True):
    """Of each fold: the sum of squared errors and seconds, or None if ``remembered`` has none."""

    def figures(X_train, y_train, X_test, y_test):
        model, seconds = fitted_rival(name, X_train, y_train)
        return [float(np.sum((model.predict(X_test) - y_test) ** 2)), seconds]

    packages = [GLASS_BOXES[name]] if name in GLASS_BOXES else []
    found = []
    for k, (train, test) in enumerate(folds(X, n_folds)):
        file = f"{case} {name} {k} of {n_folds}"
        data = X[train], y[train], X[test], y[test]
        found.append(remembered(folder, file, figures, *data, packages=packages, fit=fit))
    return found


def rival_errors(folder, case, X, y, n_folds=5, fit=True):
    """The errors of the rivals by name; LookupError where one is neither remembered nor fitted."""
    found = {}
    for name in BEST_OF:
        parts = rival_in_folds(name, folder, case, X, y, n_folds, fit)
        if None in parts:
            raise LookupError("its rivals are not remembered yet")
        found[name] = in_deviations([squares for squares, _ in parts], y)
    return found
