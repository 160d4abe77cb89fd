"""What is odd about a log: glitches, an output that is late, a thermometer that stands still."""

import numpy as np
import pandas as pd
from scipy.signal import correlate, correlation_lags
from scipy.spatial import cKDTree

from ..digits import counted, in_digits, percent
from .metrics import rate_columns

LEAST_CORRELATION = 0.9  # of output and rate
# Fewer rows determine neither a line in every input nor its residual errors. A sensor that keeps
# one value in this many rows, while it should change, is stuck.
FEWEST_ROWS = 20
_MUCH_DELAYED = 0.1  # of the squared error that is left
_MOST_GLITCHES = 3  # of a kind, that are named
# A row is alone if it deviates this many times as much as the next one. Gaussian noise never comes
# near; Student's t with three degrees of freedom did not in a thousand logs.
ALONE = 5.0
# A row is compared with the median of this many others, which one more glitch does not upset.
_N_NEIGHBOURS = 8
_MOST_CANDIDATES = 2_000  # rows with the largest errors
# A temperature moves slowly: a step of this part of its range, from row to row, is a glitch.
_SMOOTH = 0.2
_SOUND = 0.9  # smallest share of the rows that are no glitches


def oddities(log, error, left, name_row):
    """Sentences on what is odd about a log; ``left`` is what a compensation leaves of ``error``."""
    late, part = delay(log, left)
    if part > _MUCH_DELAYED:
        rows = counted(in_digits(abs(late), 2), "row")
        yield (
            f"{percent(part)} of the squared error that is left follows the change of the rate "
            f"from row to row, as if the output came some {rows} {'late' if late > 0 else 'early'}"
            ": align the two columns, or drop the rows while the rate changes."
        )
    for run in find_standing_thermometer(log):
        yield (
            f"the temperature of run {str(run)!r} never changes, while that of other runs does; if "
            "its thermometer is stuck, drop this run and calibrate again."
        )
    for row, reason in find_glitches(log, error, late if part > _MUCH_DELAYED else 0.0):
        yield (
            f"{name_row(row)}: {reason} is supported by no other row; if it is a glitch, drop such "
            "rows and calibrate again."
        )


def delay(log, left):
    """How many rows late the output seems to be; what part of the squares ``left`` this explains.

    A delay of d rows leaves -d times the slope of the rate from row to row. Noise of the rate
    itself leaves its curvature, which is taken off before, as are offsets of whole runs. An
    output late by whole rows is first compared with the rates of so many rows before.
    """
    run = log["run"] if "run" in log else pd.Series(0, log.index)
    rate = log["rate"].groupby(run, observed=True)

    def beside(late):
        """Rows late, mean squares of what is left, and without the delay, and their number."""
        earlier, now, later = (rate.shift(late + step) for step in (1, 0, -1))
        parts = {"left": left + log["rate"] - now, "slope": 0.5 * (later - earlier)}
        known = pd.DataFrame(parts | {"curvature": earlier + later - 2.0 * now}).dropna()
        known -= known.groupby(run, observed=True).transform("mean")
        error, slope, curvature = known.to_numpy().T
        size = curvature @ curvature or 1.0
        error, slope = (each - curvature * (curvature @ each / size) for each in (error, slope))
        both, own, total = error @ slope, slope @ slope or np.inf, error @ error
        n_rows = max(len(known), 1)
        return late - both / own, (total - both**2 / own) / n_rows, total / n_rows, n_rows

    _, _, total, n_rows = at_once = beside(0)
    # The rates of other runs, if alike, are no rates so many rows before: few rows are then left.
    late = whole_delay(left + log["rate"], log["rate"])
    whole = beside(late) if late else at_once
    late, least, *_ = min(at_once, whole, key=lambda found: (2 * found[3] < n_rows, found[1]))
    part = 1.0 - least / total if total else 0.0
    # Any slope explains 1 / n of the noise of n rows, and nine times as much once in 300 logs.
    return (late, part) if part * n_rows > 9.0 and abs(late) < n_rows else (0.0, 0.0)


def whole_delay(output, rate):
    """How many whole rows the output is late, by its correlation with the rate; 0 if by none."""
    table = pd.DataFrame({"output": output, "rate": rate}).reset_index(drop=True)
    known = (table - table.mean()).fillna(0.0)
    sizes = np.abs(correlate(known["output"], known["rate"], method="fft"))
    late = int(correlation_lags(len(table), len(table))[sizes.argmax()])
    beside = table.assign(rate=table["rate"].shift(late)).corr(min_periods=FEWEST_ROWS)
    return late if abs(beside.at["output", "rate"]) > LEAST_CORRELATION else 0


def find_glitches(log, error, late=0.0):
    """Rows that no other row supports, and what is odd about each; ``error`` has one per row.

    The error of a row, less what follows the rate, is compared with those of the rows nearest in
    temperature, rate and order; its temperature should lie between those of the rows before and
    after in the run. Least squares bends the whole model towards one such row. If there are many,
    three of a kind are named, and the others counted. An output ``late`` by some rows is no glitch
    if it lies among the rates of the rows so near.
    """
    temperature, rate = (log[part].to_numpy() for part in ("temperature", "rate"))
    runs = log["run"].to_numpy() if "run" in log else np.zeros(len(log), dtype=int)
    by_run = pd.Series(temperature).groupby(runs)
    # At an end of a run the rows on the one side count twice. Two rows alone tell nothing.
    shifted = [by_run.shift(step).fillna(by_run.shift(-step)) for step in (-2, -1, 1, 2)]
    _, low, high, _ = np.sort(np.column_stack(shifted), axis=1).T
    beyond = np.nan_to_num(np.maximum(low - temperature, temperature - high))
    least = max(_SMOOTH * _spread(temperature), ALONE * np.quantile(beyond, _SOUND))
    jumps = np.flatnonzero(beyond > least)
    # Of a gyro that is far from linear, the curve would hide a glitch; clipped, none bends the fit.
    columns = np.column_stack([np.ones_like(rate), rate_columns(rate, temperature)])
    low, high = np.quantile(error, [0.05, 0.95])
    clipped = np.clip(error, 2.0 * low - high, 2.0 * high - low)
    error = error - columns @ np.linalg.lstsq(columns, clipped, rcond=None)[0]
    near = log["rate"].rolling(2 * int(np.ceil(abs(late))) + 1, center=True, min_periods=1)
    error -= np.clip(error, near.min() - rate, near.max() - rate).to_numpy()
    # A row farther from its neighbours than the spread of all errors is far from the median too.
    far = np.argsort(-np.abs(error - np.median(error)), kind="stable")[:_MOST_CANDIDATES]
    places = np.column_stack([temperature, rate, np.arange(len(log))])
    scale = _spread(places)
    places /= np.where(scale > 0.0, scale, 1.0)
    # Many rows share rate and temperature: a tree that halves space, not rows, is faster then.
    tree = cKDTree(places, balanced_tree=False)
    # The row itself is among its neighbours, which does not upset the median.
    nearest = tree.query(places[far], min(_N_NEIGHBOURS + 1, tree.n))[1]
    sizes = np.abs(error[far] - np.median(error[nearest], axis=1))
    order = np.argsort(-sizes, kind="stable")
    first, next_one = sizes[order[:-1]], sizes[order[1:]]
    alone = np.flatnonzero(first > np.maximum(ALONE * next_one, _spread(error)))
    output, alone = log["output"].to_numpy(), far[order[: alone.max(initial=-1) + 1]]
    found = _named(alone, "the output of {:.4g} at a rate of {:.4g} deg/s", output, rate)
    found |= _named(jumps, "the temperature of {:.4g} degC", temperature)
    return sorted(found.items())


def _named(rows, told, *columns):
    """What is odd about the first of these rows, in words, and how many more there are."""
    named, more = rows[:_MOST_GLITCHES].tolist(), len(rows) - _MOST_GLITCHES
    found = {row: told.format(*(values[row] for values in columns)) for row in named}
    if more > 0:
        found[named[-1]] += f" (and that of {counted(f'{more:,}', 'row')} more)"
    return found


def _spread(values):
    low, high = np.quantile(values, [0.05, 0.95], axis=0)
    return high - low


def find_standing_thermometer(log):
    """Names of runs with one temperature throughout, in many more rows than is usual elsewhere."""
    if "run" not in log:
        return []
    by_run = log.groupby("run", observed=True)["temperature"]
    longest = by_run.agg(lambda values: stretches_of(values.to_numpy())[1].max())
    usual = ALONE * longest.quantile(0.5, interpolation="lower")
    stands = (by_run.nunique() == 1) & (longest > usual) & (longest >= FEWEST_ROWS)
    return longest.index[stands].tolist()


def stretches_of(values):
    """First rows and lengths of stretches of equal values."""
    starts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    return starts, np.diff(starts, append=values.size)
