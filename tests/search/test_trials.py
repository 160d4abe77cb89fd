"""Short trainings: what they leave of rows that were not trained on, and which come next."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.learning.data import StandardisedData
from skanfis.membership import Gaussian
from skanfis.search import trials as trials_module
from skanfis.search import tuning
from skanfis.search.candidates import Candidate, TermScores, rule_base
from skanfis.search.judging import dealt_rows
from skanfis.search.sample import unit_scale
from skanfis.search.splits import Split
from skanfis.search.trials import _ROWS_PER_PARAMETER, FEWEST_SEEN, Trials
from skanfis.training.settings import structure_request

from .. import oracles

pytestmark = pytest.mark.theory


def plan_of(n_inputs, n_all, weights=(), order=1, max_rules=None):
    names = [f"x{j}" for j in range(n_inputs)]
    request = structure_request(ANFISRegressor(order=order, max_rules=max_rules), names)
    return replace(request, weights=dict(weights), n_all=n_all)


def trials_of(X, y, **settings):
    rows = dealt_rows(StandardisedData.of(X, y.reshape(len(X), -1)))
    return Trials(rows, plan_of(X.shape[1], float(len(X)), **settings))


def surface(rng, n_rows=300, n_inputs=3):
    X = rng.uniform(-1.0, 1.0, (n_rows, n_inputs))
    return X, np.sin(3.0 * X[:, 0]) + X[:, 0] * X[:, 1] + 0.1 * rng.normal(size=n_rows)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("kind", ["grid", "tree", "scattered"])
def test_squared_errors_of_rules_are_those_of_the_dense_design(rng, kind, order):
    X, y = surface(rng, 200)
    y = np.column_stack([y, X[:, 2] - y**2])
    rows = dealt_rows(StandardisedData.of(X, y, rng.integers(1, 4, 200).astype(float)))
    is_left = (np.arange(200) % 4 == 0) | (rows.X[:, 0] > 1.5)
    fold, rest = rows.part(~is_left), rows.part(is_left)
    rest = replace(rest, X=np.where(rest.X > 1.5, 10.0 * rest.X, rest.X))
    trials = Trials(fold, plan_of(3, 200.0, order=order))
    tuned = trials.tuned(trials.larger(kind, trials.larger(kind, trials.one_rule)))
    # Premises have moved, and the last weights are those of the consequents.
    assert np.abs(tuned.displacement).max() > 0.05
    antecedent, penalty = tuned.evaluation.antecedent, tuned.penalty
    within = replace(fold, inputs=unit_scale(fold.X), targets=unit_scale(fold.y))
    start = tuned.problem.antecedent
    dense = oracles.DenseProblem(within, start, order, penalty)
    coefficients = dense.coefficients(antecedent.parameters)
    # As predict answers: beyond the range along the tangent, and not far from the target's.
    nearest = np.clip(rest.X, fold.X.min(axis=0), fold.X.max(axis=0))
    # As far as the output with the most noise supports it.
    fitted = oracles.dense_design(antecedent, antecedent.parameters, fold.X.T, order) @ coefficients
    squares = np.average((fitted - fold.y) ** 2, axis=0, weights=fold.weights)
    most = tuned.posterior.noise_variance * squares.max() / squares.mean()
    limit = float(f"{1.0 / np.sqrt(most):.3g}")
    way = np.clip(rest.X - nearest, -limit, limit)

    def answer(t):
        at = (nearest + t * way).T
        return oracles.dense_design(antecedent, antecedent.parameters, at, order) @ coefficients

    answers = answer(0.0) + oracles.complex_step(lambda t: answer(t[0]), np.zeros(1))[..., 0]
    margin = limit / 20.0 * np.ptp(fold.y, axis=0)
    answers = np.clip(answers, fold.y.min(axis=0) - margin, fold.y.max(axis=0) + margin)
    expected = ((answers - rest.y) ** 2).sum(axis=1)
    assert_allclose(trials.squared_errors(tuned, rest, None), expected, rtol=1e-4, atol=1e-6)
    assert (way == limit).any()


class TestSequences:
    def test_scattered_rules_look_at_inputs_that_smaller_ones_ask_for(self, rng):
        X, y = surface(rng, 400, 4)
        trials = trials_of(X, y + X[:, 1] ** 2 + X[:, 3])
        two = trials.larger("scattered", trials.one_rule)
        assert two == Candidate((1, 1, 1, 1), 2, (0, 1))
        groups = trials.tuned(two).problem.antecedent.groups
        assert {int(j) for group in groups for j in group.inputs} == {0, 1}
        assert trials.larger("scattered", two).inputs == (0, 1)

    def test_no_input_asks_for_what_terms_on_others_say(self, rng):
        """Half of them only go with the others, and ask as loudly of the line's residual."""
        asked = []
        for _ in range(5):
            X = rng.normal(size=(500, 6)) + rng.normal(size=(500, 1))
            trials = trials_of(X, np.tanh(X[:, :3].sum(axis=1)) + 0.1 * rng.normal(size=500))
            asked.append(trials.larger("scattered", trials.one_rule).inputs)
            pairs = [(j, 3) for j in range(6)]
            line = trials.tuned(trials.one_rule)
            scores = TermScores(line, trials.spacing, np.arange(6)).of(pairs)
            assert scores.min() > 10.0
        # Noise alone asks by two deviations in one of twenty.
        assert sum(map(len, asked)) <= 5 * 3 + 2
        assert all(set(one) >= {0, 1, 2} for one in asked)

    def test_rules_are_added_where_those_that_have_learnt_leave_most(self, rng):
        """One rule more: its cluster is all rows, by their squared residuals."""
        X, y = surface(rng, 400, 3)
        trials = trials_of(X, y + X[:, 1] ** 2)
        two = trials.tuned(trials.larger("scattered", trials.one_rule))
        learnt = two.evaluation.antecedent
        three = Candidate((1, 1, 1), 3, (0, 1, 2))
        found = rule_base(three, None, [Gaussian] * 3, trials.spacing, 0, two)
        centers, log_widths = found.groups[0].theta.reshape(2, 3, 3)
        Z, square = two.problem.rows.X, two.residual[:, 0] ** 2
        expected = square @ Z / square.sum()
        spread = np.sqrt(square @ (Z - expected) ** 2 / square.sum())
        assert_allclose(centers[2], expected)
        assert_allclose(np.exp(log_widths[2]), np.sqrt(3.0) * spread)
        # The others keep their terms, and get one where they fire on the input that they lack.
        kept = found.groups[0].theta.reshape(2, 3, 3)[:, :2, :2]
        assert_array_equal(kept.reshape(2, -1), learnt.groups[0].theta)
        strengths = learnt.strengths(Z.T)
        assert_allclose(centers[:2, 2], strengths @ Z[:, 2] / strengths.sum(axis=1))

    def test_a_weak_input_is_asked_for_once_the_strong_one_is_told(self, rng):
        X = rng.uniform(-1.0, 1.0, (600, 4))
        y = 30.0 * np.abs(X[:, 0]) + np.sin(3.0 * X[:, 2]) + 0.1 * rng.normal(size=600)
        trials, found = trials_of(X, y), []
        one = trials.one_rule
        for _ in range(4):
            one = trials.larger("scattered", one)
            found.append(one.inputs)
        assert found[0] == (0,)
        assert found[-1] == (0, 2)

    def test_of_a_tree_of_eight_leaves_two_are_split_at_once(self, rng):
        X, y = surface(rng, 600, 2)
        trials = trials_of(X, y)
        sizes, one = [], trials.one_rule
        while one.n_rules < 10:
            smaller, one = one, trials.larger("tree", one)
            sizes.append(one.n_rules)
        assert sizes == [2, 3, 4, 5, 6, 7, 8, 10]
        assert one.splits[:7] == smaller.splits
        later, earlier = one.splits[7:]
        assert later.leaf > earlier.leaf
        # Two leaves share what each of the two split ones had; the others are as they were.
        tuned = trials.tuned(smaller)
        known = tuned.evaluation.antecedent
        Z = tuned.problem.rows.X.T
        tree = rule_base(one, None, [Gaussian] * 2, trials.spacing, 0, tuned)
        parent = np.repeat(np.arange(8), np.isin(np.arange(8), [later.leaf, earlier.leaf]) + 1)
        found = np.zeros((8, Z.shape[1]))
        np.add.at(found, parent, tree.strengths(Z))
        assert_allclose(found, known.strengths(Z), atol=1e-12)

    def test_more_rows_never_mean_fewer_rules(self, rng):
        """Up to 464 parameters, as the pages say, or as many as rows."""
        X, y = surface(rng, 6000, 2)
        for n_rows, most in ((400, 400), (1000, 464), (6000, 464)):
            trials, sizes = trials_of(X[:n_rows], y[:n_rows]), {}
            for n_leaves in range(2, 120):
                tree = trials.one_rule.with_more_splits([Split(0, 0, 0.0, 0.0)] * (n_leaves - 1))
                sizes[trials.n_parameters(tree)] = trials._is_small(tree)
            assert all(is_small == (size <= most) for size, is_small in sizes.items())
            assert max(sizes) > most

    @pytest.mark.parametrize("kind", ["grid", "tree", "scattered"])
    @pytest.mark.parametrize("most", [None, 4])
    def test_they_end_where_rows_or_the_bound_on_rules_do(self, rng, kind, most):
        X, y = surface(rng, 40, 2)
        trials = trials_of(X, y, max_rules=most)
        sizes, one = [], trials.one_rule
        while one is not None:
            sizes.append(one.n_rules)
            assert trials.n_parameters(one) <= 40
            one = trials.larger(kind, one)
        assert 3 <= max(sizes) <= (most or 40)
        assert sizes == sorted(sizes)

    def test_no_more_terms_than_values(self, rng):
        X = np.column_stack([rng.integers(0, 2, 200), rng.integers(0, 3, 200)])
        y = 2.0 * X[:, 0] * X[:, 1] ** 2 + 0.05 * rng.normal(size=200)
        one = trials_of(X, y, order=0)
        found = one.one_rule
        while (larger := one.larger("grid", found)) is not None:
            found = larger
        assert max(found.counts) <= 3
        assert found.counts[0] <= 2


def test_a_candidate_sees_as_many_rows_as_its_parameters_need(rng):
    X, y = surface(rng, 9000, 2)
    trials = trials_of(X, y)
    few = FEWEST_SEEN
    for n_clusters, n_rows in ((0, few), (3, few), (12, 4000), (20, 8000), (90, 9000)):
        candidate = Candidate((1, 1), n_clusters, (0, 1) if n_clusters else ())
        assert trials.n_parameters(candidate) == max(n_clusters, 1) * 3 + 4 * n_clusters
        rows = trials.rows_for(candidate)
        assert rows.n_rows == n_rows
        assert n_rows == 9000 or n_rows >= _ROWS_PER_PARAMETER * trials.n_parameters(candidate)
        assert_array_equal(rows.X, trials.rows.X[:n_rows])
        assert_array_equal(rows.inputs.box, [rows.X.min(axis=0), rows.X.max(axis=0)])


@pytest.mark.parametrize(("noise", "n_tried"), [(0.0, 3), (0.3, 1)])
def test_terms_without_bounds_are_tried_in_larger_grids_only_if_they_pay(
    rng, monkeypatch, noise, n_tried
):
    x = rng.uniform(-1.0, 1.0, (300, 1))
    tried = []

    def with_free_terms(tuned):
        tried.append(tuned.problem.antecedent.n_rules)
        return tuning.with_free_terms(tuned)

    monkeypatch.setattr(trials_module, "with_free_terms", with_free_terms)
    trials = trials_of(x, np.sin(4.0 * x[:, 0]) + noise * rng.normal(size=300))
    candidate = trials.one_rule
    for _ in range(3):
        candidate = trials.larger("grid", candidate)
    trials.tuned(candidate)
    assert tried == [2, 3, 4][:n_tried]
    assert trials.tuned(candidate).premise.is_unbounded == (n_tried == 3)
