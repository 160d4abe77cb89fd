"""Rules from clusters: blobs that are known, labels that mean noise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.learning.data import StandardisedData
from skanfis.membership import Bell, Gaussian
from skanfis.search.clusters import clustered_antecedent


def blobs(rng):
    """Three blobs far apart in both inputs and target."""
    centers = 3.0 * np.array([[0, 0, 0], [3, 1, 2], [-2, 4, -3]], dtype=float)
    table = centers[np.arange(240) % 3] + rng.normal(size=(240, 3))
    return table[:, :-1], table[:, -1:]


def by_k_means(table, weight):
    return KMeans(3, n_init=3, random_state=0).fit(table, sample_weight=weight).labels_


def rules_of(rows, label):
    """Both inputs in the premises."""
    return clustered_antecedent([Gaussian] * 2, rows, label, np.arange(2))


def rule_parameters(antecedent):
    """Theta as (n_parameters, n_rules, 2), rules in the order of their first centre."""
    (group,) = antecedent.groups
    theta = group.theta.reshape(len(group.theta), -1, 2)
    return theta[:, np.argsort(theta[0, :, 0])]


class TestRules:
    def test_clusters_are_sought_in_the_premise_inputs_alone(self, rng):
        X, y = blobs(rng)
        noise = 100.0 * rng.normal(size=(len(X), 1))
        rows = StandardisedData.of(np.hstack([noise, X]), y)
        found = clustered_antecedent([Gaussian] * 3, rows, by_k_means, np.array([1, 2]))
        expected = rules_of(StandardisedData.of(X, y), by_k_means)
        assert {int(j) for group in found.groups for j in group.inputs} == {1, 2}
        for one, other in zip(rule_parameters(found), rule_parameters(expected), strict=True):
            assert_allclose(one, other)

    def test_noise_belongs_to_no_rule(self, rng):
        # Without the far rows that are labelled -1, the rules are those of the rest.
        X, y = blobs(rng)
        rows, seen = StandardisedData.of(X, y), []

        def label(table, weight):
            seen.append(table)
            return np.where(table[:, 0] > 0.5, -1, table[:, 1] > 0)

        centers, log_widths = rule_parameters(rules_of(rows, label))
        z, target, _ = rows.read(slice(None))
        # Clusters are sought in standardised inputs and target together.
        assert_allclose(np.sort(seen[0], axis=0), np.sort(np.vstack([z, target]).T, axis=0))
        kept = z[:, z[0] <= 0.5]
        own = sorted((kept[:, kept[1] > 0], kept[:, kept[1] <= 0]), key=lambda part: part[0].mean())
        assert_allclose(centers, [part.mean(axis=1) for part in own], rtol=1e-10)
        # No narrower than a tenth of the input's deviation.
        widths = [np.sqrt(2.0) * np.maximum(part.std(axis=1), 0.1) for part in own]
        assert_allclose(np.exp(log_widths), widths, rtol=1e-10)

    def test_cluster_on_one_spot_has_a_term_of_some_width(self, rng):
        X = np.vstack([np.full((30, 2), 5.0), rng.normal(size=(30, 2))])
        rows = StandardisedData.of(X, X[:, :1])
        antecedent = rules_of(rows, lambda t, w: (t[:, 0] < t[:, 0].max()).astype(int))
        widths = np.exp(rule_parameters(antecedent)[1, 1])
        assert_allclose(widths, 0.1 * np.sqrt(2.0), rtol=1e-12)

    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")
    def test_clusters_of_the_target_alone_leave_one_rule(self):
        # Every input is constant: there is nothing for a premise to tell clusters apart by.
        y = np.repeat([0.0, 1.0], 50)
        model = ANFISRegressor(partition=KMeans(2, random_state=0)).fit(np.ones((100, 2)), y)
        assert model.n_rules_ == 1
        assert_allclose(model.predict(np.ones((1, 2))), 0.5)

    def test_of_several_families_each_rule_has_terms_of_its_own(self, rng):
        rows = StandardisedData.of(*blobs(rng))
        mixed = clustered_antecedent([Gaussian, Bell], rows, by_k_means, np.arange(2))
        assert_array_equal(mixed.rule_terms, [[0, 3], [1, 4], [2, 5]])
