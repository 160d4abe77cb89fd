"""Rate levels found, groups that scikit-learn's splitters take, and splits that leak."""

import warnings

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.ensemble import RandomForestRegressor
from sklearn.model_selection import (
    GroupKFold,
    LeaveOneGroupOut,
    ShuffleSplit,
    cross_val_predict,
)

from skanfis.datasets import make_ofog
from skanfis.exceptions import SplitLeakWarning
from skanfis.gyro import (
    check_split,
    find_rate_levels,
    group_by_rate_level,
    group_by_run,
)

GRID = np.linspace(-100.8, 100.8, 57)  # steps of 3.6 deg/s
UNEVEN = np.array([-100.0, -30, -10, -3, -1, -0.3, 0, 0.3, 1, 3, 10, 30, 100])
FINE = np.linspace(-100, 100, 401)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("noise", [0.0, 1e-9, 0.01])
@pytest.mark.parametrize("levels", [GRID, UNEVEN, FINE], ids=["grid", "uneven", "fine"])
def test_levels_are_found_whatever_their_spacing_noise_and_unit(levels, noise, unit, rng):
    true = rng.permutation(np.repeat(levels, 50))
    rate = unit * (true + rng.normal(scale=noise, size=true.size))
    found = find_rate_levels(rate)
    assert_allclose(found, unit * levels, atol=unit * (0.7 * noise + 1e-9))
    groups = group_by_rate_level(rate, signed=True)
    assert_array_equal(groups, np.searchsorted(levels, true))


def test_rows_on_the_way_between_levels_count_to_the_nearest(rng):
    # A fifth of the rows, as with a sluggish table.
    way = rng.uniform(-100.8, 100.8, 1500)
    rate = np.concatenate([np.repeat(GRID, 100), way])
    assert_allclose(find_rate_levels(rate), GRID, atol=0.01)
    expected = np.abs(rate[:, None] - GRID).argmin(axis=1)
    assert_array_equal(group_by_rate_level(rate, signed=True), expected)


def test_one_level_is_a_level():
    assert find_rate_levels(np.zeros(9)).tolist() == [0.0]
    assert find_rate_levels([38.69, 38.69, 38.69]).tolist() == pytest.approx([38.69])
    assert find_rate_levels([7.0]).tolist() == [7.0]
    at_rest = np.random.default_rng(0).normal(scale=1e-3, size=500)
    assert find_rate_levels(at_rest, tolerance=0.01) == pytest.approx([0.0], abs=1e-3)


def test_tolerance_decides_where_it_is_given():
    rate = np.array([0.0, 0.4, 0.8, 5.0, 5.3])
    assert_allclose(find_rate_levels(rate, tolerance=0.5), [0.4, 5.15])
    assert_allclose(find_rate_levels(rate, tolerance=0.35), [0.0, 0.4, 0.8, 5.15])
    for tolerance in (0.0, -1.0, float("nan"), "0.1"):
        with pytest.raises(ValueError, match="must be a positive number"):
            find_rate_levels(rate, tolerance=tolerance)


@pytest.mark.parametrize(
    "rate",
    [
        np.random.default_rng(0).uniform(-100, 100, 1500),
        np.random.default_rng(0).uniform(-100, 100, 5000),
        np.random.default_rng(0).uniform(-100, 100, 15_000),
        np.random.default_rng(0).uniform(-100, 100, 500_000),
        100 * np.sin(np.arange(100_000) / 5000.0),
        np.random.default_rng(0).normal(size=100_000),
    ],
    ids=["1500", "5000", "15000", "500000", "sine", "normal"],
)
def test_a_rate_that_changes_continuously_has_no_levels(rate):
    with pytest.raises(ValueError, match=r"no levels: it changes continuously between -"):
        find_rate_levels(rate)
    with pytest.raises(ValueError, match="no levels"):
        group_by_rate_level(rate)


def test_opposite_rates_are_one_level_unless_signed():
    rate = np.tile(GRID, 3)
    groups = group_by_rate_level(rate)
    assert_array_equal(groups, np.rint(np.abs(rate) / 3.6))
    assert group_by_rate_level(rate, signed=True).max() == 56


def test_levels_are_dealt_out_by_turns():
    rate = np.tile(GRID, 3)
    groups = group_by_rate_level(rate, n_groups=5)
    assert_array_equal(groups, np.rint(np.abs(rate) / 3.6).astype(int) % 5)
    # Every group reaches over the whole range.
    reach = pd.Series(np.abs(rate)).groupby(groups).agg(["min", "max"])
    assert reach["min"].max() < 20
    assert reach["max"].min() > 85
    with pytest.raises(ValueError, match=r"n_groups=30: the rate has no more than 29 levels"):
        group_by_rate_level(rate, n_groups=30)
    with pytest.raises(ValueError, match="n_groups == 1, must be >= 2"):
        group_by_rate_level(rate, n_groups=1)


def test_runs_begin_where_the_clock_goes_back_or_stands_long():
    assert group_by_run([5.0, 6, 7]).tolist() == [0, 0, 0]
    assert group_by_run([5.0, 6, 2, 3, 1]).tolist() == [0, 0, 1, 1, 2]
    assert group_by_run([0.0, 1, 2, 60, 61], max_gap=10.0).tolist() == [0, 0, 0, 1, 1]
    data = make_ofog(n_devices=2, n_runs=2, n_power_ups=3, duration=300.0, random_state=0)
    assert_array_equal(group_by_run(data["time"]), data["power_up"])
    with pytest.raises(ValueError, match="max_gap=0 must be a positive number"):
        group_by_run([0.0, 1.0], max_gap=0)
    with pytest.raises(ValueError, match="time must be finite; 1 of its 2"):
        group_by_run([0.0, np.nan])


@pytest.fixture(scope="module")
def table_data():
    """One gyro on a table that turns at 21 levels in every run."""
    return make_ofog(n_devices=1, n_runs=6, n_rate_levels=21, dwell_time=60.0, random_state=0)


def test_a_split_by_run_shares_the_levels_of_the_table(table_data):
    with pytest.warns(SplitLeakWarning, match="6 of 6 splits test at rate levels .* 100% of"):
        report = check_split(GroupKFold(6), table_data["rate"], groups=table_data["run"])
    assert set(report["shared_levels"]) == {21}
    assert set(report["on_shared_levels"]) == {1.0}
    assert_array_equal(report["n_train"] + report["n_test"], len(table_data))


def test_a_split_by_level_shares_the_runs(table_data):
    groups = group_by_rate_level(table_data["rate"], n_groups=5)
    split = {"cv": LeaveOneGroupOut(), "rate": table_data["rate"], "groups": groups}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = check_split(**split)
    assert list(report.columns) == ["n_train", "n_test", "shared_levels", "on_shared_levels"]
    assert not report["on_shared_levels"].any()
    with pytest.warns(SplitLeakWarning, match="5 of 5 splits test on runs that they train on"):
        report = check_split(**split, run=table_data["run"])
    assert set(report["shared_runs"]) == {6}
    assert set(report["in_shared_runs"]) == {1.0}


@pytest.mark.parametrize("n_rows", [100, 1000, 100_000])
def test_a_continuous_rate_shares_no_levels_however_it_is_split(n_rows, rng):
    rate = rng.uniform(-100, 100, n_rows)
    # That it warns of nothing is part of it: a warning is an error here.
    report = check_split(ShuffleSplit(2, random_state=0), rate)
    assert report["on_shared_levels"].max() <= 0.1
    with pytest.warns(SplitLeakWarning, match="2 of 2 splits test on runs"):
        check_split(ShuffleSplit(2, random_state=0), rate, run=np.arange(n_rows) % 2)


def test_splits_may_be_given_as_scikit_learn_takes_them(table_data):
    rate = table_data["rate"]
    middle = len(rate) // 2
    with pytest.warns(SplitLeakWarning, match="1 of 1 splits"):
        report = check_split([(np.arange(middle), np.arange(middle, len(rate)))], rate)
    assert report[["n_train", "n_test"]].to_numpy().tolist() == [[middle, len(rate) - middle]]
    with pytest.warns(SplitLeakWarning, match="5 of 5 splits"):
        assert len(check_split(5, rate)) == 5
    with pytest.raises(ValueError, match="run has 2 rows where the other columns have"):
        check_split(5, rate, run=[1, 2])
    with pytest.raises(ValueError, match="run has missing values, the first at row 0"):
        check_split(5, rate, run=[None] * len(rate))


@pytest.mark.theory
def test_the_trap_is_real():
    # A forest memorises the list of levels: runs held out, it seems hundreds of times better
    # than it is between the levels.
    data = make_ofog(n_devices=1, n_runs=10, n_rate_levels=29, dwell_time=60.0, random_state=0)
    X, rate = data[["output", "temperature"]], data["rate"]
    forest = RandomForestRegressor(30, random_state=0)
    residual = {
        name: (rate - cross_val_predict(forest, X, rate, groups=groups, cv=GroupKFold(5)))
        for name, groups in (("run", data["run"]), ("level", group_by_rate_level(rate)))
    }
    inner = rate.abs() < rate.abs().max()
    by_run, by_level = (np.sqrt(np.mean(residual[name][inner] ** 2)) for name in ("run", "level"))
    assert by_run < 0.1
    assert by_level > 1.0
