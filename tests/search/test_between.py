"""What is known between the rows, by the dense design and by curves with gaps between them."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.distance import pdist, squareform

from skanfis import ANFISRegressor
from skanfis.exceptions import UnderdeterminedWarning
from skanfis.learning.data import StandardisedData
from skanfis.membership import Gaussian
from skanfis.search.between import expected_between, is_told, places_between, unknown_between
from skanfis.search.candidate import Candidate
from skanfis.search.search import StructureSearch

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


def test_places_are_half_way_to_others_that_are_near(rng):
    X = rng.standard_normal((60, 3))
    rows = rows_of(X, X[:, 0])
    distance = squareform(pdist(rows.X))
    middle = 0.5 * (rows.X[:, None] + rows.X)
    ranks, owners = [], set()
    for place in places_between(rows).T:
        apart = np.abs(middle - place).sum(axis=2)
        apart[np.diag_indices(60)] = np.inf  # no row is half-way to itself
        one, other = np.unravel_index(np.argmin(apart), apart.shape)
        assert_allclose(middle[one, other], place, atol=1e-12)
        owners |= {int(one), int(other)}
        ranks.append(np.sum(distance[one] < distance[one, other]) / 60)
    assert len(ranks) == len(owners) == 60
    # The least of twenty of a uniform distribution has the mean 1/21.
    assert 0.02 < np.mean(ranks) < 0.1


@pytest.mark.parametrize("n_rows", [1, 2, 200, 1000])
def test_there_are_places_between_any_number_of_rows(rng, n_rows):
    X = rng.standard_normal((n_rows, 2))
    places = places_between(rows_of(X, X[:, 0]))
    assert places.shape == (2, min(n_rows, 200))
    assert np.isfinite(places).all()


def test_rows_come_as_often_as_they_count(rng):
    X = rng.standard_normal((60, 1))
    weight = np.where(np.arange(60) % 2, 1.0, 1e-300)
    weight[1] = 30.0
    rows = rows_of(X, X[:, 0], weight)
    heavy = rows.X[1::2, 0]
    middle = 0.5 * (heavy[:, None] + heavy)
    middle[np.diag_indices(30)] = np.inf  # no row is half-way to itself
    (places,) = places_between(rows)
    assert_allclose(np.abs(middle.ravel() - places[:, None]).min(axis=1), 0.0, atol=1e-12)
    of_heaviest = np.abs(middle[0] - places[:, None]).min(axis=1) < 1e-12
    assert 28 <= of_heaviest.sum() < 60


def test_leverage_is_that_of_the_dense_design(rng):
    X, y = three_runs(rng, THREE)
    found = StructureSearch(
        rows_of(X, y), [Gaussian] * 2, 1, np.arange(2), np.arange(2), 0, {}, overlap=0.6
    ).trials
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
    assert unknown_between(tuned, places) == np.mean(expected > 1.0) > 0.075
    noise = tuned.posterior.noise_variance
    assert_allclose(expected_between(tuned, places), (1.0 + expected) * noise, rtol=1e-4)
    # A place is known well enough if the smaller model is expected to err by more there.
    smaller = noise * np.where(np.arange(places.shape[1]) % 2, 1.0 + 2.0 * expected, 1.0)
    part = np.mean((expected > 1.0)[::2]) / 2
    assert 0.0 < part < np.mean(expected > 1.0)
    assert unknown_between(tuned, places, smaller) == part


@pytest.mark.parametrize(
    ("temperatures", "is_known"), [(THREE, False), (np.linspace(0.0, 50.0, 30), True)]
)
def test_rules_by_time_and_temperature_take_more_than_three_runs(rng, temperatures, is_known):
    X, y = three_runs(rng, temperatures)
    found = StructureSearch(
        rows_of(X, y), [Gaussian] * 2, 1, np.arange(2), np.arange(2), 0, {}, overlap=0.6
    ).trials
    assert np.isfinite(found.score(Candidate((1, 1))))
    assert bool(np.isfinite(found.score(Candidate((4, 3))))) is is_known


@pytest.mark.parametrize("n_outputs", [1, 2])
def test_what_is_to_be_beaten_is_the_best_so_far(rng, n_outputs):
    X, y = three_runs(rng, THREE)
    rows = StandardisedData.of(X, np.column_stack([y] * n_outputs))
    found = StructureSearch(
        rows, [Gaussian] * 2, 1, np.arange(2), np.arange(2), 0, {}, overlap=0.6
    ).trials
    before, tuned = found.tuned(Candidate((1, 3))), found.tuned(Candidate((3, 3)))
    found.beat(Candidate((1, 3)))
    found.score(Candidate((3, 3)))
    (unknown,) = [one["unknown_between"] for one in found.report() if one["n_mfs"] == [3, 3]]
    at, at_before = (
        t.problem.leverage_at(t.solved, found.places, t.posterior.n_rows) for t in (tuned, before)
    )
    is_worse = (1.0 + at) * tuned.posterior.noise_variance > (
        1.0 + at_before
    ) * before.posterior.noise_variance
    assert 0.0 < unknown == np.mean((at > 1.0) & is_worse) < np.mean(at > 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_product_beside_its_factors_is_no_reason_to_refuse_rules(seed):
    # Half-way between two rows the product is not that of the factors: no new row lies there.
    rng = np.random.default_rng(seed)
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
    # 4.0 to 4.3 times the noise where the smaller model is not asked what it knows; and on seed 1
    # where three candidates of a round are trained.
    assert np.sqrt(np.mean(errors**2)) < 1.5 * noise


def test_rules_that_are_given_come_with_a_warning(rng):
    X, y = three_runs(rng, THREE)
    with pytest.warns(UnderdeterminedWarning, match=r"At \d+% of places half-way .*n_mfs"):
        ANFISRegressor([4, 3]).fit(X, y)
    # Once, where there are fewer rows than consequents.
    with pytest.warns(UnderdeterminedWarning) as raised:
        ANFISRegressor([6, 4]).fit(X[::3], y[::3])
    assert len(raised) == 1
    assert "72 consequent parameters for 60" in str(raised[0].message)
    ANFISRegressor([1, 3]).fit(X, y)
    X, y = three_runs(rng, np.linspace(0.0, 50.0, 30))
    ANFISRegressor([4, 3]).fit(X, y)


def test_what_is_chosen_is_told_by_the_rows(rng):
    X, y = three_runs(rng, THREE)
    model = ANFISRegressor().fit(X, y)
    chosen = model.structures_[0]
    assert model.n_rules_ > 1
    assert chosen["unknown_between"] <= 0.075
    assert model.structures_[-1]["unknown_between"] > 0.075
    # With groups, those that are left out decide.
    model.fit(X, y, groups=np.repeat([0, 1, 2], 60))
    assert not any("unknown_between" in c for c in model.structures_)


def test_it_is_asked_at_how_many_places_and_not_by_how_much():
    def tuned(leverage):
        problem = SimpleNamespace(
            antecedent=SimpleNamespace(n_rules=2),
            leverage_at=lambda evaluation, places, n_rows: leverage,
        )
        posterior = SimpleNamespace(n_rows=100.0, noise_variance=1.0)
        return SimpleNamespace(problem=problem, solved=None, posterior=posterior)

    # As beside three rows far off, and as of rows on three curves.
    far = np.where(np.arange(60) < 3, 1e6, 0.1)
    curves = np.where(np.arange(60) < 6, 1.2, 0.1)
    assert far.mean() > 1.0 > curves.mean()
    assert unknown_between(tuned(far), None) == 0.05
    assert unknown_between(tuned(curves), None) == 0.1
    assert is_told(0.05)
    assert not is_told(0.1)


def test_a_row_far_off_is_no_reason_to_refuse_rules(rng):
    X = rng.standard_normal((80, 2))
    X[0] = [30.0, 6.0]
    y = np.sin(1.5 * X[:, 0]) + 0.3 * np.cos(2.0 * X[:, 1]) + 0.02 * rng.standard_normal(80)
    model = ANFISRegressor().fit(X, y)
    assert all(one["unknown_between"] <= 0.075 for one in model.structures_)
    ANFISRegressor([4, 2]).fit(X, y)
