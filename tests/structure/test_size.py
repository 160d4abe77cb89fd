"""How many terms and rules: errors before memory, counts that stop early, sizes by "auto"."""

import re
import tracemalloc

import numpy as np
import pytest
from sklearn import config_context

from skanfis import ANFISRegressor
from skanfis.structure import (
    GridSize,
    count_distinct_inputs,
    structure,
    term_counts,
)
from skanfis.rows import Rows

NAMES = ["time", "temperature", "rate"]
GIB = 2**30


@pytest.mark.parametrize(
    ("n_mfs", "counts"),
    [
        (2, [2, 2, 2]),
        (np.int64(4), [4, 4, 4]),
        ([4, 1, 2], [4, 1, 2]),
        ((4, 1, 2), [4, 1, 2]),
        (np.array([4, 1, 2]), [4, 1, 2]),
        (1, [1, 1, 1]),
    ],
)
def test_term_counts_are_one_per_input(n_mfs, counts):
    found = term_counts(n_mfs, NAMES)
    assert found == counts
    assert all(type(count) is int for count in found)


@pytest.mark.parametrize(
    ("n_mfs", "error", "message"),
    [
        (
            [2, 3],
            ValueError,
            "n_mfs=[2, 3] has 2 entries, but X has 3 columns (time, temperature, rate)",
        ),
        ([2, 3, 4, 5], ValueError, "has 4 entries, but X has 3 columns"),
        ([], ValueError, "has 0 entries, but X has 3 columns"),
        (0, ValueError, "n_mfs=0 must be 1 or more everywhere"),
        (-2, ValueError, "n_mfs=-2 must be 1 or more everywhere"),
        ([2, 0, 2], ValueError, "n_mfs=[2, 0, 2] must be 1 or more everywhere"),
        (
            2.0,
            TypeError,
            "n_mfs=2.0 must be 'auto', a whole number, or one whole number per input.",
        ),
        ("two", TypeError, "n_mfs='two' must be 'auto', a whole number"),
        (True, TypeError, "n_mfs=True must be 'auto', a whole number"),
        (None, TypeError, "n_mfs=None must be 'auto', a whole number"),
        ([[2, 2, 2]], TypeError, "n_mfs=[[2, 2, 2]] must be 'auto', a whole number"),
        ([2, 2.5, 2], TypeError, "n_mfs=[2, 2.5, 2] must hold whole numbers only."),
        ([2, True, 2], TypeError, "n_mfs=[2, True, 2] must hold whole numbers only."),
        ([2, "3", 2], TypeError, "n_mfs=[2, '3', 2] must hold whole numbers only."),
    ],
)
def test_impossible_term_counts_are_named(n_mfs, error, message):
    with pytest.raises(error, match=re.escape(message)):
        term_counts(n_mfs, NAMES)


def test_size_of_a_grid_is_that_of_its_matrices():
    size = GridSize([4, 1, 2], n_basis=4, n_outputs=3)
    assert size.n_rules == 8
    assert size.n_columns == 32
    # At least the Gram matrix and its factor.
    assert size.n_bytes >= 2 * 8 * 32**2


def test_size_of_a_grid_is_not_far_from_what_training_takes(rng):
    X = rng.normal(size=(1000, 3))
    y = np.sin(X[:, 0]) + rng.normal(size=1000)
    estimator = ANFISRegressor(n_mfs=6, order=1, alpha=1e-3, stiffness=1.0, tol=0.5)
    tracemalloc.start()
    try:
        estimator.fit(X, y)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    expected = GridSize([6, 6, 6], n_basis=4).n_bytes
    assert 0.3 * peak < expected < 3.0 * peak


def test_grid_that_fits_passes_in_silence():
    GridSize([3, 3, 3], n_basis=4).check_fits(3, GIB, NAMES)
    size = GridSize([3, 3, 3], n_basis=4)
    size.check_fits(3, size.n_bytes, NAMES)
    with pytest.raises(ValueError, match="makes a grid of 27 rules"):
        size.check_fits(3, size.n_bytes - 1, NAMES)


def test_message_says_how_large_the_grid_is_and_what_to_do():
    names = [f"x{j}" for j in range(8)]
    with pytest.raises(ValueError, match="grid of 6,561 rules") as error:
        GridSize([3] * 8, n_basis=9).check_fits(3, GIB, names)
    message = str(error.value)
    assert message.startswith("n_mfs=3 on 8 inputs makes a grid of 6,561 rules with 59,049 ")
    assert "and the limit is 1.07 GB" in message
    assert "n_mfs=2 makes 256 rules" in message
    assert "partition=KMeans(" in message
    # 8 bytes for each entry of a few matrices of side 59,049
    gigabytes = float(re.search(r"it would take ([\d.]+) GB", message)[1])
    assert 2 * 8 * 59_049**2 < gigabytes * 1e9 < 20 * 8 * 59_049**2


def test_hint_at_two_terms_is_not_given_where_two_are_too_many():
    names = [f"x{j}" for j in range(20)]
    with pytest.raises(ValueError, match="grid of 1,048,576 rules") as error:
        GridSize([2] * 20, n_basis=21).check_fits(2, GIB, names)
    assert "n_mfs=2 makes" not in str(error.value)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (999, "999 bytes"),
        (1000, "1 kB"),
        (1.074e9, "1.07 GB"),
        (2.5e13, "25 TB"),
        (3e15, "3 PB"),
        (10**22, "more than 10^18 bytes"),
    ],
)
def test_bytes_are_told_in_units_that_can_be_read(number, text):
    assert structure._bytes(number) == text


@pytest.mark.parametrize("n_inputs", [400, 5000])
def test_grid_on_hundreds_of_inputs_is_refused_like_any_other(n_inputs):
    names = [f"x{j}" for j in range(n_inputs)]
    with pytest.raises(ValueError, match="makes a grid of"):
        GridSize([3] * n_inputs, n_basis=1 + n_inputs).check_fits(3, GIB, names)


def test_grid_that_is_too_large_is_refused_before_memory_is_asked_for(rng):
    X, y = rng.normal(size=(200, 10)), rng.normal(size=200)
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="grid of 59,049 rules"):
            ANFISRegressor(n_mfs=3).fit(X, y)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2e6


def test_limit_is_that_of_scikit_learn(rng):
    X, y = rng.normal(size=(500, 3)), rng.normal(size=500)
    with config_context(working_memory=0.05), pytest.raises(ValueError, match=r"limit is 52\.4 kB"):
        ANFISRegressor(n_mfs=2).fit(X, y)


def rows_of(X):
    return Rows.standardised(X, np.arange(len(X), dtype=float)[:, None])


@pytest.mark.parametrize("n_rows", [60, 3 * structure._READ_ROWS])
def test_distinct_inputs_are_counted_whatever_their_order(rng, n_rows):
    distinct = rng.normal(size=(50, 3)) * [1.0, 1e6, 1e-6] + 1e3
    X = distinct[rng.permutation(np.arange(n_rows) % 50)]
    assert count_distinct_inputs(rows_of(X), 10_000) == 50


def test_rows_that_differ_in_the_last_digits_of_one_input_are_distinct(rng):
    X = np.tile(rng.normal(size=3), (40, 1))
    X[:, 1] += 1e-9 * np.arange(40)
    assert count_distinct_inputs(rows_of(X), 1000) == 40


def test_counting_stops_as_soon_as_there_are_enough(rng):
    n = structure._READ_ROWS
    X = np.vstack([rng.normal(size=(n, 2)), np.zeros((2 * n, 2))])
    rows, read = rows_of(X), []

    class Noting:
        n_rows, X = rows.n_rows, rows.X

        def read(self, part):
            read.append(part.start)
            return rows.read(part)

    assert count_distinct_inputs(Noting(), 100) == 100
    assert read == [0]
    assert count_distinct_inputs(Noting(), n) == n
    assert read == [0, 0]
    assert count_distinct_inputs(Noting(), n + 2) == n + 1
    assert read == [0, 0, 0, n, 2 * n]
