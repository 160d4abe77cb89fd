"""What the tests of the displays share."""

import pytest

from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES

__all__ = ["ALL", "A_GRID", "EACH", "NAMES", "drawn", "plt"]

plt = pytest.importorskip("matplotlib.pyplot")
ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
# One of every kind, of both orders and both numbers of outputs, for what takes its time.
ONE_OF_EACH = {
    name: model
    for place, (name, model) in enumerate(EVERY_PAIR.items())
    if place % 2 == place // 4 % 2
}
EACH = pytest.mark.parametrize("model", ONE_OF_EACH.values(), ids=list(ONE_OF_EACH))
A_GRID = MODELS["grid, order 1, 1 outputs"]


def drawn(display):
    """Draw the figure: what is wrong in it raises or warns now."""
    display.figure_.canvas.draw()
    return display
