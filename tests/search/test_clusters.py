"""Rules from clusters: blobs that are known, rows that stand for many, labels that mean noise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.antecedent import RuleTableAntecedent
from skanfis.learning import VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian
from skanfis.search import SampleSize, clustered_antecedent, representative_rows
from skanfis.search.clusters import _HIGHEST_CROSSING, _closest, _distance
from skanfis.search.sample import effective_weight, search_sample

from .. import oracles


def blobs(rng, n_per_blob=80, n_inputs=2):
    """Three blobs far apart in both inputs and target, their labels, and weights."""
    centers = 3.0 * np.array([[0, 0, 0], [3, 1, 2], [-2, 4, -3]], dtype=float)[:, : n_inputs + 1]
    labels = rng.permutation(np.repeat(np.arange(3), n_per_blob))
    table = centers[labels] + rng.normal(size=(labels.size, n_inputs + 1))
    return table[:, :-1], table[:, -1:], labels, rng.uniform(0.5, 2.0, labels.size)


def by_k_means(table, weight):
    return KMeans(3, n_init=3, random_state=0).fit(table, sample_weight=weight).labels_


def rules_of(family, rows, label):
    """All inputs in the premises, all of one family."""
    n_inputs = rows.X.shape[1]
    return clustered_antecedent(
        [family] * n_inputs, rows, label, np.arange(n_inputs), share_terms=True
    )


def rule_parameters(antecedent, n_inputs):
    """Theta as (n_parameters, n_rules, n_inputs), rules in the order of their first centre."""
    theta = np.hstack([group.theta for group in antecedent.groups])
    inputs = np.concatenate([group.inputs for group in antecedent.groups])
    terms = antecedent.rule_terms
    terms = np.take_along_axis(terms, np.argsort(inputs[terms], axis=1), axis=1)
    theta = theta[:, terms]
    assert theta.shape[2] == n_inputs
    return theta[:, np.argsort(theta[0, :, 0])]


def highest_crossings(antecedent):
    """Of every two terms that are neighbours on an input, where they cross, by brute force."""
    z = np.linspace(-10.0, 10.0, 20_001)
    found = []
    for group in antecedent.groups:
        for j in np.unique(group.inputs):
            theta = group.theta[:, group.inputs == j]
            theta = theta[:, np.argsort(theta[0])]
            mu = group.family.value(z[None], theta)
            found += list(np.minimum(mu[1:], mu[:-1]).max(axis=1))
    return np.array(found)


class TestRules:
    def test_families_may_differ_from_input_to_input(self, rng):
        X, y, *_ = blobs(rng)
        rows = StandardisedData.of(X, y)
        mixed = clustered_antecedent(
            [Gaussian, Bell], rows, by_k_means, np.arange(2), share_terms=True
        )
        by_input = [group.theta for group in mixed.groups]
        for j, family in enumerate([Gaussian, Bell]):
            alone = rules_of(family, rows, by_k_means)
            assert_allclose(by_input[j], alone.groups[j].theta)
            assert_array_equal(alone.rule_terms, mixed.rule_terms)

    def test_clusters_are_sought_in_the_premise_inputs_alone(self, rng):
        X, y, *_ = blobs(rng)
        noise = 100.0 * rng.normal(size=(len(X), 1))
        rows = StandardisedData.of(np.hstack([noise, X]), y)
        found = clustered_antecedent(
            [Gaussian] * 3, rows, by_k_means, np.array([1, 2]), share_terms=True
        )
        expected = rules_of(Gaussian, StandardisedData.of(X, y), by_k_means)
        assert {int(j) for group in found.groups for j in group.inputs} == {1, 2}
        for one, other in zip(rule_parameters(found, 2), rule_parameters(expected, 2), strict=True):
            assert_allclose(one, other)

    @pytest.mark.parametrize("weighted", [False, True])
    @pytest.mark.parametrize("n_inputs", [1, 2])
    def test_centers_and_widths_are_weighted_moments_of_the_clusters(self, rng, weighted, n_inputs):
        X, y, labels, weight = blobs(rng, n_inputs=n_inputs)
        rows = StandardisedData.of(X, y, weight if weighted else None)
        theta = rule_parameters(rules_of(Gaussian, rows, by_k_means), n_inputs)
        z = (X - rows.inputs.offset) / rows.inputs.scale
        expected = []
        for blob in range(3):
            members = z[labels == blob]
            w = weight[labels == blob] if weighted else None
            mean = np.average(members, axis=0, weights=w)
            deviation = np.sqrt(np.average((members - mean) ** 2, axis=0, weights=w))
            assert (deviation > 0.1).all()  # wider than the least width
            expected.append([mean, deviation * np.sqrt(n_inputs)])
        expected = np.array(sorted(expected, key=lambda rule: rule[0][0])).transpose(1, 0, 2)
        assert_allclose(theta[0], expected[0], rtol=1e-10, atol=1e-12)
        assert_allclose(np.exp(theta[1]), expected[1], rtol=1e-10)

    # "At least" and "at most" hold beyond the blob too.
    @pytest.mark.parametrize("name", sorted(set(MEMBERSHIPS) - {"s_shaped", "z_shaped"}))
    def test_each_rule_rules_its_own_blob(self, rng, name):
        X, y, labels, _ = blobs(rng)
        rows = StandardisedData.of(X, y)
        antecedent = rules_of(MEMBERSHIPS[name], rows, by_k_means)
        assert isinstance(antecedent, RuleTableAntecedent)
        strongest = antecedent.strengths(rows.read(slice(None))[0]).argmax(axis=0)
        # The same partition under other names.
        assert len(set(zip(strongest.tolist(), labels.tolist(), strict=True))) == 3

    def test_clusters_are_sought_in_inputs_and_target_together(self, rng):
        rows = StandardisedData.of(rng.normal(size=(50, 2)), rng.normal(size=(50, 3)))
        seen = []

        def label(table, weight):
            seen.append(table)
            return np.arange(len(table)) % 2

        rules_of(Gaussian, rows, label)
        expected = rows.table(slice(None))
        assert_array_equal(seen[0], expected[np.lexsort(expected.T[::-1])])

    def test_noise_belongs_to_no_rule(self, rng):
        # Without the far rows that are labelled -1, the rules are those of the rest.
        X, y, _, _ = blobs(rng)
        rows = StandardisedData.of(X, y)
        noisy = rules_of(Gaussian, rows, lambda t, w: np.where(t[:, 0] > 0.5, -1, t[:, 1] > 0))
        assert noisy.n_rules == 2
        z, _, _ = rows.read(slice(None))
        kept = z[:, z[0] <= 0.5]
        means = sorted(
            kept[0, kept[1] > 0].mean() if side else kept[0, kept[1] <= 0].mean() for side in (0, 1)
        )
        assert_allclose(np.sort(rule_parameters(noisy, 2)[0, :, 0]), means, rtol=1e-10)

    def test_labels_may_be_any_integers(self, rng):
        X, y, _, _ = blobs(rng)
        rows = StandardisedData.of(X, y)
        plain = rules_of(Gaussian, rows, by_k_means)
        odd = rules_of(Gaussian, rows, lambda t, w: 7 * by_k_means(t, w) + 3)
        assert_array_equal(odd.parameters, plain.parameters)

    def test_one_cluster_is_a_linear_model(self, rng):
        rows = StandardisedData.of(rng.normal(size=(50, 2)), rng.normal(size=(50, 1)))
        antecedent = rules_of(Gaussian, rows, lambda t, w: np.zeros(len(t), dtype=int))
        assert antecedent.n_rules == 1
        assert antecedent.parameters.size == 0
        assert_array_equal(antecedent.strengths(np.zeros((2, 5))), 1.0)

    def test_no_cluster_is_an_error_that_says_why(self, rng):
        rows = StandardisedData.of(rng.normal(size=(50, 2)), rng.normal(size=(50, 1)))
        with pytest.raises(ValueError, match=r"partition found no cluster: .* noise.*standardised"):
            rules_of(Gaussian, rows, lambda t, w: np.full(len(t), -1))

    def test_cluster_on_one_spot_has_a_term_of_some_width(self, rng):
        X = np.vstack([np.full((30, 2), 5.0), rng.normal(size=(30, 2))])
        rows = StandardisedData.of(X, X[:, :1])
        antecedent = rules_of(Gaussian, rows, lambda t, w: (t[:, 0] < t[:, 0].max()).astype(int))
        assert_allclose(
            np.exp(rule_parameters(antecedent, 2)[1, 1]), 0.1 * np.sqrt(2.0), rtol=1e-12
        )

    def test_constant_input_gets_no_terms_and_widens_none(self, rng):
        X, y, _, _ = blobs(rng)
        padded = StandardisedData.of(np.insert(X, 1, 7.0, axis=1), y)
        plain = rules_of(Gaussian, StandardisedData.of(X, y), by_k_means)
        other = rules_of(Gaussian, padded, by_k_means)
        assert {int(j) for group in other.groups for j in group.inputs} == {0, 2}
        assert_allclose(other.parameters, plain.parameters, rtol=1e-12, atol=1e-14)

    def test_terms_that_nobody_could_tell_apart_are_one(self, rng):
        # Four clumps at the corners of a square, a hair off each: two terms on either input.
        corner = np.arange(400) % 4
        X = np.array([[0.0, 0.0], [9.0, 0.1], [0.1, 9.0], [9.1, 9.1]])[corner]
        X = X + rng.normal(size=X.shape)
        rows = StandardisedData.of(X, corner[:, None].astype(float))
        antecedent = rules_of(
            Gaussian, rows, lambda t, w: np.unique(t[:, 2], return_inverse=True)[1]
        )
        assert antecedent.n_rules == 4
        assert antecedent.n_terms == 4
        # A shared term has the mean and the deviation of both clumps, times sqrt(2) inputs.
        z = (X - rows.inputs.offset) / rows.inputs.scale
        for j, group in enumerate(antecedent.groups):
            for term, side in zip(np.argsort(group.theta[0]), (False, True), strict=True):
                members = z[(X[:, j] > 4.5) == side, j]
                assert_allclose(group.theta[0, term], members.mean(), rtol=1e-9)
                width = np.sqrt(2.0) * members.std()
                assert_allclose(np.exp(group.theta[1, term]), width, rtol=1e-2)

    @pytest.mark.parametrize("draw", ["lognormal", "standard_cauchy", "normal"])
    @pytest.mark.parametrize("n_clusters", [3, 8, 20])
    def test_no_two_terms_cross_too_high(self, rng, draw, n_clusters):
        X = getattr(rng, draw)(size=(400, 3))
        rows = StandardisedData.of(X, np.sin(X[:, :1]))
        for name in ("gaussian", "bell", "trapezoidal"):
            antecedent = rules_of(
                MEMBERSHIPS[name],
                rows,
                lambda t, w: KMeans(n_clusters, n_init=1, random_state=0).fit_predict(t),
            )
            assert (highest_crossings(antecedent) <= _HIGHEST_CROSSING + 1e-2).all()
            assert len(np.unique(antecedent.rule_terms, axis=0)) == antecedent.n_rules

    def test_an_input_that_tells_no_clusters_apart_has_no_terms(self, rng):
        X, y, labels, _ = blobs(rng)
        alike = rng.normal(size=(len(X), 1))
        rows = StandardisedData.of(np.hstack([X, alike]), y)
        order = np.lexsort(rows.table(slice(None)).T[::-1])
        antecedent = rules_of(Gaussian, rows, lambda t, w: labels[order])
        plain = rules_of(
            Gaussian,
            StandardisedData.of(X, y),
            lambda t, w: labels[np.lexsort(np.hstack([X, y]).T[::-1])],
        )
        assert {int(j) for group in antecedent.groups for j in group.inputs} == {0, 1}
        assert_allclose(antecedent.parameters, plain.parameters, rtol=1e-9)

    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")
    def test_clusters_of_the_target_alone_leave_one_rule(self):
        # Every input is constant: there is nothing for a premise to tell clusters apart by.
        y = np.repeat([0.0, 1.0], 50)
        model = ANFISRegressor(partition=KMeans(2, random_state=0)).fit(np.ones((100, 2)), y)
        assert model.n_rules_ == 1
        assert_allclose(model.predict(np.ones((1, 2))), 0.5)

    def test_of_several_families_each_rule_has_terms_of_its_own(self, rng):
        X, y, *_ = blobs(rng)
        rows = StandardisedData.of(X, y)
        mixed = clustered_antecedent([Gaussian, Bell], rows, by_k_means, np.arange(2))
        assert_array_equal(mixed.rule_terms, [[0, 3], [1, 4], [2, 5]])
        for j, family in enumerate([Gaussian, Bell]):
            alone = clustered_antecedent([family] * 2, rows, by_k_means, np.arange(2))
            assert_array_equal(mixed.groups[j].inputs, j)
            assert_allclose(mixed.groups[j].theta, alone.groups[0].theta[:, j::2])
        Z = rng.normal(size=(2, 50))
        expected = oracles.strengths(mixed, mixed.parameters, Z)
        assert_allclose(mixed.strengths(Z), expected, rtol=1e-10)

    def test_labels_are_asked_for_by_weight(self, rng):
        X, y, times = many(rng)
        asked = []

        def label(table, weight):
            asked.append((table, weight))
            return np.zeros(len(table), dtype=int)

        rows = StandardisedData.of(X, y, times.astype(float))
        clustered_antecedent([Gaussian] * 2, rows, label, np.array([1]))
        (table, weight), (every, share, _) = asked[0], representative_rows(rows)
        assert_array_equal(table, every[:, [1, 2]])
        assert_array_equal(weight, share)
        assert weight.sum() == times.sum()

    def test_of_clusters_that_no_input_tells_apart_one_rule_without_terms_is_left(self, rng):
        X, y = rng.normal(size=(200, 1)), rng.normal(size=(200, 1))
        rows = StandardisedData.of(X, y)
        found = rules_of(Gaussian, rows, lambda t, w: np.arange(len(t)) % 2)
        assert (found.n_rules, found.n_terms) == (1, 0)


def many(rng, n_rows=300):
    """Rows of whole numbers, some of them equal, with whole weights."""
    X = rng.integers(0, 12, (n_rows, 2)).astype(float)
    y = rng.integers(0, 3, (n_rows, 1)).astype(float)
    return X, y, rng.integers(1, 6, n_rows)


def standing_for(X, y, weight=None, most=10_000):
    """Table in the user's units, and weight as part of the whole."""
    rows = StandardisedData.of(X, y, None if weight is None else weight.astype(float))
    table, share, _ = representative_rows(rows, most)
    scales = np.concatenate([rows.inputs.scale, rows.targets.scale])
    return table * scales + np.concatenate(
        [rows.inputs.offset, rows.targets.offset]
    ), share / share.sum()


class TestRepresentativeRows:
    @pytest.mark.parametrize("most", [10_000, 100])
    def test_order_of_the_rows_does_not_matter(self, rng, most):
        X, y, weight = many(rng)
        turn = rng.permutation(len(X))
        table, share = standing_for(X, y, weight, most)
        turned, turned_share = standing_for(X[turn], y[turn], weight[turn], most)
        assert_allclose(turned, table, atol=1e-9)
        assert_allclose(turned_share, share, rtol=1e-9)

    @pytest.mark.parametrize("most", [100_000, 100])
    def test_weight_is_repetition(self, rng, most):
        # Both more than ``most`` rows, or both fewer.
        X, y, times = many(rng)
        table, share = standing_for(X, y, times, most)
        repeated = standing_for(
            np.repeat(X, times, axis=0), np.repeat(y, times, axis=0), None, most
        )
        assert_allclose(repeated[0], table, atol=1e-9)
        assert_allclose(repeated[1], share, rtol=1e-9)

    def test_weight_is_repetition_also_where_only_the_repeated_rows_are_too_many(self, rng):
        X, y, times = many(rng)
        table, share = standing_for(X, y, times, 500)
        repeated = standing_for(np.repeat(X, times, axis=0), np.repeat(y, times, axis=0), None, 500)
        assert times.sum() > 500 > len(X)
        assert repeated[0].shape == table.shape
        assert_allclose(repeated[1], share, rtol=1e-9)

    def test_few_rows_stand_for_themselves(self, rng):
        X, y, times = many(rng)
        table, share = standing_for(X, y, times)
        expected, group = np.unique(np.hstack([X, y]), axis=0, return_inverse=True)
        assert_allclose(table, expected, atol=1e-9)
        assert_allclose(share, np.bincount(group.ravel(), weights=times) / times.sum(), rtol=1e-12)
        assert len(table) < len(X)

    def test_many_rows_are_thinned_evenly(self, rng):
        X = rng.normal(size=(5000, 2))
        y = X.sum(axis=1, keepdims=True)
        rows = StandardisedData.of(X, y)
        table, weight, _ = representative_rows(rows, 500)
        assert len(table) <= 500
        assert weight.sum() == 500
        every = {row.tobytes() for row in rows.table(slice(None))}
        assert all(row.tobytes() in every for row in table)
        # A sample of independent rows would be off by 1 / sqrt(500), 0.045.
        assert_allclose(np.average(table, axis=0, weights=weight), 0.0, atol=0.15)
        assert_allclose(np.average(table**2, axis=0, weights=weight), 1.0, atol=0.2)

    def test_heavy_rows_stand_for_more(self, rng):
        X = rng.normal(size=(1000, 1))
        weight = np.where(X[:, 0] > 0.0, 9.0, 1.0)
        rows = StandardisedData.of(X, np.zeros((1000, 1)), weight)
        table, share, _ = representative_rows(rows, 200)
        heavy = table[:, 0] > -rows.inputs.offset[0] / rows.inputs.scale[0]
        assert_allclose(
            share[heavy].sum() / share.sum(), weight[X[:, 0] > 0.0].sum() / weight.sum(), atol=0.01
        )

    def test_a_fit_by_clusters_does_not_see_the_order_of_the_rows(self, rng, monkeypatch):
        monkeypatch.setattr(representative_rows, "__defaults__", (200,))
        X = rng.uniform(-1.0, 1.0, (900, 2))
        y = np.sin(3.0 * X[:, 0]) + X[:, 1] ** 2 + 0.1 * rng.normal(size=900)
        turn = rng.permutation(900)
        partition = KMeans(3, n_init=2, random_state=0)
        one = ANFISRegressor(partition=partition, solver=VariableProjection(tol=0.01)).fit(X, y)
        other = ANFISRegressor(partition=partition, solver=VariableProjection(tol=0.01)).fit(
            X[turn], y[turn]
        )
        assert_allclose(other.predict(X), one.predict(X), atol=1e-6)


class TestSampleSize:
    def test_repeats_are_rows_and_weight_but_not_distinct(self, rng):
        X, y, times = many(rng)
        size = SampleSize.of(
            StandardisedData.of(np.repeat(X, times, axis=0), np.repeat(y, times, axis=0))
        )
        assert size.n_rows == size.weight == times.sum()
        assert size.n_distinct_rows == len(np.unique(np.hstack([X, y]), axis=0))
        assert size.n_distinct_inputs == len(np.unique(X, axis=0))
        assert size.n_distinct_inputs < size.n_distinct_rows < size.n_rows

    def test_whole_weights_count_as_copies(self, rng):
        X, y, times = many(rng)
        weighted = SampleSize.of(StandardisedData.of(X, y, times.astype(float)))
        repeated = SampleSize.of(
            StandardisedData.of(np.repeat(X, times, axis=0), np.repeat(y, times, axis=0))
        )
        assert weighted.n_rows == len(X)
        assert weighted.weight == repeated.weight
        assert weighted.n_distinct_rows == repeated.n_distinct_rows
        assert weighted.n_distinct_inputs == repeated.n_distinct_inputs

    @pytest.mark.parametrize("unit", [1e-300, 1e-6, 0.5])
    def test_weights_below_one_count_by_the_precision_they_leave(self, rng, unit):
        # Kish: of equal weights every row counts; of a half with next to none, half of them.
        X, y, _ = many(rng)
        even = StandardisedData.of(X, y, np.full(300, unit))
        assert_allclose(effective_weight(even), 300.0, rtol=1e-12)
        half = StandardisedData.of(X, y, np.where(np.arange(300) < 150, unit, 1e-9 * unit))
        assert_allclose(effective_weight(half), 150.0, rtol=1e-6)
        share = rng.uniform(0.1, 1.0, 300)
        uneven = StandardisedData.of(X, y, unit * share)
        assert_allclose(effective_weight(uneven), share.sum() ** 2 / (share**2).sum(), rtol=1e-12)

    def test_counting_stops_as_soon_as_there_are_enough(self, rng):
        X = np.vstack([rng.normal(size=(5000, 2)), np.zeros((5000, 2))])
        rows = StandardisedData.of(X, np.zeros((10_000, 1)))
        assert SampleSize.of(rows, 100).n_distinct_inputs == 100
        assert SampleSize.of(rows, 10_000).n_distinct_inputs == 5001

    def test_rows_that_differ_in_the_last_digits_of_one_input_are_distinct(self, rng):
        X = np.tile(rng.normal(size=3), (40, 1))
        X[:, 1] += 1e-9 * np.arange(40)
        size = SampleSize.of(StandardisedData.of(X, np.zeros((40, 1))))
        assert size.n_distinct_inputs == 40

    @pytest.mark.parametrize("most", [10_000, 100])
    def test_a_search_sees_repeated_rows_as_weighted_ones(self, rng, most):
        X, y, times = many(rng)
        weighted = search_sample(StandardisedData.of(X, y, times.astype(float)), most)
        repeated = search_sample(
            StandardisedData.of(np.repeat(X, times, axis=0), np.repeat(y, times, axis=0)), most
        )
        assert_allclose(repeated.X, weighted.X, atol=1e-12)
        assert_allclose(repeated.y, weighted.y, atol=1e-12)
        assert_array_equal(repeated.sample_weight, weighted.sample_weight)
        # Already in the units of all rows: what they are is not standardised again.
        assert_array_equal(weighted.inputs.scale, 1.0)
        assert_array_equal(weighted.inputs.offset, 0.0)

    def test_a_search_knows_the_group_of_each_of_its_rows(self, rng):
        X, y = rng.normal(size=(500, 2)), rng.normal(size=(500, 1))
        rows = StandardisedData.of(X, y, groups=np.arange(500))
        sample = search_sample(rows, 60)
        assert sample.n_rows == 60
        assert_array_equal(np.hstack([sample.X, sample.y]), rows.table(sample.groups))


# The others rise or fall for good.
TWO_SIDED = [family for name, family in MEMBERSHIPS.items() if name not in ("s_shaped", "z_shaped")]


@pytest.mark.parametrize("family", TWO_SIDED, ids=lambda family: family.name)
def test_two_terms_cross_where_both_are_truest(family):
    # By looking everywhere between them; of widths that differ, too.
    for width in (1.0, 0.4, 3.0):
        distance = _closest(family) * (1.0 + width)
        theta = family.from_center_and_width(np.array([0.0, distance]), np.array([1.0, width]))
        between = np.linspace(0.0, distance, 20_001)[:, None]
        truths = [family.value(between, theta[:, [side]]) for side in (0, 1)]
        assert_allclose(_distance((0.0, 1.0), (distance, width**2)), _closest(family))
        assert_allclose(np.minimum(*truths).max(), _HIGHEST_CROSSING, atol=1e-3)
