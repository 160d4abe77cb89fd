"""The rules in words and in tables: conditions, values, and which of them fired on a row."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._validation import check_count
from ..digits import MOST_DIGITS
from ..export import fold, fold_with_rows
from .sentences import Sentences


def conditions(model):
    """The conditions of each rule, from the position of an input to its terms, "> 6.8 ± 0.3"."""
    inputs, names = model.antecedent.term_inputs, model.term_names
    rules: list[dict[int, str]] = [{} for _ in range(model.n_rules)]
    for rule, terms in zip(rules, model.antecedent.rule_terms.tolist(), strict=True):
        for t in terms:
            if t >= 0:
                before = f"{rule[inputs[t]]} and " if inputs[t] in rule else ""
                rule[inputs[t]] = before + names[t]
    return [dict(sorted(rule.items())) for rule in rules]


def premise_texts(model):
    """Say "temperature is low AND rate > 6.8 ± 0.3"; "anything" for a rule without conditions."""
    return [
        " AND ".join(condition(model, j, term) for j, term in rule.items()) or "anything"
        for rule in conditions(model)
    ]


def condition(model, j, term):
    """Say "temperature is low", "rate > 6.8 ± 0.3", or, for an indicator, "fibre is not PM"."""
    name = model.input_names[j]
    if term in ("0", "1") and name in model.levels:
        return model.levels[name].said(term == "1")
    return f"{name} {term}" if term.startswith(("<", ">")) else f"{name} is {term}"


def shown_rules(model, max_shown):
    """The rules to show, first those that are the strongest on most rows."""
    if max_shown is not None:
        check_count("max_shown", max_shown, 1)
    # Rounded, so that rounding errors do not change the order of rules that are alike.
    keys = [-np.round(key, 9) for key in (model.rule_weights, parts_led(model))]
    return np.lexsort(keys)[:max_shown].tolist()


def has_training_data(model):
    """Whether the model knows its training data; one from a .fis file does not."""
    return bool(np.any(model.rule_rows))


def parts_led(model):
    """Part of the training rows on which each rule is the strongest; without data, its weight."""
    rows = model.rule_rows
    return rows / rows.sum() if has_training_data(model) else model.rule_weights


def rename(model, feature_names, output_names):
    """The model with other names of inputs and outputs, if given."""
    for kind, parameter, names in (
        ("input_names", "feature_names", feature_names),
        ("output_names", "output_names", output_names),
    ):
        if names is None:
            continue
        is_list = np.iterable(names) and not isinstance(names, str)
        if not is_list or not all(isinstance(name, str) for name in names):
            raise TypeError(f"{parameter} must be a sequence of str, got {names!r}.")
        count = len(getattr(model, kind))
        if len(names) != count or len(set(names)) != count:
            own = ", ".join(map(repr, getattr(model, kind)))
            raise ValueError(
                f"{parameter}={list(names)!r} must hold one name for each of {own}, all different."
            )
        model = replace(model, **{kind: tuple(names)})
    return model


def rules_table(estimator: Any) -> Any:
    """Tabulate the rules: their conditions, their part of the data, and their values.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.

    Returns
    -------
    table : DataFrame
        One row per rule, by its number, with two levels of columns. ``"if"``: the condition of the
        text on each input, missing if there is none. ``"data"``: "weight", the part of the training
        data on which it fires, and "rows", the number of rows on which it is the strongest.
        ``"at"``: its centre, the mean of the rows weighted by its strength, or a place near it.
        ``"then y"``, per output: the rule's "value" there, and its slope by each input.

    Raises
    ------
    ValueError, TypeError
        As :func:`skanfis.export.fold`.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import rules_table
    >>> rules = rules_table(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc()))
    >>> list(rules["if", "x1"])
    ['low', 'high', 'low', 'high']
    >>> list(rules["then y"])
    ['value', 'x0', 'x1']
    """
    model = fold(estimator)
    said, names = Sentences.of(model, MOST_DIGITS), list(model.input_names)
    asked = pd.DataFrame(conditions(Sentences.of(model).model)).sort_index(axis=1)
    parts = {
        "if": asked.rename(columns=dict(enumerate(names))),
        "data": pd.DataFrame({"weight": model.rule_weights, "rows": model.rule_rows}),
        "at": pd.DataFrame(said.places, columns=names),
    }
    for k, output in enumerate(model.output_names):
        numbers = np.column_stack([said.values[:, k], said.slopes[:, :, k]])
        parts[f"then {output}"] = pd.DataFrame(numbers, columns=["value", *names])
    return pd.concat(parts, axis=1).rename_axis("rule")


def explain(estimator: Any, X: ArrayLike) -> Any:
    """Tabulate which rules made each prediction, and what each contributed.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    X : array-like of shape (n_samples, n_features)
        Rows to explain, as ``estimator.predict`` takes them.

    Returns
    -------
    table : DataFrame
        One line per row, output and rule, the strongest rule first: "row", the position in X;
        "output"; "rule", its number; "if", its conditions; "strength", its normalised strength;
        "value", its value there; "contribution", strength times value. **The sum of the
        contributions is the prediction**. Lines without a rule are "beyond x", the change along the
        tangent from the nearest point of the range, and "held", the change by the limits of
        outputs. With ``out_of_bounds="nan"`` rows outside have missing values.

    Raises
    ------
    ValueError, TypeError
        As :func:`skanfis.export.fold`; if X does not fit, or ``out_of_bounds="raise"`` refuses it.

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
    model, rows = fold_with_rows(estimator, X)
    inside = model.in_bounds(rows)
    if model.out_of_bounds == "raise" and not inside.all():
        raise ValueError(model.describe_out_of_bounds(rows))
    nearest = np.clip(rows, model.minimum, model.maximum)
    strengths = model.strengths(nearest)
    values = np.einsum("bn,rbo->nor", model.basis(nearest.T), model.coefficients)
    if model.out_of_bounds == "nan":
        values[~inside] = np.nan
    contributions = strengths[:, None] * values
    row, output, rule = map(np.ravel, np.indices(values.shape))
    premises = np.array(premise_texts(Sentences.of(model).model), dtype=object)
    lines = {"row": row, "output": output, "rule": rule, "if": premises[rule]}
    lines |= {"strength": strengths[row, rule], "value": values.ravel()}
    tables, said = [lines | {"contribution": contributions.ravel()}], contributions.sum(axis=2)
    if model.out_of_bounds == "linear" and not inside.all():
        way, slopes = model.way_out(rows), model.tangent_slopes(nearest).transpose(0, 2, 1)
        changes = way[:, None] * slopes
        row, output, j = np.nonzero(np.broadcast_to(way[:, None] != 0.0, slopes.shape))
        lines = {"row": row, "output": output, "value": slopes[row, output, j]}
        lines["if"] = [f"beyond {model.input_names[k]}" for k in j]
        tables.append(lines | {"contribution": changes[row, output, j]})
        said += changes.sum(axis=2)
    held = np.nan_to_num(np.clip(said, *model.output_limits) - said)
    if held.any():
        row, output = np.nonzero(held)
        lines = {"row": row, "output": output, "if": "held"}
        tables.append(lines | {"contribution": held[row, output]})
    # The strongest rule first; lines without a strength last.
    table = pd.concat(map(pd.DataFrame, tables)).sort_values(
        ["row", "output", "strength"], ascending=[True, True, False], ignore_index=True
    )
    names = np.array(model.output_names, dtype=object)
    return table.assign(output=names[table["output"]], rule=table["rule"].astype("Int64"))
