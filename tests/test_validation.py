"""The checks alone, where the estimator's tests do not reach: blocks, overflow, switches."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal
from sklearn import config_context
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import _validation
from skanfis._validation import check_finite, feature_indices, group_numbers
from skanfis.exceptions import ConstantInputWarning, OutOfBoundsWarning

from .quick import quick

NAMES = ["a", "b"]
NOT_FINITE = pytest.mark.parametrize(
    ("value", "kind"), [(np.nan, "NaN"), (np.inf, "infinity"), (-np.inf, "infinity")]
)


def message_of(values, what="X"):
    with pytest.raises(ValueError, match="not finite") as refusal:
        check_finite(values, what, NAMES)
    return str(refusal.value)


@pytest.mark.parametrize("row", [0, 6, 7, 8, 19])
@pytest.mark.parametrize("column", [0, 1])
@NOT_FINITE
def test_first_place_is_found_in_any_block(monkeypatch, row, column, value, kind):
    monkeypatch.setattr(_validation, "LARGE_BLOCK_ROWS", 7)
    values = np.ones((20, 2))
    values[row, column] = value
    values[19, 1] = value
    message = message_of(values, "y")
    assert message.startswith(f"Input y contains {kind} in column {NAMES[column]!r}")
    assert f"first at row {row};" in message
    expected = 1 + (column == 1 and row < 19)
    assert f"{expected} of its 20 values" in message


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_numbers_so_large_that_their_sum_overflows_are_finite(dtype):
    values = np.full((100, 2), np.finfo(dtype).max)
    check_finite(values, "X", NAMES)
    values[50, 1] = np.nan
    assert "NaN in column 'b', first at row 50" in message_of(values)


def test_check_is_switched_off_with_that_of_scikit_learn():
    bad = np.array([[np.nan, 1.0]])
    with config_context(assume_finite=True):
        assert check_finite(bad, "X", NAMES) is None
    assert "first at row 0" in message_of(bad)


@pytest.mark.parametrize("missing", [None, np.nan, np.datetime64("NaT", "s"), pd.NaT, pd.NA])
def test_a_missing_group_is_named_whatever_stands_for_it(missing):
    with pytest.raises(ValueError, match="no value for 1 of 3 rows, first at row 1"):
        group_numbers([1, missing, 2], 3)
    for groups in ([7, 5, 7], ["b", "a", "b"]):
        assert group_numbers(groups, 3).tolist() == [1, 0, 1]


def test_a_series_by_names_of_columns_is_read_by_name():
    """And not in its own order, which may be another; without all names, by position."""
    rows = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 3))
    X, y = pd.DataFrame(rows, columns=["a", "b", "c"]), rows[:, 0] ** 2
    order = ["c", "a", "b"]
    given = {
        "n_mfs": [1, 3, 2],
        "mf": ["bell", "gaussian", "triangular"],
        "premise_features": [False, True, True],
        "consequent_features": [True, True, False],
    }
    named = {key: pd.Series(values, index=order) for key, values in given.items()}
    model = quick(**named).fit(X, y)
    by_position = quick(**{key: [v[1], v[2], v[0]] for key, v in given.items()}).fit(X, y)
    assert_array_equal(model.predict(X), by_position.predict(X))
    of_inputs = {(term["input"], term["function"]) for term in model.memberships_}
    assert of_inputs == {("a", "gaussian"), ("b", "triangular")}
    assert [slopes.any() for slopes in model.consequents_[:, 1:].T] == [True, False, True]
    assert quick(pd.Series([3, 2, 1])).fit(X, y).n_rules_ == 6
    for label, message in (("d", "n_mfs names 'd', which is no column"), ("c", "a column twice")):
        with pytest.raises(ValueError, match=message):
            quick(named["n_mfs"].rename({"a": label})).fit(X, y)


def test_a_warning_points_at_the_line_of_the_user_however_deep_it_arises():
    X, y = np.random.default_rng(0).normal(size=(2, 60, 1))
    X = np.hstack([X, np.ones_like(X)])  # a constant input
    search = GridSearchCV(make_pipeline(StandardScaler(), quick()), {"anfisregressor__n_mfs": [2]})
    with pytest.warns(ConstantInputWarning) as told:
        search.fit(X, y.ravel())
    with pytest.warns(OutOfBoundsWarning) as outside:
        search.predict(X + 10.0)
    assert {Path(one.filename) for one in [*told, *outside]} == {Path(__file__)}


def test_names_in_a_series_may_have_any_labels_masks_those_of_columns():
    names = ["a", "b", "c"]
    given = pd.Series(["c", "a", "b"], index=list("xyz"))
    assert feature_indices(given, names, "premise_features").tolist() == [0, 1, 2]
    mask = pd.Series([True, False, False], index=list("cba"))
    assert feature_indices(mask, names, "premise_features").tolist() == [2]
    with pytest.raises(ValueError, match="premise_features names 'x'"):
        feature_indices(mask.set_axis(list("xyz")), names, "premise_features")
