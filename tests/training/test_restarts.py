"""Several starts, and the leave-one-out error that chooses among them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc, make_jang_three_input
from skanfis.membership import Gaussian
from skanfis.objective import SeparableProblem
from skanfis.penalty import Penalty
from skanfis.premise import Premise
from skanfis.training import restarts

from .. import oracles


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("n_outputs", [1, 2])
def test_leave_one_out_error_is_that_of_leaving_each_row_out(weighted, n_outputs):
    g = np.random.default_rng(1)
    rows = oracles.bumpy_rows(g, 40, 2, n_outputs, weighted)
    alpha = 1e-2
    problem = SeparableProblem(
        rows, oracles.random_grid(g, [Gaussian] * 2, [2, 2]), 1, Penalty(alpha=alpha)
    )
    evaluation = problem.evaluate(problem.antecedent.parameters)
    dense = oracles.DenseProblem(rows, problem.antecedent, 1, alpha)
    phi, total = dense.design(problem.antecedent.parameters) @ dense.local, 0.0
    for i in range(40):
        weight = dense.weight.copy()
        weight[i] -= 1.0 / rows.total_weight  # one unit of it
        gram = (phi.T * weight) @ phi + alpha * np.eye(phi.shape[1])
        beta = np.linalg.solve(gram, (phi.T * weight) @ dense.y)
        total += dense.weight[i] * np.sum((dense.y[i] - phi[i] @ beta) ** 2)
    assert_allclose(restarts.leave_one_out_error(problem, evaluation), total, rtol=1e-8)


def test_starts_lie_in_the_box_and_the_first_is_the_partitions_own():
    g = np.random.default_rng(1)
    antecedent = oracles.random_grid(g, [Gaussian] * 2, [3, 3])
    premise = Premise.of(antecedent, np.full(2, -2.0), np.full(2, 2.0))
    starts = restarts.displaced_starts(premise, 200, np.random.default_rng(0))
    assert_array_equal(starts[0], 0.0)
    assert (starts >= premise.lower).all()
    assert (starts <= premise.upper).all()
    assert_allclose(starts[1:].std(), 0.3, rtol=0.05)


def test_the_best_start_is_kept():
    X, y = make_jang_sinc()
    losses = [
        ANFISRegressor(n_mfs=4, n_init=n, random_state=3, alpha=1e-10).fit(X, y).loss_curve_[-1]
        for n in (1, 8)
    ]
    assert losses[1] < 0.1 * losses[0]


@pytest.mark.parametrize("settings", [{"n_mfs": 2}, {"partition": "fcm"}])
def test_number_of_workers_does_not_matter(settings):
    X, y = make_jang_three_input()[:2]
    model = ANFISRegressor(mf="bell", n_init=4, tol=1e-2, random_state=0, **settings)
    one, two = (clone(model).set_params(n_jobs=n).fit(X, y) for n in (1, 2))
    assert_array_equal(one.loss_curve_, two.loss_curve_)
    assert_array_equal(one.consequents_, two.consequents_)


def test_random_state_decides_on_the_starts():
    X, y = make_jang_sinc()
    model = ANFISRegressor(n_mfs=3, n_init=3, tol=1e-2)
    same = [clone(model).set_params(random_state=5).fit(X, y).consequents_ for _ in range(2)]
    assert_array_equal(*same)
