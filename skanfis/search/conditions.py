r"""Conditions that scattered rules can do without, as far as the evidence tells.

Without a condition of truth mu, rule r is 1 / mu times as strong before strengths are normalised.
With q = 1 / mu - 1 the prediction changes by

    delta = q w_r (f_r - y) / (1 + q w_r) ,

and twice the cost, once the consequents are solved for anew, by

    |delta|^2 - 2 <residual, delta> - |L^-1 Phi' delta|^2 ,

L being the factor of their normal equations. Relative to the noise's variance that is what the
evidence loses, in -2 log p. Half of the conditions that lose least are left out at a time.
"""

from dataclasses import replace

import numpy as np

from ..consequent import rule_outputs
from ..learning.evidence import WORTH
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from .tuning import Tuned, turned

# 1 / mu stays finite.
_FARTHEST = 300.0


def with_fewer_conditions(tuned: Tuned, free) -> Tuned:
    """The same without conditions that are worth less than a number, and trained on.

    Every rule keeps one. It is the same as it was where the evidence says so in the end.
    """
    found = tuned
    while (terms := _needless(found)).size:
        found = _without(found, terms)
    if found is tuned:
        return tuned
    premise = Premise.of(found.problem.antecedent, *found.problem.rows.inputs.box)
    found = turned(found, premise, found.penalty, free)
    has_more = found.posterior.minus_twice_log < tuned.posterior.minus_twice_log
    return found if has_more else tuned


def _needless(tuned):
    """Terms that may go next."""
    antecedent = tuned.evaluation.antecedent
    rules, places = np.nonzero(antecedent.rule_terms >= 0)
    terms = antecedent.rule_terms[rules, places]
    rule_of = rules[np.argsort(terms)]
    loss = _losses(tuned, rule_of)
    # The last of a rule stays.
    for r in range(antecedent.n_rules):
        own = np.flatnonzero(rule_of == r)
        loss[own[np.argmax(loss[own])]] = np.inf
    needless = np.flatnonzero(loss < WORTH * tuned.problem.n_outputs)
    order = np.argsort(loss[needless], kind="stable")
    return needless[order[: (needless.size + 1) // 2]]


def _losses(tuned, rule_of):
    """What the evidence loses where each term is left out, in -2 log p, (n_terms,)."""
    problem, evaluation, rows = tuned.problem, tuned.evaluation, tuned.problem.rows
    antecedent, weight = evaluation.antecedent, rows.weights / rows.total_weight
    by_rule = evaluation.coefficients.reshape(antecedent.n_rules, problem.n_basis, -1)
    Z, target, _ = rows.read(slice(None))
    strengths, functions = antecedent.strengths(Z), problem.basis(Z)
    design = (strengths[:, None] * functions).reshape(problem.n_columns, -1)
    more = np.expm1(np.minimum(-antecedent.log_memberships(Z), _FARTHEST))
    more /= 1.0 + more * strengths[rule_of]
    root = problem.local.to_global(evaluation.normal.factor.root.T).T
    found = np.zeros(antecedent.n_terms)
    for k, y in enumerate(target):
        outputs, prediction = rule_outputs(by_rule[:, :, k], strengths, functions)
        change = more * (outputs - strengths * prediction)[rule_of]
        half = root @ (design @ (change * weight).T)
        found += (change * (change - 2.0 * (y - prediction))) @ weight - np.sum(half**2, axis=0)
    return found * tuned.posterior.n_rows / tuned.posterior.noise_variance


def _without(tuned, terms):
    """The same without some terms, the premises that are left where they stand."""
    problem, now = tuned.problem, tuned.evaluation.antecedent.without_terms(terms)
    start, inputs = problem.antecedent.without_terms(terms), problem.consequent_inputs
    problem = SeparableProblem(
        problem.rows, start, problem.order, tuned.penalty, consequent_inputs=inputs
    )
    premise = Premise.of(start, *problem.rows.inputs.box)
    evaluation = problem.evaluate(now.parameters)
    return replace(
        tuned,
        problem=problem,
        evaluation=evaluation,
        displacement=premise.displacement(now.parameters),
    )
