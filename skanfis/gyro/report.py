"""One table of all figures of merit, per group, before and after, with bootstrap intervals."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from sklearn.utils import check_random_state

from . import metrics
from ._columns import check_column, check_labels
from .allan import allan_coefficients, allan_deviation

__all__ = ["gyro_report"]

# With fewer runs than this, blocks of rows are resampled: two or three runs say little of others.
_FEWEST_RUNS = 5
_N_BLOCKS = 30
# Row figures of a resample cost time in proportion to its rows, and their spread comes from the
# runs or blocks: evenly thinned rows show it as well.
_MOST_ROWS = 2_000
# A nonlinearity is looked for in means over such parts of the range of rates.
_RATE_BINS = 101
_UNEVEN = 0.01  # largest deviation of the time between rows, relative
_FEWEST_DEFINED = 0.9  # part of the resamples that must have the figure

_NAN = float("nan")


@dataclass(frozen=True)
class _Figure:
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


def gyro_report(
    rate,
    before,
    after=None,
    *,
    temperature=None,
    temperature_rate=None,
    time=None,
    run=None,
    groups=None,
    inside=None,
    full_scale=None,
    nominal_scale_factor=1.0,
    averaging_times=(10.0, 100.0),
    allan=False,
    confidence_level=0.95,
    n_resamples=200,
    random_state=None,
):
    """Tabulate the figures of merit of a gyro per group, before and after its compensation.

    Give held-out predictions: the figures of rows that a compensator was fitted to say nothing.

    Parameters
    ----------
    rate : array-like of shape (n_rows,)
        True rate, the earth's rate about the input axis included [deg/s].
    before : array-like of shape (n_rows,)
        Rate indicated without compensation [deg/s]; raw counts over their scale factor
        (:func:`scale_factor`).
    after : array-like of shape (n_rows,), default=None
        Compensated rate [deg/s]. Rows of NaN, which the compensator refused, are left out of all
        figures and counted.
    temperature : array-like of shape (n_rows,), default=None
        [degC], for the temperature sensitivities and the hysteresis.
    temperature_rate : array-like of shape (n_rows,), default=None
        [degC/min], for the ramp sensitivity and, as direction, the hysteresis.
    time : array-like of shape (n_rows,), default=None
        [s], increasing within each run, for the bias stability and the Allan deviation.
    run : array-like of shape (n_rows,), default=None
        Labels of the runs; None is one run.
    groups : array-like of shape (n_rows,), default=None
        Labels of the groups that get a table of their own beside the whole: runs, devices, rate
        levels, folds.
    inside : array-like of bool of shape (n_rows,), default=None
        Rows in the bounds of the calibration, as ``in_bounds`` of a compensator tells; the others
        are counted and stay in.
    full_scale : float, default=None
        Rate to which the nonlinearity is related, positive [deg/s]; None is the largest true rate.
    nominal_scale_factor : float, default=1.0
        Nominal scale factor of ``before`` and ``after``, not zero.
    averaging_times : tuple of float, default=(10.0, 100.0)
        Lengths of the means of the bias stability, positive [s].
    allan : bool, default=False
        Whether to read N, B and K off the Allan deviation; needs ``time``, and allantools.
    confidence_level : float, default=0.95
        Of the intervals, in (0, 1).
    n_resamples : int, default=200
        Number of resamples of the bootstrap, zero (no intervals) or more.
    random_state : int, RandomState instance or None, default=None
        Seed of the bootstrap; an int makes the intervals reproducible.

    Returns
    -------
    report : DataFrame
        One row per group and figure; "all" comes first, then the groups as they appear. Columns:
        group, figure, unit; before, before_low, before_high; after, after_low, after_high (only
        where ``after`` was given); note, which says why a figure or an interval is missing.
        ``report.attrs["resampled"]`` says by group what was resampled: "runs" or "blocks of rows".

    Raises
    ------
    ImportError
        If ``allan=True`` and allantools is not installed.
    ValueError
        If a column is not one of finite numbers as long as the others, or a parameter is out of its
        range.

    Notes
    -----
    The intervals are percentiles of a bootstrap over whole runs where a group has five or more, and
    otherwise over some thirty blocks of consecutive rows, because neighbouring rows are alike: an
    interval over single rows would be far too narrow. Blocks within one run tell nothing of the
    next run. Figures of rows are resampled on at most 2,000 evenly chosen rows. Peaks have no
    interval: the largest of a resample says nothing of the largest to come.

    The nonlinearity is that of means over 101 bins of the rate's range, so that noise is not taken
    for it. Bias figures are of the output over its scale factor (:func:`input_error`); where the
    rate changes within the runs, what the scale factor's errors leave is in them.

    Examples
    --------
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import OpenLoopArcsineRegressor, gyro_report
    >>> log = make_ofog(n_devices=1, n_runs=6, random_state=0)
    >>> train, test = log[log["run"] < 4], log[log["run"] >= 4]
    >>> law = OpenLoopArcsineRegressor("output", "temperature", warn_out_of_bounds=False)
    >>> law = law.fit(train[["output", "temperature"]], train["rate"])
    >>> report = gyro_report(
    ...     test["rate"],
    ...     test["output"],
    ...     law.predict(test[["output", "temperature"]]),
    ...     run=test["run"],
    ...     random_state=0,
    ... )
    >>> nonlinearity = report.set_index("figure").loc["scale_factor_nonlinearity"]
    >>> bool(nonlinearity["before"] > 10_000 > nonlinearity["after_high"])
    True
    """
    columns, refused = _columns(
        rate=rate,
        before=before,
        after=after,
        temperature=temperature,
        temperature_rate=temperature_rate,
        time=time,
    )
    labels = _labels(columns["rate"].size, run=run, groups=groups, inside=inside)
    full_scale = np.abs(columns["rate"]).max() if full_scale is None else full_scale
    _check_options(full_scale, averaging_times, allan, time, confidence_level, n_resamples)
    given = set(columns) | {name for name in ("run",) if labels[name] is not None}
    figures = [
        figure
        for figure in _figures(full_scale, nominal_scale_factor, averaging_times, allan)
        if given.issuperset(figure.needs)
    ]
    random_state = check_random_state(random_state)
    lines, resampled = [], {}
    for group, rows in _parts(labels["groups"], refused.size):
        part = {name: column[rows] for name, column in columns.items()}
        part |= {
            name: label[rows]
            for name, label in (("run", labels["run"]), ("inside", labels["inside"]))
            if label is not None
        }
        counts, part = _without_refused(part, refused[rows])
        units, resampled[group] = _units(part)
        draws = random_state.randint(2**31 - 1)
        bootstrap = _Bootstrap(part, units, resampled[group], n_resamples, confidence_level, draws)
        lines += [[group, *line] for line in counts + bootstrap.lines(figures)]
    report = pd.DataFrame(lines, columns=["group", "figure", "unit", *_VALUES, "note"])
    if after is None:
        report = report.drop(columns=_VALUES[3:])
    report.attrs["resampled"] = resampled
    return report


_VALUES = ["before", "before_low", "before_high", "after", "after_low", "after_high"]


def _figures(full_scale, nominal, averaging_times, allan):
    """Every figure of merit, in the order of the table."""

    def left(rows, which):
        return rows[which] - rows["rate"]

    def error(rows, which):
        return metrics.input_error(rows["rate"], rows[which])

    def nonlinearity(statistic):
        def of(rows, which):
            levels = _means_by_rate(rows["rate"], rows[which])
            return metrics.scale_factor_nonlinearity(
                *levels, statistic=statistic, full_scale=full_scale
            )

        return of

    def stability(averaging_time):
        def of(rows, which):
            run = rows.get("run")
            return metrics.squares_by_run(error(rows, which), rows["time"], averaging_time, run)

        return of

    peak = "largest value: no interval"
    figures = [
        _Figure("residual_rms", "deg/s", lambda r, w: metrics.residual_rms(left(r, w))),
        _Figure(
            "residual_peak",
            "deg/s",
            lambda r, w: metrics.residual_peak(left(r, w)),
            no_interval=peak,
        ),
        _Figure(
            "residual_peak_to_peak",
            "deg/s",
            lambda r, w: metrics.residual_peak_to_peak(left(r, w)),
            no_interval=peak,
        ),
        _Figure(
            "reduction_factor",
            "",
            lambda r, _: metrics.reduction_factor(left(r, "before"), left(r, "after")),
            needs=("after",),
            only_after=True,
        ),
        _Figure(
            "scale_factor_error",
            "ppm",
            lambda r, w: metrics.scale_factor_error(r["rate"], r[w], nominal=nominal),
        ),
        _Figure("scale_factor_nonlinearity", "ppm of full scale", nonlinearity("max")),
        _Figure("scale_factor_nonlinearity_rms", "ppm of full scale", nonlinearity("rms")),
        _Figure(
            "scale_factor_asymmetry",
            "ppm",
            lambda r, w: metrics.scale_factor_asymmetry(r["rate"], r[w]),
        ),
        _Figure(
            "scale_factor_repeatability",
            "ppm",
            lambda r, w: metrics.scale_factor_by_run(r["rate"], r[w], r["run"]),
            needs=("run",),
            combine=metrics.relative_spread,
        ),
        _Figure(
            "scale_factor_temperature_sensitivity",
            "ppm/degC",
            lambda r, w: metrics.scale_factor_temperature_sensitivity(
                r["rate"], r[w], r["temperature"]
            ),
            needs=("temperature",),
        ),
        _Figure("bias", "deg/h", lambda r, w: metrics.bias(error(r, w))),
        _Figure(
            "bias_repeatability",
            "deg/h",
            lambda r, w: metrics.error_by_run(error(r, w), r["run"]),
            needs=("run",),
            combine=metrics.spread_of_bias,
        ),
        _Figure(
            "bias_temperature_sensitivity",
            "deg/h/degC",
            lambda r, w: metrics.bias_temperature_sensitivity(
                error(r, w), r["temperature"], temperature_rate=r.get("temperature_rate")
            ),
            needs=("temperature",),
        ),
        _Figure(
            "bias_ramp_sensitivity",
            "deg/h/(degC/min)",
            lambda r, w: metrics.bias_ramp_sensitivity(
                error(r, w), r["temperature_rate"], temperature=r.get("temperature")
            ),
            needs=("temperature_rate",),
        ),
        _Figure(
            "hysteresis",
            "deg/h",
            lambda r, w: metrics.hysteresis(error(r, w), r["temperature"], r["temperature_rate"]),
            needs=("temperature", "temperature_rate"),
        ),
        *(
            _Figure(
                f"bias_stability_{seconds:g}s",
                "deg/h",
                stability(seconds),
                needs=("time",),
                combine=metrics.pooled_deviation,
            )
            for seconds in averaging_times
        ),
    ]
    if allan:
        units = {
            "angle_random_walk": "deg/sqrt(h)",
            "bias_instability": "deg/h",
            "allan_minimum": "deg/h",
            "rate_random_walk": "deg/h/sqrt(h)",
        }
        reader = _AllanReader(error)
        figures += [reader.figure(name, unit) for name, unit in units.items()]
    return figures


class _AllanReader:
    """Reads coefficients off the Allan curve of the error, which is made once per column."""

    def __init__(self, error):
        self._error = error
        self._read = {}

    def figure(self, name, unit):
        interval = "no interval: see the standard errors of allan_deviation"
        return _Figure(name, unit, partial(self._coefficient, name), no_interval=interval)

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
        runs = [rows["time"][run] for run in _runs(rows) if run.size > 1]
        if not runs:
            raise ValueError("no Allan deviation: every run is a single row")
        intervals = np.concatenate([np.diff(time) for time in runs])
        interval = np.median(intervals)
        if np.abs(intervals - interval).max() > _UNEVEN * interval:
            raise ValueError("no Allan deviation: the rows are not evenly spaced in time")
        curve = allan_deviation(self._error(rows, which), interval, run=rows.get("run"))
        return allan_coefficients(curve["averaging_time"], curve["deviation"])


@dataclass(frozen=True)
class _Bootstrap:
    """The figures of one group and their intervals."""

    rows: dict
    units: list  # positions of the rows of each run or block
    kind: str
    n_resamples: int
    confidence_level: float
    seed: int

    def lines(self, figures):
        """Name, unit, six values and a note, for each figure."""
        sides = [side for side in ("before", "after") if side in self.rows]
        if not self.rows["rate"].size:
            note = "no row is left in this group"
            return [[figure.name, figure.unit, *6 * [_NAN], note] for figure in figures]
        with np.errstate(divide="ignore", invalid="ignore"):
            spreads = self._resampled(figures, sides) if self.n_resamples else {}
            return [self._line(figure, sides, spreads) for figure in figures]

    def _line(self, figure, sides, spreads):
        values, notes = dict.fromkeys(_VALUES, _NAN), []
        for side in sides:
            if figure.only_after and side == "before":
                continue
            value, note = _evaluated(figure, self.rows, side)
            values[side] = value
            if np.isfinite(value) and self.n_resamples:
                spread = spreads.get((figure.name, side))
                note = self._interval(figure, spread, side, values)
            notes.append(note if len(sides) == 1 or not note else f"{side}: {note}")
        both = {note.partition(": ")[2] for note in notes}
        if len(notes) == 2 and len(both) == 1 and "" not in both:
            notes = [both.pop()]
        return [figure.name, figure.unit, *values.values(), "; ".join(filter(None, notes))]

    def _interval(self, figure, spread, side, values):
        """Put in the interval, or say why there is none."""
        if figure.no_interval:
            return figure.no_interval
        if spread is None:
            return f"no interval: fewer than {_FEWEST_RUNS} runs"
        defined = spread[np.isfinite(spread)]
        if defined.size < _FEWEST_DEFINED * spread.size:
            return "no interval: too many resamples do not have this figure"
        tail = 50.0 * (1.0 - self.confidence_level)
        values[f"{side}_low"], values[f"{side}_high"] = np.percentile(defined, [tail, 100.0 - tail])
        return ""

    def _resampled(self, figures, sides):
        """Values of every figure over the resamples, by name and side."""
        random_state = np.random.RandomState(self.seed)
        step = max(1, -(-self.rows["rate"].size // _MOST_ROWS))
        thinned = [unit[::step] for unit in self.units]
        by_run = {
            (figure.name, side): _per_run(figure, self.rows, side)
            for figure in figures
            for side in sides
            if figure.combine and self.kind == "runs"
        }
        of_rows = [figure for figure in figures if not (figure.combine or figure.no_interval)]
        spreads: dict = {}
        for _ in range(self.n_resamples):
            drawn = random_state.randint(len(thinned), size=len(thinned))
            chosen = np.concatenate([thinned[i] for i in drawn])
            sample = {name: column[chosen] for name, column in self.rows.items()}
            for side in sides:
                for figure in of_rows:
                    value = _evaluated(figure, sample, side)[0]
                    spreads.setdefault((figure.name, side), []).append(value)
                for figure in figures:
                    found = by_run.get((figure.name, side))
                    if found is not None:
                        value = _or_nan(figure.combine, found[drawn])[0]
                        spreads.setdefault((figure.name, side), []).append(value)
        return {key: np.array(values) for key, values in spreads.items()}


def _evaluated(figure, rows, side):
    """The figure's value and "", or NaN and why there is none."""
    if figure.only_after and side == "before":
        return _NAN, ""
    return _or_nan(figure.value, rows, side)


def _or_nan(function, *arguments):
    """What the function gives and "", or NaN and what its ValueError says."""
    try:
        return function(*arguments), ""
    except ValueError as error:
        return _NAN, str(error)


def _per_run(figure, rows, side):
    found, missing = _or_nan(figure.of, rows, side)
    return None if missing else found


def _columns(**columns):
    """The columns given, as arrays of one length, and which rows were refused."""
    rate = check_column(columns.pop("rate"), "rate")
    after = columns.pop("after")
    found = {"rate": rate}
    for name, values in columns.items():
        if values is not None:
            found[name] = check_column(values, name, rate.size)
    refused = np.zeros(rate.size, dtype=bool)
    if after is not None:
        after = np.array(after, dtype=float)
        refused = np.isnan(after)
        after[refused] = 0.0
        found["after"] = check_column(after, "after", rate.size)
    return found, refused


def _labels(n_rows, run, groups, inside):
    labels = {"run": run, "groups": groups, "inside": inside}
    if inside is not None and np.asarray(inside).dtype != bool:
        raise ValueError(f"inside must be bool; its dtype is {np.asarray(inside).dtype}.")
    return {
        name: None if values is None else check_labels(values, name, n_rows)
        for name, values in labels.items()
    }


def _check_options(full_scale, averaging_times, allan, time, confidence_level, n_resamples):
    if not full_scale > 0:
        raise ValueError(f"full_scale={full_scale} must be positive; give it for a log at rest.")
    if not all(seconds > 0 for seconds in averaging_times):
        raise ValueError(f"averaging_times={averaging_times} must be positive.")
    if allan and time is None:
        raise ValueError("allan=True needs the column time.")
    if not 0 < confidence_level < 1:
        raise ValueError(f"confidence_level={confidence_level} must lie between 0 and 1.")
    if n_resamples < 0:
        raise ValueError(f"n_resamples={n_resamples} must be zero or positive.")


def _parts(groups, n_rows):
    """Name and rows of the whole and of each group, in order of appearance."""
    yield "all", np.arange(n_rows)
    if groups is not None:
        for rows in metrics.rows_by_run(groups, n_rows, at_least=1):
            yield groups[rows[0]], rows


def _without_refused(part, refused):
    """Lines that count rows, and the part without those that were refused."""
    n_rows, n_outside = refused.size, 0
    if "inside" in part:
        n_outside = int((~part["inside"]).sum())
    counts = [_count("rows", n_rows, "before" in part)]
    if "after" in part:
        counts.append(_count("rows_refused", int(refused.sum()), False))
    if "inside" in part:
        counts.append(_count("rows_outside", n_outside, "after" not in part))
    kept = {name: column[~refused] for name, column in part.items() if name != "inside"}
    return counts, kept


def _count(name, number, in_before):
    return [
        name,
        "",
        float(number) if in_before else _NAN,
        _NAN,
        _NAN,
        float(number),
        *2 * [_NAN],
        "",
    ]


def _runs(part):
    return metrics.rows_by_run(part.get("run"), part["rate"].size, at_least=1)


def _units(part):
    """What the bootstrap resamples: the rows of each run, or blocks of rows within the runs."""
    n_rows = part["rate"].size
    if n_rows == 0:
        return [], "blocks of rows"
    runs = _runs(part)
    if len(runs) >= _FEWEST_RUNS:
        return runs, "runs"
    length = max(1, -(-n_rows // _N_BLOCKS))
    blocks = [run[i : i + length] for run in runs for i in range(0, run.size, length)]
    return blocks, "blocks of rows"


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
