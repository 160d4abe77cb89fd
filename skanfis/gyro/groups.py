"""Groups of rows that a split must not tear apart: runs, devices, and levels of a rate table.

Integers, one per row: scikit-learn's splitters for groups take them. docs/gyro_splits.rst says why
levels must be held out.
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
    "find_rate_levels",
    "group_by_rate_level",
    "group_by_run",
]

# Relative to the largest rate: rates closer than that are one to any table.
_SMALLEST_TOLERANCE = 1e-4
# Gaps between levels are at least so many times those within a level.
_CLEAR_JUMP = 3.0
# Of the rows: so many may lie in clusters too wide for a level.
_SHARE_TOO_WIDE = 0.05
# Of the range: rates without a clear jump that reach so much of it are spread over it.
_SHARE_COVERED = 0.05
# A cluster of so few rows, relative to a typical level, is of a table on its way.
_FEW_ROWS = 0.1
# Rates of different runs meet by chance, however they are drawn.
_SHARE_BY_CHANCE = 0.1


def find_rate_levels(rate: ArrayLike, *, tolerance: float | None = None) -> np.ndarray:
    """Find the levels of a rate table in its log.

    Parameters
    ----------
    rate : array-like of shape (n_samples,)
        True rate, in any unit.
    tolerance : float, default=None
        Largest gap between neighbouring rates of one level, in the unit of ``rate``. Default: where
        the gaps, sorted, make their clearest jump; at least 1e-4 of the largest rate.

    Returns
    -------
    levels : ndarray of shape (n_levels,)
        Median rate of each level, ascending. Rows of a table on its way count to the nearest.

    Raises
    ------
    ValueError
        If the rate changes continuously, so that there are no levels, or has missing values.

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
        Number of groups, at least 2: levels are dealt out to them by turns, so that each has levels
        from the whole range. Default: a group for each level.
    signed : bool, default=False
        Whether a rate and its opposite are two levels.
    tolerance : float, default=None
        As for :func:`find_rate_levels`.

    Returns
    -------
    groups : ndarray of int of shape (n_samples,)
        Number of the group of each row, from 0; of the level without ``n_groups``.

    Raises
    ------
    ValueError
        If the rate has no levels, or fewer than ``n_groups``.

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
        Largest step of the time within a run. Default: any that does not go back.

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
        As for :func:`~sklearn.model_selection.cross_validate`.
    rate : array-like of shape (n_samples,)
        True rate, in any unit.
    y, groups : array-like of shape (n_samples,), default=None
        Classes and groups, for splitters that look at them.
    run : array-like of shape (n_samples,), default=None
        Number or name of the run of each row. Default: runs are not checked.
    tolerance : float, default=None
        As for :func:`find_rate_levels`. Two rates of one level are the same to a model.

    Returns
    -------
    report : DataFrame of shape (n_splits, 4) or (n_splits, 6)
        Per split ``n_train`` and ``n_test`` [rows]; ``shared_levels``, the number of rate levels in
        both parts, and ``on_shared_levels``, the share of the test rows at them; with ``run``,
        ``shared_runs`` and ``in_shared_runs`` likewise.

    Raises
    ------
    ValueError
        If the columns do not have the same number of rows, or have missing values.

    Warns
    -----
    SplitLeakWarning
        If some split has more than a tenth of its test rows at rate levels that are in its training
        rows too, or shares runs.

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
    labels = {"levels": _level_numbers(rate, tolerance)}
    if run is not None:
        labels["runs"] = pd.factorize(check_labels(run, "run", len(rate)))[0]
        if labels["runs"].min() < 0:
            missing = labels["runs"].argmin()
            raise ValueError(f"run has missing values, the first at row {missing}.")
    rows = []
    for train, test in check_cv(cv, y).split(np.zeros((len(rate), 1)), y, groups):
        row: dict[str, float] = {"n_train": len(train), "n_test": len(test)}
        for what, of_rows in labels.items():
            share = f"{'on' if what == 'levels' else 'in'}_shared_{what}"
            # A rate that changes continuously has no levels to share.
            known = [] if of_rows is None else of_rows[test][np.isin(of_rows[test], of_rows[train])]
            row |= {f"shared_{what}": len(np.unique(known)), share: len(known) / len(test)}
        rows.append(row)
    report = pd.DataFrame(rows)
    _warn(
        report["on_shared_levels"][report["on_shared_levels"] > _SHARE_BY_CHANCE],
        len(report),
        "test at rate levels that they train at",
        "A flexible model may memorise the levels, look good, and fail between them. Hold out "
        "levels: groups=group_by_rate_level(rate) with GroupKFold.",
    )
    if run is not None:
        _warn(
            report["in_shared_runs"][report["shared_runs"] > 0],
            len(report),
            "test on runs that they train on",
            "Rows of one run know each other's temperature and bias: the residual of a new run "
            "will be larger. Hold out runs: groups=run with GroupKFold.",
        )
    return report


def _warn(leaks, n_splits, what, why):
    if len(leaks):
        warnings.warn(
            f"{len(leaks)} of {n_splits} splits {what}, {leaks.max():.0%} of the test rows at "
            f"worst. {why}",
            SplitLeakWarning,
            stacklevel=3,
        )


def _level_numbers(rate, tolerance):
    """Number of each row's level, lowest first; None where the rate changes continuously."""
    values, inverse, n_rows = np.unique(rate, return_inverse=True, return_counts=True)
    gaps = np.diff(values)
    smallest = _SMALLEST_TOLERANCE * np.abs(values).max()
    if tolerance is None:
        tolerance = _clearest_tolerance(gaps, smallest)
    else:
        tolerance = check_number(tolerance, "tolerance")
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
    levels = centers[n_rows >= _FEW_ROWS * typical]
    is_spread = len(levels) * smallest > _SHARE_COVERED * (high[-1] - low[0]) > 0
    if tolerance == smallest and is_spread:
        return None
    # Each cluster to the nearest level, which is its own if it is one.
    return np.searchsorted(0.5 * (levels[1:] + levels[:-1]), centers)[clusters]


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
        "If a table went from level to level, leave out the rows in between, or give tolerance. "
        "If not, no level can be memorised: hold out runs or devices."
    )
