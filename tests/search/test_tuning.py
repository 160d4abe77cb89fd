"""Weights and premises in turns: what is taken for noise, and what is found instead."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import FREE
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import tuning
from skanfis.search.grid import Spacing, grid_antecedent


def two_rules_of_a_sine(rng, noise):
    """Their problem, and its premise."""
    x = rng.uniform(-1.0, 1.0, (100, 1))
    rows = StandardisedData.of(x, np.sin(3.0 * x) + noise * rng.normal(size=(100, 1)))
    antecedent = grid_antecedent([Gaussian], [2], Spacing(rows))
    problem = SeparableProblem(rows, antecedent, tuning.FIRST_PENALTY)
    return problem, Premise.of(antecedent, *rows.inputs.box)


@pytest.fixture
def two_rules(rng):
    return two_rules_of_a_sine(rng, 0.1)


def test_large_models_find_nearly_the_same_in_few_turns(monkeypatch, two_rules):
    whole = tuning.tune(*two_rules, FREE)
    monkeypatch.setattr(tuning, "MANY_COLUMNS", two_rules[0].n_columns - 1)
    few = tuning.tune(*two_rules, FREE)
    # A tenth more; one step at a time does not arrive.
    assert_allclose(few.expected_error, whole.expected_error, rtol=0.15)
    assert few.expected_error != whole.expected_error


def test_what_rules_err_one_by_one(two_rules):
    """The mean over rows of sum_r w_r (y - f_r)^2, by its definition."""
    tuned = tuning.tune(*two_rules, FREE, turns=1)
    rows, evaluation = tuned.problem.rows, tuned.solved
    Z, target, _ = rows.read(slice(None))
    basis = np.vstack([np.ones_like(Z[:1]), Z])
    said = evaluation.coefficients[:, 0].reshape(2, 2) @ basis
    strengths = evaluation.antecedent.strengths(Z)
    expected = np.mean(np.sum(strengths * (target - said) ** 2, axis=0))
    assert_allclose(evaluation.mean_squared_error + tuned.disagreement, expected, rtol=1e-8)


@pytest.mark.parametrize("turns", [tuning.MOST_TURNS, 0])
def test_with_more_rows_rules_are_tuned_on_to_what_these_ask_for(turns, rng):
    x = rng.uniform(-1.0, 1.0, (2000, 1))
    rows = StandardisedData.of(x, np.sin(3.0 * x) + 0.3 * rng.normal(size=x.shape))
    antecedent = grid_antecedent([Gaussian], [3], Spacing(rows))
    premise = Premise.of(antecedent, *rows.inputs.box)

    def tuned(rows):
        problem = SeparableProblem(rows, antecedent, tuning.FIRST_PENALTY)
        return tuning.tune(problem, premise, FREE, turns)

    whole, few = tuned(rows), tuned(rows.part(slice(100)))
    assert tuning.tuned_on(whole, rows) is whole
    penalty = tuning.scaled(few.penalty, FREE, 100 / 2000)
    as_they_are = tuning.Tuned.start(
        whole.problem.with_penalty(penalty), premise, FREE, few.displacement
    )
    on = tuning.tuned_on(few, rows)
    assert (on.displacement == 0.0).all() == (turns == 0)
    least = whole.posterior.minus_twice_log
    left, before = (one.posterior.minus_twice_log - least for one in (on, as_they_are))
    assert left < 0.1 * before


def with_agreement(tuned, agreement):
    """The same with consequents alone of another agreement."""
    return tuned.with_penalty(replace(tuned.penalty, agreement=agreement))


class TestAgreement:
    @pytest.mark.parametrize("left", [1.05, 1.2, 2.0])
    def test_it_is_raised_as_far_as_the_error_allows(self, left, rng):
        apart = tuning.tune(*two_rules_of_a_sine(rng, 0.3), FREE)
        found = tuning.with_most_agreement(apart, left)
        assert found is not apart
        assert apart.expected_error < found.expected_error <= left * apart.expected_error
        # As far as consequents alone allow, or further.
        agreement = found.penalty.agreement
        assert agreement >= tuning._most_agreement(apart, left * apart.expected_error)
        # The other weights are those that the evidence found.
        assert found.penalty == replace(apart.penalty, agreement=agreement)
        # What is given or leaves nothing is not changed.
        given = replace(apart, free=FREE[1:])
        assert tuning.with_most_agreement(given, left) is given
        assert tuning.with_most_agreement(apart, 1.0) is apart

    def test_consequents_alone_are_followed_to_the_limit(self, two_rules):
        apart = tuning.tune(*two_rules, FREE)
        most = 1.1 * apart.expected_error
        agreement = tuning._most_agreement(apart, most)
        assert apart.penalty.agreement < agreement < 1.0
        assert with_agreement(apart, agreement).expected_error <= most
        assert with_agreement(apart, 1.1 * agreement).expected_error > most
        assert_allclose(tuning._most_agreement(apart, np.inf), 1.0, rtol=0.05)


@pytest.mark.theory
def test_premises_may_take_more_than_half_of_the_rows():
    # Few rows, and terms of many parameters.
    x = np.linspace(-1.0, 1.0, 20)
    model = ANFISRegressor(mf="sigmoid_product", order=0, partition="grid")
    model.fit(x[:, None], np.abs(x))
    assert np.abs(model.predict(x[:, None]) - np.abs(x)).max() < 0.02
