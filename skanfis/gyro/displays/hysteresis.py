"""HysteresisDisplay: bias against temperature, warming and cooling apart."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._columns import PER_HOUR
from ._base import DisplayInUnit, binned, check_rows, mean_by_cell
from ._style import COOLING, WARMING, dress, figures, make_axes

__all__ = ["HysteresisDisplay"]

# Enough to show a loop, and few enough that every bin has rows.
_N_BINS = 25
_FEWEST_ROWS = 3  # of a bin, below which its mean is not drawn
# Odd ones: what an error of the scale factor adds changes its sign with the rate.
_POWERS = (1, 3, 5, 7)


@dataclass(kw_only=True, eq=False, repr=False)
class HysteresisDisplay(DisplayInUnit):
    """Bias against temperature while it rises and while it falls, before and after compensation.

    Where the bias depends on more than the temperature that is logged, the two branches part: the
    thermometer lags behind the coil, and the coil's thermal rate has an effect of its own. No
    function of temperature alone can close such a loop.

    A dependence of the error on the rate (an odd polynomial, whose coefficients change linearly
    with temperature) is fitted together with the two branches and taken off.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    temperature : ndarray of shape (n_bins,)
        Middles of the bins [degC].
    before, after : ndarray of shape (2, n_bins)
        Bias while warming, and while cooling [deg/h]; NaN where there are fewer than 3 rows.

    Attributes
    ----------
    gap_before_, gap_after_ : float
        Largest distance between the branches [deg/h]; NaN where they never meet at a temperature.
    figure_, axes_ : matplotlib figure, ndarray of matplotlib axes of shape (2,)
        Before, after; once drawn.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import HysteresisDisplay
    >>> time = np.linspace(0, 2, 2001)
    >>> temperature = 20 + 30 * np.sin(np.pi * time)
    >>> temperature_rate = np.cos(np.pi * time)  # degC/min
    >>> bias = (0.5 * temperature + 10 * temperature_rate) / 3600
    >>> rate = np.zeros(2001)
    >>> display = HysteresisDisplay.from_predictions(
    ...     rate, bias, rate, temperature=temperature, temperature_rate=temperature_rate
    ... )
    >>> round(display.gap_before_), display.gap_after_
    (20, 0.0)
    """

    _PER_ROW = ("temperature", "temperature_rate")
    _UNIT = "deg/h"

    temperature: np.ndarray
    before: np.ndarray
    after: np.ndarray

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        temperature: ArrayLike,
        temperature_rate: ArrayLike,
        least_rate_of_change: float = 0.05,
        unit: str = "deg/h",
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN: the compensator refused the row.
        temperature : array-like of shape (n_rows,)
            Temperature [degC].
        temperature_rate : array-like of shape (n_rows,)
            How fast it changes [degC/min]; its sign tells warming from cooling.
        least_rate_of_change : float, default=0.05
            Rows that change more slowly [degC/min] belong to neither branch.
        unit : {"deg/s", "deg/h"}, default="deg/h"
            Unit to draw the bias in.
        ax : array of two matplotlib axes, default=None
            For before and after; None makes a figure.

        Returns
        -------
        display : HysteresisDisplay

        Raises
        ------
        ValueError
            If columns differ in length, are empty or not finite, or there is no such ``unit``.
        ImportError
            Without matplotlib.
        """
        rate, before, after, temperature, temperature_rate = check_rows(
            rate=rate,
            before=before,
            after=after,
            temperature=temperature,
            temperature_rate=temperature_rate,
        )
        edges, bins = binned(temperature, _N_BINS)
        moving = np.abs(temperature_rate) >= least_rate_of_change
        cells = bins + _N_BINS * (temperature_rate < 0)
        branches = [
            PER_HOUR * _bias_by_cell(indicated - rate, rate, temperature, cells, moving)
            for indicated in (before, after)
        ]
        display = cls(
            temperature=0.5 * (edges[:-1] + edges[1:]), before=branches[0], after=branches[1]
        )
        return display.plot(ax=ax, unit=unit)

    @property
    def gap_before_(self) -> float:
        """Largest distance between the branches before compensation [deg/h]."""
        return _gap(self.before)

    @property
    def gap_after_(self) -> float:
        """Largest distance between the branches after compensation [deg/h]."""
        return _gap(self.after)

    def _draw(self, ax):
        factor = self._factor
        self.figure_, self.axes_ = make_axes(ax, 2, (6.2, 4.6), nrows=2, sharex=True)
        panels = zip(
            self.axes_,
            ("before", "after"),
            (factor * self.before, factor * self.after),
            (factor * self.gap_before_, factor * self.gap_after_),
            strict=True,
        )
        for axes, name, (warming, cooling), gap in panels:
            both = np.isfinite(warming) & np.isfinite(cooling)
            axes.fill_between(
                self.temperature, warming, cooling, where=both, color="0.9", linewidth=0
            )
            axes.plot(self.temperature, warming, "^-", color=WARMING, label="warming", ms=4)
            axes.plot(self.temperature, cooling, "v-", color=COOLING, label="cooling", ms=4)
            what = "branches never meet"
            if both.any():
                what = f"largest gap {figures(gap)} {self._symbol}"
            dress(axes, ylabel=f"bias [{self._symbol}]", title=f"{name}: {what}")
        self.axes_[1].set_xlabel("temperature [°C]")
        self.axes_[0].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn, in the unit that it was drawn in.

        Returns
        -------
        tables : dict of str to DataFrame
            "bias", by temperature.
        """
        factor = self._factor
        columns = {"temperature [degC]": self.temperature}
        for name, branches in (("before", self.before), ("after", self.after)):
            for branch, values in zip(("warming", "cooling"), branches, strict=True):
                columns[f"bias {name}, {branch} [{self._unit}]"] = factor * values
        return {"bias": pd.DataFrame(columns)}


def _gap(branches):
    distance = np.abs(branches[0] - branches[1])
    return float(np.nanmax(distance)) if np.isfinite(distance).any() else float("nan")


def _bias_by_cell(error, rate, temperature, cells, rows):
    """Mean error of each cell at rest, (2, n_bins): one constant per cell beside the polynomial.

    The polynomial's coefficients are those of least squares on what the cells' means leave of error
    and of powers alike (Frisch and Waugh 1933), so that the many cells never enter a matrix.
    """
    rows = rows & np.isfinite(error)
    error, rate, temperature, cells = error[rows], rate[rows], temperature[rows], cells[rows]
    counts = np.bincount(cells, minlength=2 * _N_BINS)

    def mean(values):
        return mean_by_cell(values, cells, 2 * _N_BINS)

    largest = np.abs(rate).max(initial=0.0) or 1.0
    spread = temperature.std() if temperature.size else 0.0
    tau = (temperature - temperature.mean()) / spread if spread else np.zeros_like(temperature)
    powers = [(rate / largest) ** k * factor for k in _POWERS for factor in (1.0, tau)]
    design = np.column_stack([power - mean(power)[cells] for power in powers])
    coefficients = np.linalg.lstsq(design, error - mean(error)[cells], rcond=None)[0]
    by_rate = sum(c * power for c, power in zip(coefficients, powers, strict=True))
    bias = np.where(counts >= _FEWEST_ROWS, mean(error - by_rate), np.nan)
    return bias.reshape(2, _N_BINS)
