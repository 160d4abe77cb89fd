"""Several starts, and the leave-one-out error that chooses among them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc, make_jang_three_input
from skanfis.membership import Gaussian
from skanfis.premise import Premise
from skanfis.solvers import LeastSquares, VariableProjection
from skanfis.training import restarts

from .. import oracles


def test_starts_lie_in_the_box_and_the_first_is_as_given():
    g = np.random.default_rng(1)
    antecedent = oracles.random_grid(g, [Gaussian] * 2, [3, 3])
    premise = Premise.of(antecedent, np.full(2, -2.0), np.full(2, 2.0))
    starts = restarts.displaced_starts(premise, None, 200, np.random.default_rng(0))
    given = 0.1 * premise.upper
    other = restarts.displaced_starts(premise, given, 200, np.random.default_rng(0))
    assert_array_equal(starts[0], 0.0)
    assert_array_equal(other[0], given)
    assert_array_equal(starts[1:], other[1:])
    assert (starts >= premise.lower).all()
    assert (starts <= premise.upper).all()
    # A deviation of 0.3, cut off at the edges.
    drawn = np.random.default_rng(9).normal(scale=0.3, size=(20_000, premise.size))
    expected = np.clip(drawn, premise.lower, premise.upper).std(axis=0)
    assert_allclose(starts[1:].std(axis=0), expected, rtol=0.2)
    assert expected.max() > 0.2


def test_the_best_start_is_kept():
    X, y = make_jang_sinc()
    losses = [
        ANFISRegressor(
            n_mfs=4,
            n_init=n,
            random_state=3,
            agreement=0,
            alpha=1e-10,
            solver=VariableProjection(stiffness=0.0),
        )
        .fit(X, y)
        .loss_curve_[-1]
        for n in (1, 8)
    ]
    assert losses[1] < 0.6 * losses[0]


class Remembers(LeastSquares):
    """Premises stay where each start has them; every run is remembered."""

    def __init__(self, runs):
        self.runs = runs

    def solve(self, problem, premise, *, start=None, **settings):
        result = super().solve(problem, premise, start=start, **settings)
        self.runs.append((problem, start, result))
        return result


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_it_is_kept_by_its_leave_one_out_error(n_jobs):
    g = np.random.default_rng(4)
    X, runs = g.uniform(-2.0, 2.0, (60, 2)), []
    y = np.sin(2.0 * X[:, 0]) + 0.5 * g.normal(size=60)
    settings = {"n_mfs": 3, "agreement": 0.0, "alpha": 1e-6, "n_init": 12, "n_jobs": n_jobs}
    model = ANFISRegressor(solver=Remembers(runs), **settings).fit(X, y)
    errors = [problem.leave_one_out_error(result.evaluation, 60) for problem, _, result in runs]
    assert len(errors) == 12
    best = runs[int(np.argmin(errors))][2]
    assert_array_equal(model.loss_curve_, best.loss_curve)
    # Neither the first nor the one that meets the data best.
    assert best.loss_curve[-1] > min(result.loss_curve[-1] for *_, result in runs)
    assert any(start is None or not start.any() for _, start, _ in runs)
    assert runs[int(np.argmin(errors))][1].any()


@pytest.mark.parametrize("settings", [{"n_mfs": 2}, {"partition": "fcm"}])
def test_number_of_workers_does_not_matter(settings):
    X, y = make_jang_three_input()[:2]
    model = ANFISRegressor(
        mf="bell", n_init=4, random_state=0, solver=VariableProjection(tol=1e-2), **settings
    )
    one, two = (clone(model).set_params(n_jobs=n).fit(X, y) for n in (1, 2))
    assert_array_equal(one.loss_curve_, two.loss_curve_)
    assert_array_equal(one.consequents_, two.consequents_)


def test_random_state_decides_on_the_starts():
    X, y = make_jang_sinc()
    model = ANFISRegressor(n_mfs=3, n_init=3, solver=VariableProjection(tol=1e-2))
    same = [clone(model).set_params(random_state=5).fit(X, y).consequents_ for _ in range(2)]
    assert_array_equal(*same)
