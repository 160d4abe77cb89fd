"""Certain bounds: what a model can say on a box of inputs, proven.

:func:`bounds` encloses every prediction, :func:`gradient_bounds` every slope by one input, and
:func:`monotonicity` proves that predictions rise or fall with an input. ``enclosure`` has the
formulas, ``search`` the branch and bound.
"""

from .certified import Bounds, bounds, gradient_bounds, monotonicity
from .constraints import FixedPoint, OutputLimits

__all__ = ["Bounds", "FixedPoint", "OutputLimits", "bounds", "gradient_bounds", "monotonicity"]
