"""AllanDisplay: the Allan deviation of the error, before and after compensation."""

import textwrap
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ..allan import allan_coefficients, allan_deviation
from ._base import DisplayInUnit
from ._style import AFTER, BEFORE, dress, figures, make_axes, mark_decades

__all__ = ["AllanDisplay"]

_FEWEST_TIMES = 3  # for reading a slope off the curve
# Part by which a line of slope -1/2 may miss the first point of the curve.
_NEARLY = 0.3
_PER_ROOT_HOUR = 60.0  # deg/h at 1 s per deg/sqrt(h)

CAUTION = (
    "Smoothing is not compensation: a filter lowers the left of a curve and hides as much of the "
    "motion. What a compensation takes away lies on the right, at long averaging times."
)


@dataclass(kw_only=True, eq=False, repr=False)
class AllanDisplay(DisplayInUnit):
    """Allan deviation of the error against averaging time, before and after compensation.

    Angle random walk N is read where the slope of -1/2 passes 1 s, bias instability B at the
    minimum; both are drawn where the data reach them. The picture carries a caution, because a
    lower curve is often shown as proof of compensation: any filter lowers it at short times.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`. It needs the extra that
    :func:`allan_deviation` needs.

    Parameters
    ----------
    before, after : DataFrame
        As :func:`allan_deviation` returns them.

    Attributes
    ----------
    figure_, ax_ : matplotlib figure, matplotlib axes
        Once drawn.

    See Also
    --------
    allan_deviation, allan_coefficients

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import AllanDisplay
    >>> rng = np.random.default_rng(0)
    >>> noise = 0.01 * rng.standard_normal(20_000)  # deg/s at 1 Hz
    >>> drift = 0.01 * np.linspace(-1, 1, 20_000)
    >>> display = AllanDisplay.from_predictions(
    ...     np.zeros(20_000), noise + drift, noise, sampling_interval=1.0
    ... )  # doctest: +SKIP
    >>> first, last = display.before["deviation"].iloc[[0, -1]]  # doctest: +SKIP
    >>> bool(last > first / 2)  # doctest: +SKIP
    True
    """

    _PER_ROW = ("run",)
    _UNIT = "deg/h"

    before: Any
    after: Any

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        sampling_interval: float,
        run: ArrayLike | None = None,
        unit: str = "deg/h",
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s], evenly spaced in time within each run.
        sampling_interval : float
            Time between rows [s].
        run : array-like of shape (n_rows,), default=None
            Labels of the runs, over whose breaks no mean is taken; None is one run.
        unit : {"deg/s", "deg/h"}, default="deg/h"
            Unit to draw the deviation in.
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : AllanDisplay
        """
        rate = np.asarray(rate, dtype=float)
        curves = [
            allan_deviation(np.asarray(indicated) - rate, sampling_interval, run=run)
            for indicated in (before, after)
        ]
        return cls(before=curves[0], after=curves[1]).plot(ax=ax, unit=unit)

    def _draw(self, ax):
        self.figure_, axes = make_axes(ax, 1, (6.2, 4.4))
        self.ax_ = axes[0]
        for name, curve, color in (("before", self.before, BEFORE), ("after", self.after, AFTER)):
            time = curve["averaging_time"].to_numpy()
            deviation, error = (
                self._factor * curve[column].to_numpy() for column in ("deviation", "error")
            )
            self.ax_.fill_between(
                time,
                np.maximum(deviation - error, 0.1 * deviation),
                deviation + error,
                color=color,
                alpha=0.18,
                linewidth=0,
            )
            self.ax_.loglog(time, deviation, "o-", color=color, label=name, ms=3, linewidth=1.4)
            self._mark(time, deviation, color)
        dress(self.ax_, "averaging time [s]", f"Allan deviation [{self._symbol}]")
        for axis, ends in (
            (self.ax_.xaxis, self.ax_.get_xlim()),
            (self.ax_.yaxis, self.ax_.get_ylim()),
        ):
            mark_decades(axis, *ends)
        self.ax_.legend(frameon=False)
        self.ax_.set_title("\n".join(textwrap.wrap(CAUTION, 76)), loc="left", fontsize="small")

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn, in the unit that it was drawn in.

        Returns
        -------
        tables : dict of str to DataFrame
            "allan", before and after; the error is the deviation's standard error.
        """
        curves = []
        for name, curve in (("before", self.before), ("after", self.after)):
            factor = self._factor
            columns = {
                "curve": name,
                "averaging time [s]": curve["averaging_time"],
                f"Allan deviation [{self._unit}]": factor * curve["deviation"],
                f"error [{self._unit}]": factor * curve["error"],
            }
            curves.append(pd.DataFrame(columns))
        return {"allan": pd.concat(curves, ignore_index=True)}

    def _mark(self, time, deviation, color):
        """N at 1 s on its line of slope -1/2, and the minimum, where the curve has them."""
        if time.size < _FEWEST_TIMES or not (deviation > 0).all():
            return
        factor = self._factor
        read = allan_coefficients(time, deviation / factor)
        walk, instability = read.angle_random_walk, read.bias_instability
        if walk is not None and _is_read_at_short_times(walk, time, deviation / factor):
            line = np.array([1.0, time[np.argmin(deviation)]])
            level = factor * _PER_ROOT_HOUR * walk / np.sqrt(line)
            self.ax_.plot(line, level, ":", color=color, linewidth=1.2)
            self.ax_.annotate(
                f"N = {figures(walk)} °/√h",
                (line[0], level[0]),
                xytext=(6, 4),
                textcoords="offset points",
                color=color,
                fontsize="small",
            )
        if instability is not None:
            place = np.argmin(deviation)
            self.ax_.annotate(
                f"B = {figures(factor * instability)} {self._symbol}",
                (time[place], deviation[place]),
                xytext=(0, -14),
                textcoords="offset points",
                ha="center",
                color=color,
                fontsize="small",
            )


def _is_read_at_short_times(walk, time, deviation):
    """Whether a slope of -1/2 was found at the short end: elsewhere it is no white noise."""
    expected = _PER_ROOT_HOUR * walk / np.sqrt(time[0])
    return abs(deviation[0] / expected - 1.0) < _NEARLY
