"""The gyro application: from a calibration log to a checked compensator."""

from ._checks import check_log
from ._split import group_by_rate_level
from .allan import allan_coefficients, allan_deviation
from .c_code import export_c_physics
from .compensator import GyroCompensator
from .compose import ResidualRegressor
from .displays import (
    AllanDisplay,
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)
from .errors import LogError
from .features import ThermalRate
from .log import read_log
from .metrics import (
    bias,
    bias_stability,
    hysteresis,
    input_error,
    scale_factor,
)
from .physics import OpenLoopArcsineRegressor
from .report import gyro_report

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
    "allan_coefficients",
    "allan_deviation",
    "bias",
    "bias_stability",
    "check_log",
    "export_c_physics",
    "group_by_rate_level",
    "gyro_report",
    "hysteresis",
    "input_error",
    "read_log",
    "scale_factor",
]
