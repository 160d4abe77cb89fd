r"""Figures of merit in the terms of IEEE 952, as plain functions of columns of a log.

Conventions: the true rate is in deg/s, temperatures in degC, times in s, and every argument is one
column, one value per row. Scale factors are found in whatever unit the output has. Bias figures
take the *error*, in deg/s at the input, and give deg/h; :func:`input_error` makes it of an output.

The gyro model of the standard, S0 (dN/dt) = (I + E + D) / (1 + 1e-6 e_K), has the input rate I, the
drift D with its temperature and ramp terms D_T dT + D_Tdot dT/dt, and the scale-factor error
e_K = e_T dT + f(I) in ppm. Definitions that are Chinese practice (GJB 2426) rather than the IEEE's
are marked so.

Where a figure does not exist (no rate of one sign, one run only, no common temperature) these
functions raise ValueError and say why; they never return NaN.

The figures over runs are made in two steps, one value (or two) per run and then one of all: a
bootstrap over runs repeats the second only.
"""

from ._lines import rms
from ._runs import rows_by_run
from .bias import (
    bias,
    bias_ramp_sensitivity,
    bias_repeatability,
    bias_temperature_sensitivity,
    error_by_run,
    hysteresis,
    input_error,
    spread_of_bias,
)
from .residual import reduction_factor, residual_peak, residual_peak_to_peak, residual_rms
from .scale_factor import (
    relative_spread,
    scale_factor,
    scale_factor_asymmetry,
    scale_factor_by_run,
    scale_factor_error,
    scale_factor_nonlinearity,
    scale_factor_repeatability,
    scale_factor_temperature_sensitivity,
)
from .stability import bias_stability, pooled_deviation, squares_by_run

__all__ = [
    "bias",
    "bias_ramp_sensitivity",
    "bias_repeatability",
    "bias_stability",
    "bias_temperature_sensitivity",
    "error_by_run",
    "hysteresis",
    "input_error",
    "pooled_deviation",
    "reduction_factor",
    "relative_spread",
    "residual_peak",
    "residual_peak_to_peak",
    "residual_rms",
    "rms",
    "rows_by_run",
    "scale_factor",
    "scale_factor_asymmetry",
    "scale_factor_by_run",
    "scale_factor_error",
    "scale_factor_nonlinearity",
    "scale_factor_repeatability",
    "scale_factor_temperature_sensitivity",
    "spread_of_bias",
    "squares_by_run",
]
