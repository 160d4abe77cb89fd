"""Checks of data and parameters, beside scikit-learn's own; their messages name the column."""

import sys
import warnings
from collections import Counter
from collections.abc import Mapping
from contextlib import contextmanager
from datetime import date, time, timedelta
from numbers import Integral, Real

import numpy as np
from scipy.sparse import issparse
from sklearn import get_config
from sklearn.utils import check_array

from .blocks import LARGE_BLOCK_ROWS, row_blocks

# Weights are rescaled only beyond this exponent of two: below it, sums of products of two weights
# stay below 2^1023, for any possible number of rows.
_LARGEST_EXPONENT = 400
# This package, and what may stand between it and the user's line.
_PACKAGES = (__name__.split(".")[0], "sklearn", "joblib")
_SECONDS = "Give the time since some moment, such as the power-on, as a number of seconds."
_IMPUTE = "Drop these rows, or impute them in a Pipeline before (sklearn.impute)."


@contextmanager
def unchanged_by_failure(estimator):
    """Restore an estimator to its state before, if learning fails or is interrupted."""
    before = estimator.__dict__.copy()
    try:
        yield
    except BaseException:
        estimator.__dict__ = before
        raise


@contextmanager
def named_refusals(*, takes_categories=False, **tables):
    """Let scikit-learn check tables, given by their roles X=..., y=..., but name what is wrong.

    Text, times, sparse or lazy frames, masked values and duplicate column names are refused with
    the column's name; in X numeric categories, too.
    """
    refuse_lazy(**tables)
    for what, table in tables.items():
        _check_kind(table, what, takes_categories or what != "X")
    try:
        yield
    except (TypeError, ValueError, OverflowError) as error:
        for what, table in tables.items():
            _name_what_is_no_number(table, what, error)
        raise


def refuse_lazy(**tables):
    """Raise TypeError if one of the tables, given by their roles, is lazy: it has no values yet."""
    for what, table in tables.items():
        if type(table).__name__ == "LazyFrame":
            raise TypeError(
                f"{what} is a lazy frame, which has no values yet: give {what}.collect()."
            )
        # xarray's, whether lazy or not, all have the method.
        if getattr(table, "__dask_graph__", lambda: None)() is not None:
            raise TypeError(
                f"{what} is a dask collection, which has no values yet: give {what}.compute(). "
                "Only the fit, predict and score of skanfis.dask.DaskANFISRegressor take it as it "
                "is."
            )


def as_frame(table):
    """A table of pyarrow, whose columns have neither names nor dtypes, as one of pandas."""
    return table.to_pandas() if type(table).__module__.startswith("pyarrow") else table


def as_numbers(table, what="X", *, takes_categories=True, floats="d"):
    """Return a table as floats, missing values as NaN; other entries are refused by column."""
    if type(table) is np.ndarray and table.dtype in list(floats) and table.ndim < 3:
        return table
    table = as_frame(table)
    any_form = {"ensure_all_finite": False, "ensure_2d": False, "ensure_min_samples": 0}
    with named_refusals(takes_categories=takes_categories, **{what: table}):
        return check_array(table, dtype=list(floats), input_name=what, **any_form)


def rows_by_name(X, names):
    """Return the named columns of a table as an array; ValueError if one is missing.

    If no column has a str as its name, all are taken in their order.
    """
    refuse_lazy(X=X)
    X = as_frame(X)
    is_named = any(isinstance(name, str) for name in getattr(X, "columns", ()))
    lacking = [name for name in names if is_named and name not in X.columns]
    if not lacking:
        X = as_numbers(X[list(names)] if is_named else X, floats="df")
    if lacking or X.shape[1:] != (len(names),):
        what = f"lacks the column {lacking[0]!r}" if lacking else f"has the shape {X.shape}"
        raise ValueError(f"X {what}: the model takes {', '.join(map(repr, names))}.")
    return X


def _check_kind(table, what, takes_categories):
    """Refuse sparse or masked tables, duplicate column names, times, and numeric categories."""
    is_frame = hasattr(table, "columns") and hasattr(table, "dtypes")
    names = list(table.columns) if is_frame else [getattr(table, "name", None)]
    dtypes = list(table.dtypes) if is_frame else [getattr(table, "dtype", None)]
    if is_frame and not names:
        raise ValueError(f"{what} has no columns: give a table with at least one.")
    is_sparse_frame = is_frame and all(hasattr(one, "fill_value") for one in dtypes)
    if issparse(table) or is_sparse_frame:
        dense = f"{what}.sparse.to_dense()" if is_frame else f"{what}.toarray()"
        raise TypeError(
            f"Sparse data was passed for {what}, but dense data is required: give {dense}. In a "
            "Pipeline, OneHotEncoder(sparse_output=False) and ColumnTransformer(..., "
            "sparse_threshold=0) hand on dense data."
        )
    if np.ma.is_masked(table):
        masked = np.ma.getmaskarray(table).reshape(len(table), -1).any(axis=1)
        raise ValueError(
            f"{what} is a masked array with masked values in {np.count_nonzero(masked)} of "
            f"{masked.size} rows, first at row {masked.argmax()}: drop these rows"
            + (", or impute X.filled(numpy.nan) in a Pipeline." if what == "X" else ".")
        )
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        raise ValueError(
            f"{what} has {count} columns of the name {name!r}: rename or drop all but one."
        )
    for name, dtype in zip(names, dtypes, strict=True):
        categories = getattr(getattr(dtype, "categories", None), "dtype", None)
        if not takes_categories and getattr(categories, "kind", "O") in "iuf":
            raise ValueError(
                f"Column {name!r} of X is a category of numbers: encode it, as by OneHotEncoder in "
                f"a ColumnTransformer, or take its numbers, X[{name!r}].astype(float)."
            )
        dtype = dtype if categories is None else categories
        # In this order: times of polars, times of NumPy and pandas, periods of pandas.
        is_temporal = getattr(dtype, "is_temporal", lambda: False)()
        if is_temporal or getattr(dtype, "kind", "") in ("m", "M") or hasattr(dtype, "freq"):
            column = "" if name is None else f" in column {name!r}"
            raise ValueError(f"Input {what} holds times{column} ({dtype}), not numbers. {_SECONDS}")


def _name_what_is_no_number(table, what, error):
    """Raise ``error`` again, naming the first column and row that float() refuses, if any."""
    found = [(name, *place) for name, column in _columns(table) for place in _refused(column)]
    if not found:
        return
    name, row, value, refusal = found[0]
    kind = "text" if isinstance(value, str) else f"values of type {type(value).__name__}"
    where = "" if name is None else f" in column {name!r}"
    more = ", ".join(repr(other) for other, *_ in found[1:])
    also = f" So do the columns {more}." if more else ""
    if not hasattr(value, "__len__") and is_missing(value):
        kind, advice = "a missing value", _IMPUTE if what == "X" else "Drop these rows."
    elif isinstance(value, date | time | timedelta):
        advice = _SECONDS
    elif what != "X":
        advice = f"A {'target' if what == 'y' else 'weight'} must be a number."
    elif name is None:
        advice = (
            "X must be a table, with a number for every column in every row: pandas.DataFrame(X) "
            "makes one of a dict or of named fields."
        )
    else:
        advice = (
            "Correct the value, drop the column, or encode categories as numbers in a Pipeline "
            "before: OneHotEncoder(drop='if_binary', sparse_output=False) of sklearn.preprocessing."
        )
    raise (TypeError if isinstance(refusal, TypeError) else ValueError)(
        f"Input {what} holds {kind}{where}, first at row {row}: {refusal}.{also} {advice}"
    ) from error


def _refused(column):
    """Yield row, value and error of the first entry that is no number, if there is one."""
    if getattr(getattr(column, "dtype", None), "kind", "O") in "biufc":
        return
    for row, value in enumerate(column):
        try:
            # scikit-learn refuses complex numbers itself.
            float(np.nan if value is None or isinstance(value, complex) else value)
        except (TypeError, ValueError, OverflowError) as refusal:
            yield row, value, refusal
            return


def _columns(table):
    """Names and columns of a frame or array of any content; a plain vector has the name None."""
    if hasattr(table, "columns"):
        return [(name, table[name]) for name in table.columns]
    try:
        array = np.asarray(table, dtype=object)
    except ValueError:
        return []
    if array.ndim < 2:
        return [(getattr(table, "name", None), np.atleast_1d(array))]
    return [(f"x{j}", array[:, j]) for j in range(array.shape[1])] if array.ndim == 2 else []


def group_numbers(groups, n_rows):
    """The rows' groups as numbers; ValueError if one is missing, or text and numbers are mixed."""
    if np.ma.is_masked(groups):
        groups = np.where(np.ma.getmaskarray(groups), None, groups)
    groups = np.asarray(groups, dtype=object) if isinstance(groups, list) else np.asarray(groups)
    if groups.ndim == 2 and groups.shape[1] == 1:
        groups = groups.ravel()
    if groups.ndim != 1:
        raise ValueError(
            f"groups must have one entry per row; it has the shape {groups.shape}. Give each row "
            "one label; make one of several, such as 'device 1, run 2'."
        )
    if len(groups) != n_rows:
        raise ValueError(
            f"groups must have one entry per row; X has the length {n_rows}, groups {len(groups)}: "
            "give every row its label."
        )
    missing = [i for i, group in enumerate(groups) if is_missing(group)]
    if missing:
        raise ValueError(
            f"groups has no value for {len(missing)} of {len(groups)} rows, first at row "
            f"{missing[0]}: every row must belong to a group."
        )
    try:
        return np.unique(groups, return_inverse=True)[1]
    except TypeError as error:
        kinds = sorted({type(group).__name__ for group in groups})
        raise ValueError(
            f"groups holds {' and '.join(kinds)}, which cannot be put in order: give numbers "
            "alone or text alone."
        ) from error


def is_missing(label):
    """Whether a label is None, NaN, NaT or pandas.NA."""
    try:
        return label is None or bool(label != label)
    except TypeError:  # pandas.NA is neither equal to itself nor not
        return True


def check_finite(values, what, names):
    """Raise ValueError, with the column's name, if ``values`` (n_rows, n_columns) are not finite.

    A finite sum proves all values finite in one pass, without a temporary array. Only otherwise a
    second pass finds the place. ``sklearn.config_context(assume_finite=True)`` skips the check.
    """
    if get_config()["assume_finite"]:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(np.sum(values)):
            return
    for part in row_blocks(values.shape[0], LARGE_BLOCK_ROWS):
        bad = ~np.isfinite(values[part])
        if bad.any():
            row, column = np.argwhere(bad)[0]
            value = values[part.start + row, column]
            kind = "NaN" if np.isnan(value) else "infinity"
            n_bad = int(np.count_nonzero(~np.isfinite(values[:, column])))
            advice = _IMPUTE if what == "X" else "Drop these rows."
            raise ValueError(
                f"Input {what} contains {kind} in column {names[column]!r}, first at row "
                f"{part.start + row}; {n_bad} of its {values.shape[0]} values are not finite. "
                f"{advice}"
            )


def in_column_order(given, names, parameter):
    """A pandas Series or frame labelled by all columns, in their order; all else as it is given."""
    is_labelled = hasattr(given, "keys") and not isinstance(given, Mapping)
    labels = list(given.keys()) if is_labelled else []
    if len(labels) != len(names) or not all(isinstance(label, str) for label in labels):
        return given
    feature_indices(labels, names, parameter)  # every label must be a column
    return given[list(names)]


def feature_indices(given, names, parameter):
    """Sorted positions of the columns given by name, position or mask; None is all columns.

    ValueError if no column is given, one is given twice, or one does not exist.
    """
    if given is None:
        return np.arange(len(names))
    entries = np.atleast_1d(np.asarray(given, dtype=object)).tolist()
    if entries and all(isinstance(entry, bool | np.bool_) for entry in entries):
        entries = np.asarray(in_column_order(given, names, parameter)).tolist()
        if len(entries) != len(names):
            raise ValueError(
                f"{parameter} is a mask of the length {len(entries)}: give one entry for each "
                f"column of X, {len(names)} in all."
            )
        entries = np.flatnonzero(entries).tolist()
    found = [position_of(entry, names) for entry in entries]
    if None in found:
        advice = ""
        if list(names) == [f"x{j}" for j in range(len(names))]:
            advice = (
                " X came without names: give a frame; a step in front hands names on with "
                "set_output(transform='pandas')."
            )
        raise ValueError(
            f"{parameter} names {entries[found.index(None)]!r}, which is no column of X; its "
            f"columns are {', '.join(map(repr, names))}, at positions 0 to {len(names) - 1}."
            + advice
        )
    if not found:
        raise ValueError(
            f"{parameter}={given!r} names no column: leave it at None for all of them."
        )
    if len(set(found)) < len(found):
        raise ValueError(f"{parameter}={given!r} names a column twice.")
    return np.sort(found)


def position_of(entry, names):
    """Position of an entry given by name or position, -1 for the last; None if there is none."""
    if isinstance(entry, str) and entry in names:
        return list(names).index(entry)
    if isinstance(entry, Integral) and -len(names) <= int(entry) < len(names):
        return int(entry) % len(names)
    return None


def checked_position(feature, names, what="input"):
    """Position of an input or output given by name or position; ValueError if there is none."""
    found = position_of(feature, names)
    if found is None:
        raise ValueError(
            f"{feature!r} is no {what}: give a position from 0 to {len(names) - 1}, or one of "
            f"{', '.join(map(repr, names))}."
        )
    return found


def row_weights(given, n_rows):
    """One weight per row as floats, or ValueError; a number is the weight of every row."""
    is_one = isinstance(given, Real)
    weights = np.full(n_rows, float(given)) if is_one else as_numbers(given, "sample_weight")
    if weights.shape != (n_rows,):
        raise ValueError(
            f"sample_weight must have one entry per row; X has the length {n_rows}, sample_weight "
            f"the shape {weights.shape}: give every row its weight."
        )
    check_finite(weights[:, None], "sample_weight", ["sample_weight"])
    return weights


def positive_weights(sample_weight, n_rows, least=2):
    """Mask of the rows with positive weight, or None if all rows have it.

    ValueError if a weight is negative, or if fewer than ``least`` rows are left.
    """
    if np.any(sample_weight < 0):
        row = int(np.argmax(sample_weight < 0))
        raise ValueError(
            f"Negative values in sample_weight: {sample_weight[row]:g} at row {row}; weights must "
            "be zero or positive."
        )
    keep = sample_weight > 0
    n_kept = int(np.count_nonzero(keep))
    if n_kept < least:
        raise ValueError(
            f"sample_weight leaves {n_kept} of {n_rows} rows with a positive weight, but a "
            f"row of weight zero is none: give at least {least} a positive weight."
        )
    return None if n_kept == n_rows else keep


def bearable_weights(sample_weight):
    """The weights, scaled by a power of two if sums would overflow or lose digits."""
    exponent = int(np.frexp(np.max(sample_weight, initial=0.0))[1])
    return (
        np.ldexp(sample_weight, -exponent) if abs(exponent) > _LARGEST_EXPONENT else sample_weight
    )


def warn_user(message, category):
    """Warn at the user's line: the first outside this package and those that call it."""
    frame, level = sys._getframe(1), 2
    while frame.f_globals.get("__name__", "").split(".")[0] in _PACKAGES and frame.f_back:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


def check_choice(parameter, value, choices):
    """Raise ValueError if ``value`` is not one of ``choices``."""
    if not isinstance(value, str) or value not in choices:
        raise ValueError(f"{parameter}={value!r} must be one of {', '.join(map(repr, choices))}.")


def check_count(parameter, value, smallest, largest=None):
    """Raise ValueError if ``value`` is not a whole number within its limits."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not is_whole or value < smallest or (largest is not None and value > largest):
        limits = f"from {smallest} to {largest}" if largest else f"of {smallest} or more"
        raise ValueError(f"{parameter}={value!r} must be a whole number {limits}.")
