"""The figures of merit as one table: name, unit, function, and the columns that it needs."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from . import metrics
from ._columns import PER_HOUR

__all__ = ["LARGEST_VALUES", "Figure", "figures_of_merit", "taken"]

_PPM = 1e6
# A nonlinearity is looked for in means over such parts of the range of rates.
_RATE_BINS = 101
# The largest value of a resample says nothing of the largest to come.
LARGEST_VALUES = ("residual_peak", "residual_peak_to_peak")


class Figure(NamedTuple):
    """A figure of merit of some columns; ``also`` is one that is given by name where there is such.

    With ``combine``, the function is of one run, and ``combine`` of the values of all runs.
    """

    name: str
    unit: str
    function: Callable
    needs: tuple[str, ...]
    also: str = ""
    combine: Callable | None = None
    fewest_runs: int = 1

    def of(self, rows):
        also = {self.also: rows[self.also]} if self.also in rows else {}
        return self.function(*(rows[name] for name in self.needs), **also)

    def by_run(self, rows):
        runs = metrics.rows_by_run(rows.get("run"), rows["rate"].size, self.fewest_runs)
        return np.array([self.of(taken(rows, run)) for run in runs])

    def value(self, rows):
        return self.of(rows) if self.combine is None else self.combine(self.by_run(rows))


def figures_of_merit(full_scale=1.0, nominal=1.0, averaging_times=(10.0, 100.0)):
    """All figures but those of Allan, in the order of the table."""
    rates, error, residual = ("rate", "output"), ("error",), ("residual",)
    heat, ramp = "temperature", "temperature_rate"
    off = partial(_off_nominal, nominal=nominal)
    largest, root = (partial(_nonlinearity, full_scale=full_scale, size=s) for s in (_peak, _rms))
    full = "ppm of full scale"
    slope, slope_in_ramp = (partial(_bias_sensitivity, name=name) for name in (heat, ramp))
    by_run = metrics.scale_factor
    table = [
        Figure("residual_rms", "deg/s", _rms, residual),
        Figure("residual_peak", "deg/s", _peak, residual),
        Figure("residual_peak_to_peak", "deg/s", np.ptp, residual),
        Figure("reduction_factor", "", _reduction, ("rate", "before", "after")),
        Figure("scale_factor_error", "ppm", off, rates),
        Figure("scale_factor_nonlinearity", full, largest, rates),
        Figure("scale_factor_nonlinearity_rms", full, root, rates),
        Figure("scale_factor_asymmetry", "ppm", _asymmetry, rates),
        Figure("scale_factor_repeatability", "ppm", by_run, rates, "", _relative_spread, 2),
        Figure("scale_factor_temperature_sensitivity", "ppm/degC", _sensitivity, (*rates, heat)),
        Figure("bias", "deg/h", metrics.bias, error),
        Figure("bias_repeatability", "deg/h", np.mean, error, "", _spread_of_bias, 2),
        Figure("bias_temperature_sensitivity", "deg/h/degC", slope, ("error", heat), ramp),
        Figure("bias_ramp_sensitivity", "deg/h/(degC/min)", slope_in_ramp, ("error", ramp), heat),
        Figure("hysteresis", "deg/h", metrics.hysteresis, ("error", heat, ramp)),
    ]
    for seconds in averaging_times:
        squares = partial(metrics.squares_of_means, averaging_time=seconds)
        name, pooled = f"bias_stability_{seconds:g}s", metrics.pooled_deviation
        table.append(Figure(name, "deg/h", squares, ("error", "time"), "", pooled))
    return table


def taken(columns, rows):
    """Some rows of a dict of columns."""
    return {name: column[rows] for name, column in columns.items()}


def _rms(values):
    return np.sqrt(values @ values / values.size)


def _peak(values):
    return np.abs(values).max()


def _reduction(rate, before, after):
    left = _rms(after - rate)
    if left == 0:
        raise ValueError("after is zero everywhere: a factor without bound.")
    return _rms(before - rate) / left


def _off_nominal(rate, output, nominal):
    if nominal == 0 or not np.isfinite(nominal):
        raise ValueError(f"nominal={nominal} must be finite and not zero.")
    return _PPM * (metrics.line(rate, output)[0] / nominal - 1.0)


def _nonlinearity(rate, output, full_scale, size):
    """Of the means over bins of the rate's range: that of single rows would be their noise."""
    low, width = rate.min(), np.ptp(rate) / _RATE_BINS
    if width > 0:
        place = np.minimum(((rate - low) / width).astype(int), _RATE_BINS - 1)
        counts, *sums = (np.bincount(place, weights) for weights in (None, rate, output))
        rate, output = (each[counts > 0] / counts[counts > 0] for each in sums)
    slope, intercept = metrics.line(rate, output)
    return _PPM * size(output - slope * rate - intercept) / (abs(slope) * full_scale)


def _asymmetry(rate, output):
    slopes = []
    for sign, side in (("positive", rate >= 0), ("negative", rate <= 0)):
        if side.sum() < 2 or np.ptp(rate[side]) == 0:
            raise ValueError(f"No asymmetry: there are not two different {sign} rates.")
        slopes.append(metrics.line(rate[side], output[side])[0])
    return _PPM * (slopes[0] - slopes[1]) / np.mean(slopes)


def _relative_spread(slopes):
    return _PPM * np.std(slopes, ddof=1) / abs(np.mean(slopes))


def _spread_of_bias(means):
    return PER_HOUR * np.std(means, ddof=1)


def _sensitivity(rate, output, temperature):
    """S_T / S of output = (S + S_T dT) rate + c + c_T dT."""
    dt = _centred(temperature)
    without = "rate and temperature do not change independently of each other"
    slope, by_temperature, *_ = _least_squares([rate, rate * dt, dt], output, without)
    return _PPM * by_temperature / slope


def _bias_sensitivity(error, column, name, **other: Any):
    """Slope of the error in a column, fitted together with that in another."""
    without = f"{name} never changes"
    if other:
        without = "temperature and temperature_rate do not change independently of each other"
    design = [_centred(values) for values in (column, *other.values())]
    return PER_HOUR * _least_squares(design, error, without)[0]


def _centred(values):
    # Not values - mean where they are all equal: that leaves rounding errors, not zero.
    return values - (values[0] if np.ptp(values) == 0 else values.mean())


def _least_squares(design, target, without):
    """Coefficients of the columns in ``design``, beside a constant."""
    columns = np.column_stack([*design, np.ones_like(target)])
    size = np.sqrt(np.mean(columns**2, axis=0))
    rank = 0
    if (size > 0).all():
        solution, _, rank, _ = np.linalg.lstsq(columns / size, target, rcond=1e-10)
    if rank < columns.shape[1]:
        raise ValueError(f"No sensitivity: {without}.")
    return solution / size
