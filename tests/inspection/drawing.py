"""What the tests of the displays share."""

import pytest

from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES

__all__ = ["ALL", "A_GRID", "NAMES", "drawn", "plt"]

plt = pytest.importorskip("matplotlib.pyplot")
ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]


def drawn(display):
    """Draw the figure: what is wrong in it raises or warns now."""
    display.figure_.canvas.draw()
    return display
