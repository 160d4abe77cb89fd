"""What candidates are worth: expected errors, rows beyond the range, places between rows, gaps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian
from skanfis.search import trials
from skanfis.search.candidates import Candidate
from skanfis.search.trials import Trials

from .. import oracles

pytestmark = pytest.mark.theory


def inputs(rng, n_rows=400, n_inputs=3):
    return rng.uniform(-1.0, 1.0, (n_rows, n_inputs))


def search_of(X, y, sample_weight=None):
    used = np.arange(X.shape[1])
    rows = StandardisedData.of(X, y.reshape(len(X), -1), sample_weight)
    return Trials(rows, [Gaussian] * used.size, 1, used, used, 0, {})


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


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("consequent_inputs", [[0, 1], [1]])
def test_rows_beyond_the_range_count_at_its_edge(monkeypatch, weighted, consequent_inputs):
    monkeypatch.setattr(trials, "BLOCK_ROWS", 7)
    g = np.random.default_rng(4)
    rows, used = oracles.bumpy_rows(g, 200, 2, 2, weighted), np.array(consequent_inputs)
    antecedent = oracles.random_grid(g, [Gaussian, Bell], [3, 2])
    problem = SeparableProblem(rows, antecedent, 1, Penalty(alpha=1e-3), consequent_inputs=used)
    evaluation = problem.evaluate(antecedent.parameters)
    # On either side of the box of every input, and in it.
    low, high = rows.inputs.minimum, rows.inputs.maximum
    X = low + (high - low) * g.uniform(-0.5, 1.5, (100, 2))
    weight = g.uniform(0.5, 2.0, 100) if weighted else None
    rest = StandardisedData(X, g.normal(size=(100, 2)), weight, rows.inputs, rows.targets)
    at_edge = rest.inputs.apply(np.clip(X, low, high).T, np.empty((2, 100)))
    design = oracles.dense_design(antecedent, antecedent.parameters, at_edge, 1, used)
    target = (rest.y - rows.targets.offset) / rows.targets.scale
    squares = ((target - design @ evaluation.coefficients) ** 2).sum(axis=1)
    expected = np.average(squares, weights=weight)
    assert_allclose(trials.held_out_loss(rest, used, evaluation), expected, rtol=1e-9)


def test_a_search_leaves_no_term_in_a_gap():
    """A wave, and far from it a plateau."""
    rng = np.random.default_rng(0)
    gap = rng.uniform(2, 20)
    x = np.r_[rng.uniform(0, 1, 60), 1 + gap + rng.uniform(0, 1, rng.integers(1, 20))]
    y = np.sin(rng.uniform(2, 9) * x) * (x < 2) + rng.normal() * (x > 2)
    y += 0.01 * rng.normal(size=x.size)
    terms = ANFISRegressor().fit(x[:, None], y).memberships_
    assert all(np.abs((x - t["center"]) / t["width"]).min() < np.sqrt(2 * np.log(2)) for t in terms)


THREE = (0.0, 10.0, 50.0)


def rows_of(X, y, sample_weight=None):
    return StandardisedData.of(X, y[:, None], sample_weight)


def three_runs(rng, temperatures):
    """Time, temperature and target of instruments that warm up by 6 degrees, each from its own."""
    time = np.tile(np.linspace(0.0, 1.0, 60), len(temperatures))
    start = np.repeat(temperatures, 60)
    temperature = start + 6.0 * (1.0 - np.exp(-3.0 * time)) + 0.05 * rng.standard_normal(time.size)
    truth = 0.01 * (temperature - 20.0) ** 2 + np.exp(-4.0 * time)
    return np.column_stack([time, temperature]), truth + 1e-4 * rng.standard_normal(time.size)


def test_leverage_is_that_of_the_dense_design(rng):
    X, y = three_runs(rng, THREE)
    found = search_of(X, y)
    tuned, places = found.tuned(Candidate((3, 3))), found.places

    def design(Z):
        strengths = tuned.evaluation.antecedent.strengths(Z)
        local = tuned.problem.local
        own = (Z[None] - local.center[:, :, None]) / local.spread[:, :, None]
        basis = np.concatenate([np.ones((9, 1, Z.shape[1])), own], axis=1)
        return (strengths[:, None] * basis).reshape(27, -1)

    phi, penalty = (
        design(np.ascontiguousarray(found.sample.X.T)),
        tuned.problem.penalty_matrix(tuned.evaluation.normal.disagreement),
    )
    at = design(places)
    expected = np.sum(at * np.linalg.solve(phi @ phi.T + 180 * penalty, at), axis=0)
    problem = tuned.problem
    leverage = problem.leverage_at(problem.solved_again(tuned.evaluation), places, 180)
    assert_allclose(leverage, expected, rtol=1e-4)
    noise = tuned.posterior.noise_variance
    assert found._undetermined_share(tuned) == np.mean(expected > 1.0) > 0.075
    # A place is known well enough if the smaller model is expected to err by more there.
    found._error_to_match = noise * np.where(
        np.arange(places.shape[1]) % 2, 1.0 + 2.0 * expected, 1.0
    )
    part = np.mean((expected > 1.0)[::2]) / 2
    assert 0.0 < part < np.mean(expected > 1.0)
    assert found._undetermined_share(tuned) == part


@pytest.mark.parametrize(
    ("temperatures", "is_known"), [(THREE, False), (np.linspace(0.0, 50.0, 30), True)]
)
def test_rules_by_time_and_temperature_take_more_than_three_runs(rng, temperatures, is_known):
    X, y = three_runs(rng, temperatures)
    found = search_of(X, y)
    assert np.isfinite(found.score(Candidate((1, 1))))
    assert bool(np.isfinite(found.score(Candidate((4, 3))))) is is_known


def test_a_product_beside_its_factors_is_no_reason_to_refuse_rules():
    # Half-way between two rows the product is not that of the factors: no new row lies there.
    rng = np.random.default_rng(1)
    X, fresh = rng.uniform([0.0, -20.0, -100.0], [3600.0, 60.0, 100.0], (2, 800, 3))
    noise = 1e-3

    def truth(X):
        time, temperature, rate = X.T[:3]
        bias = 0.05 * np.exp(-time / 600.0) + 2e-6 * (temperature - 20.0) ** 2
        scale_factor = -4.1e-4 * (temperature - 20.0) - (0.2536 * np.deg2rad(rate)) ** 2 / 6.0
        return bias + 1e-3 * np.sin(temperature / 15.0) + rate * scale_factor

    X, fresh = (np.column_stack([Z, Z[:, 1] * Z[:, 2]]) for Z in (X, fresh))
    low, high = X.min(axis=0), X.max(axis=0)
    fresh = fresh[((low <= fresh) & (fresh <= high)).all(axis=1)]
    model = ANFISRegressor().fit(X, truth(X) + noise * rng.standard_normal(800))
    errors = model.predict(fresh) - truth(fresh)
    # 4 times the noise where the smaller model is not asked what it knows, and where three
    # candidates of a round are trained.
    assert np.sqrt(np.mean(errors**2)) < 1.5 * noise
