"""Which rows are held out: what the log calls for, and no row twice."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import LogError, check_split
from skanfis.gyro._split import choose_split


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
        ({"n_devices": 1, "n_runs": 4, "n_rate_levels": 9}, "run+level"),
        ({"n_devices": 3, "n_runs": 1, "n_rate_levels": 9}, "device+level"),
        ({"n_devices": 1, "n_runs": 2, "n_rate_levels": 9}, "level"),
    ],
)
def test_choice(options, kind):
    log = log_of(**options)
    split = choose_split(log)
    assert split.kind == kind
    every_row_once(split, len(log))


def test_a_choice_never_leaks():
    log = log_of(n_devices=1, n_runs=4, n_rate_levels=9)
    split = choose_split(log)
    # SplitLeakWarning is an error here. Levels of one size and two signs are held out together.
    report = check_split(split.folds, log["rate"], run=log["run"])
    assert report["shared_levels"].max() == 0
    assert report["shared_runs"].max() == 0


def test_levels_do_not_matter_to_a_compensator_that_does_not_see_the_output():
    log = log_of(n_devices=1, n_runs=4, n_rate_levels=9)
    assert choose_split(log, uses_output=False).kind == "run"


def test_asked_for():
    log = log_of(n_devices=1, n_runs=4, n_rate_levels=9)
    split = choose_split(log, "run")
    assert len(split.folds) == 4
    assert "whole runs held out (4 runs, 4 folds; as asked for)" in split.sentence
    assert np.array_equal(split.labels, log["run"].astype(str))
    by_level = choose_split(log, "level")
    assert len(by_level.folds) == 5
    assert set(by_level.labels) == {f"|{level:g}| °/s" for level in (0, 25, 50, 75, 100)}


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("device", "cannot hold out by device: the log has no column"),
        ("run", r"cannot hold out by run: the log has 2 run\(s\), and at least 3"),
        ("level", "cannot hold out by level: the log has no rate levels"),
        ("auto", r"could not be checked: the log has 2 run\(s\), 0 rate levels"),
        ("auto", r"No column of the time was found, .* --columns time=NAME"),
    ],
)
def test_what_cannot_be_held_out_is_refused(kind, message):
    rate = np.random.default_rng(0).uniform(-100, 100, 60)
    log = pd.DataFrame({"rate": rate, "run": np.arange(60) % 2})
    with pytest.raises(LogError, match=message):
        choose_split(log, kind)
