"""Fold the scalers and encoders of a pipeline into its model: one model of the raw columns.

A scaler maps every column alone, x = offset + scale z with a positive scale. Rules about z are
then rules about x: only the units of memberships, box and consequents change. The same holds for
the target, y = offset + scale t. A OneHotEncoder turns a column into indicators, which are inputs
of the folded model in place of the column.
"""

from collections import UserList
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.feature_selection import SelectorMixin
from sklearn.frozen import FrozenEstimator
from sklearn.impute import SimpleImputer
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import (
    FunctionTransformer,
    MaxAbsScaler,
    MinMaxScaler,
    OneHotEncoder,
    RobustScaler,
    StandardScaler,
)
from sklearn.utils.validation import check_is_fitted

from .._sklearn import safe_indexing
from ..model import TSKModel
from ..naming import default_term_names, distinct
from ..options import policy_of
from .columns import Column, Level, Reader

_SCALERS = (StandardScaler, RobustScaler, MaxAbsScaler, MinMaxScaler)


def fold(estimator: Any) -> TSKModel:
    """Return the frozen model of an estimator, in the units of the columns it is given.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        An ANFIS estimator; a Pipeline that ends in one, after steps that scale every column alone,
        select columns, encode them (OneHotEncoder) or impute (SimpleImputer, which is not folded:
        the user of the model must impute), or a ColumnTransformer of these; a
        TransformedTargetRegressor of these whose transformer is such a scaler; a search such as
        GridSearchCV or a FrozenEstimator over these. A TSKModel is returned as it is.

    Returns
    -------
    model : TSKModel
        Its inputs are the raw columns that reach the model, in the order of X, with their names in
        X ("x0", "x1", ... if it has none). A one-hot encoded column is replaced by its indicators
        ("fibre_PM"). It predicts what ``estimator`` does, up to rounding errors.

    Raises
    ------
    ValueError, TypeError
        If a step cannot be folded (the message names it), or ``estimator`` is no such estimator.

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
    return _fold_with_reader(estimator)[0]


def fold_with_rows(estimator: Any, X: Any) -> tuple[TSKModel, Any]:
    """Return the folded model of :func:`fold`, and the rows of its inputs from a table.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
    X : array-like or DataFrame of shape (n_rows, n_features)
        Checked: columns other than in training, and numbers that are not finite, are refused. None
        gives no rows.

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
    model, read = _fold_with_reader(estimator)
    return model, None if X is None else read(X)


def _fold_with_reader(estimator: Any) -> tuple[TSKModel, Reader]:
    """Return the folded model of :func:`fold`, and the reader of its inputs from a table."""
    if isinstance(estimator, TSKModel):
        inputs = [Column(j, name) for j, name in enumerate(estimator.input_names)]
        places, names = list(range(len(inputs))), list(estimator.input_names)
        return estimator, Reader(inputs, places, [], names, True)
    (*steps, (label, last)), target_steps = _steps_of("", estimator)
    model = _model_of(label, last)
    steps = [(label, step) for label, step in steps if step not in (None, "passthrough")]
    first = steps[0][1] if steps else last
    given = getattr(first, "feature_names_in_", None)
    names = [f"x{j}" for j in range(first.n_features_in_)] if given is None else list(given)
    columns = [Column(j, name) for j, name in enumerate(names)]
    for label, step in steps:
        columns = _columns_after(label, step, columns)
    # Inputs are sorted by these keys, which must differ.
    keys = [(column.source, column.place) for column in columns]
    for column, key in zip(columns, keys, strict=True):
        if keys.count(key) > 1:
            raise ValueError(
                f"Column {column.name!r} reaches the model {keys.count(key)} times: its rules "
                "cannot be written with one membership per column. Let every column reach it once."
            )
    order = sorted(range(len(columns)), key=keys.__getitem__)
    # A raw column keeps its name, even if an indicator would be called the same, "fibre_PM".
    by_claim = sorted(order, key=lambda j: columns[j].level is not None)
    for j, name in zip(by_claim, distinct(columns[j].name for j in by_claim), strict=True):
        columns[j] = replace(columns[j], name=str(name))
    model = _with_raw_inputs(model, columns, np.array(order))
    for label, transformer in reversed(target_steps):
        model = _with_raw_target(model, label, transformer)
    inputs, before = [columns[j] for j in order], [step for _, step in steps]
    levels = {one.name: one.level for one in inputs if one.level is not None}
    return replace(model, levels=levels), Reader(inputs, order, before, names, given is not None)


def last_step(estimator: Any) -> Any:
    """The ANFIS estimator at the end of pipelines and searches, or a model; TypeError for none."""
    if isinstance(estimator, TSKModel):
        return estimator
    label, last = _steps_of("", estimator)[0][-1]
    _model_of(label, last)
    return last


def final_step(estimator: Any, X: Any = None) -> tuple[Any, Any]:
    """The last step inside searches, frozen estimators and Pipelines; and X transformed for it."""
    estimator = found_by_search(estimator)
    if not isinstance(estimator, Pipeline):
        return estimator, X
    for _, step in estimator.steps[:-1] if X is not None else ():
        X = X if step in (None, "passthrough") else step.transform(X)
    return final_step(estimator.steps[-1][1], X)


def found_by_search(estimator: Any) -> Any:
    """The best estimator of a search, or the one that is frozen; any other is returned as it is."""
    if isinstance(estimator, FrozenEstimator):
        return found_by_search(estimator.estimator)
    found = getattr(estimator, "best_estimator_", None)
    return estimator if found is None else found_by_search(found)


def _described(label, step):
    """A step for a message, by its name and class."""
    return f"step {label!r} ({type(step).__name__})" if label else type(step).__name__


def _steps_of(label, estimator):
    """The steps of nested pipelines one after the other, with the model's estimator last.

    Also the transformers of the target, from the outermost to the innermost.
    """
    estimator = found_by_search(estimator)
    if isinstance(estimator, TransformedTargetRegressor):
        check_is_fitted(estimator)
        steps, targets = _steps_of(label, estimator.regressor_)
        return steps, [(label, estimator.transformer_), *targets]
    if isinstance(estimator, Pipeline):
        parts = [_steps_of(name, step) for name, step in estimator.steps]
        return [step for steps, _ in parts for step in steps], parts[-1][1]
    return [(label, estimator)], []


def _columns_after(label, step, columns):
    if not columns or step in (None, "passthrough"):
        return columns
    step = found_by_search(step)
    if isinstance(step, Pipeline):
        for name, part in step.steps:
            columns = _columns_after(name, part, columns)
        return columns
    if read := {OneHotEncoder: _encoded, SimpleImputer: _imputed}.get(type(step)):
        return read(label, step, columns)
    if isinstance(step, SelectorMixin):
        return [columns[j] for j in step.get_support(indices=True)]
    if type(step) is ColumnTransformer:
        return [
            column
            for name, part, chosen in step.transformers_
            if part != "drop"
            for column in _columns_after(name, part, [columns[j] for j in _chosen(chosen, step)])
        ]
    units = _offsets_and_scales(label, step, len(columns))
    return [
        replace(column, offset=column.offset + column.scale * offset, scale=column.scale * scale)
        for column, (offset, scale) in zip(columns, units, strict=True)
    ]


def _imputed(label, imputer, columns):
    """The columns unchanged: rules do not depend on how missing values are filled."""
    if imputer.add_indicator or not pd.isna(imputer.missing_values):
        _refuse(label, imputer, "it needs add_indicator=False and missing_values=nan")
    if pd.isna(imputer.statistics_).any():
        _refuse(label, imputer, "it drops a column that has no values")
    return columns


def _encoded(label, encoder, columns):
    """Indicators in the place of the columns that an encoder is given."""
    if any(one.level or (one.offset, one.scale) != (0.0, 1.0) for one in columns):
        _refuse(label, encoder, "it must be given columns of the table as they are")
    sources = {column.name: column.source for column in columns}
    given = None if hasattr(encoder, "feature_names_in_") else list(sources)
    by_column = copy(encoder).set_params(feature_name_combiner=lambda name, _: name)
    of_each = (one.get_feature_names_out(given).tolist() for one in (by_column, encoder))
    # All levels are known only if unknown ones raise an error and none are merged.
    is_all = encoder.handle_unknown == "error" and not hasattr(encoder, "infrequent_categories_")
    known = dict(zip(sources, encoder.categories_, strict=True)) if is_all else {}
    found = []
    for place, (column, name) in enumerate(zip(*of_each, strict=True)):
        level = name.removeprefix(f"{column}_")
        others = [other for other in map(str, known.get(column, ())) if other != level]
        # A blank level is told in quotes: no reader sees it otherwise.
        level, *others = (one if one.strip() else repr(one) for one in (level, *others))
        told = Level(column, level, tuple(others))
        found.append(Column(sources[column], name, place=place, level=told))
    return found


def _chosen(chosen, transformer):
    """Positions of the columns that a ColumnTransformer's entry takes."""
    columns = getattr(transformer, "feature_names_in_", range(transformer.n_features_in_))
    places = pd.DataFrame([range(len(columns))], columns=columns)
    # Before scikit-learn 1.7 a remainder is a list of a special class.
    chosen = chosen.data if isinstance(chosen, UserList) else chosen
    return np.ravel(safe_indexing(places, chosen, axis=1))


def _offsets_and_scales(label, scaler, n_columns):
    """Offset and scale of x = offset + scale z, for every column of a fitted scaler."""
    kind = type(scaler)
    if getattr(scaler, "clip", False):
        _refuse(label, scaler, "clip=True bends it at the edge; out_of_bounds='clip' does the same")
    is_identity = kind is FunctionTransformer and not (scaler.func or scaler.inverse_func)
    if kind not in _SCALERS and not is_identity:
        _refuse(label, scaler, "it does not map every column alone by a positive scale")
    (offset,) = scaler.inverse_transform(np.zeros((1, n_columns)))
    scale = getattr(scaler, "scale_", None)
    scale = np.ones(n_columns) if scale is None else scale
    # The scale_ of MinMaxScaler is the inverse of the others'.
    return zip(offset, 1.0 / scale if kind is MinMaxScaler else scale, strict=True)


def _refuse(label, step, reason):
    raise ValueError(
        f"{_described(label, step)} cannot be folded into the rules: {reason}. StandardScaler, "
        "MinMaxScaler, MaxAbsScaler, RobustScaler, SimpleImputer, OneHotEncoder, column selections "
        "and ColumnTransformers of these can. For rules in the units of that step's output, give "
        "what is behind it: pipeline[-1], by name if it was fitted after "
        "pipeline.set_output(transform='pandas'), or regressor_ of a TransformedTargetRegressor."
    )


def _model_of(label, estimator):
    """The frozen model of the last step, with the estimator's present ``out_of_bounds``."""
    if isinstance(estimator, type) or not hasattr(estimator, "fit"):
        hint = " Its model is one." * isinstance(getattr(estimator, "model", None), TSKModel)
        raise TypeError(
            f"estimator must be a fitted ANFIS estimator, a Pipeline that ends in one, or a "
            f"TSKModel; got {estimator!r}.{hint}"
        )
    model = getattr(estimator, "model_", None)
    if not isinstance(model, TSKModel):
        check_is_fitted(estimator)
        why = ": search with refit=True" if getattr(estimator, "refit", True) is False else ""
        raise TypeError(
            f"estimator must be or end in an ANFIS estimator; {_described(label, estimator)} has "
            f"no rules{why}."
        )
    return model.with_out_of_bounds(*policy_of(estimator.out_of_bounds))


def _with_raw_inputs(model, columns, order):
    """The model with its inputs in raw units and in the order of their raw columns."""
    offset, scale = np.array([(column.offset, column.scale) for column in columns]).T
    support, posterior, at = model.support, model.posterior, model.tangent_at
    coefficients = model.coefficients.copy()
    if model.order:
        coefficients[:, 1:] = (coefficients[:, 1:] / scale[:, None])[:, order]
    # Computed edges are widened by a few rounding errors: the training rows stay inside.
    low, high = offset + scale * model.minimum, offset + scale * model.maximum
    is_computed = (offset != 0.0) | (scale != 1.0)
    few = 4.0 * np.finfo(float).eps * is_computed  # an edge at zero stays there
    low, high = (
        edge + side * few * np.maximum(np.abs(edge), np.abs(offset))
        for edge, side in ((low, -1.0), (high, 1.0))
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
        input_names=tuple(columns[j].name for j in order),
        posterior=posterior and posterior.change_units(model.antecedent, scale, order),
        tangent_at=at if at is None else np.clip(offset + scale * at, low, high)[order],
    )
    if model.term_names == default_term_names(model):
        # Scattered terms are named by their places, which change with the units.
        return replace(folded, term_names=default_term_names(folded))
    return folded


def _with_raw_target(model, label, transformer):
    """The model with its outputs as a scaler's inverse gives them."""
    label = f"{label}: transformer of the target" if label else "transformer of the target"
    outputs = [Column(k, name) for k, name in enumerate(model.output_names)]
    columns = _columns_after(label, transformer, outputs)
    if [column.source for column in columns] != list(range(model.n_outputs)):
        raise ValueError(
            f"{_described(label, transformer)} cannot be folded into the rules: it drops or moves "
            "columns of the target. A scaler such as StandardScaler can."
        )
    offset, scale = np.array([(column.offset, column.scale) for column in columns]).T
    coefficients = model.coefficients * scale
    coefficients[:, 0] += offset
    return replace(
        model,
        coefficients=coefficients,
        target=model.target and model.target.change_units(offset, scale),
        posterior=model.posterior and model.posterior.change_target_units(scale),
    )
