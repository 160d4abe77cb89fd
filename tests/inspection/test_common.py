"""Single panels are drawn where asked, and without matplotlib displays say what to install."""

import numpy as np
import pytest

from skanfis.inspection import (
    LossCurveDisplay,
    ResponseSurfaceDisplay,
    RuleActivationDisplay,
    RuleContributionDisplay,
)

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
    with pytest.raises(ImportError, match="pip install 'skanfis\\[plot\\]'"):
        LossCurveDisplay(loss=np.ones(2)).plot()
