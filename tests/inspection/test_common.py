"""What holds for all displays: where they draw, what they need, models that know of no data."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis.inspection import (
    LossCurveDisplay,
    ResponseSurfaceDisplay,
    RuleActivationDisplay,
    RuleContributionDisplay,
    rules_html,
)

from ..export.rule_bases import rows_of
from .drawing import A_GRID, plt


@pytest.mark.parametrize(
    "display",
    [
        RuleActivationDisplay.from_estimator,
        ResponseSurfaceDisplay.from_estimator,
        RuleContributionDisplay.from_estimator,
    ],
)
def test_single_panels_are_drawn_where_asked(display):
    _, ax = plt.subplots()
    assert display(A_GRID, ax=ax).ax_ is ax


def test_displays_say_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match=r"pip install matplotlib .*'\.\[plot\]'"):
        LossCurveDisplay(loss=np.ones(2)).plot()


def test_a_model_without_data_is_not_said_to_lack_them():
    # As read from a .fis file: nothing is known of the data, which is not the same as no data.
    model = replace(
        A_GRID,
        rule_weights=np.full(12, 1 / 12),
        rule_rows=np.zeros(12),
        support=None,
        reference=np.zeros(3),
    )
    surface = ResponseSurfaceDisplay.from_estimator(model, grid_resolution=5)
    assert_array_equal(surface.coverage, 1.0)
    assert surface.held == {"rate": pytest.approx((model.minimum[2] + model.maximum[2]) / 2)}
    assert_array_equal(RuleContributionDisplay.from_estimator(model).coverage, 1.0)
    with pytest.raises(ValueError, match="read from a file and knows of no data: give X"):
        RuleActivationDisplay.from_estimator(model)
    assert RuleActivationDisplay.from_estimator(model, rows_of(model, 1.0)).rows.sum() == 40
    assert "weight" not in rules_html(model, max_rules=3).replace("font-weight", "")
