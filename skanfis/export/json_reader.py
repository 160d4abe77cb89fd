"""Read a model from JSON, and check every entry.

What an object must hold is a table: under each key the function that checks its value, given the
value and its place in the file. A new member has a line there and in ``export_json``; ``VERSION``
then rises by one, and a function such as ``_of_version_1`` gives older documents its value.
"""

import json
from functools import partial
from itertools import chain, groupby
from math import inf, nan, prod

import numpy as np

from ..antecedent import (
    Antecedent,
    GridAntecedent,
    RuleTableAntecedent,
    TreeAntecedent,
    groups_of,
)
from ..membership import FAMILIES
from ..model import TSKModel
from ..naming import distinct
from ..policies import OUT_OF_BOUNDS, TargetRange
from ..posterior import MOST_PARAMETERS, Posterior
from ..support import RuleSupport
from .limits import LARGEST_NUMBER, SMALLEST_NUMBER, check_size, number, numbers, shown

FORMAT = "skanfis-model"
# Version 1 had no trees, and other members: see ``_of_version_1``.
VERSION = 2
RULE_BASES: dict[type[Antecedent], str] = {
    GridAntecedent: "grid",
    RuleTableAntecedent: "table",
    TreeAntecedent: "tree",
}
# Rounding error of the sum of weights, which are shares of the whole.
_ROUNDING = 1e-6


def _list(value, where, least=1):
    if not isinstance(value, list) or len(value) < least:
        raise ValueError(f"{where}: {shown(value)} is not a list of {least} or more.")
    return value


def _text(value, where):
    # Half a surrogate pair is no character, and cannot be written to a file.
    if not isinstance(value, str) or value != value.encode(errors="ignore").decode():
        raise ValueError(f"{where}: {shown(value)} is not a name in quotes.")
    return value


def _one_of(choices, value, where):
    if value not in choices:
        raise ValueError(f"{where} is {shown(value)}, not {', '.join(choices)}.")
    return value


def _whole(lowest, highest):
    return partial(number, lowest=lowest, highest=highest, kind=int)


def _or_null(read, null=None):
    return lambda value, where: null if value is None else read(value, where)


_list_or_empty = partial(_list, least=0)
_positive = partial(number, lowest=SMALLEST_NUMBER)
_not_negative = partial(number, lowest=0.0)
_log = partial(number, lowest=-float(np.log(LARGEST_NUMBER)), highest=float(np.log(LARGEST_NUMBER)))
_FILE = dict.fromkeys(["inputs", "outputs", "rules"], _list) | {
    # These are checked by themselves.
    **dict.fromkeys(["format", "version", "posterior"], lambda value, where: value),
    "out_of_bounds": partial(_one_of, OUT_OF_BOUNDS),
    "max_extrapolation": _or_null(_not_negative, inf),
    "rule_base": partial(_one_of, tuple(RULE_BASES.values())),
    "terms": _list_or_empty,
    "support": _or_null(_list),
}
INPUT = {
    "name": _text,
    **dict.fromkeys(["minimum", "maximum", "reference"], number),
    "spread": _positive,
    "tangent_at": _or_null(number, nan),
}
OUTPUT = {
    "name": _text,
    **dict.fromkeys(["minimum", "maximum"], _or_null(number)),
    "spread": _or_null(_positive),
    "lower": _or_null(number, -inf),
    "upper": _or_null(number, inf),
}
_POSTERIOR = ["noise", "inputs", "consequents", "premises", "cross", "pinned"]


def parse_json(text):
    """The model that a JSON text describes; ValueError if it is none."""
    return model_of(json.loads(text, object_pairs_hook=_without_repetition))


def model_of(document):
    """The model that a file's content describes."""
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ValueError(f'not a model of skanfis: it has no "format": "{FORMAT}".')
    version = document.get("version")
    if type(version) is not int or version < 1:
        raise ValueError(f'"version" is {shown(version)}, not a whole number from 1 on.')
    if version > VERSION:
        raise ValueError(
            f"the file is of version {shown(version)}, this skanfis reads versions 1 to {VERSION}: "
            "upgrade skanfis to read it."
        )
    if version == 1:
        document = _of_version_1(document)
    file = _members({"posterior": None} | document, _FILE, "the file")
    n_rules, n_terms = len(file["rules"]), len(file["terms"])
    n_inputs, n_outputs = len(file["inputs"]), len(file["outputs"])
    inputs, outputs = _inputs(file["inputs"]), _outputs(file["outputs"])
    check_size(n_rules, n_terms, n_inputs, n_outputs)
    groups, initial_groups, term_names = _terms(file["terms"], n_inputs)
    table, rules = _rules(file["rules"], n_terms, n_inputs, n_outputs)
    antecedent = rule_base(file["rule_base"], groups, table)
    support, posterior = file["support"], file["posterior"]
    if posterior is not None:
        n_slopes = n_inputs if rules["coefficients"].shape[1] > 1 else 0
        posterior = _posterior(posterior, antecedent, n_inputs, n_slopes, n_outputs)
    return TSKModel(
        **inputs,
        **outputs,
        **rules,
        antecedent=antecedent,
        initial_antecedent=rule_base(file["rule_base"], initial_groups, table),
        out_of_bounds=file["out_of_bounds"],
        max_extrapolation=file["max_extrapolation"],
        support=None if support is None else _support(support, n_rules, n_inputs),
        term_names=term_names,
        posterior=posterior,
    )


def key_of(parameter):
    """The name in the file of one parameter of a term."""
    return parameter.name if parameter.kind == "location" else f"log_{parameter.name}"


def _without_repetition(pairs):
    members: dict = {}
    for key, value in pairs:
        if key in members:
            raise ValueError(f"the key {shown(key)} stands twice in one object.")
        members[key] = value
    return members


def _members(item, readers, where):
    """The values of an object with exactly these keys, each read by its reader."""
    if not isinstance(item, dict):
        raise ValueError(f"{where} is {shown(item)}, not an object.")
    if missing := [key for key in readers if key not in item]:
        raise ValueError(f"{where} has no {shown(missing[0])}.")
    if unknown := [key for key in item if key not in readers]:
        raise ValueError(f"{where} has the unknown key {shown(unknown[0])}.")
    inner = "" if where == "the file" else f"{where}."
    return {key: read(item[key], f"{inner}{key}") for key, read in readers.items()}


def _columns(items, readers, where):
    """The values of all objects of a list, by their keys."""
    rows = [_members(item, readers, f"{where}[{k}]") for k, item in enumerate(items)]
    return {key: [row[key] for row in rows] for key in readers}


def _check_all(holds, message):
    """Raise ValueError with the first place where a condition does not hold."""
    if not np.all(holds):
        raise ValueError(message.format(np.argmin(holds)))


def _of_version_1(document):
    """The document in the present form: with ``tangent_at``, ``pinned``, a triangle as one list."""
    found = dict(document)
    if isinstance(found.get("inputs"), list):
        no_tangent = {"tangent_at": None}
        found["inputs"] = [
            one | no_tangent if isinstance(one, dict) else one for one in found["inputs"]
        ]
    posterior = found.get("posterior")
    if isinstance(posterior, dict) and isinstance(posterior.get("consequents"), list):
        rows = [row if isinstance(row, list) else [row] for row in posterior["consequents"]]
        n_outputs = len(_list(found.get("outputs"), "outputs"))
        triangle = {"consequents": list(chain.from_iterable(rows))}
        found["posterior"] = {"pinned": [[]] * n_outputs} | posterior | triangle
    return found


def _inputs(inputs):
    """The model's arrays and names of the inputs."""
    found = _columns(inputs, INPUT, "inputs")
    names, arrays = tuple(found.pop("name")), {key: np.array(own) for key, own in found.items()}
    low, high, at = arrays["minimum"], arrays["maximum"], arrays.pop("tangent_at")
    _check_all(np.equal(names, distinct(names)), "inputs[{}] has the name of another input.")
    _check_all(low <= high, "inputs[{}]: minimum is above maximum.")
    is_within = np.isnan(at) | ((low <= at) & (at <= high))
    _check_all(is_within, "inputs[{}]: tangent_at is not from minimum to maximum.")
    return arrays | {"input_names": names, "tangent_at": None if np.isnan(at).all() else at}


def _outputs(outputs):
    """Names of the outputs, and the range of the target, known for all outputs or none."""
    found = _columns(outputs, OUTPUT, "outputs")
    names = tuple(found.pop("name"))
    values = [value for column in found.values() for value in column]
    if all(value in (None, -inf, inf) for value in values):
        return {"output_names": names}
    if None in values:
        raise ValueError("outputs: minimum, maximum and spread are null of some, but not of all.")
    target = TargetRange(**{key: np.array(column) for key, column in found.items()})
    _check_all(target.minimum <= target.maximum, "outputs[{}]: minimum is above maximum.")
    _check_all(target.lower < target.upper, "outputs[{}]: lower is not below upper.")
    _check_all(
        (target.lower <= target.maximum) & (target.upper >= target.minimum),
        "outputs[{}]: nothing from minimum to maximum is within lower and upper.",
    )
    return {"output_names": names, "target": target}


def _terms(terms, n_inputs):
    """Groups of terms after training, before it, and the terms' names."""
    names: list[str] = []
    after: list[tuple] = []
    before: list[tuple] = []
    for t, item in enumerate(terms):
        where = f"terms[{t}]"
        function = item.get("function") if isinstance(item, dict) else None
        family = FAMILIES.get(function) if isinstance(function, str) else None
        if family is None:
            raise ValueError(f'{where} has no "function" among {", ".join(FAMILIES)}.')
        theta = {
            key_of(one): number if one.kind == "location" else _log for one in family.parameters
        }
        readers = {
            "name": _text,
            "input": _whole(0, n_inputs - 1),
            "function": partial(_one_of, tuple(FAMILIES)),
            "before_training": lambda start, where, theta=theta: _members(start, theta, where),
        }
        found = _members(item, readers | theta, where)
        names.append(found["name"])
        after.append((found["input"], family, [found[key] for key in theta]))
        before.append((found["input"], family, list(found["before_training"].values())))
    return groups_of(after), groups_of(before), tuple(names)


def _rules(rules, n_terms, n_inputs, n_outputs):
    """Table of terms; coefficients, weights and rows as the model has them."""
    position = _whole(-1, n_terms - 1)

    def terms(value, where):
        return [position(term, where) for term in _list(value, where, 0)]

    def consequents(value, where):
        is_constant = all(isinstance(one, list) and len(one) == 1 for one in _list(value, where))
        return numbers(value, where, (n_outputs, 1 if is_constant else 1 + n_inputs))

    readers = {
        "terms": terms,
        "weight": partial(number, lowest=0.0, highest=1.0 + _ROUNDING),
        "rows": _not_negative,
        "consequents": consequents,
    }
    found = _columns(rules, readers, "rules")
    sizes = list(zip(map(len, found["terms"]), map(np.size, found["consequents"]), strict=True))
    _check_all(
        [size == sizes[0] for size in sizes],
        "rules[{}] has other numbers of terms or coefficients than rules[0].",
    )
    weights = np.array(found["weight"])
    if not abs(weights.sum() - 1.0) <= _ROUNDING:
        raise ValueError(f"rules[].weight: the sum over all rules is {weights.sum():g}, not 1.")
    table = np.array(found["terms"], dtype=int).reshape(len(rules), sizes[0][0])
    coefficients = np.array(found["consequents"]).transpose(0, 2, 1).copy()
    rows = np.array(found["rows"])
    return table, {"coefficients": coefficients, "rule_weights": weights, "rule_rows": rows}


def _support(items, n_rules, n_inputs):
    """The support of the rules, out of an entry for each."""
    if len(items) != n_rules:
        raise ValueError(f"support has {len(items)} entries; the model has {n_rules} rules.")
    readers = {
        "share": partial(number, lowest=0.0, highest=1.0),
        "center": partial(numbers, shape=(n_inputs,)),
        "factor": partial(numbers, shape=(n_inputs * (n_inputs + 1) // 2,)),
        "radius": _not_negative,
    }
    found = {
        key: np.array(of_rules) for key, of_rules in _columns(items, readers, "support").items()
    }
    # Memory is taken only now that the file has turned out to hold as many numbers.
    factor = np.zeros((n_rules, n_inputs, n_inputs))
    factor[:, *np.tril_indices(n_inputs)] = found["factor"]
    return RuleSupport(**found | {"factor": factor})


def _posterior(item, antecedent, n_inputs, n_slopes, n_outputs):
    """The posterior that an object describes; ValueError if it does not fit the model."""
    found = _members(item, dict.fromkeys(_POSTERIOR, _list_or_empty), "posterior")
    index = _whole(0, n_inputs - 1)
    inputs = [index(value, "posterior.inputs") for value in found.pop("inputs")]
    if len(set(inputs)) < len(inputs) or len(inputs) > n_slopes:
        raise ValueError(
            f"posterior.inputs: {shown(inputs)} has an input twice, or more than {n_slopes}."
        )
    n_parameters = antecedent.parameters.size
    n_columns = antecedent.n_rules * (1 + len(inputs))
    if n_columns + n_parameters > MOST_PARAMETERS:
        raise ValueError(f"posterior: more than {MOST_PARAMETERS} parameters.")
    # There may be fewer: directions that no data tell from rounding are left out.
    n_rows, n_free = len(found["premises"]), np.unique(antecedent.tied).size
    if n_rows > n_free:
        raise ValueError(f"posterior.premises has {n_rows} rows; {n_free} fit.")
    n_pinned = len(_list(_list(found["pinned"], "posterior.pinned")[0], "posterior.pinned[0]", 0))
    if n_pinned > n_columns + n_rows:
        raise ValueError(f"posterior.pinned has {n_pinned} rows; {n_columns + n_rows} fit.")
    shapes = {
        "noise": (n_outputs,),
        "consequents": (n_columns * (n_columns + 1) // 2,),
        "premises": (n_rows, n_parameters),
        "cross": (n_outputs, n_rows, n_columns),
        "pinned": (n_outputs, n_pinned, n_columns + n_rows),
    }
    arrays = {key: numbers(found[key], f"posterior.{key}", shape) for key, shape in shapes.items()}
    consequents = np.zeros((n_columns, n_columns))
    consequents[np.tril_indices(n_columns)] = arrays["consequents"]
    is_noise = (arrays["noise"] == 0.0) | (arrays["noise"] >= SMALLEST_NUMBER)
    _check_all(is_noise, f"posterior.noise[{{}}] is neither 0 nor {SMALLEST_NUMBER:g} or more.")
    return Posterior(**arrays | {"inputs": np.array(inputs, dtype=int), "consequents": consequents})


def rule_base(kind, groups, table):
    """The rule base of a kind with these terms; ValueError if its rules differ from the table."""
    antecedent: Antecedent = RuleTableAntecedent(groups, table)
    inputs, fits = antecedent.term_inputs, True
    if kind == "grid":
        counts = tuple(len(list(run)) for _, run in groupby(inputs))
        antecedent = GridAntecedent(groups, counts=counts)
        fits = prod(counts) == len(table) and len(counts) == np.unique(inputs).size
    elif kind == "tree":
        antecedent = _tree(groups, table)
    if not fits or not np.array_equal(antecedent.rule_terms, table):
        raise ValueError(f'the rules are not those of "rule_base": "{kind}".')
    for r, row in enumerate(table):
        terms = row[row >= 0]
        if np.unique(terms).size < terms.size:
            raise ValueError(f"rules[{r}].terms: {terms.tolist()} has a term twice.")
    return antecedent


def _tree(groups, table):
    """The tree with these rules as leaves; ValueError if there is none."""
    if [group.family.name for group in groups] != ["sigmoid_rising", "sigmoid_falling"]:
        raise ValueError(
            'terms: those of a "tree" are sigmoid_rising first, above each cut, then as many '
            "sigmoid_falling, below it."
        )
    above, below = groups
    if above.n_terms != below.n_terms:
        raise ValueError(f"terms: {above.n_terms} sides above a cut, and {below.n_terms} below.")
    is_same = (above.inputs == below.inputs) & (above.theta == below.theta).all(axis=0)
    _check_all(is_same, "terms[{}]: the side below has another input, cut or width.")
    tree = TreeAntecedent(groups, table)
    leaves = [tuple(path) for path in tree.paths]
    steps = {(path[:k], node) for path in leaves for k, (node, _) in enumerate(path)}
    places, cuts = ({step[i] for step in steps} for i in (0, 1))
    sides = {side for path in leaves for side in path}
    is_one_to_one = len(steps) == len(places) == len(cuts) == tree.n_nodes
    ends_alone = len({*leaves} - places) == len(leaves)
    if not (is_one_to_one and ends_alone and len(sides) == 2 * tree.n_nodes):
        raise ValueError(
            "rules: the paths are no tree: each cut stands at one place, and there paths go on to "
            "both of its sides; no path ends within another."
        )
    return tree
