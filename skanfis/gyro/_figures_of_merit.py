"""Every figure of merit as a function of the rows of a table, before or after compensation."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from . import metrics
from .allan import allan_coefficients, allan_deviation

__all__ = ["FIGURES_OF_ALLAN", "Figure", "figures_of_merit", "runs_of"]

# A nonlinearity is looked for in means over such parts of the range of rates.
_RATE_BINS = 101
_UNEVEN = 0.01  # largest deviation of the time between rows, relative

FIGURES_OF_ALLAN = {
    "angle_random_walk": "deg/sqrt(h)",
    "bias_instability": "deg/h",
    "allan_minimum": "deg/h",
    "rate_random_walk": "deg/h/sqrt(h)",
}


@dataclass(frozen=True)
class Figure:
    """A figure of merit: a function of the rows (a dict of columns) and "before" or "after".

    If ``combine`` is given, ``of`` gives one value or row of values per run, and ``combine`` makes
    the figure of them.
    """

    name: str
    unit: str
    of: Callable
    needs: tuple[str, ...] = ()
    combine: Callable | None = None
    only_after: bool = False
    no_interval: str = ""

    def value(self, rows, which):
        found = self.of(rows, which)
        return found if self.combine is None else self.combine(found)


def figures_of_merit(full_scale, nominal, averaging_times, allan):
    """All of them, in the order of the table."""
    figures = [
        *_of_what_is_left(),
        *_of_the_scale_factor(full_scale, nominal),
        *_of_the_bias(),
        *_of_stability(averaging_times),
    ]
    if allan:
        reader = _AllanReader()
        figures += [reader.figure(name, unit) for name, unit in FIGURES_OF_ALLAN.items()]
    return figures


def runs_of(rows):
    """Positions of the rows of each run."""
    return metrics.rows_by_run(rows.get("run"), rows["rate"].size, at_least=1)


def _left(rows, which):
    return rows[which] - rows["rate"]


def _error(rows, which):
    return metrics.input_error(rows["rate"], rows[which])


def _of_what_is_left():
    def of(metric):
        return lambda rows, which: metric(_left(rows, which))

    peak = "largest value: no interval"
    return [
        Figure("residual_rms", "deg/s", of(metrics.residual_rms)),
        Figure("residual_peak", "deg/s", of(metrics.residual_peak), no_interval=peak),
        Figure(
            "residual_peak_to_peak", "deg/s", of(metrics.residual_peak_to_peak), no_interval=peak
        ),
        Figure(
            "reduction_factor",
            "",
            lambda r, _: metrics.reduction_factor(_left(r, "before"), _left(r, "after")),
            needs=("after",),
            only_after=True,
        ),
    ]


def _of_the_scale_factor(full_scale, nominal):
    def nonlinearity(statistic):
        def of(rows, which):
            levels = _means_by_rate(rows["rate"], rows[which])
            return metrics.scale_factor_nonlinearity(
                *levels, statistic=statistic, full_scale=full_scale
            )

        return of

    return [
        Figure(
            "scale_factor_error",
            "ppm",
            lambda r, w: metrics.scale_factor_error(r["rate"], r[w], nominal=nominal),
        ),
        Figure("scale_factor_nonlinearity", "ppm of full scale", nonlinearity("max")),
        Figure("scale_factor_nonlinearity_rms", "ppm of full scale", nonlinearity("rms")),
        Figure(
            "scale_factor_asymmetry",
            "ppm",
            lambda r, w: metrics.scale_factor_asymmetry(r["rate"], r[w]),
        ),
        Figure(
            "scale_factor_repeatability",
            "ppm",
            lambda r, w: metrics.scale_factor_by_run(r["rate"], r[w], r["run"]),
            needs=("run",),
            combine=metrics.relative_spread,
        ),
        Figure(
            "scale_factor_temperature_sensitivity",
            "ppm/degC",
            lambda r, w: metrics.scale_factor_temperature_sensitivity(
                r["rate"], r[w], r["temperature"]
            ),
            needs=("temperature",),
        ),
    ]


def _of_the_bias():
    return [
        Figure("bias", "deg/h", lambda r, w: metrics.bias(_error(r, w))),
        Figure(
            "bias_repeatability",
            "deg/h",
            lambda r, w: metrics.error_by_run(_error(r, w), r["run"]),
            needs=("run",),
            combine=metrics.spread_of_bias,
        ),
        Figure(
            "bias_temperature_sensitivity",
            "deg/h/degC",
            lambda r, w: metrics.bias_temperature_sensitivity(
                _error(r, w), r["temperature"], temperature_rate=r.get("temperature_rate")
            ),
            needs=("temperature",),
        ),
        Figure(
            "bias_ramp_sensitivity",
            "deg/h/(degC/min)",
            lambda r, w: metrics.bias_ramp_sensitivity(
                _error(r, w), r["temperature_rate"], temperature=r.get("temperature")
            ),
            needs=("temperature_rate",),
        ),
        Figure(
            "hysteresis",
            "deg/h",
            lambda r, w: metrics.hysteresis(_error(r, w), r["temperature"], r["temperature_rate"]),
            needs=("temperature", "temperature_rate"),
        ),
    ]


def _of_stability(averaging_times):
    def stability(averaging_time):
        def of(rows, which):
            error, run = _error(rows, which), rows.get("run")
            return metrics.squares_by_run(error, rows["time"], averaging_time, run)

        return of

    return [
        Figure(
            f"bias_stability_{seconds:g}s",
            "deg/h",
            stability(seconds),
            needs=("time",),
            combine=metrics.pooled_deviation,
        )
        for seconds in averaging_times
    ]


class _AllanReader:
    """Reads coefficients off the Allan curve of the error, which is made once per column."""

    def __init__(self):
        self._read = {}

    def figure(self, name, unit):
        interval = "no interval: see the standard errors of allan_deviation"
        return Figure(name, unit, partial(self._coefficient, name), no_interval=interval)

    def _coefficient(self, name, rows, which):
        column, read = self._read.get(which, (None, None))
        if column is not rows[which]:
            read = self._coefficients(rows, which)
            self._read[which] = (rows[which], read)
        value = getattr(read, name)
        if value is None:
            raise ValueError(read.notes[name])
        return value

    def _coefficients(self, rows, which):
        runs = [rows["time"][run] for run in runs_of(rows) if run.size > 1]
        if not runs:
            raise ValueError("no Allan deviation: every run is a single row")
        intervals = np.concatenate([np.diff(time) for time in runs])
        interval = np.median(intervals)
        if np.abs(intervals - interval).max() > _UNEVEN * interval:
            raise ValueError("no Allan deviation: the rows are not evenly spaced in time")
        curve = allan_deviation(_error(rows, which), interval, run=rows.get("run"))
        return allan_coefficients(curve["averaging_time"], curve["deviation"])


def _means_by_rate(rate, output):
    """Mean rate and output over bins of the rate's range that hold rows."""
    low, width = rate.min(), np.ptp(rate) / _RATE_BINS
    if width == 0:
        return rate, output
    place = np.minimum(((rate - low) / width).astype(int), _RATE_BINS - 1)
    counts = np.bincount(place, minlength=_RATE_BINS)
    held = counts > 0
    sums = [np.bincount(place, values, minlength=_RATE_BINS)[held] for values in (rate, output)]
    return sums[0] / counts[held], sums[1] / counts[held]
