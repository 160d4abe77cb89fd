"""Rules as text, and as HTML for notebooks."""

from collections.abc import Sequence
from html import escape
from itertools import compress
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd

from .._validation import check_count
from ..digits import (
    MOST_DIGITS,
    counted,
    in_digits,
    limits_in_digits,
    percent,
    plain,
    range_in_digits,
)
from ..export import fold
from ..export.columns import categories, columns_of
from ..learning.data import never_changes
from ..policies import SILENT, policy_in_words
from .labels import MOST_NAMED, in_one_line
from .readability import readability_in_training
from .rules import condition, has_training_data, parts_led, premise_texts, rename, shown_rules
from .sentences import PRECISION, Sentences

# Most letters of a line; digits of a range.
_WIDTH, _DIGITS_OF_RANGE = 96, 4
_UNBROKEN = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"
# How to compute a prediction; parts in braces that do not apply are left out.
_HOW = (
    "A prediction is the mean of what the rules say, weighted by how true their conditions are; "
    "AND multiplies. {terms}A rule says its value{line}{slopes}.{errs}"
)
_ERRS = " What a rule errs by is its RMSE, used alone, on the rows on which it is the strongest."
_HOW_OF_ONE = "A prediction is what the rule says: its value{slopes}."
# The membership of a condition that names its place, by the sign before the place.
_WRITTEN = {
    ">": "x > c ± h is 1 / (1 + 9^((c - x) / h)) true, half at c and 0.9 at c + h; x < c ± h is "
    "what that lacks of 1. ",
    "near": "x near c ± h is exp(-((x - c) / h)^2 / 2) true, 0.61 at c + h, 0.14 at c + 2 h. ",
}
_TERM = "The truth of {} terms is {}. "
_LINE = ", less the common line's part in it, plus the common line"
_SLOPES = ", plus its own slopes"
_IN_PLACE = (
    "Every value has a part of this line; a rule's own slope replaces that of its input or level."
)


def export_text(
    estimator: Any,
    *,
    precision: int = PRECISION,
    max_shown: int | None = None,
    show_terms: bool = True,
    feature_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
) -> str:
    """Write the rules as IF-THEN sentences in the units of the data.

    A rule gives its value on its own rows, and by how much that changes with an input, and from
    where. Sentences and terms are the whole model: :doc:`/inspection`.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    precision : int, default=2
        Numbers are written to this many digits of the noise's standard deviation, from 1 to 17:
        with noise of 3.2, values to 0.1. Slopes that change no such digit over a standard deviation
        of their input are left out.
    max_shown : int, default=None
        Most rules to write, first those that are the strongest on most rows; None for all.
    show_terms : bool, default=True
        Whether to write the terms' parameters, the ranges, and the policy outside them.
    feature_names, output_names : sequence of str, default=None
        Other names of the inputs and the outputs; None for the model's.

    Returns
    -------
    text : str
        First, the standard deviations of the outputs, and about the rules: of the noise, or the
        training error if it is larger. Then the rules by their number, with the part of the rows on
        which each is the strongest, and the RMSE of the rule alone there. Last, how many numbers
        there are, the error of the text as printed (with the default precision), and what speaks
        against reading rules one by one.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range, a step cannot be folded, or there are no rules.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.inspection import export_text
    >>> hours = np.linspace(0.0, 10.0, 41).reshape(-1, 1)
    >>> drift = 0.1 * hours[:, 0] + 5.0 * np.exp(-hours[:, 0])
    >>> model = ANFISRegressor(n_mfs=2, solver="lse", agreement=0.1).fit(hours, drift)
    >>> print(export_text(model, feature_names=["hours"], show_terms=False))
    2 rules, 1 input, 41 rows.
    y varies by 0.94, about the rules by 0.54 (standard deviation).
    <BLANKLINE>
    Rule 0, strongest on 51 % of the rows, errs by 0.84 there:
      IF hours is low
      THEN y is about 1.16: -0.57 per hours from 3.5
    <BLANKLINE>
    Rule 1, strongest on 49 % of the rows, errs by 0.44 there:
      IF hours is high
      THEN y is about 0.95: +0.2 per hours from 6.5
    <BLANKLINE>
    6 numbers; the text as printed errs as much as the model.
    Rules go different ways, beyond chance: by hours up in rule 1 and down in rule 0.
    Errs more on its own rows than a constant would: rule 1 (errs by 0.437, a constant by 0.138).
    """
    said, found = _said(estimator, precision, feature_names, output_names)
    model, chosen = said.model, shown_rules(said.model, max_shown)
    counts = f"{counted(model.n_rules, 'rule')}, {_inputs_and_rows(model)}."
    parts = ["\n".join([counts, *map(wrapped, _deviations(model, found, precision))])]
    parts += [f"{wrapped(line)}\n{_IN_PLACE}" for line in _common_lines(said)]
    premises = premise_texts(model)
    for r in chosen:
        heading = ", ".join([f"Rule {r}", *_on_rows(model, found, r)])
        lines = [f"IF {premises[r]}"]
        for k, name in enumerate(model.output_names):
            lines.append(f"{' AND' if k else 'THEN'} {name} is {_conclusion(said, r, k)}")
        said_of = [wrapped(one, "  ", 7 * " ") for one in lines]
        parts.append("\n".join([wrapped(f"{heading}:"), *said_of]))
    parts += _left_out(model, chosen)
    if show_terms:
        parts.append(_legend(said, found, precision))
    parts.append("\n".join(wrapped(one) for one in _last_lines(said, found, precision)))
    return "\n\n".join(parts)


def rules_html(estimator: Any, *, max_shown: int = 10) -> str:
    """Write the rules as HTML, first those that are the strongest on most rows.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`skanfis.export.fold` takes it; scalers are folded into the rules.
    max_shown : int, default=10
        Most rules to show; a last line says what was left out.

    Returns
    -------
    html : str
        One ``<div>``, with names escaped, and nothing to run or to load. The findings against
        reading the rules one by one are folded away below them.

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
    said, found = _said(estimator)
    model, chosen = said.model, shown_rules(said.model, max_shown)
    premises = premise_texts(model)
    cells: dict = {}
    if has_training_data(model):
        cells["data", "rows"] = [percent(part) for part in parts_led(model)[chosen]]
        if found is not None:
            cells["data", "error"] = [_errors(found, r) for r in chosen]
    cells["rule", "if"] = [premises[r] for r in chosen]
    for k, name in enumerate(model.output_names):
        cells["then", name] = [_conclusion(said, r, k) for r in chosen]
    with pd.option_context("display.max_colwidth", None):
        table = pd.DataFrame(cells, index=chosen).map(in_one_line).rename(columns=in_one_line)
        table = table.rename_axis(columns=["", "rule"]).to_html(border=0, justify="left")
    counts = f"<b>{counted(model.n_rules, 'rule')}</b>, {_inputs_and_rows(model)}"
    below = [f"{line} {_IN_PLACE}" for line in _common_lines(said)] + _left_out(model, chosen)
    numbers, *findings = _last_lines(said, found)
    parts = [f"<div>{counts}</div>", _divs(_deviations(model, found)), table]
    parts.append(_divs([*below, numbers]))
    if findings:
        told = _divs(findings)
        parts.append(f"<details><summary>Can they be read one by one?</summary>{told}</details>")
    style = "font-family:sans-serif;font-size:90%;margin:0.5em 0"
    return f'<div style="{style}">{"".join(parts)}</div>'


def _divs(lines):
    return "".join(f"<div>{escape(in_one_line(line))}</div>" for line in lines)


def _said(estimator, precision=PRECISION, feature_names=None, output_names=None):
    """The sentences of the rules, and the readability that the fit has found, or None."""
    check_count("precision", precision, 1, MOST_DIGITS)
    model = rename(fold(estimator), feature_names, output_names)
    return Sentences.of(model, precision), readability_in_training(estimator, model)


def _inputs_and_rows(model):
    """Say "3 inputs, 506 rows"; the number of training rows only if it is known."""
    inputs, n_rows = counted(model.n_inputs, "input"), round(model.rule_rows.sum())
    return f"{inputs}, {counted(f'{n_rows:,}', 'row')}" if has_training_data(model) else inputs


def _deviations(model, found, precision=PRECISION):
    """Say "y varies by 27, about the rules by 11 (standard deviation).", as far as it is known."""
    lines, target = [], model.target
    # The noise is that of a free fit: a constrained or robust one has larger errors. The target's
    # scale of a robust fit leaves outliers out.
    is_known = found is not None and not found.is_of_chunk
    errors = found.measures.deviation * found.measures.errors if is_known else 0.0
    for k, name in enumerate(model.output_names if target else ()):
        spread = (found.measures.deviation if is_known else target.spread)[k]
        spread = 0.0 if never_changes(target.minimum[k], target.maximum[k]) else spread
        line = f"{name} varies by {in_digits(spread, precision)}"
        if model.posterior is not None:
            noise = np.maximum(model.posterior.noise, errors)[k]
            line += f", about the rules by {in_digits(noise, precision)}"
        lines.append(f"{line} (standard deviation).")
    return lines


def _common_lines(said):
    """The common line of every output that has one: "Common to the rules, y: -0.12 per ..."."""
    slopes = [_slopes(said, own, said.common_place, own != 0.0) for own in said.common.T]
    pairs = zip(said.model.output_names, slopes, strict=True)
    return [f"Common to the rules, {name}: {', '.join(own)}." for name, own in pairs if own]


def _conclusion(said, r, k):
    """The THEN part of rule r for output k: "about 33.6, of it +4.2 from the common line: ..."."""
    own = _slopes(said, said.slopes[r, :, k], said.places[r], said.is_own[r, :, k])
    has_common = np.any(~said.is_own[r, :, k] & (said.common[:, k] != 0.0))
    text = f"{'about ' if own or has_common else ''}{plain(said.values[r, k])}"
    if said.of_common[r, k]:
        text += f", of it {_signed(said.of_common[r, k])} from the common line"
    return f"{text}: {', '.join(own)}" if own else text


def _slopes(said, slopes, places, is_said):
    """Say "+5.8 per rooms from 6.3", "-2.1 if private is 1"; the largest effects come first.

    Levels of a category stand together. "No change with rooms" replaces a common slope by none.
    """
    model, parts, does = said.model, [], np.abs(slopes) * said.model.spread
    called = columns_of(model)
    most: dict[str, float] = {}
    for j in np.flatnonzero(is_said):
        most[called[j]] = max(most.get(called[j], 0.0), does[j])
    order = sorted(np.flatnonzero(is_said), key=lambda j: (-most[called[j]], called[j], -does[j]))
    for j in order:
        name, slope, place = model.input_names[j], slopes[j], places[j]
        if model.two_valued[j]:
            other = 1.0 - place
            change = _signed(slope * (other - place)) if slope else "no change"
            parts.append(f"{change} if {condition(model, j, plain(other))}")
        elif not slope:
            parts.append(f"no change with {name}")
        else:
            parts.append(f"{_signed(slope)} per {name} from {plain(place)}")
    return parts


def _on_rows(model, found, r):
    """On which part of the rows a rule is the strongest, and its error alone there."""
    if not has_training_data(model):
        return []
    if not model.rule_rows[r]:
        return ["strongest on no row"]
    share = [f"strongest on {percent(parts_led(model)[r])} of the rows"]
    errors = _errors(found, r)
    return [*share, f"errs by {errors} there"] if errors else share


def _errors(found, r):
    """The error of a rule alone; empty if it is the strongest on none of the measured rows."""
    if found is None or not found.measures.rule_rows[r]:
        return ""
    errors, names = found.rule_errors[r], found.model.output_names
    if len(names) == 1:
        return in_digits(errors[0], 2)
    return ", ".join(f"{in_digits(e, 2)} ({n})" for e, n in zip(errors, names, strict=True))


def _last_lines(said, found, precision=PRECISION):
    """How many numbers there are to read, and, if known, what speaks against reading the rules."""
    if found is None or precision != PRECISION:
        return [f"{counted(said.reading_cost, 'number')}."]
    return str(found).splitlines()


def _legend(said, found, precision):
    """The ranges and terms of the inputs, policy, limits, and how to compute a prediction."""
    model = said.model
    named = list(compress(model.memberships(), ~said.says_where))
    lines, has_ranges = _inputs(said, named)
    if has_ranges:
        words = policy_in_words(model.out_of_bounds, model.max_extrapolation)
        lines.append(wrapped(f"Outside these ranges {words}: {model.policy}."))
    for name, low, high in zip(model.output_names, *model.output_limits, strict=True):
        if np.isfinite([low, high]).any():
            limits = " to ".join(limits_in_digits(low, high, precision + 1))
            lines.append(wrapped(f"No prediction leaves these limits: {name}, {limits}."))
    return "\n".join([*lines, "", wrapped(_how(said, named, found is not None))])


def _inputs(said, named):
    """Lines on every input, with its ``named`` terms; and whether any of them has a range."""
    model, lines = said.model, ["Inputs, as they were trained:"]
    families = [group.family for group in model.antecedent.groups]
    at = {one.name for family in families for one in family.parameters if one.kind == "location"}
    called = columns_of(model)
    has_part = said.is_own.any(axis=(0, 2)) | said.common.any(axis=1)
    has_part[model.antecedent.term_inputs] = True
    # If nothing is predicted outside the range of any input, all inputs have a part.
    with_part = set(called if model.out_of_bounds in SILENT else compress(called, has_part))
    listed = []
    for j, name in enumerate(model.input_names):
        if called[j] not in with_part:
            continue
        terms = [term for term in named if term["input"] == name]
        if model.two_valued[j] and name in model.levels and not terms:
            listed.append(j)
            continue
        range_of = range_in_digits(model.minimum[j], model.maximum[j], _DIGITS_OF_RANGE)
        lines.append(wrapped(f"{name}: {range_of}", "  ", 6 * " "))
        heads = [f"{in_one_line(term['name'])}:" for term in terms]
        width = max(map(len, heads), default=0)
        for head, term in zip(heads, terms, strict=True):
            lines.append(f"    {head:<{width}} {_term_text(term, at)}")
    lists = categories(model, listed)
    for name, one in lists.items():
        levels = ", ".join([*one.levels, *one.others])
        lines.append(wrapped(f"  {name}: {levels}", later=6 * " "))
    unnamed = [one for one in dict.fromkeys(called) if one not in with_part]
    with_slope = set(compress(called, model.coefficients[:, 1:].any(axis=(0, 2))))
    for has_slope, told in ((True, "slopes too small to be written"), (False, "in no rule")):
        if alike := [one for one in unnamed if (one in with_slope) == has_slope]:
            names = ", ".join(alike) if len(alike) <= MOST_NAMED else f"{len(alike)} more inputs"
            lines.append(wrapped(f"  {names}: {told}", later=6 * " "))
    return lines, bool(with_part - lists.keys())


def _how(said, named, has_errors):
    """How to compute a prediction from the rules: the formulas of what they say."""
    model, functions = said.model, {term["function"] for term in named}
    written = [name for name in compress(model.term_names, said.says_where) if "±" in name]
    signs = {name.split()[0] for name in written}
    terms = [text for sign, text in _WRITTEN.items() if sign in signs]
    formulas = {group.family.name: group.family.formula for group in model.antecedent.groups}
    terms += [_TERM.format(*one) for one in formulas.items() if one[0] in functions and one[1]]
    line, errs = _LINE if said.common.any() else "", _ERRS if has_errors else ""
    how = _HOW_OF_ONE if model.n_rules == 1 and not model.antecedent.n_terms else _HOW
    slopes = _SLOPES if said.is_own.any() else ""
    return how.format(terms="".join(terms), line=line, slopes=slopes, errs=errs)


def _term_text(term, locations):
    """Write "gaussian, center 21.3, width 4.2" of an entry of TSKModel.memberships."""
    numbers = {k: v for k, v in term.items() if k not in ("input", "name", "function")}
    # The last digits of a parameter held as a logarithm are rounding errors.
    told = (f"{k} {plain(v) if k in locations else in_digits(v, 14)}" for k, v in numbers.items())
    return ", ".join([term["function"], *told])


def _left_out(model, chosen):
    """Say "Left out: 2 rules, strongest on 4 % of the rows.", if any are."""
    text = f"Left out: {counted(model.n_rules - len(chosen), 'rule')}"
    if has_training_data(model):
        rest = percent(max(1.0 - parts_led(model)[chosen].sum(), 0.0))
        text += f", strongest on {rest} of the rows"
    return [f"{text}."] if len(chosen) < model.n_rules else []


def wrapped(text, first="", later=""):
    """The text in lines, with indents for the first and the later ones; no line breaks at a ±."""
    text = in_one_line(text).replace(" ± ", _UNBROKEN)
    lines = fill(text, _WIDTH, initial_indent=first, subsequent_indent=later)
    return lines.replace(_UNBROKEN, " ± ")


def _signed(value):
    return f"{'-' if value < 0.0 else '+'}{plain(abs(value))}"
