"""Reading a model from JSON, every entry checked."""

import json
from itertools import groupby
from math import inf, prod

import numpy as np

from ..antecedent import (
    Antecedent,
    GridAntecedent,
    RuleTableAntecedent,
    ScatteredAntecedent,
    TermGroup,
)
from ..membership import MEMBERSHIPS
from ..model import TSKModel
from ..policies import OUT_OF_BOUNDS, TargetRange
from ..posterior import MOST_PARAMETERS, Posterior
from ..support import RuleSupport
from .limits import LARGEST_NUMBER, SMALLEST_NUMBER, check_size, number, numbers, shown

__all__ = ["FORMAT", "KINDS", "LIMITS", "OUTPUT", "VERSION", "key_of", "model_of", "parse_json"]

FORMAT = "skanfis-model"
VERSION = 1
KINDS: dict[type[Antecedent], str] = {
    GridAntecedent: "grid",
    ScatteredAntecedent: "scattered",
    RuleTableAntecedent: "table",
}
_FILE = (
    "format version inputs outputs out_of_bounds max_extrapolation rule_base terms rules support"
)
_INPUT = ["name", "minimum", "maximum", "reference", "spread"]
# Of an output; null where there is none.
LIMITS = ["lower", "upper"]
OUTPUT = ["name", "minimum", "maximum", "spread", *LIMITS]
_POSTERIOR = ["noise", "inputs", "consequents", "premises", "cross"]
_LARGEST_LOG = float(np.log(LARGEST_NUMBER))
# Of weights, each of which is a part of the whole.
_ROUNDING = 1e-6


def parse_json(text):
    """The model that a JSON text describes; ValueError where it is none."""
    return model_of(json.loads(text, parse_constant=_refuse, object_pairs_hook=_without_repetition))


def model_of(document):
    """The model that a file's content describes."""
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ValueError(f'not a model of skanfis: it has no "format": "{FORMAT}".')
    version = document.get("version")
    if type(version) is not int or version < 1:
        raise ValueError(f'"version" is {shown(version)}, not a whole number from 1 on.')
    if version > VERSION:
        raise ValueError(
            f"the file is of version {shown(version)}, this skanfis reads version {VERSION}: "
            "upgrade skanfis to read it."
        )
    posterior = document.get("posterior")
    document = {key: value for key, value in document.items() if key != "posterior"}
    _, _, inputs, outputs, policy, limit, kind, terms, rules, support = _members(
        document, _FILE.split(), "the file"
    )
    input_names, box = _inputs(_list(inputs, "inputs"))
    output_names, target = _outputs(_list(outputs, "outputs"))
    if policy not in OUT_OF_BOUNDS:
        raise ValueError(f"out_of_bounds is {shown(policy)}, not {', '.join(OUT_OF_BOUNDS)}.")
    limit = inf if limit is None else number(limit, "max_extrapolation", 0.0)
    n_rules = len(_list(rules, "rules"))
    check_size(n_rules, len(_list(terms, "terms", 0)), len(inputs), len(outputs))
    groups, initial_groups, term_names = _read_terms(terms, len(inputs))
    table, weights, rows, coefficients = _rules(rules, len(terms), len(inputs), len(outputs))
    antecedent = _rule_base(kind, groups, table)
    if posterior is not None:
        n_slopes = len(inputs) if coefficients.shape[1] > 1 else 0
        posterior = _posterior(posterior, antecedent, len(inputs), n_slopes, len(outputs))
    if not abs(weights.sum() - 1.0) <= _ROUNDING:
        raise ValueError(f"rules[].weight: the sum over all rules is {weights.sum():g}, not 1.")
    return TSKModel(
        antecedent=antecedent,
        initial_antecedent=_rule_base(kind, initial_groups, table),
        coefficients=coefficients,
        reference=box[2],
        spread=box[3],
        minimum=box[0],
        maximum=box[1],
        rule_weights=weights,
        rule_rows=rows,
        input_names=input_names,
        out_of_bounds=policy,
        max_extrapolation=limit,
        support=None if support is None else _support(support, n_rules, len(inputs)),
        term_names=term_names,
        output_names=output_names,
        target=target,
        posterior=posterior,
    )


def key_of(parameter):
    """The name in the file of one parameter of a term."""
    return parameter.name if parameter.kind == "location" else f"log_{parameter.name}"


def _refuse(constant):
    raise ValueError(f"{constant} is not a number of JSON; every number must be finite.")


def _without_repetition(pairs):
    members: dict = {}
    for key, value in pairs:
        if key in members:
            raise ValueError(f"the key {shown(key)} stands twice in one object.")
        members[key] = value
    return members


def _inputs(inputs):
    """Names, and minimum, maximum, reference, spread as rows."""
    names, box = [], []
    for j, item in enumerate(inputs):
        where = f"inputs[{j}]"
        name, *_ = _members(item, _INPUT, where)
        box.append(_range(item, _INPUT[1:], where))
        names.append(_text(name, where))
    return tuple(names), np.array(box).T.copy()


def _outputs(outputs):
    """Names, and the range of the target, which is known of every output or of none."""
    names, known = [], []
    for k, item in enumerate(outputs):
        where = f"outputs[{k}]"
        name, *values = _members(item, OUTPUT, where)
        names.append(_text(name, where))
        if all(value is None for value in values):
            continue
        seen = _range(item, ["minimum", "maximum", "spread"], where)
        ends = [
            end if item[key] is None else number(item[key], f"{where}.{key}")
            for key, end in zip(LIMITS, (-inf, inf), strict=True)
        ]
        if not ends[0] < ends[1]:
            raise ValueError(f"{where}: lower is not below upper.")
        if ends[0] > seen[1] or ends[1] < seen[0]:
            raise ValueError(f"{where}: nothing from minimum to maximum is within lower and upper.")
        known.append([*seen, *ends])
    if known and len(known) < len(names):
        raise ValueError("outputs: minimum, maximum and spread are null of some, but not of all.")
    return tuple(names), TargetRange(*np.array(known).T.copy()) if known else None


def _range(item, keys, where):
    """The numbers of these keys; minimum is at most maximum, and the spread is positive."""
    lowest = {"spread": SMALLEST_NUMBER}
    found = [number(item[key], f"{where}.{key}", lowest.get(key, -LARGEST_NUMBER)) for key in keys]
    if item["minimum"] > item["maximum"]:
        raise ValueError(f"{where}: minimum is above maximum.")
    return found


def _read_terms(terms, n_inputs):
    """Groups of terms after training, before it, and the terms' names."""
    names: list[str] = []
    after: list[tuple] = []
    before: list[tuple] = []
    for t, item in enumerate(terms):
        where = f"terms[{t}]"
        function = item.get("function") if isinstance(item, dict) else None
        family = MEMBERSHIPS.get(function) if isinstance(function, str) else None
        if family is None:
            raise ValueError(f'{where} has no "function" among {", ".join(MEMBERSHIPS)}.')
        limits = {
            key_of(parameter): LARGEST_NUMBER if parameter.kind == "location" else _LARGEST_LOG
            for parameter in family.parameters
        }
        name, j, _, start, *_ = _members(
            item, ["name", "input", "function", "before_training", *limits], where
        )
        j = _whole(j, 0, n_inputs - 1, f'"input" of {where}')
        names.append(_text(name, where))
        _members(start, limits, f'"before_training" of {where}')
        for found, place, terms_of in (
            (item, where, after),
            (start, f"{where}.before_training", before),
        ):
            theta = [
                number(found[key], f"{place}.{key}", -largest, largest)
                for key, largest in limits.items()
            ]
            terms_of.append((j, family, theta))
    return _groups(after), _groups(before), tuple(names)


def _groups(terms):
    """Consecutive terms of one family together."""
    groups = []
    for family, members in groupby(terms, key=lambda term: term[1]):
        inputs, _, theta = zip(*members, strict=True)
        groups.append(TermGroup(family, np.array(inputs), np.array(theta).T.copy()))
    return tuple(groups)


def _rules(rules, n_terms, n_inputs, n_outputs):
    """Table of terms, weights, rows and coefficients."""
    table, weights, rows = [], [], []
    consequents: list[np.ndarray] = []
    for r, item in enumerate(rules):
        where = f"rules[{r}]"
        keys = ["terms", "weight", "rows", "consequents"]
        own, weight, n_rows, by_output = _members(item, keys, where)
        table.append([_whole(t, -1, n_terms - 1, where) for t in _list(own, where, 0)])
        weights.append(number(weight, f"{where}.weight", 0.0, 1.0 + _ROUNDING))
        rows.append(number(n_rows, f"{where}.rows", 0.0))
        sizes = [len(_list(one, f"{where}.consequents")) for one in _list(by_output, where)]
        if len(sizes) != n_outputs or sizes[0] not in (1, 1 + n_inputs):
            raise ValueError(
                f'"consequents" of {where} must be one list per output, of 1 or {1 + n_inputs} '
                "numbers."
            )
        n_basis = consequents[0].shape[1] if consequents else sizes[0]
        if sizes != [n_basis] * n_outputs or len(table[-1]) != len(table[0]):
            raise ValueError(f"{where} has other numbers of terms or coefficients than rules[0].")
        consequents.append(numbers(by_output, (n_outputs, n_basis), f"{where}.consequents"))
    terms = np.array(table, dtype=int).reshape(len(rules), len(table[0]))
    coefficients = np.array(consequents).transpose(0, 2, 1).copy()
    return terms, np.array(weights), np.array(rows), coefficients


def _support(items, n_rules, n_inputs):
    """The support of the rules, out of an entry for each."""
    n_factor = n_inputs * (n_inputs + 1) // 2
    if len(_list(items, "support")) != n_rules:
        raise ValueError(f"support has {len(items)} entries; the model has {n_rules} rules.")
    found = []
    for r, item in enumerate(items):
        where = f"support[{r}]"
        keys = ["share", "center", "factor", "radius"]
        share, center, factor, radius = _members(item, keys, where)
        share = number(share, f"{where}.share", 0.0, 1.0)
        center = numbers(center, (n_inputs,), f"{where}.center")
        factor = numbers(factor, (n_factor,), f"{where}.factor")
        found.append((share, center, factor, number(radius, f"{where}.radius", 0.0)))
    shares, centers, factors, radii = map(np.array, zip(*found, strict=True))
    # Asked for now that the file has shown to be as large.
    factor = np.zeros((n_rules, n_inputs, n_inputs))
    factor[:, *np.tril_indices(n_inputs)] = factors
    return RuleSupport(shares, centers, factor, radii)


def _posterior(item, antecedent, n_inputs, n_slopes, n_outputs):
    """The posterior that an object describes; ValueError where it is not one of such a model."""
    if isinstance(item, dict):
        # Only where constraints are met with equality.
        item = {"pinned": [[]] * n_outputs} | item
    _, inputs, triangle, rows, _, pinned = _members(item, [*_POSTERIOR, "pinned"], "posterior")
    if not isinstance(inputs, list) or len(inputs) > n_slopes:
        raise ValueError(f"posterior.inputs: {shown(inputs)} is not a list of up to {n_slopes}.")
    for value in inputs:
        _whole(value, 0, n_inputs - 1, "posterior.inputs")
    if len(set(inputs)) < len(inputs):
        raise ValueError(f"posterior.inputs: {shown(inputs)} has an input twice.")
    n_parameters = antecedent.parameters.size
    n_columns = antecedent.n_rules * (1 + len(inputs))
    if n_columns + n_parameters > MOST_PARAMETERS:
        raise ValueError(f"posterior: more than {MOST_PARAMETERS} parameters.")
    n_rows = n_parameters if rows else 0
    if len(_list(triangle, "posterior.consequents")) != n_columns:
        raise ValueError(f"posterior.consequents is not a triangle of {n_columns} rows.")
    consequents = np.zeros((n_columns, n_columns))
    for i, row in enumerate(triangle):
        consequents[i, : i + 1] = numbers(row, (i + 1,), f"posterior.consequents[{i}]")
    n_pinned = len(_list(_list(pinned, "posterior.pinned")[0], "posterior.pinned[0]", 0))
    if n_pinned > n_columns + n_rows:
        raise ValueError(f"posterior.pinned has {n_pinned} rows, more than columns.")
    return Posterior(
        np.abs(numbers(item["noise"], (n_outputs,), "posterior.noise")),
        np.array(inputs, dtype=int),
        consequents,
        numbers(rows, (n_rows, n_parameters), "posterior.premises"),
        numbers(item["cross"], (n_outputs, n_rows, n_columns), "posterior.cross"),
        numbers(pinned, (n_outputs, n_pinned, n_columns + n_rows), "posterior.pinned"),
    )


def _rule_base(kind, groups, table):
    """The rule base of a kind with these terms; ValueError where its rules are not the table's."""
    inputs = np.concatenate([group.inputs for group in groups]) if groups else np.empty(0, int)
    antecedent: Antecedent
    if kind == "grid":
        counts = tuple(len(list(run)) for _, run in groupby(inputs))
        antecedent = GridAntecedent(groups, counts=counts)
        fits = prod(counts) == len(table) and len(counts) == np.unique(inputs).size
    elif kind == "scattered":
        antecedent = ScatteredAntecedent(groups, n_premise_inputs=table.shape[1])
        fits = 0 < table.size == inputs.size
    elif kind == "table":
        antecedent, fits = RuleTableAntecedent(groups, table), True
    else:
        raise ValueError(f'"rule_base" is {shown(kind)}, not {", ".join(KINDS.values())}.')
    if not fits or not np.array_equal(antecedent.rule_terms, table):
        raise ValueError(f'the rules are not those of "rule_base": "{kind}".')
    # Each place in a rule is one input's, and no input has two.
    owns = [np.unique(inputs[column[column >= 0]]) for column in table.T]
    if any(own.size > 1 for own in owns):
        raise ValueError("the terms at one place of the rules are of different inputs.")
    seen = np.concatenate(owns) if owns else np.empty(0)
    if np.unique(seen).size < seen.size:
        raise ValueError("rules have two terms of one input.")
    return antecedent


def _members(item, keys, where):
    """The values of exactly these keys."""
    if not isinstance(item, dict):
        raise ValueError(f"{where} is {shown(item)}, not an object.")
    if missing := [key for key in keys if key not in item]:
        raise ValueError(f"{where} has no {shown(missing[0])}.")
    if unknown := [key for key in item if key not in keys]:
        raise ValueError(f"{where} has the unknown key {shown(unknown[0])}.")
    return [item[key] for key in keys]


def _list(value, where, least=1):
    if not isinstance(value, list) or len(value) < least:
        raise ValueError(f"{where}: {shown(value)} is not a list of {least} or more.")
    return value


def _text(value, where):
    if not isinstance(value, str):
        raise ValueError(f"{where}: {shown(value)} is not a name in quotes.")
    return value


def _whole(value, lowest, highest, where):
    if type(value) is not int or not lowest <= value <= highest:
        raise ValueError(
            f"{where}: {shown(value)} is not a whole number from {lowest} to {highest}."
        )
    return value
