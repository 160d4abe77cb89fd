"""Checks on data that scikit-learn's own do not make, or not with the column's name."""

import sys
import warnings
from numbers import Integral

import numpy as np
from sklearn import get_config

__all__ = [
    "bearable_weights",
    "check_finite",
    "feature_indices",
    "positive_weights",
    "warn_user",
]

_READ_ROWS = 65_536
# Exponent of two up to which weights are taken as they are.
_FAR = 400


def check_finite(values, what, names):
    """Raise ValueError that names the column where ``values`` (n_rows, n_columns) is not finite.

    The sum tells in one pass, without a temporary array; only where it is not finite, a second
    pass looks for the place. ``sklearn.config_context(assume_finite=True)`` switches it off.
    """
    if get_config()["assume_finite"]:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(np.sum(values)):
            return
    for start in range(0, values.shape[0], _READ_ROWS):
        bad = ~np.isfinite(values[start : start + _READ_ROWS])
        if bad.any():
            row, column = np.argwhere(bad)[0]
            value = values[start + row, column]
            kind = "NaN" if np.isnan(value) else "infinity"
            n_bad = int(np.count_nonzero(~np.isfinite(values[:, column])))
            raise ValueError(
                f"Input {what} contains {kind} in column {names[column]!r}, first at row "
                f"{start + row}; {n_bad} of its {values.shape[0]} values are not finite. Drop "
                "these rows, or impute them in a Pipeline before (sklearn.impute)."
            )


def feature_indices(given, names, parameter):
    """Columns that a parameter names, in order: all of None, or by name, position or mask.

    ValueError where it names none, one twice, or one that is not there.
    """
    if given is None:
        return np.arange(len(names))
    entries = np.atleast_1d(np.asarray(given, dtype=object)).tolist()
    if entries and all(isinstance(entry, bool | np.bool_) for entry in entries):
        if len(entries) != len(names):
            raise ValueError(
                f"{parameter} is a mask of {len(entries)} entries, but X has {len(names)} columns."
            )
        found = list(np.flatnonzero(entries))
    else:
        found = [_feature_index(entry, names, parameter) for entry in entries]
    if not found:
        raise ValueError(
            f"{parameter}={given!r} names no column: leave it at None for all of them."
        )
    if len(set(found)) < len(found):
        raise ValueError(f"{parameter}={given!r} names a column twice.")
    return np.sort(found)


def _feature_index(entry, names, parameter):
    if isinstance(entry, str) and entry in names:
        return list(names).index(entry)
    if isinstance(entry, Integral) and -len(names) <= int(entry) < len(names):
        return int(entry) % len(names)
    raise ValueError(
        f"{parameter} names {entry!r}, which is no column of X; its columns are "
        f"{', '.join(map(repr, names))}, at positions 0 to {len(names) - 1}."
    )


def positive_weights(sample_weight, n_rows):
    """Which rows have weight: a mask, or None where all have.

    ValueError where a weight is negative, or where fewer than two rows are left.
    """
    if np.any(sample_weight < 0):
        row = int(np.argmax(sample_weight < 0))
        raise ValueError(
            f"Negative values in sample_weight: {sample_weight[row]:g} at row {row}; weights must "
            "be zero or positive."
        )
    keep = sample_weight > 0
    n_kept = int(np.count_nonzero(keep))
    if n_kept < 2:
        raise ValueError(
            f"sample_weight leaves {n_kept} of {n_rows} rows with a positive weight; at least 2 "
            "are needed."
        )
    return None if n_kept == n_rows else keep


def bearable_weights(sample_weight):
    """Weights by a power of two where their sum would overflow, or their digits be lost."""
    exponent = int(np.frexp(np.max(sample_weight, initial=0.0))[1])
    return np.ldexp(sample_weight, -exponent) if abs(exponent) > _FAR else sample_weight


def warn_user(message, category):
    """Warn at the line that called this package, or scikit-learn, whatever lies between."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals["__name__"].partition(".")[0] in (
        "skanfis",
        "sklearn",
    ):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)
