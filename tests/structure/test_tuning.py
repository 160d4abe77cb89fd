"""Weights and premises in turns: what is taken for noise, and what is found instead."""

import numpy as np

from skanfis.membership import Gaussian
from skanfis.rows import Rows
from skanfis.structure import Spacing, grid_antecedent, tuning


def test_a_kink_that_was_taken_for_noise_is_found_with_the_premises_first(monkeypatch, rng):
    x = rng.uniform(-1.0, 1.0, (150, 1))
    rows = Rows.standardised(x, np.abs(x) + 1e-3 * rng.normal(size=(150, 1)))
    antecedent = grid_antecedent([Gaussian], [3], Spacing(rows), 0.6)

    def found():
        return tuning.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)

    start = found()
    assert not start.is_free
    # Now nothing beats the way in that finds the weights first.
    monkeypatch.setattr(tuning, "WORTHWHILE", np.inf)
    assert start.expected_error < 0.3 * found().expected_error
