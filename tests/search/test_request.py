"""Starts: imported rules, named partitions, mixed families, chosen features."""

from dataclasses import replace
from inspect import signature
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.cluster import HDBSCAN, AgglomerativeClustering, KMeans, MiniBatchKMeans
from sklearn.mixture import GaussianMixture
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.cluster import FuzzyCMeans, SubtractiveClustering
from skanfis.learning import VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.learning.penalty import Penalty
from skanfis.search.start import Start
from skanfis.training.settings import structure_request

from ..quick import quick, with_few_candidates

KMEANS = KMeans(3, random_state=0)
# Its default changes: to be quiet, newer versions have to be told.
HDBSCAN_TAKES_COPY = "copy" in signature(HDBSCAN).parameters


def surface(n_rows=300, seed=0):
    g = np.random.default_rng(seed)
    ranges = {"time": (0, 600), "temperature": (-40, 60), "rate": (-100, 100)}
    frame = pd.DataFrame({name: g.uniform(*ends, n_rows) for name, ends in ranges.items()})
    y = 0.01 * frame["rate"] * np.sin(frame["temperature"] / 20) + np.exp(-frame["time"] / 200)
    return frame, y + 0.01 * g.normal(size=n_rows)


@pytest.fixture(scope="module", name="data")
def measured():
    return surface()


GRID, CLUSTERS = {"n_mfs": [2, 3, 1]}, {"partition": FuzzyCMeans(3, random_state=0)}


@pytest.fixture(scope="module", params=[GRID, CLUSTERS, {"partition": "tree", "max_rules": 3}])
def known(request, data):
    return quick(**request.param).fit(*data)


class TestImported:
    def test_without_iterations_nothing_is_learnt(self, data, known):
        X, y = surface(50, seed=1)
        for given in (known, known.model_):
            model = ANFISRegressor(partition=given, max_iter=0).fit(X, y + 5.0)
            assert_array_equal(model.predict(data[0]), known.predict(data[0]))
            assert model.memberships_ == model.initial_memberships_ == known.memberships_
            loss = np.mean((model.predict(X) - y - 5.0) ** 2) / np.var(y)
            assert_allclose(model.loss_curve_, loss, rtol=1e-9)
            weighted = ANFISRegressor(partition=given, max_iter=0).fit(
                X, y + 5.0, np.repeat([1, 9], 25)
            )
            rows = np.append(np.arange(25), np.repeat(np.arange(25, 50), 9))
            loss = np.mean((model.predict(X) - y - 5.0)[rows] ** 2) / np.var(y[rows])
            assert_allclose(weighted.loss_curve_, loss, rtol=1e-9)
            assert "as they were given" in model.status_
        # Columns without names contradict none.
        ANFISRegressor(partition=known, max_iter=0).fit(X.to_numpy(), y)

    def test_with_least_squares_the_consequents_alone_are_learnt(self, data, known):
        X, y = data
        model = ANFISRegressor(partition=known, solver="lse").fit(X, 3.0 * y - 1.0)
        assert model.stiffness_ == 0.0  # what does not move is not held
        assert model.model_.term_names == known.model_.term_names
        found, expected = (one.model_.antecedent.parameters for one in (model, known))
        assert_allclose(found, expected, rtol=1e-9)
        again = ANFISRegressor(partition=known, solver="lse").fit(X, y)
        assert_allclose(model.predict(X), 3.0 * again.predict(X) - 1.0, atol=1e-8)

    def test_a_grid_whose_terms_are_not_in_order_can_be_trained(self, data):
        X, y = data
        model = ANFISRegressor(n_mfs=[3, 1, 1], max_iter=0).fit(X, y).model_
        theta = model.antecedent.groups[0].theta.copy()
        theta[0] = theta[0, [1, 0, 2]]
        turned = model.antecedent.with_parameters(theta.ravel())
        object.__setattr__(model, "antecedent", turned)
        trained = ANFISRegressor(partition=model, solver=VariableProjection(tol=1e-2)).fit(X, y)
        assert trained.loss_curve_[-1] < trained.loss_curve_[0]

    @pytest.mark.parametrize(
        ("settings", "columns", "message"),
        [
            ({}, ["time", "rate"], "the columns of X are time, rate: give X the inputs"),
            ({}, ["time", "rate", "temperature"], "the same names and in the same order"),
            ({"n_mfs": 3}, slice(None), r"n_mfs=3 .* for the imported rules"),
            ({"n_mfs": 3, "max_iter": 0}, slice(None), r"n_mfs=3 .* for the imported rules"),
            ({"premise_features": ["rate"]}, slice(None), "premise_features=.* has no effect on"),
            ({"order": 0, "max_iter": 0}, slice(None), "order=0 has no effect with max_iter=0"),
            ({"consequent_features": [2], "max_iter": 0}, slice(None), "consequent_.*no effect"),
        ],
    )
    def test_what_imported_rules_cannot_heed_is_refused(
        self, data, known, settings, columns, message
    ):
        X, y = data
        with pytest.raises(ValueError, match=message):
            ANFISRegressor(partition=known, **settings).fit(X.loc[:, columns], y)

    def test_outputs_must_be_as_many_where_nothing_is_learnt(self, data, known):
        X, y = data
        with pytest.raises(ValueError, match="a model of y, but y has y0, y1"):
            ANFISRegressor(partition=known, max_iter=0).fit(X, np.column_stack([y, y]))


@pytest.mark.parametrize("settings", [{}, {"max_iter": 0}, {"solver": "lse"}], ids=str)
def test_an_imported_model_may_not_have_more_rules_than_the_most(data, known, settings):
    n_rules = known.n_rules_
    many = ANFISRegressor(partition=known, max_rules=n_rules - 1, **settings)
    for learn in (many.fit, many.partial_fit):
        with pytest.raises(ValueError, match=f"max_rules=.* partition has {n_rules} rules. Give"):
            learn(*data)
    model = quick(partition=known, max_rules=n_rules).fit(*data)
    assert model.n_rules_ == n_rules


TOO_MANY = ", more than max_rules=5.*fewer, or leave max_rules at None"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"max_rules": 5, "n_mfs": [3, 2, 1]}, rf"n_mfs=\[3, 2, 1\] makes 6 rules{TOO_MANY}"),
        ({"max_rules": 5, "n_mfs": 60}, f"n_mfs=60 makes 216,000 rules{TOO_MANY}"),
        (
            {"max_rules": 5, "partition": KMeans(6)},
            rf"partition=KMeans\(.*\) makes 6 rules{TOO_MANY}",
        ),
        ({"max_rules": 0}, "'max_rules' parameter"),
        ({"simplicity": -1}, "'simplicity' parameter"),
        ({"partition": "tree", "mf": "bell"}, "mf=.* has no effect with partition='tree'"),
        ({"mf": ["bell"]}, "has the length 1, and the columns of X"),
        ({"mf": ["bell", "bell", "square"]}, "mf holds 'square': it must be one of 'gaussian'"),
        ({"mf": int}, "mf holds <class 'int'>"),
        ({"premise_features": ["speed"]}, "'speed', which is no column of X; .*'time'"),
        ({"premise_features": [3]}, "premise_features names 3, which is no column"),
        ({"premise_features": [0, 0]}, "names a column twice"),
        ({"premise_features": []}, "names no column"),
        ({"premise_features": [True, False]}, "a mask of the length 2: give one entry .* 3 in all"),
        ({"consequent_features": [0], "order": 0}, "has no effect with order=0"),
        ({"n_mfs": [2, 1, 1], "premise_features": ["rate"]}, "'time', which is not in premise"),
    ],
    ids=str,
)
def test_what_does_not_fit_is_refused(data, settings, message):
    with pytest.raises(ValueError, match=message):
        ANFISRegressor(**settings).fit(*data)


@pytest.mark.theory
def test_rules_that_are_given_are_one_candidate(data):
    X, y = data
    given = ({"n_mfs": [2, 1, 2]}, "grid"), ({"partition": KMEANS}, "scattered")
    for settings, kind in (*given, ({"n_mfs": [1, 1, 1]}, "one rule")):
        model = ANFISRegressor(**settings).fit(X, y)
        (told,) = model.structures_
        assert (told["kind"], told["rules"], told["chosen"]) == (kind, model.n_rules_, True)
        words = "one rule" if kind == "one rule" else f"{model.n_rules_} rules"
        assert told["structure"] == f"{words} as given"
        assert told["n_mfs"] == settings.get("n_mfs")
        assert told["reading_cost"] == model.readability_.reading_cost
        # On the rows that it was trained on it leaves less, but not much.
        left = np.std(y - model.predict(X)) / y.std()
        assert left < told["expected_error"] < 1.3 * left
    # A line says more than the mean, and rules of noise less.
    assert told["rules_beat_mean"]
    noise = np.random.default_rng(0).normal(size=len(y))
    (told,) = ANFISRegressor(n_mfs=2, alpha=1e-9).fit(X, noise).structures_
    assert not told["rules_beat_mean"]


@pytest.mark.theory
def test_families_may_differ_from_input_to_input(data, monkeypatch):
    with_few_candidates(monkeypatch)
    X, y = (part[:150] for part in data)
    mixed = ["bell", "gaussian", "triangular"]
    for settings in ({"n_mfs": 2}, {"partition": KMeans(3, random_state=0)}, {}):
        model = quick(**{"n_mfs": "auto", "mf": mixed} | settings).fit(X, y)
        found = {term["input"]: term["function"] for term in model.memberships_}
        expected = dict(zip(X.columns, mixed, strict=True))
        assert found.items() <= expected.items()
        assert model.loss_curve_[-1] < 0.5


class TestFeatures:
    @pytest.mark.theory
    def test_rules_are_on_their_features_and_consequents_in_theirs_alone(self, data):
        """Both, and each alone: the others are on all inputs. Of a search: test_every_kind."""
        X, y = (part[:150] for part in data)
        chosen = {"premise_features": ["time", "temperature"], "consequent_features": ["rate"]}
        for keys, n_terms, slopes in (
            (list(chosen), 4, [2]),
            (["premise_features"], 4, [0, 1, 2]),
            (["consequent_features"], 6, [2]),
        ):
            model = quick(n_mfs=2, **{key: chosen[key] for key in keys}).fit(X, y)
            inputs = [term["input"] for term in model.memberships_]
            assert len(inputs) == n_terms
            assert "rate" in inputs or n_terms == 4
            assert_array_equal(np.flatnonzero(model.consequents_[:, 1:].all(axis=0)), slopes)
            left = np.mean((model.predict(X) - y) ** 2) / np.var(y)
            assert_allclose(left, model.loss_curve_[-1], rtol=1e-8)

    def test_they_may_be_masks_positions_or_names(self, data):
        given = (["rate", "time"], [0, 2], [-1, 0], [True, False, True], np.array([0, 2]))
        models = (quick(n_mfs=2, max_iter=0, consequent_features=f).fit(*data) for f in given)
        for one, other in pairwise(model.predict(data[0]) for model in models):
            assert_array_equal(one, other)

    def test_a_name_that_a_step_in_front_has_taken_away(self, data):
        model = make_pipeline(StandardScaler(), ANFISRegressor(premise_features="rate"))
        with pytest.raises(ValueError, match=r"'rate'.*set_output\(transform='pandas'\)"):
            model.fit(*data)
        model.set_output(transform="pandas").set_params(anfisregressor__n_mfs=[1, 1, 2])
        assert model.fit(*data)[-1].n_rules_ == 2


def test_names_of_terms_are_carried(data):
    X, y = data
    solver = VariableProjection(tol=1e-1)
    model = ANFISRegressor(n_mfs=[3, 2, 1], solver=solver).fit(X, y)
    assert model.rename_terms({"temperature": ["cold", "hot"]}) is model
    assert model.model_.term_names == ("low", "medium", "high", "cold", "hot")
    assert [term["name"] for term in model.memberships_] == list(model.model_.term_names)
    later = ANFISRegressor(partition=model.model_, max_iter=0).fit(X, y)
    assert later.model_.term_names == model.model_.term_names
    with pytest.raises(ValueError, match="3 given for 2 terms"):
        model.rename_terms({"temperature": ["a", "b", "c"]})
    assert model.model_.term_names == later.model_.term_names


def test_outputs_are_named_by_the_target(data):
    X, y = data
    model = ANFISRegressor(n_mfs=1)
    assert model.fit(X, y.rename("error")).model_.output_names == ("error",)
    both = pd.DataFrame({"bias": y, "scale": -y})
    assert model.fit(X, both).model_.output_names == ("bias", "scale")
    assert model.fit(X, y.to_numpy()).model_.output_names == ("y",)
    assert model.fit(X, both.to_numpy()).model_.output_names == ("y0", "y1")


@pytest.mark.parametrize(
    "clusterer",
    [
        KMeans(3, random_state=0),
        MiniBatchKMeans(3, random_state=0),
        GaussianMixture(3, random_state=0),
        AgglomerativeClustering(3),
        HDBSCAN(min_cluster_size=15, **({"copy": True} if HDBSCAN_TAKES_COPY else {})),
        FuzzyCMeans(3, random_state=0),
        SubtractiveClustering(0.8),
    ],
    ids=lambda clusterer: type(clusterer).__name__,
)
def test_any_clusterer_gives_a_rule_per_cluster(clusterer):
    # Three clumps with planes of their own, and a few rows between them.
    g = np.random.default_rng(8)
    clump = np.arange(300) % 3
    X = np.array([[0, 0], [8, 0], [0, 8]])[clump] + 0.5 * g.normal(size=(300, 2))
    X[:9] = g.uniform(0, 8, (9, 2))
    y = np.choose(clump, [X[:, 0], 5.0 - X[:, 1], X[:, 0] + X[:, 1]])
    model = ANFISRegressor(partition=clusterer).fit(X[9:], y[9:])
    assert model.n_rules_ == 3
    assert_allclose(model.predict(X[9:]), y[9:], atol=0.05)


@pytest.mark.parametrize("clusterer", [KMeans(2, random_state=0), AgglomerativeClustering(2)])
def test_any_clusterer_sees_weights_or_repeated_rows(clusterer):
    """Of three clumps, two weigh much: the light one joins its neighbour, far as it is."""
    X = np.add.outer([0.0, 1.0, 3.0], [-0.02, -0.01, 0.0, 0.01, 0.02]).reshape(-1, 1)
    weight = np.repeat([30, 30, 1], 5)
    if isinstance(clusterer, AgglomerativeClustering):
        X, weight = np.repeat(X, weight, axis=0), None
    model = ANFISRegressor(partition=clusterer, solver="lse").fit(X, X, sample_weight=weight)
    centers = sorted(term["center"] for term in model.initial_memberships_)
    assert_allclose(centers, [0.0, 33.0 / 31.0], atol=1e-9)


@pytest.mark.parametrize(
    ("clusterer", "is_seeded"),
    [
        (FuzzyCMeans(5), False),
        (make_pipeline(StandardScaler(), KMeans(5, n_init=1)), False),
        (KMeans(5, n_init=1, random_state=3), True),
    ],
    ids=str,
)
def test_draws_of_a_clusterer_without_a_seed_have_that_of_the_fit(data, clusterer, is_seeded):
    one, same, other = (
        quick(partition=clusterer, random_state=seed).fit(*data).predict(data[0])
        for seed in (None, None, 1)
    )
    assert_array_equal(one, same)
    assert np.array_equal(one, other) is is_seeded


@pytest.mark.parametrize("agreement_is_raised", [False, True])
def test_weights_found_on_a_sample_are_for_all_rows(data, agreement_is_raised, rng):
    X, y = data[0].to_numpy(), data[1].to_numpy()[:, None]
    weight = rng.uniform(0.5, 1.5, len(y))
    rows = StandardisedData.of(X, y, weight)
    sample = replace(rows, X=X[:60], y=y[:60], sample_weight=weight[:60])
    found = Penalty(agreement=0.01, alpha=0.02, slope=0.03, stiffness=0.04)
    start = Start(None, found, np.arange(2), agreement_is_raised=agreement_is_raised)
    estimator = ANFISRegressor([2, 1, 1], solver=VariableProjection(stiffness=0.04))
    asked = structure_request(estimator, list(data[0])).for_all(start, sample, rows).penalty
    # Relative to a mean over rows they fall with their number; one that is given stays as it is.
    ratio = weight[:60].sum() / weight.sum()
    assert asked.stiffness == 0.04
    assert_allclose(asked.agreement, 0.01 * (1.0 if agreement_is_raised else ratio), rtol=5e-3)
    assert_allclose([asked.alpha, asked.slope], np.multiply([0.02, 0.03], ratio), rtol=5e-3)
