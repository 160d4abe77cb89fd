"""Boxes of inputs: read from what a user gives, and held to where predictions change."""

from collections.abc import Mapping

import numpy as np
from scipy.stats import qmc

from ..model import TSKModel
from .enclosure import reach_of

__all__ = ["held_box", "input_index", "read_box", "spread_points"]


def read_box(box, model: TSKModel):
    """The box as an array (n_inputs, 2); what is not given is the range of the training data."""
    found = np.stack([model.minimum, model.maximum], axis=1)
    if box is None:
        return found
    names = ", ".join(map(repr, model.input_names))
    if isinstance(box, Mapping):
        for name, ends in box.items():
            j = input_index(name, model, "box")
            if np.shape(ends) != (2,):
                raise ValueError(f"box[{name!r}]={ends!r} must be two numbers: (low, high).")
            found[j] = ends
    else:
        try:
            given = np.array(box, dtype=float)
            what = f"an array of shape {given.shape}"
        except (TypeError, ValueError):
            given, what = np.empty(0), repr(box)
        if given.shape != found.shape:
            raise ValueError(
                f"box must have one (low, high) for each of the {model.n_inputs} inputs ({names}), "
                f"or be a dict by their names; got {what}."
            )
        found = given
    for name, (low, high) in zip(model.input_names, found, strict=True):
        if not low <= high:
            raise ValueError(
                f"box has ({low:g}, {high:g}) for {name!r}: low must not be above high, and "
                "neither may be NaN."
            )
    return found


def held_box(box, model: TSKModel, beyond=0.0):
    """Lows and highs of the part of a box in which predictions change, and a strip ``beyond``."""
    low, high = box.T.copy()
    if model.out_of_bounds in ("nan", "raise"):
        low, high = np.maximum(low, model.minimum), np.minimum(high, model.maximum)
        for name, start, stop, ends in zip(model.input_names, low, high, box, strict=True):
            if start > stop:
                raise ValueError(
                    f"box has ({ends[0]:g}, {ends[1]:g}) for {name!r}, outside the range of the "
                    f"training data: with out_of_bounds={model.out_of_bounds!r} the model predicts "
                    "nothing there. Give a box that meets the range, or another policy."
                )
        return low, high
    reach = reach_of(model)
    if model.out_of_bounds == "linear" and np.isinf(model.max_extrapolation):
        for name, ends in zip(model.input_names, box, strict=True):
            if not np.isfinite(ends).all():
                raise ValueError(
                    f"box has ({ends[0]:g}, {ends[1]:g}) for {name!r}, and the model goes on along "
                    "its tangent without end (max_extrapolation=inf): nothing bounds it. Give "
                    "finite ends, or a finite max_extrapolation."
                )
    # The way beyond is computed, and held, in floats: a few units in the last place more reach it.
    strip = 8.0 * np.finfo(float).eps * (np.abs(model.minimum) + np.abs(model.maximum) + reach)
    strip = np.where(reach > 0.0, strip, 0.0) + beyond * (model.maximum - model.minimum)
    edges = model.minimum - reach - strip, model.maximum + reach + strip
    return np.clip(low, *edges), np.clip(high, *edges)


def input_index(name, model: TSKModel, parameter):
    """The position of an input, by its name or position."""
    if isinstance(name, str) and name in model.input_names:
        return model.input_names.index(name)
    is_position = isinstance(name, int | np.integer) and not isinstance(name, bool)
    if is_position and -model.n_inputs <= name < model.n_inputs:
        return int(name) % model.n_inputs
    raise ValueError(
        f"{parameter} names {name!r}, which is no input of the model; they are "
        f"{', '.join(map(repr, model.input_names))}, at positions 0 to {model.n_inputs - 1}."
    )


def spread_points(low, high, n_points, most_inputs):
    """Rows of a box: ``n_points`` all over it, and of so few inputs all its corners."""
    unit = qmc.Halton(low.size, scramble=False).random(n_points)
    if low.size <= most_inputs:
        unit = np.vstack([np.indices((2,) * low.size).reshape(low.size, -1).T, unit])
    return np.clip(low + unit * (high - low), low, high)
