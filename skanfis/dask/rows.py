"""Rows on a cluster: collections as partitions side by side, and passes as reductions over them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import methodcaller
from typing import Any

import numpy as np

from .._validation import as_numbers, check_finite, is_missing, positive_weights
from ..blocks import add_each
from ..bounds.constraints import Constraints
from ..learning.data import Scale, StandardisedData, check_scales, column_statistics
from ..naming import default_output_names
from ..training.chunks import joined_scales

# Results that one task adds: with fewer there are more tasks, with more it holds more at once.
_FAN_IN = 8
# Weights up to this have finite squares, and so have their inverses.
_LARGEST_WEIGHT = 2.0**400


def is_collection(value):
    """Whether a value is a dask collection."""
    return hasattr(value, "__dask_graph__") and hasattr(value, "dask")


@dataclass(frozen=True)
class Layout:
    """Shape and names that every partition must have; names are None if there are none."""

    n_inputs: int
    n_outputs: int
    given_input_names: tuple | None
    given_output_names: tuple | None

    @classmethod
    def of(cls, X, y):
        """The layout of collections; TypeError or ValueError if they cannot be trained on."""
        for what, one, dimensions in (("X", X, (2,)), ("y", y, (1, 2))):
            if not is_collection(one):
                raise TypeError(
                    f"{what} is a {type(one).__name__}, but other data are dask collections: give "
                    "X and y as dask arrays or DataFrames, or compute() the others."
                )
            if one.ndim not in dimensions:
                raise ValueError(f"{what} has ndim={one.ndim}: that of X must be 2, of y 1 or 2.")
        n_inputs, n_outputs = X.shape[1], 1 if y.ndim == 1 else y.shape[1]
        is_named = hasattr(y, "divisions") and getattr(y, "name", None) is not None
        names = getattr(y, "columns", [y.name] if is_named else None)
        columns = getattr(X, "columns", None)
        return cls(
            int(n_inputs),
            int(n_outputs),
            None if columns is None else tuple(columns),
            None if names is None else tuple(names),
        )

    @property
    def input_names(self):
        """Names of the inputs, "x0", "x1", ... where they have none."""
        return _texts(self.given_input_names) or tuple(f"x{j}" for j in range(self.n_inputs))

    @property
    def output_names(self):
        """Names of the outputs, "y" or "y0", "y1", ... where they have none."""
        return _texts(self.given_output_names) or default_output_names(self.n_outputs)


def _texts(names):
    """Names that are all text; else None."""
    return names if names and all(isinstance(name, str) and name for name in names) else None


@dataclass(frozen=True, eq=False)
class Partitions:
    """Partitions of X, y, weights and groups, side by side, not computed."""

    pieces: list[tuple]  # of delayed X, y, sample_weight or None, groups or None
    layout: Layout

    @classmethod
    def of(cls, X, y, sample_weight=None, groups=None):
        """The partitions of collections; TypeError or ValueError if they do not match."""
        layout = Layout.of(X, y)
        first = _delayed(X, "X")
        pieces = [first]
        for what, one in (("y", y), ("sample_weight", sample_weight), ("groups", groups)):
            parts = [None] * len(first) if one is None else _delayed(one, what)
            if len(parts) != len(first):
                raise ValueError(
                    f"{what} has npartitions={len(parts)}, X {len(first)}: they must be cut at the "
                    "same rows. Take them from one frame, or use repartition or rechunk."
                )
            pieces.append(parts)
        return cls(list(zip(*pieces, strict=True)), layout)


def _delayed(collection, what):
    """The partitions of a collection."""
    if not is_collection(collection):
        raise TypeError(
            f"{what} is a {type(collection).__name__}, but X is a dask collection: give a dask "
            "array or Series."
        )
    if not hasattr(collection, "chunks"):
        # Simplified, so that only the columns needed are read from files. Not optimised, because
        # that joins small files into one partition, and different ones for X and y.
        return list(collection.simplify().to_delayed(optimize_graph=False))
    if collection.ndim == 2:
        collection = collection.rechunk({1: -1})
    return list(collection.to_delayed().ravel())


def reduce_partitions(partitions: Partitions, of_rows: Callable, merge: Callable):
    """Apply ``of_rows`` to every partition and merge the results, in the order of partitions.

    One task per partition, and a tree of merges; nothing but the result comes to the client.
    ``of_rows`` takes the rows with weight, not standardised; ``merge`` takes two results.
    """
    from dask.delayed import delayed

    # What all tasks share has one key, so that it is sent to a worker once.
    common = delayed((partitions.layout, of_rows), traverse=False)
    apply, add = delayed(_apply, pure=False), delayed(reduce, pure=False)
    level = [apply(common, number, *parts) for number, parts in enumerate(partitions.pieces)]
    while len(level) > 1:
        groups = [level[start : start + _FAN_IN] for start in range(0, len(level), _FAN_IN)]
        level = [add(merge, group) for group in groups]
    return computed(level[0])[0]


def computed(*collections):
    """``dask.compute``, with RuntimeError if the cluster is gone or its workers are killed."""
    from concurrent.futures import CancelledError

    from dask.base import compute

    try:
        return compute(*collections)
    except Exception as error:
        # Futures of a closed client are missing from the graph.
        is_missing = isinstance(error, ValueError) and str(error).startswith("Missing dependency")
        is_of_cluster = type(error).__module__.partition(".")[0] == "distributed"
        if is_missing or is_of_cluster or isinstance(error, CancelledError):
            raise RuntimeError(_gone(f"{type(error).__name__}: {error}".strip())) from error
        raise


def _gone(what):
    if what.startswith("KilledWorker"):
        return (
            "The same partition ended several workers, most likely for want of memory: use smaller "
            f"partitions (repartition, rechunk), or workers with more memory. ({what})"
        )
    return (
        "The cluster that the data live on does not answer: it was closed, or the data are of "
        f"another client. Load or persist them again with the client that is now open. ({what})"
    )


def _apply(common, number, *parts):
    """Apply ``of_rows`` on the worker that has the data; errors name the partition."""
    layout, of_rows = common
    try:
        return of_rows(_loaded(layout, *parts))
    except (TypeError, ValueError) as error:
        raise type(error)(f"Partition {number}: {error}") from error


def _loaded(layout, X, y, sample_weight, groups):
    """The rows with weight of one partition, not standardised."""
    inputs = _numbers(X, "X", layout.given_input_names, layout.n_inputs)
    names = layout.given_output_names if np.ndim(y) == 2 else None
    targets = _numbers(y, "y", names, layout.n_outputs)
    weight: Any = sample_weight
    if weight is not None:
        weight = _numbers(weight, "sample_weight", None, 1)[:, 0]
    labels = None if groups is None else np.asarray(groups).reshape(len(groups))
    n_rows = inputs.shape[0]
    for what, one in (("y", targets), ("sample_weight", weight), ("groups", labels)):
        if one is not None and len(one) != n_rows:
            raise ValueError(
                f"X has {n_rows} rows and {what} {len(one)}: their partitions must be cut at the "
                "same rows."
            )
    if labels is not None and any(map(is_missing, labels)):
        raise ValueError("groups has no value for some rows: every row must belong to a group.")
    keep = None if weight is None else positive_weights(weight, n_rows, least=0)
    if keep is not None:
        inputs, targets, weight = inputs[keep], targets[keep], weight[keep]
        labels = None if labels is None else labels[keep]
    nothing = Scale(*np.zeros((4, 0)))
    return StandardisedData(inputs, targets, weight, nothing, nothing, labels)


def _numbers(table, what, names, n_columns):
    """A partition as floats, (n_rows, n_columns); ValueError if its columns differ."""
    if isinstance(table, str | tuple):
        # If a chunk's future is gone, dask may pass its key instead.
        raise RuntimeError(_gone(f"{what} is a {type(table).__name__} and no rows"))
    found = None if names is None or not hasattr(table, "columns") else tuple(table.columns)
    if found is not None and found != names:
        raise ValueError(
            f"{what} has the columns {', '.join(map(str, found))}; the collection says "
            f"{', '.join(map(str, names))}. Write all parts with the same columns in one order."
        )
    array = as_numbers(table, what, takes_categories=False)
    array = array[:, None] if array.ndim == 1 else array
    if array.shape[1] != n_columns:
        raise ValueError(f"{what} has the shape {array.shape}, not {(len(array), n_columns)}.")
    return array


@dataclass(frozen=True, eq=False)
class ClusterRows:
    """``StandardisedData`` whose rows stay on the cluster, with a ``sample`` in local memory."""

    partitions: Partitions
    n_rows: int
    total_weight: float
    squared_weight: float  # the sum of their squares
    inputs: Scale
    targets: Scale
    sample: StandardisedData | None = None

    @property
    def effective_weight(self):
        """Number of rows, counted by weight."""
        return max(self.total_weight, self.total_weight**2 / self.squared_weight)

    def reduce(self, of_rows, merge):
        """The results of ``of_rows`` on the partitions' rows, merged two by two."""
        scales = {"inputs": self.inputs, "targets": self.targets}
        return reduce_partitions(
            self.partitions, lambda rows: of_rows(replace(rows, **scales)), merge
        )

    def sum(self, one_pass, block_rows, map_ordered=map):
        """Sums of a pass over all rows; the workers are the cluster's, not ``map_ordered``."""
        del map_ordered
        return self.reduce(methodcaller("sum", one_pass, block_rows), add_each)


def _describe(rows, layout):
    """Number of rows, sums of weights and of their squares, scales of inputs and of targets.

    None for a partition without rows; ValueError if a value is not finite.
    """
    if rows.n_rows == 0:
        return None
    check_finite(rows.X, "X", layout.input_names)
    check_finite(rows.y, "y", layout.output_names)
    if rows.sample_weight is not None:
        check_finite(rows.sample_weight[:, None], "sample_weight", ("sample_weight",))
        largest, total = rows.sample_weight.max(initial=0.0), rows.total_weight
        if largest > _LARGEST_WEIGHT or 0.0 < total < 1.0 / _LARGEST_WEIGHT:
            raise ValueError(f"sample_weight is as large as {largest:g}: give weights near to one.")
    inputs, targets = (column_statistics(part, rows.sample_weight) for part in (rows.X, rows.y))
    return rows.n_rows, rows.total_weight, float(np.sum(rows.weights**2)), inputs, targets


def joined(one, other):
    """Join the descriptions, as from ``_describe``, of two partitions."""
    if one is None or other is None:
        return other if one is None else one
    n_rows, weights, squares, *pairs = zip(one, other, strict=True)
    scales = [joined_scales(*pair, *weights) for pair in pairs]
    return sum(n_rows), sum(weights), sum(squares), *scales


@dataclass(frozen=True, eq=False)
class ClusterData:
    """Validated data on a cluster; see ``ValidatedData``."""

    partitions: Partitions
    described: tuple[int, float, float, Scale, Scale]  # as of ``_describe``
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    constraints: Constraints | None = None

    @classmethod
    def of(cls, partitions):
        """Validate and measure the partitions, in one pass."""
        layout = partitions.layout
        described = reduce_partitions(partitions, partial(_describe, layout=layout), joined)
        n_rows = 0 if described is None else described[0]
        if n_rows < 2:
            raise ValueError(f"Found {n_rows} rows with a positive weight; at least 2 are needed.")
        return cls(partitions, described, layout.input_names, layout.output_names)

    def rows(self):
        """The rows with their scales."""
        check_scales(*self.described[3:], self.input_names, self.output_names)
        return ClusterRows(self.partitions, *self.described)
