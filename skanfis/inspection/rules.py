"""The rules as one frame, from which text, tables, HTML and pictures are made."""

import warnings
from dataclasses import replace
from numbers import Real

import numpy as np
import pandas as pd

from .._validation import check_choice, check_count
from ..exceptions import ReadabilityWarning
from ..export import last_step
from ..model import TSKModel

__all__ = [
    "choose_rules",
    "has_training_data",
    "premise_texts",
    "readability_in_training",
    "rename",
    "rounded_reference",
    "rule_values",
    "rules_frame",
    "warn_of_findings",
    "writable",
]


def rules_frame(model, reference):
    """A row per rule: ("if", input), ("data", "weight" or "rows"), ("then output", coefficient).

    Consequents are by the inputs' distances from ``reference``; no term is None.
    """
    model = writable(model)
    inputs, names = model.antecedent.term_inputs, model.term_names
    terms: list[dict[int, str]] = [{} for _ in range(model.n_rules)]
    for rule, of_rule in zip(terms, model.antecedent.rule_terms.tolist(), strict=True):
        for t in of_rule:
            if t >= 0:
                before = f"{rule[inputs[t]]} and " if inputs[t] in rule else ""
                rule[inputs[t]] = before + names[t]
    columns: dict = {
        ("if", model.input_names[j]): [rule.get(j) for rule in terms]
        for j in sorted({j for rule in terms for j in rule})
    }
    columns["data", "weight"] = model.rule_weights
    columns["data", "rows"] = model.rule_rows
    consequents = np.zeros((model.n_rules, 1 + model.n_inputs, model.n_outputs))
    consequents[:, : model.coefficients.shape[1]] = model.coefficients
    consequents[:, 0] += np.einsum("j,rjo->ro", reference - model.reference, consequents[:, 1:])
    for k, output in enumerate(model.output_names):
        for i, name in enumerate(("constant", *model.input_names)):
            columns[f"then {output}", name] = consequents[:, i, k]
    return pd.DataFrame(columns, index=pd.RangeIndex(model.n_rules, name="rule"))


def premise_texts(frame):
    """Say "temperature is low AND rate is high"; "anything" of a rule that asks nothing."""
    if "if" not in frame:
        return ["anything"] * len(frame)
    return [
        " AND ".join(f"{name} is {term}" for name, term in rule.items() if isinstance(term, str))
        or "anything"
        for rule in frame["if"].to_dict("records")
    ]


def choose_rules(frame, sort_by, max_rules, min_weight):
    """The rules to show, in the order to show them."""
    check_choice("sort_by", sort_by, ("weight", "rows", "rule"))
    if max_rules is not None:
        check_count("max_rules", max_rules, 1)
    if not isinstance(min_weight, Real) or not 0.0 <= float(min_weight) <= 1.0:
        raise ValueError(f"min_weight={min_weight!r} must be a number from 0 to 1.")
    if sort_by != "rule":
        # Rounded, so that rules alike but for rounding errors stay in the order of their numbers.
        size = np.round(frame["data", sort_by].to_numpy(), 9)
        frame = frame.iloc[np.argsort(-size, kind="stable")]
    return frame[frame["data", "weight"].to_numpy() >= min_weight][:max_rules]


def rule_values(model, rows):
    """f_r at rows in the box, shape (n_rows, n_rules, n_outputs)."""
    constant, slopes = model.coefficients[:, 0], model.coefficients[:, 1:]
    if not model.order:
        return np.tile(constant, (len(rows), 1, 1))
    return constant + np.einsum("nj,rjo->nro", rows - model.reference, slopes)


def has_training_data(model):
    """Whether the model remembers training data; one read from a .fis file has none."""
    return bool(np.any(model.rule_rows))


def rounded_reference(model):
    """The inputs' means, rounded to the leading digit of their spreads."""
    digits = [int(np.floor(np.log10(spread))) for spread in model.spread]
    return np.array([round(float(x), -d) for x, d in zip(model.reference, digits, strict=True)])


def readability_in_training(estimator, model):
    """The fit's ``readability_`` in the names of ``model``, the whole; None where there is none."""
    last = None if isinstance(estimator, TSKModel) else last_step(estimator)
    found = getattr(last, "readability_", None)
    return None if found is None else replace(found, model=model)


def warn_of_findings(estimator, model):
    """Issue a ReadabilityWarning where the fit found that its rules cannot be read one by one."""
    found = readability_in_training(estimator, model)
    if found is not None and found.findings:
        lines = [
            "The rules are not fit to be read one by one:",
            *(f"- {sentence}" for sentence in found.findings),
            "The predictions may be good all the same. For rules that can be read, let them agree "
            "more (agreement=0.01, say; it costs some accuracy), or take fewer terms (n_mfs) or "
            "inputs (premise_features, consequent_features). skanfis.inspection.readability has "
            "the figures.",
        ]
        warnings.warn("\n".join(lines), ReadabilityWarning, stacklevel=3)


def writable(model):
    """The model with names that pandas and files take: lone surrogates become escapes."""
    written = {}
    for kind in ("input_names", "output_names", "term_names"):
        names = [name.encode("utf-8", "backslashreplace") for name in getattr(model, kind)]
        written[kind] = tuple(name.decode() for name in names)
    return replace(model, **written)


def rename(model, feature_names, output_names):
    """The model with other names of inputs and outputs, where given."""
    if feature_names is not None:
        names = _checked_names("feature_names", feature_names, model.n_inputs, "inputs")
        model = replace(model, input_names=names)
    if output_names is not None:
        names = _checked_names("output_names", output_names, model.n_outputs, "outputs")
        model = replace(model, output_names=names)
    return writable(model)


def _checked_names(parameter, names, count, what):
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"{parameter} must be a sequence of str, got {names!r}.")
    if len(names) != count:
        raise ValueError(f"{parameter} has {len(names)} names; the model has {count} {what}.")
    if len(set(names)) != len(names):
        raise ValueError(f"{parameter} repeats a name: {list(names)!r}.")
    return tuple(names)
