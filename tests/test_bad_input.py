"""Everything a user can get wrong: the message says where, what was found and what would do."""

import re
from functools import cache, partial

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import sparse
from sklearn.cluster import DBSCAN, AgglomerativeClustering, KMeans
from sklearn.exceptions import NotFittedError

from skanfis import ANFISRegressor
from skanfis.exceptions import ConstantInputWarning
from skanfis.inspection import explain
from skanfis.learning import GradientDescent, Hybrid, VariableProjection
from skanfis.options import EarlyStopping, Huber, LinearExtrapolation

from .memory import traced
from .test_validation import NOT_FINITE

NAMES = ["time", "temperature", "rate"]
N_ROWS = 60
KMEANS = KMeans(n_clusters=2, n_init=1, random_state=0)
# One rule: fitted in one solve.
QUICK = {"n_mfs": 1}


UNIT = np.random.default_rng(0).uniform(-1.0, 1.0, (N_ROWS, 3))
X = UNIT * [10.0, 1.0, 0.1] + [100.0, 0.0, 5.0]
Y = np.sin(3.0 * X[:, 1]) + 0.1 * X[:, 0]
FRAME = pd.DataFrame(X, columns=NAMES)
METHODS = ["predict", "coverage", "strengths", "in_bounds"]


def with_entry(array, place, value):
    array = np.array(array, dtype=float)
    array[place] = value
    return array


def refused(error, *parts):
    """An error whose message holds all parts, in this order."""
    return pytest.raises(error, match="(?s)" + ".*".join(re.escape(part) for part in parts))


# -------------------------------------------------------------------------------- values of X and y


def fit(X=X, y=Y, sample_weight=None, groups=None, **settings):
    return ANFISRegressor(**settings).fit(X, y, sample_weight, groups)


@cache
def line(as_frame=False):
    return ANFISRegressor(**QUICK).fit(FRAME if as_frame else X, Y)


@NOT_FINITE
@pytest.mark.parametrize("as_frame", [False, True])
def test_entry_of_x_that_is_not_finite(value, kind, as_frame):
    bad = with_entry(X, ([7, 40], [2, 2]), value)
    name = "rate" if as_frame else "x2"
    bad = pd.DataFrame(bad, columns=NAMES) if as_frame else bad
    said = [f"Input X contains {kind}", f"{name!r}", "row 7", "2 of its 60", "Drop", "impute"]
    with refused(ValueError, *said):
        fit(bad)
    for method in METHODS:
        with refused(ValueError, *said):
            getattr(line(as_frame), method)(bad)


TIMES = pd.date_range("2020", periods=N_ROWS)
LO_HI = ["lo", "hi"] * (N_ROWS // 2)
COUNTS = pd.array([1, 2, None] * 20, dtype="Int64")
ONES = np.ones(N_ROWS)
NAN_IN_Y1 = with_entry(np.column_stack([Y, Y]), (4, 1), np.nan)
# What is given to fit, and what is said of it.
REFUSED = {
    "nullable": ({"X": FRAME.assign(n=COUNTS)}, ["NaN", "'n'", "row 2", "20 of its 60"]),
    "NaN in y": ({"y": with_entry(Y, 3, np.nan)}, ["Input y contains NaN", "row 3", "1 of its 60"]),
    "second y": ({"y": NAN_IN_Y1}, ["Input y contains NaN", "'y1'", "row 4"]),
    "complex y": ({"y": Y + 1j}, ["Complex data not supported"]),
    "text": ({"X": FRAME.assign(rate="warm")}, ["could not convert string to float", "'warm'"]),
    "columns of text": (
        {"X": FRAME.assign(kind="p", site="q")},
        ["text in column 'kind', first at row 0", "the columns 'site'", "OneHot"],
    ),
    "text as y": ({"y": np.array(LO_HI)}, ["y holds text", "'lo'", "must be a number"]),
    "text in a series as y": (
        {"y": pd.Series(LO_HI, name="error")},
        ["y holds text in column 'error', first at row 0", "'lo'"],
    ),
    "times as y": ({"y": pd.Series(TIMES, name="end")}, ["y holds times in column 'end'"]),
    "times alone": ({"X": pd.DataFrame({"start": TIMES})}, ["X holds times in column 'start'"]),
    "array of times": ({"X": TIMES.to_numpy()[:, None]}, ["X holds times (datetime64"]),
    "two y of one name": (
        {"y": pd.DataFrame(np.ones((N_ROWS, 2)), columns=["e", "e"])},
        ["y has 2 columns of the name 'e'"],
    ),
    "one row": ({"X": X[:1], "y": Y[:1]}, ["1 sample(s)", "minimum of 2", "ANFISRegressor"]),
    "3D y": ({"y": Y[:, None, None]}, ["Found array with dim 3", "ANFISRegressor"]),
    "lengths": ({"y": Y[:-1]}, ["inconsistent numbers of samples", "60", "59"]),
    "other groups": ({"groups": [1, 2]}, ["one entry per row", "length 60, groups 2", "every row"]),
    "kinds of groups": ({"groups": [1, "a"] * 30}, ["groups holds int and str", "text alone"]),
    "pairs": ({"groups": [(1, 2)] * N_ROWS}, ["groups must have one entry per row", "(60, 2)"]),
    "name of groups": ({"groups": "run"}, ["groups must have one entry per row", "shape ()"]),
    "masked groups": (
        {"groups": np.ma.masked_equal(np.arange(N_ROWS) // 10, 2)},
        ["groups has no value for 10 of 60 rows, first at row 20"],
    ),
    "target beyond floats": (
        {"y": pd.Series([1] * 59 + [10**400], name="error", dtype=object)},
        ["y holds values of type int in column 'error', first at row 59", "too large"],
    ),
    "missing group": ({"groups": [None] * N_ROWS}, ["groups has no value for 60 of 60 rows"]),
    "two X of one name": (
        {"X": FRAME.set_axis(["rate", "time", "rate"], axis=1)},
        ["X has 2 columns of the name 'rate'", "rename or drop"],
    ),
    "no columns": ({"X": FRAME[[]]}, ["X has no columns", "at least one"]),
    "no columns of y": ({"y": FRAME[[]]}, ["y has no columns"]),
    "MATLAB": ({"mf": "gbellmf"}, ["'gbellmf' is MATLAB's name", "mf='bell'"]),
    "weights": (
        {"partition": AgglomerativeClustering(n_clusters=2), "sample_weight": np.ones(N_ROWS)},
        ["AgglomerativeClustering", "no sample_weight", "KMeans", "'grid'"],
    ),
    "negative weight": ({"sample_weight": with_entry(ONES, 4, -2.0)}, ["Negative", "-2 at row 4"]),
    "no weight": ({"sample_weight": 0.0 * ONES}, ["sample_weight leaves 0 of 60", "at least 2"]),
    "weight of one row": (
        {"sample_weight": with_entry(0.0 * ONES, 3, 1.0)},
        ["sample_weight leaves 1 of 60 rows", "at least 2"],
    ),
    "NaN weight": (
        {"sample_weight": with_entry(ONES, 4, np.nan)},
        ["sample_weight contains NaN", "first at row 4", "1 of its 60"],
    ),
    "missing weight": ({"sample_weight": [1.0] * 59 + [None]}, ["NaN", "first at row 59"]),
    "other weights": (
        {"sample_weight": ONES[:-1]},
        ["sample_weight must have one entry per row", "length 60", "(59,)", "every row"],
    ),
    "text as weights": ({"sample_weight": LO_HI}, ["sample_weight holds text, first at row 0"]),
    "name of weights": ({"sample_weight": "rate"}, ["sample_weight holds text", "'rate'"]),
    "2D weights": (
        {"sample_weight": np.ones((N_ROWS, 2))},
        ["sample_weight must have one entry per row", "(60, 2)"],
    ),
    "noise": ({"partition": DBSCAN(eps=1e-9)}, ["partition found no cluster", "noise"]),
    "clusters of a few rows": (
        {"partition": KMeans(3), "X": FRAME.iloc[[0, 1] * 30], "y": Y[[0, 1] * 30]},
        ["partition=KMeans(", "rows that count: 2", "n_clusters=3"],
    ),
    "no rules": ({"partition": ANFISRegressor()}, ["has no rules", "not been fitted", "model_"]),
    "a class": ({"partition": KMeans}, ["is a class", "KMeans(...)"]),
    "terms and clusters": (
        {"n_mfs": [2, 1, 2], "partition": KMEANS},
        ["n_mfs=[2, 1, 2] asks for a grid", "KMeans", "'auto'", "'grid'"],
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_fit_refuses(case):
    given, said = REFUSED[case]
    with refused(ValueError, *said):
        fit(**given)


@pytest.mark.parametrize(
    ("no_table", "kind"),
    [
        (dict(zip(NAMES, X.T, strict=True)), "type dict"),
        (FRAME.to_records(index=False), "type tuple"),
        ([[1.0, 2.0, 3.0], *([[1.0, 2.0]] * (N_ROWS - 1))], "type list"),
        ("log.csv", "text"),
    ],
)
def test_x_that_is_no_table(no_table, kind):
    for act in (fit, line().predict):
        with pytest.raises((TypeError, ValueError), match=r"X must be a table.*DataFrame") as told:
            act(no_table)
        assert f"Input X holds {'values of ' * (kind != 'text')}{kind}" in str(told.value)


TEXT = ["X holds text in column 'rate', first at row 0", "'lo'", "drop the column, or encode"]


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        (LO_HI, TEXT),
        (pd.Categorical(LO_HI), TEXT),
        (pd.array(LO_HI, dtype="string"), TEXT),
        (["1.5", "2"] * 20 + LO_HI[:20], ["first at row 40", "'lo'", "Correct the value"]),
        (pd.Series([[1]] * N_ROWS), ["holds values of type list in column 'rate', first at row 0"]),
        (pd.Series(list(X)), ["holds values of type ndarray in column 'rate', first at row 0"]),
        (TIMES, ["X holds times in column 'rate' (datetime64", "number of seconds"]),
        (TIMES.tz_localize("UTC"), ["X holds times in column 'rate' (datetime64", "UTC"]),
        (TIMES.to_period(), ["X holds times in column 'rate' (period"]),
        (
            TIMES.date.astype(object),
            ["of type date in column 'rate', first at row 0", "of seconds"],
        ),
        (pd.Categorical(TIMES), ["X holds times in column 'rate' (datetime64", "of seconds"]),
        ([1.5, pd.NA] * 30, ["a missing value in column 'rate', first at row 1", "impute"]),
        (
            pd.Series([1, 10**400] * 30, dtype=object),
            ["type int in column 'rate', first at row 1", "too"],
        ),
    ],
)
def test_column_that_is_no_number_is_named(rate, said):
    bad = FRAME.assign(rate=rate)
    model = ANFISRegressor(**QUICK).fit(FRAME, Y)
    explained, frozen = partial(explain, model), model.model_.predict
    for act in (ANFISRegressor(**QUICK).fit, model.score, explained, frozen):
        with pytest.raises((TypeError, ValueError)) as refusal:
            act(bad, *[Y] * (act not in (explained, frozen)))
        assert re.search(".*".join(map(re.escape, said)), str(refusal.value))


def test_masked_values_are_not_taken_for_what_lies_beneath():
    masked = np.ma.array(X, mask=False)
    model = ANFISRegressor(**QUICK).fit(masked, Y)
    assert_array_equal(model.predict(X), ANFISRegressor(**QUICK).fit(X, Y).predict(X))
    masked[[7, 9], 1] = np.ma.masked
    with refused(ValueError, "X is a masked array", "2 of 60 rows", "row 7", "filled"):
        ANFISRegressor(**QUICK).fit(masked, Y)
    for act in (model.predict, model.model_.predict, partial(explain, model)):
        with refused(ValueError, "X is a masked array"):
            act(masked)
    mask = np.arange(N_ROWS) == 2
    with refused(ValueError, "y is a masked array", "1 of 60 rows", "row 2"):
        ANFISRegressor(**QUICK).fit(X, np.ma.array(Y, mask=mask))
    with refused(ValueError, "sample_weight is a masked array", "1 of 60 rows", "row 2"):
        ANFISRegressor(**QUICK).fit(X, Y, np.ma.array(ONES, mask=mask))


def test_frames_of_polars():
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame({name: FRAME[name].to_numpy() for name in NAMES})
    model = ANFISRegressor(**QUICK).fit(frame, Y)
    with refused(TypeError, "X is a lazy frame", "X.collect()"):
        ANFISRegressor().fit(frame.lazy(), Y)
    for act in (model.predict, model.model_.predict, partial(explain, model)):
        with refused(TypeError, "X is a lazy frame", "X.collect()"):
            act(frame.lazy())
    for what in ("y", "sample_weight", "groups"):
        with refused(TypeError, f"{what} is a lazy frame"):
            ANFISRegressor().fit(frame, **({"y": Y} | {what: frame.lazy()}))
    with refused(ValueError, "X holds text in column 'rate', first at row 0", "'lo'"):
        model.predict(frame.with_columns(polars.Series("rate", LO_HI)))
    with refused(ValueError, "X holds times in column 'time'"):
        model.predict(frame.with_columns(polars.Series("time", TIMES.to_numpy())))


def test_tables_of_pyarrow():
    pyarrow = pytest.importorskip("pyarrow")
    table = pyarrow.Table.from_pandas(FRAME)
    model = ANFISRegressor(**QUICK).fit(table, pyarrow.table({"drift": Y}))
    assert model.model_.output_names == ("drift",)
    expected = model.predict(FRAME)
    assert_array_equal(model.predict(table), expected)
    assert_array_equal(model.model_.predict(table.select(NAMES[::-1])), expected)
    assert_array_equal(explain(model, table)["value"], explain(model, FRAME)["value"])
    place = NAMES.index("rate")
    for entries, said in ((LO_HI, "X holds text in column 'rate'"), (TIMES, "X holds times")):
        with refused(ValueError, said):
            model.predict(table.set_column(place, "rate", pyarrow.array(entries)))


class OfXarray(np.ndarray):
    """An array with dask's method, as all of xarray's have it: in memory, if there is no graph."""

    graph = None

    def __dask_graph__(self):
        return self.graph


def test_array_that_could_be_lazy_and_is_not():
    rows, target = X.view(OfXarray), Y.view(OfXarray)
    model = ANFISRegressor(**QUICK).fit(rows, target, sample_weight=ONES.view(OfXarray))
    assert_array_equal(model.predict(rows), line().predict(X))
    assert_array_equal(model.model_.predict(rows), line().model_.predict(X))
    rows.graph = {}
    for act in (lambda lazy: fit(lazy), model.predict, model.model_.predict):
        with refused(TypeError, "X is a dask collection", "X.compute()"):
            act(rows)


@pytest.mark.parametrize("groups", [TIMES, LO_HI, pd.Series(LO_HI, dtype="category")])
def test_groups_of_any_one_kind_serve(groups):
    # To one rule they make no difference.
    assert_array_equal(fit(groups=groups, **QUICK).predict(X), line().predict(X))
    # An error elsewhere is not taken for theirs.
    with refused(ValueError, "inconsistent numbers of samples"):
        ANFISRegressor(**QUICK).fit(X, Y[:-1], groups=groups)


@pytest.mark.parametrize(
    ("form", "remedy"),
    [
        (sparse.csr_matrix, "toarray"),
        (sparse.csr_array, "sparse_output=False"),
        (lambda X: pd.DataFrame(X).astype(pd.SparseDtype(float, 0.0)), "X.sparse.to_dense()"),
        (lambda X: pd.DataFrame(X).astype(pd.SparseDtype(float, np.nan)), "X.sparse.to_dense()"),
    ],
)
def test_sparse_x(form, remedy):
    for act in (lambda X: fit(X), line().predict):
        with refused(TypeError, "Sparse data was passed for X", remedy):
            act(form(X))


# ------------------------------------------------------------------------------------------- shapes


@pytest.mark.parametrize("name", [*METHODS, "n_rules_", "rules_", "memberships_", "consequents_"])
def test_before_fit(name):
    with refused(NotFittedError, "not fitted yet", "fit"):
        getattr(ANFISRegressor(), name)(X)
    assert hasattr(ANFISRegressor(), name) is (name in METHODS)


# ----------------------------------------------------------------------------- data without content


def flat(column, value=4.25):
    return with_entry(X, (slice(None), column), value)


@pytest.mark.parametrize("settings", [{"n_mfs": [3, 2]}, {"max_rules": 2}, {"partition": KMEANS}])
def test_constant_columns_cost_nothing_however_many_they_are(settings, rng):
    """They get no terms and are no slopes that a row has to pay for, in no count of parameters."""
    inputs = rng.uniform(-1.0, 1.0, (60, 2))
    target = np.sin(4.0 * inputs[:, 0]) + 0.5 * inputs[:, 1] ** 2 + 0.05 * rng.normal(size=60)
    without = ANFISRegressor(**settings).fit(inputs, target)
    if "n_mfs" in settings:
        settings = {"n_mfs": [3] + [1] * 40 + [2]}
    # What rounding alone changes is constant too.
    wobble = np.where(rng.random(60) < 0.5, 4.25, np.nextafter(4.25, 5.0))
    still = {f"still {k}": wobble for k in range(40)}
    rows = pd.DataFrame({"time": inputs[:, 0]} | still | {"rate": inputs[:, 1]})
    with pytest.warns(ConstantInputWarning, match=r"'still 0' \(always 4\.25\).*Drop them"):
        model = ANFISRegressor(**settings).fit(rows, target)
    assert model.n_rules_ == without.n_rules_
    assert {term["input"] for term in model.memberships_} <= {"time", "rate"}
    assert_array_equal(model.consequents_[:, 2:-1], 0.0)
    told, deviation = model.predict(rows, return_std=True)
    expected, expected_deviation = without.predict(inputs, return_std=True)
    assert_allclose(told, expected, rtol=0, atol=1e-9)
    assert_allclose(deviation, expected_deviation, rtol=1e-7)


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")  # beside the error
def test_terms_asked_for_a_constant_column():
    with refused(ValueError, "n_mfs=[2, 3, 2]", "3 terms on column 'x1'", "constant", "1 there"):
        ANFISRegressor(n_mfs=[2, 3, 2]).fit(flat(1), Y)


def test_constant_column_that_moves_later_changes_nothing():
    with pytest.warns(ConstantInputWarning, match="'x1'"):
        model = ANFISRegressor(n_mfs=2, solver=VariableProjection(tol=0.1)).fit(flat(1), Y)
    for policy in ("clip", "linear"):
        frozen = model.model_.with_out_of_bounds(policy)
        assert_allclose(frozen.predict(flat(1, 99.0))[:, 0], model.predict(flat(1)), rtol=1e-12)


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.UnderdeterminedWarning")
@pytest.mark.parametrize("settings", [{}, {"n_mfs": 3}, {"partition": KMEANS}])
@pytest.mark.parametrize("order", [0, 1])
def test_rows_that_are_all_the_same_give_the_mean(settings, order):
    same = np.tile(X[:1], (N_ROWS, 1))
    with pytest.warns(ConstantInputWarning, match="'x0'.*'x1'.*'x2'"):
        model = ANFISRegressor(order=order, **settings).fit(same, Y)
    assert_allclose(model.predict(X[:1]), Y.mean(), rtol=1e-12)


# -------------------------------------------------------------------------------------------- n_mfs

COUNT = "must be 'auto', a whole number, or one whole number per input"


@pytest.mark.parametrize(
    ("n_mfs", "error", "said"),
    [
        ([2, 2], ValueError, ["has the length 2", "time, temperature, rate"]),
        ([], ValueError, ["has the length 0", "time, temperature, rate"]),
        (0, ValueError, ["n_mfs=0 must be 1 or more", "1 means"]),
        ([2, 2, -3], ValueError, ["n_mfs=[2, 2, -3] must be 1 or more", "1 means"]),
        (True, TypeError, [COUNT]),
        (np.array(2), TypeError, [COUNT]),
        ([[2, 2, 2]], TypeError, [COUNT]),
        ([2, 2.5, 2], TypeError, ["n_mfs=[2, 2.5, 2]", "whole numbers only"]),
        ([None, 2, 2], TypeError, ["whole numbers only"]),
        (np.array([True, True, True]), TypeError, ["whole numbers only"]),
        ("3", ValueError, ["'n_mfs' parameter of ANFISRegressor", "'auto'", "Got '3'"]),
        (None, ValueError, ["'n_mfs' parameter", "'auto'", "Got None"]),
    ],
    ids=repr,
)
def test_number_of_terms_that_cannot_be(n_mfs, error, said):
    with refused(error, *said):
        ANFISRegressor(n_mfs=n_mfs).fit(FRAME, Y)


LIMIT = "limit is 1,024 MiB (sklearn.set_config(working_memory"


@pytest.mark.parametrize(
    ("n_inputs", "settings", "said"),
    [
        # 3^10 rules, with 11 coefficients each.
        (10, {"n_mfs": 3}, ["=3 on 10 inputs", "59,049 rules", "649,539", "45,065,222 MiB", LIMIT]),
        (10, {"n_mfs": [9] * 10}, ["on 10 inputs", "3,486,784,401 rules", "10^15 MiB"]),
        (8, {"n_mfs": 3}, ["6,561 rules with 59,049", LIMIT, "n_mfs=2 makes 256 rules"]),
        (400, {"n_mfs": 3}, ["n_mfs=3 on 400 inputs", "10^15 MiB"]),
        (1, {"n_mfs": 10**9}, ["1,000,000,000 rules", "10^15 MiB"]),
    ],
)
def test_more_rules_than_memory(n_inputs, settings, said, rng):
    wide = rng.normal(size=(50, n_inputs))
    with traced() as peak, refused(ValueError, *said, "KMeans"):
        ANFISRegressor(**settings).fit(wide, wide[:, 0])
    # Of a thousand and more.
    assert peak[0] < 2e6


# --------------------------------------------------------------------------------- other parameters


@pytest.mark.parametrize(
    ("parameter", "value", "allowed"),
    [
        ("mf", "triangel", "'gaussian'"),
        ("solver", "adam", "'varpro'"),
        ("partition", "forest", "'grid'"),
        ("partition", 3, "'fit_predict'"),
        ("out_of_bounds", "wrap", "'clip'"),
        ("order", 2, "[0, 1]"),
        ("alpha", -1e-9, "[0.0, inf)"),
        ("alpha", "large", "'auto'"),
        ("loss", "absolute", "'huber'"),
        ("early_stopping", 0.1, "'skanfis.options.EarlyStopping'"),
        ("max_iter", -1, "[0, inf)"),
        ("random_state", "lucky", "RandomState"),
        ("n_jobs", 1.5, "int"),
        ("n_jobs", 0, "[1, inf)"),
    ],
)
def test_parameter_of_the_wrong_type_or_range(parameter, value, allowed):
    estimator = ANFISRegressor(**{parameter: value})
    with pytest.raises(ValueError, match=f"'{parameter}' parameter of ANFISRegressor") as refusal:
        estimator.fit(X, Y)
    assert allowed in str(refusal.value)
    assert f"Got {value!r} instead" in str(refusal.value)


@pytest.mark.parametrize(
    ("given", "setting", "advice"),
    [
        ({}, "solver__stiffness", "give solver=VariableProjection(), of skanfis.learning"),
        ({"solver": "hybrid"}, "solver__step_size", "solver='hybrid'.*give solver=Hybrid()"),
        ({}, "partition__n_clusters", "give partition=KMeans(), of sklearn.cluster"),
        ({"loss": "huber"}, "loss__epsilon", "give loss=Huber(), of skanfis.options"),
        ({}, "early_stopping__tol", "early_stopping=False.*give early_stopping=EarlyStopping()"),
        ({}, "out_of_bounds__max_extrapolation", "give out_of_bounds=LinearExtrapolation()"),
    ],
)
def test_setting_of_a_word(given, setting, advice):
    model = ANFISRegressor(**given)
    with refused(ValueError, f"{setting} is a setting", *advice.split(".*")):
        model.set_params(**{setting: 1.0})
    assert model.get_params() == ANFISRegressor(**given).get_params()
    # The object may come with it, or be there.
    model.set_params(solver=Hybrid(), solver__step_size=0.5)
    assert model.set_params(solver__step_size=0.25).solver.step_size == 0.25


@pytest.mark.parametrize(
    ("parameter", "option", "wrong"),
    [
        ("solver", VariableProjection(tol=-1e-4), "tol"),
        ("solver", Hybrid(stiffness=-0.1), "stiffness"),
        ("solver", Hybrid(step_size=0.0), "step_size"),
        ("solver", GradientDescent(error_goal=-1.0), "error_goal"),
        ("loss", Huber(epsilon=0.09), "epsilon"),
        ("early_stopping", EarlyStopping(validation_fraction=1.0), "validation_fraction"),
        ("early_stopping", EarlyStopping(n_iter_no_change=0), "n_iter_no_change"),
        ("out_of_bounds", LinearExtrapolation(-0.5), "max_extrapolation"),
    ],
)
def test_option_whose_own_parameter_is_wrong(parameter, option, wrong):
    with refused(ValueError, f"'{wrong}' parameter of {type(option).__name__}", "range"):
        ANFISRegressor(n_mfs=2, **{parameter: option}).fit(X, Y)
