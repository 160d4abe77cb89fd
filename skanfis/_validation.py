"""Checks on data that scikit-learn's own do not make, or not with the column's name."""

import numpy as np
from sklearn import get_config

__all__ = ["check_finite", "positive_weights"]

_READ_ROWS = 65_536


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
