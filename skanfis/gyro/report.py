"""One table of all figures of merit, per group, before and after, with bootstrap intervals."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_random_state

from . import metrics
from ._columns import RATE_UNITS, check_column, check_labels, in_rate_unit
from ._figures_of_merit import LARGEST_VALUES, figures_of_merit, taken
from .allan import ALLAN_FIGURES, allan_coefficients, allan_deviation, rows_for_allan

__all__ = ["gyro_report", "table_of"]

_VALUES = ["before", "before_low", "before_high", "after", "after_low", "after_high"]
# With fewer runs than this, blocks of rows are resampled: two or three runs say little of others.
_FEWEST_RUNS = 5
_N_BLOCKS = 30
# The spread comes from the runs or blocks: evenly thinned rows show it as well.
_MOST_ROWS = 2_000
_FEWEST_DEFINED = 0.9  # part of the resamples that must have the figure


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

    Give held-out predictions. Intervals are of a bootstrap over runs where a group has five or
    more, and otherwise over some thirty blocks of rows.

    Parameters
    ----------
    rate, before : array-like of shape (n_rows,)
        True rate, and rate indicated without compensation [deg/s].
    after : array-like of shape (n_rows,), default=None
        Compensated rate [deg/s]; rows where it is NaN are counted and left out of all figures.
    temperature, temperature_rate, time : array-like of shape (n_rows,), default=None
        [degC], [degC/min], and [s], increasing within each run, for the figures that need them.
    run, groups : array-like of shape (n_rows,), default=None
        Labels of the runs (None is one run), and of groups that get a table of their own.
    inside : array-like of bool of shape (n_rows,), default=None
        Rows in the bounds of the calibration; the others are counted and stay in.
    full_scale, nominal_scale_factor : float, default=None, 1.0
        Rate of full scale [deg/s] (None: the largest true rate), and nominal scale factor.
    averaging_times : tuple of float, default=(10.0, 100.0)
        Lengths of the means of the bias stability, positive [s].
    allan : bool, default=False
        Whether to read N, B and K off the Allan deviation; needs ``time``, and allantools.
    confidence_level, n_resamples : float, int, default=0.95, 200
        Of the intervals; zero resamples make none.
    rate_unit : {"deg/s", "deg/h"}, default=None
        Unit of every figure that is a rate, or a rate per something; None leaves each its usual.
    random_state : int, RandomState instance or None, default=None
        Seed of the bootstrap.

    Returns
    -------
    report : DataFrame
        One row per group, "all" first, and figure. Columns: group, figure, unit; before,
        before_low, before_high; the same of after; note, which says why a figure or an interval is
        missing. ``report.attrs["resampled"]`` has "runs" or "blocks of rows" by group.

    Raises
    ------
    ImportError
        If ``allan=True`` and allantools is not installed.
    ValueError
        If a column is not one of finite numbers as long as the others, or a parameter is out of its
        range.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import gyro_report
    >>> rate = np.linspace(-100.0, 100.0, 101)
    >>> report = gyro_report(rate, 1.001 * rate + 0.01, rate + 0.001, random_state=0)
    >>> report.set_index("figure").loc[["scale_factor_error", "bias"], "before"].round(1).tolist()
    [1000.0, 36.0]
    """
    if inside is not None and np.asarray(inside).dtype != bool:
        raise ValueError(f"inside must be bool; its dtype is {np.asarray(inside).dtype}.")
    columns = {"rate": rate, "before": before, "after": after, "temperature": temperature}
    columns |= {"temperature_rate": temperature_rate, "time": time}
    columns |= {"run": run, "groups": groups, "inside": inside}
    table = table_of(columns, labels=("run", "groups", "inside"), gaps=("after",))
    full_scale = table["rate"].abs().max() if full_scale is None else full_scale
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
    if rate_unit not in (None, *RATE_UNITS):
        raise ValueError(
            f"rate_unit={rate_unit!r} must be one of {', '.join(RATE_UNITS)}, or None."
        )
    given = {*table, "output", "residual", "error"}
    figures = [
        figure
        for figure in figures_of_merit(full_scale, nominal_scale_factor, averaging_times)
        if given.issuperset(figure.needs) and (figure.fewest_runs < 2 or run is not None)
    ]
    generator = check_random_state(random_state)
    parts = [("all", table)]
    if groups is not None:
        parts += table.groupby("groups", sort=False, dropna=False)
    lines, resampled = [], {}
    for group, part in parts:
        seed = generator.randint(2**31 - 1)
        found, resampled[group] = _lines(part, figures, allan, confidence_level, n_resamples, seed)
        lines += [{"group": group} | line for line in found]
    report = pd.DataFrame(lines, columns=["group", "figure", "unit", *_VALUES, "note"])
    if after is None:
        report = report.drop(columns=_VALUES[3:])
    if rate_unit is not None:
        units, factors = zip(*(in_rate_unit(u, rate_unit) for u in report["unit"]), strict=True)
        values = report.columns.intersection(_VALUES)
        report = report.assign(unit=units, **report[values].mul(np.array(factors), axis=0))
    # Before compensation nothing is reduced.
    report.loc[report["figure"] == "reduction_factor", _VALUES[:3]] = np.nan
    report.attrs["resampled"] = resampled
    return report


def table_of(columns, labels=(), gaps=()):
    """Columns of equal length as a table, those that are None left out.

    All but ``labels`` must be numbers, and finite; those in ``gaps`` may be NaN.
    """
    found: dict[str, np.ndarray] = {}
    n_rows = None
    for name, values in columns.items():
        if values is None:
            continue
        if name in labels:
            found[name] = check_labels(values, name, n_rows)
        elif name in gaps:
            numbers = np.asarray(values)
            numbers = numbers if numbers.dtype.kind in "fiu" else numbers.astype(object)
            is_gap = pd.isna(numbers)
            filled = check_column(np.where(is_gap, 0.0, numbers), name, n_rows)
            found[name] = np.where(is_gap, np.nan, filled)
        else:
            found[name] = check_column(values, name, n_rows)
        n_rows = found[name].size
    return pd.DataFrame(found)


def _lines(part, figures, allan, confidence_level, n_resamples, seed):
    """Lines of one group, and what was resampled."""
    sides = [side for side in ("before", "after") if side in part]
    is_answered = part[sides[-1]].notna()
    answered = part[is_answered]
    units, kind = _units(answered)
    random_state = np.random.RandomState(seed)
    n_resamples = n_resamples if units else 0
    draws = [random_state.randint(0, len(units), size=len(units)) for _ in range(n_resamples)]
    cells = {}
    for side in sides:
        cells[side] = _cells(answered, side, figures, units, kind, draws, confidence_level)
        cells[side] += _allan_cells(part, side, is_answered.to_numpy()) if allan else []
    names = [(figure.name, figure.unit) for figure in figures]
    names += ALLAN_FIGURES.items() if allan else []
    lines = [{"figure": "rows", "before": float(len(part)), "after": float(len(part))}]
    if "after" in part:
        lines.append({"figure": "rows_refused", "after": float((~is_answered).sum())})
    if "inside" in part:
        lines.append({"figure": "rows_outside", sides[-1]: float((~part["inside"]).sum())})
    lines = [line | {"unit": "", "note": ""} for line in lines]
    for place, (name, unit) in enumerate(names):
        line = {"figure": name, "unit": unit}
        for side, found in cells.items():
            line[side], line[f"{side}_low"], line[f"{side}_high"], _ = found[place]
        notes = {side: found[place][-1] for side, found in cells.items()}
        told = [f"{side}: {note}" for side, note in notes.items() if note]
        line["note"] = notes["before"] if len({*notes.values()}) == 1 else "; ".join(told)
        lines.append(line)
    return lines, kind


def _units(rows):
    """The rows of each run, or of blocks of rows within the runs; and which of both."""
    runs = metrics.rows_by_run(rows.get("run"), len(rows)) if len(rows) else []
    if len(runs) >= _FEWEST_RUNS:
        return runs, "runs"
    length = max(1, -(-len(rows) // _N_BLOCKS))
    blocks = [run[i : i + length] for run in runs for i in range(0, run.size, length)]
    return blocks, "blocks of rows"


def _cells(table, side, figures, units, kind, draws, confidence_level):
    """Value, ends of the interval, and a note, of each figure."""
    if table.empty:
        return [(np.nan, np.nan, np.nan, "no row is left in this group")] * len(figures)
    columns = {name: table[name].to_numpy() for name in table}
    rows = _with_errors(columns, side)
    step = max(1, -(-len(table) // _MOST_ROWS))
    thinned = [unit[::step] for unit in units]
    samples = [
        _with_errors(taken(columns, np.concatenate([thinned[i] for i in draw])), side)
        for draw in draws
    ]
    tails = [50.0 * (1.0 - confidence_level), 50.0 * (1.0 + confidence_level)]
    cells = []
    for figure in figures:
        ends = (np.nan, np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            value, note = _or_nan(figure.value, rows)
            if draws and not note:
                ends, note = _interval(figure, rows, samples, draws, kind, tails)
        cells.append((value, *ends, note))
    return cells


def _interval(figure, rows, samples, draws, kind, tails):
    """Ends of the interval, and why it has none."""
    nothing = (np.nan, np.nan)
    if figure.name in LARGEST_VALUES:
        return nothing, "largest value: no interval"
    if figure.combine is None:
        spread = np.array([_or_nan(figure.of, sample)[0] for sample in samples])
    elif kind != "runs":
        return nothing, f"no interval: fewer than {_FEWEST_RUNS} runs"
    else:
        by_run = figure.by_run(rows)
        spread = np.array([_or_nan(figure.combine, by_run[draw])[0] for draw in draws])
    spread, n_resamples = spread[np.isfinite(spread)], len(draws)
    if spread.size < _FEWEST_DEFINED * n_resamples:
        return nothing, "no interval: too many resamples do not have this figure"
    return np.percentile(spread, tails), ""


def _with_errors(rows, side):
    """The columns with the output of one side, its residual, and its error at the input."""
    output = rows[side]
    error = metrics.input_error(rows["rate"], output)
    return rows | {"output": output, "residual": output - rows["rate"], "error": error}


def _allan_cells(part, side, is_answered):
    """Coefficients read off the Allan deviation, of the runs that were answered whole."""
    time = part["time"].to_numpy()
    run = part["run"].to_numpy() if "run" in part else np.zeros(len(part))
    try:
        rows, interval = rows_for_allan(time, run, is_answered)
        error = (part[side] - part["rate"]).to_numpy()[rows]
        curve = allan_deviation(error, interval, run=run[rows])
        read = allan_coefficients(curve["averaging_time"], curve["deviation"])
    except ValueError as reason:
        return [(np.nan, np.nan, np.nan, str(reason))] * len(ALLAN_FIGURES)
    notes = dict.fromkeys(ALLAN_FIGURES, "no interval: see the standard errors of allan_deviation")
    notes |= read.notes
    return [(getattr(read, n) or np.nan, np.nan, np.nan, note) for n, note in notes.items()]


def _or_nan(function, *arguments):
    """What the function gives and "", or NaN and what its ValueError says."""
    try:
        return function(*arguments), ""
    except ValueError as error:
        return np.nan, str(error)
