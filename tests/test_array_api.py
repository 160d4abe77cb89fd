"""Arrays of other libraries go in as NumPy's, whatever scikit-learn's dispatch is set to."""

import os
import subprocess
import sys

import numpy as np
import pytest
import sklearn
from numpy.testing import assert_array_equal
from sklearn.utils.fixes import parse_version

from skanfis import ANFISRegressor

strict = pytest.importorskip("array_api_strict")

WITH_DISPATCH = """
import array_api_strict, numpy, sklearn
from skanfis import ANFISRegressor
X = numpy.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
y = X[:, 0] * X[:, 1]
with sklearn.config_context(array_api_dispatch=True):
    model = ANFISRegressor(n_mfs=2).fit(*map(array_api_strict.asarray, (X, y)))
    found = model.predict(array_api_strict.asarray(X))
assert type(found) is numpy.ndarray
assert (found == ANFISRegressor(n_mfs=2).fit(X, y).predict(X)).all()
"""


def test_strict_arrays_are_the_same_as_numpys():
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
    y = X[:, 0] * X[:, 1]
    model = ANFISRegressor(n_mfs=2).fit(X, y)
    other = ANFISRegressor(n_mfs=2).fit(strict.asarray(X), strict.asarray(y))
    assert_array_equal(other.consequents_, model.consequents_)
    for method in ("predict", "coverage", "strengths", "in_bounds"):
        found = getattr(model, method)(strict.asarray(X))
        assert type(found) is np.ndarray
        assert_array_equal(found, getattr(model, method)(X))


@pytest.mark.slow
def test_dispatch_changes_nothing():
    if parse_version(sklearn.__version__) < parse_version("1.7"):
        # scikit-learn brings its own from 1.7 on.
        pytest.importorskip("array_api_compat")
    # SciPy reads its own switch when it is imported.
    environment = {**os.environ, "SCIPY_ARRAY_API": "1"}
    subprocess.run([sys.executable, "-c", WITH_DISPATCH], env=environment, check=True)


def test_arrays_on_another_device_say_so():
    class OnDevice:
        shape = (3, 2)

        def __dlpack__(self):
            raise NotImplementedError

        def __array__(self, dtype=None, copy=None):
            raise TypeError("Implicit conversion to a NumPy array is not allowed. Use .get().")

    model = ANFISRegressor(n_mfs=1).fit(np.eye(4)[:, :2], np.arange(4.0))
    with pytest.raises(TypeError, match=r"Use \.get\(\)"):
        model.predict(OnDevice())
