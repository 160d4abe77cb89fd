"""ResidualSurfaceDisplay: where over temperature and rate error is left, and where data are."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ._base import DisplayInUnit, binned, cells_table, check_rows, mean_by_cell
from ._style import NO_DATA, dress, figures, make_axes, mark_decades, symmetric_limit

__all__ = ["ResidualSurfaceDisplay"]


@dataclass(kw_only=True, eq=False, repr=False)
class ResidualSurfaceDisplay(DisplayInUnit):
    """Mean error after compensation over temperature and rate, beside the number of rows.

    What has a colour of its own on the left is not noise: averages over many rows are left. Where
    the right-hand panel is empty, nothing is known of the compensation.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    temperature_edges : ndarray of shape (n_temperatures + 1,)
        Bins of the temperature [degC].
    rate_edges : ndarray of shape (n_rates + 1,)
        Bins of the true rate [deg/s].
    residual : ndarray of shape (n_rates, n_temperatures)
        Mean error after compensation [deg/s]; NaN where a cell has no rows.
    counts : ndarray of shape (n_rates, n_temperatures)
        Number of rows of each cell.

    Attributes
    ----------
    figure_, axes_ : matplotlib figure, ndarray of matplotlib axes of shape (2,)
        Residual, counts; once drawn.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import ResidualSurfaceDisplay
    >>> rate, temperature = np.array([-50.0, 50.0, 50.0]), np.array([10.0, 10.0, 30.0])
    >>> display = ResidualSurfaceDisplay.from_predictions(
    ...     rate, rate + 1.0, rate + [0.0, 0.25, 0.5], temperature=temperature, n_bins=(2, 2)
    ... )
    >>> display.residual
    array([[0.  ,  nan],
           [0.25, 0.5 ]])
    """

    _PER_ROW = ("temperature",)

    temperature_edges: np.ndarray
    rate_edges: np.ndarray
    residual: np.ndarray
    counts: np.ndarray

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        temperature: ArrayLike,
        n_bins: Any = (24, 24),
        unit: str = "deg/s",
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN after: the compensator refused the
            row, which then counts as none. Before is not drawn.
        temperature : array-like of shape (n_rows,)
            Temperature [degC].
        n_bins : tuple of two ints, default=(24, 24)
            Number of cells in temperature and in rate.
        unit : {"deg/s", "deg/h"}, default="deg/s"
            Unit to draw the residual in.
        ax : array of two matplotlib axes, default=None
            For residual and counts; None makes a figure.

        Returns
        -------
        display : ResidualSurfaceDisplay

        Raises
        ------
        ValueError
            If columns differ in length, are empty or not finite, or there is no such ``unit``.
        ImportError
            Without matplotlib.
        """
        rate, _, after, temperature = check_rows(
            rate=rate, before=before, after=after, temperature=temperature
        )
        known = np.isfinite(after)
        temperature_edges, columns = binned(temperature, n_bins[0])
        rate_edges, rows = binned(rate, n_bins[1])
        cells = (rows * n_bins[0] + columns)[known]
        shape = (n_bins[1], n_bins[0])
        n_cells = shape[0] * shape[1]
        display = cls(
            temperature_edges=temperature_edges,
            rate_edges=rate_edges,
            residual=mean_by_cell((after - rate)[known], cells, n_cells).reshape(shape),
            counts=np.bincount(cells, minlength=n_cells).reshape(shape),
        )
        return display.plot(ax=ax, unit=unit)

    def _draw(self, ax):
        from matplotlib.colors import LogNorm

        residual = self._factor * self.residual
        self.figure_, self.axes_ = make_axes(ax, 2, (7.0, 3.3), ncols=2, sharey=True)
        limit = symmetric_limit(residual)
        mesh = self._draw_cells(0, residual, cmap="RdBu_r", vmin=-limit, vmax=limit)
        bar = self.figure_.colorbar(mesh, ax=self.axes_[0], extend="both")
        bar.set_label(f"mean error after [{self._symbol}]")
        counts = np.where(self.counts > 0, self.counts, np.nan)
        # A scale needs two ends, even where all cells have as many rows.
        norm = LogNorm(vmin=1, vmax=max(self.counts.max(), 2))
        mesh = self._draw_cells(1, counts, cmap="viridis", norm=norm)
        bar = self.figure_.colorbar(mesh, ax=self.axes_[1])
        bar.set_label("rows in the cell")
        mark_decades(bar.ax.yaxis, norm.vmin, norm.vmax)
        largest = np.nanmax(np.abs(residual))
        dress(
            self.axes_[0],
            "temperature [°C]",
            "true rate [°/s]",
            f"residual: largest {figures(largest)} {self._symbol}",
        )
        empty = np.mean(self.counts == 0)
        dress(self.axes_[1], "temperature [°C]", title=f"data: {empty:.0%} of the cells empty")

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn, in the unit that it was drawn in.

        Returns
        -------
        tables : dict of str to DataFrame
            "cells", the empty ones too.
        """
        edges = {"temperature [degC]": self.temperature_edges, "true rate [deg/s]": self.rate_edges}
        values = {
            "rows": self.counts,
            f"mean error after [{self._unit}]": self._factor * self.residual,
        }
        return {"cells": cells_table(edges, values)}

    def _draw_cells(self, place, values, **options):
        axes = self.axes_[place]
        axes.set_facecolor(NO_DATA)
        return axes.pcolormesh(
            self.temperature_edges, self.rate_edges, values, rasterized=True, **options
        )
