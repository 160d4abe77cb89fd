"""Files of simple targets, each with what it is worth; or why there is none."""

from functools import partial
from typing import Any

import numpy as np

from ...export.c.dialect import write_files
from ..c_code import raw_rate_of, units_of
from ..metrics import rms
from .autopilots import INSTANCES, NOTES, Cubic
from .error_model import ErrorModel
from .piecewise import difference, spread
from .tables import TABLES, TYPES, Table, name_of

FILES = {
    **{kind: (f"{name_of(kind)}.h", f"{name_of(kind)}.c") for kind in TABLES},
    "px4": ("px4.params",),
    "ardupilot": ("ardupilot.parm",),
}
# A target is let through whose error on rows held out is at most so many times the model's.
_MOST_TIMES = 1.5
# A table grows until its difference is such a part of the model's error, while that gains enough.
_PART, _GAIN, _FEWEST_CELLS, _MOST_CELLS = 0.1, 0.8, 4, {1: 128, 2: 32}
_N_CALIBRATION_TEMPERATURES = 200
_THERMOMETER = "The temperature [degC] must come from the thermometer that was logged."


class RefusedError(Exception):
    """Why a target is not written."""


def write_targets(calibration, options, folder):
    """Write what the options of the command ask for; yields names, sentences, and if it was done.

    Of the options it reads ``target``, ``target_type``, ``axis``, ``instance`` and ``device_id``.
    """
    for name in options.target:
        try:
            yield name, _write(calibration, options, name, folder), True
        except RefusedError as reason:
            yield name, str(reason), False


def _write(calibration, options, name, folder):
    axes = TABLES[name][1] if name in TABLES else ("temperature",)
    compensator, X = calibration.compensator, calibration.X
    again = f"Calibrate again with --inputs {' '.join(axes)}, or ask for another target."
    if missing := [axis for axis in axes if axis not in X]:
        raise RefusedError(f"the model does not take the {missing[0]}. {again}")
    error = ErrorModel(compensator, compensator.estimator, axes, X)
    if lacking := [each for each in error.uses if each not in axes]:
        needs = " and ".join(lacking)
        raise RefusedError(f"the model needs {needs}, which this target cannot say. {again}")
    model_rms = rms((calibration.after - calibration.rate)[calibration.in_range])
    if name in TABLES:
        type_name = options.target_type or next(iter(TYPES))
        n_cells = _n_cells(error, name, type_name, _PART * model_rms)
        make: Any = partial(Table, kind=name, type_name=type_name, n_cells=n_cells)
    else:
        make = partial(Cubic, autopilot=name)
    made = make(error)
    low, high = difference(error, made.piecewise)
    # ArduPilot: of the difference at T less that at T_cal.
    largest = high - low if name == "ardupilot" else max(-low, high)
    left = _held_out_rms(calibration, axes, make, name == "ardupilot")
    if not np.isfinite(largest):
        raise RefusedError("no bound of its difference from the model could be proven.")
    if left > _MOST_TIMES * model_rms:
        raise RefusedError(
            f"it leaves {left:.4g} deg/s RMS on rows held out, and the model {model_rms:.4g}; more "
            f"than {_MOST_TIMES:g} times as much is not written."
        )
    of = "model(T) - model(T_cal), for the worst T_cal," if name == "ardupilot" else "the model"
    worth = (
        f"it differs from {of} by {largest:.4g} deg/s at most, proven; it leaves {left:.4g} deg/s "
        f"RMS on rows held out, and the model {model_rms:.4g}"
    )
    _write_files(made, calibration.compensator, options, name, worth, folder)
    return worth


def _n_cells(error, kind, type_name, goal):
    """Cells of an axis that a table needs."""
    n_cells, before = _FEWEST_CELLS, np.inf
    points, most = spread(error.ends), _MOST_CELLS[len(error.ends)]
    errors = error(points)
    while True:
        made = Table(error, kind, type_name, n_cells).piecewise
        largest = np.abs(errors - made(points)).max()
        if largest <= goal or n_cells >= most or largest > _GAIN * before:
            return n_cells
        n_cells, before = 2 * n_cells, largest


def _held_out_rms(calibration, axes, make, is_relative):
    """RMS error of rows in range by targets of models that are new to them [deg/s].

    ``is_relative``: for the worst T_cal, where the offset at boot is what the model says there.
    """
    X, errors = calibration.X, calibration.before - calibration.rate
    low, high = X["temperature"].min(), X["temperature"].max()
    at, squares = np.linspace(low, high, _N_CALIBRATION_TEMPERATURES)[:, None], 0.0
    folds = zip(calibration.split.folds, calibration.fold_models, strict=True)
    for (train, test), estimator in folds:
        error = ErrorModel(calibration.compensator, estimator, axes, X.iloc[train])
        made = make(error).piecewise
        rows = test[calibration.in_range[test]]
        left = errors[rows] - made(X[list(axes)].iloc[rows].to_numpy())
        shift = made(at) - error(at) if is_relative else np.zeros(1)
        squares = squares + (left**2).sum() + 2.0 * shift * left.sum() + left.size * shift**2
    return float(np.sqrt(np.max(squares) / calibration.in_range.sum()))


def _write_files(made, compensator, options, name, worth, folder):
    about = f"In the place of the model in compensator.json: {worth}."
    if name in TABLES:
        use = "y[0] is the error of the raw rate: subtract y[0] from the raw rate."
        notes = [f"{use} {raw_rate_of(compensator)}", about, _THERMOMETER]
        write_files(made.code(notes, units_of(compensator)), folder / name_of(name))
        return
    instance = INSTANCES[name][0] if options.instance is None else options.instance
    notes = [*NOTES[name], about, _THERMOMETER]
    text = made.text(notes, options.axis, instance, options.device_id)
    (folder / FILES[name][0]).write_text(text, encoding="ascii", newline="\n")
