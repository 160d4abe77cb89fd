"""Rules, memberships and the explanation of predictions as pandas tables."""

from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._validation import check_choice
from ..export.folding import fold, fold_with_rows
from .rules import choose_rules, premise_texts, rule_values, rules_frame, warn_of_findings

__all__ = ["explain", "memberships_table", "rules_table"]


def rules_table(
    estimator: Any,
    *,
    about: str = "origin",
    sort_by: str = "rule",
    max_rules: int | None = None,
    min_weight: float = 0.0,
) -> Any:
    """Tabulate the rules: what they ask, how much of the data they hold for, what they say.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    about : {"origin", "mean"}, default="origin"
        Where the constants are the rule's value: at the origin, or the mean of the training inputs.
    sort_by, max_rules, min_weight : {"rule", "weight", "rows"}, int or None, float
        Which rules, in which order, as of :func:`export_text`; all by their number.

    Returns
    -------
    table : DataFrame
        One row per rule, by its number, with two levels of columns. ``"if"``: the term on each
        input, missing where the rule does not look at it. ``"data"``: "weight", the part of the
        training data on which it fires, and "rows", the number of rows on which it is the
        strongest. ``"then y"``, per output: the "constant", and the slope by each input.

    Raises
    ------
    ValueError
        If a parameter is out of its range, or a step of a pipeline cannot be folded.

    Warns
    -----
    ReadabilityWarning
        If the fit found that the rules cannot be read one by one; see ``readability_``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import rules_table
    >>> rules = rules_table(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc()))
    >>> list(rules["if", "x1"])
    ['low', 'high', 'low', 'high']
    >>> list(rules["then y"])
    ['constant', 'x0', 'x1']
    """
    check_choice("about", about, ("origin", "mean"))
    model = fold(estimator)
    warn_of_findings(estimator, model)
    reference = model.reference if about == "mean" else 0.0 * model.reference
    return choose_rules(rules_frame(model, reference), sort_by, max_rules, min_weight)


def memberships_table(estimator: Any, *, trained: bool = True) -> Any:
    """Tabulate the membership functions.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it.
    trained : bool, default=True
        Whether to give the memberships after training, or as they were before it.

    Returns
    -------
    table : DataFrame
        One row per term, by its number: "input", "name", "function", and every parameter in the
        units of the input, missing where a family has none such.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import memberships_table
    >>> model = ANFISRegressor(n_mfs=[2, 1]).fit(*make_jang_sinc())
    >>> memberships_table(model, trained=False)
         input  name  function  center  width
    term
    0       x0   low  gaussian   -10.0   9.89
    1       x0  high  gaussian    10.0   9.89
    """
    terms = fold(estimator).memberships(trained)
    table = pd.DataFrame(terms, columns=None if terms else ["input", "name", "function"])
    return table.rename_axis(index="term")


def explain(estimator: Any, X: ArrayLike, *, min_strength: float = 0.0) -> Any:
    """Tabulate which rules made each prediction, and what each contributed.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows to explain, as ``estimator.predict`` takes them.
    min_strength : float, default=0.0
        Rules that fire with less than this on a row, from 0 to 1, share one line, "other rules".

    Returns
    -------
    table : DataFrame
        For each row and output the strongest rule first: "row", its position in X; "output";
        "rule", its number; "if", its terms; "strength", its part in the row; "value", what it says
        there; "contribution", strength times value. **The sum of the contributions is the
        prediction**. Lines without a number are "other rules", "held" at the limits of training,
        and "beyond x", the way from the nearest point of the range along the tangent. With
        ``out_of_bounds="nan"`` rows outside have missing values.

    Raises
    ------
    ValueError
        If X does not fit the model, or lies outside the range with ``out_of_bounds="raise"``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import explain
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2).fit(X, y)
    >>> table = explain(model, X[:1])
    >>> table["if"][0]
    'x0 is low AND x1 is low'
    >>> bool(abs(table["contribution"].sum() - model.predict(X[:1])[0]) < 1e-12)
    True
    """
    if not isinstance(min_strength, Real) or not 0.0 <= float(min_strength) <= 1.0:
        raise ValueError(f"min_strength={min_strength!r} must be a number from 0 to 1.")
    model, rows = fold_with_rows(estimator, X)
    inside = model.in_bounds(rows)
    if model.out_of_bounds == "raise" and not inside.all():
        raise ValueError(model.describe_out_of_bounds(rows))
    nearest = np.clip(rows, model.minimum, model.maximum)
    strengths = model.strengths(nearest)
    values = rule_values(model, nearest)
    if model.out_of_bounds == "nan":
        values[~inside] = np.nan
    order = np.argsort(-strengths, axis=1, kind="stable")
    sorted_strengths = np.take_along_axis(strengths, order, axis=1)
    sorted_values = np.take_along_axis(values, order[:, :, None], axis=1)
    weak = strengths < min_strength
    n_rows, (n_rules, n_inputs) = len(rows), (model.n_rules, model.n_inputs)
    way, gradient = np.zeros((n_rows, n_inputs)), np.zeros((n_rows, n_inputs, model.n_outputs))
    if model.out_of_bounds == "linear" and not inside.all():
        way, gradient = model.way_out(rows), model.gradient(nearest)
    beyond = way[:, :, None] * gradient
    said = np.einsum("nr,nro->no", strengths, values) + beyond.sum(axis=1)
    held = np.nan_to_num(np.clip(said, *model.output_limits) - said)
    others = np.einsum("nr,nro->no", weak, strengths[:, :, None] * values)
    # By row, and for all that may have a line there: the rules, others, beyond each input, held.
    missing = np.full((n_rows, 1), np.nan)
    strength = np.hstack(
        [sorted_strengths, (strengths * weak).sum(axis=1, keepdims=True), np.nan * way, missing]
    )
    unknown = np.full((n_rows, 1, model.n_outputs), np.nan)
    value = np.hstack([sorted_values, unknown, gradient, unknown])
    contribution = np.hstack(
        [sorted_strengths[:, :, None] * sorted_values, others[:, None], beyond, held[:, None]]
    )
    has_line = np.hstack([sorted_strengths >= min_strength, weak.any(axis=1)[:, None], way != 0.0])
    has_line = np.repeat(has_line[:, :, None], model.n_outputs, axis=2)
    has_line = np.hstack([has_line, held[:, None] != 0.0])
    row, output, place = np.nonzero(has_line.transpose(0, 2, 1))
    # Numbers of rules first, then those of the other lines.
    source = np.hstack([order, np.tile(np.arange(n_rules, strength.shape[1]), (n_rows, 1))])
    source = source[row, place]
    texts = premise_texts(rules_frame(model, model.reference))
    texts += ["other rules", *(f"beyond {name}" for name in model.input_names), "held"]
    return pd.DataFrame(
        {
            "row": row,
            "output": np.array(model.output_names, dtype=object)[output],
            "rule": pd.Series(source, dtype="Int64").where(source < n_rules),
            "if": np.array(texts, dtype=object)[source],
            "strength": strength[row, place],
            "value": value[row, place, output],
            "contribution": contribution[row, place, output],
        }
    )
