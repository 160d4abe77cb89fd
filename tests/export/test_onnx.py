"""The ONNX graph, run by onnxruntime, answers what ``predict`` answers."""

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.compose import ColumnTransformer
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler, RobustScaler, StandardScaler

from skanfis.export import fold, register_onnx_converter
from skanfis.export.c.self_test import size_of_sum
from skanfis.options import LinearExtrapolation

from ..quick import quick
from .every_model import FEWEST, full_scale, rows, surface

REASON = "{} IS NOT INSTALLED (pip install '.[onnx]'): THE ONNX CONVERTER IS NOT TESTED"
skl2onnx = pytest.importorskip("skl2onnx", reason=REASON.format("skl2onnx"))
onnxruntime = pytest.importorskip("onnxruntime", reason=REASON.format("onnxruntime"))

PRECISIONS = pytest.mark.parametrize(
    ("dtype", "tolerance"), [(np.float64, 1e-9), (np.float32, 1e-5)], ids=["double", "float"]
)


X, Y = surface()


@pytest.fixture(scope="module", autouse=True)
def _converter():
    register_onnx_converter()


@cache
def fitted(n_outputs):
    return quick(n_mfs=1).fit(*surface(n_outputs=n_outputs))


def holding(model):
    """A fitted regressor with this model in it."""
    policy = model.out_of_bounds
    if policy == "linear":
        policy = LinearExtrapolation(model.max_extrapolation)
    estimator = copy(fitted(model.n_outputs)).set_params(out_of_bounds=policy)
    estimator.model_ = model
    return estimator


def answers(estimator, X, **options):
    """Outputs of the converted estimator, (n_rows, n_outputs)."""
    graph = skl2onnx.to_onnx(estimator, X[:1], **options).SerializeToString()
    session = onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])
    (y,) = session.run(None, {"X": X})
    assert y.dtype == X.dtype
    return y


@PRECISIONS
def test_every_model_answers_as_predict(dtype, tolerance):
    X = rows(dtype, 1000)
    # Rows that are not finite.
    bad = np.where(np.eye(3), np.array([[np.nan], [np.inf], [-np.inf]]), X[:3]).astype(dtype)
    # The operators are the same in either precision: each has half of the models, and in each every
    # family stands twice, each time on another partition.
    half = dtype is np.float32
    listed = [case for i, case in enumerate(FEWEST) if (i + i // 4) % 2 == half]
    for case in (case for case in listed if case.model.out_of_bounds != "raise"):
        found = answers(holding(case.model), np.vstack([X, bad]))
        assert np.isnan(found[len(X) :]).all(), case.label
        found, wanted = found[: len(X)], case.model.predict(X.astype(float))
        assert found.shape == wanted.shape
        assert np.array_equal(np.isnan(found), np.isnan(wanted)), case.label
        difference = np.abs(found - wanted) / full_scale(wanted)
        assert np.nanmax(difference) < tolerance, case.label


COLUMNS = ColumnTransformer(
    [("first", StandardScaler(), [2]), ("second", MinMaxScaler(), [0])], remainder="passthrough"
)
PIPELINES = {
    "columns": (COLUMNS, {"partition": KMeans(4, n_init=1, random_state=0)}),
    "two": (
        make_pipeline(RobustScaler(), StandardScaler()),
        {"n_mfs": 3, "mf": ["triangular", "s_shaped", "bell"], "out_of_bounds": "nan"},
    ),
}


@PRECISIONS
@pytest.mark.parametrize("kind", PIPELINES)
def test_pipeline_answers_as_predict(kind, dtype, tolerance):
    scaler, settings = PIPELINES[kind]
    # One output and two by turns, in either precision the other way round.
    X, y = surface(n_outputs=1 + (list(PIPELINES).index(kind) + (dtype is np.float32)) % 2)
    pipeline = make_pipeline(clone(scaler), quick(**settings))
    pipeline.fit(X, y)
    Z = (X.mean(axis=0) + 1.3 * (X - X.mean(axis=0))).astype(dtype)
    found, wanted = answers(pipeline, Z), pipeline.predict(Z.astype(float)).reshape(len(Z), -1)
    # A scaler in single precision may move a row across the edge of the box by its last bit.
    same = np.isnan(found) == np.isnan(wanted)
    assert same.mean() > (0.99 if dtype == np.float32 else 0.9999)
    scale = size_of_sum(fold(pipeline), Z, np.nan_to_num(wanted))
    assert np.nanmax((np.abs(found - wanted) / scale)[same]) < tolerance


def test_tangent_without_end_is_finite():
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    for case in FEWEST[::3]:
        if case.model.out_of_bounds == "linear" and case.model.tangent_at is not None:
            # In such units that slopes times the largest numbers are no numbers.
            steep = replace(case.model, coefficients=1e10 * case.model.coefficients, target=None)
            endless = steep.with_out_of_bounds("linear", np.inf)
            found = answers(holding(endless), np.finfo(float).max * signs)
            assert np.isfinite(found).all(), case.label


def test_a_frame_makes_an_input_of_every_column():
    table = pd.DataFrame({"a": X[:, 0], "b": X[:, 1].astype(np.float32), "c": X[:, 2].astype(int)})
    estimator = quick(n_mfs=2).fit(table, Y)
    for shown in (table[:1], table.loc[:1, ["c", "a", "b"]]):
        graph = skl2onnx.to_onnx(estimator, shown).SerializeToString()
        session = onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])
        (y,) = session.run(None, {name: table[[name]].to_numpy() for name in table})
        np.testing.assert_allclose(y[:, 0], estimator.predict(table))


def test_what_a_graph_cannot_be_is_refused():
    estimator = quick(n_mfs=2).fit(X, Y)
    with pytest.raises(NotFittedError, match="This ANFISRegressor instance is not fitted yet"):
        skl2onnx.to_onnx(quick(), X[:1])
    with pytest.raises(ValueError, match="target_opset=12 is too old"):
        skl2onnx.to_onnx(estimator, X[:1], target_opset=12)
    expected = estimator.predict(X)
    for opset in (13, 17, 18, 21):
        np.testing.assert_allclose(answers(estimator, X, target_opset=opset)[:, 0], expected)
    with pytest.raises(ValueError, match=r"onnxruntime takes .*e-5., of the model, for zero"):
        skl2onnx.to_onnx(quick(n_mfs=2).fit(X, 1e-55 * Y), X[:1])
    with pytest.raises(ValueError, match="out_of_bounds='raise' has no counterpart in ONNX"):
        skl2onnx.to_onnx(estimator.set_params(out_of_bounds="raise"), X[:1])
