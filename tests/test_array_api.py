"""Arrays of other libraries go in as NumPy's; with dispatch, predictions stay what they are."""

import importlib.util
import os
import subprocess
import sys

import numpy as np
import pytest
import sklearn
from numpy.testing import assert_array_equal
from sklearn.utils.fixes import parse_version

from skanfis import ANFISRegressor

from .quick import quick

strict = pytest.importorskip("array_api_strict")

WITH_DISPATCH = """
import LIBRARY as xp, numpy as np, pytest, sklearn, warnings
from numpy.testing import assert_allclose
from sklearn.preprocessing import StandardScaler
from sklearn.pipeline import make_pipeline
from skanfis import ANFISRegressor
from skanfis.exceptions import OutOfBoundsWarning

X = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
y = X[:, 0] * X[:, 1]
given = {"n_mfs": 2, "agreement": 0.1, "alpha": 1e-5, "solver": "lse"}
host = ANFISRegressor(**given).fit(X, y)
far = xp.asarray(2.0 * X)
with sklearn.config_context(array_api_dispatch=True):
    model = ANFISRegressor(**given).fit(xp.asarray(X), xp.asarray(y))
    assert (model.consequents_ == host.consequents_).all()
    assert type(model.predict(X)) is np.ndarray
    assert (model.predict(X) == host.predict(X)).all()
    for dtype, atol in ((xp.float64, 1e-13), (xp.float32, 1e-6)):
        # No warning, which would be an error: rows stay in the box.
        there = xp.asarray(X if dtype == xp.float64 else 0.999 * X, dtype=dtype)
        found = model.predict(there)
        assert found.dtype == dtype and found.device == far.device
        assert_allclose(np.asarray(found), host.predict(np.asarray(there)), rtol=0.0, atol=atol)
    both = model.predict(xp.asarray(X), return_std=True)
    for one, other in zip(both, host.predict(X, return_std=True)):
        assert_allclose(np.asarray(one), other)
    with pytest.warns(OutOfBoundsWarning, match="'x0' in .* of 200 rows"):
        found = model.predict(far)
    with pytest.warns(OutOfBoundsWarning):
        assert_allclose(np.asarray(found), host.predict(2.0 * X), rtol=0.0, atol=1e-13)
    with pytest.raises(ValueError, match="outside the training data: 'x0'"):
        model.set_params(out_of_bounds="raise").predict(far)
    assert model.predict(xp.asarray(X)).shape == (200,)
    with pytest.raises(ValueError, match="NaN in column 'x1', first at row 1"):
        model.predict(xp.asarray([[0.0, 0.0], [0.0, float("nan")]]))
    with pytest.raises(ValueError, match="3 features"):
        model.predict(xp.zeros((4, 3)))
    scaled = make_pipeline(StandardScaler(), ANFISRegressor(**given)).fit(X, y)
    assert_allclose(np.asarray(scaled[-1].predict(xp.asarray(scaled[0].transform(X)))),
                    scaled.predict(X), rtol=0.0, atol=1e-12)
"""


def test_strict_arrays_are_the_same_as_numpys():
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
    y = X[:, 0] * X[:, 1]
    model = quick().fit(X, y)
    other = quick().fit(strict.asarray(X), strict.asarray(y))
    assert_array_equal(other.consequents_, model.consequents_)
    for method in ("predict", "coverage", "strengths", "in_bounds"):
        found = getattr(model, method)(strict.asarray(X))
        assert type(found) is np.ndarray
        assert_array_equal(found, getattr(model, method)(X))


@pytest.mark.slow
@pytest.mark.parametrize("library", ["array_api_strict", "torch"])
def test_with_dispatch_predictions_are_computed_in_the_arrays_library(library):
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    if parse_version(sklearn.__version__) < parse_version("1.7"):
        # scikit-learn brings its own from 1.7 on.
        pytest.importorskip("array_api_compat")
    # SciPy reads its own switch when it is imported.
    environment = {**os.environ, "SCIPY_ARRAY_API": "1"}
    script = WITH_DISPATCH.replace("LIBRARY", library)
    command = [sys.executable, "-W", "error::UserWarning", "-c", script]
    subprocess.run(command, env=environment, check=True)


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
