"""The same data give the same model, to the last bit: whatever was fitted before, wherever."""

import hashlib
import warnings

import numpy as np
import pytest
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.cluster import FuzzyCMeans
from skanfis.learning import GradientDescent, Hybrid, VariableProjection

SETTINGS = {
    # Grids, and clusters by k-means.
    "searched": {"max_rules": 3},
    "grid of a given size": {"n_mfs": [2, 3, 1]},
    "scattered": {"partition": "scattered", "max_rules": 3},
    "fuzzy clusters": {"partition": FuzzyCMeans(3, random_state=0)},
    "clusterer": {"partition": KMeans(4, random_state=0)},
    "hybrid": {"n_mfs": 2, "solver": Hybrid(tol=1e-2), "max_iter": 5},
    "gradient": {"n_mfs": 2, "solver": GradientDescent(tol=1e-2), "max_iter": 5},
    "lse": {"n_mfs": 2, "solver": "lse"},
    "huber": {"n_mfs": 2, "loss": "huber"},
    "early stopping": {"n_mfs": 3, "early_stopping": True},
    "weights that are given": {
        "n_mfs": 3,
        "agreement": 0.1,
        "alpha": 0.01,
        "solver": VariableProjection(tol=1e-2, stiffness=1e-3),
    },
}


def data():
    g = np.random.default_rng(11)
    X = g.normal(size=(40, 3)) * [1.0, 100.0, 1e-3]
    return X, np.sin(X[:, 0]) + 1e-2 * X[:, 1] * X[:, 0] + 0.1 * g.normal(size=40)


def digest(name):
    """What a fit is, in short."""
    X, y = data()
    model = ANFISRegressor(**({"solver": VariableProjection(tol=1e-2)} | SETTINGS[name]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(X, y)
        # Rows held out may be out of range.
        predicted = model.predict(X)
    parts = [predicted, model.consequents_, model.loss_curve_]
    return hashlib.sha256(b"".join(np.ascontiguousarray(part) for part in parts)).hexdigest()


@pytest.mark.theory
@pytest.mark.parametrize("name", SETTINGS)
def test_nothing_fitted_before_matters(name, fresh_process):
    # There every digest comes of a process that has fitted none, in reverse order.
    assert digest(name) == fresh_process["digests"][name]
