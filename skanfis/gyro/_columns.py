"""Columns as the functions of this subpackage take them: one-dimensional, finite, equally long."""

import numpy as np

__all__ = [
    "check_column",
    "check_labels",
    "check_weights",
    "column_position",
    "evenly_chosen",
    "label_texts",
]


def check_column(values, name, n_rows=None) -> np.ndarray:
    """Return ``values`` as a float array of shape (n_rows,), or raise ValueError that names it."""
    try:
        column = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must hold numbers: {error}.") from error
    _check_shape(column, name, n_rows)
    bad = ~np.isfinite(column)
    if bad.any():
        raise ValueError(
            f"{name} must be finite; {bad.sum()} of its {column.size} values are not, the first at "
            f"row {bad.argmax()}. Drop these rows in all columns."
        )
    return column


def check_labels(values, name, n_rows) -> np.ndarray:
    """Return labels, of any type, as an array of shape (n_rows,)."""
    labels = np.asarray(values)
    _check_shape(labels, name, n_rows)
    return labels


def check_weights(sample_weight, n_rows) -> np.ndarray:
    """Return weights of mean 1, shape (n_rows,): ones where ``sample_weight`` is None."""
    if sample_weight is None:
        return np.ones(n_rows)
    sample_weight = np.asarray(sample_weight)
    if sample_weight.ndim == 0:
        sample_weight = np.full(n_rows, sample_weight)
    weights = check_column(sample_weight, "sample_weight", n_rows)
    if weights.min() < 0 or weights.max() == 0:
        raise ValueError(
            "sample_weight must be zero or positive, and positive somewhere; found values from "
            f"{weights.min():g} to {weights.max():g}."
        )
    return weights / weights.mean()


def _check_shape(column, name, n_rows):
    if column.ndim != 1:
        raise ValueError(f"{name} must have one dimension; its shape is {column.shape}.")
    if column.size == 0:
        raise ValueError(f"{name} is empty.")
    if n_rows is not None and column.size != n_rows:
        raise ValueError(f"{name} has {column.size} rows where the other columns have {n_rows}.")


def column_position(names, role, given) -> int:
    """Position of the column that a parameter gives by position or name, or ValueError.

    ``names`` has an entry for every column of X: its name, or its position where it has none.
    """
    if isinstance(given, str):
        if given not in names:
            has_names = any(isinstance(name, str) for name in names)
            found = f"its columns are {names}" if has_names else "it has no column names"
            raise ValueError(f"X has no column {role}={given!r}: {found}.")
        return names.index(given)
    if not isinstance(given, int | np.integer) or isinstance(given, bool):
        raise ValueError(f"{role}={given!r} must be the position or the name of a column.")
    if not -len(names) <= given < len(names):
        raise ValueError(f"{role}={given} is no column of X, which has {len(names)} feature(s).")
    return int(given) % len(names)


def evenly_chosen(n_rows, most) -> np.ndarray:
    """Positions of some rows, the first and the last among them, at most so many."""
    return np.unique(np.linspace(0, n_rows - 1, min(n_rows, most)).astype(int))


def label_texts(labels) -> np.ndarray:
    """A Series of labels as texts: one for all rows of a label, not one for each."""
    own = labels.astype("category").cat
    return own.categories.astype(str).to_numpy(dtype=object)[own.codes.to_numpy()]
