"""Weights and premises in turns: what is taken for noise, and what is found instead."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.data import StandardisedData
from skanfis.evidence import FREE, PRIOR_DISPLACEMENT
from skanfis.membership import Gaussian
from skanfis.objective import SeparableProblem
from skanfis.penalty import Penalty
from skanfis.premise import Premise
from skanfis.structure import Spacing, grid_antecedent, tuning


@pytest.fixture
def two_rules(rng):
    """A problem of 100 rows, and its premise."""
    x = rng.uniform(-1.0, 1.0, (100, 1))
    rows = StandardisedData.of(x, np.sin(3.0 * x) + 0.1 * rng.normal(size=(100, 1)))
    antecedent = grid_antecedent([Gaussian], [2], Spacing(rows), 0.6)
    problem = SeparableProblem(rows, antecedent, 1, tuning.FIRST_PENALTY)
    return problem, Premise.of(antecedent, *rows.inputs.box)


def test_premises_begin_as_stiff_as_their_prior_expects(monkeypatch, two_rules):
    # n kappa / sigma^2 x0^2 = 1; but where they come first, next to nothing holds them.
    monkeypatch.setattr(tuning, "GREATEST_ALONE", np.inf)
    noise = tuning.tune(*two_rules, FREE, 100.0, turns=0).posterior.noise_variance
    begun, varpro = [], tuning.varpro
    monkeypatch.setattr(
        tuning,
        "varpro",
        lambda problem, *args, **more: (
            begun.append(problem.penalty) or varpro(problem, *args, **more)
        ),
    )
    for is_loose in (False, True):
        tuning.tune(*two_rules, FREE, 100.0, turns=1, is_loose=is_loose)
    assert_allclose(begun[0].stiffness, noise / (100.0 * PRIOR_DISPLACEMENT**2))
    assert begun[1] == Penalty(agreement=1e-12, alpha=1e-12, slope=1e-12, stiffness=1e-12)


def test_premises_start_where_they_are_told_to(two_rules):
    problem, premise = two_rules
    x = np.linspace(-0.2, 0.3, premise.size)
    found = tuning.tune(problem, premise, FREE, 100.0, turns=0, displacement=x)
    assert_array_equal(found.displacement, x)
    costs = [problem.evaluate(premise.parameters(at)).cost for at in (x, 0.0 * x)]
    assert found.evaluation.cost == costs[0] != costs[1]


def test_nothing_is_computed_where_no_weight_is_to_be_found(monkeypatch, two_rules):
    # Premises that stay where they are have no stiffness.
    monkeypatch.setattr(tuning, "search_sample", None)
    antecedent, rows = two_rules[0].antecedent, two_rules[0].rows
    given = {"agreement": 0.1, "alpha": 0.01, "slope": 0.02}
    start = tuning.tuned_start(antecedent, rows, 1, np.arange(1), given, premises_move=False)
    assert start.antecedent is antecedent
    assert start.penalty == Penalty(**given, stiffness=0.0)


def test_large_models_take_few_turns_of_one_step(monkeypatch, two_rules):
    problem, premise = two_rules
    monkeypatch.setattr(tuning, "GREATEST_ALONE", np.inf)
    made = []
    for name in ("varpro", "reestimated"):
        whole = getattr(tuning, name)
        monkeypatch.setattr(
            tuning,
            name,
            lambda *args, name=name, whole=whole, **more: made.append(name) or whole(*args, **more),
        )
    monkeypatch.setattr(tuning, "_MOST_COLUMNS", problem.n_columns - 1)
    tuning.tune(problem, premise, FREE, 100.0)
    # Three before the premises move; then the premises, and the weights, twice.
    assert made == 3 * ["reestimated"] + 2 * ["varpro", "reestimated"]
    made.clear()
    monkeypatch.setattr(tuning, "_MOST_COLUMNS", problem.n_columns)
    tuning.tune(problem, premise, FREE, 100.0, turns=1)
    assert made == 5 * ["reestimated"] + ["varpro"] + 2 * ["reestimated"]


def test_a_kink_that_was_taken_for_noise_is_found_with_the_premises_first(monkeypatch, rng):
    x = rng.uniform(-1.0, 1.0, (150, 1))
    rows = StandardisedData.of(x, np.abs(x) + 1e-3 * rng.normal(size=(150, 1)))
    antecedent = grid_antecedent([Gaussian], [3], Spacing(rows), 0.6)

    def found():
        return tuning.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)

    start = found()
    # Now there is nothing but the way in that finds the weights first.
    monkeypatch.setattr(tuning, "ROWS_EACH", np.inf)
    assert start.expected_error < 0.3 * found().expected_error


def test_where_data_are_exact_nothing_holds_the_rules_together(rng):
    x = rng.uniform(-1.0, 1.0, (120, 1))
    rows = StandardisedData.of(x, np.sin(6.0 * x))
    antecedent = grid_antecedent([Gaussian], [4], Spacing(rows), 0.6)
    start = tuning.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)
    # The least that rules would pay which are to be read: n_columns sigma^2 / n over two squared.
    assert start.penalty.agreement < 0.1 * 8 * start.expected_error / 120 / 2.0**2


def test_terms_are_freed_for_a_step_and_can_be_read(rng):
    x = rng.uniform(-1.0, 1.0, (300, 1))
    rows = StandardisedData.of(x, (x > 0.2) + 0.01 * rng.normal(size=x.shape))
    antecedent = grid_antecedent([Gaussian], [2], Spacing(rows), 0.6)
    start = tuning.tuned_start(antecedent, rows, 1, np.arange(1), {}, premises_move=True)
    assert start.is_free
    assert not start.is_apart
    premise = Premise.of(antecedent, *rows.inputs.box, is_free=True)
    low, high = antecedent.with_parameters(premise.parameters(start.displacement)).groups[0].theta.T
    # They cross where the step is, and the one gives way to the other within a twentieth.
    z = rows.inputs.apply(np.array([[0.15, 0.25]]), np.empty((1, 2)))[0]
    difference = [-0.5 * ((z - c) / np.exp(w)) ** 2 for c, w in (low, high)]
    assert (np.sign(difference[0] - difference[1]) == [1.0, -1.0]).all()
    # No more than what two rows next to the step come to, which may be taken for the other side's.
    assert start.expected_error < 2.0 / 300 / np.var(x > 0.2)


def test_rules_that_compensate_are_worth_a_fifth_of_the_error(monkeypatch, rng):
    """A product, of which the rules of a grid are hyperbolic: none holds without the others."""
    X = rng.uniform(-1.0, 1.0, (300, 2))
    rows = StandardisedData.of(X, X.prod(axis=1, keepdims=True) + 1e-4 * rng.normal(size=(300, 1)))
    antecedent = grid_antecedent(2 * [Gaussian], [2, 2], Spacing(rows), 0.6)

    def found():
        return tuning.tuned_start(antecedent, rows, 1, np.arange(2), {}, premises_move=True)

    start = found()
    # Without the way in that nothing holds together.
    monkeypatch.setattr(tuning, "ROWS_EACH", np.inf)
    held = found()
    assert start.is_apart
    assert start.expected_error < held.expected_error / tuning.HOLDING


@pytest.mark.theory
def test_weights_arrive_where_there_are_more_columns_than_rows(rng):
    """Of noise on 150 inputs, nothing is learnt from 100 rows."""
    X, y = rng.normal(size=(100, 150)), rng.normal(size=(100, 1))
    rows = StandardisedData.of(X, y)
    antecedent = grid_antecedent(150 * [Gaussian], 150 * [1], Spacing(rows), 0.6)
    problem = SeparableProblem(rows, antecedent, 1, tuning.FIRST_PENALTY)
    premise = Premise.of(antecedent, *rows.inputs.box)
    found = tuning.tune(problem, premise, FREE, 100.0)
    scanned = [
        tuning.tune(
            problem.with_penalty(replace(tuning.FIRST_PENALTY, slope=slope)), premise, [], 100.0
        ).score
        for slope in np.logspace(-4, 4, 33)
    ]
    assert found.score < min(scanned) + 0.01
    assert found.posterior.n_effective < 25.0


def test_agreement_rises_until_the_strongest_rule_holds_or_the_price_is_too_high(
    monkeypatch, two_rules
):
    monkeypatch.setattr(tuning, "GREATEST_ALONE", np.inf)
    apart = tuning.tune(*two_rules, FREE, 100.0)
    alone = apart.problem.strongest_alone(apart.evaluation)
    for limit, holds in ((0.8 * alone, True), (0.01 * alone, False)):
        monkeypatch.setattr(tuning, "GREATEST_ALONE", limit / 0.9)
        found = tuning.tune(*two_rules, FREE, 100.0)
        error = found.evaluation.mean_squared_error / apart.evaluation.mean_squared_error
        assert found.is_apart is not holds
        assert (found.problem.strongest_alone(found.evaluation) <= limit) is holds
        assert error == 1.0 if not holds else 1.0 < error < tuning.HOLDING
        # The other weights are those that the evidence found.
        raised = found.penalty.agreement
        assert found.penalty == replace(apart.penalty, agreement=raised)
        assert (raised > apart.penalty.agreement) is holds
        # What is given is not changed.
        fixed = tuning.tune(*two_rules, FREE[1:], 100.0)
        assert fixed.penalty.agreement == tuning.FIRST_PENALTY.agreement


def test_agreement_that_costs_next_to_nothing_is_had(monkeypatch, two_rules):
    monkeypatch.setattr(tuning, "GREATEST_ALONE", np.inf)
    apart = tuning.tune(*two_rules, FREE, 100.0)
    alone = apart.problem.strongest_alone(apart.evaluation)
    # Half of six parameters over 30 rows, and over two.
    for wanted, n_all, price in ((0.9, 30.0, 0.1), (0.5, 2.0, 2.0)):
        monkeypatch.setattr(tuning, "_HOLDS_WELL", wanted * alone)
        monkeypatch.setattr(tuning, "_NEXT_TO_NOTHING", np.inf)
        held = tuning.held_for_nothing(apart, two_rules[1], FREE, 100.0, n_all)
        assert held.is_held
        assert held.expected_error <= (1.0 + price) * apart.expected_error
        assert held.problem.strongest_alone(held.evaluation) <= wanted * alone
    # The first step of it takes 5 % of the error: more than half of the parameters over 100 rows,
    # and however few there are, no more than 2 % is next to nothing.
    monkeypatch.setattr(tuning, "_HOLDS_WELL", 0.9 * alone)
    assert tuning.held_for_nothing(apart, two_rules[1], FREE, 100.0, 100.0) is apart
    monkeypatch.undo()
    monkeypatch.setattr(tuning, "_HOLDS_WELL", 0.9 * alone)
    assert tuning.held_for_nothing(apart, two_rules[1], FREE, 100.0, 2.0) is apart
    # Nor is anything had where agreement was given.
    assert tuning.held_for_nothing(apart, two_rules[1], FREE[1:], 100.0, 2.0) is apart


def test_agreement_that_holds_rules_does_not_fall_as_rows_rise():
    penalty = Penalty(agreement=1e-2, alpha=1e-3, slope=1e-4, stiffness=1e-5)
    for is_held, agreement in ((False, 1e-3), (True, 1e-2)):
        expected = Penalty(agreement=agreement, alpha=1e-4, slope=1e-4, stiffness=1e-6)
        free = ("agreement", "alpha", "stiffness")
        assert tuning.scaled(penalty, free, 0.1, is_held) == expected


def test_turns_go_on_from_where_they_were_left(two_rules):
    problem, premise = two_rules
    whole = tuning.tune(problem, premise, FREE, 100.0, turns=2)
    begun = tuning.tune(problem, premise, FREE, 100.0, turns=1, is_last=False)
    more = tuning.tune(begun.problem, premise, FREE, 100.0, turns=1, begun=begun)
    assert whole.penalty == more.penalty
    assert_allclose(more.displacement, whole.displacement, rtol=1e-12)


def test_turns_end_when_the_evidence_has_not_risen_twice(monkeypatch, two_rules):
    # -2 log p by turn: it rises by more than a half in the third; the last is not reached.
    told, seen = [10.0, 9.8, 5.0, 4.8, 4.9, 0.0], []

    def score(self):
        if not any(evaluation is self.evaluation for evaluation in seen):
            seen.append(self.evaluation)
        return told[[evaluation is self.evaluation for evaluation in seen].index(True)]

    monkeypatch.setattr(tuning.Tuned, "score", property(score))
    found = tuning.tune(*two_rules, FREE, 100.0)
    assert len(seen) == 5
    assert found.evaluation is seen[3]
