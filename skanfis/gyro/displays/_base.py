"""What the Displays of a compensation have in common: where their numbers come from."""

from collections.abc import Callable
from typing import Any, ClassVar, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._columns import RATE_UNITS
from ._style import SYMBOL

__all__ = [
    "CompensationDisplay",
    "DisplayInUnit",
    "binned",
    "cells_table",
    "check_rows",
    "compensated_rate",
    "mean_by_cell",
]

PREDICTS = ("error", "rate")


class CompensationDisplay:
    """A picture of a rate before and after compensation."""

    # Arguments of from_predictions with one value per row, which from_estimator finds in X.
    _PER_ROW: tuple[str, ...] = ()
    # Each picture has options of its own.
    from_predictions: ClassVar[Callable]

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        rate: ArrayLike,
        *,
        output: str | ArrayLike = "output",
        predicts: str = "error",
        ax: Any = None,
        **options: Any,
    ) -> Self:
        """Compute from a fitted estimator, and draw.

        Parameters
        ----------
        estimator : estimator
            Fitted regressor; rows should be others than it was trained on.
        X : DataFrame of shape (n_rows, n_columns)
            What the estimator predicts from; it takes the columns that it was trained on.
        rate : array-like of shape (n_rows,)
            True rate [deg/s].
        output : str or array-like of shape (n_rows,), default="output"
            Indicated rate without compensation [deg/s], or the column of X that holds it.
        predicts : {"error", "rate"}, default="error"
            Whether the estimator predicts the error, indicated minus true rate, or the rate.
        ax : matplotlib axes or array of these, default=None
            Where to draw; None makes a figure.
        **options
            As for ``from_predictions``. Where that wants a value per row, the name of a column of
            X serves too.

        Returns
        -------
        display
            The display, drawn.
        """
        before = column(X, output)
        after = compensated_rate(estimator, X, before, predicts)
        for name in cls._PER_ROW:
            if name in options:
                options[name] = column(X, options[name])
        return cls.from_predictions(rate, before, after, ax=ax, **options)


class DisplayInUnit(CompensationDisplay):
    """One whose errors are drawn in a unit that can be chosen."""

    # Of the errors stored, and as drawn unless asked otherwise.
    _UNIT: ClassVar[str] = "deg/s"

    def plot(self, ax: Any = None, *, unit: str | None = None) -> Self:
        """Draw.

        Parameters
        ----------
        ax : matplotlib axes or array of these, default=None
            Where to draw, one for each panel; None makes a figure.
        unit : {"deg/s", "deg/h"}, default=None
            Unit to draw in; None is the default of ``from_predictions``.

        Returns
        -------
        display
            Itself.

        Raises
        ------
        ValueError
            If there is no such ``unit``, or ``ax`` has another number of axes.
        ImportError
            Without matplotlib.
        """
        unit = self._UNIT if unit is None else unit
        if unit not in RATE_UNITS:
            raise ValueError(f"unit={unit!r} must be one of {', '.join(RATE_UNITS)}.")
        self.unit_ = unit
        self._draw(ax)
        return self

    @property
    def _unit(self):
        """That in which it was drawn, or would be."""
        return getattr(self, "unit_", self._UNIT)

    @property
    def _factor(self):
        """What errors stored are multiplied by."""
        return RATE_UNITS[self._unit] / RATE_UNITS[self._UNIT]

    @property
    def _symbol(self):
        return SYMBOL[self._unit]

    def _draw(self, ax):
        raise NotImplementedError


def column(X, values):
    """A column of X by its name; anything else is the values themselves."""
    return X[values] if isinstance(values, str) else values


def compensated_rate(estimator, X, indicated, predicts):
    """What the estimator makes of the indicated rate; X may have other columns than it uses."""
    if predicts not in PREDICTS:
        raise ValueError(f"predicts={predicts!r} must be one of {', '.join(PREDICTS)}.")
    names = getattr(estimator, "feature_names_in_", None)
    predicted = estimator.predict(X if names is None else X[list(names)])
    return np.asarray(indicated, dtype=float) - predicted if predicts == "error" else predicted


def check_rows(**columns) -> list[np.ndarray]:
    """The columns as arrays of equal length; ValueError names the one that differs."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    n_rows = next(iter(arrays.values())).size
    for name, values in arrays.items():
        if values.shape != (n_rows,):
            first = next(iter(arrays))
            raise ValueError(
                f"{name} has shape {values.shape}; it must have one value per row, as many as "
                f"{first} ({n_rows})."
            )
    return list(arrays.values())


def binned(positions, n_bins):
    """Edges of equal bins over the finite positions, and the bin of each row."""
    low, high = positions.min(), positions.max()
    edges = np.linspace(low, high if high > low else low + 1.0, n_bins + 1)
    bins = np.searchsorted(edges, positions, side="right") - 1
    return edges, np.clip(bins, 0, n_bins - 1)


def mean_by_cell(values, cells, n_cells):
    """Mean of the values of each cell, (n_cells,); NaN where it has none."""
    counts = np.bincount(cells, minlength=n_cells)
    sums = np.bincount(cells, values, minlength=n_cells)
    return np.divide(sums, counts, out=np.full(n_cells, np.nan), where=counts > 0)


def cells_table(edges, values):
    """One line per cell of a map: the ends of its sides, and its values of shape (n_y, n_x)."""
    (x_name, x), (y_name, y) = edges.items()
    n_x, n_y = x.size - 1, y.size - 1
    columns = {
        f"{x_name}, from": np.tile(x[:-1], n_y),
        f"{x_name}, to": np.tile(x[1:], n_y),
        f"{y_name}, from": np.repeat(y[:-1], n_x),
        f"{y_name}, to": np.repeat(y[1:], n_x),
    }
    return pd.DataFrame(columns | {name: value.ravel() for name, value in values.items()})
