"""What text, tables and pictures have in common: how a model's rules are told and chosen."""

from dataclasses import replace
from numbers import Real

import numpy as np

from .._validation import check_choice, check_count, warn_user
from ..exceptions import ReadabilityWarning
from ..export import last_step
from ..model import TSKModel

__all__ = [
    "SORT_BY",
    "choose_rules",
    "conditions",
    "consequents_about",
    "knows_data",
    "premise_text",
    "premises",
    "readability_in_training",
    "renamed",
    "round_reference",
    "warn_if_unreadable",
]

SORT_BY = ("weight", "rows", "rule")


def knows_data(model):
    """Whether the model remembers training data; one read from a .fis file has none."""
    return bool(np.any(model.rule_rows))


def readability_in_training(estimator, model):
    """What the fit found of its rules on its rows; None where nothing is known of it.

    It has no units, and terms and rules keep their order when scalers are folded in: with the names
    of ``model``, the whole, its sentences speak of the whole's columns.
    """
    if isinstance(estimator, TSKModel):
        return None
    found = getattr(last_step(estimator), "readability_", None)
    return None if found is None else replace(found, model=model)


def warn_if_unreadable(estimator, model):
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
        warn_user("\n".join(lines), ReadabilityWarning)


def conditions(model):
    """For every rule the positions (input, term) that it looks at."""
    inputs = model.antecedent.term_inputs
    return [
        [(int(inputs[t]), int(t)) for t in rule if t >= 0] for rule in model.antecedent.rule_terms
    ]


def premises(model):
    """For every rule its terms by input, and the inputs that some rule looks at."""
    rules = [dict(rule) for rule in conditions(model)]
    return rules, sorted({j for rule in rules for j in rule})


def premise_text(model, rule_conditions, conjunction=" AND "):
    """Say "temperature is low AND rate is high"; "anything" of a rule that asks nothing."""
    if not rule_conditions:
        return "anything"
    return conjunction.join(
        f"{model.input_names[j]} is {model.term_names[t]}" for j, t in rule_conditions
    )


def choose_rules(model, sort_by, max_rules, min_weight):
    """Positions of the rules to tell, in the order to tell them."""
    check_choice("sort_by", sort_by, SORT_BY)
    if max_rules is not None:
        check_count("max_rules", max_rules, 1)
    if not isinstance(min_weight, Real) or not 0.0 <= float(min_weight) <= 1.0:
        raise ValueError(
            f"min_weight={min_weight!r} must be a number from 0 to 1: a part of the weight of the "
            "training data."
        )
    # Rounded, so that rules alike but for rounding errors stay in the order of their numbers.
    rank = {
        "weight": np.round(model.rule_weights, 9),
        "rows": model.rule_rows,
        "rule": np.zeros(model.n_rules),
    }
    order = np.argsort(-rank[sort_by], kind="stable")
    return order[~(model.rule_weights[order] < min_weight)][:max_rules]


def consequents_about(model, reference):
    """Coefficients (n_rules, 1 + n_inputs, n_outputs) of 1 and of the inputs less a reference."""
    moved = np.zeros((model.n_rules, 1 + model.n_inputs, model.n_outputs))
    moved[:, : model.coefficients.shape[1]] = model.coefficients
    moved[:, 0] += np.einsum("j,rjo->ro", reference - model.reference, moved[:, 1:])
    return moved


def round_reference(model):
    """The inputs' means, rounded to the leading digit of their spreads."""
    digits = [int(np.floor(np.log10(spread))) for spread in model.spread]
    return np.array([round(float(x), -d) for x, d in zip(model.reference, digits, strict=True)])


def renamed(model, feature_names, output_names):
    """The model with other names of inputs and outputs, where given."""
    if feature_names is not None:
        names = _check_names("feature_names", feature_names, model.n_inputs, "inputs")
        model = replace(model, input_names=names)
    if output_names is not None:
        names = _check_names("output_names", output_names, model.n_outputs, "outputs")
        model = replace(model, output_names=names)
    return model


def _check_names(parameter, names, count, what):
    names = tuple(names) if not isinstance(names, str) else names
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"{parameter} must be a sequence of str, got {names!r}.")
    if len(names) != count:
        raise ValueError(f"{parameter} has {len(names)} names; the model has {count} {what}.")
    if len(set(names)) != len(names):
        raise ValueError(f"{parameter} repeats a name: {list(names)!r}.")
    return names
