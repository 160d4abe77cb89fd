r"""Scalers in front of a model, and on its target, folded into it: one model of the raw columns.

A scaler such as StandardScaler maps every column alone, z = (x - offset) / scale with a positive
scale. Rules about z are rules about x = offset + scale z: memberships, box and consequents change
their units, nothing else does. The same holds for the target, y = offset + scale t.

A OneHotEncoder makes numbers of what is none: its indicators are inputs of the folded model, in the
place of the column that it encodes.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.utils import check_array

from .._validation import check_finite
from ..model import TSKModel
from ..naming import default_term_names
from ._column import Column
from ._one_hot import part_of
from ._steps import columns_after, is_passthrough, refuse_step
from .unwrapping import model_of, steps_of, target_steps

__all__ = ["fold", "fold_with_reader", "fold_with_rows"]


def fold(estimator: Any) -> TSKModel:
    """Return the frozen model of an estimator, in the units of the columns it is given.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        An ANFIS estimator; a Pipeline that ends in one, with steps in front that treat every
        column alone (StandardScaler, MinMaxScaler, MaxAbsScaler, RobustScaler, "passthrough",
        column selections, a OneHotEncoder, a ColumnTransformer of these); a
        TransformedTargetRegressor of these whose transformer is such a scaler; a search such as
        GridSearchCV over these. A TSKModel is returned as it is.

    Returns
    -------
    model : TSKModel
        Its inputs are the raw columns that reach the model, in the order of X, by their names in X
        ("x0", "x1", ... where it has none); a column that a step drops is no input. In the place of
        a column that is one-hot encoded are its indicators, by the encoder's names ("fibre_PM").
        Terms and rules keep their order. ``model.predict(X)``, with X of these columns, is what
        ``estimator.predict(X)`` is, to rounding errors, under every policy out of bounds.

    Raises
    ------
    ValueError
        If a step cannot be folded; it is named.
    TypeError
        If ``estimator`` is no such estimator.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.pipeline import make_pipeline
    >>> from sklearn.preprocessing import StandardScaler
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import fold
    >>> X, y = make_jang_sinc()
    >>> pipeline = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=3)).fit(X, y)
    >>> model = fold(pipeline)
    >>> bool(np.allclose(model.predict(X)[:, 0], pipeline.predict(X)))
    True
    """
    return _Folding(estimator).model


def fold_with_rows(estimator: Any, X: Any) -> tuple[TSKModel, np.ndarray]:
    """Return what :func:`fold` does, and the rows of the model's inputs out of a table.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`fold` takes it.
    X : array-like or DataFrame of shape (n_rows, n_features)
        A table that ``estimator`` takes.

    Returns
    -------
    model : TSKModel
    rows : ndarray of shape (n_rows, model.n_inputs)
        Finite, in raw units.

    Raises
    ------
    ValueError, TypeError
        As :func:`fold` does; ValueError too where X has other columns than ``estimator`` was
        trained on, or a value that is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.export import fold_with_rows
    >>> X = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
    >>> model, rows = fold_with_rows(ANFISRegressor(n_mfs=2).fit(X, X[:, 0] ** 2), X)
    >>> model.strengths(rows).shape
    (20, 2)
    """
    folding = _Folding(estimator)
    return folding.model, folding.rows(X)


def fold_with_reader(estimator: Any) -> tuple[TSKModel, Callable[..., np.ndarray]]:
    """Return what :func:`fold` does, and a function from tables to the model's inputs.

    For tables that are read in parts.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`fold` takes it.

    Returns
    -------
    model : TSKModel
    read : callable
        ``read(X)`` gives the rows that :func:`fold_with_rows` gives, and raises what it raises.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.export import fold_with_reader
    >>> X = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
    >>> model, read = fold_with_reader(ANFISRegressor(n_mfs=2).fit(X, X[:, 0] ** 2))
    >>> [read(part).shape for part in (X[:5], X[5:])]
    [(5, 1), (15, 1)]
    """
    folding = _Folding(estimator)
    return folding.model, folding.rows


class _Folding:
    """What becomes of an estimator: its model in raw units, and how to find the inputs in X."""

    def __init__(self, estimator):
        if isinstance(estimator, TSKModel):
            self.model = estimator
            self.names, self.is_named = estimator.input_names, True
            self.inputs = [Column(j) for j in range(estimator.n_inputs)]
            return
        *steps, (label, last) = steps_of("", estimator)
        model = model_of(label, last)
        first = next((step for _, step in steps if not is_passthrough(step)), last)
        n_raw = first.n_features_in_
        names = getattr(first, "feature_names_in_", None)
        self.is_named = names is not None
        self.names = tuple(f"x{j}" for j in range(n_raw)) if names is None else tuple(names)
        columns = [Column(j) for j in range(n_raw)]
        for label, step in steps:
            columns = columns_after(label, step, columns, self.names)
        self._check_once(columns)
        order = np.array(sorted(range(len(columns)), key=lambda j: columns[j].key))
        self.inputs = [columns[j] for j in order]
        model = _with_raw_inputs(model, columns, order, [self._name(one) for one in self.inputs])
        for label, transformer in reversed(target_steps("", estimator)):
            model = _with_raw_target(model, label, transformer)
        self.model = model

    def rows(self, X):
        """The model's inputs out of the table X."""
        given = getattr(X, "columns", None)
        if self.is_named and given is not None and list(given) != list(self.names):
            raise ValueError(
                f"X must have the columns {', '.join(map(repr, self.names))}, in this order; it "
                f"has {', '.join(map(repr, given))}."
            )
        encoded = [one for one in self.inputs if one.indicator is not None]
        table = X if encoded else _as_numbers(X)
        n_columns = np.shape(table)[1]
        if n_columns != len(self.names):
            raise ValueError(
                f"X has {n_columns} columns, the estimator takes {len(self.names)}: "
                f"{', '.join(map(repr, self.names))}."
            )
        if encoded:
            rows = np.column_stack([_values(one, X) for one in self.inputs])
        else:
            rows = table[:, [one.source for one in self.inputs]]
        check_finite(rows, "X", self.model.input_names)
        return rows

    def _name(self, column):
        return self.names[column.source] if column.indicator is None else column.indicator.name

    def _check_once(self, columns):
        keys = [column.key for column in columns]
        for column in columns:
            if keys.count(column.key) > 1:
                raise ValueError(
                    f"Column {self._name(column)!r} reaches the model {keys.count(column.key)} "
                    "times: its rules cannot be written with one membership per column. Let every "
                    "column reach it once."
                )


def _as_numbers(X):
    return check_array(X, dtype=np.float64, ensure_all_finite=False, input_name="X")


def _values(column, X):
    """What an input is on the rows of the user's table."""
    if column.indicator is not None:
        return column.indicator.values(X)
    return _as_numbers(part_of(X, [column.source]))[:, 0]


def _with_raw_inputs(model, columns, order, names):
    """The model with its inputs in raw units and in the order of their raw columns."""
    offset, scale = np.array([column.offset_and_scale() for column in columns]).T
    support, posterior = model.support, model.posterior
    coefficients = model.coefficients.copy()
    if model.order:
        coefficients[:, 1:] = (coefficients[:, 1:] / scale[:, None])[:, order]
    folded = replace(
        model,
        antecedent=_with_raw_terms(model.antecedent, offset, scale, order),
        initial_antecedent=_with_raw_terms(model.initial_antecedent, offset, scale, order),
        coefficients=coefficients,
        reference=(offset + scale * model.reference)[order],
        spread=(scale * model.spread)[order],
        minimum=_edges(columns, model.minimum, -1.0)[order],
        maximum=_edges(columns, model.maximum, 1.0)[order],
        support=support and support.change_units(offset, scale).reordered(order),
        input_names=tuple(map(str, names)),
        posterior=posterior and posterior.change_units(model.antecedent, scale, order),
    )
    if model.term_names == default_term_names(model.antecedent):
        # Scattered terms are called by where they stand, which is elsewhere in other units.
        return replace(folded, term_names=default_term_names(folded.antecedent))
    return folded


def _edges(columns, edges, side):
    pairs = zip(columns, map(float, edges), strict=True)
    return np.array([column.outermost(edge, side) for column, edge in pairs])


def _with_raw_terms(antecedent, offset, scale, order):
    """The same terms and rules in raw units, each term on its input's new place."""
    place = np.argsort(order)
    moved = antecedent.change_units(offset, scale)
    groups = tuple(replace(group, inputs=place[group.inputs]) for group in moved.groups)
    return replace(moved, groups=groups)


def _with_raw_target(model, label, transformer):
    """The model with its outputs as a scaler's inverse gives them."""
    label = f"{label}: transformer of the target" if label else "transformer of the target"
    columns = columns_after(label, transformer, [Column(k) for k in range(model.n_outputs)])
    if [column.source for column in columns] != list(range(model.n_outputs)):
        refuse_step(label, transformer, "it drops or moves columns of the target")
    offset, scale = np.array([column.offset_and_scale() for column in columns]).T
    coefficients = model.coefficients * scale
    coefficients[:, 0] += offset
    target, posterior = model.target, model.posterior
    return replace(
        model,
        coefficients=coefficients,
        target=target and target.change_units(offset, scale),
        posterior=posterior and posterior.change_target_units(scale),
    )
