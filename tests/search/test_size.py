"""How many terms and rules: what is asked for, and errors before memory."""

import numpy as np
import pytest
from sklearn import config_context
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.exceptions import ConstantInputWarning

from ..memory import traced


@pytest.mark.parametrize("order", [0, 1])
def test_clusters_that_are_too_many_are_refused_before_memory_is_asked_for(rng, order):
    X, y = rng.normal(size=(400, 4)), rng.normal(size=400)
    clusterer = KMeans(200, n_init=1, max_iter=2, random_state=0)
    n_columns = 200 * (5 if order else 1)
    limit = 8 * n_columns**2 / 2**20  # one of the matrices that training takes
    told = f"200 rules with {n_columns:,} conseq.*limit is {limit:,} MiB .*Use fewer"
    refused = pytest.raises(ValueError, match=told)
    with traced() as peak, config_context(working_memory=limit), refused:
        ANFISRegressor(partition=clusterer, order=order).fit(X, y)
    # Clustering itself takes distances of all rows to all centres.
    assert peak[0] < max(8 * n_columns**2, 8e6)


def test_more_columns_than_pairs_have_room_for_are_refused_at_once(rng):
    X = rng.normal(size=(30, 20_000))
    refused = pytest.raises(
        ValueError, match=r"X has 20,000 columns: .* 195,\d* MiB of memory, but"
    )
    with traced() as peak, refused:
        ANFISRegressor().fit(X, X[:, 0])
    assert peak[0] < 20 * X.nbytes


def test_of_many_constant_columns_ten_are_named(rng):
    X = np.zeros((30, 15))
    X[:, 0] = rng.normal(size=30)
    with pytest.warns(ConstantInputWarning, match=r"'x10' \(always 0\), and 4 more are const"):
        ANFISRegressor().fit(X, X[:, 0])
