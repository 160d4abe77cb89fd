"""Structure by itself: what the search finds, what it says of it, and that nothing else matters."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.base import clone
from sklearn.linear_model import LinearRegression

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_three_input
from skanfis.learning import VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.search import tuning
from skanfis.search.candidates import KINDS
from skanfis.search.judging import dealt_rows, judging_folds
from skanfis.search.search import StructureSearch
from skanfis.training.settings import structure_request

pytestmark = pytest.mark.theory


def inputs(rng, n_rows=400, n_inputs=3):
    return rng.uniform(-1.0, 1.0, (n_rows, n_inputs))


def chosen(model):
    (told,) = (one for one in model.structures_ if one["chosen"])
    return told


@pytest.mark.parametrize("width", [0.3, 1.5, 2.5])
def test_the_two_rules_that_made_the_data_are_found(rng, width):
    """Narrow terms, and wide ones that no bound on where neighbours cross would allow."""
    x = inputs(rng, 400, 1)
    strengths = np.exp(-0.5 * ((x - [-0.6, 0.8]) / width) ** 2)
    y = np.sum(strengths * (np.array([1.0, 3.0]) + x * [4.0, -5.0]), axis=1) / strengths.sum(axis=1)
    model = ANFISRegressor(partition="grid", simplicity=0).fit(x, y)
    assert model.n_rules_ == 2
    assert_allclose(model.predict(x), y, atol=1e-5)


@pytest.mark.parametrize("n_rows", [150, 2000])
def test_noise_alone_gets_a_single_rule(rng, n_rows):
    """Nine times of ten (``benchmarks structure``, 36 of 40); here four of five at least."""
    draws = [(inputs(rng, n_rows, 8), rng.standard_normal(n_rows)) for _ in range(5)]
    assert sum(ANFISRegressor().fit(*draw).n_rules_ == 1 for draw in draws) >= 4


@pytest.mark.parametrize("partition", KINDS)
def test_more_noise_never_gives_more_rules(rng, partition):
    X = inputs(rng, 100, 2)
    truth, noise = np.sin(3.0 * X[:, 0]) + X[:, 1] ** 2, rng.standard_normal(100)
    model = ANFISRegressor(partition=partition, max_rules=4)
    assert model.fit(X, truth + 0.02 * noise).n_rules_ > model.fit(X, truth + 30 * noise).n_rules_


def test_a_replicated_table_is_fitted_as_if_its_inputs_were_a_hair_apart(rng):
    levels = np.repeat(np.linspace(-1.0, 1.0, 21), 40)[:, None]
    y = np.tanh(3.0 * levels[:, 0]) + 0.2 * rng.standard_normal(840)
    jittered = levels + 1e-9 * rng.standard_normal(levels.shape)
    check = np.linspace(-1.0, 1.0, 200)[:, None]
    errors = [
        np.sqrt(np.mean((m.predict(check) - np.tanh(3.0 * check[:, 0])) ** 2))
        for m in (ANFISRegressor(simplicity=0).fit(X, y) for X in (levels, jittered))
    ]
    assert errors[0] < 0.03
    assert_allclose(errors[0], errors[1], rtol=0.05)


def test_terms_of_a_grid_mean_something(rng):
    """Of an input with a long tail, one with gaps, and whole numbers."""
    clusters = rng.choice([-4.0, 0.0, 3.0], 300) + 0.2 * rng.standard_normal(300)
    X = np.column_stack([rng.lognormal(size=300), clusters, rng.integers(0, 5, 300)])
    scale = X.std(axis=0)
    y = np.tanh(2.0 * X[:, 0] / scale[0]) + 0.5 * np.sin(2.0 * X[:, 1] / scale[1])
    y += 0.5 * np.abs(X[:, 2] - 2.0) + 0.1 * rng.standard_normal(300)
    terms = ANFISRegressor(partition="grid").fit(X, y).memberships_
    assert {term["input"] for term in terms} == {"x0", "x1", "x2"}
    for j in range(3):
        own = [term for term in terms if term["input"] == f"x{j}"]
        own.sort(key=lambda term: term["center"])
        truth = [gaussian(X[:, j], term).max() for term in own]
        assert all(t > 0.5 for t in truth)
        for left, right in pairwise(own):
            axis = np.linspace(left["center"], right["center"], 501)
            assert np.minimum(gaussian(axis, left), gaussian(axis, right)).max() < 0.9


def gaussian(x, term):
    return np.exp(-0.5 * ((x - term["center"]) / term["width"]) ** 2)


@pytest.mark.parametrize("n_rows", [2, 3, 40])
def test_a_target_that_is_constant_or_exactly_a_line_is_a_rule(rng, n_rows):
    X = inputs(rng, n_rows, 1)
    assert_allclose(ANFISRegressor().fit(X, np.full(n_rows, 0.64)).predict(X), 0.64)
    line = ANFISRegressor().fit(X, 2.0 * X[:, 0] + 1.0)
    assert line.n_rules_ == 1
    assert_allclose(line.predict(0.5 * X), X[:, 0] + 1.0, atol=2e-2)


@pytest.mark.parametrize("seed", range(4))
def test_an_exact_plane_is_one_rule_where_judges_lie_beyond_the_target(seed):
    """Its predictions are not held near the target: one without noise is followed further."""
    rng = np.random.default_rng(seed)
    X = np.column_stack([rng.uniform(-1.0, 1.0, 60), rng.normal(size=60)])
    model = ANFISRegressor(max_rules=2).fit(X, 2.0 * X[:, 0] - X[:, 1])
    assert model.n_rules_ == 1
    assert model.structures_[0]["expected_error"] < 1e-9


@pytest.mark.floors
def test_noise_free_data_get_next_to_no_penalty():
    X, y = make_jang_three_input()
    model = ANFISRegressor(partition="grid", solver=VariableProjection(tol=1e-2)).fit(X, y)
    assert model.alpha_ <= 1e-4
    # More rules pass through every one of 216 rows, and are not told between them.
    assert model.score(X, y) > 0.9995


def runs(n_runs=6, seed=0):
    """Runs of an instrument: each has a bias of its own, which a wiggle in the run's input fits."""
    g = np.random.default_rng(seed)
    run = np.repeat(np.arange(n_runs), 90)
    temperature = g.uniform(-1, 1, n_runs)[run] + 0.02 * g.normal(size=run.size)
    rate = g.uniform(-1, 1, run.size)
    y = np.sin(2 * rate) + 0.3 * g.normal(size=n_runs)[run] + 0.02 * g.normal(size=run.size)
    return np.column_stack([temperature, rate]), y, run


def test_runs_that_differ_by_chance_are_not_modelled_where_they_are_given():
    X, y, run = runs()
    model = ANFISRegressor(max_rules=8)
    alone, grouped = (clone(model).fit(X, y, groups=groups) for groups in (None, run))
    inputs = [[term["input"] for term in model.memberships_] for model in (alone, grouped)]
    assert inputs[0].count("x0") > inputs[1].count("x0") == 0
    # It knows how well it will do on new runs, as far as six runs tell; the other has no idea.
    X_new, y_new, _ = runs(40, seed=1)
    for model, least, most in ((grouped, 0.5, 1.5), (alone, 0.0, 0.5)):
        error = np.sqrt(np.mean((model.predict(X_new) - y_new) ** 2)) / y.std()
        assert least * error <= chosen(model)["expected_error"] < most * error


def test_without_iterations_the_terms_of_a_searched_structure_stay_at_their_start(rng):
    X = inputs(rng, 100)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(100)
    model = ANFISRegressor(partition="grid", max_iter=0).fit(X, y)
    assert model.n_rules_ > 1
    assert model.memberships_ == model.initial_memberships_


@pytest.mark.parametrize(
    ("starts", "n_rows", "most"),
    [((0.0, 10.0, 50.0), 30, 0.3), (np.linspace(0.0, 50.0, 25), 40, 0.01)],
)
def test_between_runs_rules_by_time_and_temperature_are_not_wild(rng, starts, n_rows, most):
    """Instruments that warm up by 6 degrees, each from its own; three say next to nothing."""
    time = np.tile(np.linspace(0.0, 1.0, n_rows), len(starts))
    warmth = 6.0 * (1.0 - np.exp(-3.0 * time))
    temperature = np.repeat(starts, n_rows) + warmth + 0.05 * rng.standard_normal(time.size)

    def truth(X):
        return 0.01 * (X[:, 1] - 20.0) ** 2 + np.exp(-4.0 * X[:, 0])

    X = np.column_stack([time, temperature])
    y = truth(X) + 1e-4 * rng.standard_normal(time.size)
    fresh = rng.uniform(X.min(axis=0), X.max(axis=0), (2000, 2))
    error = ANFISRegressor().fit(X, y).predict(fresh) - truth(fresh)
    assert np.sqrt(np.mean(error**2)) < most * y.std()


def test_every_row_is_searched_where_one_group_alone_is_judged(rng):
    """A run at rest lies in the range of a ramp; the ramp is beyond that of the run at rest."""
    X = inputs(rng, 110, 2)
    X[50:] *= [0.0, 0.5]
    rows = StandardisedData.of(X, X[:, :1], groups=np.repeat([0.0, 1.0], [50, 60]))
    search = StructureSearch(rows, structure_request(ANFISRegressor(), ["a", "b"]), 0.05)
    assert [fold.rows.n_rows for fold in search.folds] == [50]
    assert search.trials.rows.n_rows == 110


def test_the_mean_that_rules_must_beat_is_by_weight(rng):
    X, weight = inputs(rng, 60, 2), rng.uniform(1.0, 9.0, 60)
    rows = StandardisedData.of(X, X[:, :1] + np.log(weight)[:, None], weight)
    search = StructureSearch(rows, structure_request(ANFISRegressor(), ["a", "b"]), 0.05)
    rows, squares, judges = dealt_rows(rows), [], []
    for grow, rest in judging_folds(rows)[0]:
        mean = np.average(rows.y[grow, 0], weights=rows.weights[grow])
        squares.append((rows.y[rest, 0] - mean) ** 2)
        judges.append(rows.weights[rest])
    expected = np.average(np.concatenate(squares), weights=np.concatenate(judges))
    assert_allclose(search._variance(), expected, rtol=1e-12)


# ----------------------------------------------------------------------------- what is said of it


def bumps(rng, n_rows=100):
    X = inputs(rng, n_rows)
    return X, np.sin(3.0 * X[:, 0]) + X[:, 1] * X[:, 2] + 0.1 * rng.standard_normal(n_rows)


@pytest.mark.parametrize("n_groups", [None, 7])
def test_expected_error_of_the_linear_model_is_that_of_its_folds(rng, n_groups):
    """Of planes through the other folds, times what more rows are worth: (1 + k / n), k = 4."""
    X, y = bumps(rng, 80)
    groups = None if n_groups is None else rng.integers(0, n_groups, 80)
    nothing = {"agreement": 0.0, "alpha": 0.0, "solver": VariableProjection(stiffness=0.0)}
    model = ANFISRegressor(partition="grid", max_rules=1, **nothing).fit(X, y, groups=groups)
    (told,) = [one for one in model.structures_ if one["structure"] == "one rule"]
    rows = dealt_rows(StandardisedData.of(X, y[:, None], groups=groups))
    Z, t, squares, weights = rows.X, rows.y[:, 0], [], []
    for grow, rest in judging_folds(rows)[0]:
        plane = LinearRegression().fit(Z[grow], t[grow])
        squares.append((plane.predict(Z[rest]) - t[rest]) ** 2)
        weights.append(grow.size)
    factor = (1.0 + 4.0 / 80.0) / (1.0 + 4.0 / weights[0])
    error = np.sqrt(factor * np.mean(np.concatenate(squares)))
    assert_allclose(told["expected_error"], error, rtol=1e-3)


@pytest.mark.parametrize("settings", [{"solver": "lse"}, {"max_iter": 0}])
def test_where_premises_stay_the_search_moves_none(rng, monkeypatch, few_candidates, settings):
    """And the model has the slopes of the structure that was judged, no more."""
    monkeypatch.setattr(tuning, "varpro", None)  # so that no run of it ends well
    model = ANFISRegressor(max_rules=4, **settings).fit(*bumps(rng))
    assert model.readability_.reading_cost == chosen(model)["reading_cost"]


def test_candidates_are_listed_from_the_best(rng, few_candidates):
    """Of one kind alone: test_every_kind."""
    model = ANFISRegressor().fit(*bumps(rng, 60))
    found = model.structures_
    assert [one["expected_error"] for one in found] == sorted(o["expected_error"] for o in found)
    assert {one["kind"] for one in found} == {"one rule", *KINDS}
    assert chosen(model)["rules"] == model.n_rules_
    assert len({one["structure"] for one in found}) == len(found)
    for one in found:
        n_conditions = 3 * one["rules"]
        if one["kind"] in ("scattered", "tree"):
            words = "scattered rules" if one["kind"] == "scattered" else "rules"
            assert f"{one['rules']} {words}" in one["structure"]
            assert one["n_mfs"] is None
            n_conditions = one["rules"] ** 2
        elif one["n_mfs"] is not None:
            assert np.prod(one["n_mfs"]) == one["rules"]
            n_conditions = one["rules"] * sum(count > 1 for count in one["n_mfs"])
        # The dense one says everything; the other less.
        most = n_conditions + 4 * one["rules"]
        assert one["reading_cost"] <= most
        if "slopes" in one["structure"]:
            assert one["reading_cost"] < most
        elif one["kind"] == "grid":
            assert one["reading_cost"] == most


def test_slopes_are_left_out_in_two_steps(rng):
    """Where the fewest cost too much, those are left that the evidence would rather not have."""
    X = rng.normal(size=(100, 12))
    y = X @ np.linspace(0.0, 1.0, 12) + 2.0 * rng.normal(size=100)
    model = ANFISRegressor(max_rules=1).fit(X, y)
    costs = {one["structure"]: one["reading_cost"] for one in model.structures_}
    fewer, fewest = (costs[f"one rule, {much} slopes"] for much in ("fewer", "fewest"))
    assert costs["one rule"] == 13 > fewer > fewest
    assert chosen(model)["structure"] == "one rule, fewer slopes"


def test_what_is_chosen_costs_least_of_what_is_within_the_tolerance(rng, few_candidates):
    X, y = bumps(rng)
    model = ANFISRegressor(max_rules=4)
    fitted = {s: clone(model).set_params(simplicity=s).fit(X, y) for s in (0.0, 0.05, 0.5)}
    told = {s: chosen(model) for s, model in fitted.items()}
    costs = [one["reading_cost"] for one in told.values()]
    assert costs == sorted(costs, reverse=True)
    assert len(set(costs)) > 1
    for s, one in told.items():
        squares = one["expected_error"] ** 2
        least = told[0.0]["expected_error"] ** 2
        # The signal is clear: of the target's variance, about 1, more is explained than left.
        most = least + ((1.0 + s) ** 2 - 1.0) * min(least, 1.0 - least)
        assert squares <= most * (1.0 + 1e-9)
        cheaper = [o for o in fitted[s].structures_ if o["reading_cost"] < one["reading_cost"]]
        assert all(o["expected_error"] ** 2 > most or not o["rules_beat_mean"] for o in cheaper)


@pytest.mark.parametrize("seed", range(2))
def test_a_parabola_is_not_told_by_rules_of_one_slope(seed):
    """Two rules far apart with a slope in common, blended over all rows, are one numeral less."""
    g = np.random.default_rng(seed)
    x = g.uniform(-0.8, 1.3, (150, 1))
    model = ANFISRegressor().fit(x, x[:, 0] ** 2 + 0.2 * g.standard_normal(150))
    alone = model.consequents_ @ np.vstack([np.ones(150), x[:, 0]])
    strongest = alone[model.apply(x), np.arange(150)]
    # Else 1.2.
    assert np.std(strongest - model.predict(x)) < 0.7 * np.std(x[:, 0] ** 2)


# ------------------------------------------------------------------------------------ nothing else


@pytest.mark.parametrize("partition", ["grid", "scattered"])
def test_of_columns_that_are_equal_their_order_says_nothing(few_candidates, partition):
    X, y = bumps(np.random.default_rng(0))
    plain = ANFISRegressor(partition=partition, max_rules=4)
    twice = X[:, [0, 0, 1, 2, 2]]
    turned = twice[:, ::-1].copy()
    found, other = (clone(plain).fit(columns, y).predict(columns) for columns in (twice, turned))
    assert_allclose(other, found, atol=1e-5 * y.std())


@pytest.mark.parametrize("seed", range(2))
def test_the_share_of_an_outer_term_rises_to_the_end_of_the_axis(seed):
    """ "High" is a shoulder in what it decides, if not in its own membership."""
    rng = np.random.default_rng(seed)
    X = np.column_stack([rng.lognormal(size=400), rng.standard_normal((400, 2))])
    y = np.log(X[:, 0]) * np.tanh(2.0 * X[:, 1]) + 0.5 * X[:, 2] ** 2
    model = ANFISRegressor(partition="grid").fit(X, y + 0.1 * rng.standard_normal(400)).model_
    along = np.linspace(model.minimum, model.maximum, 200).T
    shares, antecedent = model.antecedent.strengths_and_shares(along)[1], model.antecedent
    assert antecedent.n_terms >= 4
    for j in np.unique(antecedent.term_inputs):
        own = np.flatnonzero(antecedent.term_inputs == j)
        low, *_, high = own[np.argsort(antecedent.term_places[own])]
        assert (np.diff(shares[low]) < 1e-3).all()
        assert (np.diff(shares[high]) > -1e-3).all()
