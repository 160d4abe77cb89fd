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
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import RidgeCV
from sklearn.model_selection import GridSearchCV, KFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

from skanfis import ANFISRegressor

from .report import Measure, Results, Row, Table
from .timing import best_of

__all__ = ["run"]


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
    grid = {"svr__C": [1, 10, 100], "svr__gamma": [0.03, 0.1, 0.3], "svr__epsilon": [0.01, 0.1]}
    pipeline = make_pipeline(StandardScaler(), SVR())
    search = GridSearchCV(pipeline, grid, scoring="neg_mean_squared_error", cv=3)
    yield "ridge", lambda d: make_pipeline(StandardScaler(), RidgeCV(np.logspace(-3, 3, 13)))
    yield "SVR", lambda d: TransformedTargetRegressor(search, transformer=StandardScaler())
    yield "Gaussian process", gaussian_process
    yield "ANFISRegressor()", lambda d: ANFISRegressor(warn_out_of_bounds=False)


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
    lines, ratios = [], []
    for name, X, y in data_sets():
        figures = {label: measure(make, X, y) for label, make in estimators()}
        errors = [error for error, _ in figures.values()]
        ratios.append(errors[-1] / min(errors[:-1]))
        cells = [cell for pair in figures.values() for cell in map(float, pair)]
        lines.append([f"{name}, {X.shape[0]} x {X.shape[1]}", *cells, float(ratios[-1])])
    head = ["data"]
    for label, _ in estimators():
        head += [label, "fit, CPU [s]"]
    mean = float(np.exp(np.mean(np.log(ratios))))
    work = "as it comes, over the best of tuned ridge, SVR and Gaussian process; six data sets"
    return Results(
        [Row(work, [Measure("geometric mean of the errors' ratio", mean, "", 1.05, 1.0)])],
        [Table("Structure by itself, five folds", [*head, "ratio"], lines)],
    )
