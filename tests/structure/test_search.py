"""Structure by itself: what the search finds, and what its score means."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.linear_model import LinearRegression

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_three_input
from skanfis.membership import Gaussian
from skanfis.rows import Rows
from skanfis.training import automatic

QUIET = {"warn_out_of_bounds": False}


def inputs(rng, n_rows=400, n_inputs=3):
    return rng.uniform(-1.0, 1.0, (n_rows, n_inputs))


def terms_per_input(model, n_inputs=3):
    names = [term["input"] for term in model.memberships_]
    return [max(names.count(f"x{j}"), 1) for j in range(n_inputs)]


def test_linear_truth_gets_a_linear_model(rng):
    X = inputs(rng)
    y = X @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor().fit(X, y)
    assert model.n_rules_ == 1
    assert_allclose(model.consequents_[0, 1:], [1.0, -2.0, 0.5], atol=0.05)


def test_noise_alone_gets_a_single_rule(rng):
    assert ANFISRegressor().fit(inputs(rng), rng.standard_normal(400)).n_rules_ == 1


@pytest.mark.parametrize("which", [0, 1, 2])
def test_only_the_input_that_bends_the_surface_gets_terms(which, rng):
    X = inputs(rng)
    y = np.tanh(4.0 * X[:, which]) + X @ [0.3, 0.2, -0.4] + 0.05 * rng.standard_normal(400)
    counts = terms_per_input(ANFISRegressor(partition="grid").fit(X, y))
    assert counts[which] > 1
    assert all(count == 1 for j, count in enumerate(counts) if j != which)


def test_constant_consequents_get_terms_where_linear_ones_need_none(rng):
    X = inputs(rng, n_inputs=1)
    y = X[:, 0] + 0.05 * rng.standard_normal(400)
    assert ANFISRegressor().fit(X, y).n_rules_ == 1
    assert ANFISRegressor(order=0).fit(X, y).n_rules_ > 1


def test_expected_error_of_the_linear_model_is_the_final_prediction_error(rng):
    X = inputs(rng)
    y = X @ [1.0, -2.0, 0.5] + 0.3 * rng.standard_normal(400)
    model = ANFISRegressor(alpha=0.0, stiffness=0.0).fit(X, y)
    linear = next(c for c in model.structures_ if c["structure"] == "grid [1, 1, 1]")
    design = np.column_stack([np.ones(400), X])
    residual = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    error = np.sqrt(np.mean(residual**2) * (1 + 4 / 400) / (1 - 4 / 400)) / y.std()
    assert_allclose(linear["expected_error"], error, rtol=1e-9)


def test_expected_error_is_that_on_new_rows(rng):
    def surface(n):
        X = inputs(rng, n)
        return X, np.sin(3.0 * X[:, 0]) + X[:, 0] * X[:, 1] + 0.2 * rng.standard_normal(n)

    X, y = surface(500)
    model = ANFISRegressor(**QUIET).fit(X, y)
    X_new, y_new = surface(20_000)
    found = np.sqrt(np.mean((model.predict(X_new) - y_new) ** 2)) / y.std()
    # 500 rows tell a standard deviation to 3 %; twice that.
    assert_allclose(model.structures_[0]["expected_error"], found, rtol=0.06)


def test_what_is_given_is_not_searched_for(rng):
    X = inputs(rng)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor(alpha=3e-5).fit(X, y)
    assert model.alpha_ == 3e-5
    assert {c["alpha"] for c in model.structures_} == {3e-5}
    assert len({c["stiffness"] for c in model.structures_}) > 1
    model = ANFISRegressor(alpha=3e-5, stiffness=0.01).fit(X, y)
    assert (model.alpha_, model.stiffness_) == (3e-5, 0.01)
    assert {c["stiffness"] for c in model.structures_} == {0.01}


def test_grid_tries_no_scattered_rules(rng):
    X = inputs(rng)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(400)
    tried = {
        c["structure"].split()[0] for c in ANFISRegressor(partition="grid").fit(X, y).structures_
    }
    assert tried == {"grid"}
    assert ANFISRegressor(n_mfs=2).fit(X, y).structures_ == []


def test_candidates_are_listed_from_the_best(rng):
    X = inputs(rng)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor().fit(X, y)
    errors = [c["expected_error"] for c in model.structures_]
    assert errors == sorted(errors)
    chosen = [
        c["expected_error"]
        for c in model.structures_
        if (c["alpha"], c["stiffness"]) == (model.alpha_, model.stiffness_)
    ]
    assert min(chosen) <= 1.01 * errors[0]


def test_repeated_rows_are_no_more_evidence_than_one(rng):
    X = inputs(rng, 120)
    y = np.sin(3.0 * X[:, 0]) + 0.5 * rng.standard_normal(120)
    once, often = ANFISRegressor(**QUIET), ANFISRegressor(**QUIET)
    once.fit(X, y)
    often.fit(np.tile(X, (10, 1)), np.tile(y, 10))
    assert [c["structure"] for c in once.structures_] == [c["structure"] for c in often.structures_]
    assert_allclose(once.predict(X), often.predict(X), atol=1e-7)


def test_many_rows_are_represented_by_few(rng, monkeypatch):
    X = inputs(rng, 1500)
    y = np.sin(3.0 * X[:, 0]) + 0.1 * rng.standard_normal(1500)
    seen = []
    trained = automatic.SeparableProblem
    monkeypatch.setattr(
        automatic,
        "SeparableProblem",
        lambda rows, *args, **kwargs: seen.append(rows.n_rows) or trained(rows, *args, **kwargs),
    )
    ANFISRegressor().fit(X, y)
    assert set(seen) == {automatic._MOST_ROWS}


def test_wide_data_keep_the_best_inputs_only(rng, monkeypatch):
    X = inputs(rng, 300, 12)
    y = np.sin(3.0 * X[:, 7]) + np.abs(X[:, 2]) + 0.05 * rng.standard_normal(300)
    monkeypatch.setattr(automatic, "_MOST_GROWING", 3)
    model = ANFISRegressor(partition="grid", alpha=1e-6, stiffness=1e-5).fit(X, y)
    counts = terms_per_input(model, 12)
    assert [j for j, count in enumerate(counts) if count > 1] == [2, 7]
    # 1 linear model, 12 of one term more, then 3 in every round
    assert (len(model.structures_) - 1 - 12) % 3 == 0


def test_too_few_rows_for_anything_but_a_line(rng):
    X = np.array([[0.0], [1.0], [2.0], [3.0]])
    model = ANFISRegressor(**QUIET).fit(X, 2.0 * X[:, 0] + 1.0)
    assert_allclose(model.predict([[0.5], [2.5]]), [2.0, 6.0], rtol=1e-2)


def test_noise_free_data_get_next_to_no_ridge():
    X, y = make_jang_three_input()
    model = ANFISRegressor().fit(X, y)
    assert model.alpha_ <= 1e-8
    assert model.score(X, y) > 0.9999
    assert_array_equal(model.predict(X), ANFISRegressor().fit(X, y).predict(X))


@pytest.mark.parametrize(
    ("scores", "chosen"),
    [
        # The stiffest of those that are as good as the best ...
        ([0.5, 0.4, 0.3001, 0.3, 0.302, 0.5], 4),
        # ... and a loose one only where it is much better.
        ([0.300, 0.301, 0.305, 0.4, 0.5, 0.6], 2),
        ([0.300, 0.301, 0.320, 0.4, 0.5, 0.6], 1),
        ([0.100, 0.300, 0.305, 0.4, 0.5, 0.6], 0),
    ],
)
def test_the_stiffest_level_that_is_as_good_is_taken(rng, scores, chosen):
    X = inputs(rng)
    rows = Rows.standardised(X, X[:, :1] ** 2)
    every = np.arange(X.shape[1])
    search = automatic.StructureSearch(
        rows, [Gaussian] * 3, 1, every, every, len(X), 0, None, None, 0.6
    )
    start = automatic.Candidate((2, 1, 1), None, 1)
    for level, score in enumerate(scores):
        search.scores[automatic.replace(start, level=level)] = score
    assert search._tune(start).level == chosen


def runs(n_runs=6, n_rows=120, seed=0):
    """Runs of an instrument: each has a bias of its own, which a wiggle in the run's input fits."""
    g = np.random.default_rng(seed)
    run = np.repeat(np.arange(n_runs), n_rows)
    temperature = g.uniform(-1, 1, n_runs)[run] + 0.02 * g.normal(size=run.size)
    rate = g.uniform(-1, 1, run.size)
    y = np.sin(2 * rate) + 0.3 * g.normal(size=n_runs)[run] + 0.02 * g.normal(size=run.size)
    return np.column_stack([temperature, rate]), y, run


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
        model.set_params(warn_out_of_bounds=False)
        errors.append(np.sqrt(np.mean((model.predict(X_new) - y_new) ** 2)) / y.std())
    assert_allclose(grouped.structures_[0]["expected_error"], errors[1], rtol=0.5)
    assert alone.structures_[0]["expected_error"] < 0.5 * errors[0]


def test_score_of_groups_is_that_of_trainings_without_them():
    X, y, run = runs(5)
    model = ANFISRegressor(n_mfs="auto", partition="grid", alpha=1e-6, stiffness=1e-5)
    model.fit(X, y, groups=run)
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
    assert_allclose(linear["expected_error"], expected, rtol=1e-3)


def test_a_single_group_says_nothing():
    X, y, run = runs(3)
    one, none = (ANFISRegressor().fit(X, y, groups=g) for g in (np.zeros(run.size), None))
    assert_array_equal(one.predict(X), none.predict(X))
