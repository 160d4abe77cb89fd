r"""Conditions that scattered rules can do without, by the evidence.

Without a condition of membership mu, rule r is 1 / mu times as strong before strengths w_r are
normalised. With q = 1 / mu - 1, output f_r and prediction y, the prediction changes by
delta = q w_r (f_r - y) / (1 + q w_r). The condition is worth the evidence that this change loses.
"""

import numpy as np

from ..consequent import basis, rule_outputs
from ..learning.evidence import WORTH
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from .tuning import Tuned, turned

# Largest -log mu, so that 1 / mu stays finite.
_FARTHEST = 300.0


def with_fewer_conditions(tuned: Tuned) -> Tuned:
    """The same without conditions that are worth less than a number to read, and trained on.

    Only half of them go at a time: those that are left are worth more then. Every rule keeps one.
    If the evidence is lower in the end, all conditions stay.
    """
    rows, inputs, found = tuned.problem.rows, tuned.problem.consequent_inputs, tuned
    # Always that of the model with all conditions.
    scale = tuned.posterior.scale
    while True:
        loss = scale * term_losses(found)
        for own in (row[row >= 0] for row in found.evaluation.antecedent.rule_terms):
            loss[own[np.argmax(loss[own])]] = np.inf
        n_needless = np.count_nonzero(loss < WORTH * tuned.problem.n_outputs)
        if n_needless == 0:
            break
        terms = np.argsort(loss, kind="stable")[: (n_needless + 1) // 2]
        start = found.problem.antecedent.without_terms(terms)
        now = found.evaluation.antecedent.without_terms(terms)
        problem = SeparableProblem(rows, start, tuned.penalty, consequent_inputs=inputs)
        premise = Premise.of(start, *rows.inputs.box)
        found = Tuned.start(problem, premise, tuned.free, premise.displacement(now.parameters))
    if found is tuned:
        return tuned
    found = turned(found)
    return min(tuned, found, key=lambda one: one.posterior.minus_twice_log)


def term_losses(tuned):
    """By how much 2F (``evidence``) rises if a term is left out, for each term, (n_terms,)."""
    problem, solved, rows = tuned.problem, tuned.solved, tuned.problem.rows
    antecedent, weight = solved.antecedent, rows.weights / rows.total_weight
    has_term = antecedent.rule_terms >= 0
    rule_of = np.nonzero(has_term)[0][np.argsort(antecedent.rule_terms[has_term])]
    Z, target, _ = rows.read(slice(None))
    strengths, functions = antecedent.strengths(Z), basis(Z[problem.consequent_inputs])
    more = np.expm1(np.minimum(-antecedent.log_memberships(Z), _FARTHEST))
    more /= 1.0 + more * strengths[rule_of]
    design = (strengths[:, None] * functions).reshape(problem.n_columns, -1)
    root = problem.local.to_global(solved.normal.factor.root.T).T
    by_rule = solved.coefficients.reshape(len(strengths), problem.n_basis, -1)
    found = np.zeros(antecedent.n_terms)
    for k, y in enumerate(target):
        outputs, prediction = rule_outputs(by_rule[:, :, k], strengths, functions)
        change = more * (outputs - strengths * prediction)[rule_of]
        half = root @ (design @ (change * weight).T)
        found += (change * (change - 2.0 * (y - prediction))) @ weight - np.sum(half**2, axis=0)
    return found
