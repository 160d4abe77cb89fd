"""Figures of merit in the terms of IEEE 952, as one table of functions of columns of a log.

Every column has one value per row: rates in deg/s, temperatures in degC, times in s. The error at
the input is the output divided by its scale factor, minus the true rate; biases are means of this
error, in deg/h. If a figure does not exist, its function raises ValueError with the reason.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import binned_statistic

from ._columns import PER_HOUR, check_column, check_labels
from .errors import needed

_PPM = 1e6
# Bins of temperature in which warming and cooling are compared, and the rows that a mean needs.
HYSTERESIS_BINS, ROWS_PER_MEAN = 20, 5
SLOWEST = 0.05  # degC/min, below which a temperature neither rises nor falls
# Powers of the rate, odd, because a scale factor error changes its sign with the rate.
_POWERS = (1, 3, 5, 7)
_RATE_BINS = 101  # bins of the rate, over whose means the nonlinearity is computed
# A gyro is at rest up to this part of the largest rate; the bias needs at least so many such rows.
_AT_REST, _FEWEST_AT_REST = 1e-4, 10
# Figures without interval: the largest value of a resample says nothing of the largest to come.
LARGEST_VALUES = ("residual_peak", "residual_peak_to_peak")
# Figures that are sizes of means, so that noise increases them.
SIZES_WITH_NOISE = ("scale_factor_nonlinearity", "scale_factor_nonlinearity_rms", "hysteresis")
ALLAN_FIGURES = {
    "angle_random_walk": "deg/sqrt(h)",
    "bias_instability": "deg/h",
    "allan_minimum": "deg/h",
    "rate_random_walk": "deg/h/sqrt(h)",
}
_FLICKER = np.sqrt(2.0 * np.log(2.0) / np.pi)  # 0.664
_POINTS_PER_SLOPE = 3  # a line through two would always fit
# Neighbouring processes differ by a half in slope: a third of that tells them apart.
_SLOPE_TOLERANCE = 0.15
# A stretch has at least so many averaging times: with fewer, a deviation says next to nothing.
_ROWS_PER_TIME = 10
_UNEVEN = 0.01  # largest deviation of the time between rows, relative


class _Figure(NamedTuple):
    """A figure of merit: a function of the columns ``needs``, and of ``also`` if the log has it.

    With ``combine``, the function takes one run, and ``combine`` takes the values of all runs.
    """

    name: str
    unit: str
    function: Callable
    needs: tuple[str, ...]
    also: str = ""
    combine: Callable | None = None

    def of(self, rows):
        also = {self.also: rows[self.also]} if self.also in rows else {}
        return self.function(*(rows[name] for name in self.needs), **also)

    def by_run(self, rows):
        runs = rows_by_run(rows.get("run"), rows["rate"].size)
        parts = [{name: column[run] for name, column in rows.items()} for run in runs]
        return np.array([self.of(part) for part in parts])

    def value(self, rows):
        return self.of(rows) if self.combine is None else self.combine(self.by_run(rows))


def figures_of_merit(full_scale=1.0):
    """All figures but those of Allan, in the order of the report."""
    rates, residual = ("rate", "output"), ("residual",)
    heat, ramp = "temperature", "temperature_rate"
    largest, root = (partial(_nonlinearity, full_scale=full_scale, size=s) for s in (_peak, rms))
    full = "ppm of full scale"
    slope, slope_in_ramp = (partial(_bias_sensitivity, name=name) for name in (heat, ramp))
    short, long = (partial(_squares_of_means, over=seconds) for seconds in (10.0, 100.0))
    timed, pooled, of_bias = ("error", "time"), _pooled_deviation, ("error", "of_bias")

    def bias(error, of_bias):
        return PER_HOUR * error[of_bias].mean() if of_bias.any() else np.nan

    def spread(values):
        known = values[np.isfinite(values)]
        if known.size < 2:
            raise ValueError("No repeatability: it takes two runs or more.")
        return np.std(known, ddof=1)

    def relative_spread(slopes):
        return _PPM * spread(slopes) / abs(np.mean(slopes))

    return [
        _Figure("residual_rms", "deg/s", rms, residual),
        _Figure("residual_peak", "deg/s", _peak, residual),
        _Figure("residual_peak_to_peak", "deg/s", np.ptp, residual),
        _Figure("reduction_factor", "", _reduction, ("rate", "before", "after")),
        _Figure(
            "scale_factor_error", "ppm", lambda *line: _PPM * (scale_factor(*line) - 1.0), rates
        ),
        _Figure("scale_factor_nonlinearity", full, largest, rates),
        _Figure("scale_factor_nonlinearity_rms", full, root, rates),
        _Figure("scale_factor_asymmetry", "ppm", _asymmetry, rates),
        _Figure("scale_factor_repeatability", "ppm", scale_factor, rates, combine=relative_spread),
        _Figure("scale_factor_temperature_sensitivity", "ppm/degC", _sensitivity, (*rates, heat)),
        _Figure("bias", "deg/h", bias, of_bias),
        _Figure("bias_repeatability", "deg/h", bias, of_bias, combine=spread),
        _Figure("bias_temperature_sensitivity", "deg/h/degC", slope, (*of_bias, heat), also=ramp),
        _Figure(
            "bias_ramp_sensitivity", "deg/h/(degC/min)", slope_in_ramp, (*of_bias, ramp), also=heat
        ),
        _Figure("hysteresis", "deg/h", hysteresis, ("rate", "error", heat, ramp)),
        _Figure("bias_stability_10s", "deg/h", short, timed, combine=pooled),
        _Figure("bias_stability_100s", "deg/h", long, timed, combine=pooled),
    ]


def table_of(columns, labels=(), gaps=()):
    """Columns of equal length as a table; those that are None are left out.

    All but ``labels`` must be numbers, and finite; those in ``gaps`` may be NaN.
    """
    found: dict[str, np.ndarray] = {}
    n_rows = None
    for name, values in columns.items():
        if values is None:
            continue
        if name in labels:
            found[name] = check_labels(values, name, n_rows)
        else:
            found[name] = check_column(values, name, n_rows, may_lack=name in gaps)
        n_rows = found[name].size
    return pd.DataFrame(found)


def rows_by_run(run, n_rows):
    """Positions of the rows of each run, in order of appearance."""
    if run is None:
        return [np.arange(n_rows)]
    place = pd.factorize(check_labels(run, "run", n_rows), use_na_sentinel=False)[0]
    return np.split(np.argsort(place, kind="stable"), np.cumsum(np.bincount(place))[:-1])


def rms(values) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def scale_factor(rate, output) -> float:
    """Slope of the least-squares line of the output against the true rate."""
    return float(_line(np.asarray(rate), np.asarray(output))[0])


def input_error(rate, output):
    """Error at the input [deg/s]; if the rate never changes, the scale factor is taken as 1."""
    return output / (1.0 if np.ptp(rate) == 0 else scale_factor(rate, output)) - rate


def rows_of_bias(rate):
    """Rows for the bias: those at rest, or all rows of a log that has hardly any at rest."""
    at_rest = np.abs(rate) <= _AT_REST * np.abs(rate).max()
    # All rows give the intercept of the line, which includes the nonlinearity.
    return at_rest | (np.count_nonzero(at_rest) < _FEWEST_AT_REST)


def hysteresis(rate, error, temperature, temperature_rate) -> float:
    """Largest gap between the biases while warming and while cooling, at equal temperature."""
    if not temperature_rate.min() < 0 < temperature_rate.max():
        raise ValueError("No hysteresis: the temperature does not both rise and fall.")
    edges = np.linspace(temperature.min(), temperature.max(), HYSTERESIS_BINS + 1)
    gaps = np.ptp(biases_of_branches(edges, rate, error, temperature, temperature_rate), axis=0)
    if np.isnan(gaps).all():
        told = f"warming and cooling share no temperature at which both have {ROWS_PER_MEAN} rows"
        raise ValueError(f"No hysteresis: {told}.")
    return float(PER_HOUR * np.nanmax(gaps))


def biases_of_branches(edges, rate, error, temperature, temperature_rate):
    """Mean errors in bins of temperature while warming, and while cooling, at a rate of zero.

    The error's dependence on the rate, an odd polynomial that is linear in temperature, is fitted
    jointly with these means and subtracted (Frisch, Waugh).
    """
    columns = np.column_stack([error, rate_columns(rate, temperature)])
    moving = np.abs(temperature_rate) >= SLOWEST
    bins, columns = np.digitize(temperature[moving], edges[1:-1]), columns[moving]
    places = bins + np.where(temperature_rate[moving] > 0, 0, edges.size - 1)
    by_place = pd.DataFrame(columns).groupby(places)
    means = by_place.mean()
    columns -= means.loc[places].to_numpy()
    coefficients = np.linalg.lstsq(columns[:, 1:], columns[:, 0], rcond=None)[0]
    at_rest = (means[0] - means.iloc[:, 1:] @ coefficients).where(by_place.size() >= ROWS_PER_MEAN)
    return at_rest.reindex(range(2 * (edges.size - 1))).to_numpy().reshape(2, -1)


def rate_columns(rate, temperature):
    """Odd powers of the rate, and their products with the temperature: what an error may follow."""
    powers = (rate / (np.abs(rate).max() or 1.0))[:, None] ** np.array(_POWERS)
    return np.column_stack([powers, powers * _centred(temperature)[:, None]])


def allan_deviation(error, time, run=None):
    """Overlapping Allan deviation, by allantools, in octaves up to a tenth of a stretch.

    The error is used on all stretches of a run where it is known and rows are evenly spaced in
    time; their variances are averaged. Returns a table: averaging_time [s]; in the unit of the
    error the deviation and, by IEEE 952 from the number of differences of non-overlapping means,
    its standard error.
    """
    oadev = needed("allantools", "allantools is not installed (pip install allantools)").oadev
    runs = [rows for rows in rows_by_run(run, time.size) if rows.size >= _ROWS_PER_TIME]
    usual = np.median(np.concatenate([np.diff(time[rows]) for rows in runs])) if runs else np.nan
    stretches, parts = [], []
    for rows in runs:
        known, steps = np.isfinite(error[rows]), np.diff(time[rows])
        is_next = (steps > 0.0) & (np.abs(steps - usual) <= _UNEVEN * usual)
        is_next &= known[1:] & known[:-1]
        stretches += np.split(rows, np.flatnonzero(~is_next) + 1)
    for rows in stretches:
        if rows.size < _ROWS_PER_TIME:
            continue
        # In units of the time between rows.
        steps, deviations, _, counts = oadev(error[rows], data_type="freq", taus="octave")
        part = pd.DataFrame({"steps": steps, "sum": counts * deviations**2, "n": counts})
        part["apart"] = rows.size / steps - 1.0
        parts.append(part[steps * _ROWS_PER_TIME <= rows.size])
    if not parts:
        raise ValueError(f"nowhere do {_ROWS_PER_TIME} rows in range follow evenly in time")
    sums = pd.concat(parts).groupby("steps", as_index=False).sum()
    deviation = np.sqrt(sums["sum"] / sums["n"])
    columns = {"averaging_time": sums["steps"] * usual, "deviation": deviation}
    return pd.DataFrame(columns | {"error": deviation / np.sqrt(2.0 * sums["apart"])})


def allan_figures(tau, deviation):
    """The value of each figure, or NaN if the curve [s, deg/h] has none, and why it has none.

    Three neighbouring points have a slope if their line has it within 0.15; the nearest one
    counts. N is sought before the minimum and any rise, K after it. No end is a minimum.
    """
    if tau.size < _POINTS_PER_SLOPE:
        raise ValueError(f"The curve has {tau.size} points; at least {_POINTS_PER_SLOPE} needed.")
    if deviation.min() <= 0:
        raise ValueError(f"deviation must be positive; its smallest value is {deviation.min():g}.")
    lowest = int(np.argmin(deviation))
    minimum, no_minimum = deviation[lowest], ""
    if lowest in (0, tau.size - 1):
        side = "rises from its shortest" if lowest == 0 else "still falls at its longest"
        minimum = np.nan
        no_minimum = f"no minimum: the curve {side} averaging time, {tau[lowest]:g} s"
    # White noise falls from the shortest averaging time on. A curve that falls after a rise has a
    # hump, as steps of the error at every new rate leave it, and no white noise there.
    rises = np.flatnonzero(np.diff(deviation[: lowest + 1]) > 0)
    white = slice(rises[0] + 1 if rises.size else lowest + 1)
    walk, no_walk = _level(tau[white], deviation[white], -0.5)
    drift, no_drift = _level(tau[lowest:], deviation[lowest:], 0.5)
    return {
        # sigma sqrt(tau) is N where the slope is -1/2: 1 deg/h at 1 s is 1/60 deg/sqrt(h).
        "angle_random_walk": (walk / 60.0, no_walk),
        "bias_instability": (minimum / _FLICKER, no_minimum),
        "allan_minimum": (minimum, no_minimum),
        # sigma = K sqrt(tau / 3) with tau in h; 60 is the root of the seconds in an hour.
        "rate_random_walk": (drift * np.sqrt(3.0) * 60.0, no_drift),
    }


def _line(rate, output):
    if rate.min() == rate.max():
        raise ValueError(f"No scale factor: the rate is {rate[0]:g} deg/s in all rows.")
    return np.polyfit(rate, output, 1)


def _peak(values):
    return np.abs(values).max()


def _reduction(rate, before, after):
    left = rms(after - rate)
    if left == 0:
        raise ValueError("No reduction factor: the error after is zero in all rows.")
    return rms(before - rate) / left


def _nonlinearity(rate, output, full_scale, size):
    """Nonlinearity of means over bins of the rate: that of single rows would be their noise."""
    means = binned_statistic(rate, [rate, output], bins=_RATE_BINS).statistic
    rate, output = means[:, ~np.isnan(means[0])]
    slope, intercept = _line(rate, output)
    return _PPM * size(output - slope * rate - intercept) / (abs(slope) * full_scale)


def _asymmetry(rate, output):
    slopes = []
    for sign, side in (("positive", rate >= 0), ("negative", rate <= 0)):
        if side.sum() < 2 or np.ptp(rate[side]) == 0:
            raise ValueError(f"No asymmetry: there are not two different {sign} rates.")
        slopes.append(scale_factor(rate[side], output[side]))
    return _PPM * (slopes[0] - slopes[1]) / np.mean(slopes)


def _sensitivity(rate, output, temperature):
    """S_T / S of the model output = (S + S_T dT) rate + c + c_T dT, dT from the mean."""
    dt = _centred(temperature)
    without = "rate and temperature do not change independently of each other"
    slope, by_temperature, *_ = _least_squares([rate, rate * dt, dt], output, without)
    return _PPM * by_temperature / slope


def _bias_sensitivity(error, of_bias, column, name, **other):
    """Slope of the bias by one column, fitted jointly with the slope by another.

    It uses the rows at rest, as the bias does, if they span half the range of all rows; else all.
    """
    columns = [column, *other.values()]
    if any(np.ptp(each[of_bias]) < 0.5 * np.ptp(each) for each in columns):
        of_bias = np.ones_like(of_bias)
    without = f"{name} never changes"
    if other:
        without = "temperature and temperature_rate do not change independently of each other"
    design = [_centred(values[of_bias]) for values in columns]
    return PER_HOUR * _least_squares(design, error[of_bias], without)[0]


def _centred(values):
    # Equal values minus their mean would leave rounding errors, not zero.
    return values - (values[0] if np.ptp(values) == 0 else values.mean())


def _least_squares(design, target, without):
    """Coefficients of the columns in ``design``, fitted jointly with a constant."""
    columns = np.column_stack([*design, np.ones_like(target)])
    size = np.sqrt(np.mean(columns**2, axis=0))
    rank = 0
    if (size > 0).all():
        solution, _, rank, _ = np.linalg.lstsq(columns / size, target, rcond=1e-10)
    if rank < columns.shape[1]:
        raise ValueError(f"No sensitivity: {without}.")
    return solution / size


def _squares_of_means(error, time, over):
    """Sum of squares of one run's means over averaging times, and its degrees of freedom."""
    steps = np.diff(time)
    if (steps <= 0).any():
        raise ValueError("time must increase within each run.")
    apart = np.median(steps) if steps.size else 0.0
    if apart > over * (1.0 + 1e-9):
        raise ValueError(f"No bias stability over {over:g} s: rows are {apart:g} s apart.")
    # A time on an edge belongs to the interval that starts there, rounding errors or not.
    place = np.floor((time - time[0]) / over + 1e-9).astype(int)
    _, place, counts = np.unique(place, return_inverse=True, return_counts=True)
    full = counts >= 0.5 * counts.max()  # a time less than half full has no mean
    means = np.bincount(place, error)[full] / counts[full]
    return np.sum((means - means.mean()) ** 2), means.size - 1


def _pooled_deviation(squares):
    """Standard deviation within runs [deg/h] (GJB 2426), from each run's sum of squares."""
    sum_of_squares, degrees_of_freedom = np.sum(squares, axis=0)
    if degrees_of_freedom == 0:
        raise ValueError("No bias stability: the means are too long for a run to hold two.")
    return float(PER_HOUR * np.sqrt(sum_of_squares / degrees_of_freedom))


def _level(tau, deviation, slope):
    """Level of the line along the curve whose slope is nearest this, and ""; or NaN and why not.

    Of pure noise that is a line at short times, which many rows make exact.
    """
    x, y = np.log(tau), np.log(deviation)
    lines = []
    for start in range(x.size - _POINTS_PER_SLOPE + 1):
        window = slice(start, start + _POINTS_PER_SLOPE)
        off = abs(np.polyfit(x[window], y[window], 1)[0] - slope)
        lines.append((off, np.mean(y[window] - slope * x[window])))
    off, level = min(lines, default=(np.inf, np.nan))
    if off > _SLOPE_TOLERANCE:
        return np.nan, f"no slope of {'+' if slope > 0 else '-'}1/2"
    return np.exp(level), ""
