r"""Rules that do nothing: those that never fire, and those that repeat another.

A rule *never fires* where its strength is nowhere above one in a hundred. It *repeats* another
where their strengths are in proportion on all rows, which shows in their mean products over the
rows O_rs = mean of w_r w_s: O_rs / sqrt(O_rr O_ss) is close to one. They then have one consequent
between them, however it is divided. Of two that repeat one another the stronger one stays.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..model import TSKModel
from ..support import RuleSupport

# A strength that is nowhere above this: what the rule says moves no prediction by more than a
# hundredth of its difference from the others.
_NEVER = 0.01
# Cosine of the strengths of two rules over all rows: an angle of less than a degree, which no
# consequents could be told apart by.
_ALIKE = 0.9999


def redundant_rules(overlap, peak):
    """Rules that do nothing: list of dict with "rule", "reason" and "weight", by rule.

    ``overlap`` is the mean of w_r w_s over the rows, (n_rules, n_rules), ``peak`` the largest
    strength of each rule on any row.
    """
    weight, own = overlap.sum(axis=1), np.sqrt(np.diagonal(overlap))
    found = dict.fromkeys(np.flatnonzero(peak < _NEVER), "never fires")
    strongest_first = [r for r in np.argsort(-weight, kind="stable") if r not in found]
    kept: list[int] = []
    for r in strongest_first:
        alike = [s for s in kept if overlap[r, s] > _ALIKE * own[r] * own[s]]
        if alike:
            found[r] = f"repeats rule {alike[0]}"
        else:
            kept.append(r)
    return [{"rule": int(r), "reason": found[r], "weight": float(weight[r])} for r in sorted(found)]


def model_without_rules(model: TSKModel, rules: ArrayLike) -> TSKModel:
    """The model without some rules: those that are left fire as before, in proportion.

    ValueError where there is no such rule, or where none would be left.
    """
    numbers = np.asarray(rules)
    if numbers.size and numbers.dtype.kind not in "iu":
        raise TypeError(f"rules={rules!r} must be whole numbers, those of rules.")
    numbers = np.unique(numbers)
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
    antecedent, terms = model.antecedent.without_rules(numbers)
    weights, support = model.rule_weights[kept], model.support
    if support is not None:
        # What the rules say of every input alone is another thing without some of them.
        own = {key: of_rules[kept] for key, of_rules in vars(support).items() if key != "marginals"}
        support = RuleSupport(**own)
    return replace(
        model,
        antecedent=antecedent,
        initial_antecedent=model.initial_antecedent.without_rules(numbers)[0],
        coefficients=model.coefficients[kept],
        rule_weights=weights / weights.sum(),
        rule_rows=model.rule_rows[kept],
        support=support,
        posterior=None,  # it is of all rules
        term_names=tuple(model.term_names[t] for t in terms),
    )
