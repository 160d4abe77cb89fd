"""Whether what two models have seen can be added: the same premises, inputs and outputs."""

import numpy as np

from .stream import Stream

__all__ = ["check_same_premises", "stream_of"]

# Parameters that a file has carried agree to their last digits.
_ROUNDING = 1e-12


def stream_of(model, place) -> Stream:
    """What a model has seen; ValueError where it has no sums."""
    stream = getattr(model, "_stream", None)
    if stream is None:
        raise ValueError(
            f"Model {place} of merge has not been trained by partial_fit ({type(model).__name__}): "
            "there are no sums over its rows to add."
        )
    return stream


def check_same_premises(one: Stream, other: Stream, place):
    """Raise ValueError that says in what two streams differ; ``place`` is that of the other."""
    difference = _difference(one, other)
    if difference:
        raise ValueError(
            f"Models 0 and {place} of merge cannot be added: {difference}. Sums over rows add at "
            "the same premises alone: train each with solver='lse' and the same model as partition."
        )


def _difference(one, other):
    pairs = [
        ("inputs", one.base.input_names, other.base.input_names),
        ("outputs", one.base.output_names, other.base.output_names),
    ]
    for what, mine, theirs in pairs:
        if tuple(mine) != tuple(theirs):
            return f"their {what} are {', '.join(mine)} and {', '.join(theirs)}"
    if one.base.n_rules != other.base.n_rules:
        return f"they have {one.base.n_rules} and {other.base.n_rules} rules"
    inputs = [stream.moments.consequent_inputs for stream in (one, other)]
    if not np.array_equal(*inputs):
        names = [", ".join(one.base.input_names[j] for j in own) or "none" for own in inputs]
        return f"their consequents are linear in {names[0]} and in {names[1]}"
    return _difference_of_terms(one.base, other.base)


def _difference_of_terms(one, other):
    mine, theirs = one.memberships(), other.memberships()
    if len(mine) != len(theirs):
        return f"they have {len(mine)} and {len(theirs)} terms"
    for place, (a, b) in enumerate(zip(mine, theirs, strict=True)):
        what = f"term {place}, {a['name']!r} of {a['input']!r},"
        for key in ("input", "function"):
            if a[key] != b[key]:
                return f"{what} has {key} {a[key]!r} in one and {b[key]!r} in the other"
        for key in (key for key in a if key not in ("input", "name", "function")):
            size = max(abs(a[key]), abs(b[key]))
            if abs(a[key] - b[key]) > _ROUNDING * size:
                return f"{what} has {key} {a[key]:.10g} in one and {b[key]:.10g} in the other"
    if not np.array_equal(one.antecedent.rule_terms, other.antecedent.rule_terms):
        return "their rules combine the terms otherwise"
    return ""
