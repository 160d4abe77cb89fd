"""Cross-validation splits that keep runs, devices or rate levels whole, and which to choose.

Groups are integers, one per row, as scikit-learn's splitters take them. docs/gyro_splits.rst says
why levels must be held out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.signal import find_peaks

from ..digits import counted
from ._columns import check_column
from .errors import LogError

# Relative to the largest rate: no table tells closer rates apart.
_SMALLEST_TOLERANCE = 1e-4
# Smallest ratio of a gap between levels to a gap within a level.
_CLEAR_JUMP = 3.0
# Largest share of the rows that may lie in clusters too wide for a level.
_SHARE_TOO_WIDE = 0.05
# Rates without a clear jump that cover more than this share of their range are spread over it.
_SHARE_COVERED = 0.05
# A cluster with fewer rows, relative to a typical level, is a table between levels.
_FEW_ROWS = 0.1

KINDS = ("auto", "device", "run", "level", "device+level", "run+level", "leg", "piece")

# Fewest groups of a kind. Of two legs each way, one is held out, and the other shows its direction.
_FEWEST = {"device": 3, "run": 3, "level": 5, "leg": 4, "piece": 2}
# As in scikit-learn's cross-validation: each fold trains on four fifths.
_N_FOLDS = 5
# Folds of the levels if runs are held out too: every fold then trains on two thirds of the levels.
_N_LEVEL_FOLDS_BESIDE = 3
# No model can memorise more levels than a few per term.
_MOST_LEVELS = 100
# Share of levels that several runs have, beyond which runs count as sharing levels.
_SHARED = 0.1
# A level is a dwell of a few rows, not a rate that came up once.
_ROWS_PER_LEVEL = 3
# Widest gap between temperatures, relative to their range: three soaks leave gaps of a half.
_WIDEST_GAP = 0.4
# From a turning point the temperature comes back by at least this share of its range, and [degC].
_TURN, _SMALLEST_TURN = 0.2, 3.0
# Rows of each run among which turning points are searched.
_MOST_POINTS = 5_000
_NO_CLOCK = (
    " No column of the time was found, whose gaps would tell runs apart: name it with --columns "
    "time=NAME."
)
# Cautions if there are several groups of a kind, but too few to hold one out.
_TOO_FEW = {
    "level": "the table stood at only {} rates (without their signs), too few to hold one out: the "
    "error that is left at any other rate is not known.",
    "device": "{} devices share a compensator, and are too few to hold one out: the error that it "
    "leaves in any other device is not known, and a compensator for each alone may leave less.",
}
_NO_ROWS = "the log has no temperature from {:.4g} to {:.4g} degC: the error there is not known."
_LEGS = "legs between turning points of the temperature"
# What is held out, and what of it is counted.
_WORDS = {
    "device": ("whole devices", "devices"),
    "run": ("whole runs", "runs"),
    "level": ("rate levels", "levels"),
    "leg": (f"whole {_LEGS}", "legs"),
    "piece": (f"pieces of the {_LEGS}", f"legs, {_N_FOLDS} pieces of each"),
}


def group_by_rate_level(rate: ArrayLike) -> np.ndarray:
    """Group rows by the level of the rate table, found from the rates themselves.

    Gaps between neighbouring rates are sorted, and their clearest jump separates gaps within a
    level from gaps between levels. Rows of a table between levels count to the nearest level.

    Parameters
    ----------
    rate : array-like of shape (n_samples,)
        True rate, in any unit; a rate and its opposite are one level.

    Returns
    -------
    groups : ndarray of int of shape (n_samples,)
        Number of the level of each row, the lowest 0. Modulo 5 they are five groups, each with
        levels from the whole range.

    Raises
    ------
    ValueError
        If the rate changes continuously, so that it has no levels, or if values are missing.

    Examples
    --------
    >>> from skanfis.gyro import group_by_rate_level
    >>> rate = [-20.0, -10, 0, 10, 20, -20, -10, 0, 10, 20]
    >>> group_by_rate_level(rate).tolist()
    [2, 1, 0, 1, 2, 2, 1, 0, 1, 2]
    """
    rate = check_column(rate, "rate")
    labels = level_numbers(np.abs(rate))
    # Many rates of a row or two each are no levels of a table either.
    if labels is None or 1 + labels.max() >= max(_MOST_LEVELS, labels.size / 2):
        raise ValueError(
            f"rate has no levels: it changes continuously between {rate.min():g} and "
            f"{rate.max():g}. If a table went from level to level, leave out the rows in between, "
            "or round the rates. If not, no level can be memorised: hold out runs or devices."
        )
    return labels


def level_numbers(rate, fewest=1):
    """Number of each row's level, from the lowest; None if most rows are in no level of enough."""
    values, inverse, n_rows = np.unique(rate, return_inverse=True, return_counts=True)
    gaps = np.diff(values)
    smallest = _SMALLEST_TOLERANCE * np.abs(values).max()
    tolerance = _clearest_tolerance(gaps, smallest)
    first = np.flatnonzero(np.concatenate([[True], gaps > tolerance]))
    clusters = np.searchsorted(first, inverse, side="right") - 1
    n_rows = np.add.reduceat(n_rows, first)
    low, high = values[first], values[np.append(first[1:], len(values)) - 1]
    # A cluster that is wider than it is far from the next is no level.
    between = np.concatenate([[np.inf], low[1:] - high[:-1], [np.inf]])
    widest = np.minimum(between[:-1], between[1:])
    if len(low) == 1:  # nothing is next
        widest = np.maximum(0.01 * np.abs(high), 10.0 * tolerance)
    if n_rows[high - low > widest].sum() > _SHARE_TOO_WIDE * len(rate):
        return None
    others = np.sort(n_rows)[:-1]  # a gyro may rest for most of the log
    typical = np.median(np.repeat(others, others)) if others.size else 0
    centers = 0.5 * (low + high)
    is_level = n_rows >= max(_FEW_ROWS * typical, fewest)
    if 2 * n_rows[is_level].sum() < len(rate):
        return None
    levels = centers[is_level]
    is_spread = len(levels) * smallest > _SHARE_COVERED * (high[-1] - low[0]) > 0
    if tolerance == smallest and is_spread:
        return None
    # Each cluster goes to the nearest level, which for a level is the cluster itself.
    return np.searchsorted(0.5 * (levels[1:] + levels[:-1]), centers)[clusters]


def _clearest_tolerance(gaps, smallest):
    """Gap that tells levels apart, from the gaps between all different rates."""
    wide = np.sort(np.append(gaps[gaps > smallest], smallest))
    if len(wide) == 1:
        return smallest
    jumps = wide[1:] / wide[:-1]
    place = jumps.argmax()
    return np.sqrt(wide[place] * wide[place + 1]) if jumps[place] >= _CLEAR_JUMP else smallest


@dataclass(frozen=True, eq=False)
class Split:
    """Folds of a cross-validation: every row is tested once, by a model that is new to its group.

    ``labels`` name the groups in a report, ``sentence`` says what was held out and why, and
    ``cautions`` what this cannot show. ``most``, a value of ``--write``, is the most complex
    compensation that it can recommend.
    """

    kind: str
    folds: list
    labels: np.ndarray
    sentence: str
    cautions: tuple[str, ...] = ()
    most: str = ""


def choose_split(log, kind="auto", *, uses_output=True):
    """The split of the kind asked for; with "auto", of the kind that suits the log.

    ``uses_output``: only a compensator that sees the output can memorise levels of the rate.
    """
    # Groups are numbered in the order of their names, whatever the order of the files.
    groups = {
        name: np.unique(log[name].astype(str), return_inverse=True)[1]
        for name in ("device", "run")
        if name in log
    }
    levels = level_numbers(np.abs(log["rate"].to_numpy()), _ROWS_PER_LEVEL)
    if levels is not None and uses_output:
        groups["level"] = levels
    if "temperature" in log:
        groups["leg"] = groups["piece"] = find_legs(log["temperature"].to_numpy(), log.get("run"))
    counts = {name: np.unique(numbers).size for name, numbers in groups.items()}
    reason = "as asked for"
    if kind == "auto":
        kind, reason = _choose(groups, counts, "time" in log)
    if kind == "piece":
        reason += "; so few cycles cannot show whether they repeat"
    parts = kind.split("+")
    if "device" in parts:
        reason += "; a log of each device alone may leave less"
    for part in parts:
        _check(part, counts)
    numbers = np.column_stack([fold_numbers(part, groups[part], len(parts)) for part in parts])
    # Rows that share only the run, or only the level, with tested rows are neither side's.
    sides = ((numbers != fold, numbers == fold) for fold in np.unique(numbers, axis=0))
    folds = [tuple(np.flatnonzero(side.all(axis=1)) for side in pair) for pair in sides]
    what = " and ".join(_WORDS[part][0] for part in parts)
    of_each = ", ".join(f"{counts[part]} {_WORDS[part][1]}" for part in parts)
    sentence = f"{what} held out ({of_each}, {len(folds)} folds; {reason})"
    few = [n for n in _TOO_FEW if n not in parts and 1 < counts.get(n, 0) < _FEWEST[n]]
    cautions = tuple(_TOO_FEW[name].format(counts[name]) for name in few)
    # One thermal cycle cannot show that more repeats.
    most = "constant" if kind == "piece" and log["rate"].nunique() == 1 else ""
    if "temperature" in log and (gap := _gap(log["temperature"].to_numpy())):
        cautions, most = (*cautions, _NO_ROWS.format(*gap)), most or "law-line"
    if "level" in few:
        # Two coefficients bend the law: four levels test it, fewer could be memorised by it.
        most = "law-line" if counts["level"] == _FEWEST["level"] - 1 else "line"
    return Split(kind, folds, _labels(log, parts[0], groups[parts[0]]), sentence, cautions, most)


def _gap(temperature):
    """Ends of the widest gap between temperatures; None if it is small beside their range."""
    # One or two rows far from all others are no soak.
    values = np.sort(temperature)[_ROWS_PER_LEVEL - 1 : 1 - _ROWS_PER_LEVEL]
    if values.size < 2:
        return None
    place = np.diff(values).argmax()
    low, high = values[place : place + 2]
    return (low, high) if high - low > _WIDEST_GAP * np.ptp(values) else None


def _choose(groups, counts, has_time):
    """The kind of split that a log calls for, and why."""
    # The best comes first: devices, runs, levels, legs, pieces.
    enough = [name for name, count in counts.items() if count >= _FEWEST[name]]
    if not enough:
        found = [counted(counts[name], name) for name in ("device", "run") if name in counts]
        found.append(counted(counts.get("level", 0), "rate level"))
        clock = "" if has_time else _NO_CLOCK
        raise LogError(
            "the compensator could not be checked: the log has "
            f"{', '.join(found)}. To hold them out in turn takes at least 3 runs (a column run, or "
            f"one file each), 5 rate levels, or a temperature that rises and falls.{clock}"
        )
    whole = enough[0]
    if whole not in ("device", "run"):
        return whole, "too few runs to hold out"
    if "level" in enough and counts["level"] <= _MOST_LEVELS:
        pairs = np.unique(np.column_stack([groups["level"], groups[whole]]), axis=0)
        # Share of the levels that two groups or more have.
        if np.mean(np.unique(pairs[:, 0], return_counts=True)[1] > 1) > _SHARED:
            return f"{whole}+level", f"the {whole}s share rate levels, which could be memorised"
    return whole, f"rows of one {whole} are alike"


def _check(part, counts):
    if part not in counts:
        what = {"level": "rate levels", "leg": "temperature", "piece": "temperature"}
        missing = what.get(part, f"column for the {part}")
        raise LogError(f"--groups {part}: the log has no {missing} to hold out.")
    if counts[part] < _FEWEST[part]:
        found = counted(counts[part], "leg" if part == "piece" else part)
        raise LogError(
            f"--groups {part}: the log has {found}; to hold one out takes {_FEWEST[part]} or more."
        )


def fold_numbers(part, groups, n_parts):
    """Number of the fold that tests each row, as far as one part of a split decides."""
    if part == "level":
        return groups % (_N_LEVEL_FOLDS_BESIDE if n_parts > 1 else _N_FOLDS)
    if part == "piece":
        # Hold out one piece of every leg. A warming leg and the next, cooling one lose different
        # temperatures, so that the model has seen each temperature in one direction.
        return (_pieces(groups) + 2 * groups) % _N_FOLDS
    # By order and not by size, so that a row more or less moves no group to another fold.
    return groups % min(_N_FOLDS, np.unique(groups).size)


def _labels(log, part, groups):
    """A label for each row's group, such as "|25| °/s", or "2: 25 to 71 °C" for a leg."""
    if part in ("device", "run"):
        return log[part].astype(str).to_numpy(dtype=object)
    if part == "level":
        levels = log["rate"].abs().groupby(groups).median()
        names = [f"|{level:.4g}| °/s" for level in levels]
    else:
        if part == "piece":
            numbers = groups * _N_FOLDS + _pieces(groups)
            groups = np.unique(numbers, return_inverse=True)[1]
        ends = log["temperature"].groupby(groups).agg(["first", "last"]).itertuples()
        names = [f"{number + 1}: {first:.0f} to {last:.0f} °C" for number, first, last in ends]
    return np.array(names, dtype=object)[groups]


def find_legs(temperature, run=None):
    """Number of each row's leg, run by run; turning points of the temperature separate legs."""
    least = max(_TURN * float(np.ptp(temperature)), _SMALLEST_TURN)
    runs = np.zeros(temperature.size) if run is None else np.asarray(run)
    legs, n_legs = np.empty(temperature.size, dtype=int), 0
    for _, part in pd.Series(temperature).groupby(runs):
        turns = _turns(part.to_numpy(), least)
        legs[part.index] = n_legs + np.searchsorted(turns, np.arange(part.size), side="right")
        n_legs += len(turns) + 1
    return legs


def _turns(temperature, least):
    """Rows at which the temperature turns, and comes back by ``least`` or more before the next."""
    # Some rows suffice: for a soak of equal values the time grows as the square of their number.
    every = -(-temperature.size // _MOST_POINTS)
    some = temperature[::every]
    highs, lows = (find_peaks(side, prominence=least)[0] for side in (some, -some))
    turns = pd.concat([pd.Series("high", highs), pd.Series("low", lows)]).sort_index()
    # Of several highs or lows in a row, as rounding leaves at a soak, take the first.
    return turns.index[turns != turns.shift()] * every


def _pieces(legs):
    """Number of each row's piece of its leg."""
    by_leg = pd.Series(legs).groupby(legs)
    return (by_leg.cumcount() * _N_FOLDS // by_leg.transform("size")).to_numpy()
