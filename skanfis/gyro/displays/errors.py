"""The error before and after a compensation: over time, by group, by rate, as a loop, by Allan."""

import textwrap
from typing import Any

import numpy as np
import pandas as pd

from ...inspection.labels import as_label
from .._columns import evenly_chosen
from .._rate_units import PER_HOUR, RATE_UNITS
from ..allan import allan_coefficients, allan_deviation
from ..metrics import rms
from ._base import (
    AFTER,
    BEFORE,
    GyroDisplay,
    bins_of,
    dress,
    figures,
    mark_decades,
    signs,
)

__all__ = [
    "AllanDisplay",
    "ErrorDisplay",
    "GroupResidualDisplay",
    "HysteresisDisplay",
    "ScaleFactorErrorDisplay",
]

_TWO_ROWS: dict[str, Any] = {"nrows": 2, "sharex": True}
_SIDES = (("before", BEFORE), ("after", AFTER))
_BESIDE = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "frameon": False}
_WARMING, _COOLING = "#c8443c", "#3a6ea5"
# Bands about two dots wide in the picture; points beyond cover one another.
_N_BANDS, _N_POINTS = 300, 3_000
# The worst groups: more lines cannot be read.
MOST_GROUPS = 30
# Enough to show a loop, and few enough that every bin has rows; fewer rows have no mean.
_N_TEMPERATURES, _FEWEST_ROWS = 25, 3
# Odd ones: what an error of the scale factor adds changes its sign with the rate.
_POWERS = (1, 3, 5, 7)
# Odd, so that a bin has the rest in its middle; nearer to rest, a bias over the rate would fill
# the picture.
_N_RATES, _SMALLEST_SHARE = 41, 0.05
# Part by which a line of slope -1/2 may miss the first point of the curve, or it is no white noise.
_NEARLY = 0.3
_PER_ROOT_HOUR = 60.0  # deg/h at 1 s per deg/sqrt(h)
_CAUTION = (
    "Smoothing is not compensation: a filter lowers the left of a curve and hides as much of the "
    "motion. What a compensation takes away lies on the right, at long averaging times."
)


class ErrorDisplay(GyroDisplay):
    """The rate error before and after compensation, against time or temperature.

    Two panels, each with its own scale. A band reaches from the smallest to the largest error of
    all rows, so that no peak is lost; points are some of the rows.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them: "points", "bands", and "whole", the RMS and peak of all rows.

    Other Parameters
    ----------------
    position : array-like of shape (n_rows,)
        Time, temperature, or what else to draw the error against.
    position_label : str, default="time [s]"
        What the position is, with its unit.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import ErrorDisplay
    >>> rate, time = np.zeros(4), [0.0, 1.0, 2.0, 3.0]
    >>> before, after = [0.3, -0.3, 0.3, -0.3], [0.1, -0.1, 0.1, -0.1]
    >>> display = ErrorDisplay.from_predictions(rate, before, after, position=time)
    >>> display.tables()["whole"]["RMS error [deg/s]"].tolist()
    [0.3, 0.1]
    """

    _PER_ROW = ("position",)
    _PANELS = _TWO_ROWS

    @classmethod
    def _computed(cls, rows, unit, position_label="time [s]"):
        errors = rows[["before", "after"]]
        bins, edges = bins_of(rows["position"], _N_BANDS)
        ends = errors.groupby(bins).agg(["min", "max"]).reindex(range(_N_BANDS))
        bands = pd.DataFrame(
            {f"{position_label}, from": edges[:-1], f"{position_label}, to": edges[1:]}
            | {
                f"{name} error {side} [{unit}]": ends[side, end].to_numpy()
                for side in errors
                for name, end in (("smallest", "min"), ("largest", "max"))
            }
        )
        points = rows.loc[evenly_chosen(len(rows), _N_POINTS), ["position", "before", "after"]]
        points.columns = [position_label, *(f"error {side} [{unit}]" for side in errors)]
        whole = pd.DataFrame(
            {
                "errors": errors.columns,
                f"RMS error [{unit}]": [rms(errors[side].dropna()) for side in errors],
                f"peak [{unit}]": errors.abs().max().to_numpy(),
            }
        )
        return {"points": points.reset_index(drop=True), "bands": bands, "whole": whole}

    def _draw(self, axes, tables):
        points, bands = tables["points"], tables["bands"]
        label = points.columns[0]
        starts, ends = bands.iloc[:, 0], bands.iloc[:, 1]
        for place, (panel, (side, color)) in enumerate(zip(axes, _SIDES, strict=True)):
            low, high = (
                bands[f"{end} error {side} [{self._unit}]"] for end in ("smallest", "largest")
            )
            panel.fill_between(
                [*starts, ends.iloc[-1]],
                [*low, low.iloc[-1]],
                [*high, high.iloc[-1]],
                step="post",
                color=color,
                alpha=0.22,
                linewidth=0,
            )
            error = points[f"error {side} [{self._unit}]"]
            panel.plot(points[label], error, ".", color=color, markersize=2.5, alpha=0.6, mew=0)
            size, peak = map(figures, tables["whole"].iloc[place, 1:])
            title = f"{side}: RMS {size}, peak {peak} {self._unit}"
            dress(panel, ylabel=f"error [{self._unit}]", title=title)
        axes[-1].set_xlabel(signs(label))


class GroupResidualDisplay(GyroDisplay):
    """RMS error of every held-out group, before and after compensation, on a logarithmic axis.

    One line per run, device or rate level, the worst at the top; with more than 30, only the worst
    are drawn. A compensation is as good as the groups on which it is bad.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them: "groups", the smallest error after compensation first.

    Other Parameters
    ----------------
    groups : array-like of shape (n_rows,)
        Label of the group of each row, which was held out when its rows were compensated.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import GroupResidualDisplay
    >>> display = GroupResidualDisplay.from_predictions(
    ...     np.zeros(4), [1, -1, 2, 2], [0.3, -0.3, 0.1, 0.1], groups=["cold", "cold", "hot", "hot"]
    ... )
    >>> display.tables()["groups"]["group"].tolist()
    ['hot', 'cold']
    """

    _PER_ROW = ("groups",)

    @classmethod
    def _computed(cls, rows, unit):
        squares = rows[["before", "after"]].pow(2).groupby(rows["groups"]).mean()
        # Groups without an answer last, at the top: nothing is worse.
        table = np.sqrt(squares).sort_values("after", kind="stable").reset_index()
        table.columns = ["group", f"RMS error before [{unit}]", f"RMS error after [{unit}]"]
        return {"groups": table}

    def _size(self):
        return 6.2, 1.4 + 0.2 * min(len(self._tables["groups"]), MOST_GROUPS)

    def _draw(self, axes, tables):
        (panel,), table = axes, tables["groups"]
        shown = table.iloc[-MOST_GROUPS:]
        before, after = (shown.iloc[:, place].to_numpy() for place in (1, 2))
        lines = np.arange(len(shown))
        panel.hlines(lines, after, before, color="0.8", linewidth=2, zorder=1)
        panel.plot(before, lines, "o", color=BEFORE, label="before", markersize=5)
        panel.plot(after, lines, "o", color=AFTER, label="after", markersize=5)
        panel.set_xscale("log")
        drawn = np.concatenate([before, after])
        drawn = drawn[drawn > 0]
        if drawn.size:
            low, high = drawn.min(), drawn.max()
            # Beside the values, and a factor of four in all at least.
            room = max(1.15, 2.0 / np.sqrt(high / low))
            panel.set_xlim(low / room, high * room)
            mark_decades(panel.xaxis, low / room, high * room)
        panel.set_yticks(lines, [as_label(group) for group in shown["group"]])
        panel.set_ylim(-0.7, len(shown) - 0.3)
        extent = f"worst {len(shown)} of {len(table)}" if len(shown) < len(table) else len(shown)
        middle, worst = figures(table.iloc[:, 2].median()), figures(shown.iloc[:, 2].max())
        dress(
            panel,
            f"RMS error [{self._unit}]",
            "held-out group",
            f"{extent} groups: after, {middle} in the median, {worst} in the worst",
        )
        panel.legend(**_BESIDE)


class ScaleFactorErrorDisplay(GyroDisplay):
    r"""Scale-factor error against rate, at several temperatures, before and after compensation.

    The temperature's range is cut into equal bands, and the rate's into equal bins. In each, the
    bias, which is the error at rest of the band's least-squares line, is taken off the error, and
    the rest divided by the rate,

    .. math:: 10^6 \, \frac{\overline{\text{error} - \text{bias}}}{\overline{\text{rate}}} ,

    but for rates below 5 % of the largest, where any error is a large one in ppm.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them: "scale-factor", a row per band and bin that has rows.

    Other Parameters
    ----------------
    temperature : array-like of shape (n_rows,)
        Temperature [degC].
    n_temperatures : int, default=3
        Number of bands of the temperature.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import ScaleFactorErrorDisplay
    >>> rate, temperature = np.meshgrid(np.linspace(-100, 100, 41), [0.0, 25.0, 50.0])
    >>> error = (-410e-6 * (temperature - 25) * rate).ravel()  # -410 ppm/degC
    >>> rate, temperature = rate.ravel(), temperature.ravel()
    >>> display = ScaleFactorErrorDisplay.from_predictions(
    ...     rate, rate + error, rate, temperature=temperature
    ... )
    >>> display.tables()["scale-factor"][
    ...     "scale-factor error before [ppm]"
    ... ].round().unique().tolist()
    [10250.0, 0.0, -10250.0]
    """

    _PER_ROW = ("temperature",)
    _UNITS = ("ppm",)
    _PANELS = _TWO_ROWS

    @classmethod
    def _computed(cls, rows, unit, n_temperatures=3):
        if np.ptp(rows["rate"]) == 0:
            raise ValueError(f"rate is {rows['rate'][0]:g} in all rows: there is no scale factor.")
        bands, edges = bins_of(rows["temperature"], n_temperatures)
        bins, _ = bins_of(rows["rate"], _N_RATES)
        far = rows["rate"].abs() >= _SMALLEST_SHARE * rows["rate"].abs().max()
        means = {"true rate [deg/s]": rows["rate"][far].groupby([bands, bins]).mean()}
        for side in ("before", "after"):
            known = rows[["rate", side]].dropna()
            biases = bands.map({band: _bias(part) for band, part in known.groupby(bands)})
            known = known.assign(error=known[side] - biases)
            parts = known[far.reindex(known.index)].groupby([bands, bins]).mean()
            means[f"scale-factor error {side} [ppm]"] = 1e6 * parts["error"] / parts["rate"]
        table = pd.DataFrame(means).reset_index(names=["band", "bin"])
        band = table["band"].astype(int)
        ends = {"temperature, from [degC]": edges[band], "temperature, to [degC]": edges[band + 1]}
        table = pd.concat([pd.DataFrame(ends), table.drop(columns=["band", "bin"])], axis=1)
        return {"scale-factor": table}

    def _draw(self, axes, tables):
        import matplotlib

        bands = tables["scale-factor"].groupby(list(tables["scale-factor"].columns[:2]))
        colors = matplotlib.colormaps["plasma"](np.linspace(0.05, 0.75, bands.ngroups))
        for panel, (side, _) in zip(axes, _SIDES, strict=True):
            column = f"scale-factor error {side} [ppm]"
            for (ends, band), color in zip(bands, colors, strict=True):
                known = band.dropna(subset=column)
                rate, ppm = known["true rate [deg/s]"], known[column]
                # The line is broken at rest.
                for half, label in ((rate < 0, f"{np.mean(ends):.0f} °C"), (rate > 0, None)):
                    panel.plot(rate[half], ppm[half], ".-", color=color, label=label, lw=1.2, ms=4)
            largest = figures(tables["scale-factor"][column].abs().max())
            title = f"{side}: largest {largest} ppm"
            dress(panel, ylabel="scale-factor error [ppm]", title=title)
        axes[-1].set_xlabel(signs("true rate [deg/s]"))
        axes[0].legend(title="around", fontsize="small", **_BESIDE)


class HysteresisDisplay(GyroDisplay):
    """Bias against temperature while it rises and while it falls, before and after compensation.

    Where the bias depends on more than the temperature that is logged, the two branches part. No
    function of temperature alone can close such a loop. A dependence of the error on the rate (an
    odd polynomial, whose coefficients change linearly with temperature) is fitted together with the
    two branches and taken off.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them: "bias", by temperature; NaN where there are fewer than 3 rows.

    Other Parameters
    ----------------
    temperature, temperature_rate : array-like of shape (n_rows,)
        Temperature [degC], and how fast it changes [degC/min]: its sign tells warming from cooling.
    least_rate_of_change : float, default=0.05
        Rows that change more slowly [degC/min] belong to neither branch.

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
    _UNITS = ("deg/h", "deg/s")
    _PANELS = _TWO_ROWS

    @classmethod
    def _computed(cls, rows, unit, least_rate_of_change=0.05):
        bins, edges = bins_of(rows["temperature"], _N_TEMPERATURES)
        rows = rows.assign(bin=bins, is_warming=rows["temperature_rate"] > 0)
        moving = rows[rows["temperature_rate"].abs() >= least_rate_of_change]
        table = pd.DataFrame({"temperature [degC]": 0.5 * (edges[:-1] + edges[1:])})
        for side in ("before", "after"):
            biases = _bias_of_branches(moving.dropna(subset=side), side)
            for name, is_warming in (("warming", True), ("cooling", False)):
                table[f"bias {side}, {name} [{unit}]"] = biases[is_warming]
        return {"bias": table}

    @property
    def gap_before_(self) -> float:
        """Largest distance between the branches before compensation."""
        return self._gap("before")

    @property
    def gap_after_(self) -> float:
        """Largest distance between the branches after compensation."""
        return self._gap("after")

    def _branches(self, side):
        table = self._tables["bias"]
        return [table[f"bias {side}, {name} [{self._unit}]"] for name in ("warming", "cooling")]

    def _gap(self, side):
        warming, cooling = self._branches(side)
        return float((warming - cooling).abs().max())

    def _draw(self, axes, tables):
        temperature = tables["bias"]["temperature [degC]"]
        for panel, (side, _) in zip(axes, _SIDES, strict=True):
            warming, cooling = self._branches(side)
            met = warming.notna() & cooling.notna()
            panel.fill_between(temperature, warming, cooling, where=met, color="0.9", linewidth=0)
            panel.plot(temperature, warming, "^-", color=_WARMING, label="warming", ms=4)
            panel.plot(temperature, cooling, "v-", color=_COOLING, label="cooling", ms=4)
            gap = f"largest gap {figures(self._gap(side))} {self._unit}"
            title = f"{side}: {gap if met.any() else 'branches never meet'}"
            dress(panel, ylabel=f"bias [{self._unit}]", title=title)
        axes[-1].set_xlabel("temperature [°C]")
        axes[0].legend(**_BESIDE)


class AllanDisplay(GyroDisplay):
    """Allan deviation of the error against averaging time, before and after compensation.

    Angle random walk N is read where the slope of -1/2 passes 1 s, bias instability B at the
    minimum; both are drawn where the data reach them. The picture carries a caution, because a
    lower curve is often shown as proof of compensation: any filter lowers it at short times.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them: "allan"; the error is the deviation's standard error.

    Other Parameters
    ----------------
    sampling_interval : float
        Time between rows [s], which are evenly spaced within each run.
    run : array-like of shape (n_rows,), default=None
        Labels of the runs, over whose breaks no mean is taken; None is one run.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import AllanDisplay
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal((2, 20_000))  # deg/s at 1 Hz
    >>> display = AllanDisplay.from_predictions(
    ...     np.zeros(20_000), *noise, sampling_interval=1.0
    ... )  # doctest: +SKIP
    >>> len(display.tables()["allan"])  # doctest: +SKIP
    22
    """

    _OPTIONAL = ("run",)
    _UNITS = ("deg/h", "deg/s")

    @classmethod
    def _computed(cls, rows, unit, sampling_interval):
        run, parts = rows.get("run"), []
        for side in ("before", "after"):
            curve = allan_deviation(rows[side], sampling_interval, run=run)  # times 3600, for deg/s
            columns = {
                "curve": side,
                "averaging time [s]": curve["averaging_time"],
                f"Allan deviation [{unit}]": curve["deviation"] / PER_HOUR,
                f"error [{unit}]": curve["error"] / PER_HOUR,
            }
            parts.append(pd.DataFrame(columns))
        return {"allan": pd.concat(parts, ignore_index=True)}

    def _draw(self, axes, tables):
        (panel,) = axes
        for side, color in _SIDES:
            curve = tables["allan"][tables["allan"]["curve"] == side]
            time, deviation, error = (curve.iloc[:, place].to_numpy() for place in (1, 2, 3))
            low = np.maximum(deviation - error, 0.1 * deviation)
            panel.fill_between(time, low, deviation + error, color=color, alpha=0.18, linewidth=0)
            panel.loglog(time, deviation, "o-", color=color, label=side, ms=3, linewidth=1.4)
            self._mark(panel, time, deviation, color)
        dress(panel, "averaging time [s]", f"Allan deviation [{self._unit}]")
        mark_decades(panel.xaxis, *panel.get_xlim())
        mark_decades(panel.yaxis, *panel.get_ylim())
        panel.legend(frameon=False)
        panel.set_title("\n".join(textwrap.wrap(_CAUTION, 76)), loc="left", fontsize="small")

    def _mark(self, panel, time, deviation, color):
        """N at 1 s on its line of slope -1/2, and B at the minimum, where the curve has them."""
        factor = RATE_UNITS[self._unit] / RATE_UNITS["deg/h"]
        try:
            read = allan_coefficients(time, deviation / factor)
        except ValueError:
            return  # too few points, or no noise at all
        style = {"textcoords": "offset points", "color": color, "fontsize": "small"}
        lowest = np.argmin(deviation)
        if (walk := read.angle_random_walk) is not None:
            ends = np.array([1.0, time[lowest]])
            level = factor * _PER_ROOT_HOUR * walk / np.sqrt(ends)
            expected = level[0] / np.sqrt(time[0])
            if abs(deviation[0] / expected - 1.0) < _NEARLY:
                panel.plot(ends, level, ":", color=color, linewidth=1.2)
                text = f"N = {figures(walk)} °/√h"
                panel.annotate(text, (ends[0], level[0]), xytext=(6, 4), **style)
        if read.bias_instability is not None:
            text = f"B = {figures(factor * read.bias_instability)} {signs(self._unit)}"
            place = (time[lowest], deviation[lowest])
            panel.annotate(text, place, xytext=(0, -14), ha="center", **style)


def _bias(rows):
    """Error at rest of the least-squares line of the last column against the rate."""
    rate, error = rows["rate"], rows.iloc[:, -1]
    return np.polyfit(rate, error, 1)[1] if np.ptp(rate) > 0 else 0.0


def _bias_of_branches(rows, side):
    """Mean error at rest by bin of temperature, for each branch.

    One constant per bin and branch is fitted beside the polynomial, whose coefficients are those of
    least squares on what the means leave of errors and powers alike (Frisch and Waugh 1933).
    """
    ratio = rows["rate"] / (rows["rate"].abs().max() or 1.0)
    deviation = rows["temperature"] - rows["temperature"].mean()
    powers = pd.DataFrame(
        {k: ratio**k for k in _POWERS} | {-k: ratio**k * deviation for k in _POWERS}
    )
    keys = [rows["is_warming"], rows["bin"]]
    design = powers - powers.groupby(keys).transform("mean")
    left = rows[side] - rows[side].groupby(keys).transform("mean")
    coefficients = np.linalg.lstsq(design, left, rcond=None)[0]
    found = (rows[side] - powers @ coefficients).groupby(keys).agg(["mean", "size"])
    means = found["mean"].where(found["size"] >= _FEWEST_ROWS).unstack("is_warming")
    return means.reindex(index=range(_N_TEMPERATURES), columns=[True, False])
