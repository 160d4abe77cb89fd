"""A model with its scalers folded in predicts, on raw rows, what the pipeline predicts."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.decomposition import PCA
from sklearn.exceptions import NotFittedError
from sklearn.frozen import FrozenEstimator
from sklearn.impute import SimpleImputer
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import FeatureUnion, make_pipeline
from sklearn.preprocessing import (
    FunctionTransformer,
    MaxAbsScaler,
    MinMaxScaler,
    OneHotEncoder,
    PowerTransformer,
    RobustScaler,
    StandardScaler,
)

from skanfis import ANFISRegressor
from skanfis.export import export_c, fold, fold_with_rows

NAMES = ["hours", "kelvin", "rate"]
KINDS = {
    "grid": {"n_mfs": [2, 3, 1]},
    "bells": {"n_mfs": 2, "mf": "bell"},
    "triangles": {"n_mfs": 2, "mf": "triangular"},
    "order 0": {"n_mfs": [3, 1, 2], "order": 0},
    "scattered": {"partition": KMeans(4, n_init=1, random_state=0)},
}
SCALERS = {
    "standard": StandardScaler(),
    "uncentred": StandardScaler(with_mean=False),
    "min-max": MinMaxScaler((-3, 7)),
    "max-abs": MaxAbsScaler(),
    "robust": RobustScaler(),
    "identity": FunctionTransformer(),
    "passthrough": "passthrough",
    "two": make_pipeline(RobustScaler(), "passthrough", MinMaxScaler()),
    "frozen": FrozenEstimator(StandardScaler().fit(np.diag([3e4, 300.0, 1e-3]))),
    "columns": ColumnTransformer(
        [("r", RobustScaler(), [2]), ("s", make_pipeline(StandardScaler(), MaxAbsScaler()), [0])],
        remainder="passthrough",
    ),
}

# Every kind of rules behind every scaler; policies and numbers of outputs take turns. A triangle
# that training has not moved has its corner on the edge of the box, where the last bit decides on
# which side of it the tangent is taken.
CASES = [
    (kind, scaler, ("clip", "nan" if kind == "triangles" else "linear", "nan")[i % 3], 1 + i % 2)
    for i, (kind, scaler) in enumerate(product(KINDS, SCALERS))
]


def data(n_outputs=1, n_rows=120):
    """Columns of very different units, one of them far from the origin."""
    g = np.random.default_rng(0)
    z = g.uniform(-1.5, 1.5, (n_rows, 3))
    y = np.column_stack([np.sin(2 * z[:, 0]) + z[:, 1] * z[:, 2], 1e3 + 50 * z[:, 1] ** 2])
    X = z * [200.0, 15.0, 1e-4] + [5e4, 290.0, 0.0]
    return X, (y[:, 0] if n_outputs == 1 else y)


X, Y = data()


def around(X, n_rows=400):
    """Rows in and out of the box."""
    middle, half = (X.max(axis=0) + X.min(axis=0)) / 2, np.ptp(X, axis=0) / 2
    g = np.random.default_rng(1)
    return np.vstack([X, middle + half * g.uniform(-2.5, 2.5, (n_rows, X.shape[1]))])


def regressor(**settings):
    return ANFISRegressor(**({"solver": "lse"} | settings))


def assert_same_predictions(estimator, X, full_scale=50.0):
    model, rows = fold_with_rows(estimator, X)
    expected = estimator.predict(X).reshape(len(X), -1)
    assert_allclose(model.predict(rows), expected, rtol=0, atol=1e-12 * full_scale)


@pytest.mark.parametrize(("kind", "scaler", "policy", "n_outputs"), CASES)
def test_folded_model_predicts_what_the_pipeline_does(kind, scaler, policy, n_outputs):
    X, y = data(n_outputs)
    last = regressor(**KINDS[kind], out_of_bounds=policy)
    pipe = make_pipeline(clone(SCALERS[scaler], safe=False), last)
    if n_outputs == 2:
        pipe = TransformedTargetRegressor(pipe, transformer=RobustScaler())
    pipe.fit(X, y)
    assert_same_predictions(pipe, around(X), np.ptp(y, axis=0).max() * 20)
    model = fold(FrozenEstimator(pipe))
    # Strictly, as in C: ``in_bounds`` allows for rounding.
    assert ((model.minimum <= X) & (model.maximum >= X)).all()
    assert_array_equal(model.predict(X).shape, (len(X), n_outputs))


def test_an_edge_at_zero_stays_there():
    ratios = np.linspace(0.0, 5.0, 30)[:, None] ** [1, 2]
    model = fold(make_pipeline(MinMaxScaler(), regressor(n_mfs=[2, 1])).fit(ratios, ratios[:, 1]))
    assert_array_equal(model.minimum, 0.0)
    export_c(model, name="m")  # less than zero by a rounding error is a number that C cannot hold


def test_moved_and_dropped_columns_go_back_to_their_place():
    frame = pd.DataFrame(X[:, [2, 0, 1, 0]], columns=["rate", "dropped", "kelvin", "hours"])
    chosen = ColumnTransformer(
        [
            ("by name", StandardScaler(), ["hours"]),
            ("by mask", MinMaxScaler(), [False, False, True, False]),
            ("none", StandardScaler(), []),
            ("left out", "drop", ["dropped"]),
        ],
        remainder=RobustScaler(),
    )
    rules = regressor(n_mfs=[2, 3, 1], out_of_bounds="linear")
    pipe = make_pipeline(chosen, rules).fit(frame, Y)
    model, rows = fold_with_rows(pipe, frame)
    assert model.input_names == ("rate", "kelvin", "hours")
    assert [term["input"] for term in model.memberships()] == ["hours"] * 2 + ["kelvin"] * 3
    assert_array_equal(rows, frame[["rate", "kelvin", "hours"]])
    assert_same_predictions(pipe, pd.DataFrame(around(frame.to_numpy()), columns=frame.columns))


def mixed(n_rows=200):
    """A table with text in it, and a target that depends on it."""
    g = np.random.default_rng(3)
    frame = pd.DataFrame(
        {
            "fibre": g.choice(["PM", "SM", "rare"], n_rows, p=[0.5, 0.45, 0.05]),
            "kelvin": g.uniform(230.0, 340.0, n_rows),
            "axis": g.choice(["x", "y"], n_rows),
        }
    )
    slope = frame["fibre"].map({"PM": 0.1, "SM": -0.2, "rare": 0.3})
    return frame, slope * (frame["kelvin"] - 290.0) + (frame["axis"] == "y")


@pytest.mark.parametrize(
    ("options", "fibres", "kelvin"),
    [
        ({}, ["fibre_PM", "fibre_SM", "fibre_rare"], "kelvin"),
        # A level that is called like a column.
        ({}, ["fibre_PM (2)", "fibre_SM", "fibre_rare"], "fibre_PM"),
        ({"drop": "first"}, ["fibre_SM", "fibre_rare"], "kelvin"),
        ({"min_frequency": 0.2}, ["fibre_PM", "fibre_SM", "fibre_infrequent_sklearn"], "kelvin"),
        ({"handle_unknown": "ignore", "sparse_output": False}, None, "kelvin"),
    ],
)
def test_one_hot_encoded_columns_are_inputs(options, fibres, kelvin):
    X, y = mixed()
    X = X.rename(columns={"kelvin": kelvin})
    encode = make_pipeline(OneHotEncoder(**options), StandardScaler(with_mean=False))
    front = ColumnTransformer(
        [("kind", encode, ["axis", "fibre"])], remainder=RobustScaler(), sparse_threshold=0
    )
    pipe = make_pipeline(front, regressor(**KINDS["scattered"])).fit(X, y)
    model, rows = fold_with_rows(pipe, X)
    # The other levels are known if none are merged and unknown ones are refused.
    others = () if {"min_frequency", "handle_unknown"} & set(options) else ("PM", "rare")
    assert model.levels["fibre_SM"] == ("fibre", "SM", others)
    if fibres is not None:
        assert list(model.input_names[: len(fibres) + 1]) == [*fibres, kelvin]
        indicator = (X["fibre"] == "SM").to_numpy()
        assert_array_equal(rows[:, model.input_names.index("fibre_SM")], indicator)
    else:
        X = X.assign(fibre="unheard of")
    # Rows out of range as well.
    assert_same_predictions(pipe, pd.concat([X, X.assign(**{kelvin: X[kelvin] * 1.2})]))


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (PCA(2), r"'pca' \(PCA\) cannot be folded into the rules: .* every column alone"),
        (PCA(2), r"behind it: pipeline\[-1\], by name if"),
        (SimpleImputer(add_indicator=True), "SimpleImputer.*add_indicator=False"),
        (SimpleImputer(missing_values=0.0), "SimpleImputer.*missing_values=nan"),
        (FunctionTransformer(np.negative), "FunctionTransformer"),
        (FeatureUnion([("a", StandardScaler())]), "FeatureUnion"),
        (MinMaxScaler(clip=True), "clip=True bends it"),
        (ColumnTransformer([("mix", PCA(2), [0, 2])]), r"step 'mix' \(PCA\)"),
        (ColumnTransformer([("a", "passthrough", [0]), ("b", StandardScaler(), [0])]), "'x0' .* 2"),
    ],
)
def test_what_does_not_fold_is_named(step, message):
    pipe = make_pipeline(step, regressor(n_mfs=2)).fit(X, Y)
    with pytest.raises(ValueError, match=message):
        fold(pipe)


@pytest.mark.parametrize(
    "settings", [{"func": np.log, "inverse_func": np.exp}, {"transformer": PowerTransformer()}]
)
def test_a_bent_target_is_refused(settings):
    target = TransformedTargetRegressor(regressor(n_mfs=2), **settings, check_inverse=False)
    with pytest.raises(ValueError, match=r"of the target' .*cannot be folded.* or regressor_ of a"):
        fold(target.fit(X, Y + 10.0))
    # What the message advises is the model of the transformed target.
    said = fold(target.regressor_).predict(X)
    back = target.transformer_.inverse_transform(said)[:, 0]
    assert_allclose(back, target.predict(X), rtol=1e-12)


def test_what_stands_for_missing_values_stands_for_them_in_tables(rng):
    table = pd.DataFrame(X, columns=NAMES).assign(fibre=rng.choice(["PM", "SM"], len(X)))
    for name in ("kelvin", "fibre"):
        table.loc[rng.choice(len(X), 30), name] = np.nan
    # To an imputer of NaN, None is a category; and what reaches no model may be text.
    table["fibre"] = table["fibre"].astype(object).where(rng.random(len(X)) > 0.1, None)
    table["remark"] = "warm"
    numbers = make_pipeline(
        StandardScaler(with_std=False), SimpleImputer(strategy="median"), SimpleImputer()
    )
    scaled_first = make_pipeline(MinMaxScaler(), SimpleImputer())
    encoder = OneHotEncoder(drop="if_binary", sparse_output=False)
    words = make_pipeline(SimpleImputer(strategy="most_frequent"), encoder)
    every = ColumnTransformer(
        [("n", numbers, NAMES[:2]), ("s", scaled_first, NAMES[2:]), ("w", words, ["fibre"])]
    )
    pipe = make_pipeline(every, regressor(n_mfs=[2, 2, 1, 1, 1, 1])).fit(table, Y)
    assert list(fold(pipe).input_names) == [*NAMES, "fibre_PM", "fibre_SM", "fibre_None"]
    assert_same_predictions(pipe, table)
    # Text that reaches no model is no matter, without an encoder too.
    bare = make_pipeline(ColumnTransformer([("n", numbers, NAMES)]), regressor(n_mfs=2))
    assert_same_predictions(bare.fit(table, Y), table)


def test_an_imputer_that_drops_a_column_is_refused():
    empty = X * [1.0, np.nan, 1.0]
    with pytest.warns(UserWarning, match="without any observed values"):
        pipe = make_pipeline(SimpleImputer(), regressor(n_mfs=2)).fit(empty, Y)
    with pytest.raises(ValueError, match=r"SimpleImputer.* drops a column that has no values"):
        fold(pipe)


def test_what_has_no_rules_is_refused():
    with pytest.raises(TypeError, match=r"LinearRegression.* has no rules"):
        fold(make_pipeline(StandardScaler(), LinearRegression()).fit(X, Y))
    with pytest.raises(TypeError, match=r"GridSearchCV has no rules: search with refit=True"):
        fold(GridSearchCV(ANFISRegressor(n_mfs=2), {"order": [0]}, cv=2, refit=False).fit(X, Y))
    with pytest.raises(TypeError, match="got 3"):
        fold(3)
    with pytest.raises(TypeError, match="fitted ANFIS estimator"):
        fold(ANFISRegressor)
    pipe = make_pipeline(StandardScaler(), ANFISRegressor())
    for unfitted in (pipe, GridSearchCV(ANFISRegressor(), {})):
        with pytest.raises(NotFittedError):
            fold(unfitted)


def test_rows_are_checked():
    frame = pd.DataFrame(X.copy(), columns=NAMES)
    pipe = make_pipeline(StandardScaler(), regressor(n_mfs=2)).fit(frame, Y)
    with pytest.raises(ValueError, match="X must have the columns 'hours', 'kelvin', 'rate', in"):
        fold_with_rows(pipe, frame[["kelvin", "hours", "rate"]])
    with pytest.raises(ValueError, match=r"X has the shape \(\d+, 2\): .* rows of 'hours'"):
        fold_with_rows(pipe, X[:, :2])
    frame.loc[3, "kelvin"] = np.nan
    with pytest.raises(ValueError, match="NaN in column 'kelvin', first at row 3"):
        fold_with_rows(pipe, frame)


def test_steps_take_rows_with_and_without_names_in_silence():
    frame = pd.DataFrame(X, columns=NAMES)
    for known, given in ((X, frame), (frame, X), (frame, X.tolist())):
        pipe = make_pipeline(StandardScaler(), regressor(n_mfs=2)).fit(known, Y)
        assert_array_equal(fold_with_rows(pipe, given)[1], X)
