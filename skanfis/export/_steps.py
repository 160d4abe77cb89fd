"""Columns of a table through the steps of a pipeline that treat every column alone."""

import operator
from collections import UserList

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

from ._column import Column
from ._one_hot import indicators
from .unwrapping import described

__all__ = ["columns_after", "is_passthrough", "refuse_step"]


def is_passthrough(step):
    return step is None or (isinstance(step, str) and step == "passthrough")


def columns_after(label, step, columns, names=()):
    """The columns after a step; ``names`` are those of the user's table."""
    if not columns or is_passthrough(step):
        return columns
    if isinstance(step, Pipeline):
        for name, part in step.steps:
            columns = columns_after(name, part, columns, names)
        return columns
    if type(step) is OneHotEncoder:
        return _one_hot(label, step, columns, names)
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
    operations = _scaler_operations(label, step)
    return [
        column.then([(operation, float(numbers[k])) for operation, numbers in operations])
        for k, column in enumerate(columns)
    ]


def _one_hot(label, encoder, columns, names):
    """Indicators in the place of the columns that an encoder is given."""
    if any(column.operations or column.indicator for column in columns):
        refuse_step(label, encoder, "it must be given columns of the table as they are")
    sources = [column.source for column in columns]
    found = indicators(encoder, sources, [names[j] for j in sources])
    return [Column(source, indicator=one) for source, one in found]


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


def _scaler_operations(label, scaler):
    """What a scaler does, in its own arithmetic: pairs of operation and one number per column."""
    kind = type(scaler)
    if kind is FunctionTransformer and scaler.func is None and scaler.inverse_func is None:
        return []
    if getattr(scaler, "clip", False):
        refuse_step(
            label, scaler, "clip=True bends it at the edge; out_of_bounds='clip' does the same"
        )
    if kind is StandardScaler:
        mean = scaler.mean_ if scaler.with_mean else None
        steps = [(operator.sub, mean), (operator.truediv, scaler.scale_)]
    elif kind is RobustScaler:
        steps = [(operator.sub, scaler.center_), (operator.truediv, scaler.scale_)]
    elif kind is MaxAbsScaler:
        steps = [(operator.truediv, scaler.scale_)]
    elif kind is MinMaxScaler:
        steps = [(operator.mul, scaler.scale_), (operator.add, scaler.min_)]
    else:
        refuse_step(label, scaler, "it does not map every column alone by a positive scale")
    return [(operation, numbers) for operation, numbers in steps if numbers is not None]


def refuse_step(label, step, reason):
    raise ValueError(
        f"{described(label, step)} cannot be folded into the rules: {reason}. StandardScaler, "
        "MinMaxScaler, MaxAbsScaler, RobustScaler, OneHotEncoder, column selections and "
        "ColumnTransformers of these can. For rules in the units of that step's output, give the "
        "ANFIS estimator alone."
    )
