"""Write a compensator as C, with notes on its inputs, their units, and the use of its output."""

from typing import Any

from ..export.c import CCode, export_c
from ..export.folding import found_by_search
from .c_code import export_c_physics
from .compose import FrozenRules, ResidualRegressor

SUBTRACT = "y[0] is the error of the raw rate: subtract y[0] from the raw rate."
_TAKE = "y[0] is the compensated rate: take it in the place of the raw rate."

# Units of the inputs of a compensator, and how the inputs are computed.
_UNITS = {"time": "s", "temperature": "degC", "temperature_rate": "degC/s"}
_NOTES = {
    "time": "time is that since power-on: zero at the first sample.",
    "temperature": "temperature is that of the thermometer that was logged in the calibration.",
    "temperature_rate": "temperature_rate is low-passed, with a time constant of $lag s. At "
    "power-on: temperature_rate = 0, previous = temperature. At every sample after that, h [s] "
    "after the one before: temperature_rate += (1 - exp(-h / $lag)) * ((temperature - previous) / "
    "h - temperature_rate); then previous = temperature.",
}


def export_c_compensator(compensator, path, *, std, dtype="double") -> CCode:
    """Write a GyroCompensator as C; its header says what inputs and output are, and their units."""
    found, units = found_by_search(compensator.estimator), input_units(compensator)
    export: Any = export_c_physics
    if not isinstance(found, ResidualRegressor):
        export, found = export_c, FrozenRules.of(found, len(compensator.inputs)).model
        units = {name: units[name] for name in compensator.inputs}
        units[found.output_names[0]] = "deg/s"
    assumed = [f"Unit assumed: {text}" for text in compensator.assumed.values()]
    return export(
        found,
        path,
        dtype=dtype,
        std=std,
        min_coverage=compensator.min_coverage,
        units=units,
        notes=notes_on(compensator) + assumed,
    )


def notes_on(compensator):
    """How to use the output, and how inputs are computed, as sentences."""
    use = SUBTRACT if compensator.predicts == "error" else _TAKE
    notes = [f"{use} {raw_rate_of(compensator)}"]
    notes += [note for name, note in _NOTES.items() if name in compensator.inputs]
    return [note.replace("$lag", f"{compensator.time_constant:g}") for note in notes]


def input_units(compensator):
    """Units of the inputs of a compensator, and of the rate."""
    return _UNITS | {"output": compensator.output_unit, "rate": "deg/s"}


def raw_rate_of(compensator):
    """What the raw rate is, as a sentence."""
    factor = compensator.scale_factor
    divided = "" if factor == 1.0 else f" divided by {factor:.9g}"
    raw = f"The raw rate [deg/s] is the output of the gyro [{compensator.output_unit}]{divided}."
    return f"{raw} What the true rate of the log left out, as the earth's, is taken for bias."
