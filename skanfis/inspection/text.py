"""Rules as text."""

from collections.abc import Sequence
from math import floor, log10
from typing import Any

import numpy as np

from .._validation import check_choice, check_count
from ..export.folding import fold
from .rules import (
    choose_rules,
    conditions,
    consequents_about,
    knows_data,
    premise_text,
    renamed,
    round_reference,
    warn_if_unreadable,
)

__all__ = ["consequent_text", "count_text", "export_text", "range_text", "rows_text", "term_text"]

# More than these give back no other double.
_MOST_DIGITS = 17


def export_text(
    estimator: Any,
    *,
    precision: int = 4,
    about: str = "mean",
    sort_by: str = "weight",
    max_rules: int | None = None,
    min_weight: float = 0.0,
    show_terms: bool = True,
    feature_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
) -> str:
    """Write the rules as IF-THEN sentences in the units of the data.

    The sentences and the terms' parameters are the whole model: the output is the mean of the
    rules' values, weighted by the products of the memberships of their terms.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    precision : int, default=4
        Significant digits of the numbers, from 1 to 17. Places on an input's axis get as many more
        as it takes to tell them to this part of the term's width. Slopes whose effect over the
        whole range of the input is beyond these digits of the output are left out.
    about : {"mean", "origin"}, default="mean"
        How consequents are written. "mean": by the inputs' distances from a round number near their
        mean, ``1.2 + 0.3 * (temperature - 290)``, so that the digits of the constant say something
        about the data. "origin": in the textbook form, ``-85.8 + 0.3 * temperature``, the numbers
        of ``consequents_``.
    sort_by : {"weight", "rows", "rule"}, default="weight"
        "weight": rules that fire on more of the training data come first; "rows": by the number of
        rows on which they are the strongest; "rule": as they are numbered.
    max_rules : int, default=None
        Write no more rules than this; None is all. A last line says what was left out.
    min_weight : float, default=0.0
        Write only rules that fire on at least this part of the weight of the training data, from 0
        to 1.
    show_terms : bool, default=True
        Whether to write the terms' parameters, the ranges of the inputs, the policy outside them,
        and the noise, where a fit has found it.
    feature_names : sequence of str, default=None
        Names of the inputs; None for those in training.
    output_names : sequence of str, default=None
        Names of the outputs; None for the model's, "y" or "y0", "y1", ...

    Returns
    -------
    text : str
        Rules by their number, from 0, as in ``rules_`` and ``consequents_``; with the part of the
        weight of the training data on which each fires, and the number of training rows on which it
        is the strongest; these two are left out where a model that was read from a file
        knows of no data.

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
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.inspection import export_text
    >>> hours = np.linspace(0.0, 10.0, 41).reshape(-1, 1)
    >>> drift = 0.1 * hours[:, 0] + 5.0 * np.exp(-hours[:, 0])
    >>> model = ANFISRegressor(n_mfs=2, solver="lse", agreement=0.1).fit(hours, drift)
    >>> print(export_text(model, precision=3, feature_names=["hours"], output_names=["drift"]))
    2 rules, 1 input.
    <BLANKLINE>
    Rule 0, 50 % of the weight, strongest on 21 rows:
      IF hours is low
      THEN drift = 0.338 - 0.555 * (hours - 5)
    <BLANKLINE>
    Rule 1, 50 % of the weight, strongest on 20 rows:
      IF hours is high
      THEN drift = 0.649 + 0.195 * (hours - 5)
    <BLANKLINE>
    Terms:
      hours, trained from 0 to 10
        low:  gaussian, center 0, width 4.95
        high: gaussian, center 10, width 4.95
    Outside these ranges: out_of_bounds='linear', max_extrapolation=0.5.
    Held within the limits of its training: drift, 0.023 to 5.469.
    Standard deviation of the noise about the rules: drift 0.548.
    """
    check_count("precision", precision, 1, _MOST_DIGITS)
    check_choice("about", about, ("mean", "origin"))
    model = renamed(fold(estimator), feature_names, output_names)
    warn_if_unreadable(estimator, model)
    chosen = choose_rules(model, sort_by, max_rules, min_weight)
    reference = round_reference(model) if about == "mean" else 0.0 * model.reference
    consequents = consequents_about(model, reference)
    told = [_told(consequents[:, :, k], model, precision) for k in range(model.n_outputs)]
    premises = conditions(model)
    parts = [f"{count_text(model.n_rules, 'rule')}, {count_text(model.n_inputs, 'input')}."]
    for r in chosen:
        lines = [_heading(model, r), f"  IF {premise_text(model, premises[r])}"]
        word = "THEN"
        for k, name in enumerate(model.output_names):
            value = consequent_text(told[k][r], model.input_names, reference, precision)
            lines.append(f"  {word} {name} = {value}")
            word = " AND"
        parts.append("\n".join(lines))
    if chosen.size < model.n_rules:
        parts.append(_what_is_left_out(model, chosen))
    if show_terms:
        parts.append(_legend(model, precision))
    return "\n\n".join(parts)


def _told(consequents, model, precision):
    """The coefficients, less slopes that move the output by less than the last digit written."""
    change = np.abs(consequents[:, 1:]) * (model.maximum - model.minimum)
    scale = max(np.abs(consequents[:, 0]).max(), change.max(initial=0.0))
    told = consequents.copy()
    told[:, 1:][change < 10.0 ** -(precision + 2) * scale] = 0.0
    return told


def consequent_text(coefficients, input_names, reference, precision):
    """Write a + b * (x - x0) + ...; inputs of which a rule takes no account are left out."""
    text = number(coefficients[0], precision)
    for name, slope, origin in zip(input_names, coefficients[1:], reference, strict=True):
        if slope == 0.0:
            continue
        # A name such as "rate / s" would be read as arithmetic.
        factor = name if name.isidentifier() else f"[{name}]"
        if origin != 0.0:
            factor = f"({factor} {'-' if origin > 0.0 else '+'} {abs(origin):.15g})"
        sign = "-" if slope < 0.0 else "+"
        text += f" {sign} {number(abs(slope), precision)} * {factor}"
    return text


def term_text(term, precision):
    """Write "gaussian, center 21.3, width 4.2" of an entry of TSKModel.memberships."""
    numbers = {k: v for k, v in term.items() if k not in ("input", "name", "function")}
    location, *lengths = numbers.values()
    written = [place(location, precision, lengths[0])]
    written += [number(length, precision) for length in lengths]
    pairs = zip(numbers, written, strict=True)
    return ", ".join([term["function"], *(f"{name} {value}" for name, value in pairs)])


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
    return count_text(f"{count:.0f}" if count >= 10.0 else f"{count:.2g}", "row")


def count_text(number_of, what):
    """Write "1 rule" or "2 rules"."""
    return f"{number_of} {what}" + ("" if str(number_of) == "1" else "s")


def _heading(model, r):
    if not knows_data(model):
        return f"Rule {r}:"
    rows = rows_text(model.rule_rows[r])
    return f"Rule {r}, {100.0 * model.rule_weights[r]:.3g} % of the weight, strongest on {rows}:"


def _what_is_left_out(model, chosen):
    left_out = count_text(model.n_rules - chosen.size, "rule")
    if not knows_data(model):
        return f"{left_out} left out."
    weight = 1.0 - model.rule_weights[chosen].sum()
    return f"{left_out} with {100.0 * max(weight, 0.0):.3g} % of the weight left out."


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
            f"    {term['name'] + ':':<{width + 1}} {term_text(term, precision)}" for term in terms
        ]
    lines.append(f"Outside these ranges: {model.policy}.")
    for k, name in enumerate(model.output_names):
        low, high = model.output_limits[:, k]
        if np.isfinite([low, high]).all():
            ends = " to ".join(place(end, precision, high - low) for end in (low, high))
            lines.append(f"Held within the limits of its training: {name}, {ends}.")
        elif np.isfinite([low, high]).any():
            side, end = ("above", low) if np.isfinite(low) else ("below", high)
            lines.append(
                f"Held {side} the limit of its training: {name}, {number(end, precision)}."
            )
    if model.posterior is not None:
        noise = zip(model.output_names, model.posterior.noise, strict=True)
        told = ", ".join(f"{name} {number(value, precision)}" for name, value in noise)
        lines.append(f"Standard deviation of the noise about the rules: {told}.")
    return "\n".join(lines)
