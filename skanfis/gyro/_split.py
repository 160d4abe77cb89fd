"""Which rows to hold out: whole devices or runs, rate levels that could be learnt, or legs."""

from dataclasses import dataclass

import numpy as np
from sklearn.model_selection import GroupKFold

from ._columns import label_texts
from .errors import LogError
from .groups import find_rate_levels, group_by_rate_level

__all__ = ["KINDS", "Split", "choose_split"]

KINDS = ("auto", "device", "run", "level", "device+level", "run+level", "leg", "piece")

# With two legs each way, one can be held out while another tells its direction.
_FEWEST = {"device": 3, "run": 3, "level": 5, "leg": 4, "piece": 2}
# As in scikit-learn's cross-validation: each fold trains on four fifths.
_N_FOLDS = 5
# Of the levels, where runs are held out too: every fold then trains on two thirds of them.
_N_LEVEL_FOLDS_BESIDE = 3
# More levels than a few per term of any model cannot be memorised.
_MOST_LEVELS = 100
# Of the levels, beyond which runs are taken to share them.
_SHARED = 0.1
# A level is a dwell of a few rows, not a rate that came up once.
_ROWS_PER_LEVEL = 3
# What a temperature must come back by for a turn: of its range, and at least [degC].
_TURN, _SMALLEST_TURN = 0.2, 3.0
# A turning point is looked for among so many means of each run.
_MOST_POINTS = 5_000


@dataclass(frozen=True, eq=False)
class Split:
    """Folds of a cross-validation: every row is tested once, by a model that is new to its group.

    ``labels`` are those that a report lists, ``sentence`` says what was held out and why.
    """

    kind: str
    folds: list
    labels: np.ndarray
    sentence: str


def choose_split(log, kind="auto", *, uses_output=True):
    """The split of the kind asked for, or of that which the log calls for.

    ``uses_output`` says whether the compensator sees the output: only then can it tell levels.
    """
    groups = {name: _numbers(log[name]) for name in ("device", "run") if name in log}
    levels = _levels(log) if uses_output else None
    if levels is not None:
        groups["level"] = levels
    if "temperature" in log:
        groups["leg"] = groups["piece"] = find_legs(log["temperature"].to_numpy(), log.get("run"))
    counts = {name: np.unique(numbers).size for name, numbers in groups.items()}
    reason = "as asked for"
    if kind == "auto":
        kind, reason = _choose(groups, counts, "time" in log)
    parts = kind.split("+")
    for part in parts:
        _check(part, counts)
    if kind in ("leg", "piece"):
        legs = groups["leg"]
        folds = legs % min(_N_FOLDS, counts["leg"]) if kind == "leg" else cut_legs(legs)
        what = f"whole legs between turning points of the temperature held out ({counts[kind]} legs"
        if kind == "piece":
            what = f"{what.replace('whole', 'pieces of the')}, {_N_FOLDS} pieces of each"
            reason += "; whether a cycle repeats, so few cannot show"
        folds = _hold_out(folds)
        labels = _name_legs(legs, log["temperature"].to_numpy())
        return Split(kind, folds, labels, f"{what}, {len(folds)} folds; {reason})")
    folds = _folds(log, parts, groups)
    named = {part: "rate levels" if part == "level" else f"whole {part}s" for part in parts}
    told = ", ".join(f"{counts[part]} {named[part].split()[-1]}" for part in parts)
    sentence = f"{' and '.join(named.values())} held out ({told}, {len(folds)} folds; {reason})"
    return Split(kind, folds, _labels(log, parts[0]), sentence)


def _choose(groups, counts, has_time):
    """The kind of split that a log calls for, and why."""
    enough = [name for name, count in counts.items() if count >= _FEWEST[name]]
    whole = next((name for name in ("device", "run") if name in enough), None)
    if whole is None:
        for kind in ("level", "leg", "piece"):
            if kind in enough:
                return kind, "too few runs to hold out"
        raise LogError(_nothing_to_hold_out(counts, has_time))
    if "level" in enough and counts["level"] <= _MOST_LEVELS:
        pairs = np.unique(np.column_stack([groups["level"], groups[whole]]), axis=0)
        # Levels, on average, that are met by two groups or more.
        if np.mean(np.unique(pairs[:, 0], return_counts=True)[1] > 1) > _SHARED:
            return f"{whole}+level", f"the {whole}s share rate levels, which could be memorised"
    return whole, f"rows of one {whole} are alike"


def _check(part, counts):
    if part not in counts:
        what = {"level": "rate levels", "leg": "temperature", "piece": "temperature"}
        missing = what.get(part, f"column for the {part}")
        raise LogError(f"cannot hold out by {part}: the log has no {missing}.")
    if counts[part] < _FEWEST[part]:
        name = "leg" if part == "piece" else part
        raise LogError(
            f"cannot hold out by {part}: the log has {counts[part]} {name}(s), and at least "
            f"{_FEWEST[part]} are needed."
        )


def _nothing_to_hold_out(counts, has_time):
    found = [f"{counts[name]} {name}(s)" for name in ("device", "run") if name in counts]
    found.append(f"{counts.get('level', 0)} rate levels")
    clock = ""
    if not has_time:
        clock = (
            " No column of the time was found, whose gaps would tell runs apart: name it with "
            "--columns time=NAME."
        )
    return (
        f"the compensator could not be checked: the log has {', '.join(found)}. At least 3 runs "
        "(a column run, or one file each), 5 rate levels, or a temperature that rises and falls "
        f"are needed, to be held out in turn.{clock}"
    )


def _numbers(labels):
    """Numbers of labels in the order of their names, whatever the order of the files."""
    return np.unique(label_texts(labels).astype(str), return_inverse=True)[1]


def _levels(log):
    """Number of each row's level of |rate|; None where the rate changes continuously."""
    try:
        levels = group_by_rate_level(log["rate"].to_numpy())
    except ValueError:
        return None
    # A level for nearly every row is none: holding it out would hold out single rows.
    return levels if np.unique(levels).size * _ROWS_PER_LEVEL <= levels.size else None


def _folds(log, parts, groups):
    fold = level = np.zeros(len(log), dtype=int)
    if parts[-1] == "level":
        n_levels = _N_LEVEL_FOLDS_BESIDE if len(parts) > 1 else _N_FOLDS
        level = group_by_rate_level(log["rate"].to_numpy(), n_groups=n_levels)
        if len(parts) == 1:
            return _hold_out(level)
    numbers, fold = groups[parts[0]], fold.copy()
    splitter = GroupKFold(min(_N_FOLDS, np.unique(numbers).size))
    for place, (_, test) in enumerate(splitter.split(numbers, groups=numbers)):
        fold[test] = place
    if len(parts) == 1:
        return _hold_out(fold)
    # Rows of the same run, or of the same level, are neither trained on nor tested.
    return [
        (
            np.flatnonzero((fold != place) & (level != part)),
            np.flatnonzero((fold == place) & (level == part)),
        )
        for place, part in np.unique(np.column_stack([fold, level]), axis=0)
    ]


def _hold_out(fold):
    return [(np.flatnonzero(fold != n), np.flatnonzero(fold == n)) for n in np.unique(fold)]


def _labels(log, part):
    if part != "level":
        return label_texts(log[part])
    levels = find_rate_levels(np.abs(log["rate"].to_numpy()))
    names = np.array([f"|{level:.4g}| °/s" for level in levels], dtype=object)
    return names[group_by_rate_level(log["rate"].to_numpy())]


def find_legs(temperature, run=None):
    """Number of each row's leg, from one turning point of the temperature to the next, by runs."""
    least = max(_TURN * float(np.ptp(temperature)), _SMALLEST_TURN)
    runs = np.zeros(temperature.size, dtype=int)
    if run is not None:
        runs = np.unique(run, return_inverse=True)[1]
    legs = np.empty(temperature.size, dtype=int)
    n_legs = 0
    for number in range(runs.max() + 1):
        rows = np.flatnonzero(runs == number)
        turns = _turns(temperature[rows], least)
        legs[rows] = n_legs + np.searchsorted(turns, np.arange(rows.size), side="right")
        n_legs += len(turns) + 1
    return legs


def _turns(temperature, least):
    """Rows at which the temperature turns, and comes back by ``least`` or more before the next."""
    width = -(-temperature.size // _MOST_POINTS)
    starts = np.arange(0, temperature.size, width)
    means = np.add.reduceat(temperature, starts) / np.diff(starts, append=temperature.size)
    turns, rising = [], 0
    low = high = 0  # places of the extremes since the last turn
    for place, value in enumerate(means.tolist()):
        low = place if value < means[low] else low
        high = place if value > means[high] else high
        if rising >= 0 and means[high] - value > least:
            # The first way may have begun before this turn.
            began = rising or (high > 0 and means[high] - means[:high].min() > least)
            turns += [high] if began else []
            rising, low = -1, place
        elif rising <= 0 and value - means[low] > least:
            began = rising or (low > 0 and means[:low].max() - means[low] > least)
            turns += [low] if began else []
            rising, high = 1, place
    return starts[np.array(turns, dtype=int)]


def cut_legs(legs):
    """Fold of each row: the pieces of every leg in turn, one leg's beside another's of the next.

    With a piece of a leg that warms goes one at another temperature of the next, which cools: the
    model has seen each temperature one way.
    """
    folds = np.empty(legs.size, dtype=int)
    for leg in np.unique(legs):
        rows = np.flatnonzero(legs == leg)
        folds[rows] = (np.arange(rows.size) * _N_FOLDS // rows.size + 2 * leg) % _N_FOLDS
    return folds


def _name_legs(legs, temperature):
    """A label for each row's leg, such as "2: 25 to 71 °C"."""
    names = np.empty(legs.max() + 1, dtype=object)
    for leg in np.unique(legs):
        values = temperature[legs == leg]
        names[leg] = f"{leg + 1}: {values[0]:.0f} to {values[-1]:.0f} °C"
    return names[legs]
