"""Certain bounds: what a model can say on a box of inputs, proven."""

from .certified import Bounds, bounds, gradient_bounds, monotonicity
from .constraints import FixedPoint, OutputLimits

__all__ = ["Bounds", "FixedPoint", "OutputLimits", "bounds", "gradient_bounds", "monotonicity"]
