"""Maps over two columns: where error is left, where data are, what the calibration covers."""

from typing import Any, ClassVar, Self

import numpy as np
import pandas as pd

from ...inspection.labels import as_label
from .._columns import ask, check_column, evenly_chosen
from ._base import GyroDisplay, bins_of, dress, figures, mark_decades, signs

__all__ = ["CoverageDisplay", "ResidualSurfaceDisplay"]

_NO_DATA = "#e9e9e6"
# Rows beyond cover one another.
_N_POINTS = 2_000
_COLORS = ["#c8654a", "#f0c9b8", "#f7f7f7", "#cfe3ef", "#8ebbd8"]  # none, some, full
_UNITS = {"temperature": "degC", "output": "deg/s", "time": "s", "temperature_rate": "degC/min"}
# Of the sizes that a colour scale covers, so that one outlier does not flatten it.
_NEARLY_ALL = 0.995


class ResidualSurfaceDisplay(GyroDisplay):
    """Mean error after compensation over temperature and rate, beside the number of rows.

    ``from_predictions`` takes ``temperature`` [degC] and ``n_bins`` of temperature and of rate.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

    Examples
    --------
    >>> from skanfis.gyro import ResidualSurfaceDisplay
    >>> rates = [-50, 50, 50], [-50, 50, 50], [-50, 50.25, 50.5]
    >>> options = {"temperature": [10, 10, 30], "n_bins": (2, 2)}
    >>> display = ResidualSurfaceDisplay.from_predictions(*rates, **options)
    >>> display.tables()["cells"]["rows"].tolist()
    [1, 0, 1, 1]
    """

    _PER_ROW = ("temperature",)
    _SIZE = (7.0, 3.3)
    _PANELS: ClassVar = {"ncols": 2, "sharey": True}

    @classmethod
    def _computed(cls, rows, unit, n_bins=(24, 24)):
        labels = ("temperature [degC]", "true rate [deg/s]")
        ends, cells = _cells(rows["temperature"], rows["rate"], n_bins, labels)
        found = rows["after"].groupby(cells).agg(["count", "mean"]).reindex(ends.index)
        ends["rows"] = found["count"].fillna(0).astype(int)
        ends[f"mean error after [{unit}]"] = found["mean"]
        return {"cells": ends}

    def _draw(self, axes, cells):
        from matplotlib.colors import LogNorm

        residual, counts = cells.iloc[:, -1], cells["rows"]
        limit = residual.abs().quantile(_NEARLY_ALL) or 1.0
        mesh = _draw_cells(axes[0], cells, residual, cmap="RdBu_r", vmin=-limit, vmax=limit)
        label = signs(cells.columns[-1])
        self.figure_.colorbar(mesh, ax=axes[0], extend="both").set_label(label)
        # A scale needs two ends, even where all cells have as many rows.
        norm = LogNorm(vmin=1, vmax=max(counts.max(), 2))
        mesh = _draw_cells(axes[1], cells, counts.where(counts > 0), cmap="viridis", norm=norm)
        bar = self.figure_.colorbar(mesh, ax=axes[1], label="rows in the cell")
        mark_decades(bar.ax.yaxis, norm.vmin, norm.vmax)
        title = f"residual: largest {figures(residual.abs().max())} {self._unit}"
        dress(axes[0], "temperature [degC]", "true rate [deg/s]", title)
        empty = np.mean(counts == 0)
        dress(axes[1], "temperature [degC]", title=f"data: {empty:.0%} of the cells empty")


class CoverageDisplay(GyroDisplay):
    """Where the calibration data cover what a compensator may be asked: a map over two inputs.

    Cells without a row are hatched; in the others the colour is the coverage, from 0 to 1. Outside
    the dashed line rows are flagged, and within it where the coverage is below ``min_coverage``,
    beyond the dotted line. Colour and lines hold all other inputs at one value.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.
    min_coverage : float, default=0.1
        Rows that are covered less are flagged.

    Examples
    --------
    >>> import pandas as pd
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.gyro import CoverageDisplay
    >>> X = pd.DataFrame({"temperature": [10.0, 20.0, 30.0] * 9, "output": range(27)})
    >>> model = ANFISRegressor(1).fit(X, X["output"])
    >>> len(CoverageDisplay.from_estimator(model, X).tables()["points"])
    9216
    """

    _SIZE = (6.2, 4.0)

    def __init__(self, tables: dict[str, pd.DataFrame], *, min_coverage: float = 0.1) -> None:
        super().__init__(tables)
        self.min_coverage = min_coverage

    @classmethod
    def from_estimator(  # type: ignore[override]
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
        others, units : dict, default=None
            Values to hold other inputs at (default: medians), and units of columns, by name.
        n_points, n_cells : int, default=96, 24
            Number of values, and of cells, on each axis.
        min_coverage : float, default=0.1
            Rows that are covered less are flagged.
        margin : float, default=0.15
            How far the picture goes beyond the data, as a part of their range.
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : CoverageDisplay
        """
        others = {} if others is None else others
        for name in (x, y, *others):
            if name not in X:
                raise ValueError(f"{name!r} is no column of X, which has {', '.join(X)}.")
        units = _UNITS | (units or {})
        words = [name.replace("_", " ") for name in (x, y)]
        labels = [
            f"{word} [{units[n]}]" if n in units else word
            for n, word in zip((x, y), words, strict=True)
        ]
        grid = X.median().to_frame().T.assign(**others)
        grid = grid.loc[grid.index.repeat(n_points**2)].reset_index(drop=True)
        columns = [check_column(X[name], name) for name in (x, y)]
        steps = np.linspace(-margin, 1.0 + margin, n_points)
        values = [column.min() + steps * np.ptp(column) for column in columns]
        grid[x], grid[y] = (each.ravel() for each in np.meshgrid(*values))
        cells, numbers = _cells(X[x], X[y], (n_cells, n_cells), labels)
        cells["rows"] = np.bincount(numbers, minlength=n_cells**2)
        points = grid[[x, y]].set_axis(labels, axis=1)
        points["coverage"] = ask(estimator, "coverage", grid)
        points["in range"] = ask(estimator, "in_bounds", grid).astype(int)
        numbers = _cell_numbers(grid[x], grid[y], *_edges(cells))
        points["in a cell with data"] = numbers.map(cells["rows"] > 0).eq(True).astype(int)
        rows = X[[x, y]].iloc[evenly_chosen(len(X), _N_POINTS)].set_axis(labels, axis=1)
        tables = {"points": points, "rows": rows.reset_index(drop=True), "cells": cells}
        return cls(tables, min_coverage=min_coverage).plot(ax)

    def _draw(self, axes, points, rows, cells):
        from matplotlib.colors import LinearSegmentedColormap

        (panel,), labels = axes, points.columns[:2]
        x, y = (points[label].unique() for label in labels)
        coverage, inside, held = points.iloc[:, 2:].to_numpy().T.reshape(3, y.size, x.size)
        panel.set_facecolor(_NO_DATA)
        panel.patch.set(hatch="////", edgecolor="0.75", linewidth=0)
        colors = LinearSegmentedColormap.from_list("coverage", _COLORS)
        style = {"cmap": colors, "vmin": 0, "vmax": 1, "rasterized": True}
        mesh = panel.pcolormesh(x, y, np.where(held, coverage, np.nan), **style)
        self.figure_.colorbar(mesh, ax=panel, label="coverage where there are data")
        panel.plot(*rows.to_numpy().T, ".", color="0.15", ms=1.5, alpha=0.35, mew=0)
        left, bottom = x[inside.any(axis=0)], y[inside.any(axis=1)]
        if left.size and bottom.size:
            corners = left[[0, -1, -1, 0, 0]], bottom[[0, 0, -1, -1, 0]]
            panel.plot(*corners, "--", color="0.15", linewidth=1.2)
        flagged = np.where(inside, coverage, np.nan)
        if np.nanmin(flagged, initial=np.inf) < self.min_coverage:
            style = {"colors": "0.15", "linestyles": ":", "linewidths": 1.2}
            panel.contour(x, y, flagged, levels=[self.min_coverage], **style)
        empty = np.mean(cells["rows"] == 0)
        title = f"{empty:.0%} of the cells in range are empty (hatched)"
        dress(panel, as_label(labels[0]), as_label(labels[1]), title)
        panel.grid(False)


def _cells(x, y, n_bins, labels):
    """Ends of all cells, a line for each, and the number of the cell of every row."""
    edges = [bins_of(values, n)[1] for values, n in zip((x, y), n_bins, strict=True)]
    places = np.divmod(np.arange(n_bins[0] * n_bins[1]), n_bins[0])[::-1]
    ends: dict[str, np.ndarray] = {}
    for label, place, each in zip(labels, places, edges, strict=True):
        ends |= {f"{label}, from": each[place], f"{label}, to": each[place + 1]}
    return pd.DataFrame(ends), _cell_numbers(x, y, *edges).astype(int)


def _cell_numbers(x, y, x_edges, y_edges):
    """Number of the cell of every point; NaN beyond all."""
    columns, lines = (
        pd.Series(pd.cut(values, edges, labels=False, include_lowest=True))
        for values, edges in ((x, x_edges), (y, y_edges))
    )
    return lines * (x_edges.size - 1) + columns


def _edges(cells):
    """Edges of the cells in both directions."""
    return [np.append(cells.iloc[:, k].unique(), cells.iloc[-1, k + 1]) for k in (0, 2)]


def _draw_cells(axes, cells, values, **options):
    x, y = _edges(cells)
    axes.set_facecolor(_NO_DATA)
    shape = (y.size - 1, x.size - 1)
    return axes.pcolormesh(x, y, values.to_numpy().reshape(shape), rasterized=True, **options)
