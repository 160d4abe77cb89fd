"""Groups of rows that a split must not tear apart: runs, devices, and levels of a rate table.

A rate table turns at a list of rates. A flexible model memorises the list: the output of the
gyro tells which level it is, and the level's exact rate is known from training. It fails at every
rate between the levels, and no split shows this that leaves each level in both of its parts. The
groups here are integers, one per row: GroupKFold, LeaveOneGroupOut, GroupShuffleSplit and
StratifiedGroupKFold of scikit-learn take them as they are.
"""

import warnings
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.model_selection import check_cv
from sklearn.utils import check_scalar

from ..exceptions import SplitLeakWarning
from ._columns import check_column, check_labels, check_number

__all__ = [
    "check_split",
    "combine_groups",
    "find_rate_levels",
    "group_by_rate_level",
    "group_by_run",
]

# Relative to the largest rate: rates closer than that are one to any table.
_SMALLEST_TOLERANCE = 1e-4
# Gaps between levels are at least so many times those within a level.
_CLEAR_JUMP = 3.0
# Rows in clusters too wide for a level that do not matter.
_SHARE_TOO_WIDE = 0.05
# Without a clear jump, rates that reach so much of the range, at the smallest tolerance, are spread
# over it.
_SHARE_COVERED = 0.05
# A cluster of so few rows, relative to a typical level, is of a table on its way.
_FEW_ROWS = 0.1
# Rates of different runs meet by chance, however they are drawn.
_SHARE_BY_CHANCE = 0.1


def find_rate_levels(rate: ArrayLike, *, tolerance: float | None = None) -> np.ndarray:
    """Find the levels of a rate table in its log.

    The rates are sorted; a gap wider than the tolerance separates two levels. Where there are far
    fewer rows than at a typical level, less than a tenth, the table was on its way: these rows are
    counted to the nearest level.

    Parameters
    ----------
    rate : array-like of shape (n_samples,)
        True rate, in any unit.
    tolerance : float, default=None
        Largest gap between neighbouring rates of one level, positive, in the unit of ``rate``.
        Default: found from the data, where the gaps, sorted, make their clearest jump (of 3 times
        or more); at least 1e-4 of the largest rate.

    Returns
    -------
    levels : ndarray of shape (n_levels,)
        Median rate of each level, ascending.

    Raises
    ------
    ValueError
        If the rate changes continuously, so that there are no levels: more than 5 % of the rows
        belong to a group that is wider than its distance to the next, or the gaps make no jump and
        the rates are spread over the range. Or if ``rate`` has missing values.

    See Also
    --------
    group_by_rate_level : The groups that belong to the levels.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import find_rate_levels
    >>> encoder = np.random.default_rng(0).normal(scale=0.01, size=400)
    >>> rate = np.tile([-50.0, -5.0, 0.0, 5.0, 50.0], 80) + encoder
    >>> abs(find_rate_levels(rate).round(2)).tolist()
    [50.0, 5.0, 0.0, 5.0, 50.0]
    """
    rate = check_column(rate, "rate")
    labels = _level_numbers(rate, tolerance)
    if labels is None:
        raise ValueError(_no_levels(rate))
    return pd.Series(rate).groupby(labels).median().to_numpy()


def group_by_rate_level(
    rate: ArrayLike,
    *,
    n_groups: int | None = None,
    signed: bool = False,
    tolerance: float | None = None,
) -> np.ndarray:
    """Groups that hold a level of the rate table together.

    Parameters
    ----------
    rate : array-like of shape (n_samples,)
        True rate, in any unit.
    n_groups : int, default=None
        Number of groups, at least 2: the levels, in ascending order, are dealt out to them by
        turns, so that each group has levels from the whole range. Default: a group for each level.
    signed : bool, default=False
        Whether a rate and its opposite are two levels. They are one by default: a gyro's errors are
        nearly symmetric, and who knows the one level knows much of the other.
    tolerance : float, default=None
        As for :func:`find_rate_levels`.

    Returns
    -------
    groups : ndarray of int of shape (n_samples,)
        Number of the group of each row, from 0; of the level (lowest rate first) without
        ``n_groups``.

    Raises
    ------
    ValueError
        If the rate has no levels, or fewer than ``n_groups``.

    Notes
    -----
    The group that holds the largest rate is an extrapolation to whoever is trained on the others:
    judge by the rows below it, or by what the model says of rows out of its bounds.

    Examples
    --------
    >>> from sklearn.model_selection import LeaveOneGroupOut
    >>> from skanfis.gyro import group_by_rate_level
    >>> rate = [-20.0, -10, 0, 10, 20, -20, -10, 0, 10, 20]
    >>> group_by_rate_level(rate).tolist()
    [2, 1, 0, 1, 2, 2, 1, 0, 1, 2]
    >>> group_by_rate_level(rate, n_groups=2).tolist()
    [0, 1, 0, 1, 0, 0, 1, 0, 1, 0]
    >>> LeaveOneGroupOut().get_n_splits(groups=group_by_rate_level(rate, signed=True))
    5
    """
    rate = check_column(rate, "rate")
    labels = _level_numbers(rate if signed else np.abs(rate), tolerance)
    if labels is None:
        raise ValueError(_no_levels(rate))
    if n_groups is None:
        return labels
    n_groups, n_levels = check_scalar(n_groups, "n_groups", int, min_val=2), labels.max() + 1
    if n_levels < n_groups:
        raise ValueError(f"n_groups={n_groups}: the rate has no more than {n_levels} levels.")
    return labels % n_groups


def group_by_run(time: ArrayLike, *, max_gap: float | None = None) -> np.ndarray:
    """Groups of rows from one power-on to the next, in a log that does not number them.

    Parameters
    ----------
    time : array-like of shape (n_samples,)
        Time in the order of the log, in any unit. Where it goes back, a run begins.
    max_gap : float, default=None
        Largest step of the time within a run, positive, in the unit of ``time``: a longer one is
        the time without power. Default: any step is within a run, unless it goes back.

    Returns
    -------
    groups : ndarray of int of shape (n_samples,)
        Number of the run of each row, from 0.

    Raises
    ------
    ValueError
        If ``time`` has missing values or ``max_gap`` is not positive.

    Examples
    --------
    >>> from skanfis.gyro import group_by_run
    >>> group_by_run([0.0, 10, 20, 0, 10, 500, 510], max_gap=60).tolist()
    [0, 0, 0, 1, 1, 2, 2]
    """
    steps = np.diff(check_column(time, "time"))
    begins = steps < 0
    if max_gap is not None:
        begins |= steps > check_number(max_gap, "max_gap")
    return np.concatenate([[0], np.cumsum(begins)])


def combine_groups(*labels: ArrayLike) -> np.ndarray:
    """Groups of the rows that agree in several labels, such as device and run.

    Parameters
    ----------
    *labels : array-like of shape (n_samples,)
        Labels of any type: runs that are numbered anew for each device, say, after the device.

    Returns
    -------
    groups : ndarray of int of shape (n_samples,)
        Number of the combination of each row, from 0, in the order of the labels.

    Raises
    ------
    ValueError
        If there are no labels, their lengths differ, or one is missing.

    Examples
    --------
    >>> from skanfis.gyro import combine_groups
    >>> device, run = ["a", "a", "a", "b", "b"], [1, 1, 2, 1, 2]
    >>> combine_groups(device, run).tolist()
    [0, 0, 1, 2, 3]
    """
    if not labels:
        raise ValueError("combine_groups needs one column of labels or more.")
    n_rows = len(np.asarray(labels[0]))
    table = pd.DataFrame(
        {place: check_labels(each, f"labels[{place}]", n_rows) for place, each in enumerate(labels)}
    )
    for place in table:
        if table[place].isna().any():
            row = int(table[place].isna().to_numpy().argmax())
            raise ValueError(f"labels[{place}] has missing values, the first at row {row}.")
    return table.groupby(list(table), observed=True).ngroup().to_numpy()


def check_split(
    cv: Any,
    rate: ArrayLike,
    *,
    y: ArrayLike | None = None,
    groups: ArrayLike | None = None,
    run: ArrayLike | None = None,
    tolerance: float | None = None,
) -> pd.DataFrame:
    """Check that a split does not test on what it was trained on, and warn if it does.

    Parameters
    ----------
    cv : int, cross-validation splitter or iterable
        What is given to :func:`~sklearn.model_selection.cross_validate` as ``cv``.
    rate : array-like of shape (n_samples,)
        True rate, in any unit.
    y : array-like of shape (n_samples,), default=None
        Classes, for splitters that look at them.
    groups : array-like of shape (n_samples,), default=None
        Groups, for splitters that need them.
    run : array-like of shape (n_samples,), default=None
        Number or name of the run of each row. Default: runs are not checked.
    tolerance : float, default=None
        As for :func:`find_rate_levels`. Two rates of one level are the same to a model.

    Returns
    -------
    report : DataFrame of shape (n_splits, 4) or (n_splits, 6)
        One row per split: ``n_train`` and ``n_test`` [rows], ``shared_levels``, the number of rate
        levels that are in both parts, and ``on_shared_levels``, the share of the test rows at them,
        0 to 1; with ``run``, ``shared_runs`` and ``in_shared_runs`` likewise. A rate that changes
        continuously has no levels to share.

    Raises
    ------
    ValueError
        If the columns do not have the same number of rows, or have missing values.

    Warns
    -----
    SplitLeakWarning
        If some split has more than a tenth of its test rows at rate levels that are in its training
        rows too (below that, rates of different runs meet by chance), or shares runs.

    Examples
    --------
    >>> import warnings
    >>> from sklearn.model_selection import GroupKFold, KFold
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import check_split, group_by_rate_level
    >>> data = make_ofog(n_devices=1, n_runs=4, n_rate_levels=21, random_state=0)
    >>> levels = group_by_rate_level(data["rate"])
    >>> check_split(GroupKFold(3), data["rate"], groups=levels)
       n_train  n_test  shared_levels  on_shared_levels
    0      ...
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     by_run = check_split(GroupKFold(4), data["rate"], groups=data["run"])
    >>> float(by_run["on_shared_levels"].min())
    1.0
    >>> print(caught[0].message)
    4 of 4 splits test at rate levels that they train at, ...
    """
    rate = check_column(rate, "rate")
    n_rows = len(rate)
    runs = None if run is None else combine_groups(check_labels(run, "run", n_rows))
    levels = _level_numbers(rate, tolerance)
    rows = []
    for train, test in check_cv(cv, y).split(np.zeros((n_rows, 1)), y, groups):
        row = {"n_train": len(train), "n_test": len(test)}
        row["shared_levels"], row["on_shared_levels"] = _shared(levels, train, test)
        if runs is not None:
            row["shared_runs"], row["in_shared_runs"] = _shared(runs, train, test)
        rows.append(row)
    report = pd.DataFrame(rows)
    _warn_of_levels(report)
    if runs is not None:
        _warn_of_runs(report)
    return report


def _level_numbers(rate, tolerance):
    """Number of each row's level, lowest first; None where the rate changes continuously."""
    values, inverse, n_rows = np.unique(rate, return_inverse=True, return_counts=True)
    gaps = np.diff(values)
    smallest = _SMALLEST_TOLERANCE * np.abs(values).max()
    if tolerance is None:
        tolerance = _clearest_tolerance(gaps, smallest)
    else:
        tolerance = check_number(tolerance, "tolerance")
    is_new = np.concatenate([[True], gaps > tolerance])
    clusters, first = np.cumsum(is_new) - 1, np.flatnonzero(is_new)
    n_rows = np.add.reduceat(n_rows, first)
    low, high = values[first], values[np.append(first[1:], len(values)) - 1]
    if np.sum(n_rows[_are_wide(low, high, tolerance)]) > _SHARE_TOO_WIDE * len(rate):
        return None
    centers = 0.5 * (low + high)
    levels = centers[_have_rows(n_rows)]
    is_spread = len(levels) * smallest > _SHARE_COVERED * (high[-1] - low[0]) > 0
    if tolerance == smallest and is_spread:
        return None
    # Each cluster to the nearest level, which is its own if it is one.
    return np.searchsorted(0.5 * (levels[1:] + levels[:-1]), centers)[clusters[inverse]]


def _are_wide(low, high, tolerance):
    """Clusters that are wider than they are far from the next: no levels."""
    if len(low) == 1:  # nothing is next
        return high - low > np.maximum(0.01 * np.abs(high), 10.0 * tolerance)
    between = np.concatenate([[np.inf], low[1:] - high[:-1], [np.inf]])
    return high - low > np.minimum(between[:-1], between[1:])


def _have_rows(n_rows):
    """Clusters that have as many rows as befits a level."""
    others = np.sort(n_rows)[:-1]  # a gyro may rest for most of the log
    typical = np.median(np.repeat(others, others)) if others.size else 0
    return n_rows >= _FEW_ROWS * typical


def _clearest_tolerance(gaps, smallest):
    """Gap that tells levels apart, from the gaps between all different rates."""
    wide = np.sort(np.append(gaps[gaps > smallest], smallest))
    if len(wide) == 1:
        return smallest
    jumps = wide[1:] / wide[:-1]
    place = jumps.argmax()
    return np.sqrt(wide[place] * wide[place + 1]) if jumps[place] >= _CLEAR_JUMP else smallest


def _no_levels(rate):
    return (
        f"rate has no levels: it changes continuously between {rate.min():g} and {rate.max():g}. "
        "If a table went from level to level, remove its way (clip_dwells), or give tolerance. If "
        "not, no level can be memorised: hold out runs or devices."
    )


def _shared(labels, train, test):
    """Number of labels in both parts, and share of the test rows that have them."""
    if labels is None:
        return 0, 0.0
    is_known = np.isin(labels[test], labels[train])
    return len(np.unique(labels[test][is_known])), float(np.mean(is_known))


def _warn_of_levels(report):
    share = report["on_shared_levels"]
    leaks = share > _SHARE_BY_CHANCE
    if leaks.any():
        warnings.warn(
            f"{leaks.sum()} of {len(report)} splits test at rate levels that they train at, "
            f"{share.max():.0%} of the test rows at worst. A flexible model may memorise the "
            "levels, look good, and fail between them. Hold out levels: "
            "groups=group_by_rate_level(rate) with GroupKFold.",
            SplitLeakWarning,
            stacklevel=3,
        )


def _warn_of_runs(report):
    leaks = report["shared_runs"] > 0
    if leaks.any():
        warnings.warn(
            f"{leaks.sum()} of {len(report)} splits test on runs that they train on, "
            f"{report['in_shared_runs'].max():.0%} of the test rows at worst. Rows of one run know "
            "each other's temperature and bias: the residual of a new run will be larger. Hold out "
            "runs: groups=run with GroupKFold.",
            SplitLeakWarning,
            stacklevel=3,
        )
