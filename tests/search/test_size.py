"""How many terms and rules: what is asked for, and errors before memory."""

import re
import tracemalloc

import numpy as np
import pytest
from sklearn import config_context
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.learning import VariableProjection
from skanfis.search import size
from skanfis.search.size import check_grid_fits, term_counts

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


def test_size_of_a_grid_is_not_far_from_what_training_takes(rng):
    X = rng.normal(size=(1000, 3))
    y = np.sin(X[:, 0]) + rng.normal(size=1000)
    solver = VariableProjection(stiffness=1.0, tol=0.5)
    estimator = ANFISRegressor(n_mfs=5, order=1, agreement=0.1, alpha=1e-3, solver=solver)
    tracemalloc.start()
    try:
        estimator.fit(X, y)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    expected = size.n_bytes(125, 15, n_basis=4, n_outputs=1)
    assert 0.3 * peak < expected < 3.0 * peak


def test_message_says_how_large_the_grid_is_and_what_to_do():
    names = [f"x{j}" for j in range(8)]
    with pytest.raises(ValueError, match="grid of 6,561 rules") as error:
        check_grid_fits(3, [3] * 8, 9, 1, GIB, names)
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
        check_grid_fits(2, [2] * 20, 21, 1, GIB, names)
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
    assert size._bytes(number) == text


@pytest.mark.parametrize("n_inputs", [400, 5000])
def test_grid_on_hundreds_of_inputs_is_refused_like_any_other(n_inputs):
    names = [f"x{j}" for j in range(n_inputs)]
    with pytest.raises(ValueError, match="makes a grid of"):
        check_grid_fits(3, [3] * n_inputs, 1 + n_inputs, 1, GIB, names)


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


@pytest.mark.parametrize("order", [0, 1])
def test_clusters_that_are_too_many_are_refused_before_memory_is_asked_for(rng, order):
    X, y = rng.normal(size=(400, 4)), rng.normal(size=400)
    clusterer = KMeans(200, n_init=1, max_iter=2, random_state=0)
    n_columns = 200 * (5 if order else 1)
    limit = 8 * n_columns**2 / 2**20  # one of the matrices that training takes
    tracemalloc.start()
    try:
        with (
            config_context(working_memory=limit),
            pytest.raises(
                ValueError, match=rf"200 rules with {n_columns:,} consequent .*Use fewer"
            ),
        ):
            ANFISRegressor(partition=clusterer, order=order).fit(X, y)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Clustering itself takes distances of all rows to all centres.
    assert peak < max(8 * n_columns**2, 8e6)
