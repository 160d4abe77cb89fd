"""GroupResidualDisplay: the residual of every group that was held out."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ...inspection.labels import as_label
from ._base import DisplayInUnit, check_rows, mean_by_cell
from ._style import AFTER, BEFORE, dress, figures, make_axes, mark_decades

__all__ = ["MOST_LINES", "GroupResidualDisplay"]

# The worst groups: more lines cannot be read.
MOST_LINES = 30


@dataclass(kw_only=True, eq=False, repr=False)
class GroupResidualDisplay(DisplayInUnit):
    """RMS error of every held-out group, before and after compensation, on a logarithmic axis.

    One line per run, device or rate level, the worst at the top; with more than 30, only the worst
    are drawn. A compensation is as good as the groups on which it is bad.

    Make it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    groups : ndarray of shape (n_groups,)
        Labels of the groups, in the order of their error after compensation, smallest first.
    before, after : ndarray of shape (n_groups,)
        RMS errors [deg/s]; NaN where the compensator refused all rows of the group.

    Attributes
    ----------
    figure_, ax_ : matplotlib figure, matplotlib axes
        Once drawn.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import GroupResidualDisplay
    >>> rate, run = np.zeros(4), np.array(["cold", "cold", "hot", "hot"])
    >>> display = GroupResidualDisplay.from_predictions(
    ...     rate, [1.0, -1.0, 2.0, 2.0], [0.3, -0.3, 0.1, 0.1], groups=run
    ... )
    >>> display.groups, display.after
    (array(['hot', 'cold'], dtype=...), array([0.1, 0.3]))
    """

    _PER_ROW = ("groups",)

    groups: np.ndarray
    before: np.ndarray
    after: np.ndarray

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        groups: ArrayLike,
        unit: str = "deg/s",
        ax: Any = None,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s], each row compensated by an estimator that
            had not seen its group. NaN: the compensator refused the row.
        groups : array-like of shape (n_rows,)
            Label of the group of each row.
        unit : {"deg/s", "deg/h"}, default="deg/s"
            Unit to draw in.
        ax : matplotlib axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : GroupResidualDisplay

        Raises
        ------
        ValueError
            If columns differ in length, are empty or not finite, or there is no such ``unit``.
        ImportError
            Without matplotlib.
        """
        rate, before, after, groups = check_rows(
            rate=rate, before=before, after=after, groups=groups
        )
        labels, codes = np.unique(groups, return_inverse=True)
        results = [_rms_by_group(indicated - rate, codes) for indicated in (before, after)]
        # Groups without an answer last, at the top: nothing is worse.
        order = np.argsort(results[1], kind="stable")
        display = cls(groups=labels[order], before=results[0][order], after=results[1][order])
        return display.plot(ax=ax, unit=unit)

    def _draw(self, ax):
        factor = self._factor
        shown = slice(-MOST_LINES, None)
        groups = self.groups[shown]
        before, after = factor * self.before[shown], factor * self.after[shown]
        height = 1.4 + 0.2 * len(groups)
        self.figure_, axes = make_axes(ax, 1, (6.2, height))
        self.ax_ = axes[0]
        lines = np.arange(len(groups))
        self.ax_.hlines(lines, after, before, color="0.8", linewidth=2, zorder=1)
        self.ax_.plot(before, lines, "o", color=BEFORE, label="before", markersize=5)
        self.ax_.plot(after, lines, "o", color=AFTER, label="after", markersize=5)
        self.ax_.set_xscale("log")
        drawn = np.concatenate([before, after])
        drawn = drawn[drawn > 0]
        if drawn.size:
            mark_decades(self.ax_.xaxis, *_with_room(self.ax_, drawn))
        self.ax_.set_yticks(lines, [as_label(group) for group in groups])
        self.ax_.set_ylim(-0.7, len(groups) - 0.3)
        left_out = len(self.groups) - len(groups)
        extent = f"worst {len(groups)} of {len(self.groups)}" if left_out else f"{len(groups)}"
        worst = figures(np.nanmax(after))
        dress(
            self.ax_,
            f"RMS error [{self._symbol}]",
            "held-out group",
            f"{extent} groups: after, {figures(np.nanmedian(factor * self.after))} in the median, "
            f"{worst} in the worst",
        )
        self.ax_.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn, in the unit that it was drawn in; groups that are not drawn, too.

        Returns
        -------
        tables : dict of str to DataFrame
            "groups", the smallest error after compensation first.
        """
        factor = self._factor
        columns = {
            "group": self.groups,
            f"RMS error before [{self._unit}]": factor * self.before,
            f"RMS error after [{self._unit}]": factor * self.after,
        }
        return {"groups": pd.DataFrame(columns)}


def _with_room(axes, values):
    """Ends of an axis that leaves room beside the values, and covers a factor of four at least."""
    low, high = values.min(), values.max()
    room = max(1.15, 2.0 / np.sqrt(high / low))
    axes.set_xlim(low / room, high * room)
    return low / room, high * room


def _rms_by_group(errors, codes):
    known = np.isfinite(errors)
    return np.sqrt(mean_by_cell(errors[known] ** 2, codes[known], codes.max() + 1))
