"""The loss curve is the estimator's."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis.inspection import LossCurveDisplay

from .drawing import A_GRID, drawn, plt


def test_loss_is_the_estimators(fitted):
    pipe, _ = fitted
    display = drawn(LossCurveDisplay.from_estimator(pipe))
    assert_array_equal(display.line_.get_ydata(), pipe[-1].loss_curve_)
    assert_array_equal(display.line_.get_xdata(), np.arange(len(pipe[-1].loss_curve_)))
    assert display.status == pipe[-1].status_
    assert display.line_.get_label() == "varpro"
    assert display.ax_.get_yscale() == "log"


def test_losses_share_axes():
    _, ax = plt.subplots()
    LossCurveDisplay(loss=np.array([1.0, 0.5])).plot(ax=ax)
    LossCurveDisplay(loss=np.array([1.0, 0.0]), name="exact").plot(ax=ax, color="red")
    assert [line.get_color() for line in ax.get_lines()][1] == "red"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["exact"]


def test_a_model_alone_has_no_loss_curve():
    with pytest.raises(TypeError, match="estimator must be a fitted ANFIS estimator"):
        LossCurveDisplay.from_estimator(A_GRID)
