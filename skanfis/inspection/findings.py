"""What is not fit to be read, in sentences, and the limits beyond which it is not."""

from itertools import pairwise

import numpy as np

from ..learning.penalty import GREATEST_ALONE
from ..membership import GREATEST_CROSSING, LEAST_TRUTH
from .readable_terms import crossings, distinct_terms, greatest_truth_in_box, own_terms

__all__ = [
    "GREATEST_ALONE",
    "GREATEST_BEYOND",
    "GREATEST_CROSSING",
    "GREATEST_SUM",
    "GREATEST_WORDLESS",
    "LEAST_TRUTH",
    "capital",
    "figure",
    "findings",
    "findings_without_rows",
]

# In ranges of the target. Rules whose values lie in the target's range reach one at most. At two,
# at least half of what the rules say on some row is there to cancel the rest.
GREATEST_SUM = 2.0
# In ranges of the target. A rule may say a little more than was ever seen, for its neighbours take
# part everywhere; a quarter of the range beyond is no mean of anything that was.
GREATEST_BEYOND = 0.25

# Of the rows. Outer terms stand a little inside of the data, so that a few rows on either side have
# no true term; beyond, a stretch of the input has no name.
GREATEST_WORDLESS = 0.05

# Of figures that are compared.
_DIGITS = 6
# A sentence names so many terms, pairs or rules; beyond, it counts them.
_MOST_NAMED = 5


def findings(model, measures):
    """What the measures of a model speak against.

    Parameters
    ----------
    model : TSKModel
    measures : Measures

    Returns
    -------
    findings : list of str
    """
    sentences = _on_truth(model, own_terms(model.antecedent), measures.truth, "on any row")
    sentences += _on_crossings(model) + _on_wordless(model, measures.wordless)
    for k, name in enumerate(model.output_names):
        of_output = f" of {name!r}" if model.n_outputs > 1 else ""
        sentences += _on_compensation(measures, k, of_output)
        sentences += _on_values(measures.rule_beyond[:, k], of_output)
    return sentences


def findings_without_rows(model):
    """What can be found without rows: terms that cross, or are true nowhere in the range.

    Parameters
    ----------
    model : TSKModel

    Returns
    -------
    findings : list of str
    """
    own = own_terms(model.antecedent)
    truth = greatest_truth_in_box(model)
    return _on_truth(model, own, truth, "in the range of training") + _on_crossings(model)


def _on_truth(model, own, truth, where):
    never = [t for t in own if truth[t] < LEAST_TRUTH]
    if not never:
        return []
    what = "a term is" if len(never) == 1 else f"{len(never)} of {len(own)} terms are"
    named = _named([f"{_term(model, t)} ({figure(truth[t])})" for t in never])
    return [f"{capital(what)} never truer than {LEAST_TRUTH} {where}: {named}."]


def _on_crossings(model):
    heights = crossings(model.antecedent)
    too_high, n_pairs = [], 0
    for own in distinct_terms(model.antecedent).values():
        n_pairs += len(own) - 1
        for t, following in pairwise(own):
            if heights[t] > GREATEST_CROSSING:
                both = f"{model.term_names[t]!r} and {_term(model, following)}"
                too_high.append(f"{both} ({figure(heights[t])})")
    if not too_high:
        return []
    many = len(too_high) > 1
    what = f"{len(too_high)} of {n_pairs} pairs of neighbouring terms" if many else "Two terms"
    return [
        f"{what} can hardly be told apart, for they cross above {GREATEST_CROSSING}: "
        f"{_named(too_high)}."
    ]


def _on_wordless(model, wordless):
    # An input without terms has none, which is no more than a limit.
    beyond = np.flatnonzero(np.nan_to_num(wordless) > GREATEST_WORDLESS)
    beyond = beyond[np.argsort(-wordless[beyond], kind="stable")]
    if not beyond.size:
        return []
    named = _named([f"{model.input_names[j]!r} ({wordless[j]:.0%} of the rows)" for j in beyond])
    many = "an input" if beyond.size == 1 else f"{beyond.size} inputs"
    return [f"Rows lie where no term of {many} is truer than {LEAST_TRUTH}: {named}."]


def _on_compensation(found, k, of_output):
    sentences = []
    if found.alone[k] > GREATEST_ALONE:
        sentences.append(
            f"No rule{of_output} can be read without the others: the strongest alone misses the "
            f"model by {figure(found.alone[k])} standard deviations of the target (limit "
            f"{GREATEST_ALONE})."
        )
    if found.greatest_sum[k] > GREATEST_SUM:
        sentences.append(
            f"The rules{of_output} cancel one another: on one row their contributions add up, in "
            f"size, to {figure(found.greatest_sum[k])} ranges of the target (limit "
            f"{GREATEST_SUM:g})."
        )
    return sentences


def _on_values(beyond, of_output):
    rules = np.flatnonzero(beyond > GREATEST_BEYOND)
    if not rules.size:
        return []
    # Rules that are alike but for rounding stay in their order.
    rules = rules[np.argsort(-np.round(beyond[rules], _DIGITS), kind="stable")]
    what = "A rule says where it fires"
    if rules.size > 1:
        what = f"{rules.size} of {beyond.size} rules say where they fire"
    named = _named([f"rule {r} (by {figure(beyond[r])} ranges)" for r in rules])
    return [
        f"{what}{of_output} what the target never was, beyond its range by more than "
        f"{GREATEST_BEYOND:g} of it: {named}."
    ]


def _named(parts):
    if len(parts) <= _MOST_NAMED:
        return ", ".join(parts)
    return f"{', '.join(parts[:_MOST_NAMED])} and {len(parts) - _MOST_NAMED} more"


def _term(model, t):
    return f"{model.term_names[t]!r} of {model.input_names[model.antecedent.term_inputs[t]]!r}"


def figure(value):
    """Three digits, and no exponent where a person would write none."""
    return f"{float(f'{value:.3g}'):.10g}"


def capital(text):
    """The text as a sentence begins."""
    return text[:1].upper() + text[1:]
