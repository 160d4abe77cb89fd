"""Words, units and tables that several sections share."""

import numpy as np

from .._law_text import law_text
from ..displays._style import figures

__all__ = [
    "law_formula",
    "law_table",
    "signs",
    "terms_text",
    "unit_of",
    "value_and_interval",
    "words",
]

_UNITS = {"time": "s", "temperature": "°C", "temperature_rate": "°C/s"}
_SIGNS = (("degC", "°C"), ("deg", "°"), ("sqrt(h)", "√h"))


def words(name):
    """A name in code as words."""
    return name.replace("_", " ")


def signs(unit):
    """A unit with the signs that are usual in print."""
    for name, sign in _SIGNS:
        unit = unit.replace(name, sign)
    return unit


def unit_of(calibration, name):
    """Sign of the unit of an input."""
    return signs(_UNITS.get(name, calibration.recipe.output_unit))


def terms_text(terms):
    """Numbers of fuzzy terms in words."""
    if terms is None:
        return "structure left to ANFISRegressor"
    return "terms " + " × ".join(map(str, terms))


def value_and_interval(line, which):
    """Cell of a figure of merit, "before" or "after"."""
    value = line[which]
    if not np.isfinite(value):
        return "–"
    low, high = line[f"{which}_low"], line[f"{which}_high"]
    known = np.isfinite([low, high]).all()
    return figures(value), f"[{figures(low)}, {figures(high)}]" if known else ""


def law_formula(law, recipe):
    """The arcsine law as a formula."""
    return law_text(law, recipe.inputs, recipe.output_unit)


def law_table(law, recipe):
    """The arcsine law as a formula and by its coefficients."""
    lines = [
        law_formula(law, recipe),
        f"at {law.reference_temperature_:.6g} °C; powers of the difference, lowest first",
    ]
    for name in ("amplitude_", "sagnac_factor_", "bias_"):
        values = ", ".join(f"{value:.8g}" for value in getattr(law, name))
        lines.append(f"{words(name.rstrip('_'))}: {values}")
    if law.temperature_rate is not None:
        lines.append(f"lag of the thermometer: {law.thermometer_lag_:.6g} s")
    return "\n".join(lines)
