"""The table of all figures of merit, before and after compensation, with bootstrap intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_random_state

from . import metrics
from ._columns import PER_HOUR, RATE_UNITS, in_rate_unit

# With fewer runs than this, blocks of rows are resampled: two or three runs say little of others.
_FEWEST_RUNS = 5
_N_BLOCKS = 30
# Rows of a resample, thinned at random: the spread between runs or blocks decides, not the rows.
_MOST_ROWS = 2_000
_FEWEST_DEFINED = 0.9  # least share of the resamples that must have the figure
_PERCENTILES = 2.5, 97.5


def gyro_report(
    rate: ArrayLike,
    before: ArrayLike,
    after: ArrayLike | None = None,
    *,
    temperature: ArrayLike | None = None,
    temperature_rate: ArrayLike | None = None,
    time: ArrayLike | None = None,
    run: ArrayLike | None = None,
    full_scale: float | None = None,
    allan: bool = False,
    n_resamples: int = 200,
    rate_unit: str | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> pd.DataFrame:
    """Tabulate the figures of merit of a gyro, before and after its compensation.

    Give held-out predictions. The 95 % intervals come from a bootstrap over runs, if there are five
    or more, and otherwise over some thirty blocks of rows.

    Parameters
    ----------
    rate, before : array-like of shape (n_rows,)
        True rate, and rate indicated without compensation [deg/s].
    after : array-like of shape (n_rows,), default=None
        Compensated rate [deg/s]; rows where it is NaN are left out.
    temperature, temperature_rate, time : array-like of shape (n_rows,), default=None
        [degC], [degC/min], and [s], increasing within each run, for the figures that need them.
    run : array-like of shape (n_rows,), default=None
        Labels of the runs; None is one run.
    full_scale : float, default=None
        Rate of full scale [deg/s]; None is the largest true rate.
    allan : bool, default=False
        Whether to read N, B and K off the Allan deviation; needs ``time``, and allantools.
    n_resamples : int, default=200
        Resamples for the intervals; zero makes no intervals.
    rate_unit : {"deg/s", "deg/h"}, default=None
        Unit of every figure that is a rate, or a rate per something; None: each in its usual unit.
    random_state : int, RandomState instance or None, default=None
        Seed of the bootstrap.

    Returns
    -------
    report : DataFrame
        One row per figure. Columns: figure, unit; before, before_low, before_high; the same of
        after; note, which says why a figure or an interval is missing. The attribute "resampled"
        is "runs" or "blocks of rows".

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import gyro_report
    >>> rate = np.linspace(-100.0, 100.0, 101)
    >>> report = gyro_report(rate, 1.001 * rate + 0.01, rate + 0.001, random_state=0)
    >>> report.set_index("figure").loc[["scale_factor_error", "bias"], "before"].round(1).tolist()
    [1000.0, 36.0]
    """
    columns = {"rate": rate, "before": before, "after": after, "temperature": temperature}
    columns |= {"temperature_rate": temperature_rate, "time": time, "run": run}
    table = metrics.table_of(columns, labels=("run",), gaps=("after",))
    sides = ["before", "after"] if "after" in table else ["before"]
    is_answered = table[sides[-1]].notna()
    if not is_answered.any():
        raise ValueError("after is NaN in all rows: the compensator refused them.")
    full_scale = table["rate"].abs().max() if full_scale is None else full_scale
    if not full_scale > 0:
        raise ValueError(f"full_scale={full_scale} must be positive; give it for a log at rest.")
    if allan and time is None:
        raise ValueError("allan=True needs the column time.")
    if n_resamples < 0:
        raise ValueError(f"n_resamples={n_resamples} must be zero or positive.")
    if rate_unit not in (None, *RATE_UNITS):
        raise ValueError(
            f"rate_unit={rate_unit!r} must be one of {', '.join(RATE_UNITS)}, or None."
        )
    given = {*table, "output", "residual", "error", "of_bias"}
    every = metrics.figures_of_merit(full_scale)
    figures = [figure for figure in every if given.issuperset(figure.needs)]
    answered = {name: table[name].to_numpy()[is_answered] for name in table}
    answered["of_bias"] = metrics.rows_of_bias(answered["rate"])
    blocks, kind = _blocks_of(answered)
    # A new generator, so that a given one advances by one number only.
    generator = np.random.RandomState(check_random_state(random_state).randint(2**31 - 1))
    draws = [generator.randint(0, len(blocks), size=len(blocks)) for _ in range(n_resamples)]
    names = [(figure.name, figure.unit) for figure in figures]
    names += metrics.ALLAN_FIGURES.items() if allan else []
    report, notes = pd.DataFrame(names, columns=["figure", "unit"]), {}
    for side in sides:
        cells = _cells(answered, side, figures, blocks, kind, draws)
        cells += _allan_cells(table, side, is_answered) if allan else []
        *values, notes[side] = zip(*cells, strict=True)
        report[[side, f"{side}_low", f"{side}_high"]] = np.transpose(values)
    # The reduction factor has no value before compensation.
    report.loc[report["figure"] == "reduction_factor", report.columns[2:5]] = np.nan
    if rate_unit is not None:
        own, factors = zip(*(in_rate_unit(u, rate_unit) for u in report["unit"]), strict=True)
        report = report.assign(unit=own, **report.iloc[:, 2:].mul(np.array(factors), axis=0))
    report["note"] = list(map(_joined, pd.DataFrame(notes).to_dict("records")))
    report.attrs["resampled"] = kind
    return report


def _joined(notes):
    """One note if both sides have the same, or else each with its side."""
    if len({*notes.values()}) == 1:
        return notes["before"]
    return "; ".join(f"{side}: {note}" for side, note in notes.items() if note)


def _blocks_of(rows):
    """Rows that are resampled together, run by run or in blocks of each run; and what they are."""
    n_rows = rows["rate"].size
    runs = metrics.rows_by_run(rows.get("run"), n_rows)
    if len(runs) >= _FEWEST_RUNS:
        return runs, "runs"
    length = -(-n_rows // _N_BLOCKS)
    blocks = [run[i : i + length] for run in runs for i in range(0, run.size, length)]
    return blocks, "blocks of rows"


def _cells(answered, side, figures, blocks, kind, draws):
    """Value, ends of the interval, and a note, of each figure."""
    step = -(-answered["rate"].size // _MOST_ROWS)
    # At random: every second row might have rates of one sign only.
    choice = np.random.RandomState(0).choice
    places = [
        np.concatenate([choice(rows, -(-rows.size // step), replace=step > 1) for rows in drawn])
        for drawn in ([blocks[i] for i in draw] for draw in draws)
    ]
    rows, cells = _of_side(answered, side), []
    with np.errstate(divide="ignore", invalid="ignore"):
        samples = [_of_side({k: each[at] for k, each in answered.items()}, side) for at in places]
        for figure in figures:
            ends, (value, note) = (np.nan, np.nan), _or_nan(figure.value, rows)
            if draws and not note:
                ends, note = _interval(figure, value, rows, samples, draws, kind)
            cells.append((value, *ends, note))
    return cells


def _interval(figure, value, rows, samples, draws, kind):
    """Ends of the interval, and a note if there is none."""
    nothing = (np.nan, np.nan)
    if figure.name in metrics.LARGEST_VALUES:
        return nothing, "no interval: it is a largest value"
    if figure.combine is None:
        found = [_or_nan(figure.of, sample)[0] for sample in samples]
    elif kind != "runs":
        return nothing, f"no interval: fewer than {_FEWEST_RUNS} runs"
    else:
        by_run = figure.by_run(rows)
        found = [_or_nan(figure.combine, by_run[draw])[0] for draw in draws]
    spread = np.array(found)[np.isfinite(found)]
    if spread.size < _FEWEST_DEFINED * len(draws):
        return nothing, "no interval: too many resamples do not have this figure"
    # A resample has fewer different rows, and so more noise: only its relative spread is used.
    own = value / (np.median(spread) or 1.0) if figure.name in metrics.SIZES_WITH_NOISE else 1.0
    return own * np.percentile(spread, _PERCENTILES), ""


def _of_side(rows, side):
    """The columns, plus the output of one side, its residual, and its error at the input."""
    rate, output = rows["rate"], rows[side]
    error = metrics.input_error(rate, output)
    return rows | {"output": output, "residual": output - rate, "error": error}


def _allan_cells(part, side, is_answered):
    """Coefficients of the Allan deviation, over rows that follow one another."""
    error = PER_HOUR * (part[side] - part["rate"]).where(is_answered).to_numpy()
    try:
        curve = metrics.allan_deviation(error, part["time"].to_numpy(), part.get("run"))
        found = metrics.allan_figures(*curve[["averaging_time", "deviation"]].to_numpy().T)
    except ValueError as reason:
        return [(np.nan, np.nan, np.nan, str(reason))] * len(metrics.ALLAN_FIGURES)
    usual = "no interval: see the standard errors of AllanDisplay"
    return [(value, np.nan, np.nan, note or usual) for value, note in found.values()]


def _or_nan(function, *arguments):
    """The function's value and "", or NaN and the text of its ValueError."""
    try:
        return function(*arguments), ""
    except ValueError as error:
        return np.nan, str(error)
