"""ErrorDisplay: the error against time, temperature or anything else, before and after."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._columns import evenly_chosen
from ._base import DisplayInUnit, binned, check_rows
from ._style import AFTER, BEFORE, dress, figures, make_axes

__all__ = ["ErrorDisplay"]

# Bands about two dots wide in the picture.
_N_BINS = 300
# Points beyond cover one another.
_N_POINTS = 3_000


@dataclass(kw_only=True, eq=False, repr=False)
class ErrorDisplay(DisplayInUnit):
    """The rate error before and after compensation, against time or temperature.

    Two panels, one above the other, each with its own scale: a good compensation would be a
    straight line on the scale of what it compensates. A band reaches from the smallest to the
    largest error of all rows, so that no peak is lost; points are some of the rows.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    position : ndarray of shape (n_points,)
        Where the points lie: time, temperature ...
    before, after : ndarray of shape (n_points,)
        Errors of these points [deg/s].
    edges : ndarray of shape (n_bins + 1,)
        Bins of the position.
    range_before, range_after : ndarray of shape (n_bins, 2)
        Smallest and largest error in each bin [deg/s]; NaN where it has no rows.
    rms : tuple of two floats
        Root mean square of all errors before and after [deg/s].
    position_label : str, default="time [s]"
        What the position is, with its unit.

    Attributes
    ----------
    figure_, axes_ : matplotlib figure, ndarray of matplotlib axes of shape (2,)
        Before, after; once drawn.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import ErrorDisplay
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> X, old = log[["time", "temperature", "output"]], log["run"] < 3
    >>> model = ANFISRegressor([1, 2, 3], out_of_bounds="nan")
    >>> model = model.fit(X[old], log["error"][old])
    >>> display = ErrorDisplay.from_estimator(
    ...     model, X, log["rate"], position="temperature", position_label="temperature [°C]"
    ... )
    >>> before, after = display.rms
    >>> bool(after < before / 20)
    True
    """

    _PER_ROW = ("position",)

    position: np.ndarray
    before: np.ndarray
    after: np.ndarray
    edges: np.ndarray
    range_before: np.ndarray
    range_after: np.ndarray
    rms: Any
    position_label: str = "time [s]"

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        position: ArrayLike,
        position_label: str = "time [s]",
        unit: str = "deg/s",
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN: the compensator refused the row.
        position : array-like of shape (n_rows,)
            Time, temperature, or what else to draw the error against.
        position_label : str, default="time [s]"
            What the position is, with its unit.
        unit : {"deg/s", "deg/h"}, default="deg/s"
            Unit to draw the errors in.
        ax : array of two matplotlib axes, default=None
            For the errors before and after; None makes a figure.

        Returns
        -------
        display : ErrorDisplay

        Raises
        ------
        ValueError
            If columns differ in length, are empty or not finite, or there is no such ``unit``.
        ImportError
            Without matplotlib.
        """
        rate, before, after, position = check_rows(
            rate=rate, before=before, after=after, position=position
        )
        errors = before - rate, after - rate
        edges, bins = binned(position, _N_BINS)
        some = evenly_chosen(rate.size, _N_POINTS)
        display = cls(
            position=position[some],
            before=errors[0][some],
            after=errors[1][some],
            edges=edges,
            range_before=_ranges(errors[0], bins),
            range_after=_ranges(errors[1], bins),
            rms=tuple(float(np.sqrt(np.nanmean(error**2))) for error in errors),
            position_label=position_label,
        )
        return display.plot(ax=ax, unit=unit)

    def _draw(self, ax):
        factor, symbol = self._factor, self._symbol
        self.figure_, self.axes_ = make_axes(ax, 2, (6.2, 4.4), nrows=2, sharex=True)
        panels = (
            ("before", self.before, self.range_before, BEFORE),
            ("after", self.after, self.range_after, AFTER),
        )
        for axes, (name, errors, ranges, color), rms in zip(
            self.axes_, panels, self.rms, strict=True
        ):
            low, high = factor * ranges.T
            axes.fill_between(
                self.edges,
                np.append(low, low[-1]),
                np.append(high, high[-1]),
                step="post",
                color=color,
                alpha=0.22,
                linewidth=0,
            )
            axes.plot(
                self.position, factor * errors, ".", color=color, markersize=2.5, alpha=0.6, mew=0
            )
            peak = np.nanmax(np.abs(factor * ranges))
            title = f"{name}: RMS {figures(factor * rms)}, peak {figures(peak)} {symbol}"
            dress(axes, ylabel=f"error [{symbol}]", title=title)
        self.axes_[1].set_xlabel(self.position_label)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn, in the unit that it was drawn in.

        Returns
        -------
        tables : dict of str to DataFrame
            "points", and "bands", from the smallest to the largest error in each bin.
        """
        factor = self._factor
        points = pd.DataFrame(
            {
                self.position_label: self.position,
                f"error before [{self._unit}]": factor * self.before,
                f"error after [{self._unit}]": factor * self.after,
            }
        )
        bands = {"from": self.edges[:-1], "to": self.edges[1:]}
        bands = {f"{self.position_label}, {end}": edge for end, edge in bands.items()}
        for name, ranges in (("before", self.range_before), ("after", self.range_after)):
            for which, column in zip(("smallest", "largest"), ranges.T, strict=True):
                bands[f"{which} error {name} [{self._unit}]"] = factor * column
        return {"points": points, "bands": pd.DataFrame(bands)}


def _ranges(errors, bins):
    """Smallest and largest error in each bin; NaN where there is none."""
    low, high = np.full((2, _N_BINS), [[np.inf], [-np.inf]])
    known = np.isfinite(errors)
    np.minimum.at(low, bins[known], errors[known])
    np.maximum.at(high, bins[known], errors[known])
    ranges = np.column_stack([low, high])
    ranges[np.isinf(low)] = np.nan
    return ranges
