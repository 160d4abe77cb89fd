"""Conditions that are left out: what they are worth by another solution, and which they are."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.consequent import basis
from skanfis.learning.data import StandardisedData
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import conditions

from .. import oracles
from .test_candidates import tuned_on


def tuned_rules(rng, n_outputs=1):
    """Five rules on two of three inputs, trained a little, of rows with weights."""
    X, weight = rng.normal(size=(200, 3)), rng.uniform(0.5, 2.0, 200)
    y = np.sin(2.0 * X[:, [0]]) * X[:, [1]] + 0.1 * rng.normal(size=(200, n_outputs))
    rows = StandardisedData.of(X, y, weight)
    return tuned_on(rows, oracles.random_scattered(rng, Gaussian, 5, [0, 1]), turns=2)


def test_what_a_condition_is_worth_is_the_rise_of_the_cost(rng):
    """Of a target less the change, solved for anew with the same design and penalty."""
    tuned = tuned_rules(rng, n_outputs=2)
    problem, rows, evaluation = tuned.problem, tuned.problem.rows, tuned.solved
    antecedent, weight = evaluation.antecedent, rows.weights / rows.total_weight
    Z, target, _ = rows.read(slice(None))

    def design(rules):
        return np.einsum("rn,bn->nrb", rules.strengths(Z), basis(Z)).reshape(len(Z.T), -1)

    phi = design(antecedent) @ problem.local.to_global(np.eye(problem.n_columns))
    matrix = phi.T @ (weight[:, None] * phi) + evaluation.normal.penalty

    def twice_cost(y):
        slope = phi.T @ (weight[:, None] * y)
        return weight @ np.sum(y**2, axis=1) - np.vdot(slope, np.linalg.solve(matrix, slope))

    found = conditions.term_losses(tuned)
    for t, loss in enumerate(found):
        change = design(antecedent.without_terms([t])) - design(antecedent)
        left = target.T - change @ evaluation.coefficients
        assert_allclose(loss, twice_cost(left) - twice_cost(target.T), rtol=1e-6, atol=1e-12)


def test_the_condition_that_a_rule_does_not_have_goes(rng):
    """Where x0 is low, the place along x1 makes no difference."""
    X = rng.uniform(-2.0, 2.0, (500, 2))
    centers = np.array([[-1.0, 0.0], [1.0, -1.0], [1.0, 1.0]])
    theta = np.stack([centers, np.full((3, 2), -0.5)])
    theta[1, 0, 1] = 1.0
    rules = oracles.own_terms(Gaussian, [0, 1], theta)
    firing = rules.without_terms([1]).strengths(X.T)
    values = np.array([[0.0, 1.0, 0.0], [2.0, 0.0, 1.0], [-2.0, 1.0, 1.0]]) @ basis(X.T)
    y = np.sum(firing * values, axis=0) + 0.1 * rng.normal(size=500)
    rows = StandardisedData.of(X, y[:, None])
    start = rules.change_units(-rows.inputs.offset / rows.inputs.scale, 1.0 / rows.inputs.scale)
    tuned = tuned_on(rows, start)
    found = conditions.with_fewer_conditions(tuned)
    assert_array_equal(found.evaluation.antecedent.table, [[0, -1], [1, 2], [3, 4]])
    assert found.expected_error < 1.02 * tuned.expected_error


def test_every_rule_keeps_a_condition_and_the_evidence_rises(rng):
    tuned = tuned_rules(rng)
    # Of noise no condition is worth anything.
    noise = rng.normal(size=tuned.problem.rows.y.shape)
    rows = StandardisedData.of(tuned.problem.rows.X, noise)
    tuned = tuned_on(rows, tuned.problem.antecedent, tuned.penalty, turns=1)
    found = conditions.with_fewer_conditions(tuned)
    assert found.posterior.minus_twice_log < tuned.posterior.minus_twice_log
    assert_array_equal((found.evaluation.antecedent.table >= 0).sum(axis=1), 1)
    moved = Premise.of(found.problem.antecedent, *rows.inputs.box).parameters(found.displacement)
    assert_allclose(moved, found.evaluation.antecedent.parameters)


def test_half_of_them_go_at_a_time_and_all_come_back_where_the_evidence_falls(rng, monkeypatch):
    """Were none worth anything, four of nine could go: every one of five rules keeps one."""
    tuned, n_terms = tuned_rules(rng), []
    measured = conditions.term_losses

    def losses(found):
        n_terms.append(found.evaluation.antecedent.n_terms)
        return measured(found)

    monkeypatch.setattr(conditions, "term_losses", losses)
    monkeypatch.setattr(conditions, "WORTH", np.inf)
    # Rules that do not learn again are the worse for it.
    monkeypatch.setattr(conditions, "turned", lambda found: found)
    assert conditions.with_fewer_conditions(tuned) is tuned
    assert n_terms == [9, 7, 6, 5]
