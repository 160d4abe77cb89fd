"""The rules at a glance, as HTML for notebooks: one piece, no script, nothing loaded."""

from html import escape
from typing import Any

import numpy as np

from .._validation import check_count
from ..export import fold
from .findings import findings_without_rows
from .rules import (
    choose_rules,
    consequents_about,
    knows_data,
    premises,
    readability_in_training,
    round_reference,
)
from .text import consequent_text, count_text, range_text, term_text

__all__ = ["rules_html"]

# Hues of terms from the lowest to the highest, from blue to red; they show on white and on black.
_HUES = (220, 10)
# Dots: a picture stands beside the others of a row on a notebook's page.
_WIDTH, _HEIGHT = 130, 34
# A corner every other dot: curves look smooth.
_POINTS = 61


def rules_html(estimator: Any, *, max_rules: int = 10, precision: int = 4) -> str:
    """Write the rules as HTML, the weightiest first, with pictures of the terms.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    max_rules : int, default=10
        Most rules to show; a last line says what was left out.
    precision : int, default=4
        Significant digits of the numbers, from 1 to 17.

    Returns
    -------
    html : str
        One ``<div>``, with names escaped, without script or anything to load. A fitted
        ANFISRegressor shows it by itself in notebooks. Below the rules stands what speaks against
        reading them one by one: what the estimator's ``readability_`` says, where it has one, or
        what can be said without rows. :func:`readability` says more.

    Raises
    ------
    ValueError
        If a step of a pipeline cannot be folded, or a number is out of its range.
    TypeError
        If ``estimator`` has no rules.

    Examples
    --------
    >>> from IPython.display import HTML  # doctest: +SKIP
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import rules_html
    >>> X, y = make_jang_sinc()
    >>> page = rules_html(ANFISRegressor(n_mfs=3).fit(X, y))
    >>> HTML(page)  # doctest: +SKIP
    >>> page.count("<tr>")
    10
    """
    check_count("precision", precision, 1, 17)
    model = fold(estimator)
    chosen = choose_rules(model, "weight", max_rules, 0.0)
    parts = [
        '<div style="font-family:sans-serif;font-size:90%;margin:0.5em 0">',
        f"<div><b>{count_text(model.n_rules, 'rule')}</b> on "
        f"{count_text(model.n_inputs, 'input')}</div>",
        _table(model, chosen, precision),
    ]
    if chosen.size < model.n_rules:
        left_out = "and " + count_text(model.n_rules - chosen.size, "rule")
        if knows_data(model):
            weight = max(1.0 - float(model.rule_weights[chosen].sum()), 0.0)
            left_out += f" with {100.0 * weight:.3g} % of the weight"
        parts.append(f"<div>{left_out}</div>")
    parts.append(_how_to_read(estimator, model))
    return "".join([*parts, "</div>"])


def _how_to_read(estimator, model):
    """What the fit found of its rules on its rows; else what can be said without rows."""
    found = readability_in_training(estimator, model)
    if found is None:
        return "".join(f"<div>{escape(line)}</div>" for line in findings_without_rows(model))
    return found.html()


def _term_hues(model):
    """A hue for every term: the rank of its place among those of its input, from blue to red."""
    hues = np.empty(model.antecedent.n_terms)
    inputs, places = model.antecedent.term_inputs, model.antecedent.term_places
    for j in np.unique(inputs):
        own = np.flatnonzero(inputs == j)
        rank = np.argsort(np.argsort(places[own], kind="stable"))
        hues[own] = _HUES[0] + (_HUES[1] - _HUES[0]) * rank / max(own.size - 1, 1)
    return hues


def _table(model, chosen, precision):
    """A line per rule; the terms of each input stand under their picture."""
    rules, looked_at = premises(model)
    hues = _term_hues(model)
    pictures = [_picture(model, j, hues, precision) for j in looked_at]
    reference = round_reference(model)
    consequents = consequents_about(model, reference)
    largest = float(np.max(model.rule_weights))
    lines = [_line("th", ["rule", *(["weight"] if knows_data(model) else []), *pictures, "then"])]
    for r in chosen:
        terms = [_chip(model, rules[r].get(j), hues) for j in looked_at]
        formulas = [
            consequent_text(consequents[r, :, k], model.input_names, reference, precision)
            for k in range(model.n_outputs)
        ]
        named = zip(model.output_names, formulas, strict=True)
        then = "<br>".join(escape(f"{name} = {formula}") for name, formula in named)
        then = f'<span style="font-family:monospace">{then}</span>'
        weight = [_weight(model, r, largest)] if knows_data(model) else []
        lines.append(_line("td", [str(r), *weight, *terms, then]))
    return f'<table style="border-collapse:collapse">{"".join(lines)}</table>'


def _line(tag, cells):
    opening = f'<{tag} style="text-align:left;vertical-align:bottom;padding:2px 8px">'
    return f"<tr>{''.join(f'{opening}{cell}</{tag}>' for cell in cells)}</tr>"


def _weight(model, r, largest):
    """A bar, the part of the training data's weight, and whether the rule wins on any row."""
    weight = float(model.rule_weights[r])
    note = " (no row)" if model.rule_rows[r] < 0.5 else ""
    return (
        '<span style="white-space:nowrap"><span style="display:inline-block;height:0.8em;'
        f'background:hsla(220,60%,55%,0.5);width:{60.0 * weight / largest:.1f}px"></span> '
        f"{100.0 * weight:.3g} %{note}</span>"
    )


def _chip(model, term, hues):
    if term is None:
        return "any"
    return (
        f'<span style="background:hsla({hues[term]:.0f},70%,55%,0.25);white-space:nowrap;'
        f'border-left:3px solid hsl({hues[term]:.0f},70%,50%);padding:0 4px">'
        f"{escape(model.term_names[term])}</span>"
    )


def _picture(model, j, hues, precision):
    """The membership functions of input j, and its name and range."""
    own = np.flatnonzero(model.antecedent.term_inputs == j)
    Z = np.zeros((model.n_inputs, _POINTS))
    Z[j] = np.linspace(model.minimum[j], model.maximum[j], _POINTS)
    mu = np.exp(model.antecedent.log_memberships(Z)[own])
    memberships = model.memberships()
    curves = "".join(
        _curve(one, hues[t], f"{model.term_names[t]}: {term_text(memberships[t], precision)}")
        for t, one in zip(own, mu, strict=True)
    )
    low, high = range_text(model, j, precision)
    return (
        f'<svg width="{_WIDTH}" height="{_HEIGHT + 2}" style="border-bottom:1px solid gray">'
        f"{curves}</svg><br>{escape(model.input_names[j])}"
        f'<div style="font-weight:normal;font-size:85%">{low} to {high}</div>'
    )


def _curve(mu, hue, title):
    x = np.linspace(0.0, _WIDTH, mu.size)
    y = 1.0 + _HEIGHT * (1.0 - mu)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        f'<polyline points="{points}" fill="none" stroke="hsl({hue:.0f},70%,50%)" '
        f'stroke-width="1.5"><title>{escape(title)}</title></polyline>'
    )
