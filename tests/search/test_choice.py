"""The rule of choice, on errors that are planted."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import sem

from skanfis.learning.data import StandardisedData
from skanfis.search.candidates import Candidate
from skanfis.search.choice import Judged, Judges, best_of, chosen, tolerated, within


def judged(squares, cost=1, n_rules=1, of_rules=0.0, n_clusters=0):
    squares = np.asarray(squares, dtype=float)
    candidate = Candidate((n_rules,), n_clusters)
    return Judged(candidate, [], squares, squares, squares.mean(), cost, of_rules)


def alike(n_rows, group=None, certain=1.0):
    return Judges(np.ones(n_rows), np.arange(n_rows) if group is None else group, certain)


class TestPrefer:
    @pytest.mark.parametrize("in_groups", [False, True])
    def test_a_gain_counts_from_one_standard_error_on(self, rng, in_groups):
        """Of rows the textbook's; of groups of equal size that of the groups' means."""
        before, gain = rng.uniform(2.0, 3.0, 120), rng.normal(size=120)
        group = np.arange(120) % 8
        if in_groups:
            gain += rng.normal(size=8)[group]
        gain -= gain.mean()
        means = np.bincount(group, gain) / 15.0 if in_groups else gain
        judges = alike(120, group if in_groups else None)
        for factor, is_preferred in ((1.01, True), (0.99, False)):
            after = before - gain - factor * sem(means, ddof=0)
            assert judges.are_less(after, before) is is_preferred
        assert not judges.are_less(before, before)

    def test_what_is_less_than_a_hundred_thousandth_of_the_deviation_is_nothing(self):
        """However sure it is: beside an exact line, no rules are read for it."""
        judges = alike(50)
        for gain, is_preferred in ((1.01e-5, True), (0.99e-5, False)):
            assert judges.are_less(np.zeros(50), np.full(50, gain**2)) is is_preferred

    def test_rows_of_one_group_are_alike_in_whatever_fold(self):
        X, y, group = np.zeros((3, 1)), np.zeros((3, 1)), np.array([7, 3, 7])
        weight = np.arange(1.0, 4.0)
        rows = StandardisedData(X, y, weight, None, None, group)
        found = Judges.of([rows.part([0, 1]), rows.part([2])], 1.0)
        assert_array_equal(found.group, [1, 0, 1])
        assert found.mean(np.array([1.0, 0.0, 5.0])) == 16.0 / 6.0
        # One group for all says nothing.
        for one in (None, np.full(3, 7)):
            alone = Judges.of([StandardisedData(X, y, weight, None, None, one)], 1.0)
            assert_array_equal(alone.group, [0, 1, 2])


def test_the_best_costs_more_to_read_only_where_that_is_no_chance():
    # 4 before 2 before 1 before 3: by its cost, each against the best so far.
    level = np.ones(100)
    luck = 1.0 + np.where(np.arange(100) % 2, 0.5, -0.52)
    candidates = [judged(0.5 * luck, 9), judged(level, 3), judged(0.5 * level, 7), judged(luck, 4)]
    assert best_of(candidates, alike(100)) is candidates[2]
    assert best_of(candidates[1::2], alike(100)) is candidates[1]


def test_several_rules_may_have_to_beat_one_by_two_standard_errors():
    level, luck = np.full(100, 3.0), np.where(np.arange(100) % 2, 1.0, -1.0)
    one_error = sem(luck, ddof=0)
    line, rules = judged(level), judged(level - luck - 1.5 * one_error, 4, 2)
    more = judged(rules.squares - one_error, 9, 3)
    better_line = judged(rules.squares, 3)
    for certain, best in ((1.0, rules), (2.0, line)):
        judges = alike(100, certain=certain)
        assert best_of([line, rules], judges) is best
        assert best_of([line, rules, more], judges) is more
        assert best_of([line, better_line], judges) is better_line


@pytest.mark.parametrize(
    ("least", "expected"),
    [
        (0.04, 0.04 * 1.05**2),  # a clear signal: a twentieth of the error
        (0.98, 0.98 + 0.1025 * 0.02),  # a weak one: a tenth of what it explains
        (0.5, 0.5 * 1.05**2),  # as much of either
        (1.02, 1.02),  # worse than the mean: nothing
    ],
)
def test_what_is_given_up_is_part_of_the_error_or_of_what_is_explained(least, expected):
    assert_allclose(tolerated(least, 1.0, 0.05), expected, rtol=1e-12)
    assert tolerated(least, 1.0, 0.0) == least


def test_of_what_is_tolerated_the_one_read_soonest_is_chosen():
    costs, errors = (3, 9, 9, 27, 81), (0.60, 0.47, 0.44, 0.42, 0.40)
    candidates = [judged([error], cost) for cost, error in zip(costs, errors, strict=True)]
    for simplicity, expected in ((0.0, 4), (0.03, 3), (0.05, 2), (0.2, 2), (0.3, 0)):
        most = tolerated(0.40, 1.0, simplicity)
        assert most == pytest.approx(0.40 * (1.0 + simplicity) ** 2)
        assert chosen(within(candidates, candidates[0], most), 1.0) is candidates[expected]


def test_what_has_more_rules_than_the_best_is_not_simpler():
    best, simpler, more = judged([0.40], 9, 3), judged([0.41], 8, 3), judged([0.40], 4, 4)
    assert within([best, simpler, more], best, 0.42) == [best, simpler]
    assert within([best, simpler, more], best, 0.40) == [best]


def test_rules_that_hold_one_by_one_are_read_sooner_and_cuts_sooner_than_bells():
    bells, cuts = judged([0.40], 9, n_clusters=3), judged([0.41], 9, 3)
    assert chosen([bells, cuts], 1.0) is cuts
    assert chosen([judged([0.40], 8, n_clusters=3), cuts], 1.0).cost == 8
    poor, poorer = judged([0.40], 5, of_rules=1.01), judged([0.40], 7, of_rules=3.0)
    assert chosen([poor, cuts], 1.0) is cuts
    # Where none hold, it is the numerals again.
    assert chosen([poorer, poor], 1.0) is poor
