"""What the displays have in common: axes, colours, notes, and rows along one or two inputs."""

from collections.abc import Mapping
from numbers import Real

import numpy as np

from .._validation import position_of
from .labels import as_label
from .rules import has_training_data

__all__ = ["COVERED", "Display", "colors", "panels", "position", "section"]

# Below this coverage the prediction counts as extrapolated.
COVERED = 0.5
# The brightest end of a colour map is hard to see on white.
_BRIGHTEST = 0.85


class Display:
    """A picture: ``from_estimator`` stores arrays and draws, ``plot`` draws them again."""

    def _begin(self, ax, width=5.6, height=4.2):
        """Take ``ax``, or the axes of a new figure of this size in inches."""
        if ax is None:
            ax = _pyplot().subplots(figsize=(width, height), layout="constrained")[1]
        self.ax_, self.figure_ = ax, ax.figure
        return ax

    def _note(self, held, *notes):
        """Write which inputs are held, and other notes, above the picture."""
        values = [f"{as_label(name)} = {value:.4g}" for name, value in held.items()]
        self.ax_.set_title("; ".join([*values, *notes]), fontsize="small", loc="left")


def panels(ax, count, columns=3):
    """So many axes as an array: those given, or of a new figure."""
    if ax is not None:
        axes = np.ravel(ax)
        if axes.size != count:
            raise ValueError(f"ax has {axes.size} axes; {count} are needed, one per panel.")
        return axes
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = _pyplot().figure(figsize=(3.2 * columns, 2.6 * rows), layout="constrained")
    return np.array([figure.add_subplot(rows, columns, i + 1) for i in range(count)])


def _pyplot():
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError(
            "Displays are drawn with matplotlib: pip install matplotlib (the extra 'plot'; in a "
            "clone pip install '.[plot]')."
        ) from error
    return plt


def colors(count, colormap):
    """So many colours along a colour map, in order."""
    return _pyplot().get_cmap(colormap)(np.linspace(0.0, _BRIGHTEST, count))


def position(feature, names, what="input"):
    """Position of an input or output given by its name or position."""
    found = position_of(feature, names)
    if found is not None:
        return found
    raise ValueError(
        f"{feature!r} is no {what}: give a position from 0 to {len(names) - 1}, or one of "
        f"{', '.join(map(repr, names))}."
    )


def section(model, inputs, values, held):
    """Rows that have ``values`` (n_rows, n_inputs_varied) on some inputs, with the others held.

    The others take their value in ``held``, or their mean in training; without training data, the
    middle of their range. Returns the rows, the others' values by name, and the rows' coverage.
    """
    middle = 0.5 * (model.minimum + model.maximum)
    mean = model.reference if has_training_data(model) else middle
    row = np.clip(mean, model.minimum, model.maximum)
    held = {} if held is None else held
    if not isinstance(held, Mapping):
        raise TypeError(f"held must be a dict from inputs to values, got {held!r}.")
    for feature, value in held.items():
        j = position(feature, model.input_names)
        low, high = model.minimum[j], model.maximum[j]
        if not isinstance(value, Real) or not low <= value <= high:
            raise ValueError(
                f"held[{feature!r}]={value!r} must be a number in the range of training, from "
                f"{low:.6g} to {high:.6g}."
            )
        row[j] = value
    rows = np.tile(row, (len(values), 1))
    rows[:, inputs] = values
    others = [j for j in range(model.n_inputs) if j not in inputs]
    coverage = np.ones(len(rows)) if model.support is None else model.coverage(rows)
    return rows, {model.input_names[j]: float(row[j]) for j in others}, coverage
