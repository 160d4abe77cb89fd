"""The surface is the prediction."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import MinMaxScaler

from skanfis import ANFISRegressor
from skanfis.inspection import ResponseSurfaceDisplay

from ..export.rule_bases import rows_of
from .drawing import A_GRID, ALL, drawn


@ALL
def test_surface_is_the_prediction_with_the_rest_held(model):
    display = ResponseSurfaceDisplay.from_estimator(
        model, features=("rate", 0), held={1: 30.0}, output=-1, grid_resolution=7
    )
    rows = np.column_stack([display.xx1.ravel(), np.full(49, 30.0), display.xx0.ravel()])
    assert_allclose(display.response.ravel(), model.predict(rows)[:, -1], rtol=1e-12)
    assert_allclose(display.coverage.ravel(), model.coverage(rows), rtol=1e-12)
    assert display.held == {"chip temperature": 30.0}
    assert display.ax_.get_xlabel() == "rate"
    assert display.ax_.get_ylabel() == "time"
    assert display.xx0.min() == model.minimum[2]
    assert display.xx1.max() == model.maximum[0]


@pytest.mark.parametrize("plot_method", ["contourf", "pcolormesh"])
def test_surface_of_a_pipeline_over_its_data(fitted, plot_method):
    pipe, X = fitted
    target = TransformedTargetRegressor(pipe, transformer=MinMaxScaler())
    target.fit(X, pipe.predict(X))
    display = drawn(ResponseSurfaceDisplay.from_estimator(target, X, plot_method=plot_method))
    assert_array_equal(display.points, X)
    assert display.held == {}
    corner = pd.DataFrame([X.max()])
    assert display.response[-1, -1] == pytest.approx(target.predict(corner)[0], rel=1e-9)


def test_what_is_not_held_stands_at_its_mean():
    display = ResponseSurfaceDisplay.from_estimator(A_GRID, features=(0, 2), grid_resolution=3)
    assert display.held == {"chip temperature": A_GRID.reference[1]}
    assert "chip temperature = 18.5" in display.ax_.get_title(loc="left")


def test_colours_are_set_by_where_the_data_are():
    rows = rows_of(A_GRID, 0.2)
    wide = ResponseSurfaceDisplay.from_estimator(A_GRID, grid_resolution=41)
    narrow = ResponseSurfaceDisplay.from_estimator(A_GRID, rows, grid_resolution=41)
    assert np.ptp(narrow.surface_.levels) < np.ptp(wide.surface_.levels)


def test_a_flat_surface_can_be_drawn():
    X = np.random.default_rng(0).uniform(size=(20, 2))
    flat = ANFISRegressor(n_mfs=2, solver="lse").fit(X, np.full(20, 3.0))
    drawn(ResponseSurfaceDisplay.from_estimator(flat, X, grid_resolution=4))


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"features": (0, 0)}, ValueError, "the same input twice"),
        ({"features": (0,)}, ValueError, "must be two inputs"),
        ({"features": "rate"}, ValueError, "must be two inputs"),
        ({"output": 1}, ValueError, "1 is no output: give a position from 0 to 0, or one of 'y'"),
        ({"held": [1.0]}, TypeError, "held must be a dict"),
        ({"held": {"rate": np.nan}}, ValueError, "must be a number in the range of training, from"),
        ({"held": {"rate": 5.0}}, ValueError, r"held\['rate'\]=5.0"),
        ({"held": {"rate": "high"}}, ValueError, r"held\['rate'\]='high'"),
        ({"grid_resolution": 1}, ValueError, "grid_resolution=1"),
        ({"plot_method": "bars"}, ValueError, "plot_method='bars'"),
    ],
)
def test_surface_parameters_are_checked(settings, error, message):
    with pytest.raises(error, match=message):
        ResponseSurfaceDisplay.from_estimator(A_GRID, **settings)


def test_a_model_of_one_input_has_no_surface():
    x = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
    with pytest.raises(ValueError, match="one input, and a surface takes two: RuleContribution"):
        ResponseSurfaceDisplay.from_estimator(ANFISRegressor(n_mfs=2).fit(x, x[:, 0]))
