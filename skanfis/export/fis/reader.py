"""Read a .fis file into a frozen model: parsed strictly, as data only.

Every pattern is anchored, and takes linear time on any line.
"""

import re
from functools import partial
from math import prod
from os import PathLike
from typing import NamedTuple

import numpy as np

from ...antecedent import groups_of
from ...model import TSKModel
from ...naming import distinct
from ..json_reader import rule_base
from ..limits import LARGEST_NUMBER, check_size, read_bytes, shown
from .functions import theta_of

# Larger files are refused before they are read.
_MOST_BYTES = 2**22

_HEAD = re.compile(r"\[(System|Rules|(?:Input|Output)[1-9][0-9]{0,5})\]")
_QUOTED = re.compile(r"'([^']*)'")
_BRACKETS = re.compile(r"\[(.*)\]")
_WHOLE = re.compile(r"[0-9]{1,9}")
# Whole numbers in a rule, which fuzzylite writes as 1.000.
_WHOLE_OF_RULE = re.compile(r"([0-9]{1,9})(?:\.0*)?")
# No number takes more than 100 characters, and a longer text takes long to parse.
_NUMBER = re.compile(r"(?=.{1,100}$)[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_MEMBERSHIP = re.compile(r"'([^']*)'\s*:\s*'([^']*)'\s*,\s*\[([^\]]*)\]")
_RULE = re.compile(r"([^,]*),([^,(]*)\(([^()]*)\)\s*:\s*([12])")
# Separator of numbers.
_BLANK = re.compile(r"\s*,\s*|\s+")
_SYSTEM = {
    "Type": ("sugeno", "only Sugeno systems are supported"),
    "AndMethod": ("prod", "only the product is supported"),
    "DefuzzMethod": ("wtaver", "only the weighted average is supported"),
}


def read_fis(path: str | PathLike[str]) -> TSKModel:
    """Read a Sugeno system from a .fis file of MATLAB, Octave or fuzzylite.

    The file is data: it is parsed strictly, and no part of it is ever run. :doc:`/files` says what
    it may hold; everything else is refused, as is a file of more than 4 MiB.

    Parameters
    ----------
    path : str or path-like

    Returns
    -------
    model : skanfis.model.TSKModel
        Its box is the Range of the inputs; outside it the edge is held (``out_of_bounds="clip"``).
        The file has no training data: ``coverage`` is zero everywhere.

    Raises
    ------
    ValueError
        With the line, if the file is malformed or has parts that are not supported.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_fis, read_fis
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "sinc.fis"
    ...     text = export_fis(ANFISRegressor(n_mfs=4).fit(*make_jang_sinc()), path)
    ...     read_fis(path).n_rules
    16
    """
    data = read_bytes(path, _MOST_BYTES)
    try:
        return parse_fis(data.decode("utf-8-sig", "surrogateescape"))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def parse_fis(text):
    """The model that the text of a .fis file describes; ValueError with the line."""
    sections = _sections(text)
    if "System" not in sections:
        raise ValueError("line 1: the file has no [System].")
    counted = sections["System"][""]
    n_inputs, n_outputs, n_rules = _read_system(sections.pop("System"))

    def variables(kind, count, read_term):
        for number in range(1, count + 1):
            if f"{kind}{number}" not in sections:
                raise counted.error(f"[System] counts [{kind}{number}], which is not there.")
            yield _variable(sections.pop(f"{kind}{number}"), read_term)

    inputs = list(variables("Input", n_inputs, theta_of))
    outputs = list(variables("Output", n_outputs, partial(_consequent, n_inputs)))
    head, *rules = sections.pop("Rules", {"": counted}).values()
    if len(rules) != n_rules:
        raise head.error(f"[System] counts {n_rules} rules, [Rules] has {len(rules)}.")
    for name, section in sections.items():
        raise section[""].error(f"[{name}] is not among those that are counted.")
    try:
        check_size(n_rules, sum(len(one.terms) for one in inputs), n_inputs, n_outputs)
    except ValueError as error:
        raise head.error(error) from None
    table = np.array([_rule(entry, inputs, outputs) for entry in rules])
    return _model(inputs, outputs, table[:, :n_inputs], table[:, n_inputs:])


class _Entry(NamedTuple):
    """The value of a key, or a rule; ``line`` is its number in the file."""

    line: int
    text: str

    def error(self, reason):
        """A ValueError with the line."""
        return ValueError(f"line {self.line}: {reason}")

    def match(self, pattern, wanted):
        match = pattern.fullmatch(self.text)
        if match is None:
            raise self.error(f"expected {wanted}, found {shown(self.text)}.")
        return match

    def name(self):
        return self.match(_QUOTED, "a name in single quotes")[1]

    def whole(self, lowest):
        number = int(self.match(_WHOLE, "a whole number")[0])
        if number < lowest:
            raise self.error(f"{number} is below {lowest}.")
        return number

    def numbers(self, text):
        """The numbers in a part of it, between blanks or commas."""
        tokens = _BLANK.split(text.strip()) if text.strip() else []
        for token in tokens:
            if _NUMBER.fullmatch(token) is None or abs(float(token)) > LARGEST_NUMBER:
                raise self.error(
                    f"expected a number of size up to {LARGEST_NUMBER:g}, found {shown(token)}."
                )
        return [float(token) for token in tokens]


def _sections(text):
    """Entries by section and key; the section's head has the key "".

    Comments, which begin with % or #, and empty lines are skipped.
    """
    sections: dict[str, dict[str, _Entry]] = {}
    name = ""
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        entry = _Entry(number, line.replace("\t", " ").strip())
        if not entry.text or entry.text[0] in "%#":
            continue
        if not entry.text.isprintable():
            raise entry.error(f"{shown(entry.text)} has characters that UTF-8 does not print.")
        key, separator, value = (part.strip() for part in entry.text.partition("="))
        if entry.text[0] == "[":
            name = entry.match(_HEAD, "[System], [Input1], [Output1] or [Rules]")[1]
            if name in sections:
                raise entry.error(f"[{name}] stands here for the second time.")
            sections[name] = {"": entry}
        elif not name:
            raise entry.error(f"expected [System] before anything else, found {shown(line)}.")
        elif name == "Rules":
            sections[name][f"{number}"] = entry
        elif not separator:
            raise entry.error(f"expected key=value in [{name}], found {shown(line)}.")
        elif key in sections[name]:
            raise entry.error(f"[{name}] has {shown(key)} for the second time.")
        else:
            sections[name][key] = _Entry(number, value)
    return sections


def _take(section, key):
    """Remove and return the entry of a key; ValueError if there is none."""
    if key not in section:
        raise section[""].error(f"{section[''].text} has no {key}.")
    return section.pop(key)


def _check_empty(section):
    """Raise ValueError if a key is left, which is then unknown."""
    head, *others = section
    for key in others:
        raise section[key].error(f"{section[head].text} has the unknown key {shown(key)}.")


class _Variable(NamedTuple):
    """An input or output: its name, its range, its membership functions and their names."""

    name: str
    low: float
    high: float
    names: list
    terms: list


def _read_system(section):
    """Numbers of inputs, outputs and rules."""
    # The last three have no effect in a Sugeno system whose rules use AND.
    for key in ("Name", *_SYSTEM, "OrMethod", "ImpMethod", "AggMethod"):
        entry = _take(section, key)
        wanted, reason = _SYSTEM.get(key, (entry.name(), ""))
        if entry.name() != wanted:
            raise entry.error(f"{key}={shown(entry.name())}: {reason} ({wanted!r}).")
    section.pop("Version", None)
    counts = [_take(section, key).whole(1) for key in ("NumInputs", "NumOutputs", "NumRules")]
    _check_empty(section)
    return counts


def _variable(section, read_term):
    """An input or output with its membership functions, each as ``read_term`` takes it."""
    name, interval = _take(section, "Name").name(), _take(section, "Range")
    ends = interval.numbers(interval.match(_BRACKETS, "[low high]")[1])
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise interval.error(f"expected [low high] with low < high, found {shown(interval.text)}.")
    # Written by some versions of fuzzylite.
    section.pop("Enabled", None)
    names, terms = [], []
    for k in range(_take(section, "NumMFs").whole(0)):
        entry = _take(section, f"MF{k + 1}")
        match = entry.match(_MEMBERSHIP, "'name':'function',[parameters]")
        parameters = entry.numbers(match[3])
        try:
            terms.append(read_term(match[2], parameters, *ends))
        except ValueError as error:
            raise entry.error(error) from None
        names.append(match[1])
    _check_empty(section)
    return _Variable(name, ends[0], ends[1], names, terms)


def _consequent(n_inputs, function, parameters, low, high):
    """p0 of a constant; p0, p1 .. pd of a linear one."""
    if (function, len(parameters)) not in (("constant", 1), ("linear", n_inputs + 1)):
        raise ValueError(
            f"the consequent {shown(function)} with {len(parameters)} parameters is not "
            f"supported; constant with 1, linear with {n_inputs + 1} are."
        )
    return [parameters[-1], *parameters[:-1]]


def _rule(entry, inputs, outputs):
    """The numbers of a rule's terms, from 1 on, and of its consequents; 0 for none."""
    match = entry.match(
        _RULE,
        "a rule such as '1 2, 3 (1) : 1' (terms of the inputs, consequents, weight, connection: "
        "the connection is 1 or 2)",
    )
    antecedent = _numbers_of_terms(entry, match[1], inputs, "input", lowest=0)
    consequent = _numbers_of_terms(entry, match[2], outputs, "output", lowest=1)
    if entry.numbers(match[3]) != [1.0]:
        raise entry.error(f"the rule has weight {shown(match[3])}; only weight 1 is supported.")
    if match[4] == "2" and np.count_nonzero(antecedent) > 1:
        raise entry.error("the rule joins its terms by OR (2); only AND (1) is supported.")
    return antecedent + consequent


def _numbers_of_terms(entry, text, variables, kind, lowest):
    """One number for every variable, each from ``lowest`` to the number of its terms."""
    tokens = text.split()
    if len(tokens) != len(variables):
        raise entry.error(
            f"the rule has {len(tokens)} numbers for {len(variables)} {kind}s, it must have one "
            "for each."
        )
    numbers = []
    for token, variable in zip(tokens, variables, strict=True):
        match, n_terms = _WHOLE_OF_RULE.fullmatch(token), len(variable.terms)
        if match is None or not lowest <= int(match[1]) <= n_terms:
            raise entry.error(
                f"{shown(token)} for {kind} {shown(variable.name)}, which has {n_terms} membership "
                f"functions: it must be a whole number from {lowest} to that. NOT (a negative "
                "number) and hedges (fractions) are not supported."
            )
        numbers.append(int(match[1]))
    return numbers


def _model(inputs, outputs, antecedents, consequents):
    order = _places_of_grid(inputs, antecedents)
    if order is not None:
        antecedents, consequents = antecedents[order], consequents[order]
    premises = np.flatnonzero(antecedents.any(axis=0))
    # Input and number of each term used in a rule, input by input.
    places: list = [(j, k) for j, own in enumerate(antecedents.T) for k in np.unique(own) if k > 0]
    groups = groups_of((j, *inputs[j].terms[k - 1]) for j, k in places)
    table = np.full(antecedents.shape, -1)
    for t, (j, k) in enumerate(places):
        table[antecedents[:, j] == k, j] = t
    kind = "table" if order is None else "grid"
    antecedent = rule_base(kind, groups, table[:, premises])
    names = [distinct(variable.names) for variable in inputs]
    # Constant consequents among linear ones get zero slopes.
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
        # Another reference would round the file's p0.
        reference=np.zeros(len(inputs)),
        # Standard deviation of rows spread evenly over the Range.
        spread=(high - low) / np.sqrt(12.0),
        minimum=low,
        maximum=high,
        rule_weights=np.full(n_rules, 1.0 / n_rules),
        rule_rows=np.zeros(n_rules),
        input_names=distinct(variable.name for variable in inputs),
        out_of_bounds="clip",
        term_names=tuple(names[j][k - 1] for j, k in places),
        output_names=distinct(variable.name for variable in outputs),
    )


def _places_of_grid(inputs, antecedents):
    """Positions of a grid's rules in the file, in C order; None if the rules are no grid.

    A grid has all combinations of two or more terms, of one family, on every input with terms.
    """
    used = [(one, own) for one, own in zip(inputs, antecedents.T, strict=True) if own.any()]
    terms = [[one.terms[k - 1] for k in np.unique(own) if k > 0] for one, own in used]
    for of_input, (_, own) in zip(terms, used, strict=True):
        places, families = [theta[0] for _, theta in of_input], {family for family, _ in of_input}
        if not own.all() or len(places) < 2 or len(families) > 1 or np.any(np.diff(places) <= 0.0):
            return None
    order = np.unique(antecedents, axis=0, return_index=True)[1]
    return order if len(antecedents) == order.size == prod(map(len, terms)) else None
