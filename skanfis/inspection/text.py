"""Rules as text, and as HTML for notebooks."""

from collections.abc import Sequence
from html import escape
from math import floor, log10
from typing import Any

import numpy as np
import pandas as pd

from .._validation import check_choice, check_count
from ..export import fold
from .rules import (
    has_training_data,
    premise_texts,
    readability_in_training,
    rename,
    rounded_reference,
    rules_frame,
    warn_of_findings,
    weightiest,
    writable,
)

# More than these give back no other double.
_MOST_DIGITS = 17
_IN_PLACE = "It is added to what a rule says; a slope that a rule states stands in its place."


def export_text(
    estimator: Any,
    *,
    precision: int = 4,
    about: str = "mean",
    max_shown: int | None = None,
    show_terms: bool = True,
    feature_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
) -> str:
    """Write the rules as IF-THEN sentences in the units of the data.

    Sentences and terms are the whole model: :doc:`/inspection`.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    precision : int, default=4
        Significant digits, from 1 to 17. Slopes that move no such digit are left out.
    about : {"mean", "origin"}, default="mean"
        Consequents by the inputs' distances from a round number near their mean, ``1.2 + 0.3 *
        (temperature - 290)``, or in the textbook form, ``-85.8 + 0.3 * temperature``.
    max_shown : int, default=None
        Most rules to write, the weightiest first; None for all.
    show_terms : bool, default=True
        Whether to write the terms' parameters, the ranges, the policy outside them, and the noise.
    feature_names, output_names : sequence of str, default=None
        Other names of the inputs and the outputs; None for the model's.

    Returns
    -------
    text : str
        Rules by their number, with the part of the training data on which each fires, and the
        number of rows on which it is the strongest. A last line says what was left out.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range, a step cannot be folded, or there are no rules.

    Warns
    -----
    ReadabilityWarning
        If the fit found that the rules cannot be read one by one; see ``readability_``.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.inspection import export_text
    >>> hours = np.linspace(0.0, 10.0, 41).reshape(-1, 1)
    >>> drift = 0.1 * hours[:, 0] + 5.0 * np.exp(-hours[:, 0])
    >>> model = ANFISRegressor(n_mfs=2, solver="lse", agreement=0.1).fit(hours, drift)
    >>> print(export_text(model, precision=3, feature_names=["hours"], show_terms=False))
    2 rules, 1 input.
    <BLANKLINE>
    Rule 0, 50 % of the weight, strongest on 21 rows:
      IF hours is low
      THEN y = 0.338 - 0.555 * (hours - 5)
    <BLANKLINE>
    Rule 1, 50 % of the weight, strongest on 20 rows:
      IF hours is high
      THEN y = 0.649 + 0.195 * (hours - 5)
    """
    check_count("precision", precision, 1, _MOST_DIGITS)
    check_choice("about", about, ("mean", "origin"))
    model = rename(fold(estimator), feature_names, output_names)
    warn_of_findings(estimator, model)
    reference = rounded_reference(model) if about == "mean" else 0.0 * model.reference
    frame = rules_frame(model, reference)
    chosen = weightiest(frame, max_shown)
    consequents, common = _consequent_texts(model, frame, reference, precision)
    parts = [f"{_count(model.n_rules, 'rule')}, {_count(model.n_inputs, 'input')}."]
    parts += [f"Common to the rules, {name}: {text}" for name, text in common.items()]
    if common:
        parts[-1] += f"\n{_IN_PLACE}"
    for r, premise in zip(chosen.index, premise_texts(chosen), strict=True):
        heading = f"Rule {r}"
        if has_training_data(model):
            rows = rows_text(model.rule_rows[r])
            share = f"{100.0 * model.rule_weights[r]:.3g} %"
            heading += f", {share} of the weight, strongest on {rows}"
        then = "\n   AND ".join(f"{name} = {texts[r]}" for name, texts in consequents.items())
        parts.append(f"{heading}:\n  IF {premise}\n  THEN {then}")
    if len(chosen) < model.n_rules:
        parts.append(f"{_left_out(model, chosen)} left out.")
    if show_terms:
        parts.append(_legend(model, precision))
    return "\n\n".join(parts)


def rules_html(estimator: Any, *, max_shown: int = 10, precision: int = 4) -> str:
    """Write the rules as HTML, the weightiest first.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    max_shown : int, default=10
        Most rules to show; a last line says what was left out.
    precision : int, default=4
        Significant digits of the numbers, from 1 to 17.

    Returns
    -------
    html : str
        One ``<div>``, with names escaped, and nothing to run or to load; ``readability_`` below.

    Raises
    ------
    ValueError, TypeError
        If a number is out of its range, a step cannot be folded, or there are no rules.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import rules_html
    >>> rules_html(ANFISRegressor(n_mfs=3).fit(*make_jang_sinc())).count("</tr>")
    11
    """
    check_count("precision", precision, 1, _MOST_DIGITS)
    model = writable(fold(estimator))
    reference = rounded_reference(model)
    frame = rules_frame(model, reference)
    chosen = weightiest(frame, max_shown)
    consequents, common = _consequent_texts(model, frame, reference, precision)
    cells: dict = {}
    if has_training_data(model):
        notes = np.where(chosen["data", "rows"] < 0.5, " (no row)", "")
        shares = zip(chosen["data", "weight"], notes, strict=True)
        cells["data", "weight"] = [f"{100.0 * share:.3g} %{note}" for share, note in shares]
    for name in chosen.get("if", ()):
        low, high = range_text(model, model.input_names.index(name), precision)
        cells["if", f"{name}, {low} to {high}"] = chosen["if", name].fillna("any")
    for name, texts in consequents.items():
        cells["then", name] = [texts[r] for r in chosen.index]
    with pd.option_context("display.max_colwidth", None):
        table = pd.DataFrame(cells, index=list(chosen.index))
        table = table.rename_axis(columns=["", "rule"]).to_html(border=0, justify="left")
    counts = f"<b>{_count(model.n_rules, 'rule')}</b> on {_count(model.n_inputs, 'input')}"
    parts = [f"<div>{counts}</div>", table]
    parts += [
        f"<div>common to the rules, {escape(name)}: {escape(text)}. {_IN_PLACE}</div>"
        for name, text in common.items()
    ]
    if len(chosen) < model.n_rules:
        parts.append(f"<div>and {_left_out(model, chosen)}</div>")
    found = readability_in_training(estimator, model)
    parts += [f"<div>{escape(line)}</div>" for line in str(found or "").splitlines()]
    style = "font-family:sans-serif;font-size:90%;margin:0.5em 0"
    return f'<div style="{style}">{"".join(parts)}</div>'


def _consequent_texts(model, frame, reference, precision):
    """By output and rule "a + b * (x - x0) + ..."; by output what all rules have in common."""
    texts, common = {}, {}
    is_common = np.pad(model.common_slopes, ((0, 0), (1, 0)))
    first = is_common.argmax(axis=0), np.arange(1 + model.n_inputs)
    for output in model.output_names:
        values = frame[f"then {output}"].to_numpy(copy=True)
        # Slopes that move the output by less than the last digit written.
        change = np.abs(values[:, 1:]) * (model.maximum - model.minimum)
        scale = max(np.abs(values[:, 0]).max(), change.max(initial=0.0))
        is_small = change < 10.0 ** -(precision + 2) * scale
        # Where others have one in common, it would be taken for theirs.
        is_small &= is_small.all(axis=0) | ~is_common[:, 1:].any(axis=0)
        values[:, 1:][is_small] = 0.0
        line = np.where(is_common.any(axis=0), values[first], 0.0)
        if line.any():
            common[output] = _formula(line, model.input_names, reference, precision)
        values[is_common] = 0.0
        texts[output] = [_formula(row, model.input_names, reference, precision) for row in values]
    return texts, common


def _formula(coefficients, input_names, reference, precision):
    text = number(coefficients[0], precision) if coefficients[0] else ""
    for name, slope, origin in zip(input_names, coefficients[1:], reference, strict=True):
        if slope == 0.0:
            continue
        # A name such as "rate / s" would be read as arithmetic.
        factor = name if name.isidentifier() else f"[{name}]"
        if origin != 0.0:
            factor = f"({factor} {'-' if origin > 0.0 else '+'} {abs(origin):.15g})"
        sign = "-" if slope < 0.0 else "+"
        text += f" {sign} {number(abs(slope), precision)} * {factor}"
    return text.removeprefix(" + ").removeprefix(" ") or number(0.0, precision)


def _legend(model, precision):
    lines = ["Terms:"]
    memberships = model.memberships()
    for j, name in enumerate(model.input_names):
        low, high = range_text(model, j, precision)
        heading = f"  {name}, trained from {low} to {high}"
        terms = [term for term in memberships if term["input"] == name]
        lines.append(heading if terms else f"{heading}: no terms")
        width = max((len(term["name"]) for term in terms), default=0)
        lines += [
            f"    {term['name'] + ':':<{width + 1}} {_term_text(term, precision)}" for term in terms
        ]
    lines.append(f"Outside these ranges: {model.policy}.")
    for name, low, high in zip(model.output_names, *model.output_limits, strict=True):
        ends = [low, high]
        if np.isfinite(ends).all():
            written = [place(end, precision, (high - low) or abs(high) or 1.0) for end in ends]
        else:
            written = [number(end, precision) for end in ends]
        if np.isfinite(ends).any():
            limits = " to ".join(written)
            lines.append(f"Held within the limits of its training: {name}, {limits}.")
    if model.posterior is not None:
        noise = zip(model.output_names, model.posterior.noise, strict=True)
        values = ", ".join(f"{name} {number(value, precision)}" for name, value in noise)
        lines.append(f"Standard deviation of the noise about the rules: {values}.")
    return "\n".join(lines)


def _term_text(term, precision):
    """Write "gaussian, center 21.3, width 4.2" of an entry of TSKModel.memberships."""
    numbers = {k: v for k, v in term.items() if k not in ("input", "name", "function")}
    location, *lengths = numbers.values()
    written = [place(location, precision, lengths[0])]
    written += [number(length, precision) for length in lengths]
    pairs = zip(numbers, written, strict=True)
    return ", ".join([term["function"], *(f"{name} {value}" for name, value in pairs)])


def _left_out(model, chosen):
    text = _count(model.n_rules - len(chosen), "rule")
    if not has_training_data(model):
        return text
    weight = max(1.0 - chosen["data", "weight"].sum(), 0.0)
    return f"{text} with {100.0 * weight:.3g} % of the weight"


def range_text(model, j, precision):
    """Lowest and highest value of input j in training."""
    low, high = model.minimum[j], model.maximum[j]
    return [place(edge, precision, (high - low) or model.spread[j]) for edge in (low, high)]


def number(value, precision):
    """Write so many significant digits, without an exponent while there is room."""
    rounded = float(f"{float(value):.{precision - 1}e}")
    return f"{rounded:.{max(precision, 15)}g}"


def place(value, precision, resolution):
    """Write a place on an axis, to so many digits of a length that matters there."""
    rounded = round(float(value), precision - floor(log10(resolution)))
    return repr(rounded + 0.0).removesuffix(".0")


def rows_text(count):
    """Write "13 rows"; weights make fractions of rows."""
    return _count(f"{count:.0f}" if count >= 10.0 else f"{count:.2g}", "row")


def _count(number_of, what):
    return f"{number_of} {what}" + ("" if str(number_of) == "1" else "s")
