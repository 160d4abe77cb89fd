"""What both clusterers have to do, whatever the order of the rows, and what they refuse."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal
from sklearn.base import clone

from skanfis.cluster import FuzzyCMeans, SubtractiveClustering

BOTH = pytest.mark.parametrize(
    "clusterer",
    [SubtractiveClustering(0.3), FuzzyCMeans(4, m=1.5, random_state=0)],
    ids=["subtractive", "fcm"],
)


@BOTH
def test_order_and_repetition_of_rows_change_no_bit(clusterer, rng):
    X, weight = rng.normal(size=(100, 3)), rng.integers(0, 4, 100)
    X[weight == 0] *= 100.0  # rows that are not there stretch no range
    order = rng.permutation(100)
    weighted = clone(clusterer).fit(X, sample_weight=weight)
    turned = clone(clusterer).fit(X[order], sample_weight=weight[order])
    repeated = clone(clusterer).fit(np.repeat(X, weight, axis=0))
    for found in (turned, repeated):
        assert_array_equal(found.cluster_centers_, weighted.cluster_centers_)
        assert_array_equal(found.predict(X), weighted.labels_)
    assert_array_equal(turned.labels_, weighted.labels_[order])


@BOTH
def test_errors_name_the_row_and_the_column(clusterer, rng):
    X = rng.normal(size=(10, 2))
    fitted = clone(clusterer).fit(X)
    bad = np.where(np.arange(20).reshape(10, 2) == 7, np.nan, X)
    for method in (clone(clusterer).fit, fitted.predict):
        with pytest.raises(ValueError, match="X contains NaN in column 'x1', first at row 3"):
            method(bad)
    with pytest.raises(ValueError, match="X holds text in column 'b', first at row 0"):
        clone(clusterer).fit(pd.DataFrame(X, columns=["a", "b"]).assign(b="warm"))
    with pytest.raises(ValueError, match="Negative values in sample_weight: -2 at row 1"):
        clone(clusterer).fit(X, sample_weight=[1, -2, *[1] * 8])
    with pytest.raises(ValueError, match=r"weight.*zero"):
        clone(clusterer).fit(X, sample_weight=np.zeros(10))


@BOTH
def test_fit_that_fails_or_is_interrupted_leaves_the_one_before(clusterer, rng, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    X = rng.normal(size=(50, 2))
    fitted = clone(clusterer).fit(X)
    before = vars(fitted).copy()
    with pytest.raises(ValueError, match=r"weight.*zero"):
        fitted.fit(X[:, :1], sample_weight=0.0)
    assert vars(fitted) == before
    for where in ("subtractive.potentials", "fuzzy_cmeans.descend", "_rows.nearest"):
        monkeypatch.setattr(f"skanfis.cluster.{where}", interrupt)
    with pytest.raises(KeyboardInterrupt):
        fitted.fit(100.0 * X)
    assert vars(fitted) == before


@pytest.mark.parametrize(
    ("clusterer", "message"),
    [
        (FuzzyCMeans(m=1.0), "'m' parameter"),
        (FuzzyCMeans(init=np.zeros((2, 2))), r"init has shape \(2, 2\), not \(3, 2\)"),
        (FuzzyCMeans(init=np.full((3, 2), np.nan)), "init contains NaN"),
        (FuzzyCMeans(11), "n_clusters=11 needs as many distinct rows .* but there are 10"),
        (SubtractiveClustering(0.0), "'radius' parameter"),
        (SubtractiveClustering([0.5]), r"radius has shape \(1,\), not \(2,\)"),
        (SubtractiveClustering([0.5, -1.0]), "must be positive and finite"),
        (SubtractiveClustering(accept=0.1), "reject=0.15 must not exceed accept=0.1"),
    ],
)
def test_bad_parameters_are_refused(rng, clusterer, message):
    with pytest.raises(ValueError, match=message):
        clusterer.fit(rng.normal(size=(10, 2)))
