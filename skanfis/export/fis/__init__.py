"""Write and read Sugeno systems in the .fis format of MATLAB and Octave; this module writes."""

import re
import unicodedata
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..._validation import warn_user
from ...digits import percent
from ...naming import distinct
from ..folding import fold
from .functions import function_of
from .reader import parse_fis, read_fis

__all__ = ["export_fis", "read_fis"]

_NOT_IN_A_NAME = re.compile(r"[^A-Za-z0-9_]+")
_MINUS = re.compile(r"(?<!\S)-(?=[0-9.])")
# Words that fuzzylite reserves for rules.
_WORDS = {"if", "is", "then", "with", "and", "or", "not"}
_WORDS |= {"any", "very", "seldom", "somewhat", "extremely"}
_HEAD = """[System]
Name='skanfis'
Type='sugeno'
Version=2.0
NumInputs={model.n_inputs}
NumOutputs={model.n_outputs}
NumRules={model.n_rules}
AndMethod='prod'
OrMethod='probor'
ImpMethod='prod'
AggMethod='sum'
DefuzzMethod='wtaver'"""
# Points of the box at which the rules of the file are compared with the model.
_N_POINTS = 1000
_GAP = (
    "no rule of the .fis file fires: other programs give NaN, zero or the middle of the output's "
    "Range there, skanfis what the nearest rule says. A membership without a foot (mf = "
    "'gaussian', 'bell', 'two_sided_gaussian') or fewer, wider terms leave no such gaps."
)
_HELD = (
    "the .fis file goes beyond the limits that skanfis holds outputs within: clamp them as the "
    "comment at its head says."
)


def export_fis(estimator: Any, path: str | PathLike[str] | None = None) -> str:
    """Write a trained model as a .fis file, for MATLAB, Octave or fuzzylite.

    The system is Sugeno's, with product as AND and weighted average; numbers have all their digits.
    Clamp the inputs to their Range, which is that of the training data, because programs differ
    beyond it. Clamp the outputs to the limits in the comment at the head of the file.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`fold` takes it.
    path : str or path-like, default=None
        The file to write, which Octave wants to end in ".fis"; None writes nothing.

    Returns
    -------
    text : str
        ASCII. Names become letters, digits and underscores; a comment gives those that changed.

    Raises
    ------
    ValueError, TypeError
        As :func:`fold`; ValueError if a membership is none of skanfis' own, or if
        :func:`read_fis` would refuse a number, such as a width beyond 1e50.

    Warns
    -----
    UserWarning
        If no rule of the file fires at some of 1,000 points in the box of the training data, or
        outputs are beyond their limits there.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_fis
    >>> export_fis(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc())).splitlines()[-1]
    '2 2, 4 (1) : 1'
    """
    model = fold(estimator).as_rule_table()
    _warn_of_differences(model)
    inputs, names_of_terms, terms, rules = _premises(model)
    comments, (input_names, output_names) = _comments_and_names(model)
    lines = [*comments, _HEAD.format(model=model)]
    for j, name in enumerate(input_names):
        own = np.flatnonzero(inputs == j)
        names = _identifiers([names_of_terms[t] for t in own], "term")
        interval = _wide(model.minimum[j], model.maximum[j], 0.0)
        lines += _variable(f"Input{j + 1}", name, interval, names, [terms[t] for t in own])
    names = [f"rule{r + 1}" for r in range(model.n_rules)]
    for k, name in enumerate(output_names):
        interval, consequents = _consequents(model, k)
        lines += _variable(f"Output{k + 1}", name, interval, names, consequents)
    lines += ["", "[Rules]"]
    for r, rule in enumerate(rules, start=1):
        consequents = " ".join([str(r)] * model.n_outputs)
        lines.append(f"{' '.join(map(str, rule))}, {consequents} (1) : 1")
    text = "\n".join([*lines, ""])
    try:
        parse_fis(text)
    except ValueError as error:
        raise ValueError(
            f"cannot write what read_fis would refuse: {error} Train on inputs and targets in "
            "other units."
        ) from None
    if path is not None:
        Path(path).write_text(text, encoding="ascii", newline="\n")
    return text


def _premises(model):
    """For each term its input, name, and function with parameters; the rules (n_rules, n_inputs).

    A rule's entry is the number of its term on that input, from 1 on, or 0 for none.
    """
    inputs, rule_terms = model.antecedent.term_inputs, model.antecedent.rule_terms
    every = model.antecedent.terms
    terms = [function_of(family, family.natural(theta)) for _, family, theta in every]
    number = [np.count_nonzero(inputs[: t + 1] == j) for t, j in enumerate(inputs)]
    rules = np.zeros((model.n_rules, model.n_inputs), dtype=int)
    for r, place in np.argwhere(rule_terms >= 0):
        term = rule_terms[r, place]
        rules[r, inputs[term]] = number[term]
    names, always = list(model.term_names), ~rules.any(axis=1)
    if always.any():
        # Readers require a condition in every rule: add a term that is 1 on the whole Range.
        rules[always, 0] = 1 + np.count_nonzero(inputs == 0)
        inputs, names = np.append(inputs, 0), [*names, "any value"]
        low, high = model.minimum[0], model.maximum[0]
        margin = 1.0 + abs(low) + abs(high)
        terms.append(("trapmf", [low - margin, low, high, high + margin]))
    return inputs, names, terms, rules


def _consequents(model, k):
    """An interval that holds output k within the box, and its functions with parameters."""
    constants, slopes = model.consequents[:, 0, k], model.consequents[:, 1:, k]
    if model.order:
        by_rule = [("linear", [*b, a]) for a, b in zip(constants, slopes, strict=True)]
    else:
        by_rule = [("constant", [a]) for a in constants]
    # A linear function on a box: its value at the middle, and the half-widths times its slopes.
    half = 0.5 * (model.maximum - model.minimum)
    middle, reach = constants + slopes @ (model.minimum + half), np.abs(slopes) @ half
    return _wide((middle - reach).min(), (middle + reach).max(), 1.0), by_rule


def _wide(low, high, least):
    """The interval, widened if it is empty, because MATLAB requires low < high."""
    return [low, high if high > low else max(low + least, np.nextafter(low, np.inf))]


def _variable(section, name, interval, names, functions):
    """The lines of an input or output."""
    lines = ["", f"[{section}]", f"Name='{name}'", f"Range={_numbers(interval)}"]
    lines.append(f"NumMFs={len(functions)}")
    for k, (term, (function, parameters)) in enumerate(zip(names, functions, strict=True)):
        lines.append(f"MF{k + 1}='{term}':'{function}',{_numbers(parameters)}")
    return lines


def _numbers(values):
    """Numbers as text, in as few digits as give the same double back."""
    return f"[{' '.join(repr(float(value)) for value in values)}]"


def _comments_and_names(model):
    """The lines at the head; identifiers of the inputs and of the outputs."""
    comments = [
        f"% Sugeno system of {model.n_rules} rules, written by skanfis.",
        "% It holds within the Range of its inputs: clamp them to it.",
    ]
    if model.out_of_bounds != "clip":
        comments.append(f"% In skanfis, beyond it: {model.policy}.")
    if model.tangent_at is not None:
        comments.append("% The constraints of the fit hold within the Range: beyond it, not here.")
    for k, limits in enumerate(model.output_limits.T, start=1):
        if np.isfinite(limits).any():
            comments.append(f"% In skanfis, Output{k} is held within {_numbers(limits)}: clamp it.")
    found = []
    for kind, given in (("Input", model.input_names), ("Output", model.output_names)):
        names = _identifiers(given, kind.lower())
        for k, (name, original) in enumerate(zip(names, given, strict=True), start=1):
            if name != original:
                comments.append(f"% {kind}{k} is {original!a}.")
        found.append(names)
    return comments, found


def _identifiers(names, fallback):
    """Names of letters, digits and underscores, different from each other."""
    identifiers = []
    for k, name in enumerate(names, start=1):
        plain = _MINUS.sub("minus ", name).replace("> ", "above ").replace("< ", "below ")
        plain = plain.replace("±", "pm")
        plain = unicodedata.normalize("NFKD", plain)
        base = _NOT_IN_A_NAME.sub("_", plain.encode("ascii", "ignore").decode()).strip("_")
        if not base:
            base = f"{fallback}{k}"
        elif base[0].isdigit() or base in _WORDS:
            base = f"{fallback}_{base}"
        identifiers.append(base)
    return distinct(identifiers, "{}_{}")


def _warn_of_differences(model):
    """Warn if the file differs from skanfis within the Range.

    Where all textbook strengths are zero, the nearest rule answers in skanfis, whose memberships
    have a floor; the file has no answer. Also, the format has no limits of outputs.
    """
    low, high = model.minimum, model.maximum
    room = 0.1 * (high - low)  # some points lie on the edge, which terms may not reach
    X = np.random.default_rng(0).uniform(low - room, high + room, (_N_POINTS, model.n_inputs))
    X = np.clip(X, low, high)
    groups = model.antecedent.groups
    with np.errstate(over="ignore"):
        by_group = [group.family.value(X.T[group.inputs], group.theta) for group in groups]
    # One row more, for inputs without a term in a rule (-1).
    mu = np.concatenate([*by_group, np.ones((1, _N_POINTS))])
    fires = np.zeros(_N_POINTS, dtype=bool)
    for rule in model.antecedent.rule_terms:
        fires |= np.prod(mu[rule], axis=0) > 0.0
    is_held = (model.predict(X) != replace(model, target=None).predict(X)).any(axis=1)
    for is_there, what in ((~fires, _GAP), (is_held, _HELD)):
        if is_there.any():
            where = f"{percent(np.mean(is_there))} of {_N_POINTS} points within the training range"
            warn_user(f"At {where} {what}", UserWarning)
