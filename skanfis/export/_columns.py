"""How an input of a model comes from a column of the user's table, through steps that scale it.

A scaler maps every column alone, x = offset + scale z with a positive scale. A OneHotEncoder makes
indicators of a column, which are inputs of the folded model in its place.
"""

from collections import UserList
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from sklearn.compose import ColumnTransformer
from sklearn.feature_selection import SelectorMixin
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import (
    FunctionTransformer,
    MaxAbsScaler,
    MinMaxScaler,
    OneHotEncoder,
    RobustScaler,
    StandardScaler,
)
from sklearn.utils import check_array

__all__ = ["Column", "Indicator", "as_numbers", "columns_after", "described", "is_passthrough"]


@dataclass(frozen=True, eq=False)
class Indicator:
    """Output ``place`` of a fitted encoder that is given some columns of the user's table."""

    encoder: OneHotEncoder
    columns: tuple[int, ...]
    place: int
    name: str

    def values(self, X):
        """0 or 1 for every row of the user's table, shape (n_rows,)."""
        encoded = self.encoder.transform(_part_of(X, list(self.columns)))[:, [self.place]]
        dense = encoded.toarray() if hasattr(encoded, "toarray") else np.asarray(encoded)
        return dense[:, 0].astype(np.float64)


@dataclass(frozen=True)
class Column:
    """Raw column ``source`` as x = offset + scale z, or an indicator made of it."""

    source: int
    offset: float = 0.0
    scale: float = 1.0
    indicator: Indicator | None = None

    @property
    def key(self):
        """What orders the inputs, and no two of them share."""
        return self.source, -1 if self.indicator is None else self.indicator.place

    def values(self, X):
        """The input on the rows of the user's table."""
        if self.indicator is not None:
            return self.indicator.values(X)
        return as_numbers(_part_of(X, [self.source]))[:, 0]

    def edge(self, z, side):
        """The x of an edge of the box, to the lower (-1) or upper (1) side.

        Two roundings farther out where it is computed: the rows that made it stay inside.
        """
        x = self.offset + self.scale * z
        is_raw = self.offset == 0.0 and self.scale == 1.0
        return x if is_raw else x + side * 4.0 * np.spacing(max(abs(x), abs(self.offset)))


def as_numbers(X):
    return check_array(X, dtype=np.float64, ensure_all_finite=False, input_name="X")


def is_passthrough(step):
    return step is None or (isinstance(step, str) and step == "passthrough")


def described(label, step):
    """A step for a message, by its name and class."""
    return f"step {label!r} ({type(step).__name__})" if label else type(step).__name__


def columns_after(label, step, columns, names=()):
    """The columns after a step; ``names`` are those of the user's table."""
    if not columns or is_passthrough(step):
        return columns
    if isinstance(step, Pipeline):
        for name, part in step.steps:
            columns = columns_after(name, part, columns, names)
        return columns
    if type(step) is OneHotEncoder:
        return _encoded(label, step, columns, names)
    if isinstance(step, SelectorMixin):
        return [columns[j] for j in step.get_support(indices=True)]
    if type(step) is ColumnTransformer:
        return [
            column
            for name, part, chosen in step.transformers_
            if not (isinstance(part, str) and part == "drop")
            for column in columns_after(
                name, part, [columns[j] for j in _positions(chosen, step)], names
            )
        ]
    offsets, scales = _offset_and_scale(label, step, len(columns))
    return [
        replace(column, offset=column.offset + column.scale * offset, scale=column.scale * scale)
        for column, offset, scale in zip(columns, offsets, scales, strict=True)
    ]


def _encoded(label, encoder, columns, names):
    """Indicators in the place of the columns that an encoder is given."""
    if any(column != Column(column.source) for column in columns):
        _refuse(label, encoder, "it must be given columns of the table as they are")
    sources = [column.source for column in columns]
    named = hasattr(encoder, "feature_names_in_")
    outputs = encoder.get_feature_names_out(None if named else [names[j] for j in sources])
    counts = [len(categories) for categories in encoder.categories_]
    merged = getattr(encoder, "infrequent_categories_", [None] * len(counts))
    dropped = [None] * len(counts) if encoder.drop_idx_ is None else encoder.drop_idx_
    n_outputs = [
        count - (0 if few is None else len(few) - 1) - (left_out is not None)
        for count, few, left_out in zip(counts, merged, dropped, strict=True)
    ]
    return [
        Column(source, indicator=Indicator(encoder, tuple(sources), place, str(name)))
        for place, (source, name) in enumerate(
            zip(np.repeat(sources, n_outputs).tolist(), outputs, strict=True)
        )
    ]


def _positions(chosen, transformer):
    """Positions of the columns that a ColumnTransformer's entry takes."""
    names = list(getattr(transformer, "feature_names_in_", []))
    if isinstance(chosen, slice):
        first, last = chosen.start, chosen.stop
        if isinstance(first, str) or isinstance(last, str):
            # By name, the last is included.
            first = names.index(first) if first is not None else None
            last = names.index(last) + 1 if last is not None else None
        return np.arange(transformer.n_features_in_)[first : last : chosen.step]
    if isinstance(chosen, UserList):
        # The columns of a remainder, before scikit-learn 1.7: to look at one issues a warning.
        chosen = chosen.data
    chosen = np.atleast_1d(np.asarray(chosen, dtype=object if len(names) else None))
    if all(isinstance(one, str) for one in chosen):
        return [names.index(one) for one in chosen]
    kind = bool if all(isinstance(one, bool | np.bool_) for one in chosen) else int
    return np.arange(transformer.n_features_in_)[chosen.astype(kind)]


def _offset_and_scale(label, scaler, n_columns):
    """Of x = offset + scale z, for every column of a fitted scaler."""
    kind = type(scaler)
    if getattr(scaler, "clip", False):
        _refuse(label, scaler, "clip=True bends it at the edge; out_of_bounds='clip' does the same")
    offset: Any = None
    scale: Any = None
    if kind is StandardScaler:
        offset, scale = (scaler.mean_ if scaler.with_mean else None), scaler.scale_
    elif kind is RobustScaler:
        offset, scale = scaler.center_, scaler.scale_
    elif kind is MaxAbsScaler:
        scale = scaler.scale_
    elif kind is MinMaxScaler:
        offset, scale = -scaler.min_ / scaler.scale_, 1.0 / scaler.scale_
    elif kind is not FunctionTransformer or scaler.func or scaler.inverse_func:
        _refuse(label, scaler, "it does not map every column alone by a positive scale")
    offsets = [0.0] * n_columns if offset is None else offset.tolist()
    return offsets, [1.0] * n_columns if scale is None else scale.tolist()


def _refuse(label, step, reason):
    raise ValueError(
        f"{described(label, step)} cannot be folded into the rules: {reason}. StandardScaler, "
        "MinMaxScaler, MaxAbsScaler, RobustScaler, OneHotEncoder, column selections and "
        "ColumnTransformers of these can. For rules in the units of that step's output, give the "
        "ANFIS estimator alone."
    )


def _part_of(X, columns):
    """Columns of a frame, or of anything that is an array of objects, by their positions."""
    if hasattr(X, "iloc"):
        return X.iloc[:, columns]
    if hasattr(X, "get_columns"):
        return X[:, columns]
    return np.asarray(X, dtype=object)[:, columns]
