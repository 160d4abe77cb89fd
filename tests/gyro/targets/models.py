"""Compensators of every kind that a simple target is made of, and rows in their range."""

from functools import cache

import numpy as np
import pandas as pd
from sklearn.dummy import DummyRegressor

from skanfis.gyro import GyroCompensator
from skanfis.gyro._models import make_law_and_line, make_polynomial
from skanfis.gyro.targets.error_model import ErrorModel

from ...quick import quick

ENDS = np.array([(-20.0, 60.0), (-2500.0, 2500.0)])  # degC, counts
COUNTS = -25.0  # per deg/s
INPUTS = ("output", "temperature")  # another order than that of the axes
AXES = ("temperature", "output")


def rows(n_rows, seed=0):
    """Rows (n_rows, 2) of temperature and output."""
    return np.random.default_rng(seed).uniform(*ENDS.T, (n_rows, 2))


def planted(temperature, output):
    """An error [deg/s] that is bent in both."""
    rate = output / COUNTS
    return 0.02 * np.tanh((temperature - 20.0) / 15.0) + 1e-3 * rate * np.sin(temperature / 25.0)


@cache
def error_of(kind):
    """The ErrorModel of both axes, of a kind of estimator."""
    points = rows(800)
    X = pd.DataFrame(points, columns=AXES)[list(INPUTS)]
    error = planted(*points.T)
    rate = X["output"] / COUNTS - error
    make = {
        "rules": lambda: quick([3, 4]),
        "polynomial": lambda: make_polynomial(3),
        "constant": DummyRegressor,
        "law and line": lambda: make_law_and_line(INPUTS),
    }[kind]
    is_rate = kind == "law and line"
    estimator = make().fit(X, rate if is_rate else error)
    predicts = "rate" if is_rate else "error"
    compensator = GyroCompensator(estimator, INPUTS, predicts, COUNTS, "counts")
    return ErrorModel(compensator, estimator, AXES, X.iloc[0])


@cache
def error_over_temperature(kind="rules"):
    """The ErrorModel of the temperature alone."""
    points = rows(800)[:, :1]
    X = pd.DataFrame(points, columns=AXES[:1])
    estimator = {"rules": lambda: quick([4]), "polynomial": lambda: make_polynomial(3)}[kind]()
    estimator.fit(X, planted(points[:, 0], 0.0))
    compensator = GyroCompensator(estimator, AXES[:1])
    return ErrorModel(compensator, estimator, AXES[:1], X.iloc[0])
