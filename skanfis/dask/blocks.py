"""Dask collections as blocks of rows: what is checked before, and what when a block is there."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._validation import check_finite, positive_weights
from ..learning.data import Scale, StandardisedData, column_statistics
from ..naming import default_output_names
from .fusing import Unread, fused

__all__ = ["Blocks", "Layout", "Loaded", "describe", "is_collection", "joined_scales"]

# Exponents of two within which weights are taken as they are: their squares are finite.
_LARGEST_WEIGHT = 2.0**400


def is_collection(value):
    """Whether a value is a dask collection."""
    return hasattr(value, "__dask_graph__") and hasattr(value, "dask")


@dataclass(frozen=True)
class Layout:
    """What every block must look like; names are None where the collection has none."""

    n_inputs: int
    n_outputs: int
    is_single_output: bool
    given_input_names: tuple | None
    given_output_names: tuple | None

    @property
    def input_names(self):
        """Names of the inputs, "x0", "x1", ... where they have none."""
        return _strings(self.given_input_names) or tuple(f"x{j}" for j in range(self.n_inputs))

    @property
    def output_names(self):
        """Names of the outputs, "y" or "y0", "y1", ... where they have none."""
        if names := _strings(self.given_output_names):
            return names
        return default_output_names(self.n_outputs)


def _strings(names):
    """Names that are all text; else None."""
    is_text = names and all(isinstance(name, str) and name for name in names)
    return tuple(names) if is_text else None


@dataclass(frozen=True, eq=False)
class Loaded:
    """The rows of one block that have weight, in memory."""

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None
    groups: np.ndarray | None
    n_given: int

    def __sizeof__(self):
        """Bytes, as a scheduler asks that weighs the moving of rows against waiting for them."""
        arrays = self.X, self.y, self.sample_weight, self.groups
        return object.__sizeof__(self) + sum(one.nbytes for one in arrays if one is not None)

    def rows(self, inputs, targets):
        """The same on given scales."""
        return StandardisedData(self.X, self.y, self.sample_weight, inputs, targets, self.groups)


@dataclass(frozen=True, eq=False)
class Blocks:
    """Partitions of X, y, weights and groups, side by side, not computed."""

    # Of delayed X, y, sample_weight or None, groups or None; or of one alone: Unread, or a delayed
    # list of Loaded.
    pieces: list[tuple]
    layout: Layout

    @classmethod
    def of(cls, X, y, sample_weight=None, groups=None):
        """Blocks of collections; TypeError or ValueError where they cannot be laid side by side."""
        layout = _layout(X, y)
        first = _delayed(X, "X", None)
        pieces = [first]
        for what, one in (("y", y), ("sample_weight", sample_weight), ("groups", groups)):
            if one is None:
                pieces.append([None] * len(first))
                continue
            parts = _delayed(one, what, X)
            if len(parts) != len(first):
                raise ValueError(
                    f"{what} has {len(parts)} partitions, X has {len(first)}: they must be cut at "
                    "the same rows. Take them from one frame, use repartition, or compute the "
                    "sizes of unknown chunks (compute_chunk_sizes) so that they can be rechunked."
                )
            pieces.append(parts)
        return cls(fused(list(zip(*pieces, strict=True))), layout)

    def load(self, number, *parts):
        """One block, checked, or some; runs where the data are. ValueError names the partition."""
        if isinstance(parts[0], list):
            return parts[0]
        if isinstance(parts[0], Unread):
            parts = parts[0].read()
        try:
            return [_loaded(self.layout, *parts)]
        except (TypeError, ValueError) as error:
            raise type(error)(f"Partition {number}: {error}") from error

    def without_pieces(self):
        """What :meth:`load` needs, to be sent."""
        return replace(self, pieces=[])


def _layout(X, y):
    for what, one in (("X", X), ("y", y)):
        if not is_collection(one):
            raise TypeError(
                f"{what} is a {type(one).__name__}, but the other one is a dask collection: give "
                "both as dask arrays or DataFrames (dask.array.from_array, "
                "dask.dataframe.from_pandas)."
            )
    if X.ndim != 2:
        raise ValueError(f"X must have two dimensions, rows and columns; it has {X.ndim}.")
    if y.ndim not in (1, 2):
        raise ValueError(f"y must have one or two dimensions; it has {y.ndim}.")
    n_inputs, n_outputs = X.shape[1], 1 if y.ndim == 1 else y.shape[1]
    for what, count in (("X", n_inputs), ("y", n_outputs)):
        if not (isinstance(count, int | np.integer) and count > 0):
            raise ValueError(f"{what} has {count} columns: their number must be known, and not 0.")
    output_names = getattr(y, "columns", None)
    if output_names is None and getattr(y, "name", None) is not None and hasattr(y, "divisions"):
        output_names = [y.name]
    layout = Layout(int(n_inputs), int(n_outputs), y.ndim == 1, _names(X), _tuple(output_names))
    names = layout.given_input_names or ()
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"X has {names.count(twice[0])} columns of the name {twice[0]!r}.")
    return layout


def _names(table):
    return _tuple(getattr(table, "columns", None))


def _tuple(names):
    return None if names is None else tuple(names)


def _delayed(collection, what, like):
    """The partitions of a collection; chunks of an array are cut as those of ``like``."""
    if not is_collection(collection):
        raise TypeError(
            f"{what} is a {type(collection).__name__}, but X is a dask collection: give a dask "
            "array or Series."
        )
    if not hasattr(collection, "chunks"):
        # Simplified, so that files are read in the columns that are needed; but not optimised:
        # that joins small files into one partition, X's other ones than y's.
        return list(collection.simplify().to_delayed(optimize_graph=False))
    if collection.ndim == 2:
        collection = collection.rechunk({1: -1})
    chunks = None if like is None else getattr(like, "chunks", None)
    if chunks is not None and chunks[0] != collection.chunks[0]:
        sizes = (*chunks[0], *collection.chunks[0])
        if all(size == size for size in sizes):  # none is unknown, which is NaN
            if sum(chunks[0]) != sum(collection.chunks[0]):
                raise ValueError(
                    f"X has {sum(chunks[0]):,} rows and {what} {sum(collection.chunks[0]):,}."
                )
            collection = collection.rechunk({0: chunks[0]})
    return list(collection.to_delayed().ravel())


def _loaded(layout, X, y, sample_weight, groups):
    inputs = _numbers(X, "X", layout.given_input_names, layout.n_inputs, layout.input_names)
    names = layout.given_output_names if np.ndim(y) == 2 else None
    targets = _numbers(y, "y", names, layout.n_outputs, layout.output_names)
    weight = None
    if sample_weight is not None:
        weight = _numbers(sample_weight, "sample_weight", None, 1, ("sample_weight",))[:, 0]
    labels = None if groups is None else np.asarray(groups)
    if labels is not None and labels.ndim == 2 and labels.shape[1] == 1:
        labels = labels[:, 0]
    n_rows = inputs.shape[0]
    for what, one in (("y", targets), ("sample_weight", weight), ("groups", labels)):
        if one is not None and len(one) != n_rows:
            raise ValueError(
                f"X has {n_rows} rows and {what} {len(one)}: their partitions must be cut at the "
                "same rows."
            )
    if labels is not None and any(label is None or label != label for label in labels):
        raise ValueError("groups has no value for some rows: every row must belong to a group.")
    if weight is not None and (weight <= 0.0).any():
        kept = weight > 0.0
        if (weight < 0.0).any():
            positive_weights(weight, n_rows)  # says which
        inputs, targets, weight = inputs[kept], targets[kept], weight[kept]
        labels = None if labels is None else labels[kept]
    return Loaded(inputs, targets, weight, labels, n_rows)


def _numbers(table, what, names, n_columns, shown):
    """A partition as floats, (n_rows, n_columns); ValueError where it is none of these columns."""
    found = None if names is None or not hasattr(table, "columns") else tuple(table.columns)
    if found is not None and found != names:
        raise ValueError(
            f"{what} has the columns {', '.join(map(str, found))}; the collection says "
            f"{', '.join(map(str, names))}. Write all parts with the same columns in one order."
        )
    if not hasattr(table, "dtype") and not hasattr(table, "dtypes"):
        # Where its future is gone, dask may hand over a chunk's key in its place.
        raise RuntimeError(
            f"{what} is a {type(table).__name__} and no rows: the cluster that they lived on was "
            "closed. Load or persist them again with the client that is now open."
        )
    kinds = _kinds(table)
    for place, kind in enumerate(kinds):
        if kind not in "biuf":
            name = shown[place] if place < len(shown) else place
            dtype = table.dtypes.iloc[place] if hasattr(table, "columns") else table.dtype
            raise ValueError(
                f"{what} holds no real numbers in column {name!r} (dtype {dtype}): convert or drop "
                "it."
            )
    array = np.asarray(table, dtype=float)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2 or array.shape[1] != n_columns:
        raise ValueError(f"{what} has the shape {array.shape}; {n_columns} columns are expected.")
    return array


def _kinds(table):
    dtypes = list(table.dtypes) if hasattr(table, "columns") else [table.dtype]
    return ["f" if str(dtype) in ("Float64", "Float32") else dtype.kind for dtype in dtypes]


@dataclass(frozen=True, eq=False)
class Described:
    """What is known of some rows after one pass; the scales are None of no rows."""

    n_rows: int
    n_given: int
    weight: float
    largest_weight: float
    inputs: Scale | None
    targets: Scale | None


def describe(loaded: Loaded, layout: Layout) -> Described:
    """Count and measure a block; ValueError where it is not finite."""
    check_finite(loaded.X, "X", layout.input_names)
    check_finite(loaded.y, "y", layout.output_names)
    n_rows, weight = loaded.X.shape[0], loaded.sample_weight
    total, largest = float(n_rows), 1.0
    if weight is not None:
        check_finite(weight[:, None], "sample_weight", ("sample_weight",))
        total, largest = float(weight.sum()), float(weight.max(initial=0.0))
    if largest > _LARGEST_WEIGHT or (weight is not None and 0.0 < total < 1.0 / _LARGEST_WEIGHT):
        raise ValueError(f"sample_weight is as large as {largest:g}: give weights nearer to one.")
    if n_rows == 0:
        return Described(0, loaded.n_given, 0.0, 0.0, None, None)
    inputs, targets = (column_statistics(values, weight) for values in (loaded.X, loaded.y))
    return Described(n_rows, loaded.n_given, total, largest, inputs, targets)


def joined(one: Described, other: Described) -> Described:
    """Describe the rows of both."""
    if one.n_rows == 0 or other.n_rows == 0:
        known = other if one.n_rows == 0 else one
        return replace(known, n_given=one.n_given + other.n_given)
    weights = one.weight, other.weight
    return Described(
        one.n_rows + other.n_rows,
        one.n_given + other.n_given,
        sum(weights),
        max(one.largest_weight, other.largest_weight),
        joined_scales(one.inputs, other.inputs, *weights),
        joined_scales(one.targets, other.targets, *weights),
    )


def joined_scales(one: Any, other: Any, weight, other_weight) -> Scale:
    """The scale of the rows of both (Chan, Golub and LeVeque 1983), in parts of their range."""
    share = other_weight / (weight + other_weight)
    low, high = np.minimum(one.minimum, other.minimum), np.maximum(one.maximum, other.maximum)
    constant = low == high
    span = np.where(constant, 1.0, high - low)
    step = (other.offset - one.offset) / span
    square = (1.0 - share) * (_spread(one) / span) ** 2 + share * (_spread(other) / span) ** 2
    scale = span * np.sqrt(square + share * (1.0 - share) * step**2)
    return Scale(
        np.where(constant, low, one.offset + share * span * step),
        np.where(constant | (scale == 0.0), 1.0, scale),
        low,
        high,
    )


def _spread(scale):
    return np.where(scale.is_constant, 0.0, scale.scale)
