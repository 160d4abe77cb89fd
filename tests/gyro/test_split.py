"""Rate levels found, and which rows are held out: what the log calls for, and no row twice."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import make_ofog
from skanfis.gyro import LogError, group_by_rate_level
from skanfis.gyro._split import choose_split, find_legs, fold_numbers, level_numbers

GRID = np.linspace(-100.8, 100.8, 57)  # steps of 3.6 deg/s
UNEVEN = np.array([-100.0, -30, -10, -3, -1, -0.3, 0, 0.3, 1, 3, 10, 30, 100])
FINE = np.linspace(-100, 100, 401)
LEVELS = np.linspace(-100, 100, 9)


def levels_of(rate):
    """The median rate of each level."""
    groups = level_numbers(np.asarray(rate))
    return pd.Series(rate).groupby(groups).median().to_numpy()


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("noise", [0.0, 1e-9, 0.01])
@pytest.mark.parametrize("levels", [GRID, UNEVEN, FINE], ids=["grid", "uneven", "fine"])
def test_levels_are_found_whatever_their_spacing_noise_and_unit(levels, noise, unit, rng):
    true = rng.permutation(np.repeat(levels, 50))
    rate = unit * (true + rng.normal(scale=noise, size=true.size))
    found = levels_of(rate)
    assert_allclose(found, unit * levels, atol=unit * (0.7 * noise + 1e-9))
    groups = level_numbers(np.asarray(rate))
    assert_array_equal(groups, np.searchsorted(levels, true))


def test_rows_on_the_way_between_levels_count_to_the_nearest(rng):
    # A fifth of the rows, as with a sluggish table.
    way = rng.uniform(-100.8, 100.8, 1500)
    rate = np.concatenate([np.repeat(GRID, 100), way])
    assert_allclose(levels_of(rate), GRID, atol=0.01)
    expected = np.abs(rate[:, None] - GRID).argmin(axis=1)
    assert_array_equal(level_numbers(np.asarray(rate)), expected)


@pytest.mark.parametrize("rate", [[0.0] * 9, [38.69] * 3, [7.0]])
def test_one_level_is_a_level(rate):
    assert_allclose(levels_of(rate), rate[:1])


CONTINUOUS = {
    "few": lambda rng: rng.uniform(-100, 100, 1500),
    "many": lambda rng: rng.uniform(-100, 100, 500_000),
    "sine": lambda rng: 100 * np.sin(np.arange(100_000) / 5000.0),
    "normal": lambda rng: rng.normal(size=100_000),
    # Rows that are few: every one lies clear of the next.
    "short sine": lambda rng: 100 * np.sin(np.arange(300) / 50.0),
    "ramp": lambda rng: np.linspace(-100.0, 100.0, 1000),
}


@pytest.mark.parametrize("kind", CONTINUOUS)
def test_a_rate_that_changes_continuously_has_no_levels(kind, rng):
    with pytest.raises(ValueError, match=r"no levels: it changes continuously between -"):
        group_by_rate_level(CONTINUOUS[kind](rng))


def test_a_rate_and_its_opposite_are_one_level():
    rate = np.tile(GRID, 3)
    assert_array_equal(group_by_rate_level(rate), np.rint(np.abs(rate) / 3.6).astype(int))


def log_of(**options):
    return make_ofog(duration=1200.0, random_state=0, **options)


def every_row_once(split, n_rows):
    tested = np.concatenate([test for _, test in split.folds])
    assert np.array_equal(np.sort(tested), np.arange(n_rows))
    for train, test in split.folds:
        assert not np.intersect1d(train, test).size


@pytest.mark.parametrize(
    ("options", "kind"),
    [
        ({"n_devices": 1, "n_runs": 4}, "run"),
        ({"n_devices": 3, "n_runs": 2}, "device"),
        ({"n_devices": 2, "n_runs": 2}, "run"),
        ({"n_devices": 1, "n_runs": 4, "rates": LEVELS}, "run+level"),
        ({"n_devices": 3, "n_runs": 1, "rates": LEVELS}, "device+level"),
        ({"n_devices": 1, "n_runs": 2, "rates": LEVELS}, "level"),
    ],
)
def test_choice(options, kind):
    log = log_of(**options)
    split = choose_split(log)
    assert split.kind == kind
    assert ("a log of each device alone may leave less" in split.sentence) == ("device" in kind)
    every_row_once(split, len(log))


def test_a_rate_of_one_row_or_two_is_no_level():
    rate = np.repeat([10.0, 20, 30, 40, 50, 64, 77], [5, 5, 5, 5, 5, 1, 2])
    columns = {"rate": rate, "output": rate, "temperature": np.linspace(0.0, 50.0, rate.size)}
    split = choose_split(pd.DataFrame(columns), "level")
    assert "(5 levels, 5 folds" in split.sentence
    # Its rows go with the nearest.
    assert np.unique(split.labels, return_counts=True)[1].tolist() == [5, 5, 5, 5, 8]
    with pytest.raises(LogError, match="the log has 4 level"):
        choose_split(pd.DataFrame(columns)[5:], "level")


def test_asked_for_or_for_a_compensator_that_does_not_see_the_output():
    log = log_of(n_devices=1, n_runs=4, rates=LEVELS)
    assert choose_split(log, uses_output=False).kind == "run"
    split = choose_split(log, "run")
    assert "whole runs held out (4 runs, 4 folds; as asked for)" in split.sentence
    assert np.array_equal(split.labels, log["run"].astype(str))
    by_level = choose_split(log, "level")
    assert len(by_level.folds) == 5
    assert set(by_level.labels) == {f"|{level:g}| °/s" for level in (0, 25, 50, 75, 100)}


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("device", "--groups device: the log has no column"),
        ("run", r"--groups run: the log has 2 runs; to hold one out takes 3"),
        ("level", "--groups level: the log has no rate levels"),
        ("auto", r"could not be checked: the log has 2 runs, 0 rate levels"),
        ("auto", r"No column of the time was found, .* --columns time=NAME"),
    ],
)
def test_what_cannot_be_held_out_is_refused(kind, message):
    rate = np.random.default_rng(0).uniform(-100, 100, 60)
    log = pd.DataFrame({"rate": rate, "run": np.arange(60) % 2})
    with pytest.raises(LogError, match=message):
        choose_split(log, kind)


def cycle(*turns, n_rows=400):
    """A temperature that goes from turn to turn, with noise."""
    legs = [np.linspace(a, b, n_rows, endpoint=False) for a, b in pairwise(turns)]
    noise = np.random.default_rng(0).normal(scale=0.2, size=n_rows * len(legs))
    return np.concatenate(legs) + noise


@pytest.mark.parametrize(
    ("turns", "expected"),
    [
        ((25, -30, 60, -20, 25), [0, 1, 2, 3]),
        ((60, -30), [0]),
        # A turn that is small beside the whole range is none.
        ((20, 21, -30, 60), [0, 0, 1]),
        ((20, 20), [0]),
    ],
)
def test_legs_are_those_of_the_chamber(turns, expected):
    legs = find_legs(cycle(*turns))
    assert np.unique(legs).tolist() == np.unique(expected).tolist()
    # A turning point is found within a few rows, as noise allows.
    assert np.mean(legs != np.repeat(expected, 400)) < 0.02


def test_every_run_has_legs_of_its_own_and_rounding_makes_none():
    one = cycle(20, 60, 20, n_rows=30_000)
    legs = find_legs(np.concatenate([one, one]), np.repeat(["b", "a"], one.size))
    assert np.bincount(legs).size == 4
    np.testing.assert_allclose(np.bincount(legs), 30_000, rtol=0.02)
    # Soaks at which the last digit flickers.
    soaks = cycle(20, 20, 60, 60, 20, 20, 60).round()
    assert np.unique(find_legs(soaks)).tolist() == [0, 1, 2]
    # Of many rows some are looked at: of all, these would take minutes.
    long_soaks = cycle(20.5, 60.5, 60.5, 20.5, 20.5, 60.5, n_rows=100_000).round()
    assert np.unique(find_legs(long_soaks)).tolist() == [0, 1, 2]


def test_pieces_leave_each_temperature_to_the_other_direction():
    temperature = cycle(-30, 60, -30)
    legs = find_legs(temperature)
    folds = fold_numbers("piece", legs, 1)
    assert set(folds) == set(range(5))
    for fold in range(5):
        up, down = (temperature[(folds == fold) & (legs == leg)] for leg in (0, 1))
        if fold != 3:  # the bands of the one fold where both meet
            assert up.min() > down.max() - 2.0 or down.min() > up.max() - 2.0
    split = choose_split(pd.DataFrame({"temperature": np.round(temperature, -1), "rate": 0.0}))
    assert split.kind == "piece"
    # Five pieces of each leg, all of them groups.
    labels = list(dict.fromkeys(split.labels))
    assert len(labels) == 10
    assert labels[0].startswith("1: -30 to ")
    assert labels[-1].endswith(" to -30 °C")
    every_row_once(split, temperature.size)


def test_a_row_less_moves_no_other_row_to_another_fold():
    run = np.repeat(np.arange(12), 150)
    table = {"run": run, "temperature": np.tile(np.linspace(0.0, 40.0, 150), 12), "rate": 0.0}
    log = pd.DataFrame(table)

    def tested_with(log):
        found = np.empty(len(log), dtype=int)
        for number, (_, test) in enumerate(choose_split(log, "run").folds):
            found[test] = number
        return found

    whole = tested_with(log)
    for lost in (0, 700, 1799):
        less = tested_with(log.drop(index=lost).reset_index(drop=True))
        np.testing.assert_array_equal(less, np.delete(whole, lost))


@pytest.mark.parametrize(
    ("soaks", "most"),
    [((-20, 20, 60), "law-line"), ((-20, 0, 20, 40, 60), ""), ((-20, 60), "law-line")],
)
def test_temperatures_far_from_all_others_are_told(soaks, most, rng):
    """A cubic, or rules, may go any way between three soaks, and no row there is held out."""
    temperature = np.repeat(soaks, 90) + rng.normal(scale=0.1, size=90 * len(soaks))
    rate = rng.uniform(-100.0, 100.0, temperature.size)
    run = np.arange(temperature.size) % 3
    temperature[0] = 85.0  # a glitch is no soak
    split = choose_split(pd.DataFrame({"temperature": temperature, "rate": rate, "run": run}))
    assert split.most == most
    assert [told[:26] for told in split.cautions] == ["the log has no temperature"] * bool(most)
    assert all(told.endswith(" degC: the error there is not known.") for told in split.cautions)


@pytest.mark.parametrize(
    ("rates", "n_devices", "expected", "most"),
    [
        ([-50, 50], 1, [], ""),
        ([-50, 0, 50], 1, ["the table stood at only 2 rates"], "line"),
        ([-30, 0, 80, 100], 1, ["the table stood at only 4 rates"], "law-line"),
        (LEVELS, 1, [], ""),
        (LEVELS, 2, ["2 devices share a compensator"], ""),
        (LEVELS, 3, [], ""),
    ],
)
def test_too_few_levels_or_devices_to_hold_one_out_are_told(rates, n_devices, expected, most):
    n_runs = 4 if n_devices == 1 else 2
    kinds = {"n_devices": n_devices, "n_runs": n_runs, "rates": rates}
    log = make_ofog(**kinds, sampling_interval=60.0, random_state=0)
    split = choose_split(log.assign(run=log.groupby(["device", "run"]).ngroup()))
    assert ("level" in split.kind) == (rates is LEVELS)
    assert (len(split.cautions), split.most) == (len(expected), most)
    assert all(map(str.startswith, split.cautions, expected))
