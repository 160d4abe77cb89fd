"""Compensators of every kind that a simple target is made of, and rows in their range."""

from functools import cache

import numpy as np
import pandas as pd

from skanfis.gyro import GyroCompensator, OpenLoopArcsineRegressor, ResidualRegressor
from skanfis.gyro._simpler import kinds
from skanfis.gyro.targets.error_model import ErrorModel

from ...quick import quick

ENDS = np.array([(-20.0, 60.0), (-2500.0, 2500.0)])  # degC, counts
COUNTS = -25.0  # per deg/s
AXES = INPUTS = ("temperature", "output")


def rows(n_rows, seed=0):
    """Rows (n_rows, 2) of temperature and output."""
    return np.random.default_rng(seed).uniform(*ENDS.T, (n_rows, 2))


def planted(temperature, output):
    """An error [deg/s] that is bent in both."""
    rate = output / COUNTS
    return 0.02 * np.tanh((temperature - 20.0) / 15.0) + 1e-3 * rate * np.sin(temperature / 25.0)


def framed():
    """Rows with the ends of the range among them."""
    return np.vstack([rows(800), ENDS.T])


def polynomial(X, error, policy="clip"):
    """The cubic nearest to an error, as it is written."""
    every = {name: fit for name, _, fit in kinds(list(X), policy)}
    return every["cubic polynomial"](X, error)


def law_and_line():
    law = OpenLoopArcsineRegressor("output", "temperature", bias_degree=1, amplitude_degree=1)
    return ResidualRegressor(law, quick([1, 1]), n_rounds=3)


@cache
def error_of(kind):
    """The ErrorModel of both inputs, of a kind of estimator."""
    points = framed()
    X = pd.DataFrame(points, columns=AXES)[list(INPUTS)]
    error = planted(*points.T)
    rate = X["output"] / COUNTS - error
    make = {
        "rules": quick([3, 4]).fit,
        "polynomial": polynomial,
        "constant": quick([1, 1], order=0).fit,
        "law and line": law_and_line().fit,
    }[kind]
    is_rate = kind == "law and line"
    estimator = make(X, rate if is_rate else error)
    predicts = "rate" if is_rate else "error"
    compensator = GyroCompensator(estimator, INPUTS, predicts, COUNTS, "counts")
    return ErrorModel(compensator, estimator, X)


@cache
def error_over_temperature(kind="rules"):
    """The ErrorModel of the temperature alone."""
    points = framed()[:, :1]
    X = pd.DataFrame(points, columns=AXES[:1])
    make = {"rules": quick([4]).fit, "polynomial": polynomial}[kind]
    estimator = make(X, planted(points[:, 0], 0.0))
    compensator = GyroCompensator(estimator, AXES[:1])
    return ErrorModel(compensator, estimator, X)
