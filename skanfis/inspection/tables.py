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
        Where the constants of the consequents are the rule's value: at the origin, as in textbooks,
        or at the mean of the training inputs, with more digits. The slopes are the same.
    sort_by, max_rules, min_weight : {"rule", "weight", "rows"}, int or None, float
        Which rules, and in which order, as :func:`export_text` takes them; all by their number.

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
        One row per term, labelled by its number, with columns "input", "name", "function" and one
        for every parameter, in the units of the input (a bell's "slope" has none); missing where a
        family has no such parameter.

    Raises
    ------
    ValueError
        If a step of a pipeline cannot be folded.

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
        The strongest rule first, for each row and output. Columns: "row", its position in X;
        "output", its name; "rule", the rule's number; "if", its terms; "strength", its part in the
        row, which sums to one over the rules; "value", what it says there; "contribution", strength
        times value. **The sum of the contributions to a row's output is the prediction**, to
        rounding errors.

        Lines without a number: "other rules" (see ``min_strength``); "held", where the output is
        held at the limits of its training, with the difference to what the rules say; and of a
        row outside the training range, which is explained at the nearest point in it, "beyond x"
        for each input that is outside, with ``out_of_bounds="linear"``: its "value" is the slope
        there, its "contribution" the slope times the distance, or times ``max_extrapolation``
        standard deviations where that is less. With "nan" such rows have missing values.

    Raises
    ------
    ValueError
        If X is not finite, or has other columns than in training; if it is outside the training
        range and ``out_of_bounds="raise"``; if a step of a pipeline cannot be folded.

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
    lines = _rule_lines(model, strengths, values, min_strength)
    said = np.einsum("nr,nro->no", strengths, values)
    if model.out_of_bounds == "linear" and not inside.all():
        way, gradient = model.way_out(rows), model.gradient(nearest)
        beyond = way[:, :, None] * gradient
        row, j, output = np.nonzero(np.repeat(way[:, :, None] != 0.0, model.n_outputs, axis=2))
        names = np.array([f"beyond {name}" for name in model.input_names], dtype=object)
        cell = (row, j, output)
        lines.append(_lines(row, output, names[j], beyond[cell], value=gradient[cell]))
        said += beyond.sum(axis=1)
    held = np.nan_to_num(np.clip(said, *model.output_limits) - said)
    row, output = np.nonzero(held)
    lines.append(_lines(row, output, "held", held[row, output]))
    # Sorted by row and output alone, lines stay in the order in which they were made.
    table = pd.concat([part for part in lines if len(part)] or lines[:1], ignore_index=True)
    table = table.sort_values(["row", "output"], kind="stable", ignore_index=True)
    table["output"] = np.array(model.output_names, dtype=object)[table["output"]]
    return table


def _rule_lines(model, strengths, values, min_strength):
    """A line for each rule that fires on a row, by falling strength, and one for all others."""
    premises = np.array(premise_texts(rules_frame(model, model.reference)), dtype=object)
    contributions = strengths[:, :, None] * values
    order = np.argsort(-strengths, axis=1, kind="stable")
    fires = np.take_along_axis(strengths, order, axis=1) >= min_strength
    row, place, output = np.nonzero(np.repeat(fires[:, :, None], model.n_outputs, axis=2))
    rule = order[row, place]
    cell = (row, rule, output)
    fired = _lines(
        row,
        output,
        premises[rule],
        contributions[cell],
        rule=rule,
        strength=strengths[row, rule],
        value=values[cell],
    )
    weak = strengths < min_strength
    row, output = np.nonzero(np.repeat(weak.any(axis=1)[:, None], model.n_outputs, axis=1))
    total = np.einsum("nr,nro->no", weak, contributions)[row, output]
    others = _lines(row, output, "other rules", total, strength=(strengths * weak).sum(axis=1)[row])
    return [fired, others]


def _lines(row, output, what, contribution, *, rule=None, strength=np.nan, value=np.nan):
    """Lines of an explanation."""
    return pd.DataFrame(
        {
            "row": row,
            "output": output,
            "rule": pd.array([pd.NA] * len(row) if rule is None else rule, dtype="Int64"),
            "if": np.full(len(row), what, dtype=object) if isinstance(what, str) else what,
            "strength": strength,
            "value": value,
            "contribution": contribution,
        }
    )
