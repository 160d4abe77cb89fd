"""The arcsine law as data: what GyroCompensator writes, and reads with every entry checked."""

import numpy as np

from .physics import OpenLoopArcsineRegressor, check_parameters

__all__ = ["law_document", "read_law"]

_POLYNOMIALS = ("amplitude", "sagnac_factor", "bias")
_NUMBERS = ("offset", "thermometer_lag", "reference_temperature")
_RANGE = ("minimum", "maximum")
_PARAMETERS = ("max_phase", "out_of_bounds")
_KEYS = ("columns", *_POLYNOMIALS, *_NUMBERS, *_RANGE, *_PARAMETERS)
_ROLES = ("output", "temperature", "temperature_rate")
_MOST_COEFFICIENTS = 6
# Products of such numbers with each other are finite.
_LARGEST = 1e50


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
    lists = {key: _numbers(document, key, 1, longest) for key in _POLYNOMIALS}
    edges = {key: _numbers(document, key, len(columns), len(columns)) for key in _RANGE}
    if (edges["minimum"] > edges["maximum"]).any():
        raise ValueError("the law's minimum is above its maximum")
    numbers = {key: _numbers({key: [document[key]]}, key, 1, 1)[0] for key in _NUMBERS}
    if len(columns) < len(_ROLES) and numbers["thermometer_lag"] != 0.0:
        raise ValueError("the law has a thermometer_lag and no column for the temperature's rate")
    _numbers({"max_phase": [document["max_phase"]]}, "max_phase", 1, 1)
    law = OpenLoopArcsineRegressor(
        **dict(zip(_ROLES, [*columns, None, None], strict=False)),
        **{
            f"{name}_degree": lists[key].size - 1
            for name, key in zip(("amplitude", "sagnac", "bias"), _POLYNOMIALS, strict=True)
        },
        reference_temperature=float(numbers["reference_temperature"]),
        warn_out_of_bounds=False,
        **{key: document[key] for key in _PARAMETERS},
    )
    check_parameters(law)
    fitted = lists | edges | {key: float(value) for key, value in numbers.items()}
    for key, value in fitted.items():
        setattr(law, f"{key}_", value)
    law.n_features_in_ = len(inputs)
    law.feature_names_in_ = np.array(inputs, dtype=object)
    law.columns_ = [list(inputs).index(name) for name in columns]
    return law


def _numbers(document, key, fewest, most):
    values = document[key]
    if (
        not isinstance(values, list)
        or not fewest <= len(values) <= most
        or any(type(value) not in (int, float) for value in values)
        or any(not abs(value) <= _LARGEST for value in values)
    ):
        count = f"{fewest}" if fewest == most else f"{fewest} to {most}"
        raise ValueError(f"the law's {key} must hold {count} finite number(s), not {values!r}")
    return np.array(values, dtype=float)
