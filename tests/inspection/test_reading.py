"""Readability of pipelines, from tables of every kind; the display shows the figures."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler, StandardScaler

from skanfis import ANFISRegressor
from skanfis.inspection import ReadabilityDisplay, measures, readability
from skanfis.inspection.reading import _bands

from ..export.rule_bases import MODELS, rows_of
from .drawing import A_GRID, EACH, drawn, plt

TWO_OUTPUTS = MODELS["scattered, order 1, 2 outputs"]


def target_of(X):
    return 1e3 + np.sin(X["kelvin"] / 20) + 1e6 * X["rate"] ** 2


def assert_same(found, expected, rtol=1e-9):
    assert_allclose(found.summary, expected.summary, rtol=rtol)
    assert_allclose(found.rules["value"], expected.rules["value"], rtol=rtol)
    assert_allclose(found.terms["greatest_truth"], expected.terms["greatest_truth"], rtol=rtol)


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_estimators_around_the_model_speak_of_their_own_units(fitted):
    pipe, X = fitted
    y = target_of(X)
    expected = readability(pipe[-1], pipe[:-1].transform(X), y)
    found = readability(pipe, X, y)
    assert_same(found, expected)
    assert list(found.terms["input"]) == ["kelvin"] * 3 + ["rate"] * 2
    anfis = ANFISRegressor(n_mfs=2, solver="lse")
    search = GridSearchCV(make_pipeline(StandardScaler(), anfis), {})
    scaled = TransformedTargetRegressor(search, transformer=MinMaxScaler()).fit(X, y)
    inner = scaled.regressor_.best_estimator_
    inside = readability(inner, X, scaled.transformer_.transform(y.to_numpy()[:, None]))
    outside = readability(scaled, X, y)
    assert_allclose(outside.summary, inside.summary, rtol=1e-6)
    assert_allclose(
        outside.rules["value"],
        scaled.transformer_.inverse_transform(inside.rules[["value"]].to_numpy())[:, 0],
        rtol=1e-9,
    )


def test_columns_that_do_not_reach_the_model_may_hold_anything():
    X = np.random.default_rng(0).uniform(size=(60, 3))
    pipe = make_pipeline(
        ColumnTransformer([("two", "passthrough", [2, 0])]), ANFISRegressor(n_mfs=2, solver="lse")
    )
    pipe.fit(X, X[:, 0] ** 2)
    expected = readability(pipe, X)
    X[:, 1] = np.nan
    assert_same(readability(pipe, X), expected)


def test_tables_of_every_kind(fitted):
    pipe, X = fitted
    y = target_of(X)
    expected = readability(pipe, X, y)
    polars = pytest.importorskip("polars")
    shuffled = X.set_index(np.random.default_rng(0).permutation(len(X)).astype(float))
    with_list = readability(pipe[-1], pipe[:-1].transform(X).tolist(), list(y))
    for found in (
        readability(pipe, polars.DataFrame({name: X[name].to_numpy() for name in X}), y),
        readability(pipe, shuffled, y),
        with_list,
    ):
        assert_same(found, expected)


def test_without_y_it_is_the_predictions(fitted):
    pipe, X = fitted
    assert_same(readability(pipe, X), readability(pipe, X, pipe.predict(X)))


def test_whole_weights_are_repeats(fitted):
    pipe, X = fitted
    times = np.random.default_rng(0).integers(0, 3, len(X))
    y = target_of(X)
    found = readability(pipe, X, y, sample_weight=times)
    assert_same(found, readability(pipe, X.loc[X.index.repeat(times)], np.repeat(y, times)))


def test_rows_are_read_block_by_block(tmp_path):
    n_rows = 500_000
    X = np.memmap(tmp_path / "rows", dtype=np.float32, mode="w+", shape=(n_rows, 3))
    X[:] = rows_of(A_GRID, 1.0, 1000).astype(np.float32)[np.arange(n_rows) % 1000]
    readability(A_GRID, X[:10])  # what is made once
    tracemalloc.start()
    found = readability(A_GRID, X)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.7 * X.size * 8
    assert_allclose(found.summary, readability(A_GRID, X[:1000]).summary, rtol=1e-9)


def test_errors_name_the_row_and_the_column(monkeypatch):
    X = rows_of(A_GRID, 1.0)
    monkeypatch.setattr(measures, "LARGE_BLOCK_ROWS", 10)
    bad = X.copy()
    bad[33, 1] = np.nan
    with pytest.raises(ValueError, match="'chip temperature', first at row 33; 1 of its 40 values"):
        readability(A_GRID, bad)
    with pytest.raises(ValueError, match="X has 2 columns, the estimator takes 3"):
        readability(A_GRID, X[:, :2])
    with pytest.raises(ValueError, match=r"y has 2 columns; the model has 1 outputs: 'y'"):
        readability(A_GRID, X, np.ones((40, 2)))
    with pytest.raises(ValueError, match="Input y contains NaN in column 'y', first at row 3"):
        readability(A_GRID, X, np.where(np.arange(40) == 3, np.nan, 1.0))
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        readability(A_GRID, X, np.ones(39))
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        readability(A_GRID, X, sample_weight=np.ones(39))
    with pytest.raises(ValueError, match="Negative values in sample_weight: -1 at row 0"):
        readability(A_GRID, X, sample_weight=-np.ones(40))
    with pytest.raises(ValueError, match="minimum of 1 is required"):
        readability(A_GRID, X[:0])
    with pytest.raises(TypeError, match="must be a fitted ANFIS estimator"):
        readability(None, X)


@EACH
def test_display_shows_what_was_measured(model):
    X = rows_of(model, 1.3)
    display = drawn(ReadabilityDisplay.from_estimator(model, X, output=-1, n_points=11))
    inside = np.clip(X, model.minimum, model.maximum)
    assert_allclose(display.predictions, model.predict(inside)[:, -1], rtol=1e-9)
    strongest = model.strengths(inside).argmax(axis=1)
    values = np.array(
        [model.consequents[r, :, -1] @ [1.0, *x] for r, x in zip(strongest, inside, strict=True)]
    )
    assert_allclose(display.alone, values, rtol=1e-6, atol=1e-9)
    points = display.axes_[1].collections[0].get_offsets()
    assert_array_equal(points, np.column_stack([display.predictions, display.alone]))
    # The points are the measure: equal weights, no ties.
    error = np.sqrt(np.mean((display.alone - display.predictions) ** 2))
    found = display.readability.measures
    assert_allclose(error / found.deviation[-1], found.alone[-1], rtol=1e-6, atol=1e-9)
    assert f"{found.alone[-1]:.3g} sd" in display.axes_[1].get_title(loc="left")
    labels = [label.get_text() for label in display.axes_[0].get_yticklabels()]
    assert labels == list(display.readability.terms["term"])
    written = [text.get_text() for text in display.axes_[0].texts]
    for truth in display.readability.terms["greatest_truth"]:
        assert f"{truth:.2f}" in written
    for image, curve in zip(display.axes_[0].images, display.memberships, strict=True):
        assert_array_equal(image.get_array()[0], curve)
    plt.close(display.figure_)


def test_bands_are_the_terms_along_their_ranges():
    bands = _bands(A_GRID, 5)
    for t, term in zip(range(2), A_GRID.memberships()[:2], strict=True):
        x = np.linspace(A_GRID.minimum[0], A_GRID.maximum[0], 5)
        expected = np.exp(-(((x - term["center"]) / term["width"]) ** 2) / 2)
        assert_allclose(bands[t], expected, rtol=1e-9)


def test_display_of_chosen_rows_on_given_axes():
    X = rows_of(TWO_OUTPUTS, 1.0)
    weight = np.ones(40)
    weight[::4] = 0.0
    _, axes = plt.subplots(1, 2)
    display = ReadabilityDisplay.from_estimator(
        TWO_OUTPUTS, X, sample_weight=weight, output="y1", max_rows=20, ax=axes
    )
    assert_array_equal(display.axes_, axes)
    assert display.alone.size == 10  # of every second row, half have weight
    assert_allclose(display.predictions, TWO_OUTPUTS.predict(X[2::4])[:, 1], rtol=1e-9)
    assert axes[1].get_ylabel() == "y1: strongest rule alone"
    assert display.plot(ax=plt.subplots()[1]) is display
    with pytest.raises(ValueError, match="2 are needed"):
        display.plot(ax=plt.subplots(1, 3)[1])
    for settings in ({"max_rows": 0}, {"n_points": 1}, {"output": 2}):
        with pytest.raises(ValueError, match=next(iter(settings)).replace("output", "no output")):
            ReadabilityDisplay.from_estimator(TWO_OUTPUTS, X, **settings)
    plt.close("all")


def test_what_cannot_be_read_is_red():
    X = np.random.default_rng(0).uniform(size=(50, 1))
    frame = pd.DataFrame(X, columns=["x"])
    model = ANFISRegressor(n_mfs=2, solver="lse").fit(frame, X[:, 0])
    display = ReadabilityDisplay.from_estimator(model, frame.iloc[:1])
    red = [text.get_text() for text in display.axes_[0].texts if text.get_color() == "#c1272d"]
    bad = display.readability.terms["greatest_truth"]
    assert red == [f"{truth:.2f}" for truth in bad if truth < 0.5]
    plt.close("all")
