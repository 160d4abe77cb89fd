"""A cubic in the place of the law as C, compiled, answers what Python answers, with its flags."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import export_c_physics
from skanfis.gyro._simpler import fitted_rule, kinds

from ..export.c_compiler import SANITIZE, UNTOUCHED, evaluate_all, needs_compiler

INPUTS = ("time", "temperature", "temperature_rate", "output")


def cubic_of(X, log, policy):
    *_, (_, _, fit) = kinds(list(X), policy)
    return fit(
        X, (log["output"] - log["rate"]).to_numpy(), fitted_rule(X, np.zeros(len(X)), 0, policy)
    )


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
    estimator = cubic_of(X, log, policy)
    low, high = X.min().to_numpy(), X.max().to_numpy()
    rng = np.random.default_rng(0)
    reach = rng.choice([1.0, 1.5], 3000)[:, None]
    rows = low + (high - low) * (0.5 + reach * rng.uniform(-0.5, 0.5, (3000, 4)))
    rows = rows.astype(np.float32 if dtype == "float" else float)
    code = export_c_physics(estimator, tmp_path / "gyro", dtype=dtype, std=std)
    flags = SANITIZE if policy == "linear" else []
    [(y, status)] = evaluate_all([code], rows, tmp_path, std, [1], flags)
    table = pd.DataFrame(rows.astype(float), columns=INPUTS)
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
    assert "A polynomial of the third degree with 35 terms" in code.header


@needs_compiler
def test_its_header_is_told_and_rows_that_are_not_finite_get_no_output(tmp_path):
    log = make_ofog(n_devices=1, n_runs=3, duration=600.0, random_state=0)
    X = log[["temperature", "output"]]
    estimator = cubic_of(X, log, "clip")
    said = {"units": {"temperature": "degC"}, "notes": ["Subtract y[0]."]}
    code = export_c_physics(estimator, tmp_path / "gyro", std="c99", **said)
    assert " * Subtract y[0].\n" in code.header
    assert "[0] temperature [degC]: " in code.header
    rows = np.vstack([X.to_numpy(), [[np.nan, 0.0], [20.0, np.inf]]])
    [(y, status)] = evaluate_all([code], rows, tmp_path, "c99", [1], [])
    np.testing.assert_allclose(y[:-2, 0], estimator.predict(X), atol=1e-12)
    assert (status[-2:] & 2 == 2).all()
    assert (y[-2:] == UNTOUCHED).all()
