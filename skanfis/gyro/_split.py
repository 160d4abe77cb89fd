"""Which rows to hold out: whole devices or runs, rate levels that could be learnt, or legs."""

from dataclasses import dataclass

import numpy as np
from sklearn.model_selection import GroupKFold

from ._columns import label_texts
from ._legs import cut_legs, find_legs, name_legs
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
    numbers = {name: _numbers(log, name) for name in ("device", "run")}
    levels = _levels(log) if uses_output else None
    legs = _legs(log)
    if kind == "auto":
        kind, reason = _choose(numbers, levels, legs, "time" in log)
    else:
        reason = "as asked for"
    parts = kind.split("+")
    available = numbers | {"level": levels, "leg": legs, "piece": legs}
    for part in parts:
        _check(part, available[part])
    if parts[-1] in ("leg", "piece"):
        return _by_leg(log, parts[-1], legs, reason)
    folds = _folds(log, parts, available)
    labels = _labels(log, parts[0])
    held_out = " and ".join(
        f"whole {part}s" if part != "level" else "rate levels" for part in parts
    )
    counts = ", ".join(
        f"{np.unique(available[part]).size} {'levels' if part == 'level' else part + 's'}"
        for part in parts
    )
    sentence = f"{held_out} held out ({counts}, {len(folds)} folds; {reason})"
    return Split(kind, folds, labels, sentence)


def _by_leg(log, kind, legs, reason):
    """Legs in turn, or pieces of them where each direction was gone but once."""
    n_legs = np.unique(legs).size
    if kind == "leg":
        n_folds = min(_N_FOLDS, n_legs)
        folds = _hold_out(legs % n_folds)
        what = f"whole legs between turning points of the temperature held out ({n_legs} legs"
    else:
        folds = _hold_out(cut_legs(legs))
        what = (
            "pieces of the legs between turning points of the temperature held out "
            f"({n_legs} legs, {len(folds)} pieces of each"
        )
        reason += "; whether a cycle repeats, so few cannot show"
    sentence = f"{what}, {len(folds)} folds; {reason})"
    return Split(kind, folds, name_legs(legs, log["temperature"].to_numpy()), sentence)


def _choose(numbers, levels, legs, has_time):
    """The kind of split that a log calls for, and why."""
    whole = next((name for name, groups in numbers.items() if _is_enough(name, groups)), None)
    few = _is_enough("level", levels) and np.unique(levels).size <= _MOST_LEVELS
    if whole is None:
        if _is_enough("level", levels):
            return "level", "too few runs to hold out"
        for kind in ("leg", "piece"):
            if _is_enough(kind, legs):
                return kind, "too few runs to hold out"
        raise LogError(_nothing_to_hold_out(numbers, levels, has_time))
    if few and _share_levels(numbers[whole], levels):
        return f"{whole}+level", f"the {whole}s share rate levels, which could be memorised"
    return whole, f"rows of one {whole} are alike"


def _is_enough(name, groups):
    return groups is not None and np.unique(groups).size >= _FEWEST[name]


def _check(part, groups):
    if groups is None:
        what = {"level": "rate levels", "leg": "temperature", "piece": "temperature"}.get(
            part, f"column for the {part}"
        )
        raise LogError(f"cannot hold out by {part}: the log has no {what}.")
    if not _is_enough(part, groups):
        raise LogError(
            f"cannot hold out by {part}: the log has {np.unique(groups).size} "
            f"{'leg' if part == 'piece' else part}(s), and at "
            f"least {_FEWEST[part]} are needed."
        )


def _nothing_to_hold_out(numbers, levels, has_time):
    found = [
        f"{np.unique(groups).size} {name}(s)"
        for name, groups in numbers.items()
        if groups is not None
    ]
    found.append(f"{0 if levels is None else np.unique(levels).size} rate levels")
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


def _numbers(log, name):
    if name not in log:
        return None
    labels = log[name].astype("category").cat
    # By their names, as text: numbers of the categories alone depend on the order of the files.
    places = np.unique(labels.categories.astype(str), return_inverse=True)[1]
    return np.unique(places[labels.codes.to_numpy()], return_inverse=True)[1]


def _levels(log):
    """Number of each row's level of |rate|; None where the rate changes continuously."""
    try:
        levels = group_by_rate_level(log["rate"].to_numpy())
    except ValueError:
        return None
    # A level for nearly every row is none: holding it out would hold out single rows.
    return levels if np.unique(levels).size * _ROWS_PER_LEVEL <= levels.size else None


def _legs(log):
    """Number of each row's leg of the temperature; None where there is no temperature."""
    if "temperature" not in log:
        return None
    return find_legs(log["temperature"].to_numpy(), log.get("run"))


def _share_levels(groups, levels):
    """Whether more than a tenth of the levels, on average, are met by two groups or more."""
    pairs = np.unique(np.column_stack([levels, groups]), axis=0)
    return bool(np.mean(np.bincount(pairs[:, 0])[np.unique(levels)] > 1) > _SHARED)


def _folds(log, parts, available):
    level_rows = None
    if parts[-1] == "level":
        n_levels = _N_LEVEL_FOLDS_BESIDE if len(parts) > 1 else _N_FOLDS
        level_rows = group_by_rate_level(log["rate"].to_numpy(), n_groups=n_levels)
        if len(parts) == 1:
            return _hold_out(level_rows)
    groups = available[parts[0]]
    n_folds = min(_N_FOLDS, np.unique(groups).size)
    number = np.empty(len(log), dtype=int)
    for fold, (_, test) in enumerate(GroupKFold(n_folds).split(groups, groups=groups)):
        number[test] = fold
    if level_rows is None:
        return _hold_out(number)
    return [
        (
            np.flatnonzero((number != fold) & (level_rows != level)),
            np.flatnonzero((number == fold) & (level_rows == level)),
        )
        for fold in range(n_folds)
        for level in np.unique(level_rows)
        if np.any((number == fold) & (level_rows == level))
    ]


def _hold_out(number):
    return [(np.flatnonzero(number != n), np.flatnonzero(number == n)) for n in np.unique(number)]


def _labels(log, part):
    if part != "level":
        return label_texts(log[part])
    sizes = np.abs(log["rate"].to_numpy())
    levels = find_rate_levels(sizes)
    names = np.array([f"|{level:.4g}| °/s" for level in levels], dtype=object)
    return names[group_by_rate_level(log["rate"].to_numpy())]
