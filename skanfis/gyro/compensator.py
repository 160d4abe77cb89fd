"""GyroCompensator: a fitted estimator with all that is needed to apply it to a log; its file."""

import json
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from .._threads import without
from ..exceptions import OutOfBoundsWarning
from ..export import export_json
from ..export.c.dialect import status_word
from ..export.folding import found_by_search
from ..export.json_reader import model_of
from ..export.limits import MOST_BYTES, SMALLEST_NUMBER, number, numbers, read_bytes, shown
from ._checks import columns_of
from ._columns import ask, check_column, declared_units
from .compose import FrozenRules, Polynomial, ResidualRegressor, cubic_powers, joined, law_and_rules
from .physics import DEGREES, HIGHEST_DEGREE, ROLES, OpenLoopArcsineRegressor, check_parameters
from .thermal_rate import ThermalRate

INPUTS = ("time", "temperature", "temperature_rate", "output")

_FORMAT, _VERSION = "skanfis gyro compensator", 1
# Entries of a law in the file: lists of coefficients; numbers; lists with a number per column.
_POLYNOMIALS = ("amplitude", "sagnac_factor", "bias")
_NUMBERS = ("thermometer_lag", "reference_temperature")
_RANGE = ("minimum", "maximum")
_OF_POLYNOMIAL = ("center", "scale", "coefficients")
_PARAMETERS = ("max_phase", "out_of_bounds")
# The name of a unit is shown in tables and on axes.
_LONGEST_UNIT = 40


@dataclass(frozen=True, eq=False)
class GyroCompensator:
    """A fitted compensator with its inputs, units and limits: what the command writes and applies.

    It takes logs as :func:`read_log` returns them, and never uses the true rate.

    Parameters
    ----------
    estimator : fitted estimator
        Predicts from the columns ``inputs``, in this order. It, or a Pipeline's last step, must
        have ``in_bounds`` and ``coverage``.
    inputs : tuple of str
        Of "time" (since power-on [s]), "temperature" [degC], "temperature_rate" (low-passed
        [degC/s], see :class:`ThermalRate`) and "output" (in ``output_unit``).
    predicts : {"error", "rate"}, default="error"
        Whether the estimator predicts the error, indicated minus true rate, or the rate [deg/s].
    scale_factor : float, default=1.0
        Output per deg/s: the indicated rate is the output divided by this.
    output_unit : str, default="deg/s"
        Unit of the output, "deg/s" or a raw signal such as "counts".
    time_constant : float, default=60.0
        Time constant of "temperature_rate" [s].
    min_coverage : float, default=0.1
        Rows with less coverage by the training data are flagged.
    units : dict of str to str, default={}
        Units of the calibration's files by part, such as {"temperature": "degF"}. They are assumed
        for columns of other files that name no unit.
    assumed : dict of str to str, default={}
        Sentences by part on the units that neither a column's name nor an option gave.

    Raises
    ------
    ValueError
        If a parameter is none of these, or a number is zero, negative or infinite where none makes
        sense.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import GyroCompensator
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> inputs = ("time", "temperature", "output")
    >>> model = ANFISRegressor([2, 2, 3]).fit(log[list(inputs)], log["error"])
    >>> compensator = GyroCompensator(model, inputs)
    >>> hotter = log.assign(temperature=log["temperature"] + 40)
    >>> compensator.apply(hotter).query("status == 0").shape[0] < len(log)
    True
    """

    estimator: Any
    inputs: tuple[str, ...]
    predicts: str = "error"
    scale_factor: float = 1.0
    output_unit: str = "deg/s"
    time_constant: float = 60.0
    min_coverage: float = 0.1
    units: dict[str, str] = field(default_factory=dict)
    assumed: dict[str, str] = field(default_factory=dict)

    def __post_init__(self):
        _check_roles(list(self.inputs), self.predicts)
        _divisor(self.scale_factor, "scale_factor")
        number(self.time_constant, "time_constant", SMALLEST_NUMBER)
        number(self.min_coverage, "min_coverage", 0.0, 1.0)

    def apply(self, log: pd.DataFrame) -> pd.DataFrame:
        """Compensate a log, and flag the rows whose compensation cannot be trusted.

        Parameters
        ----------
        log : DataFrame of shape (n_rows, n_parts)
            As :func:`read_log` returns it; a column for the true rate is not used.

        Returns
        -------
        compensated : DataFrame of shape (n_rows, 4)
            rate_indicated and rate_compensated [deg/s]; coverage by the training data, 0 to 1;
            status, the sum of 1 (an input is out of range), 4 (the coverage is below
            ``min_coverage``) and 8 (the policy gives no rate: NaN). Zero: all is well.

        Raises
        ------
        ValueError
            If the log lacks a column or a value of the inputs, or the policy raises; with the rate
            of the temperature, if time does not increase within a run.
        """
        for part in columns_of((*self.inputs, "output")):
            if part not in log:
                raise ValueError(f"the log has no {part}, which the compensator takes.")
        X = features(log, self.inputs, self.time_constant)
        indicated = log["output"].to_numpy() / self.scale_factor
        # The status replaces the warning, row by row.
        with without(OutOfBoundsWarning):
            predicted = self.estimator.predict(X)
        compensated = indicated - predicted if self.predicts == "error" else predicted.copy()
        inside, coverage = (ask(self.estimator, name, X) for name in ("in_bounds", "coverage"))
        refused = ~np.isfinite(compensated)
        compensated[refused] = np.nan
        status = status_word(~inside, refused, ~(coverage >= self.min_coverage))
        columns = {"rate_indicated": indicated, "rate_compensated": compensated}
        columns |= {"coverage": coverage, "status": status.astype(np.uint8)}
        return pd.DataFrame(columns, index=X.index)

    def write_json(self, path: str | PathLike[str]) -> None:
        """Write the compensator as JSON: reading it runs no code.

        Raises
        ------
        ValueError, TypeError
            If the estimator is neither an ANFIS after scalers, nor a :class:`ResidualRegressor` of
            the arcsine law and such an ANFIS, nor one of the command's simple compensations; or if
            a number is beyond what :meth:`read_json` takes.
        OSError
            If the file cannot be written.
        """
        text = _text_of(self)
        _settings(json.loads(text))  # so that nothing is written that cannot be read again
        Path(path).write_text(text, encoding="utf-8", newline="\n")

    @classmethod
    def read_json(cls, path: str | PathLike[str]) -> Self:
        """Read a compensator that :meth:`write_json` has written.

        It gives the same results as the one written. Its estimator can predict, but not be fitted.

        Raises
        ------
        ValueError
            If the file is not such a compensator, or a number in it is out of its range. The
            message says where, as in ``model.inputs[0].spread``.
        OSError
            If the file cannot be opened.
        """
        data = read_bytes(path, MOST_BYTES)
        try:
            return cls(**_settings(json.loads(data.decode("utf-8"))))
        except (ValueError, RecursionError) as error:
            reason = str(error).removesuffix(".")
            if isinstance(error, UnicodeDecodeError | json.JSONDecodeError):
                reason = "it is not the JSON that a compensator.json holds"
            raise ValueError(f"{path} is no gyro compensator: {reason}.") from error


_KEYS = [each.name for each in fields(GyroCompensator) if each.name != "estimator"]


def as_written(compensator):
    """The compensator as written and read again: equal to the last bit, at its edges too."""
    return GyroCompensator(**_settings(json.loads(_text_of(compensator))))


def _text_of(compensator):
    """The JSON text of a compensator; its inputs are only those that its parts take."""
    found, law, polynomial = found_by_search(compensator.estimator), None, None
    if isinstance(found, ResidualRegressor):
        fitted, rules = law_and_rules(found)
        if isinstance(fitted, Polynomial):
            polynomial = {key: getattr(fitted, key).tolist() for key in _OF_POLYNOMIAL}
        else:
            law = {
                "columns": [compensator.inputs[j] for j in fitted.columns_],
                **{key: getattr(fitted, f"{key}_").tolist() for key in (*_POLYNOMIALS, *_RANGE)},
                **{key: getattr(fitted, f"{key}_") for key in _NUMBERS},
                "max_phase": float(fitted.max_phase),
                "out_of_bounds": fitted.out_of_bounds,
            }
    else:
        rules = FrozenRules.of(found, len(compensator.inputs))
    columns = [compensator.inputs[j] for j in rules.positions]
    used = {*columns, *(law["columns"] if law else [])}
    document = {
        "format": _FORMAT,
        "version": _VERSION,
        **{key: getattr(compensator, key) for key in _KEYS},
        "inputs": [name for name in compensator.inputs if name in used],
        "law": law,
        "polynomial": polynomial,
        "columns": columns,
        "model": json.loads(export_json(rules.model)),
    }
    return json.dumps(document, indent=1, allow_nan=False, default=float) + "\n"


def features(log, inputs, time_constant):
    """The columns ``inputs``, which are known on board; time counts from power-on."""
    runs = log["run"].to_numpy() if "run" in log else np.zeros(len(log))
    columns = {}
    for name in inputs:
        if name == "time":
            start = log.get("power_on", log["time"].groupby(runs).transform("first"))
            columns[name] = check_column(log["time"] - start, "time")
        elif name == "temperature_rate":
            rate = ThermalRate(time_constant, time="time", run="run")
            parts = log[["time", "temperature"]].assign(run=runs)
            columns[name] = rate.fit_transform(parts)[:, 0]
        else:
            columns[name] = log[name].to_numpy()
    return pd.DataFrame(columns, index=log.index)


def _check_roles(inputs, predicts):
    if not _are_of(inputs, INPUTS):
        raise ValueError(f"inputs is {inputs!r}; it must be of {', '.join(INPUTS)}")
    if predicts not in ("error", "rate"):
        raise ValueError(f"predicts is {predicts!r}; it must be error or rate")


def _settings(document):
    """Check a file's content and return the arguments of the compensator; else ValueError."""
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise ValueError(f'its "format" is not "{_FORMAT}"')
    if document.get("version") != _VERSION:
        raise ValueError(f"its version is {document.get('version')!r}, this reads {_VERSION}")
    if set(document) != {"format", "version", "law", "polynomial", "columns", "model", *_KEYS}:
        raise ValueError(f"its keys are {', '.join(document)}")
    inputs, columns, unit = (document[key] for key in ("inputs", "columns", "output_unit"))
    _check_roles(inputs, document["predicts"])
    if not (isinstance(unit, str) and unit.isprintable() and 0 < len(unit) <= _LONGEST_UNIT):
        raise ValueError(f"output_unit: {shown(unit)} is not the name of a unit")
    for key in ("units", "assumed"):
        found = document[key]
        if not (isinstance(found, dict) and all(isinstance(text, str) for text in found.values())):
            raise ValueError(f"{key} is {shown(found)}; it must be an object of texts")
    declared_units(document["units"])
    try:
        model = model_of(document["model"])
    except ValueError as error:
        raise ValueError(f"model.{error}") from error
    if not _are_of(columns, inputs):
        raise ValueError(f"columns is {columns!r}; they must be of the inputs")
    if model.n_inputs != len(columns) or model.n_outputs != 1:
        raise ValueError(f"its model has {model.n_inputs} inputs and {model.n_outputs} outputs")
    estimator = FrozenRules(model, np.array([inputs.index(name) for name in columns]))
    if document["law"] is not None:
        estimator = joined(_read_law(document["law"], inputs), estimator)
    if document["polynomial"] is not None:
        estimator = joined(_read_polynomial(document["polynomial"], estimator, inputs), estimator)
    return {key: document[key] for key in _KEYS} | {"inputs": tuple(inputs), "estimator": estimator}


def _read_law(document, inputs):
    """The fitted law that a file's content describes; ValueError if it is none."""
    keys = ("columns", *_POLYNOMIALS, *_NUMBERS, *_RANGE, *_PARAMETERS)
    if not isinstance(document, dict) or set(document) != set(keys):
        raise ValueError(f"its law must be an object with the keys {', '.join(keys)}")
    columns = document["columns"]
    if not _are_of(columns, inputs) or len(columns) > len(ROLES):
        raise ValueError(f"the law's columns are {columns!r}; they must be 1 to 3 of the inputs")
    longest = 1 + HIGHEST_DEGREE if len(columns) > 1 else 1
    fitted = {key: _coefficients(document[key], f"law.{key}", longest) for key in _POLYNOMIALS}
    for key in ("amplitude", "sagnac_factor"):
        _divisor(document[key][0], f"law.{key}[0]")
    degrees = [fitted[key].size - 1 for key in _POLYNOMIALS]
    for key in _RANGE:
        fitted[key] = numbers(document[key], f"law.{key}", (len(columns),))
    if (fitted["minimum"] > fitted["maximum"]).any():
        raise ValueError("the law's minimum is above its maximum")
    fitted |= {key: number(document[key], f"law.{key}") for key in _NUMBERS}
    if len(columns) < len(ROLES) and fitted["thermometer_lag"] != 0.0:
        raise ValueError("the law has a thermometer_lag and no column for the temperature's rate")
    number(document["max_phase"], "law.max_phase", 0.0, np.pi / 2.0)
    law = OpenLoopArcsineRegressor(
        **dict(zip(ROLES, [*columns, None, None], strict=False)),
        **dict(zip(DEGREES, degrees, strict=True)),
        **{key: document[key] for key in _PARAMETERS},
    )
    check_parameters(law)
    for key, value in fitted.items():
        setattr(law, f"{key}_", value)
    law.n_features_in_ = len(inputs)
    law.feature_names_in_ = np.array(inputs, dtype=object)
    law.columns_ = [inputs.index(name) for name in columns]
    return law


def _read_polynomial(document, rule, inputs):
    """The cubic that a file's content describes; ValueError if it is none."""
    if not isinstance(document, dict) or set(document) != set(_OF_POLYNOMIAL):
        raise ValueError(f"its polynomial must be an object of {', '.join(_OF_POLYNOMIAL)}")
    if not isinstance(rule, FrozenRules) or rule.positions.tolist() != list(range(len(inputs))):
        raise ValueError("a polynomial goes with a rule on all inputs, and no law")
    n_terms = len(cubic_powers(len(inputs)))
    sizes = zip(_OF_POLYNOMIAL, (len(inputs), len(inputs), n_terms), strict=True)
    lists = {key: numbers(document[key], f"polynomial.{key}", (n,)) for key, n in sizes}
    for j, value in enumerate(document["scale"]):
        _divisor(value, f"polynomial.scale[{j}]")
    box, names = (rule.model.minimum, rule.model.maximum), np.array(inputs, dtype=object)
    return Polynomial(*box, **lists, feature_names_in_=names)


def _divisor(value, where):
    """Check a number of either sign that may be divided by."""
    size = number(abs(number(value, where)), f"{where}, in size", SMALLEST_NUMBER)
    return size if value > 0 else -size


def _coefficients(values, where, most):
    if not isinstance(values, list) or not 0 < len(values) <= most:
        raise ValueError(f"{where}: {shown(values)} must be a list of numbers, {most} at most")
    return numbers(values, where, (len(values),))


def _are_of(names, known):
    """Whether it is a list of some of the known names, each of them once."""
    return isinstance(names, list) and 0 < len(names) == sum(names.count(k) == 1 for k in known)
