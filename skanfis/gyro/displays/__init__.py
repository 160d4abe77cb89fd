"""Pictures of a compensation, after scikit-learn's Displays: they store arrays and draw them."""

from .allan import AllanDisplay
from .coverage import CoverageDisplay
from .error import ErrorDisplay
from .groups import GroupResidualDisplay
from .hysteresis import HysteresisDisplay
from .scale_factor import ScaleFactorErrorDisplay
from .surface import ResidualSurfaceDisplay

__all__ = [
    "AllanDisplay",
    "CoverageDisplay",
    "ErrorDisplay",
    "GroupResidualDisplay",
    "HysteresisDisplay",
    "ResidualSurfaceDisplay",
    "ScaleFactorErrorDisplay",
]
