"""Scalers in front of a model, and on its target, folded into it: one model of the raw columns.

Rules about z are rules about x = offset + scale z: memberships, box and consequents change their
units, nothing else does. The same holds for the target, y = offset + scale t.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

from .._validation import check_finite
from ..model import TSKModel
from ..naming import default_term_names
from ..options import policy_of
from ._columns import Column, as_numbers, columns_after, described, is_passthrough

__all__ = ["fold", "fold_with_reader", "fold_with_rows", "found_by_search", "last_step"]


def fold(estimator: Any) -> TSKModel:
    """Return the frozen model of an estimator, in the units of the columns it is given.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        An ANFIS estimator; a Pipeline that ends in one, with steps in front that scale every column
        alone, select columns or encode them (OneHotEncoder), or a ColumnTransformer of these; a
        TransformedTargetRegressor of these whose transformer is such a scaler; a search such as
        GridSearchCV over these. A TSKModel is returned as it is.

    Returns
    -------
    model : TSKModel
        Its inputs are the raw columns that reach the model, in the order of X, by their names in X
        ("x0", "x1", ... where it has none), and in the place of one that is one-hot encoded its
        indicators ("fibre_PM"). It predicts what ``estimator`` does, to rounding errors.

    Raises
    ------
    ValueError, TypeError
        If a step cannot be folded, which is named; if ``estimator`` is no such estimator.

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
    return fold_with_reader(estimator)[0]


def fold_with_rows(estimator: Any, X: Any) -> tuple[TSKModel, np.ndarray]:
    """Return what :func:`fold` does, and the rows of the model's inputs out of a table.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
    X : array-like or DataFrame of shape (n_rows, n_features)
        Checked: other columns than in training are refused, and numbers that are not finite.

    Returns
    -------
    model : TSKModel
    rows : ndarray of shape (n_rows, model.n_inputs)

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
    model, read = fold_with_reader(estimator)
    return model, read(X)


def fold_with_reader(estimator: Any) -> tuple[TSKModel, Callable[..., np.ndarray]]:
    """Return what :func:`fold` does, and a function from tables to the model's inputs.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel

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
    >>> read(X[:5]).shape
    (5, 1)
    """
    if isinstance(estimator, TSKModel):
        inputs = [Column(j) for j in range(estimator.n_inputs)]
        return estimator, _reader(inputs, estimator.input_names, True, estimator.input_names)
    *steps, (label, last) = _steps_of("", estimator)
    model = _model_of(label, last)
    first = next((step for _, step in steps if not is_passthrough(step)), last)
    given = getattr(first, "feature_names_in_", None)
    n_raw = first.n_features_in_
    names = tuple(f"x{j}" for j in range(n_raw)) if given is None else tuple(given)
    columns = [Column(j) for j in range(n_raw)]
    for label, step in steps:
        columns = columns_after(label, step, columns, names)

    named = [names[c.source] if c.indicator is None else c.indicator.name for c in columns]
    keys = [column.key for column in columns]
    for name, key in zip(named, keys, strict=True):
        if keys.count(key) > 1:
            raise ValueError(
                f"Column {name!r} reaches the model {keys.count(key)} times: its rules cannot be "
                "written with one membership per column. Let every column reach it once."
            )
    order = np.array(sorted(range(len(columns)), key=keys.__getitem__))
    inputs = [columns[j] for j in order]
    model = _with_raw_inputs(model, columns, order, [named[j] for j in order])
    for label, transformer in reversed(_target_steps("", estimator)):
        model = _with_raw_target(model, label, transformer)
    return model, _reader(inputs, names, given is not None, model.input_names)


def last_step(estimator: Any) -> Any:
    """Return the ANFIS estimator itself at the end of pipelines, wrappers and searches.

    Parameters
    ----------
    estimator : fitted estimator
        As :func:`fold` takes it, but for the steps in front, which may be any.

    Returns
    -------
    last : estimator
        With a ``model_`` of rules; TypeError where there is none.

    Examples
    --------
    >>> from sklearn.pipeline import make_pipeline
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import last_step
    >>> last_step(make_pipeline(ANFISRegressor(n_mfs=2)).fit(*make_jang_sinc())).model_.n_rules
    4
    """
    label, last = _steps_of("", estimator)[-1]
    _model_of(label, last)
    return last


def found_by_search(estimator: Any) -> Any:
    """Return the estimator that a search has kept, or one that is no search as it is.

    Parameters
    ----------
    estimator : estimator
        A fitted search such as GridSearchCV, a search over searches, or any other.

    Returns
    -------
    found : estimator

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.export import found_by_search
    >>> found_by_search(ANFISRegressor(n_mfs=2)).n_mfs
    2
    """
    while hasattr(estimator, "best_estimator_"):
        estimator = estimator.best_estimator_
    return estimator


def _steps_of(label, estimator):
    """The steps of nested pipelines one after the other, the model's estimator last."""
    estimator = found_by_search(estimator)
    if isinstance(estimator, TransformedTargetRegressor):
        check_is_fitted(estimator)
        return _steps_of(label, estimator.regressor_)
    if isinstance(estimator, Pipeline):
        return [part for name, step in estimator.steps for part in _steps_of(name, step)]
    return [(label, estimator)]


def _target_steps(label, estimator):
    """The transformers of the target from the outermost to the innermost."""
    estimator = found_by_search(estimator)
    if isinstance(estimator, TransformedTargetRegressor):
        return [(label, estimator.transformer_), *_target_steps(label, estimator.regressor_)]
    if isinstance(estimator, Pipeline):
        return _target_steps(*estimator.steps[-1])
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
            f"estimator must be or end in an ANFIS estimator; {described(label, estimator)} has no "
            "rules."
        )
    if not hasattr(estimator, "out_of_bounds"):
        return model
    return model.with_out_of_bounds(*policy_of(estimator.out_of_bounds))


def _reader(inputs, names, is_named, input_names):
    """The function that takes the inputs out of tables with columns of these names."""

    def read(X):
        given = getattr(X, "columns", None)
        if is_named and given is not None and list(given) != list(names):
            raise ValueError(
                f"X must have the columns {', '.join(map(repr, names))}, in this order; it "
                f"has {', '.join(map(repr, given))}."
            )
        is_encoded = any(one.indicator is not None for one in inputs)
        table = X if is_encoded else as_numbers(X)
        n_columns = np.shape(table)[1]
        if n_columns != len(names):
            raise ValueError(
                f"X has {n_columns} columns, the estimator takes {len(names)}: "
                f"{', '.join(map(repr, names))}."
            )
        if is_encoded:
            rows = np.column_stack([one.values(X) for one in inputs])
        else:
            rows = table[:, [one.source for one in inputs]]
        check_finite(rows, "X", input_names)
        return rows

    return read


def _with_raw_inputs(model, columns, order, names):
    """The model with its inputs in raw units and in the order of their raw columns."""
    offset, scale = np.array([(column.offset, column.scale) for column in columns]).T
    support, posterior = model.support, model.posterior
    coefficients = model.coefficients.copy()
    if model.order:
        coefficients[:, 1:] = (coefficients[:, 1:] / scale[:, None])[:, order]
    low, high = (
        np.array([c.edge(z, side) for c, z in zip(columns, edges.tolist(), strict=True)])
        for edges, side in ((model.minimum, -1.0), (model.maximum, 1.0))
    )
    place = np.argsort(order)
    antecedents = {}
    for name in ("antecedent", "initial_antecedent"):
        moved = getattr(model, name).change_units(offset, scale)
        groups = tuple(replace(group, inputs=place[group.inputs]) for group in moved.groups)
        antecedents[name] = replace(moved, groups=groups)
    folded = replace(
        model,
        **antecedents,
        coefficients=coefficients,
        reference=(offset + scale * model.reference)[order],
        spread=(scale * model.spread)[order],
        minimum=low[order],
        maximum=high[order],
        support=support and support.change_units(offset, scale).reordered(order),
        input_names=tuple(map(str, names)),
        posterior=posterior and posterior.change_units(model.antecedent, scale, order),
    )
    if model.term_names == default_term_names(model.antecedent):
        # Scattered terms are called by where they stand, which is elsewhere in other units.
        return replace(folded, term_names=default_term_names(folded.antecedent))
    return folded


def _with_raw_target(model, label, transformer):
    """The model with its outputs as a scaler's inverse gives them."""
    label = f"{label}: transformer of the target" if label else "transformer of the target"
    columns = columns_after(label, transformer, [Column(k) for k in range(model.n_outputs)])
    if [column.source for column in columns] != list(range(model.n_outputs)):
        raise ValueError(
            f"{described(label, transformer)} cannot be folded into the rules: it drops or moves "
            "columns of the target. A scaler such as StandardScaler can."
        )
    offset, scale = np.array([(column.offset, column.scale) for column in columns]).T
    coefficients = model.coefficients * scale
    coefficients[:, 0] += offset
    target, posterior = model.target, model.posterior
    return replace(
        model,
        coefficients=coefficients,
        target=target and target.change_units(offset, scale),
        posterior=posterior and posterior.change_target_units(scale),
    )
