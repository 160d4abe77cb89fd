"""The arcsine law as data: what GyroCompensator writes, and reads with every entry checked."""

import numpy as np

from ..export.limits import SMALLEST_NUMBER, number, shown
from .physics import OpenLoopArcsineRegressor, check_parameters

__all__ = ["law_document", "read_law"]

_POLYNOMIALS = ("amplitude", "sagnac_factor", "bias")
_NUMBERS = ("offset", "thermometer_lag", "reference_temperature")
_RANGE = ("minimum", "maximum")
_PARAMETERS = ("max_phase", "out_of_bounds")
_KEYS = ("columns", *_POLYNOMIALS, *_NUMBERS, *_RANGE, *_PARAMETERS)
_ROLES = ("output", "temperature", "temperature_rate")
# Of the fifth degree in temperature, the highest that the estimator takes.
_MOST_COEFFICIENTS = 6
# What phase and rate are divided by.
_NEVER_ZERO = ("amplitude", "sagnac_factor")


def law_document(law, inputs):
    """Content of a file for a fitted law; ``inputs`` are the names of all columns of X."""
    return {
        "columns": [inputs[j] for j in law.columns_],
        **{key: getattr(law, f"{key}_").tolist() for key in _POLYNOMIALS},
        **{key: getattr(law, f"{key}_") for key in _NUMBERS},
        **{key: getattr(law, f"{key}_").tolist() for key in _RANGE},
        "max_phase": float(law.max_phase),
        "out_of_bounds": law.out_of_bounds,
    }


def read_law(document, inputs):
    """The fitted law that a file's content describes; ValueError where it is none."""
    if not isinstance(document, dict) or set(document) != set(_KEYS):
        raise ValueError(f"its law must be an object with the keys {', '.join(_KEYS)}")
    columns = document["columns"]
    if (
        not isinstance(columns, list)
        or not 1 <= len(columns) <= len(_ROLES)
        or any(name not in inputs for name in columns)
        or len(set(columns)) < len(columns)
    ):
        raise ValueError(f"the law's columns are {columns!r}; they must be 1 to 3 of the inputs")
    longest = _MOST_COEFFICIENTS if len(columns) > 1 else 1
    lists = {key: _numbers(document[key], key, 1, longest) for key in _POLYNOMIALS}
    for key in _NEVER_ZERO:
        number(abs(float(lists[key][0])), f"law.{key}[0], in size", SMALLEST_NUMBER)
    edges = {key: _numbers(document[key], key, len(columns), len(columns)) for key in _RANGE}
    if (edges["minimum"] > edges["maximum"]).any():
        raise ValueError("the law's minimum is above its maximum")
    numbers = {key: number(document[key], f"law.{key}") for key in _NUMBERS}
    if len(columns) < len(_ROLES) and numbers["thermometer_lag"] != 0.0:
        raise ValueError("the law has a thermometer_lag and no column for the temperature's rate")
    number(document["max_phase"], "law.max_phase", 0.0, np.pi / 2.0)
    law = OpenLoopArcsineRegressor(
        **dict(zip(_ROLES, [*columns, None, None], strict=False)),
        **{
            f"{name}_degree": lists[key].size - 1
            for name, key in zip(("amplitude", "sagnac", "bias"), _POLYNOMIALS, strict=True)
        },
        reference_temperature=numbers["reference_temperature"],
        **{key: document[key] for key in _PARAMETERS},
    )
    check_parameters(law)
    fitted = lists | edges | numbers
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
