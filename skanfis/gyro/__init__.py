"""The gyro application: from a calibration log to a checked compensator."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._checks import check_log
    from ._split import group_by_rate_level
    from .c_code import export_c_physics
    from .compensator import GyroCompensator
    from .compose import ResidualRegressor
    from .displays import AllanDisplay, ErrorDisplay, GroupResidualDisplay
    from .errors import LogError
    from .log import read_log
    from .physics import OpenLoopArcsineRegressor
    from .report import gyro_report
    from .thermal_displays import (
        CoverageDisplay,
        HysteresisDisplay,
        ResidualSurfaceDisplay,
        ScaleFactorErrorDisplay,
    )
    from .thermal_rate import ThermalRate

__all__ = [
    "AllanDisplay",
    "CoverageDisplay",
    "ErrorDisplay",
    "GroupResidualDisplay",
    "GyroCompensator",
    "HysteresisDisplay",
    "LogError",
    "OpenLoopArcsineRegressor",
    "ResidualRegressor",
    "ResidualSurfaceDisplay",
    "ScaleFactorErrorDisplay",
    "ThermalRate",
    "check_log",
    "export_c_physics",
    "group_by_rate_level",
    "gyro_report",
    "read_log",
]
_HOMES = (
    "_checks _split c_code compensator compose displays errors log physics report "
    "thermal_displays thermal_rate"
)


def __dir__():
    return __all__


def __getattr__(name):
    # Imported on demand, so that __main__.py can handle Ctrl-C before libraries load.
    for home in _HOMES.split() if name in __all__ else ():
        if hasattr(module := import_module(f".{home}", __name__), name):
            return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
