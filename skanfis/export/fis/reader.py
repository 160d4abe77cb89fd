"""From a .fis file to a frozen model: strictly, and nothing but data."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from os import PathLike
from typing import NamedTuple

import numpy as np

from ...antecedent import (
    Antecedent,
    GridAntecedent,
    RuleTableAntecedent,
    ScatteredAntecedent,
    TermGroup,
)
from ...model import TSKModel
from ..limits import check_size, read_bytes, shown
from .functions import theta_of
from .syntax import sections_of, text_of

__all__ = ["parse_fis", "read_fis"]

# What is larger is refused before it is read, and so are counts that no rule base comes near:
# each is a loop over sections.
_MOST_BYTES = 2**22
_MOST_VARIABLES = 1000
_MOST_TERMS = 10_000
_MOST_RULES = 100_000


def read_fis(path: str | PathLike[str], *, input_names: Sequence[str] | None = None) -> TSKModel:
    """Read a Sugeno system from a .fis file of MATLAB, Octave or fuzzylite.

    The file is data: it is parsed strictly, and no part of it is ever run. :doc:`/files` says what
    it may hold; everything else is refused, as is a file of more than 4 MiB.

    Parameters
    ----------
    path : str or path-like
    input_names : sequence of str, default=None
        Names for the inputs in place of the file's: those of a table's columns.

    Returns
    -------
    model : skanfis.model.TSKModel
        Its box is the Range of the inputs; outside it the edge is held (``out_of_bounds="clip"``).
        Of the training data the file knows nothing: ``coverage`` is zero everywhere.

    Raises
    ------
    ValueError
        With the line, if the file is malformed or holds what is not supported; if ``input_names``
        are not one per input, and different.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import read_fis, write_fis
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_fis(ANFISRegressor(n_mfs=4).fit(*make_jang_sinc()), Path(folder) / "sinc.fis")
    ...     read_fis(Path(folder) / "sinc.fis").n_rules
    16
    """
    try:
        model = parse_fis(text_of(read_bytes(path, _MOST_BYTES)))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if input_names is None:
        return model
    names = tuple(map(str, input_names))
    if len(set(names)) != model.n_inputs or len(names) != model.n_inputs:
        raise ValueError(
            f"input_names={list(names)!r} must be {model.n_inputs} different names, one for each "
            f"of {', '.join(model.input_names)}."
        )
    return replace(model, input_names=names)


def parse_fis(text):
    """The model that the text of a .fis file describes; ValueError with the line."""
    sections = sections_of(text)
    if "System" not in sections:
        raise ValueError("line 1: the file has no [System].")
    n_inputs, n_outputs, n_rules, and_method = _read_system(sections["System"])
    inputs = [_variable(sections, "Input", j + 1, theta_of) for j in range(n_inputs)]
    consequent = partial(_consequent, n_inputs)
    outputs = [_variable(sections, "Output", k + 1, consequent) for k in range(n_outputs)]
    rules = _rules(sections, inputs, outputs, n_rules, and_method)
    for name, section in sections.items():
        if name not in ("System", "Rules"):
            raise ValueError(f"line {section.line}: [{name}] is not among those that are counted.")
    return _model(inputs, outputs, *rules)


class _Variable(NamedTuple):
    """An input or output: its name, its range, its membership functions and their names."""

    name: str
    low: float
    high: float
    names: list
    terms: list


def _read_system(section):
    """Numbers of inputs, outputs and rules, and the entry of the AND method."""
    section.take("Name").name()
    for key, wanted, reason in (
        ("Type", "sugeno", "only Sugeno systems are supported"),
        ("DefuzzMethod", "wtaver", "only the weighted average is supported"),
    ):
        entry = section.take(key)
        if entry.name() != wanted:
            raise entry.error(f"{key}={shown(entry.name())}: {reason} ({wanted!r}).")
    section.entries.pop("Version", None)
    n_inputs = section.take("NumInputs").whole(1, _MOST_VARIABLES)
    n_outputs = section.take("NumOutputs").whole(1, _MOST_VARIABLES)
    n_rules = section.take("NumRules").whole(1, _MOST_RULES)
    and_method = section.take("AndMethod")
    and_method.name()
    # These three have no part in a Sugeno system of rules joined by AND.
    for key in ("OrMethod", "ImpMethod", "AggMethod"):
        section.take(key).name()
    section.check_empty()
    return n_inputs, n_outputs, n_rules, and_method


def _variable(sections, kind, number, read_term):
    """An input or output with its membership functions, each as ``read_term`` takes it."""
    section = sections.pop(f"{kind}{number}", None)
    if section is None:
        line = sections["System"].line
        raise ValueError(f"line {line}: [System] counts [{kind}{number}], which is not there.")
    name = section.take("Name").name()
    low, high = section.take("Range").interval()
    # Written by some versions of fuzzylite.
    section.entries.pop("Enabled", None)
    names, terms = [], []
    for k in range(section.take("NumMFs").whole(0, _MOST_TERMS)):
        entry = section.take(f"MF{k + 1}")
        term_name, function, parameters = entry.membership()
        try:
            terms.append(read_term(function, parameters, low, high))
        except ValueError as error:
            raise entry.error(error) from None
        names.append(term_name)
    section.check_empty()
    return _Variable(name, low, high, names, terms)


def _consequent(n_inputs, function, parameters, low, high):
    """p0 of a constant; p0, p1 .. pd of a linear one."""
    lengths = {"constant": 1, "linear": n_inputs + 1}
    if function not in lengths:
        raise ValueError(
            f"the consequent {shown(function)} is not supported; constant, linear are."
        )
    if len(parameters) != lengths[function]:
        raise ValueError(
            f"{function} takes {lengths[function]} parameters, found {len(parameters)}."
        )
    return [parameters[-1], *parameters[:-1]]


def _rules(sections, inputs, outputs, n_rules, and_method):
    """Antecedents (n_rules, n_inputs) and consequents (n_rules, n_outputs), numbers from 1."""
    section = sections.get("Rules")
    if section is None or len(section.rules) != n_rules:
        found = 0 if section is None else len(section.rules)
        line = sections["System"].line if section is None else section.line
        raise ValueError(f"line {line}: [System] counts {n_rules} rules, [Rules] has {found}.")
    n_terms = sum(len(variable.terms) for variable in inputs)
    try:
        check_size(n_rules, n_terms, len(inputs), len(outputs))
    except ValueError as error:
        raise ValueError(f"line {section.line}: {error}") from None
    antecedents = np.zeros((n_rules, len(inputs)), dtype=int)
    consequents = np.zeros((n_rules, len(outputs)), dtype=int)
    for r, entry in enumerate(section.rules):
        antecedent, consequent, weight, connection = entry.rule()
        _check_terms(entry, antecedent, inputs, "input", lowest=0)
        _check_terms(entry, consequent, outputs, "output", lowest=1)
        if weight != 1.0:
            raise entry.error(f"the rule has weight {weight:g}; only weight 1 is supported.")
        is_joined = np.count_nonzero(antecedent) > 1
        if is_joined and connection == 2:
            raise entry.error("the rule joins its terms by OR (2); only AND (1) is supported.")
        if is_joined and and_method.name() != "prod":
            raise and_method.error(
                f"AndMethod={shown(and_method.name())}: only the product ('prod') is supported."
            )
        antecedents[r], consequents[r] = antecedent, consequent
    return antecedents, consequents


def _check_terms(entry, numbers, variables, kind, lowest):
    """One number for every variable, each from ``lowest`` to the number of its terms."""
    if len(numbers) != len(variables):
        raise entry.error(
            f"the rule has {len(numbers)} numbers for {len(variables)} {kind}s, it must have one "
            "for each."
        )
    for number, variable in zip(numbers, variables, strict=True):
        what, n_terms = f"{number} for {kind} {shown(variable.name)}", len(variable.terms)
        if number < 0:
            raise entry.error(f"{what}: NOT, a negative number, is not supported.")
        if not lowest <= number <= n_terms:
            raise entry.error(
                f"{what}, which has {n_terms} membership functions; it must be from {lowest} to "
                "that."
            )


def _model(inputs, outputs, antecedents, consequents):
    rows = _grid_rows(inputs, antecedents)
    if rows is not None:
        antecedents, consequents = antecedents[rows], consequents[rows]
    # Input and number of each term that a rule looks at, input by input.
    places: list = [(j, k) for j, own in enumerate(antecedents.T) for k in np.unique(own) if k > 0]
    antecedent: Antecedent
    if rows is not None:
        counts = tuple(Counter(j for j, _ in places).values())
        antecedent = GridAntecedent(_groups(inputs, places), counts=counts)
    elif _is_scattered(inputs, antecedents):
        premises = np.flatnonzero(antecedents.any(axis=0))
        places = [(j, rule[j]) for rule in antecedents for j in premises]
        antecedent = ScatteredAntecedent(_groups(inputs, places), n_premise_inputs=premises.size)
    else:
        table = np.full(antecedents.shape, -1)
        for t, (j, k) in enumerate(places):
            table[antecedents[:, j] == k, j] = t
        antecedent = RuleTableAntecedent(_groups(inputs, places), table)
    names = [_distinct(variable.names) for variable in inputs]
    # Constants beside linear consequents have no slopes.
    n_basis = max(len(term) for output in outputs for term in output.terms)
    coefficients = np.zeros((len(consequents), n_basis, len(outputs)))
    for (r, k), number in np.ndenumerate(consequents):
        term = outputs[k].terms[number - 1]
        coefficients[r, : len(term), k] = term
    n_rules = len(antecedents)
    low, high = np.array([(variable.low, variable.high) for variable in inputs]).T.copy()
    return TSKModel(
        antecedent=antecedent,
        initial_antecedent=antecedent,
        coefficients=coefficients,
        # About another point the file's own p0 would be rounded.
        reference=np.zeros(len(inputs)),
        # That of rows spread evenly over the Range.
        spread=(high - low) / np.sqrt(12.0),
        minimum=low,
        maximum=high,
        rule_weights=np.full(n_rules, 1.0 / n_rules),
        rule_rows=np.zeros(n_rules),
        input_names=_distinct(variable.name for variable in inputs),
        out_of_bounds="clip",
        term_names=tuple(names[j][k - 1] for j, k in places),
        output_names=_distinct(variable.name for variable in outputs),
    )


def _grid_rows(inputs, antecedents):
    """Where the rules of a full grid stand, in C order; None where they are no grid.

    A grid has at least two terms of one family, in order, on every input that it looks at.
    """
    n_combinations = 1
    for variable, column in zip(inputs, antecedents.T, strict=True):
        own = np.unique(column)
        if not own.any():
            continue
        n_combinations *= own.size
        terms = [variable.terms[k - 1] for k in own]
        is_one_family = len({family for family, _ in terms}) == 1
        is_ordered = np.all(np.diff([theta[0] for _, theta in terms]) > 0.0)
        if own.size == 1 or own[0] == 0 or not (is_one_family and is_ordered):
            return None
    if n_combinations != len(antecedents):
        return None
    rows = np.lexsort(antecedents.T[::-1])
    distinct = np.any(np.diff(antecedents[rows], axis=0), axis=1)
    return rows if distinct.all() else None


def _is_scattered(inputs, antecedents):
    """Whether all rules look at the same inputs, by terms of their own and of one family."""
    used = [(one, own) for one, own in zip(inputs, antecedents.T, strict=True) if own.any()]
    families = {one.terms[k - 1][0] for one, own in used for k in own if k > 0}
    return len(families) == 1 and all(
        own.min() > 0 and np.unique(own).size == own.size for _, own in used
    )


def _groups(inputs, places):
    """The terms at these places, pairs of input and number, in runs of one family."""
    terms = [(j, *inputs[j].terms[k - 1]) for j, k in places]
    groups = []
    for family, members in groupby(terms, key=lambda term: term[1]):
        numbers, _, thetas = zip(*members, strict=True)
        groups.append(TermGroup(family, np.array(numbers), np.stack(thetas, axis=1)))
    return tuple(groups)


def _distinct(names):
    """The names; one that was there before gets a number."""
    taken: dict[str, int] = {}
    distinct = []
    for name in names:
        while name in taken:
            taken[name] += 1
            name = f"{name} ({taken[name]})"
        taken[name] = 1
        distinct.append(name)
    return tuple(distinct)
