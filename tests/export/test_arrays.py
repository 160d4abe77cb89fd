"""The model's formula in the array API standard gives what the model gives."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis.export import arrays
from skanfis.export.arrays import predict_in

from .every_model import CASES, FEWEST, rows, size_of_sum

# Of the largest sum over rules: rounding, of some hundred operations.
TOLERANCE = {np.float64: 1e-12, np.float32: 3e-5}


@pytest.mark.parametrize("dtype", TOLERANCE)
@pytest.mark.parametrize("library", ["array_api_strict", "torch"])
def test_every_model(library, dtype, monkeypatch):
    xp = pytest.importorskip(library)
    if library == "torch":
        # Its own functions are not quite those of the standard; scikit-learn brings what is.
        xp = pytest.importorskip("sklearn.externals.array_api_compat.torch")
    monkeypatch.setattr(arrays, "LARGE_BLOCK_ROWS", 128)
    X = rows(dtype, 300)
    worst = {}
    # The same formula in either precision.
    for case in CASES if dtype is np.float64 else FEWEST:
        model = case.model
        if model.out_of_bounds == "raise":
            # Asked before, by whoever calls.
            model = model.with_out_of_bounds("clip")
        expected = model.predict(X.astype(float))
        found = np.asarray(predict_in(xp, model, xp.asarray(X)))
        assert found.dtype == dtype
        assert_array_equal(np.isnan(found), np.isnan(expected))
        difference = np.nanmax(np.abs(found - expected) / size_of_sum(model, X.astype(float)))
        worst[case.label] = difference
    late = {label: value for label, value in worst.items() if not value < TOLERANCE[dtype]}
    assert not late
