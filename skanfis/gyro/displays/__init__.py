"""Pictures of a compensation, after scikit-learn's Displays: they store tables and draw them."""

from .errors import (
    AllanDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ScaleFactorErrorDisplay,
)
from .maps import CoverageDisplay, ResidualSurfaceDisplay

__all__ = [
    "AllanDisplay",
    "CoverageDisplay",
    "ErrorDisplay",
    "GroupResidualDisplay",
    "HysteresisDisplay",
    "ResidualSurfaceDisplay",
    "ScaleFactorErrorDisplay",
]
