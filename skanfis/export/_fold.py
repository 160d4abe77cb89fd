r"""Scalers in front of a model, and on its target, folded into it: one model of the raw columns.

A scaler such as StandardScaler maps every column alone, z = (x - offset) / scale with a positive
scale. Rules about z are rules about x = offset + scale z: memberships, box and consequents change
their units, nothing else does. The same holds for the target, y = offset + scale t.

The box needs care. Its edges are rows of the training data, and the edge computed back from z may
differ from the row's x in the last bit: the row would then be out of bounds. The edge taken is
therefore the outermost x that the scaler's own arithmetic maps into the box of z.
"""

import operator
from dataclasses import dataclass, replace

import numpy as np
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.feature_selection import SelectorMixin
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import (
    FunctionTransformer,
    MaxAbsScaler,
    MinMaxScaler,
    RobustScaler,
    StandardScaler,
)
from sklearn.utils import check_array
from sklearn.utils.validation import check_is_fitted

from .._validation import check_finite
from ..model import TSKModel
from ..naming import default_term_names

__all__ = ["fold", "fold_with_reader", "fold_with_rows", "last_step"]

_INVERSE = {
    operator.sub: operator.add,
    operator.add: operator.sub,
    operator.truediv: operator.mul,
    operator.mul: operator.truediv,
}


def fold(estimator):
    """Return the frozen model of an estimator, in the units of the columns it is given.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        An ANFIS estimator; a Pipeline that ends in one, with steps in front that treat every
        column alone (StandardScaler, MinMaxScaler, MaxAbsScaler, RobustScaler, "passthrough",
        column selections, a ColumnTransformer of these); a TransformedTargetRegressor of these
        whose transformer is such a scaler; a search such as GridSearchCV over these. A TSKModel is
        returned as it is.

    Returns
    -------
    model : TSKModel
        Its inputs are the raw columns that reach the model, in the order of X, by their names in X
        ("x0", "x1", ... where it has none); a column that a step drops is no input. Terms and rules
        keep their order. ``model.predict(X)``, with X of these columns, is what
        ``estimator.predict(X)`` is, to rounding errors, under every policy out of bounds.

    Raises
    ------
    ValueError
        If a step cannot be folded; it is named.
    TypeError
        If ``estimator`` is no such estimator.
    """
    return _Folding(estimator).model


def fold_with_rows(estimator, X):
    """:func:`fold`, and the rows of the model's inputs out of the table X that ``estimator`` takes.

    Returns
    -------
    model : TSKModel
    rows : ndarray of shape (n_rows, model.n_inputs)
        Finite, in raw units.
    """
    folding = _Folding(estimator)
    return folding.model, folding.rows(X)


def fold_with_reader(estimator):
    """:func:`fold`, and a function from a table that ``estimator`` takes to the model's inputs.

    For tables that are read in parts; each comes out as :func:`fold_with_rows` gives it.
    """
    folding = _Folding(estimator)
    return folding.model, folding.rows


def last_step(estimator):
    """The ANFIS estimator itself at the end of pipelines, wrappers and searches."""
    label, last = _flat("", estimator)[-1]
    _model_of(label, last)
    return last


@dataclass(frozen=True)
class _Column:
    """How a column comes from a raw one: arithmetic with numbers, in the scaler's own order."""

    source: int
    operations: tuple = ()

    def then(self, operations):
        return replace(self, operations=(*self.operations, *operations))

    def forward(self, x):
        for operation, number in self.operations:
            x = operation(x, number)
        return x

    def backward(self, z):
        for operation, number in reversed(self.operations):
            z = _INVERSE[operation](z, number)
        return z

    def offset_and_scale(self):
        """Of x = offset + scale z."""
        offset, scale = 0.0, 1.0
        for operation, number in self.operations:
            if operation is operator.sub:
                offset += number * scale
            elif operation is operator.add:
                offset -= number * scale
            elif operation is operator.truediv:
                scale *= number
            else:
                scale /= number
        return offset, scale

    def outermost(self, edge, side):
        """The outermost x, to the ``side`` (-1 or 1), that is mapped to no more than ``edge``."""
        guess = self.backward(edge)
        if not self.operations or not np.isfinite(guess):
            return guess

        def is_inside(x):
            return side * self.forward(x) <= side * edge

        offset, _ = self.offset_and_scale()
        step = side * np.spacing(max(abs(guess), abs(offset)))
        inner, outer = guess, guess
        while not is_inside(inner):
            inner, step = inner - step, 2.0 * step
        while is_inside(outer):
            outer, step = outer + step, 2.0 * step
        while (middle := inner + 0.5 * (outer - inner)) not in (inner, outer):
            inner, outer = (middle, outer) if is_inside(middle) else (inner, middle)
        return inner


class _Folding:
    """What becomes of an estimator: its model in raw units, and how to find the inputs in X."""

    def __init__(self, estimator):
        if isinstance(estimator, TSKModel):
            self.model = estimator
            self.names, self.sources = estimator.input_names, np.arange(estimator.n_inputs)
            self.is_named = True
            return
        *steps, (label, last) = _flat("", estimator)
        model = _model_of(label, last)
        first = next((step for _, step in steps if not _is_passthrough(step)), last)
        n_raw = first.n_features_in_
        names = getattr(first, "feature_names_in_", None)
        self.is_named = names is not None
        self.names = tuple(f"x{j}" for j in range(n_raw)) if names is None else tuple(names)
        columns = [_Column(j) for j in range(n_raw)]
        for label, step in steps:
            columns = _through(label, step, columns)
        self._check_once(columns)
        order = np.argsort([column.source for column in columns], kind="stable")
        self.sources = np.array([columns[j].source for j in order])
        model = _with_raw_inputs(model, columns, order, [self.names[j] for j in self.sources])
        for label, transformer in reversed(_targets("", estimator)):
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
        table = check_array(X, dtype=np.float64, ensure_all_finite=False, input_name="X")
        if table.shape[1] != len(self.names):
            raise ValueError(
                f"X has {table.shape[1]} columns, the estimator takes {len(self.names)}: "
                f"{', '.join(map(repr, self.names))}."
            )
        rows = table[:, self.sources]
        check_finite(rows, "X", self.model.input_names)
        return rows

    def _check_once(self, columns):
        sources = [column.source for column in columns]
        for source in sources:
            if sources.count(source) > 1:
                raise ValueError(
                    f"Column {self.names[source]!r} reaches the model {sources.count(source)} "
                    "times: its rules cannot be written with one membership per column. Let every "
                    "column reach it once."
                )


def _flat(label, estimator):
    """The steps of nested pipelines one after the other, the model's estimator last."""
    if hasattr(estimator, "best_estimator_"):
        return _flat(label, estimator.best_estimator_)
    if isinstance(estimator, TransformedTargetRegressor):
        check_is_fitted(estimator)
        return _flat(label, estimator.regressor_)
    if isinstance(estimator, Pipeline):
        return [part for name, step in estimator.steps for part in _flat(name, step)]
    return [(label, estimator)]


def _targets(label, estimator):
    """The transformers of the target from the outermost to the innermost."""
    if hasattr(estimator, "best_estimator_"):
        return _targets(label, estimator.best_estimator_)
    if isinstance(estimator, TransformedTargetRegressor):
        return [(label, estimator.transformer_), *_targets(label, estimator.regressor_)]
    if isinstance(estimator, Pipeline):
        return _targets(*estimator.steps[-1])
    return []


def _model_of(label, estimator):
    """The frozen model of the last step, with the policy that its parameters ask for now."""
    if isinstance(estimator, type) or not hasattr(estimator, "fit"):
        raise TypeError(
            f"estimator must be a fitted ANFIS estimator, a Pipeline that ends in one, or a "
            f"TSKModel; got {estimator!r}."
        )
    model = getattr(estimator, "model_", None)
    if not isinstance(model, TSKModel):
        check_is_fitted(estimator)
        raise TypeError(
            f"estimator must be or end in an ANFIS estimator; {_describe(label, estimator)} has no "
            "rules."
        )
    policy = getattr(estimator, "out_of_bounds", model.out_of_bounds)
    return model.with_out_of_bounds(policy, getattr(estimator, "max_extrapolation", None))


def _describe(label, step):
    return f"step {label!r} ({type(step).__name__})" if label else type(step).__name__


def _refuse(label, step, reason):
    raise ValueError(
        f"{_describe(label, step)} cannot be folded into the rules: {reason}. StandardScaler, "
        "MinMaxScaler, MaxAbsScaler, RobustScaler, column selections and ColumnTransformers of "
        "these can. For rules in the units of that step's output, give the ANFIS estimator alone."
    )


def _is_passthrough(step):
    return step is None or (isinstance(step, str) and step == "passthrough")


def _through(label, step, columns):
    """The columns after a step."""
    if not columns or _is_passthrough(step):
        return columns
    if isinstance(step, Pipeline):
        for name, part in step.steps:
            columns = _through(name, part, columns)
        return columns
    if isinstance(step, SelectorMixin):
        return [columns[j] for j in step.get_support(indices=True)]
    if type(step) is ColumnTransformer:
        return [
            column
            for name, part, chosen in step.transformers_
            if not (isinstance(part, str) and part == "drop")
            for column in _through(name, part, [columns[j] for j in _positions(chosen, step)])
        ]
    operations = _scaler_operations(label, step)
    return [
        column.then([(operation, float(numbers[k])) for operation, numbers in operations])
        for k, column in enumerate(columns)
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
        _refuse(label, scaler, "clip=True bends it at the edge; out_of_bounds='clip' does the same")
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
        _refuse(label, scaler, "it does not map every column alone by a positive scale")
    return [(operation, numbers) for operation, numbers in steps if numbers is not None]


def _with_raw_inputs(model, columns, order, names):
    """The model with its inputs in raw units and in the order of their raw columns."""
    offset, scale = np.array([column.offset_and_scale() for column in columns]).T
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
        support=_with_raw_support(model.support, offset, scale, order),
        input_names=tuple(map(str, names)),
        posterior=_with_raw_posterior(model, scale, order),
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


def _with_raw_support(support, offset, scale, order):
    return None if support is None else support.change_units(offset, scale).reordered(order)


def _with_raw_posterior(model, scale, order):
    if model.posterior is None:
        return None
    return model.posterior.change_units(model.antecedent, scale, order)


def _with_raw_target(model, label, transformer):
    """The model with its outputs as a scaler's inverse gives them."""
    columns = _through(label, transformer, [_Column(k) for k in range(model.n_outputs)])
    if [column.source for column in columns] != list(range(model.n_outputs)):
        _refuse(label, transformer, "it drops or moves columns of the target")
    offset, scale = np.array([column.offset_and_scale() for column in columns]).T
    coefficients = model.coefficients * scale
    coefficients[:, 0] += offset
    posterior = model.posterior
    return replace(
        model,
        coefficients=coefficients,
        posterior=None if posterior is None else posterior.change_target_units(scale),
    )
