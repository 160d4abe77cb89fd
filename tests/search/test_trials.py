"""What candidates are worth: trained in part or out, their scores, and what they begin with."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.learning.data import StandardisedData
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian
from skanfis.search import search, trials, tuning
from skanfis.search.candidate import Candidate

pytestmark = pytest.mark.theory


def inputs(rng, n_rows=400, n_inputs=3):
    return rng.uniform(-1.0, 1.0, (n_rows, n_inputs))


def search_of(X, y):
    used = np.arange(X.shape[1])
    rows, families = StandardisedData.of(X, y[:, None]), [Gaussian] * used.size
    return search.StructureSearch(rows, families, 1, used, used, 0, {}, overlap=0.6).trials


def test_many_rows_are_represented_by_few(rng, monkeypatch):
    X = inputs(rng, 2500, 1)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(2500)
    seen = []
    trained = trials.SeparableProblem
    monkeypatch.setattr(
        trials,
        "SeparableProblem",
        lambda rows, *args, **kwargs: seen.append(rows.n_rows) or trained(rows, *args, **kwargs),
    )
    ANFISRegressor().fit(X, y)
    assert set(seen) == {trials._MOST_ROWS}


def test_a_grid_starts_from_where_the_terms_of_the_best_so_far_are(rng):
    X, used = inputs(rng, 200, 2), np.arange(2)
    y = np.sin(3.0 * X[:, [0]]) + np.cos(4.0 * X[:, [1]]) + 0.05 * rng.standard_normal((200, 1))
    rows = StandardisedData.of(X, y)
    found = search.StructureSearch(rows, [Gaussian] * 2, 1, used, used, 0, {}, overlap=0.6).trials
    found.beat(Candidate((3, 2)))
    child = found.rule_bases.of(Candidate((3, 3)), found.sample)
    premise = Premise.of(child, found.sample.inputs.minimum, found.sample.inputs.maximum)
    started = child.with_parameters(premise.parameters(found._inherited(child, premise)))
    before, (own,), (start,) = (
        found.tuned(Candidate((3, 2))).evaluation.antecedent,
        started.groups,
        child.groups,
    )
    assert np.abs(before.groups[0].theta[:, :3] - start.theta[:, :3]).max() > 0.05
    assert_allclose(own.theta[:, :3], before.groups[0].theta[:, :3], atol=1e-9)
    # Of the input that has one more term nothing is inherited.
    assert_allclose(own.theta[:, 3:], start.theta[:, 3:], atol=1e-9)


def test_only_candidates_that_may_still_lead_are_trained_out(rng):
    X = inputs(rng, 300, 2)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(300)
    found, alone = search_of(X, y), search_of(X, y)
    linear, best, other = (Candidate(counts) for counts in ((1, 1), (3, 1), (1, 3)))
    assert found.leading([best, other], linear) == best
    assert found.error(best) == alone.error(best)
    # What terms on the other input leave after a turn is left as it is.
    assert not found._begun
    assert found.error(other) > 1.5 * found.error(best)
    turned_once = alone.train(other, alone.sample, turns=1).score
    assert found._found[other].score == turned_once
    # So it is where there is one candidate, which is to be better than what came before.
    assert alone.leading([other], best) == other
    assert alone._found[other].score == turned_once


@pytest.mark.floors
@pytest.mark.parametrize("clustering", ["k-means", "fcm"])
def test_no_more_clusters_than_rows_are_tried(rng, clustering):
    X = inputs(rng, 12, 1)
    found = search_of(X, X[:, 0] + 0.1 * rng.standard_normal(12))
    few, many, linear = (
        Candidate(None, 2, clustering),
        Candidate(None, 13, clustering),
        Candidate((1,)),
    )
    assert set(found.promising([many, few, linear])) == {few, linear}
    assert found.score(many) == np.inf
    assert np.isfinite(found.score(linear))


@pytest.mark.floors
def test_without_terms_there_is_nothing_to_train_out(rng, monkeypatch):
    X = inputs(rng, 50, 2)
    found, linear = search_of(X, X[:, 0] + 0.1 * rng.standard_normal(50)), Candidate((1, 1))
    # So are scattered rules whose terms could not be told apart.
    train, trained = found.train, []
    monkeypatch.setattr(
        found,
        "train",
        lambda *args, **kwargs: trained.append(train(*args, **kwargs)) or trained[-1],
    )
    found.leading([linear], linear)
    assert [found.tuned(linear)] == trained


def test_what_parameters_cost_falls_as_the_rows_rise(rng):
    # A plane through 8,000 rows of noise alone: the mean square on new rows is the noise's times
    # 1 + k / n, and k is 3 for all but the pull on the slopes.
    X = inputs(rng, 8000, 2)
    y = X @ [3.0, 2.0] + rng.standard_normal(8000)
    found, linear = search_of(X, y), Candidate((1, 1))
    tuned, n = found.tuned(linear), found.n_sample
    assert n < 2200.0
    assert_allclose(tuned.posterior.n_effective, 3.0, atol=0.05)
    noise = tuned.evaluation.mean_squared_error / (1.0 - 3.0 / n)
    assert_allclose(tuned.expected_error, noise * (1.0 + 3.0 / n), rtol=1e-3)
    on_all = tuned.expected_error * (1.0 + 3.0 / 8000.0) / (1.0 + 3.0 / n)
    assert_allclose(found.error(linear) ** 2, on_all, rtol=1e-4)


@pytest.mark.floors
def test_next_to_exact_data_all_candidates_are_trained_out(rng):
    X = inputs(rng, 300, 2)
    y = X[:, 1] + 0.03 * np.sin(3.0 * X[:, 0])
    found, alone = search_of(X, y), search_of(X, y)
    best, other = Candidate((3, 1)), Candidate((1, 3))
    assert found.leading([best, other], Candidate((1, 1))) == best
    assert found.error(other) > 1.5 * found.error(best)
    assert found.error(other) == alone.error(other)


def test_score_counts_rows_by_weight_and_all_outputs(rng):
    # n m log of the error, from which what a larger model must gain is taken; more where a rule
    # does not hold alone.
    X = inputs(rng, 120, 1)
    y = np.column_stack([np.sin(3.0 * X[:, 0]), X[:, 0]]) + 0.1 * rng.standard_normal((120, 2))
    times = rng.integers(1, 4, 120)
    rows, used = StandardisedData.of(X, y, times.astype(float)), np.arange(1)
    whole = search.StructureSearch(rows, [Gaussian], 1, used, used, 0, {}, overlap=0.6)
    whole.choose("grid")
    found = whole.trials
    assert len(found.scores) > 1
    for candidate, score in found.scores.items():
        worth = tuning.HOLDING if found._found[candidate].is_apart else 1.0
        expected = times.sum() * 2 * np.log(worth * found.error(candidate) ** 2)
        assert_allclose(score, expected, rtol=1e-12)
    assert {tuned.is_apart for tuned in found._found.values()} == {True, False}


def test_training_goes_on_from_what_told_the_promise(rng, monkeypatch):
    X = inputs(rng, 120, 1)
    found, candidate = search_of(X, np.sin(3.0 * X[:, 0])), Candidate((3,))
    steps, tune = [], trials.tune

    def noting(problem, premise, free, n_rows, turns, first_steps, *args, **more):
        steps.append((turns, first_steps, problem.penalty))
        return tune(problem, premise, free, n_rows, turns, first_steps, *args, **more)

    monkeypatch.setattr(trials, "tune", noting)
    assert found.promising([candidate]) == [candidate]
    found.leading([candidate], candidate)
    (_, before, start), (turns, after, at), *_ = steps
    assert (before, turns, before + after) == (2, 1, tuning.FIRST_STEPS)
    assert start == tuning.FIRST_PENALTY != at


def test_a_loose_training_that_leaves_the_noise_ends_with_its_first_turn(rng, monkeypatch):
    X = inputs(rng, 200, 1)
    found = search_of(X, X[:, 0] ** 2 + 0.3 * rng.standard_normal(200))
    best = Candidate((2,))
    found.tuned(best)
    train, turns = found.train, []
    monkeypatch.setattr(
        found, "train", lambda *args, **more: turns.append(args[2:]) or train(*args, **more)
    )
    assert found.loosely(best) is None
    assert turns == [(1,)]
    # What one does find, where data are exact, is trained out and scored.
    x = 0.25 * rng.normal(size=(93, 1)) + rng.choice([-1.0, 0.0, 1.2], (93, 1))
    exact = search_of(x, np.exp(-2.0 * (x[:, 0] - 0.3) ** 2))
    loose = exact.loosely(Candidate((5,)))
    assert loose == Candidate((5,), is_loose=True)
    assert exact.scores[loose] < exact.score(Candidate((5,)))
