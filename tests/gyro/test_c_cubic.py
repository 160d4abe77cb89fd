"""A cubic in the place of the law as C, compiled, answers what Python answers, with its flags."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import export_c_physics

from ..export.c_compiler import SANITIZE, UNTOUCHED, evaluate_all, needs_compiler
from .targets.models import polynomial

INPUTS = ("time", "temperature", "temperature_rate", "output")


@needs_compiler
@pytest.mark.parametrize(
    ("policy", "dtype", "std", "tolerance"),
    [
        ("linear", "double", "c99", 1e-12),
        ("linear", "float", "c89", 2e-5),
        ("clip", "double", "c89", 1e-12),
        ("nan", "double", "c99", 1e-12),
    ],
)
def test_answers_as_python(tmp_path, policy, dtype, std, tolerance):
    log = make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=0)
    X = log[list(INPUTS)]
    estimator = polynomial(X, (log["output"] - log["rate"]).to_numpy(), policy)
    low, high = X.min().to_numpy(), X.max().to_numpy()
    rng = np.random.default_rng(0)
    reach = rng.choice([1.0, 1.5], 3000)[:, None]
    rows = low + (high - low) * (0.5 + reach * rng.uniform(-0.5, 0.5, (3000, 4)))
    rows[:2] = [np.nan, 0.0, 0.0, 0.0], [0.0, 20.0, 0.0, np.inf]
    rows = rows.astype(np.float32 if dtype == "float" else float)
    said = {"units": {"temperature": "degC"}, "notes": ["Subtract y[0]."]}
    code = export_c_physics(estimator, tmp_path / "gyro", dtype=dtype, std=std, **said)
    flags = SANITIZE if policy == "linear" else []
    [(y, status)] = evaluate_all([code], rows, tmp_path, std, [1], flags)
    # What is not finite gets no output.
    assert (status[:2] == 2 + 8).all()
    none = np.nan if policy == "nan" else UNTOUCHED
    np.testing.assert_array_equal(y[:2, 0], none)
    y, status = y[2:], status[2:]
    table = pd.DataFrame(rows[2:].astype(float), columns=INPUTS)
    error, coverage = estimator.predict(table), estimator.coverage(table)
    answered = np.isfinite(error)
    told = np.where(answered, 4 * (coverage < 0.1), 8) + ~estimator.in_bounds(table)
    sure = np.abs(coverage - 0.1) > 1e-3
    assert {0, 9 if policy == "nan" else 1} <= set(status)
    np.testing.assert_array_equal(status[sure], told[sure])
    assert answered.all() == (policy != "nan")
    size = np.abs(error[answered]).max()
    np.testing.assert_allclose(y[answered, 0] / size, error[answered] / size, atol=tolerance)
    assert np.isnan(y[~answered]).all()
    for told in ("A polynomial of the third degree with 35 terms", " * Subtract y[0].\n"):
        assert told in code.header
    assert "[1] temperature [degC]: " in code.header
