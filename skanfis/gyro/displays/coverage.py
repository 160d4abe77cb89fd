"""CoverageDisplay: where the compensator knows what it says, and where it only goes on."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd

from ...inspection.labels import as_label
from .._columns import ask, evenly_chosen
from ._base import binned, cells_table
from ._style import NO_DATA, dress, make_axes

__all__ = ["CoverageDisplay"]

# Points beyond cover one another.
_N_POINTS = 2_000
_COLORS = ["#c8654a", "#f0c9b8", "#f7f7f7", "#cfe3ef", "#8ebbd8"]  # none, some, full
_SYMBOLS = {"degC": "°C", "deg/s": "°/s", "degC/min": "°C/min"}


@dataclass(kw_only=True, eq=False, repr=False)
class CoverageDisplay:
    """Where the calibration data cover what a compensator may be asked: a map over two inputs.

    Cells that hold no row are empty, hatched, whatever the model says of them. In the others the
    colour is :meth:`skanfis.ANFISRegressor.coverage`, from 0 (no data speak here) to 1. Outside the
    dashed line the compensator follows its policy for rows out of bounds and flags them; beyond the
    dotted line, inside it, its coverage is below ``min_coverage``, and rows are flagged too. For
    colour and lines all other inputs are held at one value; a row of any value fills a cell.

    Make it with :meth:`from_estimator`.

    Parameters
    ----------
    x, y : ndarray of shape (n_x,), (n_y,)
        Values of the two inputs.
    coverage : ndarray of shape (n_y, n_x)
        Coverage at each pair.
    inside : ndarray of bool of shape (n_y, n_x)
        Whether the pair is within the bounds of the training data.
    rows : ndarray of shape (n_points, 2)
        Some rows of the data.
    x_edges, y_edges : ndarray of shape (n_columns + 1,), (n_lines + 1,)
        Ends of the cells that rows are counted in, from the smallest to the largest of the data.
    counts : ndarray of shape (n_lines, n_columns)
        Number of rows in each cell, of all rows.
    min_coverage : float
        Rows that are covered less are flagged.
    names : tuple of two str
        Names of the two inputs, with units where these are known.

    Attributes
    ----------
    figure_, ax_ : matplotlib figure, matplotlib axes
        Once drawn.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import CoverageDisplay
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> X = log[["temperature", "output"]]
    >>> model = ANFISRegressor(2).fit(X, log["error"])
    >>> display = CoverageDisplay.from_estimator(model, X)
    >>> display.coverage.shape, bool(display.inside[0, 0])
    ((96, 96), False)
    """

    x: np.ndarray
    y: np.ndarray
    coverage: np.ndarray
    inside: np.ndarray
    rows: np.ndarray
    x_edges: Any
    y_edges: Any
    counts: np.ndarray
    min_coverage: float
    names: Any

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        *,
        x: str = "temperature",
        y: str = "output",
        others: dict[str, Any] | None = None,
        units: dict[str, Any] | None = None,
        n_points: int = 96,
        n_cells: int = 24,
        min_coverage: float = 0.1,
        margin: float = 0.15,
        ax: Any = None,
    ) -> Self:
        """Compute from a fitted estimator, and draw.

        Parameters
        ----------
        estimator : estimator
            Fitted, with methods ``coverage`` and ``in_bounds``, or a Pipeline that ends in such.
        X : DataFrame of shape (n_rows, n_inputs)
            Rows to draw, and from which the values of other inputs are taken.
        x, y : str, default="temperature", "output"
            Columns of X that the axes stand for.
        others : dict of str to float, default=None
            Values to hold other inputs at; the median of X where they are not named.
        units : dict of str to str, default=None
            Units of the columns, for the labels; None stands for degC, deg/s, s and degC/min for
            temperature, output, time and temperature_rate.
        n_points : int, default=96
            Number of values on each axis.
        n_cells : int, default=24
            Number of cells on each axis, over the range of X.
        min_coverage : float, default=0.1
            Rows that are covered less are flagged.
        margin : float, default=0.15
            How far the picture goes beyond the data, as a part of their range.
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : CoverageDisplay

        Raises
        ------
        ValueError
            If ``x``, ``y`` or ``others`` name no column of X.
        """
        others = {} if others is None else others
        for name in (x, y, *others):
            if name not in X:
                raise ValueError(f"{name!r} is no column of X, which has {', '.join(X)}.")
        axes = [_values(X[name].to_numpy(dtype=float), n_points, margin) for name in (x, y)]
        grid = X.median().to_frame().T.assign(**others)
        grid = grid.loc[grid.index.repeat(n_points**2)].reset_index(drop=True)
        grid[x], grid[y] = (values.ravel() for values in np.meshgrid(*axes))
        some = evenly_chosen(len(X), _N_POINTS)
        bins = [binned(X[name].to_numpy(dtype=float), n_cells) for name in (x, y)]
        (x_edges, columns), (y_edges, lines) = bins
        counts = np.bincount(lines * n_cells + columns, minlength=n_cells**2)
        units = {
            "temperature": "degC",
            "output": "deg/s",
            "time": "s",
            "temperature_rate": "degC/min",
        } | (units or {})
        display = cls(
            x=axes[0],
            y=axes[1],
            coverage=ask(estimator, "coverage", grid).reshape(n_points, n_points),
            inside=ask(estimator, "in_bounds", grid).reshape(n_points, n_points),
            rows=X[[x, y]].to_numpy(dtype=float)[some],
            x_edges=x_edges,
            y_edges=y_edges,
            counts=counts.reshape(n_cells, n_cells),
            min_coverage=min_coverage,
            names=tuple(_label(name, units) for name in (x, y)),
        )
        return display.plot(ax=ax)

    def plot(self, ax: Any = None) -> Self:
        """Draw.

        Parameters
        ----------
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : CoverageDisplay
            Itself.
        """
        from matplotlib.colors import LinearSegmentedColormap

        held = self._is_held()
        self.figure_, axes = make_axes(ax, 1, (6.2, 4.0))
        self.ax_ = axes[0]
        cmap = LinearSegmentedColormap.from_list("coverage", _COLORS)
        self.ax_.set_facecolor(NO_DATA)
        self.ax_.patch.set(hatch="////", edgecolor="0.75", linewidth=0)
        mesh = self.ax_.pcolormesh(
            self.x,
            self.y,
            np.where(held, self.coverage, np.nan),
            cmap=cmap,
            vmin=0,
            vmax=1,
            rasterized=True,
        )
        self.figure_.colorbar(mesh, ax=self.ax_).set_label("coverage where there are data")
        self.ax_.plot(*self.rows.T, ".", color="0.15", markersize=1.5, alpha=0.35, mew=0)
        x, y = self.x[self.inside.any(axis=0)], self.y[self.inside.any(axis=1)]
        if x.size and y.size:
            self.ax_.plot(
                x[[0, -1, -1, 0, 0]], y[[0, 0, -1, -1, 0]], "--", color="0.15", linewidth=1.2
            )
        flagged = np.where(self.inside, self.coverage, np.nan)
        if np.nanmin(flagged, initial=np.inf) < self.min_coverage:
            self.ax_.contour(
                self.x,
                self.y,
                flagged,
                levels=[self.min_coverage],
                colors="0.15",
                linestyles=":",
                linewidths=1.2,
            )
        empty = np.mean(self.counts == 0)
        dress(
            self.ax_,
            as_label(self.names[0]),
            as_label(self.names[1]),
            f"{empty:.0%} of the cells in range are empty (hatched)",
        )
        self.ax_.grid(False)
        return self

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn.

        Returns
        -------
        tables : dict of str to DataFrame
            "points" with their coverage, and "cells" with their number of rows, the empty ones too.
        """
        x, y = (values.ravel() for values in np.meshgrid(self.x, self.y))
        points = {
            self.names[0]: x,
            self.names[1]: y,
            "coverage": self.coverage.ravel(),
            "in range": self.inside.ravel().astype(int),
            "in a cell with data": self._is_held().ravel().astype(int),
        }
        edges = dict(zip(self.names, (self.x_edges, self.y_edges), strict=True))
        return {"points": pd.DataFrame(points), "cells": cells_table(edges, {"rows": self.counts})}

    def _is_held(self):
        """Whether each point lies in a cell with rows, (n_y, n_x)."""
        columns, lines = (
            np.searchsorted(edges, values, side="right") - 1
            for edges, values in ((self.x_edges, self.x), (self.y_edges, self.y))
        )
        within = [
            (values >= edges[0]) & (values <= edges[-1])
            for edges, values in ((self.x_edges, self.x), (self.y_edges, self.y))
        ]
        n_lines, n_columns = self.counts.shape
        places = np.ix_(np.clip(lines, 0, n_lines - 1), np.clip(columns, 0, n_columns - 1))
        return (self.counts[places] > 0) & within[1][:, None] & within[0][None, :]


def _values(column, n_points, margin):
    low, high = column.min(), column.max()
    beyond = margin * (high - low)
    return np.linspace(low - beyond, high + beyond, n_points)


def _label(name, units):
    unit = units.get(name)
    return f"{name.replace('_', ' ')} [{_SYMBOLS.get(unit, unit)}]" if unit else name
