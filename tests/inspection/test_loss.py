"""The loss curve is the estimator's."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis import ANFISRegressor
from skanfis.inspection import LossCurveDisplay
from skanfis.learning import VariableProjection

from .drawing import A_GRID, drawn, plt


def test_loss_is_the_estimators(fitted):
    pipe, _ = fitted
    display = drawn(LossCurveDisplay.from_estimator(pipe))
    assert_array_equal(display.line_.get_ydata(), pipe[-1].loss_curve_)
    assert_array_equal(display.line_.get_xdata(), np.arange(len(pipe[-1].loss_curve_)))
    assert display.status == pipe[-1].status_
    assert display.line_.get_label() == "VariableProjection"
    assert display.ax_.get_yscale() == "log"


def test_losses_share_axes():
    _, ax = plt.subplots()
    LossCurveDisplay(loss=np.array([1.0, 0.5])).plot(ax=ax)
    LossCurveDisplay(loss=np.array([1.0, 0.0]), name="exact").plot(ax=ax, color="red")
    assert [line.get_color() for line in ax.get_lines()][1] == "red"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["exact"]


def test_a_model_alone_has_no_loss_curve():
    with pytest.raises(TypeError, match="TSKModel has not been trained here"):
        LossCurveDisplay.from_estimator(A_GRID)


def test_rows_held_out_are_a_dashed_line_of_the_same_colour():
    X = np.random.default_rng(0).uniform(-3, 3, (80, 1))
    # With weights that are given the premises have not been moved before the run begins.
    given = {"agreement": 0.01, "alpha": 1e-6, "solver": VariableProjection(stiffness=1e-5)}
    model = ANFISRegressor(n_mfs=3, early_stopping=True, random_state=0, **given)
    model.fit(X, np.sin(X[:, 0]))
    display = drawn(LossCurveDisplay.from_estimator(model))
    line = display.validation_line_
    assert_array_equal(line.get_ydata(), model.validation_loss_curve_)
    assert line.get_xdata()[0] == 1
    assert line.get_xdata()[-1] <= len(model.loss_curve_)
    assert (line.get_linestyle(), line.get_color()) == ("--", display.line_.get_color())
    assert line.get_label() == "VariableProjection, rows held out"
