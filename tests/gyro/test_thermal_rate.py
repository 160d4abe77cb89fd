"""Thermal features: closed forms, the recursion in C, causality, runs."""

import ctypes
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

from skanfis.gyro import ThermalRate

from ..export.c_compiler import gcc, needs_compiler


@pytest.fixture
def log(rng):
    """Three runs whose rows are mixed, with unequal steps of time."""
    runs = []
    for name, n_rows in (("b", 40), ("a", 25), ("c", 1)):
        time = 1000 * rng.random() + np.cumsum(rng.uniform(0.5, 20.0, n_rows))
        temperature = 20 + np.cumsum(rng.normal(size=n_rows))
        runs.append(pd.DataFrame({"t": time, "T": temperature, "run": name, "other": time**2}))
    log = pd.concat(runs, ignore_index=True)
    # The runs by turns, each in its own order.
    return log.iloc[np.argsort(log.groupby("run").cumcount(), kind="stable")]


@pytest.mark.parametrize("steps", [np.full(200, 3.0), np.geomspace(0.01, 50, 200)])
def test_rate_of_a_ramp_comes_up_with_the_time_constant(steps):
    time = np.cumsum(steps)
    X = np.column_stack([time, 5.0 - 0.02 * time])
    rate = ThermalRate(30.0, time=0).fit_transform(X).ravel()
    assert_allclose(rate, -0.02 * (1 - np.exp(-(time - time[0]) / 30)), rtol=1e-9)


@pytest.mark.parametrize("convert", [pd.to_timedelta, pd.to_datetime])
def test_dates_and_durations_are_no_times_in_seconds(log, convert):
    """NumPy would make them microseconds, and every rate a million times too small."""
    log = log.assign(t=convert(log["t"], unit="s"))
    with pytest.raises(ValueError, match=r"'t' \(time\) must hold numbers, not .* seconds\."):
        ThermalRate(30.0, time="t", run="run").fit(log[["t", "T", "run"]])


@needs_compiler
def test_the_lines_in_c_give_the_same(log, tmp_path):
    page = Path(__file__).parents[2] / "docs" / "gyro_data.rst"
    lines = page.read_text(encoding="utf-8").partition("code-block:: c\n")[2].splitlines()
    update = "".join(line for line in lines if line.endswith(";"))
    assert update.count(";") == 2
    source = """
#include <math.h>
void rates(const double *t, const double *T, double *rates, int n)
{
    double tau = 33.0, rate = 0.0, previous = T[0];
    for (int k = 1; k < n; ++k) {
        double h = t[k] - t[k - 1], temperature = T[k];
        UPDATE
        rates[k] = rate;
    }
}
"""
    (tmp_path / "rates.c").write_text(source.replace("UPDATE", update), encoding="utf-8")
    gcc(["-shared", "-fPIC", "rates.c", "-o", "rates.so", "-lm"], tmp_path)
    function = ctypes.CDLL(str(tmp_path / "rates.so")).rates
    function.argtypes = [*[np.ctypeslib.ndpointer(float)] * 3, ctypes.c_int]
    columns = log.loc[log["run"] == "b", ["t", "T"]].to_numpy()
    found = np.zeros(len(columns))
    function(*columns.T.copy(), found, len(found))
    assert_allclose(found, ThermalRate(33.0, time=0).fit_transform(columns).ravel(), rtol=1e-12)


FEATURE = ThermalRate(20.0, time="t", run="run")


def test_runs_do_not_know_of_each_other(log):
    features = clone(FEATURE).fit_transform(log)
    for _, rows in log.reset_index(drop=True).groupby("run"):
        assert_array_equal(clone(FEATURE).fit_transform(rows), features[rows.index])
        assert_array_equal(features[rows.index[0]], 0.0)


def test_frames_of_any_kind_and_arrays_give_the_same(log):
    columns = log[["t", "T", "run"]]
    features = clone(FEATURE).fit_transform(columns)
    polars = pl.DataFrame(columns.to_dict("list"))
    categorical = columns.assign(run=columns["run"].astype("category"))
    for frame in (polars, categorical):
        assert_array_equal(clone(FEATURE).fit_transform(frame), features)
    numbered = columns.assign(run=pd.factorize(columns["run"])[0]).to_numpy()
    by_position = clone(FEATURE).set_params(time=0, run=-1)
    assert_array_equal(by_position.fit_transform(numbered), features)


def test_new_columns_have_names_and_keep_the_index(log):
    feature = clone(FEATURE)
    made = feature.set_output(transform="pandas").fit_transform(log)
    assert list(made.columns) == ["T_rate", "other_rate"] == list(feature.get_feature_names_out())
    assert_array_equal(made.index, log.index)
    assert feature.n_features_in_ == 4
    with pytest.raises(ValueError, match="input_features"):
        feature.get_feature_names_out(["a", "b"])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"time_constant": 0.0}, "time_constant=0.0 must be a positive number"),
        ({"time_constant": np.inf}, "time_constant=inf must be a positive number"),
        ({"time_constant": "1 min"}, "time_constant='1 min' must be a positive"),
        ({"time": "seconds"}, r"time='seconds' is no column of X.* 4 feature\(s\): \['t', 'T'"),
        ({"time": 4}, "time=4 is no column of X, which has 4 feature"),
        ({"time": True}, "time=True is no column of X"),
        ({"run": "t"}, "time='t' and run='t' are one column"),
        ({"run": 2.5}, "run=2.5 is no column of X"),
        ({"run": None}, r"must increase .* at row \d+ it does not. Is this where a ru"),
    ],
)
def test_refuses_parameters_without_meaning(parameters, message, log):
    with pytest.raises(ValueError, match=message):
        clone(FEATURE).set_params(**parameters).fit(log)


def test_refuses_logs_that_cannot_be_filtered(log):
    feature, standing = clone(FEATURE), log.copy()
    previous, row = np.flatnonzero(log["run"] == "b")[4:6]
    standing.iloc[row, 0] = standing.iloc[previous, 0]
    with pytest.raises(ValueError, match=f"within a run; at row {row} it does not.$"):
        feature.fit(standing)
    with pytest.raises(ValueError, match=r"column 'T' must be finite; 1 of its 66 .* at row 3"):
        feature.fit(log.assign(T=np.where(np.arange(66) == 3, np.nan, log["T"])))
    with pytest.raises(ValueError, match="column 'other' must hold numbers"):
        feature.fit(log.assign(other="a"))
    with pytest.raises(ValueError, match=r"column 'run' \(run\) has missing values, .* at row 7"):
        feature.fit(log.assign(run=np.where(np.arange(66) == 7, None, log["run"])))
    with pytest.raises(ValueError, match="nothing to filter"):
        feature.fit(log[["t", "run"]])
    with pytest.raises(NotFittedError):
        clone(feature).transform(log)
    with pytest.raises(ValueError, match="feature names"):
        feature.fit(log).transform(log[["T", "t", "run", "other"]])


def test_a_fit_that_fails_leaves_the_columns_of_the_one_before(log):
    feature = clone(FEATURE).fit(log)
    before = feature.transform(log)
    with pytest.raises(ValueError, match="must increase"):
        feature.fit(log[["other", "run", "T", "t"]].assign(t=1.0))
    assert_array_equal(feature.transform(log), before)
