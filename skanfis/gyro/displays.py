"""Plots of a compensation, in the style of scikit-learn's Displays: they store tables and draw."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ..inspection.displays import mark_decades
from ..inspection.labels import as_label
from ._columns import RATE_UNITS, evenly_chosen
from .metrics import allan_deviation, allan_figures, rms, table_of

# Colours that the colour-blind can tell apart.
SIDES = {"before": "#d55e00", "after": "#0072b2"}
_SIGNS = {"degC": "°C", "deg/": "°/", "sqrt(h)": "√h"}
# Bands, each about two dots wide in the picture; points, of which more would hide one another.
_N_BANDS, _N_POINTS = 300, 3_000
# Only the worst groups are shown: more lines could not be read.
_MOST_GROUPS = 30
_CAUTION = """\
Smoothing is not compensation: a filter lowers the left of a curve and hides
as much of the motion. What a compensation takes away lies on the right, at
long averaging times."""


class GyroDisplay:
    """A picture drawn from tables; it then has ``figure_``, ``axes_`` and ``ax_``, the first."""

    # Options with a value per row; those of _PER_ROW must be given.
    _PER_ROW: ClassVar[tuple[str, ...]] = ()
    _OPTIONAL: ClassVar[tuple[str, ...]] = ()
    # The first is the default unit of from_predictions.
    _UNITS: ClassVar[tuple[str, ...]] = ("deg/s", "deg/h")
    _PANELS = 1, 1  # rows and columns
    _size: tuple[float, float] = (6.2, 4.4)

    # Tables of what is drawn, from the errors of all rows in the unit, and options.
    _computed: Callable[..., dict[str, pd.DataFrame]]
    _tables: dict[str, pd.DataFrame]
    _unit: str
    _draw: Callable[..., None]

    def tables(self) -> dict[str, pd.DataFrame]:
        """The tables that are drawn, by name; columns have their units in their names."""
        return self._tables

    def plot(self, ax: Any = None) -> Self:
        """Draw; returns the display itself.

        Parameters
        ----------
        ax : matplotlib Figure, axes or array of axes, default=None
            Where to draw: an empty figure, or axes, one for each panel. None makes a figure.
        """
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure(layout="constrained")
        if hasattr(ax, "set_size_inches"):
            ax.set_size_inches(self._size)
            ax = ax.subplots(*self._PANELS, sharex="col", sharey="row")
        self.axes_ = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
        n_axes = np.prod(self._PANELS)
        if self.axes_.size != n_axes:
            raise ValueError(f"ax has {self.axes_.size} axes; this picture needs {n_axes}.")
        self.ax_, self.figure_ = self.axes_[0], self.axes_[0].figure
        self._draw(self.axes_, *self._tables.values())
        return self

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        unit: str | None = None,
        ax: Any = None,
        **options: Any,
    ) -> Self:
        """Compute from rates, and draw; returns the display.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN: the compensator refused the row.
        unit : {"deg/s", "deg/h"}, default=None
            Unit of the errors; None is that which is usual in this picture.
        ax : matplotlib Figure, axes or array of axes, default=None
            Where to draw, as for :meth:`plot`.
        **options
            What the class describes.
        """
        unit = cls._UNITS[0] if unit is None else unit
        if unit not in cls._UNITS:
            raise ValueError(f"unit={unit!r} must be one of {', '.join(cls._UNITS)}.")
        for name in cls._PER_ROW:
            if name not in options:
                raise TypeError(f"{cls.__name__} needs {name}, with one value per row.")
        columns = {"rate": rate, "before": before, "after": after}
        columns |= {name: options.pop(name, None) for name in (*cls._PER_ROW, *cls._OPTIONAL)}
        rows = table_of(columns, labels=("run", "groups"), gaps=SIDES)
        for side in SIDES:
            if rows[side].isna().all():
                raise ValueError(f"{side} is NaN in all rows: there is nothing to draw.")
            rows[side] = RATE_UNITS.get(unit, 1.0) * (rows[side] - rows["rate"])
        display = cls()
        display._unit = unit
        display._tables = display._computed(rows, **options)
        return display.plot(ax)


class ErrorDisplay(GyroDisplay):
    """The rate error before and after compensation, against time or temperature.

    A band reaches from the smallest to the largest error of all rows; points are some of the rows.

    ``from_predictions`` takes ``position``, a time or temperature per row, and ``position_label``.

    Examples
    --------
    >>> from skanfis.gyro import ErrorDisplay
    >>> before, after = [0.3, -0.3, 0.3], [0.1, -0.1, 0.1]
    >>> display = ErrorDisplay.from_predictions([0, 0, 0], before, after, position=[0, 1, 2])
    >>> display.tables()["whole"]["RMS error [deg/s]"].round(3).tolist()
    [0.3, 0.1]
    """

    _PER_ROW = ("position",)
    _PANELS = 2, 1

    def _computed(self, rows, position_label="time [s]"):
        errors, unit = rows[[*SIDES]], self._unit
        bins, edges = bins_of(rows["position"], _N_BANDS)
        ends = errors.groupby(bins).agg(["min", "max"]).reindex(range(_N_BANDS))
        ends.columns = [
            f"{end} error {side} [{unit}]" for side in errors for end in ("smallest", "largest")
        ]
        places = {f"{position_label}, from": edges[:-1], f"{position_label}, to": edges[1:]}
        points = rows.loc[evenly_chosen(len(rows), _N_POINTS), ["position", *SIDES]]
        points.columns = [position_label, *(f"error {side} [{unit}]" for side in errors)]
        whole = {
            "errors": errors.columns,
            f"RMS error [{unit}]": [rms(errors[side].dropna()) for side in errors],
            f"peak [{unit}]": errors.abs().max().to_numpy(),
        }
        return {
            "points": points.reset_index(drop=True),
            "bands": pd.DataFrame(places).join(ends),
            "whole": pd.DataFrame(whole),
        }

    def _draw(self, axes, points, bands, whole):
        places = bands.iloc[:, :2].to_numpy().ravel()  # both ends of every band, which is level
        for place, (panel, (side, color)) in enumerate(zip(axes, SIDES.items(), strict=True)):
            ends = bands.iloc[:, 2 + 2 * place : 4 + 2 * place].to_numpy().T
            style = {"color": color, "alpha": 0.22, "linewidth": 0}
            panel.fill_between(places, *np.repeat(ends, 2, axis=1), **style)
            style = {"color": color, "markersize": 2.5, "alpha": 0.6, "mew": 0}
            panel.plot(points.iloc[:, 0], points.iloc[:, 1 + place], ".", **style)
            size, peak = map(three_digits, whole.iloc[place, 1:])
            title = f"{side}: RMS {size}, peak {peak} {self._unit}"
            dress(panel, ylabel=f"error [{self._unit}]", title=title)
        axes[-1].set_xlabel(signs(points.columns[0]))


class GroupResidualDisplay(GyroDisplay):
    """RMS error of every held-out group, before and after, the worst 30 from the top down.

    ``from_predictions`` takes ``groups``, the label of each row's held-out group.

    Examples
    --------
    >>> from skanfis.gyro import GroupResidualDisplay
    >>> options = {"groups": ["cold", "hot"]}
    >>> display = GroupResidualDisplay.from_predictions([0, 0], [1, 2], [0.3, 0.1], **options)
    >>> display.tables()["groups"]["group"].tolist()
    ['hot', 'cold']
    """

    _PER_ROW = ("groups",)

    def _computed(self, rows):
        squares = rows[[*SIDES]].pow(2).groupby(rows["groups"], dropna=False).mean()
        # Groups without an answer last, at the top: nothing is worse.
        table = np.sqrt(squares).sort_values("after", kind="stable").reset_index()
        table.columns = ["group", *(f"RMS error {side} [{self._unit}]" for side in SIDES)]
        longest = min(table["group"].astype(str).str.len().max(), 60)  # names of files are long
        self._size = 6.1 + 0.08 * longest, 1.6 + 0.2 * min(len(table), _MOST_GROUPS)
        return {"groups": table}

    def _draw(self, axes, groups):
        (panel,), shown = axes, groups.iloc[-_MOST_GROUPS:]
        errors, lines = shown.iloc[:, 1:].to_numpy(), np.arange(len(shown))
        panel.hlines(lines, errors[:, 1], errors[:, 0], color="0.8", linewidth=2, zorder=1)
        for (side, color), error in zip(SIDES.items(), errors.T, strict=True):
            panel.plot(error, lines, "o", color=color, label=side, markersize=5)
        panel.set(xscale="log", xmargin=0.2)
        mark_decades(panel.xaxis)
        panel.set_yticks(lines, [as_label(group) for group in shown["group"]])
        panel.set_ylim(-0.7, len(shown) - 0.3)
        extent = f"worst {len(shown)} of {len(groups)}" if len(shown) < len(groups) else len(shown)
        middle, worst = map(three_digits, (groups.iloc[:, 2].median(), shown.iloc[:, 2].max()))
        title = f"{extent} groups\nafter: {middle} in the median, {worst} in the worst"
        dress(panel, f"RMS error [{self._unit}]", "held-out group", title, legend="")


class AllanDisplay(GyroDisplay):
    """Allan deviation of the error against averaging time, before and after compensation.

    The legend has N and B if the curve has them; the title cautions against smoothing.
    ``from_predictions`` takes ``time`` [s] and ``run``, labels of the runs or None. The curves are
    of all stretches of ten rows or more that follow one another evenly, none of them NaN.

    Examples
    --------
    >>> from skanfis.gyro import AllanDisplay
    >>> rates, options = ([0] * 20, [1, 2] * 10, [1, 1.1] * 10), {"time": range(20)}
    >>> display = AllanDisplay.from_predictions(*rates, **options)  # doctest: +SKIP
    """

    _PER_ROW = ("time",)
    _OPTIONAL = ("run",)
    _UNITS = ("deg/h", "deg/s")

    def _computed(self, rows):
        time, run, unit = rows["time"].to_numpy(), rows.get("run"), self._unit
        both = rows[[*SIDES]].notna().all(axis=1)
        errors = {side: rows[side].where(both).to_numpy() for side in SIDES}
        curves = {side: allan_deviation(error, time, run) for side, error in errors.items()}
        table = pd.concat(curves, names=["curve"]).reset_index("curve")
        names = "averaging time [s]", f"Allan deviation [{unit}]", f"error [{unit}]"
        table.columns = ["curve", *names]
        return {"allan": table.reset_index(drop=True)}

    def _draw(self, axes, allan):
        (panel,) = axes
        for side, color in SIDES.items():
            time, deviation, error = allan[allan["curve"] == side].iloc[:, 1:].to_numpy().T
            low = np.maximum(deviation - error, 0.1 * deviation)
            panel.fill_between(time, low, deviation + error, color=color, alpha=0.18, linewidth=0)
            label = side + self._coefficients(time, deviation)
            panel.loglog(time, deviation, "o-", color=color, label=label, ms=3, lw=1.4)
        dress(panel, "averaging time [s]", f"Allan deviation [{self._unit}]")
        mark_decades(panel.xaxis)
        mark_decades(panel.yaxis)
        panel.legend(frameon=False)
        panel.set_title(_CAUTION, loc="left", fontsize="small")

    def _coefficients(self, time, deviation):
        """N and B of a curve, in words."""
        factor = RATE_UNITS[self._unit] / RATE_UNITS["deg/h"]
        try:
            (walk, _), (instability, _), *_ = allan_figures(time, deviation / factor).values()
        except ValueError:
            return ""  # too few points, or no noise at all
        text = "" if np.isnan(walk) else f", N = {three_digits(walk)} °/√h"
        if np.isfinite(instability):
            text += f", B = {three_digits(factor * instability)} {signs(self._unit)}"
        return text


def bins_of(values, n_bins):
    """The bin of each value, and the edges of equal bins over the values."""
    low, high = values.min(), values.max()
    edges = np.linspace(low, high if high > low else low + 1.0, n_bins + 1)
    return pd.cut(values, edges, labels=False, include_lowest=True), edges


def dress(axes, xlabel="", ylabel="", title="", legend=None):
    """Labels, a light grid, no box; ``legend`` is the title of one beside the panel."""
    axes.grid(True, color="0.9", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set(xlabel=signs(xlabel), ylabel=signs(ylabel))
    axes.set_title(signs(title), loc="left", fontsize="medium")
    if legend is not None:
        axes.legend(title=legend, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def signs(text):
    """Units with the signs that are usual in print."""
    for name, sign in _SIGNS.items():
        text = text.replace(name, sign)
    return text


def three_digits(value):
    """A number with three digits that count, without an exponent where it can be; NaN is a dash."""
    if value == 0 or not np.isfinite(value):
        return "–" if np.isnan(value) else f"{value:g}"
    # The exponent after rounding: 9.996 becomes 10.0.
    decimals = max(2 - int(f"{value:.2e}".partition("e")[2]), 0)
    return f"{value:,.{decimals}f}" if decimals < 8 else f"{value:.2e}"
