"""A fitted pipeline."""

import numpy as np
import pandas as pd
import pytest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from ..quick import quick


@pytest.fixture(scope="session")
def fitted():
    """A pipeline on columns with names, and its data."""
    g = np.random.default_rng(0)
    X = pd.DataFrame(g.uniform([250.0, -1e-3], [330.0, 1e-3], (150, 2)), columns=["kelvin", "rate"])
    y = 1e3 + np.sin(X["kelvin"] / 20) + 1e6 * X["rate"] ** 2
    pipe = make_pipeline(StandardScaler(), quick(n_mfs=[3, 2])).fit(X, y)
    return pipe, X
