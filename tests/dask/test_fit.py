"""Fits on dask collections are those of one process, and rows stay where they are."""

import pickle
from copy import copy
from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import KMeans
from sklearn.metrics import r2_score

pytest.importorskip("dask")

import dask
import dask.array as da
import dask.dataframe as dd

from skanfis import ANFISRegressor
from skanfis.dask import DaskANFISRegressor, rows
from skanfis.inspection import effects
from skanfis.learning import sampling

N_ROWS = 6000
NAMES = ["temperature", "rate"]


@pytest.fixture(autouse=True)
def one_thread():
    with dask.config.set(scheduler="synchronous"):
        yield


@pytest.fixture
def few_are_many(monkeypatch):
    monkeypatch.setattr(sampling, "MANY_ROWS", N_ROWS - 1)
    monkeypatch.setattr(sampling, "SAMPLE_ROWS", 1500)


def data(n_rows=N_ROWS):
    g = np.random.default_rng(0)
    X = g.normal(size=(n_rows, 2)) * [20.0, 100.0] + [25.0, 0.0]
    y = np.tanh(X[:, 0] / 30.0) * X[:, 1] + g.normal(size=n_rows)
    return X, y


def frame(n_rows=N_ROWS):
    X, y = data(n_rows)
    return pd.DataFrame(X, columns=NAMES).assign(error=y)


def cut(chunks, *arrays):
    """Dask arrays, cut at the same rows."""
    return [da.from_array(a, chunks=(chunks, *a.shape[1:])) for a in arrays]


def assert_same_model(one, other, rtol):
    one, other = one.model_, other.model_
    for name in ("coefficients", "minimum", "reference", "spread", "rule_weights", "rule_rows"):
        a, b = getattr(one, name), getattr(other, name)
        assert_allclose(a, b, rtol=0.0, atol=rtol * np.abs(b).max())
    for name in ("share", "center", "factor", "radius"):
        a, b = getattr(one.support, name), getattr(other.support, name)
        assert_allclose(a, b, rtol=0.0, atol=10.0 * rtol * np.abs(b).max())
    for a, b in zip(one.support.marginals, other.support.marginals, strict=True):
        assert_allclose(a[0], b[0], rtol=0.0, atol=10.0 * rtol)
        assert_allclose(a[2], b[2], rtol=0.0, atol=10.0 * rtol)


@pytest.mark.parametrize("weighted", [False, True])
def test_coefficients_are_those_of_one_process(few_are_many, weighted):
    """Of weights that are no copies as many rows count as their spread leaves, however small."""
    whole = data()
    if weighted:
        whole += (1e-4 * np.random.default_rng(1).uniform(0.5, 1.5, N_ROWS),)
    single = ANFISRegressor(n_mfs=3).fit(*whole)
    # One partition, even ones, odd and empty ones.
    for chunks in (N_ROWS, 700, (1, 0, N_ROWS - 2, 1, 0)):
        spread = DaskANFISRegressor(n_mfs=3).fit(*cut(chunks, *whole))
        assert_same_model(spread, single, 1e-10)
        assert (spread.alpha_, spread.n_iter_) == (single.alpha_, single.n_iter_)
        assert_allclose(spread.noise_std_, single.noise_std_, rtol=1e-10)
        assert spread.readability_.line == single.readability_.line


def test_search_by_groups_with_weights_is_that_of_one_process(few_are_many, monkeypatch):
    monkeypatch.setattr(sampling, "SAMPLE_ROWS", 150)
    X, y = data(2 * N_ROWS)
    g = np.random.default_rng(1)
    weight = g.integers(0, 3, len(y)).astype(float)
    groups = np.array(["cold", "hot", "room"])[g.integers(0, 3, len(y))]
    whole = (X[:, :1], np.column_stack([y, X[:, 0] ** 2]), weight, groups)
    single = ANFISRegressor(partition="grid").fit(*whole)
    found = DaskANFISRegressor(partition="grid").fit(*cut(2345, *whole))
    errors = [[one["expected_error"] for one in model.structures_] for model in (found, single)]
    assert_allclose(*errors, rtol=1e-9)
    assert_same_model(found, single, 1e-10)


def test_few_rows_are_fetched_and_trained_on_as_ever():
    table = frame(500).assign(weight=np.linspace(0.0, 2.0, 500), run=np.arange(500) // 50)
    lazy = dd.from_pandas(table, npartitions=3)
    settings = {"n_mfs": 2, "early_stopping": True}
    kinds = (ANFISRegressor, table), (DaskANFISRegressor, lazy), (DaskANFISRegressor, table)
    here, there, eager = (
        model(**settings).fit(own[NAMES], own["error"], own["weight"], own["run"])
        for model, own in kinds
    )
    assert_array_equal(there.consequents_, here.consequents_)
    assert list(there.feature_names_in_) == NAMES
    assert there.model_.output_names == ("error",)
    assert_array_equal(eager.consequents_, here.consequents_)


def test_nothing_but_sums_and_one_sample_comes_to_the_client(few_are_many, monkeypatch):
    X, y = data()
    sizes = []
    real = rows.computed

    def computed(*lazy):
        result = real(*lazy)
        sizes.append(len(pickle.dumps(result)))
        return result

    monkeypatch.setattr(rows, "computed", computed)
    DaskANFISRegressor(n_mfs=2).fit(*cut(500, X, y))
    sample = sizes.pop(1)
    assert sample < 1.3 * 1500 * 6 * 8
    assert max(sizes) < 10_000  # the data are 144,000
    assert len(sizes) <= 12


def test_parquet_of_small_files_is_read_partition_by_partition(few_are_many, tmp_path):
    table = frame()
    for i in range(8):
        part = table.iloc[i * 750 : (i + 1) * 750].assign(other="text")
        part.to_parquet(tmp_path / f"{i}.parquet")
    lazy, given = dd.read_parquet(tmp_path), {"n_mfs": 2, "agreement": 0.1, "alpha": 1e-5}
    model = DaskANFISRegressor(**given).fit(lazy[NAMES], lazy["error"])
    single = ANFISRegressor(**given).fit(table[NAMES], table["error"])
    assert_same_model(model, single, 1e-10)
    predicted = model.predict(lazy[NAMES])
    assert isinstance(predicted, dd.Series)
    assert predicted.name == "error"
    assert_array_equal(predicted.compute().to_numpy(), model.predict(table[NAMES]))
    _, deviations = model.predict(lazy[NAMES], return_std=True)
    expected = model.predict(table[NAMES], return_std=True)[1]
    assert_array_equal(deviations.compute().to_numpy(), expected)


@pytest.mark.parametrize("n_outputs", [1, 2])
def test_what_is_lazy_is_what_is_eager(n_outputs):
    X, y = data(600)
    y = y if n_outputs == 1 else np.column_stack([y, X[:, 0]])
    model = DaskANFISRegressor(n_mfs=2).fit(X, y)
    eager = model.predict(X)
    lazy = model.predict(da.from_array(X, chunks=((250, 0, 350), (1, 1))))
    assert isinstance(lazy, da.Array)
    assert (lazy.shape, lazy.dtype) == (eager.shape, eager.dtype)
    assert_array_equal(lazy.compute(), eager)
    weight = np.linspace(0.0, 1.0, 600)
    score = model.score(*cut(170, X, y, weight))
    assert_allclose(score, r2_score(y, eager, sample_weight=weight), rtol=1e-12)
    table = dd.from_pandas(pd.DataFrame(X), npartitions=3)
    assert_array_equal(model.predict(table).compute().to_numpy(), eager)
    assert_array_equal(table.map_partitions(model.coverage).compute(), model.coverage(X))
    for method in (model.coverage, model.strengths, model.apply, model.in_bounds):
        with pytest.raises(TypeError, match=r"fit, predict and score take dask .* X\.compute"):
            method(table)


@cache
def fitted():
    """On rows at hand, which it takes as well."""
    return DaskANFISRegressor(n_mfs=2).fit(*data(600))


@cache
def fitted_on_a_frame():
    table = frame(300)
    return DaskANFISRegressor(n_mfs=2).fit(table[NAMES], table["error"])


@pytest.mark.parametrize(
    ("change", "chunks"),
    [
        (lambda y: np.full(600, 0.1), (250, 0, 350)),  # of a constant: zero
        (lambda y: np.full(600, 1e9 + 0.1), (250, 0, 350)),
        (lambda y: y + 1e9, (250, 1, 349)),  # far from the mean of the training
    ],
)
def test_score_is_that_of_one_process(change, chunks):
    X, y = data(600)
    y = change(y)
    expected = ANFISRegressor.score(fitted(), X, y)
    assert fitted().score(*cut(chunks, X, y)) == pytest.approx(expected, rel=1e-12, abs=0.0)


def test_score_of_one_row_is_nan_and_of_no_prediction_refused():
    X, y = data(600)
    assert np.isnan(fitted().score(*cut(1, X[:1], y[:1])))
    X[300] += 1e6
    model = copy(fitted()).set_params(out_of_bounds="nan")
    with pytest.raises(ValueError, match="y is not finite, or X is out of range"):
        model.score(*cut(250, X, y))


def parts_of(*tables):
    """A frame of these partitions, which say nothing of themselves before they are there."""
    meta = tables[0].iloc[:0]
    return dd.from_delayed([dask.delayed(t) for t in tables], meta=meta, verify_meta=False)


def with_nan():
    table = frame(300)
    table.loc[212, "rate"] = np.nan
    lazy = dd.from_pandas(table, npartitions=3, sort=False)
    return lazy[NAMES], lazy["error"]


def with_other(change):
    """Of two partitions the second one is another."""
    table = frame(300)
    lazy = parts_of(table[NAMES][:100], change(table[NAMES][100:]))
    return lazy, da.from_array(table["error"].to_numpy(), chunks=((100, 200),))


def test_whole_numbers_in_one_partition_are_read_as_floats():
    table = frame(300).round()
    lazy = parts_of(table[:100].astype({"rate": int}), table[100:])
    single = ANFISRegressor(n_mfs=2).fit(table[NAMES], table["error"])
    found = DaskANFISRegressor(n_mfs=2).fit(lazy[NAMES], lazy["error"])
    assert_array_equal(found.consequents_, single.consequents_)


def with_unknown_chunks():
    X, y = cut(100, *data(300))
    return X[X[:, 0] > -1e9], y[(y > 0.0)]


def of_other_partitions():
    lazy = dd.from_pandas(frame(300), npartitions=3)
    return lazy[NAMES], lazy["error"].repartition(npartitions=2)


def weighted(weight):
    return cut(100, *data(300), weight)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (with_nan, ValueError, r"Partition 2: .*NaN in column 'rate', first at row 12"),
        (
            lambda: with_other(lambda part: part.rename(columns={"rate": "Rate"})),
            ValueError,
            r"Partition 1: .*has the columns temperature, Rate",
        ),
        (
            lambda: with_other(lambda part: part.assign(rate="fast")),
            ValueError,
            r"Partition 1: .*holds text in column 'rate'",
        ),
        (with_unknown_chunks, ValueError, r"Partition \d: X has 100 rows and y \d+"),
        (lambda: cut(100, data(300)[0], data(299)[1]), ValueError, "Partition 2: .*100 .* y 99"),
        (of_other_partitions, ValueError, "y has npartitions=2, X 3"),
        (
            lambda: (cut(100, data(300)[0])[0], data(300)[1]),
            TypeError,
            "y is a ndarray, but other data are dask collections",
        ),
        (
            lambda: (*data(300), da.ones(300, chunks=100)),
            TypeError,
            "X is a ndarray, but other data are dask collections: .* compute",
        ),
        (
            lambda: weighted(np.where(np.arange(300) == 107, -2.0, 1.0)),
            ValueError,
            "Partition 1: Negative values in sample_weight",
        ),
        (
            lambda: cut(100, *data(300), np.ones(300), np.array([1, pd.NA, 2] * 100)),
            ValueError,
            r"Partition \d: groups has no value for some rows",
        ),
        (lambda: weighted(np.zeros(300)), ValueError, "Found 0 rows with a positive weight"),
    ],
)
def test_bad_data_are_refused_by_name(make, error, message):
    with pytest.raises(error, match=message):
        DaskANFISRegressor(n_mfs=2).fit(*make())


def test_what_needs_every_residual_is_refused(few_are_many):
    with pytest.raises(ValueError, match="needs every row's own residual"):
        DaskANFISRegressor(n_mfs=2, loss="huber").fit(*cut(1000, *data()))


def test_clusters_taken_as_they_are_need_no_residual(few_are_many):
    X, y = data()
    given = {"partition": KMeans(2, n_init=1, random_state=0), "max_iter": 0}
    single = ANFISRegressor(**given).fit(X, y)
    spread = DaskANFISRegressor(**given).fit(*cut(1000, X, y))
    assert_allclose(spread.predict(X), single.predict(X), rtol=0, atol=1e-10 * np.ptp(y))
    with pytest.raises(ValueError, match="max_iter=0 with a model as partition needs"):
        DaskANFISRegressor(partition=single, max_iter=0).fit(*cut(1000, X, y))


def test_prediction_wants_the_columns_of_training():
    with pytest.raises(ValueError, match="must be in the same order"):
        fitted_on_a_frame().predict(dd.from_pandas(frame(300)[NAMES[::-1]], npartitions=2))
    with pytest.raises(ValueError, match="expecting 2 features"):
        fitted().predict(da.zeros((10, 3)))
    with pytest.raises(ValueError, match="X has ndim=1, and that of a table is 2"):
        fitted().predict(da.zeros(10))
    with pytest.raises(ValueError, match="X has ndim=1: that of X must be 2"):
        DaskANFISRegressor().fit(da.zeros(10), da.zeros(10))


def test_arrays_without_names_are_warned_of_once_and_not_by_every_block():
    model, table = fitted_on_a_frame(), frame(300)[NAMES]
    with pytest.warns(UserWarning, match="X does not have valid feature names") as caught:
        lazy = model.predict(da.from_array(table.to_numpy(), chunks=(100, 2)))
    assert len(caught) == 1
    assert_array_equal(lazy.compute(), model.predict(table))  # a warning would be an error


def test_plain_estimator_names_the_one_for_dask():
    X, y = data(300)
    with pytest.raises(TypeError, match=r"skanfis\.dask\.DaskANFISRegressor"):
        ANFISRegressor().fit(*cut(100, X, y))
    with pytest.raises(TypeError, match=r"X\.compute"):
        ANFISRegressor(n_mfs=1).fit(X, y).predict(*cut(100, X))
    with pytest.raises(TypeError, match=r"X\.compute\(\)\. Only the fit, predict and score of"):
        effects(DaskANFISRegressor(n_mfs=1).fit(X, y), *cut(100, X))
