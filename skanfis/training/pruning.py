r"""Rules that do nothing: those that never fire, and those that repeat another.

A rule *never fires* where it has no say on any training row: its strength is nowhere above one in a
hundred. It *repeats* another where their strengths are in proportion on all rows, which shows in
their mean products over the rows O_rs = mean of w_r w_s: O_rs / sqrt(O_rr O_ss) is close to one.
They then have one consequent between them, however it is divided. Of two that repeat one another
the stronger one stays.

:func:`model_without_rules` leaves rules out of a frozen model, for training to go on from there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ..antecedent import Antecedent, GridAntecedent, RuleTableAntecedent, TermGroup
from ..data import StandardisedData
from ..model import TSKModel
from ..support import RuleFiring, RuleSupport

__all__ = [
    "RuleStatistics",
    "model_without_rules",
    "redundant_rules",
    "rule_statistics",
    "without_rules",
]

# A strength that is nowhere above this: what the rule says moves no prediction by more than a
# hundredth of its difference from the others.
_NEVER = 0.01
# Cosine of the strengths of two rules over all rows: an angle of less than a degree, which no
# consequents could be told apart by.
_ALIKE = 0.9999


@dataclass(frozen=True, eq=False)
class RuleStatistics:
    """How rules fire on a set of rows."""

    overlap: np.ndarray  # mean of w_r w_s, (n_rules, n_rules)
    strongest: np.ndarray  # part of the weight on which each rule is the strongest
    peak: np.ndarray  # largest strength of each rule on any row


def rule_statistics(rows: StandardisedData, firing: RuleFiring) -> RuleStatistics:
    """Statistics of every rule, out of how rules have fired on these rows."""
    weight = rows.total_weight
    return RuleStatistics(firing.overlap / weight, firing.strongest / weight, firing.peak)


def redundant_rules(statistics: RuleStatistics):
    """Rules that do nothing: list of dict with "rule", "reason" and "weight", by rule."""
    overlap = statistics.overlap
    weight, own = overlap.sum(axis=1), np.sqrt(np.diagonal(overlap))
    found = dict.fromkeys(np.flatnonzero(statistics.peak < _NEVER), "never fires")
    strongest_first = [r for r in np.argsort(-weight, kind="stable") if r not in found]
    kept: list[int] = []
    for r in strongest_first:
        alike = [s for s in kept if overlap[r, s] > _ALIKE * own[r] * own[s]]
        if alike:
            found[r] = f"repeats rule {alike[0]}"
        else:
            kept.append(r)
    return [{"rule": int(r), "reason": found[r], "weight": float(weight[r])} for r in sorted(found)]


def without_rules(antecedent: Antecedent, rules: Sequence[int] | np.ndarray):
    """The rule base without some rules, and the terms that are left, by position.

    A grid stays a grid where whole terms go; else its rules are listed one by one. Terms that no
    rule uses go too.
    """
    kept = np.setdiff1d(np.arange(antecedent.n_rules), rules)
    table = antecedent.rule_terms[kept]
    terms = np.unique(table[table >= 0])
    if isinstance(antecedent, GridAntecedent):
        counts = [np.unique(column).size for column in table.T]
        if np.prod(counts) == kept.size:
            return _grid_with(antecedent, terms)
    place = np.full(antecedent.n_terms + 1, -1)
    place[terms] = np.arange(terms.size)
    return RuleTableAntecedent(_groups_with(antecedent.groups, terms), place[table]), terms


def _groups_with(groups, terms):
    """The groups with these terms alone."""
    left, start = [], 0
    for group in groups:
        own = terms[(terms >= start) & (terms < start + group.n_terms)] - start
        if own.size:
            left.append(TermGroup(group.family, group.inputs[own], group.theta[:, own]))
        start += group.n_terms
    return tuple(left)


def _grid_with(antecedent, terms):
    """A grid of fewer terms, and which; an input with one term left has no say any more."""
    inputs = antecedent.term_inputs
    left, numbers = np.unique(inputs[terms], return_counts=True)
    terms = terms[np.isin(inputs[terms], left[numbers > 1])]
    counts = tuple(int(np.sum(inputs[terms] == j)) for j in dict.fromkeys(inputs[terms]))
    return replace(antecedent, groups=_groups_with(antecedent.groups, terms), counts=counts), terms


def model_without_rules(model: TSKModel, rules: Sequence[int] | np.ndarray) -> TSKModel:
    """The model without some rules: those that are left fire as before, in proportion.

    ValueError where there is no such rule, or where none would be left.
    """
    numbers = np.unique(np.asarray(rules, dtype=int))
    unknown = numbers[(numbers < 0) | (numbers >= model.n_rules)]
    if unknown.size:
        raise ValueError(
            f"rules has {unknown[0]}, but the model has {model.n_rules} rules, of the numbers 0 to "
            f"{model.n_rules - 1}."
        )
    if numbers.size == 0:
        return model
    if numbers.size == model.n_rules:
        raise ValueError(f"rules names all {model.n_rules} rules: one at least must be left.")
    kept = np.setdiff1d(np.arange(model.n_rules), numbers)
    antecedent, terms = without_rules(model.antecedent, numbers)
    weights = model.rule_weights[kept]
    return replace(
        model,
        antecedent=antecedent,
        initial_antecedent=without_rules(model.initial_antecedent, numbers)[0],
        coefficients=model.coefficients[kept],
        rule_weights=weights / weights.sum(),
        rule_rows=model.rule_rows[kept],
        support=_support_of(model.support, kept),
        term_names=tuple(model.term_names[t] for t in terms),
    )


def _support_of(support, rules):
    """The support of some of the rules."""
    if support is None:
        return None
    return RuleSupport(*(getattr(support, field.name)[rules] for field in fields(support)))
