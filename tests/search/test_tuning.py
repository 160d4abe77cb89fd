"""Weights and premises in turns: what is taken for noise, and what is found instead."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import FREE
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, tuning


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


def test_large_models_find_nearly_the_same_in_few_turns(monkeypatch, two_rules):
    whole = tuning.tune(*two_rules, FREE, 100.0)
    monkeypatch.setattr(tuning, "MOST_COLUMNS", two_rules[0].n_columns - 1)
    few = tuning.tune(*two_rules, FREE, 100.0)
    # A tenth more; one step at a time does not arrive.
    assert_allclose(few.expected_error, whole.expected_error, rtol=0.15)
    assert few.expected_error != whole.expected_error


def test_turns_go_on_from_where_they_were_left(two_rules):
    problem, premise = two_rules
    whole = tuning.tune(problem, premise, FREE, 100.0, turns=2)
    begun = tuning.tune(problem, premise, FREE, 100.0, turns=1)
    more = tuning.tune(begun.problem, premise, FREE, 100.0, turns=1, begun=begun)
    assert whole.penalty == more.penalty
    assert_allclose(more.displacement, whole.displacement, rtol=1e-12)


@pytest.mark.parametrize(
    ("limit", "worth", "agreement_is_raised"), [(0.8, 1.2, True), (0.01, 1.2, False)]
)
def test_agreement_rises_until_rules_hold_or_the_price_is_too_high(
    limit, worth, agreement_is_raised, monkeypatch, two_rules
):
    apart = tuning.tune(*two_rules, FREE, 100.0)
    limit *= apart.problem.strongest_alone(apart.evaluation)
    monkeypatch.setattr(tuning, "_HOLDS", limit)
    monkeypatch.setattr(tuning, "_HOLDS_WELL", np.inf)
    found = tuning.with_rules_that_hold(apart, two_rules[1], FREE, 100.0, 100.0)
    assert found.agreement_is_raised is agreement_is_raised
    if not agreement_is_raised:
        assert found.problem.strongest_alone(found.evaluation) > limit
        return
    assert found.problem.strongest_alone(found.evaluation) <= limit
    assert apart.expected_error < found.expected_error <= worth * apart.expected_error
    # The other weights are those that the evidence found.
    assert found.penalty == replace(apart.penalty, agreement=found.penalty.agreement)
    # What is given is not changed.
    assert tuning.with_rules_that_hold(apart, two_rules[1], FREE[1:], 100.0, 100.0) is apart
