"""What is proven of a calibration's rules over a box: the largest compensation, the rate's sign."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..bounds import bounds, gradient_bounds

__all__ = ["Certain", "certain_of"]

# For each bound; what is reached with them holds, and is told to be no tighter.
_MOST_BOXES = 20_000


@dataclass(frozen=True)
class Certain:
    """Proven bounds.

    ``found`` are :class:`~skanfis.bounds.Bounds` of what the rules give [deg/s]. ``rate_rises`` is
    whether the compensated rate is proven to go with the output, in the sense of the scale factor,
    all over the box; None where the output is no input, or a law beside the rules is not bounded.
    """

    found: Any
    rate_rises: bool | None

    @property
    def largest(self):
        """What no compensation in the box exceeds in size [deg/s]."""
        return float(self.found.magnitude[0])

    @property
    def attained(self):
        """The largest size that was met in the box [deg/s], and the inputs where it was."""
        found = self.found
        sides = [(abs(found.lowest[0]), found.at_lowest[0])]
        sides.append((abs(found.highest[0]), found.at_highest[0]))
        size, place = max(sides, key=lambda side: side[0])
        return float(size), place


def certain_of(calibration):
    """Bounds over the box of the recipe, other inputs in the range of the calibration."""
    recipe, compensator = calibration.recipe, calibration.compensator
    box = {name: (low, high) for name, low, high in recipe.box} or None
    found = bounds(calibration.rules, box, max_boxes=_MOST_BOXES)
    if recipe.physics or "output" not in recipe.inputs:
        return Certain(found, None)
    # rate = output / factor - error: its slope has the factor's sign where the error's is less.
    slope = gradient_bounds(calibration.rules, "output", box, max_boxes=_MOST_BOXES)
    own = 1.0 / compensator.scale_factor
    rises = slope.upper[0] < own if own > 0.0 else slope.lower[0] > own
    return Certain(found, bool(np.all(rises)))
