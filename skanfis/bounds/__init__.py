"""Proven bounds of the predictions of a model on a box of inputs, and of their slopes."""

from .certified import Bounds, bounds, gradient_bounds, monotonicity
from .constraints import FixedPoint, OutputLimits

__all__ = ["Bounds", "FixedPoint", "OutputLimits", "bounds", "gradient_bounds", "monotonicity"]
