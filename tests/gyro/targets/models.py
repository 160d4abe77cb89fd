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
AXES = ("temperature", "output")


def rows(n_rows, seed=0):
    """Rows (n_rows, 2) of temperature and output."""
    return np.random.default_rng(seed).uniform(*ENDS.T, (n_rows, 2))


def planted(temperature, output):
    """An error [deg/s] that is bent in both."""
    rate = output / COUNTS
    return 0.02 * np.tanh((temperature - 20.0) / 15.0) + 1e-3 * rate * np.sin(temperature / 25.0)


def polynomial(X, error, policy="clip"):
    """The cubic nearest to an error, as it is written."""
    every = {name: fit for name, _, fit in kinds(list(X), policy)}
    return every["cubic polynomial"](X, error)


def law_and_line():
    law = OpenLoopArcsineRegressor("output", "temperature", bias_degree=1, amplitude_degree=1)
    return ResidualRegressor(law, quick([1, 1]), n_rounds=3)


@cache
def error_of(kind, n_inputs=2):
    """The ErrorModel of both inputs, or of the temperature, of a kind of estimator."""
    # With the ends of the range among them.
    points = np.vstack([rows(800), ENDS.T])[:, :n_inputs]
    X = pd.DataFrame(points, columns=AXES[:n_inputs])
    output = points[:, 1] if n_inputs > 1 else 0.0
    error = planted(points[:, 0], output)
    estimator, predicts = {
        "rules": lambda: (quick([3, 4] if n_inputs > 1 else [4]).fit(X, error), "error"),
        "polynomial": lambda: (polynomial(X, error), "error"),
        "constant": lambda: (quick([1, 1], order=0).fit(X, error), "error"),
        "law and line": lambda: (law_and_line().fit(X, output / COUNTS - error), "rate"),
    }[kind]()
    compensator = GyroCompensator(estimator, AXES[:n_inputs], predicts, COUNTS, "counts")
    return ErrorModel(compensator, estimator, X)
