"""The error before and after a compensation: over time, by group, by rate, as a loop, by Allan."""

import textwrap
from typing import ClassVar

import numpy as np
import pandas as pd

from ...inspection.labels import as_label
from .._columns import PER_HOUR, RATE_UNITS, evenly_chosen
from ..allan import allan_coefficients, allan_deviation
from ..metrics import rms
from ._base import SIDES, GyroDisplay, bins_of, dress, figures, mark_decades, signs

__all__ = [
    "AllanDisplay",
    "ErrorDisplay",
    "GroupResidualDisplay",
    "HysteresisDisplay",
    "ScaleFactorErrorDisplay",
]

_TWO_ROWS = {"nrows": 2, "sharex": True}
_BRANCHES = {"warming": ("^-", "#c8443c"), "cooling": ("v-", "#3a6ea5")}
# Bands about two dots wide in the picture; points beyond cover one another.
_N_BANDS, _N_POINTS = 300, 3_000
# The worst groups: more lines cannot be read.
_MOST_GROUPS = 30
# Enough to show a loop, and few enough that every bin has rows; fewer rows have no mean.
_N_TEMPERATURES, _FEWEST_ROWS = 25, 3
# Odd ones: what an error of the scale factor adds changes its sign with the rate.
_POWERS = (1, 3, 5, 7)
# Odd, so that a bin has the rest in its middle; near rest, a bias over the rate would fill it.
_N_RATES, _SMALLEST_SHARE = 41, 0.05
_CAUTION = (
    "Smoothing is not compensation: a filter lowers the left of a curve and hides as much of the "
    "motion. What a compensation takes away lies on the right, at long averaging times."
)


class ErrorDisplay(GyroDisplay):
    """The rate error before and after compensation, against time or temperature.

    A band reaches from the smallest to the largest error of all rows; points are some of the rows.

    ``from_predictions`` takes ``position``, a time or temperature per row, and ``position_label``.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

    Examples
    --------
    >>> from skanfis.gyro import ErrorDisplay
    >>> before, after = [0.3, -0.3, 0.3], [0.1, -0.1, 0.1]
    >>> display = ErrorDisplay.from_predictions([0, 0, 0], before, after, position=[0, 1, 2])
    >>> display.tables()["whole"]["RMS error [deg/s]"].round(3).tolist()
    [0.3, 0.1]
    """

    _PER_ROW = ("position",)
    _PANELS: ClassVar = _TWO_ROWS

    @classmethod
    def _computed(cls, rows, unit, position_label="time [s]"):
        errors = rows[["before", "after"]]
        bins, edges = bins_of(rows["position"], _N_BANDS)
        ends = errors.groupby(bins).agg(["min", "max"]).reindex(range(_N_BANDS))
        bands = {f"{position_label}, from": edges[:-1], f"{position_label}, to": edges[1:]}
        for side in errors:
            bands[f"smallest error {side} [{unit}]"] = ends[side, "min"]
            bands[f"largest error {side} [{unit}]"] = ends[side, "max"]
        points = rows.loc[evenly_chosen(len(rows), _N_POINTS), ["position", "before", "after"]]
        points.columns = [position_label, *(f"error {side} [{unit}]" for side in errors)]
        whole = {
            "errors": errors.columns,
            f"RMS error [{unit}]": [rms(errors[side].dropna()) for side in errors],
            f"peak [{unit}]": errors.abs().max().to_numpy(),
        }
        points = points.reset_index(drop=True)
        return {"points": points, "bands": pd.DataFrame(bands), "whole": pd.DataFrame(whole)}

    def _draw(self, axes, points, bands, whole):
        # Every band is a step, and the last one ends.
        steps = pd.concat([bands, bands.tail(1)]).to_numpy(copy=True)
        steps[-1, 0] = steps[-1, 1]
        for place, (panel, (side, color)) in enumerate(zip(axes, SIDES, strict=True)):
            low, high = steps[:, 2 + 2 * place : 4 + 2 * place].T
            style = {"step": "post", "color": color, "alpha": 0.22, "linewidth": 0}
            panel.fill_between(steps[:, 0], low, high, **style)
            error = points.iloc[:, 1 + place]
            style = {"color": color, "markersize": 2.5, "alpha": 0.6, "mew": 0}
            panel.plot(points.iloc[:, 0], error, ".", **style)
            size, peak = map(figures, whole.iloc[place, 1:])
            title = f"{side}: RMS {size}, peak {peak} {self._unit}"
            dress(panel, ylabel=f"error [{self._unit}]", title=title)
        axes[-1].set_xlabel(signs(points.columns[0]))


class GroupResidualDisplay(GyroDisplay):
    """RMS error of every held-out group, before and after, the worst 30 from the top down.

    ``from_predictions`` takes ``groups``, the label of each row's held-out group.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

    Examples
    --------
    >>> from skanfis.gyro import GroupResidualDisplay
    >>> options = {"groups": ["cold", "hot"]}
    >>> display = GroupResidualDisplay.from_predictions([0, 0], [1, 2], [0.3, 0.1], **options)
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
        return 6.2, 1.4 + 0.2 * min(len(self._tables["groups"]), _MOST_GROUPS)

    def _draw(self, axes, groups):
        (panel,), shown = axes, groups.iloc[-_MOST_GROUPS:]
        errors, lines = shown.iloc[:, 1:].to_numpy(), np.arange(len(shown))
        panel.hlines(lines, errors[:, 1], errors[:, 0], color="0.8", linewidth=2, zorder=1)
        for (side, color), error in zip(SIDES, errors.T, strict=True):
            panel.plot(error, lines, "o", color=color, label=side, markersize=5)
        panel.set_xscale("log")
        panel.margins(x=0.2)
        mark_decades(panel.xaxis, *panel.get_xlim())
        panel.set_yticks(lines, [as_label(group) for group in shown["group"]])
        panel.set_ylim(-0.7, len(shown) - 0.3)
        extent = f"worst {len(shown)} of {len(groups)}" if len(shown) < len(groups) else len(shown)
        middle, worst = figures(groups.iloc[:, 2].median()), figures(shown.iloc[:, 2].max())
        title = f"{extent} groups: after, {middle} in the median, {worst} in the worst"
        dress(panel, f"RMS error [{self._unit}]", "held-out group", title, legend="")


class ScaleFactorErrorDisplay(GyroDisplay):
    """Scale-factor error against rate, in bands of temperature, before and after compensation.

    It is what the bias, read off the band's least-squares line, leaves of the error, over the rate.
    Rates below 5 % of the largest are left out.

    ``from_predictions`` takes ``temperature`` [degC] and ``n_temperatures``, the number of bands.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

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
    _PANELS: ClassVar = _TWO_ROWS

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

    def _draw(self, axes, scale_factor):
        import matplotlib

        bands = scale_factor.groupby(list(scale_factor.columns[:2]))
        colors = matplotlib.colormaps["plasma"](np.linspace(0.05, 0.75, bands.ngroups))
        for panel, (side, _) in zip(axes, SIDES, strict=True):
            column = f"scale-factor error {side} [ppm]"
            for (ends, band), color in zip(bands, colors, strict=True):
                known = band.dropna(subset=column)
                rate, ppm = known["true rate [deg/s]"], known[column]
                # The line is broken at rest.
                for half, label in ((rate < 0, f"{np.mean(ends):.0f} °C"), (rate > 0, None)):
                    panel.plot(rate[half], ppm[half], ".-", color=color, label=label, lw=1.2, ms=4)
            title = f"{side}: largest {figures(scale_factor[column].abs().max())} ppm"
            legend = "around" if panel is axes[0] else None
            dress(panel, ylabel="scale-factor error [ppm]", title=title, legend=legend)
        axes[-1].set_xlabel(signs("true rate [deg/s]"))


class HysteresisDisplay(GyroDisplay):
    """Bias against temperature while it rises and while it falls, before and after compensation.

    What the error owes to the rate (an odd polynomial, linear in temperature) is taken off.

    ``from_predictions`` takes ``temperature`` [degC], ``temperature_rate`` [degC/min] and
    ``least_rate_of_change``, below which a row belongs to neither branch (0.05 degC/min).

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import HysteresisDisplay
    >>> rate, angle = np.zeros(2001), np.linspace(0, 2 * np.pi, 2001)
    >>> options = {"temperature": np.sin(angle), "temperature_rate": np.cos(angle)}
    >>> before = 10 * np.cos(angle) / 3600
    >>> display = HysteresisDisplay.from_predictions(rate, before, rate, **options)
    >>> round(display.gap_before_), display.gap_after_
    (20, 0.0)
    """

    _PER_ROW = ("temperature", "temperature_rate")
    _UNITS = ("deg/h", "deg/s")
    _PANELS: ClassVar = _TWO_ROWS

    @classmethod
    def _computed(cls, rows, unit, least_rate_of_change=0.05):
        bins, edges = bins_of(rows["temperature"], _N_TEMPERATURES)
        branch = np.where(rows["temperature_rate"] > 0, *_BRANCHES)
        rows = rows.assign(bin=bins, branch=branch)
        moving = rows[rows["temperature_rate"].abs() >= least_rate_of_change]
        table = pd.DataFrame({"temperature [degC]": 0.5 * (edges[:-1] + edges[1:])})
        for side in ("before", "after"):
            biases = _bias_of_branches(moving.dropna(subset=side), side)
            for name in _BRANCHES:
                table[f"bias {side}, {name} [{unit}]"] = biases[name]
        return {"bias": table}

    @property
    def gap_before_(self) -> float:
        """Largest distance between the branches before compensation."""
        return self._gap(self._tables["bias"].iloc[:, 1:3])

    @property
    def gap_after_(self) -> float:
        """Largest distance between the branches after compensation."""
        return self._gap(self._tables["bias"].iloc[:, 3:5])

    def _gap(self, branches):
        return float(branches.diff(axis=1).iloc[:, 1].abs().max())

    def _draw(self, axes, bias):
        temperature = bias["temperature [degC]"]
        gaps, legends = (self.gap_before_, self.gap_after_), ("", None)
        for place, (panel, (side, _)) in enumerate(zip(axes, SIDES, strict=True)):
            branches = bias.iloc[:, 1 + 2 * place : 3 + 2 * place].to_numpy().T
            panel.fill_between(temperature, *branches, color="0.9", linewidth=0)
            for values, (name, (form, color)) in zip(branches, _BRANCHES.items(), strict=True):
                panel.plot(temperature, values, form, color=color, label=name, ms=4)
            found = f"largest gap {figures(gaps[place])} {self._unit}"
            title = f"{side}: {'branches never meet' if np.isnan(gaps[place]) else found}"
            dress(panel, ylabel=f"bias [{self._unit}]", title=title, legend=legends[place])
        axes[-1].set_xlabel("temperature [°C]")


class AllanDisplay(GyroDisplay):
    """Allan deviation of the error against averaging time, before and after compensation.

    The legend has N and B where the curve has them, the title a caution against smoothing.
    ``from_predictions`` takes ``sampling_interval`` [s] and ``run``, labels of the runs or None.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.

    Examples
    --------
    >>> from skanfis.gyro import AllanDisplay
    >>> rates, options = ([0] * 20, [1, 2] * 10, [1, 1.1] * 10), {"sampling_interval": 1.0}
    >>> display = AllanDisplay.from_predictions(*rates, **options)  # doctest: +SKIP
    """

    _OPTIONAL = ("run",)
    _UNITS = ("deg/h", "deg/s")

    @classmethod
    def _computed(cls, rows, unit, sampling_interval):
        parts = []
        for side in ("before", "after"):
            # This takes deg/s and gives deg/h: 3600 times the unit of what it is given.
            curve = allan_deviation(rows[side], sampling_interval, run=rows.get("run"))
            columns = {
                "curve": side,
                "averaging time [s]": curve["averaging_time"],
                f"Allan deviation [{unit}]": curve["deviation"] / PER_HOUR,
                f"error [{unit}]": curve["error"] / PER_HOUR,
            }
            parts.append(pd.DataFrame(columns))
        return {"allan": pd.concat(parts, ignore_index=True)}

    def _draw(self, axes, allan):
        (panel,) = axes
        for side, color in SIDES:
            time, deviation, error = allan[allan["curve"] == side].iloc[:, 1:].to_numpy().T
            low, label = (
                np.maximum(deviation - error, 0.1 * deviation),
                self._label(time, deviation),
            )
            panel.fill_between(time, low, deviation + error, color=color, alpha=0.18, linewidth=0)
            panel.loglog(time, deviation, "o-", color=color, label=side + label, ms=3, lw=1.4)
        dress(panel, "averaging time [s]", f"Allan deviation [{self._unit}]")
        mark_decades(panel.xaxis, *panel.get_xlim())
        mark_decades(panel.yaxis, *panel.get_ylim())
        panel.legend(frameon=False)
        panel.set_title("\n".join(textwrap.wrap(_CAUTION, 76)), loc="left", fontsize="small")

    def _label(self, time, deviation):
        """What is read off a curve, in words."""
        factor = RATE_UNITS[self._unit] / RATE_UNITS["deg/h"]
        try:
            read = allan_coefficients(time, deviation / factor)
        except ValueError:
            return ""  # too few points, or no noise at all
        walk, instability = read.angle_random_walk, read.bias_instability
        text = "" if walk is None else f", N = {figures(walk)} °/√h"
        if instability is not None:
            text += f", B = {figures(factor * instability)} {signs(self._unit)}"
        return text


def _bias(rows):
    """Error at rest of the least-squares line of the last column against the rate."""
    rate, error = rows["rate"], rows.iloc[:, -1]
    return np.polyfit(rate, error, 1)[1] if np.ptp(rate) > 0 else 0.0


def _bias_of_branches(rows, side):
    """Mean error at rest by bin and branch, fitted together with the polynomial (Frisch, Waugh)."""
    ratio = rows["rate"] / (rows["rate"].abs().max() or 1.0)
    deviation = rows["temperature"] - rows["temperature"].mean()
    powers = {k: ratio**k for k in _POWERS} | {-k: ratio**k * deviation for k in _POWERS}
    powers, keys = pd.DataFrame(powers), [rows["branch"], rows["bin"]]
    design = powers - powers.groupby(keys).transform("mean")
    left = rows[side] - rows[side].groupby(keys).transform("mean")
    coefficients = np.linalg.lstsq(design, left, rcond=None)[0]
    found = (rows[side] - powers @ coefficients).groupby(keys).agg(["mean", "size"])
    means = found["mean"].where(found["size"] >= _FEWEST_ROWS).unstack("branch")
    return means.reindex(index=range(_N_TEMPERATURES), columns=list(_BRANCHES))
