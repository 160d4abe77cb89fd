"""Terms are grown where they pay, and no further."""

import numpy as np
import pytest

from skanfis.gyro._structure import grow_terms, held_out_rms


def test_grows_the_input_that_pays_most_and_stops_when_none_does():
    needed = np.array([1, 3, 2])

    def score(terms):
        return 1.0 + np.maximum(needed - np.array(terms), 0) @ [1.0, 2.0, 3.0]

    told = []
    terms, tried = grow_terms(score, 3, 36, told.append)
    assert terms == [1, 3, 2]
    assert len(told) == 3
    assert tried[0] == ((1, 1, 1), 8.0)
    # Three candidates for each of three steps taken, and for one that was not.
    assert len(tried) == 1 + 4 * 3


def test_keeps_to_the_most_rules():
    terms, tried = grow_terms(lambda terms: 1.0 / np.prod(terms), 2, 5, lambda text: None)
    assert np.prod(terms) <= 5
    assert max(np.prod(candidate) for candidate, _ in tried) <= 5


def test_a_small_gain_is_no_gain():
    terms, _ = grow_terms(lambda terms: 1.0 - 0.01 * sum(terms), 2, 9, lambda text: None)
    assert terms == [1, 1]


def test_rms_is_over_all_folds_and_the_rows_in_bounds():
    errors = {1: ([3.0, 100.0], [True, False]), 2: ([4.0, 5.0, 0.0], [True, False, True])}

    def fold(train, test):
        return tuple(np.array(part) for part in errors[test])

    assert held_out_rms(fold, [(None, 1), (None, 2)]) == pytest.approx(np.sqrt(25.0 / 3.0))
    assert held_out_rms(fold, []) == np.inf
