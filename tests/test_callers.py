"""Warnings of a cross-validation are silent unless asked for, and speak the user's language."""

import re
import warnings

import numpy as np
import pandas as pd
import pytest
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.decomposition import PCA
from sklearn.model_selection import GridSearchCV, GroupKFold, KFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler, StandardScaler

from skanfis import ANFISRegressor
from skanfis.exceptions import ConstantInputWarning, OutOfBoundsWarning

rng = np.random.default_rng(0)
FRAME = pd.DataFrame({"kelvin": rng.uniform(250.0, 350.0, 60), "hours": np.arange(60.0)})
Y = (FRAME["kelvin"] / 100.0) ** 2
BEYOND = FRAME.assign(kelvin=FRAME["kelvin"] + 30.0)
LINE = ANFISRegressor(n_mfs=1)
FOLDS = KFold(3)  # in order: every fold but the middle one leaves the range of "hours"


def told(pipe, table):
    with pytest.warns(OutOfBoundsWarning) as caught:
        pipe.predict(table)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    return str(caught[0].message)


def test_a_search_says_nothing_and_what_it_keeps_speaks():
    pipe = make_pipeline(StandardScaler(), LINE)
    search = GridSearchCV(pipe, {"anfisregressor__alpha": [0.01, 0.1]}, cv=FOLDS).fit(FRAME, Y)
    cross_val_predict(pipe, FRAME, Y, cv=FOLDS)  # warnings are errors here
    assert "'kelvin'" in told(search, BEYOND)


def test_a_filter_that_names_the_category_asks_for_all():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", OutOfBoundsWarning)
        cross_val_predict(LINE, FRAME, Y, cv=FOLDS)
    hours = [w for w in caught if "'hours' in 20 of 20 rows" in str(w.message)]
    assert len(hours) == 2


FRONTS = {
    "scaler": StandardScaler(),
    "nested": make_pipeline(MinMaxScaler(), StandardScaler()),
    "columns": ColumnTransformer([("k", MinMaxScaler(), ["kelvin"])], remainder=StandardScaler()),
}


@pytest.mark.parametrize("front", FRONTS)
def test_columns_are_named_as_the_pipeline_was_given_them(front):
    target = TransformedTargetRegressor(make_pipeline(FRONTS[front], LINE))
    for pipe in (make_pipeline(FRONTS[front], LINE), make_pipeline("passthrough", target)):
        message = told(pipe.fit(FRAME, Y), BEYOND)
        kelvin, found = FRAME["kelvin"], BEYOND["kelvin"]
        outside = (found > kelvin.max()).sum()
        expected = (
            f"'kelvin' in {outside} of 60 rows (trained on [{kelvin.min():.6g}, "
            f"{kelvin.max():.6g}], found [{found.min():.6g}, {found.max():.6g}])"
        )
        assert expected in message
        assert "'hours'" not in message


def test_columns_that_a_step_mixes_are_its_own():
    pipe = make_pipeline(PCA(2), StandardScaler().set_output(transform="pandas"), LINE)
    assert re.search(r"'(x|pca)[01]' in", told(pipe.fit(FRAME, Y), BEYOND))


def test_constant_column_is_named_as_the_pipeline_was_given_it():
    front = ColumnTransformer([("k", MinMaxScaler(), ["kelvin"])], remainder=StandardScaler())
    front.set_params(verbose_feature_names_out=False)
    pipe = make_pipeline(front, LINE)
    with pytest.warns(ConstantInputWarning, match=r"'hours' \(always 0 after the steps in front"):
        pipe.fit(FRAME.assign(hours=3.0), Y)
    with pytest.warns(ConstantInputWarning, match=r"'hours' \(always 0\)"):
        LINE.fit(FRAME.assign(hours=-0.0), Y)
    runs = [0] * 30 + [1] * 30
    held = FRAME.assign(hours=runs)
    # Within each fold of two runs the column is constant; of all rows it is not.
    cross_val_predict(pipe, held, Y, groups=runs, cv=GroupKFold(2))
