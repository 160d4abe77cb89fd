"""The arcsine law as text: a formula to be read or typed into a spreadsheet, and JSON."""

import numpy as np

from ..export.limits import SMALLEST_NUMBER, number, shown
from ..policies import SILENT
from .physics import HIGHEST_DEGREE, ROLES, OpenLoopArcsineRegressor, check_parameters

__all__ = ["law_document", "law_text", "past_phase", "read_law"]

_POLYNOMIALS = ("amplitude", "sagnac_factor", "bias")
_NUMBERS = ("offset", "thermometer_lag", "reference_temperature")
_RANGE = ("minimum", "maximum")
_PARAMETERS = ("max_phase", "out_of_bounds")


def law_text(law, names, unit="deg/s"):
    """The fitted law as a formula with its units, and what happens past the arcsine.

    ``names`` are those of all columns of X, ``unit`` is that of the output.
    """
    names = [names[j] for j in law.columns_]
    amplitude, sagnac, bias = (
        _polynomial(values) for values in (law.amplitude_, law.sagnac_factor_, law.bias_)
    )
    formula = (
        f"rate [deg/s] = arcsin(({names[0]} [{unit}]{_term(-law.offset_)}) / ({amplitude})) "
        f"/ ({sagnac}) - ({bias})"
    )
    if len(names) > 1:
        lag = _term(law.thermometer_lag_, f" s * {names[2]} [degC/s]") if len(names) > 2 else ""
        formula += f", t = {names[1]} [degC]{lag}{_term(-law.reference_temperature_)}"
    policy = past_phase(law.out_of_bounds, "rate")
    return f"{formula}\nBeyond a phase (the arcsin) of {law.max_phase:g} rad {policy}."


def past_phase(policy, what):
    """What happens beyond the largest phase, as a clause; ``what`` there is none of in silence."""
    if policy in SILENT:
        return f"there is no {what}"
    return "the phase is held there" if policy == "clip" else "the law goes on along its tangent"


def _polynomial(coefficients):
    """In powers of t, from the lowest."""
    text = f"{coefficients[0]:.8g}"
    for power, value in enumerate(coefficients[1:], start=1):
        text += _term(value, " t" if power == 1 else f" t^{power}")
    return text


def _term(value, factor=""):
    """What is to be added, with its sign; nothing for zero."""
    return f" {'-' if value < 0 else '+'} {abs(value):.8g}{factor}" if value else ""


def law_document(law, inputs):
    """Content of a JSON file for a fitted law; ``inputs`` are the names of all columns of X."""
    return {
        "columns": [inputs[j] for j in law.columns_],
        **{key: getattr(law, f"{key}_").tolist() for key in (*_POLYNOMIALS, *_RANGE)},
        **{key: getattr(law, f"{key}_") for key in _NUMBERS},
        "max_phase": float(law.max_phase),
        "out_of_bounds": law.out_of_bounds,
    }


def read_law(document, inputs):
    """The fitted law that a file's content describes; ValueError where it is none."""
    keys = ("columns", *_POLYNOMIALS, *_NUMBERS, *_RANGE, *_PARAMETERS)
    if not isinstance(document, dict) or set(document) != set(keys):
        raise ValueError(f"its law must be an object with the keys {', '.join(keys)}")
    columns = document["columns"]
    if (
        not isinstance(columns, list)
        or not 1 <= len(columns) <= len(ROLES)
        or any(name not in inputs for name in columns)
        or len(set(columns)) < len(columns)
    ):
        raise ValueError(f"the law's columns are {columns!r}; they must be 1 to 3 of the inputs")
    longest = 1 + HIGHEST_DEGREE if len(columns) > 1 else 1
    fitted = {key: _numbers(document[key], key, 1, longest) for key in _POLYNOMIALS}
    # What phase and rate are divided by.
    for key in ("amplitude", "sagnac_factor"):
        number(abs(float(fitted[key][0])), f"law.{key}[0], in size", SMALLEST_NUMBER)
    degrees = [fitted[key].size - 1 for key in _POLYNOMIALS]
    for key in _RANGE:
        fitted[key] = _numbers(document[key], key, len(columns), len(columns))
    if (fitted["minimum"] > fitted["maximum"]).any():
        raise ValueError("the law's minimum is above its maximum")
    fitted |= {key: number(document[key], f"law.{key}") for key in _NUMBERS}
    if len(columns) < len(ROLES) and fitted["thermometer_lag"] != 0.0:
        raise ValueError("the law has a thermometer_lag and no column for the temperature's rate")
    number(document["max_phase"], "law.max_phase", 0.0, np.pi / 2.0)
    law = OpenLoopArcsineRegressor(
        **dict(zip(ROLES, [*columns, None, None], strict=False)),
        **dict(zip(("amplitude_degree", "sagnac_degree", "bias_degree"), degrees, strict=True)),
        reference_temperature=fitted["reference_temperature"],
        **{key: document[key] for key in _PARAMETERS},
    )
    check_parameters(law)
    for key, value in fitted.items():
        setattr(law, f"{key}_", value)
    law.n_features_in_ = len(inputs)
    law.feature_names_in_ = np.array(inputs, dtype=object)
    law.columns_ = [list(inputs).index(name) for name in columns]
    return law


def _numbers(values, key, fewest, most):
    if not isinstance(values, list) or not fewest <= len(values) <= most:
        count = f"{fewest}" if fewest == most else f"{fewest} to {most}"
        raise ValueError(f"law.{key}: {shown(values)} must be a list of {count} number(s)")
    return np.array([number(value, f"law.{key}[{k}]") for k, value in enumerate(values)])
