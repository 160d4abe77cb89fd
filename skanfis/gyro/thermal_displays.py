"""Plots over temperature: scale factor error, hysteresis, mean residual, coverage by the data."""

from typing import Any, Self

import numpy as np
import pandas as pd

from ..digits import percent
from ..inspection.displays import mark_decades
from ._columns import ask, check_column, evenly_chosen
from .displays import SIDES, GyroDisplay, bins_of, dress, signs, three_digits
from .metrics import HYSTERESIS_BINS, biases_of_branches

# Bands of temperature; bins of the rate, an odd number, so that zero is in the middle of one; part
# of the largest rate, below which the bias divided by the rate would hide everything else.
_N_BANDS, _N_RATES, _SMALLEST_SHARE = 3, 41, 0.05
_BRANCHES = {"warming": ("^-", "#c8443c"), "cooling": ("v-", "#3a6ea5")}
# Cells and points on each axis of a map; dots for rows, of which more would hide one another.
_N_CELLS, _N_POINTS, _MOST_DOTS = 24, 96, 2_000
# How far a map of the coverage goes beyond the data, as a part of their range.
_MARGIN = 0.15
# Share of the cells within the colour scale, so that one outlier does not flatten it.
_NEARLY_ALL = 0.995
_NO_DATA = "#e9e9e6"
_COLORS = ["#c8654a", "#f0c9b8", "#f7f7f7", "#cfe3ef", "#8ebbd8"]  # none, some, full


class ScaleFactorErrorDisplay(GyroDisplay):
    """Scale-factor error against rate in three bands of temperature, before and after.

    It is the error minus the bias, divided by the rate; the bias is from a least-squares fit to
    each band, linear in rate and temperature. Rates below 5 % of the largest are left out.

    ``from_predictions`` takes ``temperature`` [degC].

    Examples
    --------
    >>> from skanfis.gyro import ScaleFactorErrorDisplay
    >>> rates, options = ([-100, 100], [-100.1, 100.1], [-100, 100]), {"temperature": [25, 25]}
    >>> display = ScaleFactorErrorDisplay.from_predictions(*rates, **options)
    >>> display.tables()["scale-factor"].iloc[:, -2:].round().max().tolist()
    [1000.0, 0.0]
    """

    _PER_ROW = ("temperature",)
    _UNITS = ("ppm",)
    _PANELS = 2, 1

    def _computed(self, rows):
        if np.ptp(rows["rate"]) == 0:
            raise ValueError(f"rate is {rows['rate'][0]:g} in all rows: there is no scale factor.")
        bands, edges = bins_of(rows["temperature"], _N_BANDS)
        ends = (edges[bands + k] for k in (0, 1))
        keys = [*map(pd.Series, ends), bins_of(rows["rate"], _N_RATES)[0]]
        far = rows["rate"].abs() >= _SMALLEST_SHARE * rows["rate"].abs().max()
        means = {"true rate [deg/s]": rows["rate"][far].groupby(keys).mean()}
        for side in SIDES:
            known = rows[["rate", side]].dropna()
            for _, part in rows.loc[known.index].groupby(bands):
                heat = part["temperature"] - part["temperature"].mean()
                design = np.column_stack([part["rate"], heat, np.ones(len(part))])
                _, *bias = np.linalg.lstsq(design, part[side], rcond=None)[0]
                known.loc[part.index, side] -= design[:, 1:] @ bias
            parts = known[far[known.index]].groupby(keys).mean()
            means[f"scale-factor error {side} [ppm]"] = 1e6 * parts[side] / parts["rate"]
        names = ["temperature, from [degC]", "temperature, to [degC]", "bin"]
        table = pd.DataFrame(means).reset_index(names=names).drop(columns="bin")
        return {"scale-factor": table}

    def _draw(self, axes, scale_factor):
        import matplotlib

        bands = scale_factor.groupby(list(scale_factor.columns[:2]))
        colors = matplotlib.colormaps["plasma"](np.linspace(0.05, 0.75, bands.ngroups))
        for panel, side in zip(axes, SIDES, strict=True):
            column = f"scale-factor error {side} [ppm]"
            for (ends, band), color in zip(bands, colors, strict=True):
                known = band.dropna(subset=column)
                rate, ppm = known["true rate [deg/s]"], known[column]
                # The line is broken at rest.
                told = "{:z.0f} to {:z.0f} °C".format(*ends)
                for half, label in ((rate < 0, told), (rate > 0, None)):
                    panel.plot(rate[half], ppm[half], ".-", color=color, label=label, lw=1.2, ms=4)
            title = f"{side}: largest {three_digits(scale_factor[column].abs().max())} ppm"
            legend = "temperature" if panel is axes[0] else None
            dress(panel, ylabel="scale-factor error [ppm]", title=title, legend=legend)
        axes[-1].set_xlabel(signs("true rate [deg/s]"))


class HysteresisDisplay(GyroDisplay):
    """Bias against temperature while it rises and while it falls, before and after compensation.

    The error's dependence on the rate (an odd polynomial, linear in temperature) is subtracted.

    ``from_predictions`` takes ``temperature`` [degC] and ``temperature_rate`` [degC/min]; rows
    slower than 0.05 degC/min belong to neither branch.

    Examples
    --------
    >>> from skanfis.gyro import HysteresisDisplay
    >>> options = {"temperature": range(200), "temperature_rate": [1, -1] * 100}
    >>> rates = [0] * 200, [0.01, 0] * 100, [0] * 200
    >>> display = HysteresisDisplay.from_predictions(*rates, **options)
    >>> round(display.tables()["bias"]["bias before, warming [deg/h]"].max())
    36
    """

    _PER_ROW = ("temperature", "temperature_rate")
    _UNITS = ("deg/h", "deg/s")
    _PANELS = 2, 1

    def _computed(self, rows):
        _, edges = bins_of(rows.dropna(subset="after")["temperature"], HYSTERESIS_BINS)
        table = pd.DataFrame({"temperature [degC]": 0.5 * (edges[:-1] + edges[1:])})
        for side in SIDES:
            columns = rows.dropna(subset=side)[["rate", side, *self._PER_ROW]].to_numpy().T
            for name, bias in zip(_BRANCHES, biases_of_branches(edges, *columns), strict=True):
                table[f"bias {side}, {name} [{self._unit}]"] = bias
        return {"bias": table}

    def _draw(self, axes, bias):
        temperature = bias["temperature [degC]"]
        for place, (panel, side) in enumerate(zip(axes, SIDES, strict=True)):
            branches = bias.iloc[:, 1 + 2 * place : 3 + 2 * place].to_numpy().T
            panel.fill_between(temperature, *branches, color="0.9", linewidth=0)
            for values, (name, (form, color)) in zip(branches, _BRANCHES.items(), strict=True):
                panel.plot(temperature, values, form, color=color, label=name, ms=4)
            gaps = pd.Series(np.abs(branches[0] - branches[1]))
            found = f"largest gap {three_digits(gaps.max())} {self._unit}"
            title = f"{side}: {found if gaps.notna().any() else 'branches never meet'}"
            legend = "" if panel is axes[0] else None
            dress(panel, ylabel=f"bias [{self._unit}]", title=title, legend=legend)
        axes[-1].set_xlabel("temperature [°C]")


class ResidualSurfaceDisplay(GyroDisplay):
    """Mean error after compensation over temperature and rate, beside the number of rows.

    ``from_predictions`` takes ``temperature`` [degC].

    Examples
    --------
    >>> from skanfis.gyro import ResidualSurfaceDisplay
    >>> rates = [-50, 50, 50], [-50, 50, 50], [-50, 50.25, 50.75]
    >>> display = ResidualSurfaceDisplay.from_predictions(*rates, temperature=[10, 30, 30])
    >>> display.tables()["cells"].iloc[-1, -2:].tolist()  # rows, and their mean error
    [2.0, 0.5]
    """

    _PER_ROW = ("temperature",)
    _size = (7.0, 3.3)
    _PANELS = 1, 2

    def _computed(self, rows):
        columns = {"temperature": "temperature [degC]", "rate": "true rate [deg/s]"}
        cells, numbers = _cells(rows[[*columns]].rename(columns=columns))
        found = rows["after"].groupby(numbers).agg(["count", "mean"]).reindex(cells.index)
        cells["rows"] = found["count"].fillna(0).astype(int)
        cells[f"mean error after [{self._unit}]"] = found["mean"]
        return {"cells": cells}

    def _draw(self, axes, cells):
        from matplotlib.colors import LogNorm

        residual, counts = cells.iloc[:, -1], cells["rows"]
        limit = residual.abs().quantile(_NEARLY_ALL) or 1.0
        mesh = _draw_cells(axes[0], cells, residual, cmap="RdBu_r", vmin=-limit, vmax=limit)
        self.figure_.colorbar(mesh, ax=axes[0], extend="both")
        # A scale needs two ends, even if all cells have equally many rows.
        norm = LogNorm(vmin=1, vmax=max(counts.max(), 2))
        mesh = _draw_cells(axes[1], cells, counts.where(counts > 0), cmap="viridis", norm=norm)
        bar = self.figure_.colorbar(mesh, ax=axes[1], label="rows in the cell")
        mark_decades(bar.ax.yaxis)
        title = f"{residual.name}: largest {three_digits(residual.abs().max())}"
        dress(axes[0], "temperature [degC]", "true rate [deg/s]", title)
        empty = np.mean(counts == 0)
        dress(axes[1], "temperature [degC]", title=f"data: {percent(empty)} of the cells empty")


class CoverageDisplay(GyroDisplay):
    """Coverage by the calibration data, over temperature and output.

    Cells without a row are hatched; in the others the colour is the coverage, from 0 to 1. Rows are
    flagged outside the dashed line, and inside it where the coverage is below ``min_coverage``,
    beyond the dotted line. Colour and lines hold all other inputs at one value.

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

    _size = (6.2, 4.0)
    min_coverage: float

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        *,
        output_unit: str = "deg/s",
        min_coverage: float = 0.1,
        ax: Any = None,
    ) -> Self:
        """Compute from a fitted estimator, and draw; returns the display.

        Parameters
        ----------
        estimator : estimator
            Fitted, with methods ``coverage`` and ``in_bounds``, or a Pipeline that ends in such.
        X : DataFrame of shape (n_rows, n_inputs)
            Rows to draw, with columns temperature and output; other inputs are at their medians.
        output_unit : str, default="deg/s"
            Unit of the column output.
        min_coverage : float, default=0.1
            Rows with less coverage are flagged.
        ax : matplotlib Figure or axes, default=None
            Where to draw, as for :meth:`plot`.
        """
        labels = {"temperature": "temperature [degC]", "output": f"output [{output_unit}]"}
        for name in labels:
            if name not in X:
                raise ValueError(f"{name!r} is no column of X, which has {', '.join(X)}.")
        rows = pd.DataFrame({label: check_column(X[name], name) for name, label in labels.items()})
        steps = np.linspace(-_MARGIN, 1.0 + _MARGIN, _N_POINTS)
        axes = (rows[label].min() + steps * (np.ptp(rows[label]) or 1.0) for label in rows)
        places = dict(zip(labels, (each.ravel() for each in np.meshgrid(*axes)), strict=True))
        grid = pd.DataFrame(X.median().to_dict() | places)[list(X)]
        cells, numbers = _cells(rows)
        cells["rows"] = np.bincount(numbers, minlength=len(cells))
        points = grid[list(labels)].rename(columns=labels)
        points["coverage"] = ask(estimator, "coverage", grid)
        points["in range"] = ask(estimator, "in_bounds", grid).astype(int)
        # With a margin of empty cells around them.
        has_rows = np.pad(cells["rows"].to_numpy().reshape(_N_CELLS, _N_CELLS) > 0, 1)
        at = np.ceil(_N_CELLS * steps).clip(0, _N_CELLS + 1).astype(int)
        points["in a cell with data"] = has_rows[np.ix_(at, at)].ravel().astype(int)
        rows = rows.iloc[evenly_chosen(len(rows), _MOST_DOTS)].reset_index(drop=True)
        display = cls()
        display.min_coverage = min_coverage
        display._tables = {"points": points, "rows": rows, "cells": cells}
        return display.plot(ax)

    def _draw(self, axes, points, rows, cells):
        from matplotlib.colors import LinearSegmentedColormap

        (panel,), labels = axes, points.columns[:2]
        x, y = (points[label].unique() for label in labels)
        coverage, inside, has_rows = points.iloc[:, 2:].to_numpy().T.reshape(3, y.size, x.size)
        panel.set_facecolor(_NO_DATA)
        panel.patch.set(hatch="////", edgecolor="0.75", linewidth=0)
        colors = LinearSegmentedColormap.from_list("coverage", _COLORS)
        style = {"cmap": colors, "vmin": 0, "vmax": 1, "rasterized": True}
        mesh = panel.pcolormesh(x, y, np.where(has_rows, coverage, np.nan), **style)
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
        title = f"{percent(np.mean(cells['rows'] == 0))} of the cells in range are empty (hatched)"
        dress(panel, labels[0], labels[1], title)
        panel.grid(False)


def _cells(columns):
    """Table of all cells over two columns, with their ends; and the cell number of every row."""
    ends: dict[str, np.ndarray] = {}
    numbers = np.zeros(len(columns), dtype=int)
    lines, places = np.divmod(np.arange(_N_CELLS**2), _N_CELLS)
    for label, place, size in zip(columns, (places, lines), (1, _N_CELLS), strict=True):
        bins, edges = bins_of(columns[label], _N_CELLS)
        ends |= {f"{label}, from": edges[place], f"{label}, to": edges[place + 1]}
        numbers = numbers + size * bins
    return pd.DataFrame(ends), numbers


def _draw_cells(axes, cells, values, **options):
    axes.set_facecolor(_NO_DATA)
    edges = (np.append(cells.iloc[:, k].unique(), cells.iloc[-1, k + 1]) for k in (0, 2))
    image = values.to_numpy().reshape(_N_CELLS, _N_CELLS)
    return axes.pcolormesh(*edges, image, rasterized=True, **options)
