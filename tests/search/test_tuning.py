"""Weights and premises in turns: what is taken for noise, and what is found instead."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import FREE, PRIOR_DISPLACEMENT
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import Spacing, grid_antecedent, tuning


def test_premises_begin_as_stiff_as_their_prior_expects(monkeypatch, two_rules):
    # n kappa / sigma^2 x0^2 = 1; but where they come first, next to nothing holds them.
    noise = tuning.tune(*two_rules, FREE, 100.0, turns=0).posterior.noise_variance
    begun, varpro = [], tuning.varpro
    monkeypatch.setattr(
        tuning,
        "varpro",
        lambda problem, *args, **more: (
            begun.append(problem.penalty) or varpro(problem, *args, **more)
        ),
    )
    tuning.tune(*two_rules, FREE, 100.0, turns=1)
    tuning.tune_unbounded(*two_rules, FREE, 100.0)
    assert_allclose(begun[0].stiffness, noise / (100.0 * PRIOR_DISPLACEMENT**2))
    assert begun[1] == Penalty(agreement=1e-12, alpha=1e-12, slope=1e-12, stiffness=1e-12)


def test_large_models_take_few_turns_of_one_step(monkeypatch, two_rules):
    problem, premise = two_rules
    made = []
    for name in ("varpro", "reestimated"):
        whole = getattr(tuning, name)
        monkeypatch.setattr(
            tuning,
            name,
            lambda *args, name=name, whole=whole, **more: made.append(name) or whole(*args, **more),
        )
    monkeypatch.setattr(tuning, "MOST_COLUMNS", problem.n_columns - 1)
    tuning.tune(problem, premise, FREE, 100.0)
    # Three before the premises move; then the premises, and the weights, twice.
    assert made == 3 * ["reestimated"] + 2 * ["varpro", "reestimated"]
    made.clear()
    monkeypatch.setattr(tuning, "MOST_COLUMNS", problem.n_columns)
    tuning.tune(problem, premise, FREE, 100.0, turns=1)
    assert made == 5 * ["reestimated"] + ["varpro"] + 2 * ["reestimated"]


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


def test_agreement_that_holds_rules_does_not_fall_as_rows_rise():
    penalty = Penalty(agreement=1e-2, alpha=1e-3, slope=1e-4, stiffness=1e-5)
    for is_held, agreement in ((False, 1e-3), (True, 1e-2)):
        expected = Penalty(agreement=agreement, alpha=1e-4, slope=1e-4, stiffness=1e-6)
        free = ("agreement", "alpha", "stiffness")
        assert tuning.scaled(penalty, free, 0.1, is_held) == expected


def test_turns_go_on_from_where_they_were_left(two_rules):
    problem, premise = two_rules
    whole = tuning.tune(problem, premise, FREE, 100.0, turns=2)
    begun = tuning.tune(problem, premise, FREE, 100.0, turns=1)
    more = tuning.tune(begun.problem, premise, FREE, 100.0, turns=1, begun=begun)
    assert whole.penalty == more.penalty
    assert_allclose(more.displacement, whole.displacement, rtol=1e-12)


def test_turns_end_when_the_evidence_rises_no_further(monkeypatch, two_rules):
    # -2 log p by turn, that of the second asked for first: in the fourth it rises by less than a
    # half; the last is not reached.
    told, seen = [9.0, 10.0, 5.0, 4.8, 0.0], []

    def score(self):
        if not any(evaluation is self.evaluation for evaluation in seen):
            seen.append(self.evaluation)
        return told[[evaluation is self.evaluation for evaluation in seen].index(True)]

    monkeypatch.setattr(tuning.Tuned, "score", property(score))
    found = tuning.tune(*two_rules, FREE, 100.0)
    assert len(seen) == 4
    assert found.evaluation is seen[3]


@pytest.mark.parametrize(("limit", "worth", "is_held"), [(0.8, 1.2, True), (0.01, 1.2, False)])
def test_agreement_rises_until_rules_hold_or_the_price_is_too_high(
    limit, worth, is_held, monkeypatch, two_rules
):
    apart = tuning.tune(*two_rules, FREE, 100.0)
    limit *= apart.problem.strongest_alone(apart.evaluation)
    monkeypatch.setattr(tuning, "_HOLDS", limit)
    monkeypatch.setattr(tuning, "_HOLDS_WELL", np.inf)
    found = tuning.with_rules_that_hold(apart, two_rules[1], FREE, 100.0)
    assert found.is_held is is_held
    if not is_held:
        assert found.problem.strongest_alone(found.evaluation) > limit
        return
    assert found.problem.strongest_alone(found.evaluation) <= limit
    assert apart.expected_error < found.expected_error <= worth * apart.expected_error
    # The other weights are those that the evidence found.
    assert found.penalty == replace(apart.penalty, agreement=found.penalty.agreement)
    # What is given is not changed.
    assert tuning.with_rules_that_hold(apart, two_rules[1], FREE[1:], 100.0) is apart
