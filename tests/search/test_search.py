"""Structure by itself: what the search finds, and what its score means."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import LeaveOneOut, cross_val_predict

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_three_input
from skanfis.learning import VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.membership import Gaussian
from skanfis.search import search
from skanfis.search.candidates import Candidate, term_scores
from skanfis.search.trials import Trials

pytestmark = pytest.mark.theory


def inputs(rng, n_rows=400, n_inputs=3):
    return rng.uniform(-1.0, 1.0, (n_rows, n_inputs))


def terms_per_input(model, n_inputs=3):
    names = [term["input"] for term in model.memberships_]
    return [max(names.count(f"x{j}"), 1) for j in range(n_inputs)]


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_linear_truth_gets_next_to_a_linear_model(rng):
    # A criterion by error lets a rule more pass where it does no harm; the plane stays a plane.
    X = inputs(rng)
    y = X @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor().fit(X, y)
    assert model.n_rules_ == 1
    assert_allclose(
        model.consequents_[:, 1:], np.tile([1.0, -2.0, 0.5], (model.n_rules_, 1)), atol=0.1
    )
    X_new = inputs(rng)
    error = model.predict(X_new) - X_new @ [1.0, -2.0, 0.5]
    # Least squares with the four parameters of a plane is off by 0.1 (4 / 400)^(1/2).
    assert np.sqrt(np.mean(error**2)) < 2.5 * 0.01


def test_noise_alone_gets_a_single_rule(rng):
    assert ANFISRegressor().fit(inputs(rng), rng.standard_normal(400)).n_rules_ == 1


@pytest.mark.parametrize("seed", range(3))
def test_of_a_plane_in_as_many_inputs_as_rows_no_term_is_learnt(seed):
    """Of fifty inputs, one has luck with two terms on sixty rows."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((60, 50))
    y = X[:, :3].sum(axis=1) + 1.7 * rng.standard_normal(60)
    assert ANFISRegressor().fit(X, y).n_rules_ == 1


@pytest.mark.parametrize("which", [0, 2])
def test_only_the_input_that_bends_the_surface_gets_terms(which, rng):
    X = inputs(rng)
    y = np.tanh(4.0 * X[:, which]) + X @ [0.3, 0.2, -0.4] + 0.05 * rng.standard_normal(400)
    counts = terms_per_input(ANFISRegressor(partition="grid").fit(X, y))
    assert counts[which] > 1
    assert all(count == 1 for j, count in enumerate(counts) if j != which)


def test_constant_consequents_get_terms_where_linear_ones_need_none(rng):
    X = inputs(rng, n_inputs=1)
    y = X[:, 0] + 0.05 * rng.standard_normal(400)
    linear = ANFISRegressor().fit(X, y).n_rules_
    assert linear <= 2
    assert ANFISRegressor(order=0).fit(X, y).n_rules_ > linear


def test_expected_error_of_the_linear_model_is_that_of_rows_left_out(rng):
    X = inputs(rng, 80)
    y = X @ [1.0, -2.0, 0.5] + 0.3 * rng.standard_normal(80)
    model = ANFISRegressor(
        partition="grid", agreement=0.0, alpha=0.0, solver=VariableProjection(stiffness=0.0)
    ).fit(X, y)
    linear = next(c for c in model.structures_ if c["structure"] == "grid [1, 1, 1]")
    left_out = cross_val_predict(LinearRegression(), X, y, cv=LeaveOneOut())
    error = np.sqrt(np.mean((y - left_out) ** 2)) / y.std()
    assert_allclose(linear["expected_error"], error, rtol=1e-9)


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_expected_error_is_that_on_new_rows(rng):
    def surface(n):
        X = inputs(rng, n)
        return X, np.sin(3.0 * X[:, 0]) + X[:, 0] * X[:, 1] + 0.2 * rng.standard_normal(n)

    X, y = surface(500)
    model = ANFISRegressor().fit(X, y)
    X_new, y_new = surface(20_000)
    found = np.sqrt(np.mean((model.predict(X_new) - y_new) ** 2)) / y.std()
    # 500 rows tell a standard deviation to 3 %; twice that.
    assert_allclose(model.structures_[0]["expected_error"], found, rtol=0.06)


def test_what_is_given_is_not_searched_for(rng):
    X = inputs(rng, 100)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(100)
    model = ANFISRegressor(partition="grid", alpha=3e-5).fit(X, y)
    assert (model.alpha_, model.slope_alpha_) == (3e-5, 3e-5)
    assert {c["alpha"] for c in model.structures_} == {3e-5}
    assert len({c["stiffness"] for c in model.structures_}) > 1
    assert len({c["agreement"] for c in model.structures_}) > 1
    solver = VariableProjection(stiffness=0.01)
    model = ANFISRegressor(partition="grid", agreement=0.3, alpha=3e-5, solver=solver).fit(X, y)
    assert (model.agreement_, model.alpha_, model.stiffness_) == (0.3, 3e-5, 0.01)
    assert {c["stiffness"] for c in model.structures_} == {0.01}
    assert {c["agreement"] for c in model.structures_} == {0.3}


def test_grid_tries_no_scattered_rules(rng):
    X = inputs(rng, 100)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(100)
    tried = {
        c["structure"].split()[0] for c in ANFISRegressor(partition="grid").fit(X, y).structures_
    }
    assert tried == {"grid"}
    assert ANFISRegressor(n_mfs=2).fit(X, y).structures_ == []


KEYS = {
    "structure",
    "n_mfs",
    "expected_error",
    "log_evidence",
    "agreement",
    "alpha",
    "stiffness",
}


def test_log_evidence_is_that_of_a_linear_model_averaged_out(rng):
    # With agreement and alpha given, the linear model has no prior but on its slopes, alpha: the
    # data are normal with covariance sigma^2 (I + Z Z' / (n alpha)), sigma^2 at its best.
    X = inputs(rng, 100)
    y = X @ [1.0, -2.0, 0.5] + 0.3 * rng.standard_normal(100)
    scores = []
    z = (X - X.mean(axis=0)) / X.std(axis=0)
    t = (y - y.mean()) / y.std()
    for alpha in (1e-3, 1e-1):
        model = ANFISRegressor(partition="grid", agreement=0.1, alpha=alpha).fit(X, y)
        linear = next(c for c in model.structures_ if c["structure"] == "grid [1, 1, 1]")
        covariance = np.eye(100) + z @ z.T / (100 * alpha)
        sign, logarithm = np.linalg.slogdet(covariance)
        # The constant takes one row's worth.
        scores.append(
            [
                linear["log_evidence"],
                -0.5 * (logarithm + 99 * np.log(t @ np.linalg.solve(covariance, t))),
            ]
        )
        assert sign == 1.0
    found, expected = np.transpose(scores)
    assert_allclose(np.diff(found), np.diff(expected), rtol=1e-6)


def test_candidates_are_listed_from_the_best(rng):
    X = inputs(rng, 100)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(100)
    model = ANFISRegressor().fit(X, y)
    errors = [c["expected_error"] for c in model.structures_]
    assert errors == sorted(errors)
    assert all(set(c) == KEYS for c in model.structures_)


# The search over both goes through the one over grids.
@pytest.mark.parametrize("partition", ["auto", "fcm"])
def test_more_noise_never_gives_more_rules(rng, partition):
    X = inputs(rng, 200, 2)
    truth, noise = np.sin(3.0 * X[:, 0]) + X[:, 1] ** 2, rng.standard_normal(200)
    found = [
        ANFISRegressor(partition=partition).fit(X, truth + s * noise).n_rules_ for s in (0.02, 30.0)
    ]
    assert found == sorted(found, reverse=True)
    assert found[0] > 3
    assert found[-1] == 1


def test_a_replicated_table_is_fitted_as_if_its_inputs_were_a_hair_apart(rng):
    levels = np.repeat(np.linspace(-1.0, 1.0, 21), 40)[:, None]
    y = np.tanh(3.0 * levels[:, 0]) + 0.2 * rng.standard_normal(840)
    jittered = levels + 1e-9 * rng.standard_normal(levels.shape)
    check = np.linspace(-1.0, 1.0, 200)[:, None]
    errors = [
        np.sqrt(np.mean((m.predict(check) - np.tanh(3.0 * check[:, 0])) ** 2))
        for m in (ANFISRegressor().fit(X, y) for X in (levels, jittered))
    ]
    assert errors[0] < 0.03
    assert_allclose(errors[0], errors[1], rtol=0.05)


def test_of_many_inputs_those_that_matter_are_found(rng, monkeypatch):
    X = inputs(rng, 300, 12)
    y = np.sin(3.0 * X[:, 7]) + np.abs(X[:, 2]) + 0.05 * rng.standard_normal(300)
    rounds, promising = [], Trials.promising

    def noting(self, candidates):
        rounds.append(promising(self, candidates))
        return rounds[-1]

    monkeypatch.setattr(Trials, "promising", noting)
    model = ANFISRegressor(partition="grid").fit(X, y)
    counts = terms_per_input(model, 12)
    assert [j for j, count in enumerate(counts) if count > 1] == [2, 7]
    # None is given up for what it promises in a round: beside others' terms it may do better.
    for tried in rounds[:3]:
        counts = np.array([candidate.counts for candidate in tried])
        grown = np.argmax(counts - counts.min(axis=0), axis=1)
        assert_array_equal(np.sort(grown), np.arange(12))


def test_screening_is_by_correlations_of_weighted_rows(rng):
    # The formula term by term, the share as that of two Gaussians that cross at the overlap.
    X, every = inputs(rng, 150, 18), np.arange(18)
    y = np.sin(3.0 * X[:, [0]]) + X[:, [5]] * X[:, [3]] + 0.3 * rng.standard_normal((150, 1))
    # Weights that go with the inputs: the mean of a share is far from its plain mean.
    rows = StandardisedData.of(X, y, np.ceil(np.exp(X.sum(axis=1))))
    found = search.StructureSearch(rows, [Gaussian] * 18, 1, every, every, 0, {})
    linear = Candidate((1,) * 18)
    z, s = found.trials.sample.X, found.trials.sample.sample_weight
    basis = np.column_stack([np.ones(len(z)), z])
    coefficients = found.trials.tuned(linear).evaluation.coefficients
    r = found.trials.sample.y[:, 0] - basis @ coefficients[:, 0]
    statistic = []
    for j in every:
        centers = found.trials.spacing.centers(j, 2)
        width = 0.5 * (centers[1] - centers[0]) / np.sqrt(-2.0 * np.log(0.6))
        mu = np.exp(-0.5 * ((z[:, [j]] - centers) / width) ** 2)
        w = mu[:, 1] / mu.sum(axis=1)
        w -= np.average(w, weights=s)
        parts = [(s * w * b) @ r / np.sqrt(s @ (w * b) ** 2) for b in basis.T]
        statistic.append(np.sum(np.square(parts)))
    centers = np.array([found.trials.spacing.centers(j, 2) for j in every])
    asked = term_scores(found.trials.tuned(linear), every, centers)
    assert_allclose(asked, statistic, rtol=1e-9)
    found._screen(linear)
    assert_array_equal(found.inputs, np.argsort(statistic)[::-1][: search._SCREENED])
    assert_array_equal(found.trials.rule_bases.inputs, found.inputs)


def test_no_more_terms_than_values(rng):
    X = np.column_stack([rng.integers(0, 2, 200), rng.integers(0, 3, 200), rng.uniform(size=200)])
    y = np.sin(9.0 * X[:, 2]) + 2.0 * X[:, 0] * X[:, 1] ** 2 + 0.05 * rng.standard_normal(200)
    model = ANFISRegressor(partition="grid", order=0).fit(X, y)
    tried = [
        [int(c) for c in line["structure"].removeprefix("grid [").removesuffix("]").split(",")]
        for line in model.structures_
    ]
    assert np.max(tried, axis=0)[:2].tolist() == [2, 3]


DRAWS = {
    "lognormal": lambda g, shape: g.lognormal(size=shape),
    "clusters": lambda g, shape: (
        g.choice([-4.0, 0.0, 3.0], size=shape) + 0.2 * g.standard_normal(shape)
    ),
    "integers": lambda g, shape: g.integers(0, 5, size=shape).astype(float),
}


@pytest.mark.parametrize("draw", DRAWS)
def test_terms_of_a_default_fit_mean_something(rng, draw):
    X = DRAWS[draw](rng, (300, 3))
    scale = X.std(axis=0)
    y = np.tanh(2.0 * X[:, 0] / scale[0]) + 0.5 * np.sin(2.0 * X[:, 1] / scale[1])
    y += 0.1 * rng.standard_normal(300)
    model = ANFISRegressor().fit(X, y)
    terms = model.memberships_
    assert len(terms) > 1
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


def test_too_few_rows_for_anything_but_a_line(rng):
    X = np.array([[0.0], [1.0], [2.0], [3.0]])
    model = ANFISRegressor().fit(X, 2.0 * X[:, 0] + 1.0)
    assert_allclose(model.predict([[0.5], [2.5]]), [2.0, 6.0], rtol=1e-2)


@pytest.mark.floors
def test_noise_free_data_get_next_to_no_penalty():
    X, y = make_jang_three_input()
    model = ANFISRegressor(partition="grid", solver=VariableProjection(tol=1e-2)).fit(X, y)
    assert model.alpha_ <= 1e-4
    # More rules pass through every one of 216 rows, and are not told between them.
    assert model.score(X, y) > 0.9995


def runs(n_runs=6, n_rows=90, seed=0):
    """Runs of an instrument: each has a bias of its own, which a wiggle in the run's input fits."""
    g = np.random.default_rng(seed)
    run = np.repeat(np.arange(n_runs), n_rows)
    temperature = g.uniform(-1, 1, n_runs)[run] + 0.02 * g.normal(size=run.size)
    rate = g.uniform(-1, 1, run.size)
    y = np.sin(2 * rate) + 0.3 * g.normal(size=n_runs)[run] + 0.02 * g.normal(size=run.size)
    return np.column_stack([temperature, rate]), y, run


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_runs_that_differ_by_chance_are_not_modelled_where_they_are_given():
    X, y, run = runs()
    alone, grouped = (ANFISRegressor().fit(X, y, groups=groups) for groups in (None, run))
    on_temperature = [
        [term["input"] for term in model.memberships_].count("x0") for model in (alone, grouped)
    ]
    assert on_temperature[0] > on_temperature[1] == 0
    # It knows how well it will do on new runs, as far as six runs tell; the other has no idea.
    X_new, y_new, _ = runs(40, seed=1)
    errors = []
    for model in (alone, grouped):
        errors.append(np.sqrt(np.mean((model.predict(X_new) - y_new) ** 2)) / y.std())
    assert_allclose(grouped.structures_[0]["held_out_error"], errors[1], rtol=0.5)
    assert alone.structures_[0]["expected_error"] < 0.5 * errors[0]


def test_score_of_groups_is_that_of_trainings_without_them():
    X, y, run = runs(5)
    model = ANFISRegressor(partition="grid", alpha=1e-9).fit(X, y, groups=run)
    linear = next(s for s in model.structures_ if s["structure"] == "grid [1, 1]")
    squares = []
    for held in range(5):
        kept = run != held
        low, high = X[kept].min(axis=0), X[kept].max(axis=0)
        inside = ~kept & ((low <= X) & (high >= X)).all(axis=1)
        plane = LinearRegression().fit(X[kept], y[kept])
        if inside.any():
            squares.append((plane.predict(X[inside]) - y[inside]) ** 2)
    expected = np.sqrt(np.mean(np.concatenate(squares))) / y.std()
    assert_allclose(linear["held_out_error"], expected, rtol=1e-3)
    # What decides is what is listed first, not the error that is expected of rows like these.
    held_out = [s["held_out_error"] for s in model.structures_]
    assert held_out == sorted(held_out)


def test_a_single_group_says_nothing():
    X, y, run = runs(2, 40)
    grid = ANFISRegressor(partition="grid")
    one, none = (clone(grid).fit(X, y, groups=g) for g in (np.zeros(run.size), None))
    assert_array_equal(one.predict(X), none.predict(X))


def test_without_iterations_the_terms_of_a_searched_structure_stay_at_their_start(rng):
    X = inputs(rng, 100)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(100)
    model = ANFISRegressor(partition="grid", max_iter=0).fit(X, y)
    assert model.n_rules_ > 1
    assert model.memberships_ == model.initial_memberships_
