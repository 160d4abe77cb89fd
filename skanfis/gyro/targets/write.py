"""Write simple targets to files, each with its proven and measured error, or refuse them."""

from functools import partial
from typing import Any

import numpy as np

from ...export.c.dialect import write_files
from ..c_compensator import SUBTRACT, input_units, notes_on, raw_rate_of
from ..metrics import rms
from .autopilots import NOTES, Cubic
from .error_model import ErrorModel, difference, spread
from .tables import Table

FILES = {
    "table": ("gyro_table.h", "gyro_table.c"),
    "rate-table": ("gyro_rate_table.h", "gyro_rate_table.c"),
    "px4": ("px4.params",),
    "ardupilot": ("ardupilot.parm",),
}
# A target is written if its error on held-out rows is at most this many times the model's.
_MOST_TIMES = 1.5
_N_CALIBRATION_TEMPERATURES = 200


def axes_of(text):
    """The inputs that a target such as "px4:x:0" has."""
    return ("temperature", "output") if text.startswith("rate-table") else ("temperature",)


def write_targets(calibration, texts, folder):
    """Write targets such as "px4:x:0"; yield each, a sentence, and whether it was written.

    The inputs of the calibration must be those of every target.
    """
    for text in texts:
        yield text, *_write(calibration, text, folder)


def _write(calibration, text, folder):
    """A sentence on a target's accuracy, or on why it was refused; and whether it is written."""
    name, *details = text.split(":")
    compensator, X = calibration.compensator, calibration.X
    make: Any = partial(Cubic, autopilot=name)
    is_code = name not in NOTES
    if is_code:
        make = partial(Table, type_name=(details or ["float"])[0])
    error = ErrorModel(compensator, compensator.estimator, X)
    made = make(error)
    low, high = difference(error, made.piecewise)
    # ArduPilot applies the difference at T minus that at T_cal.
    is_relative = name == "ardupilot"
    largest = high - low if is_relative else max(0.0, -low, high)
    model_rms = rms((calibration.after - calibration.rate)[calibration.inside])
    if not np.isfinite(largest):
        return "its difference from the model could not be bounded.", False
    left = _held_out_rms(calibration, make, is_relative)
    if left > _MOST_TIMES * model_rms:
        return (
            f"it leaves {left:.4g} deg/s RMS on rows held out, more than {_MOST_TIMES:g} times as "
            f"much as the model, {model_rms:.4g}."
        ), False
    of = "model(T) - model(T_cal), for the worst T_cal," if is_relative else "the model"
    worth = (
        f"it differs from {of} by {largest:.4g} deg/s at most, proven; it leaves {left:.4g} deg/s "
        f"RMS on rows held out, and the model {model_rms:.4g}"
    )
    if name == "px4":
        edges = spread(made.piecewise.ends).T
        steepest = np.abs(made.piecewise.ranges(edges[:, :-1], edges[:, 1:])[1]).max()
        worth += f"; PX4, which updates it every 1 degC, adds {steepest:.4g} deg/s at most"
    notes = [f"This replaces the model in compensator.json: {worth}.", *notes_on(compensator)[1:]]
    if is_code:
        use = f"{SUBTRACT} {raw_rate_of(compensator)}"
        write_files(
            made.code([use, *notes], input_units(compensator)), folder / FILES[name][0][:-2]
        )
    else:
        written = made.text([NOTES[name], *notes], *details)
        (folder / FILES[name][0]).write_text(written, encoding="ascii", newline="\n")
    return worth, True


def _held_out_rms(calibration, make, is_relative):
    """RMS error of rows in range, by targets of models that had not seen them [deg/s].

    ``is_relative``: for the worst T_cal, if the offset at boot is the model's value there.
    """
    X, errors = calibration.X, calibration.before - calibration.rate
    low, high = X["temperature"].min(), X["temperature"].max()
    at, squares = np.linspace(low, high, _N_CALIBRATION_TEMPERATURES)[:, None], 0.0
    folds = zip(calibration.split.folds, calibration.fold_models, strict=True)
    for (train, test), estimator in folds:
        error = ErrorModel(calibration.compensator, estimator, X.iloc[train])
        made = make(error).piecewise
        rows = test[calibration.inside[test]]
        left = errors[rows] - made(X.iloc[rows].to_numpy())
        shift = made(at) - error(at) if is_relative else np.zeros(1)
        squares = squares + (left**2).sum() + 2.0 * shift * left.sum() + left.size * shift**2
    return float(np.sqrt(np.max(squares) / calibration.inside.sum()))
