"""What the displays have in common: axes, colours, labels, and rows along one or two inputs."""

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
    """A picture on one axes: ``from_estimator`` stores arrays, ``plot`` draws them."""

    def _begin(self, ax, width=5.6, height=4.2):
        """Take ``ax``, or the axes of a new figure of this size in inches."""
        if ax is None:
            ax = _pyplot().subplots(figsize=(width, height), layout="constrained")[1]
        self.ax_, self.figure_ = ax, ax.figure
        return ax

    def _note(self, held, *notes):
        """What is held, and other notes, in small letters above the picture."""
        values = [f"{as_label(name)} = {value:.4g}" for name, value in held.items()]
        self.ax_.set_title("; ".join([*values, *notes]), fontsize="small", loc="left")


def panels(ax, count, width=3.2, height=2.6, columns=3):
    """So many axes as an array: of a new figure, in the place of one axes, or those given."""
    plt = _pyplot()
    columns = min(columns, count)
    rows = -(-count // columns)
    if ax is None:
        figure = plt.figure(figsize=(width * columns, height * rows), layout="constrained")
        grid = figure.add_gridspec(rows, columns)
    elif isinstance(ax, plt.Axes):
        if count == 1:
            return np.array([ax])
        figure = ax.figure
        grid = ax.get_subplotspec().subgridspec(rows, columns)
        ax.set_axis_off()
    else:
        axes = np.ravel(ax)
        if axes.size != count:
            raise ValueError(f"ax has {axes.size} axes; {count} are needed, one per panel.")
        return axes
    return np.array([figure.add_subplot(grid[i // columns, i % columns]) for i in range(count)])


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

    Others are held where ``held`` says, or at their mean in training; without training data, in the
    middle of their range. Returns the rows, the others' values by name, and the rows' coverage, 1
    where the model knows of no data.
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
