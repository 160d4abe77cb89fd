"""Rows that no other row supports are named, and no others."""

import numpy as np
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro._checks import find_glitches


def simulated(seed, **options):
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=seed, **options)


def found(log):
    return [row for row, _ in find_glitches(log, (log["output"] - log["rate"]).to_numpy())]


@pytest.mark.parametrize(("part", "by"), [("output", 20.0), ("rate", -50.0), ("temperature", 40.0)])
def test_one_row_is_named(part, by):
    log, row = simulated(0), 77
    log.loc[row, part] += by
    assert found(log) == [row]


def test_three_rows_are_named_and_more_support_each_other():
    log = simulated(0)
    rows = [10, 100, 200, 300]
    for count in (2, 3):
        spoilt = log.copy()
        spoilt.loc[rows[:count], "output"] += 40.0
        assert found(spoilt) == rows[:count]
    log.loc[rows, "output"] += 40.0
    assert found(log) == []


def test_the_sentence_says_what_is_odd():
    log = simulated(0).assign(rate=0.0)
    log["output"] = 0.01 * np.random.default_rng(0).normal(size=len(log))
    log.loc[7, "output"] = 99.0
    log.loc[8, "temperature"] = 150.0
    odd, hot = find_glitches(log, log["output"].to_numpy())
    assert odd == (7, "the output of 99 at a rate of 0 deg/s")
    assert hot == (8, "the temperature of 150 degC")


@pytest.mark.parametrize(
    "options", [{}, {"profile": "ramps"}, {"profile": "ramps", "rates": [-100, 0, 100]}]
)
def test_sound_logs_have_none(options):
    log, g = simulated(0, **options), np.random.default_rng(0)
    assert found(log) == []
    # Digits lost, and noise of heavy tails.
    assert found(log.round({"temperature": 0, "output": 2})) == []
    assert found(log.assign(output=log["output"] + 0.05 * g.standard_t(3, len(log)))) == []
