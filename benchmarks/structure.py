"""Structure by itself against tuned regressors, on data that come with scikit-learn."""

import numpy as np
from sklearn.compose import TransformedTargetRegressor
from sklearn.datasets import (
    load_breast_cancer,
    load_diabetes,
    load_wine,
    make_friedman1,
    make_friedman2,
    make_friedman3,
)
from sklearn.ensemble import GradientBoostingRegressor, HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import RidgeCV
from sklearn.model_selection import GridSearchCV, KFold
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from sklearn.svm import SVR

from skanfis import ANFISRegressor

from .report import Measure, Results, Row, Table
from .timing import best_of

__all__ = ["run"]

BEST_OF = ("ridge", "SVR", "Gaussian process")
OURS = "ANFISRegressor()"


def data_sets():
    """Name, X and y of each; the last two predict one measured column from others."""
    yield "diabetes", *load_diabetes(return_X_y=True)
    yield "Friedman 1", *make_friedman1(1000, n_features=8, noise=1.0, random_state=0)
    yield "Friedman 2", *make_friedman2(800, noise=125.0, random_state=0)
    yield "Friedman 3", *make_friedman3(800, noise=0.1, random_state=0)
    wine, cancer = load_wine().data, load_breast_cancer().data
    yield "wine: alcohol", wine[:, 1:10], wine[:, 0]
    yield "cells: radius", cancer[:, [1, 4, 5, 6, 8, 9]], cancer[:, 0]


def estimators():
    """Name and how to make it for so many inputs; those of ``BEST_OF`` first, this package last."""
    alphas = np.logspace(-3, 3, 13)
    yield "ridge", lambda d: make_pipeline(StandardScaler(), RidgeCV(alphas))
    yield "SVR", lambda d: support_vectors()
    yield "Gaussian process", gaussian_process
    yield (
        "quadratic ridge",
        lambda d: make_pipeline(
            StandardScaler(), PolynomialFeatures(2), StandardScaler(), RidgeCV(alphas)
        ),
    )
    yield "MLP", lambda d: neural_network()
    yield "GradientBoosting", lambda d: boosting()
    yield "HistGradientBoosting", lambda d: histogram_boosting()
    yield OURS, lambda d: ANFISRegressor()


def tuned(model, grid):
    """A search over the parameters of a model, of three folds inside the training rows."""
    return GridSearchCV(model, grid, scoring="neg_mean_squared_error", cv=3)


def standardised(model, grid):
    """The same on standardised inputs and target."""
    step = type(model).__name__.lower()
    search = tuned(
        make_pipeline(StandardScaler(), model), {f"{step}__{k}": v for k, v in grid.items()}
    )
    return TransformedTargetRegressor(search, transformer=StandardScaler())


def support_vectors():
    return standardised(
        SVR(), {"C": [1, 10, 100], "gamma": [0.03, 0.1, 0.3], "epsilon": [0.01, 0.1]}
    )


def neural_network():
    """Few enough rows for L-BFGS, which gets farther than Adam here."""
    model = MLPRegressor(solver="lbfgs", max_iter=300, random_state=0)
    return standardised(
        model, {"hidden_layer_sizes": [(20,), (50,)], "alpha": [0.1, 1.0, 10.0, 100.0]}
    )


def boosting():
    grid = {"learning_rate": [0.03, 0.1], "max_depth": [2, 3], "n_estimators": [100, 300]}
    return tuned(GradientBoostingRegressor(subsample=0.7, random_state=0), grid)


def histogram_boosting():
    grid = {"learning_rate": [0.03, 0.1], "max_leaf_nodes": [4, 16], "max_iter": [100, 300]}
    return tuned(HistGradientBoostingRegressor(early_stopping=False, random_state=0), grid)


def gaussian_process(n_inputs):
    kernel = ConstantKernel() * RBF([2.0] * n_inputs) + WhiteKernel(0.1)
    return make_pipeline(StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True))


def measure(make_estimator, X, y):
    """Root mean square error over five folds, in deviations of y, and processor time of a fit."""
    squares, times = [], []
    for train, test in KFold(5, shuffle=True, random_state=0).split(X):
        seconds, model = best_of(
            lambda train=train: make_estimator(X.shape[1]).fit(X[train], y[train]), 1
        )
        squares.append((model.predict(X[test]) - y[test]) ** 2)
        times.append(seconds)
    return np.sqrt(np.mean(np.concatenate(squares))) / y.std(), np.median(times)


def run(options):
    errors, times, ratios = [], [], []
    for name, X, y in data_sets():
        figures = {label: measure(make, X, y) for label, make in estimators()}
        label = f"{name}, {X.shape[0]} x {X.shape[1]}"
        best = min(figures[rival][0] for rival in BEST_OF)
        errors.append([label, *(float(error) for error, _ in figures.values())])
        times.append([label, *(float(seconds) for _, seconds in figures.values())])
        ratios.append([error / best for error, _ in figures.values()])
    means = dict(zip(figures, np.exp(np.mean(np.log(ratios), axis=0)).tolist(), strict=True))
    errors.append(["geometric mean of the ratios", *means.values()])
    work = "as it comes, over the best of tuned ridge, SVR and Gaussian process; six data sets"
    measure_of_all = Measure("geometric mean of the errors' ratio", means[OURS], "", 1.05, 1.0)
    return Results(
        [Row(work, [measure_of_all])],
        [
            Table(
                "Structure by itself: error of five folds, in deviations of the target; the ratios "
                f"are to the best of {', '.join(BEST_OF)}",
                ["data", *means],
                errors,
            ),
            Table("Structure by itself: fit with all tuning, CPU [s]", ["data", *means], times),
        ],
    )
