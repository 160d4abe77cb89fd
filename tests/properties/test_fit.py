"""Whatever the data: a model that answers, or one sentence that names what is wrong."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skanfis import ANFISRegressor
from skanfis.exceptions import ConstantInputWarning, OutOfBoundsWarning, UnderdeterminedWarning
from skanfis.export import export_json
from skanfis.export.json_reader import parse_json
from skanfis.inspection import export_text

from .strategies import settings_of_fit, tables

# What NumPy and SciPy say where arithmetic has gone wrong.
RAW = re.compile("empty|SVD|singular|converge|zero-size|NaN|infs|operands|reduction|cannot reshape")


def fitted(table, settings):
    """A model, or None where the data are refused by a sentence of ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for expected in (ConstantInputWarning, OutOfBoundsWarning, UnderdeterminedWarning):
            warnings.simplefilter("ignore", expected)
        warnings.filterwarnings("ignore", category=Warning, message="solver=")
        try:
            return ANFISRegressor(**settings).fit(*table)
        except ValueError as error:
            if RAW.search(str(error)):
                raise
            return None


# What is drawn is not there to be read.
@pytest.mark.theory
@given(tables(), settings_of_fit, st.floats(1.0, 1e3))
def test_a_fit_is_no_worse_than_the_mean_answers_everywhere_and_comes_back(table, settings, reach):
    model = fitted(table, settings)
    if model is None:
        return
    weight = np.ones(len(table.y)) if table.sample_weight is None else table.sample_weight
    # NumPy 1.25 warns where it divides numbers below the normal ones.
    with np.errstate(over="ignore"):
        weight = weight / weight.max()
    kept = weight > 0.0
    X, size = table.X[kept], np.abs(table.y).max() or 1.0
    predicted = model.predict(X)
    assert np.isfinite(predicted).all()
    off, y = (predicted - table.y[kept]) / size, table.y[kept] / size
    mean = np.average(y, weights=weight[kept])
    error, spread = (np.average(e**2, weights=weight[kept]) for e in (off, y - mean))
    assert error <= 1.01 * spread + 1e-18
    frozen = model.model_
    half = 0.5 * (frozen.maximum - frozen.minimum)
    unit = np.random.default_rng(0).uniform(-reach, reach, (20, table.X.shape[1]))
    rows = frozen.minimum + half * (1.0 + unit)
    assert np.isfinite(frozen.with_out_of_bounds("clip").predict(rows)).all()
    strengths, coverage = frozen.strengths(rows), frozen.coverage(rows)
    np.testing.assert_allclose(strengths.sum(axis=1), 1.0, rtol=1e-9)
    assert ((coverage >= 0.0) & (coverage <= 1.0 + 1e-9)).all()
    assert export_text(model).count("\nRule ") == frozen.n_rules
    try:
        text = export_json(model)
    except ValueError as error:
        if "cannot write what read_json would refuse" not in str(error):
            raise
        return
    np.testing.assert_array_equal(parse_json(text).predict(rows), frozen.predict(rows))
