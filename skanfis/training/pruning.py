r"""Rules that do nothing: those that never fire, and those that repeat another.

A rule *never fires* if its strength is below one in a hundred on every row. It *repeats* another if
their strengths are proportional over the rows. Then the cosine O_rs / sqrt(O_rr O_ss) is close to
one, with O_rs the mean of w_r w_s, and the data determine only one consequent for both, however it
is divided. Of two rules that repeat one another, the stronger one stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..model import TSKModel
from ..support import RuleSupport

# Largest strength of a rule that never fires: it moves no prediction by more than a hundredth of
# its difference from the others.
_NEVER = 0.01
# Least cosine of the strengths of two rules that repeat one another: an angle of less than a
# degree, too little to tell their consequents apart.
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
    """The model without some rules; the strengths of the others keep their proportions.

    ValueError where there is no such rule, or where none would be left.
    """
    numbers = np.asarray(rules)
    if numbers.size and numbers.dtype.kind not in "iu":
        raise TypeError(f"rules={rules!r} must be whole numbers: the numbers of rules.")
    numbers = np.unique(numbers)
    unknown = numbers[(numbers < 0) | (numbers >= model.n_rules)]
    if unknown.size:
        raise ValueError(
            f"rules has {unknown[0]}, but the model has {model.n_rules} rules, numbered 0 to "
            f"{model.n_rules - 1}."
        )
    if numbers.size == 0:
        return model
    if numbers.size == model.n_rules:
        raise ValueError(f"rules names all {model.n_rules} rules, but at least one must be left.")
    kept = np.setdiff1d(np.arange(model.n_rules), numbers)
    antecedent, terms = model.antecedent.without_rules(numbers)
    weights, support = model.rule_weights[kept], model.support
    if support is not None:
        # The marginal effects of the inputs change without these rules: they are dropped.
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
        posterior=None,  # it would be that of all rules
        term_names=tuple(model.term_names[t] for t in terms),
    )
