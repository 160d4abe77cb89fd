"""Rules, memberships and the explanation of predictions as pandas tables."""

from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._validation import check_choice
from ..export.folding import fold, fold_with_rows
from .rules import (
    choose_rules,
    conditions,
    consequents_about,
    premise_text,
    premises,
    warn_if_unreadable,
)

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
        What the constants of the consequents mean. "origin": the textbook form, p0 + p1 x1 + ...;
        "mean": the rule's value at the mean of the training inputs, which keeps more digits where
        a column lies far from the origin. The slopes are the same.
    sort_by : {"rule", "weight", "rows"}, default="rule"
        Order of the rules: by number, or the most important first.
    max_rules : int, default=None
        Give no more rules than this; None is all.
    min_weight : float, default=0.0
        Give only rules with at least this part of the weight of the training data, from 0 to 1.

    Returns
    -------
    table : DataFrame
        One row per rule, labelled by its number, with two levels of columns. ``"if"``: the term on
        each input that rules look at, missing where the rule does not. ``"data"``: "weight", the
        part of the weight of the training data on which the rule fires, and "rows", the number of
        training rows, by their weight, on which it is the strongest. ``"then y"``, for each output
        by its name: the "constant", and the slope by each input.

    Raises
    ------
    ValueError
        If a parameter is out of its range, or a step of a pipeline cannot be folded.
    TypeError
        If ``estimator`` has no rules.

    Warns
    -----
    ReadabilityWarning
        If the fit found that the rules cannot be read one by one; see ``readability_``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import rules_table
    >>> X, y = make_jang_sinc()
    >>> rules = rules_table(ANFISRegressor(n_mfs=2).fit(X, y))
    >>> rules["if"]
            x0    x1
    rule
    0      low   low
    1      low  high
    2     high   low
    3     high  high
    >>> float(rules["data"]["weight"].sum())
    1.0
    >>> list(rules["then y"])
    ['constant', 'x0', 'x1']
    """
    check_choice("about", about, ("origin", "mean"))
    model = fold(estimator)
    warn_if_unreadable(estimator, model)
    chosen = choose_rules(model, sort_by, max_rules, min_weight)
    reference = model.reference if about == "mean" else 0.0 * model.reference
    consequents = consequents_about(model, reference)
    by_rule, looked_at = premises(model)
    columns: dict = {
        ("if", model.input_names[j]): [model.term_names[r[j]] if j in r else None for r in by_rule]
        for j in looked_at
    }
    columns["data", "weight"] = model.rule_weights
    columns["data", "rows"] = model.rule_rows
    for k, output in enumerate(model.output_names):
        for i, name in enumerate(("constant", *model.input_names)):
            columns[f"then {output}", name] = consequents[:, i, k]
    table = pd.DataFrame(columns, index=pd.RangeIndex(model.n_rules, name="rule"))
    return table.iloc[chosen]


def memberships_table(estimator: Any, *, trained: bool = True) -> Any:
    """Tabulate the membership functions.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it.
    trained : bool, default=True
        Whether to tell the memberships after training, or as they were before it.

    Returns
    -------
    table : DataFrame
        One row per term, labelled by its number, with columns "input", "name", "function" and one
        for every parameter, in the units of the input (a bell's "slope" has none); missing where a
        family has no such parameter.

    Raises
    ------
    ValueError
        If a step of a pipeline cannot be folded.
    TypeError
        If ``estimator`` has no rules.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import memberships_table
    >>> X, y = make_jang_sinc()
    >>> memberships_table(ANFISRegressor(n_mfs=[2, 1]).fit(X, y), trained=False)
         input  name  function  center  width
    term
    0       x0   low  gaussian   -10.0   9.89
    1       x0  high  gaussian    10.0   9.89
    """
    terms = fold(estimator).memberships(trained)
    table = pd.DataFrame(terms, columns=None if terms else ["input", "name", "function"])
    return table.rename_axis(index="term")


def explain(estimator: Any, X: ArrayLike, *, min_strength: float = 0.0) -> Any:
    """Tell for each row which rules fired, by how much, and what each contributed.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows to explain, as ``estimator.predict`` takes them.
    min_strength : float, default=0.0
        Rules that fire with less than this on a row, from 0 to 1, are told in one line, "other
        rules".

    Returns
    -------
    table : DataFrame
        The strongest rule first, for each row and output. Columns:

        * "row": its position in X, from 0;
        * "output": the name of the output;
        * "rule": the rule's number, missing for other lines;
        * "if": its terms, "other rules", "beyond x" or "held" (see below);
        * "strength": the part that the rule has in the row; the sum over rules is one;
        * "value": what the rule says there;
        * "contribution": strength times value. **The sum of the contributions to a row's output is
          the prediction**, to rounding errors.

        A row outside the training range is explained at the nearest point in it. With
        ``out_of_bounds="linear"``, a line "beyond x" for each input that is outside has the way to
        the row: its "value" is the slope there, its "contribution" the slope times the distance, or
        times ``max_extrapolation`` standard deviations where that is less.
        With "nan" the values and contributions of such rows are missing. Where an output is held at
        the limits of its training, a line "held" has the difference to what the rules say.

    Raises
    ------
    ValueError
        If X is not finite, or has other columns than in training; if it is outside the training
        range and ``out_of_bounds="raise"``; if a step of a pipeline cannot be folded.
    TypeError
        If ``estimator`` has no rules.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import explain
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2).fit(X, y)
    >>> table = explain(model, X[:1])
    >>> table.drop(columns=["value", "contribution"])
       row output  rule                        if  strength
    0    0      y     0      x0 is low AND x1 is low   ...
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
    lines = [_rule_lines(model, strengths, values, min_strength)]
    said = np.einsum("nr,nro->no", strengths, values)
    if model.out_of_bounds == "linear" and not inside.all():
        way, gradient = model.way_out(rows), model.gradient(nearest)
        lines.append(_lines_beyond(model, way, gradient))
        said += np.einsum("nj,njo->no", way, gradient)
    low, high = model.output_limits
    lines.append(_lines_held(model, np.clip(said, low, high) - said))
    table = pd.concat(lines).sort_values(["row", "output", "place"], kind="stable")
    table["output"] = np.array(model.output_names, dtype=object)[table["output"]]
    table["rule"] = table["rule"].astype("Int64")
    return table.drop(columns="place").reset_index(drop=True)


def rule_values(model, rows):
    """f_r at rows in the box, shape (n_rows, n_rules, n_outputs)."""
    constant, slopes = model.coefficients[:, 0], model.coefficients[:, 1:]
    if not model.order:
        return np.tile(constant, (len(rows), 1, 1))
    return constant + np.einsum("nj,rjo->nro", rows - model.reference, slopes)


def _rule_lines(model, strengths, values, min_strength):
    """A line for each rule that fires on a row, by falling strength, and one for all others."""
    premises = np.array([premise_text(model, rule) for rule in conditions(model)], dtype=object)
    _, n_rules, n_outputs = values.shape
    order = np.argsort(-strengths, axis=1, kind="stable")
    contributions = strengths[:, :, None] * values
    told = np.take_along_axis(strengths, order, axis=1) >= min_strength
    row, place, output = np.nonzero(np.repeat(told[:, :, None], n_outputs, axis=2))
    rule = order[row, place]
    fired = _lines(
        row,
        output,
        premises[rule],
        contributions[row, rule, output],
        place,
        rule=rule,
        strength=strengths[row, rule],
        value=values[row, rule, output],
    )
    silent = strengths < min_strength
    row, output = np.nonzero(np.repeat(silent.any(axis=1)[:, None], n_outputs, axis=1))
    said = (contributions * silent[:, :, None]).sum(axis=1)[row, output]
    strength = (strengths * silent).sum(axis=1)[row]
    others = _lines(row, output, "other rules", said, n_rules, strength=strength)
    return pd.concat([fired, others]) if len(others) else fired


def _lines_held(model, change):
    """A line for each output that is held at its limit."""
    row, output = np.nonzero(np.nan_to_num(change))
    place = model.n_rules + 1 + model.n_inputs
    return _lines(row, output, np.full(row.size, "held", dtype=object), change[row, output], place)


def _lines_beyond(model, distance, gradient):
    """A line for each input that lies outside the box: the way along the tangent."""
    row, j, output = np.nonzero(np.repeat((distance != 0.0)[:, :, None], model.n_outputs, axis=2))
    names = np.array([f"beyond {name}" for name in model.input_names], dtype=object)
    slope = gradient[row, j, output]
    said, place = slope * distance[row, j], model.n_rules + 1 + j
    return _lines(row, output, names[j], said, place, value=slope)


def _lines(row, output, what, contribution, place, *, rule=np.nan, strength=np.nan, value=np.nan):
    """Lines of an explanation, in the order of their places."""
    return pd.DataFrame(
        {
            "row": row,
            "output": output,
            "rule": rule,
            "if": what,
            "strength": strength,
            "value": value,
            "contribution": contribution,
            "place": place,
        }
    )
