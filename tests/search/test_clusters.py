"""Rules from clusters: blobs that are known, labels that mean noise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.antecedent import RuleTableAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian
from skanfis.search.clusters import clustered_antecedent

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
    return clustered_antecedent([family] * n_inputs, rows, label, np.arange(n_inputs))


def rule_parameters(antecedent):
    """Theta as (n_parameters, n_rules, 2), rules in the order of their first centre."""
    (group,) = antecedent.groups
    theta = group.theta.reshape(len(group.theta), -1, 2)
    return theta[:, np.argsort(theta[0, :, 0])]


class TestRules:
    def test_clusters_are_sought_in_the_premise_inputs_alone(self, rng):
        X, y, *_ = blobs(rng)
        noise = 100.0 * rng.normal(size=(len(X), 1))
        rows = StandardisedData.of(np.hstack([noise, X]), y)
        found = clustered_antecedent([Gaussian] * 3, rows, by_k_means, np.array([1, 2]))
        expected = rules_of(Gaussian, StandardisedData.of(X, y), by_k_means)
        assert {int(j) for group in found.groups for j in group.inputs} == {1, 2}
        for one, other in zip(rule_parameters(found), rule_parameters(expected), strict=True):
            assert_allclose(one, other)

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

    def test_noise_belongs_to_no_rule(self, rng):
        # Without the far rows that are labelled -1, the rules are those of the rest.
        X, y, _, _ = blobs(rng)
        rows, seen = StandardisedData.of(X, y), []

        def label(table, weight):
            seen.append(table)
            return np.where(table[:, 0] > 0.5, -1, table[:, 1] > 0)

        centers, log_widths = rule_parameters(rules_of(Gaussian, rows, label))
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
        antecedent = rules_of(Gaussian, rows, lambda t, w: (t[:, 0] < t[:, 0].max()).astype(int))
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
