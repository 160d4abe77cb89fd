"""What the displays have in common: axes to draw on, and which inputs to look at."""

from collections.abc import Mapping
from numbers import Real

import numpy as np

from .._validation import position_of
from .rules import knows_data

__all__ = [
    "COVERED",
    "colors",
    "coverage_if_known",
    "held_row",
    "one_axes",
    "panels",
    "position",
    "terms_text",
]

# Below this coverage the prediction counts as extrapolated.
COVERED = 0.5

# The brightest end of a colour map is hard to see on white.
_BRIGHTEST = 0.85


def one_axes(ax, width=5.6, height=4.2):
    """``ax``, or the axes of a new figure of this size in inches."""
    if ax is not None:
        return ax
    return _pyplot().subplots(figsize=(width, height), layout="constrained")[1]


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
            raise ValueError(f"ax has {axes.size} axes; {count} are needed, one per input.")
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


def terms_text(model, rule, inputs):
    """Names of the rule's terms on some inputs, "any" where it does not look at one."""
    return ", ".join(model.term_names[rule[j]] if j in rule else "any" for j in inputs)


def coverage_if_known(model, rows):
    """How well the training data cover each row; 1 where the model knows of no data."""
    return np.ones(len(rows)) if model.support is None else model.coverage(rows)


def held_row(model, held):
    """A row of the inputs' means, but for what the mapping ``held`` says by input.

    Without data that a mean could be of, the middle of the ranges.
    """
    middle = 0.5 * (model.minimum + model.maximum)
    mean = model.reference if knows_data(model) else middle
    row = np.clip(mean, model.minimum, model.maximum)
    if held is None:
        return row
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
    return row
