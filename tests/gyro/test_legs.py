"""Legs of a thermal cycle: between the temperatures at which a chamber turned."""

from itertools import pairwise

import numpy as np
import pytest

from skanfis.gyro._split import _name_legs as name_legs
from skanfis.gyro._split import cut_legs, find_legs


def cycle(*turns, n_rows=400):
    """A temperature that goes from turn to turn, with noise."""
    legs = [np.linspace(a, b, n_rows, endpoint=False) for a, b in pairwise(turns)]
    noise = np.random.default_rng(0).normal(scale=0.2, size=n_rows * len(legs))
    return np.concatenate(legs) + noise


@pytest.mark.parametrize(
    "turns", [(25, -30, 60, -20, 25), (-30, 60, -30), (60, -30), (20, 21, -30, 60), (20, 20)]
)
def test_legs_are_those_of_the_chamber(turns):
    temperature = cycle(*turns)
    legs = find_legs(temperature)
    # A turn that is small beside the whole range is none.
    planted = [turn for turn in turns if turn != 21]
    n_legs = len(planted) - 1
    assert np.unique(legs).tolist() == list(range(n_legs))
    expected = np.repeat(np.arange(len(turns) - 1), 400)
    if 21 in turns:
        expected = np.maximum(expected - 1, 0)
    # A turning point is found within a few rows, as noise allows.
    assert np.mean(legs != expected) < 0.02


def test_every_run_has_legs_of_its_own_and_long_logs_are_thinned():
    one = cycle(20, 60, 20, n_rows=30_000)
    legs = find_legs(np.concatenate([one, one]), np.repeat(["b", "a"], one.size))
    assert np.bincount(legs).size == 4
    np.testing.assert_allclose(np.bincount(legs), 30_000, rtol=0.02)


def test_pieces_leave_each_temperature_to_the_other_direction():
    temperature = cycle(-30, 60, -30)
    legs = find_legs(temperature)
    folds = cut_legs(legs)
    assert set(folds) == set(range(5))
    for fold in range(5):
        up, down = (temperature[(folds == fold) & (legs == leg)] for leg in (0, 1))
        if fold != 3:  # the bands of the one fold where both meet
            assert up.min() > down.max() - 2.0 or down.min() > up.max() - 2.0
    assert set(name_legs(legs, np.round(temperature, -1))) == {"1: -30 to 60 °C", "2: 60 to -30 °C"}
