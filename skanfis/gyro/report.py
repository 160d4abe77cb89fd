"""One table of all figures of merit, per group, before and after, with bootstrap intervals."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_random_state

from . import metrics
from ._bootstrap import VALUES, Bootstrap, units_to_resample
from ._columns import RATE_UNITS, check_column, check_labels, in_rate_unit
from ._figures_of_merit import figures_of_merit

__all__ = ["gyro_report"]

_NAN = float("nan")


def gyro_report(
    rate: ArrayLike,
    before: ArrayLike,
    after: ArrayLike | None = None,
    *,
    temperature: ArrayLike | None = None,
    temperature_rate: ArrayLike | None = None,
    time: ArrayLike | None = None,
    run: ArrayLike | None = None,
    groups: ArrayLike | None = None,
    inside: ArrayLike | None = None,
    full_scale: float | None = None,
    nominal_scale_factor: float = 1.0,
    averaging_times: Any = (10.0, 100.0),
    allan: bool = False,
    confidence_level: float = 0.95,
    n_resamples: int = 200,
    rate_unit: str | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> pd.DataFrame:
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
    rate_unit : {"deg/s", "deg/h"}, default=None
        Unit of every figure that is a rate, or a rate per something; None leaves to each the unit
        that is usual: deg/s for residuals, deg/h for biases.
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
    >>> law = OpenLoopArcsineRegressor("output", "temperature")
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
    if rate_unit not in (None, *RATE_UNITS):
        raise ValueError(
            f"rate_unit={rate_unit!r} must be one of {', '.join(RATE_UNITS)}, or None."
        )
    given = set(columns) | {name for name in ("run",) if labels[name] is not None}
    figures = [
        figure
        for figure in figures_of_merit(full_scale, nominal_scale_factor, averaging_times, allan)
        if given.issuperset(figure.needs)
    ]
    generator = check_random_state(random_state)
    lines, resampled = [], {}
    for group, rows in _parts(labels["groups"], refused.size):
        part = _part(rows, columns, labels)
        counts, part = _without_refused(part, refused[rows])
        units, resampled[group] = units_to_resample(part)
        draws = generator.randint(2**31 - 1)
        bootstrap = Bootstrap(part, units, resampled[group], n_resamples, confidence_level, draws)
        lines += [[group, *line] for line in counts + bootstrap.lines(figures)]
    report = pd.DataFrame(lines, columns=["group", "figure", "unit", *VALUES, "note"])
    if after is None:
        report = report.drop(columns=VALUES[3:])
    if rate_unit is not None:
        report = _in_unit(report, rate_unit)
    report.attrs["resampled"] = resampled
    return report


def _in_unit(report, rate_unit):
    """The report with every rate in one unit."""
    values = [name for name in VALUES if name in report]
    units, factors = zip(*(in_rate_unit(unit, rate_unit) for unit in report["unit"]), strict=True)
    return report.assign(unit=units, **report[values].mul(np.array(factors), axis=0))


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


def _part(rows, columns, labels):
    """The columns of some rows, and the labels that figures need."""
    part = {name: column[rows] for name, column in columns.items()}
    needed = {name: labels[name] for name in ("run", "inside")}
    return part | {name: label[rows] for name, label in needed.items() if label is not None}


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
    before = float(number) if in_before else _NAN
    return [name, "", before, _NAN, _NAN, float(number), _NAN, _NAN, ""]
