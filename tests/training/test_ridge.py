"""The ridge by generalised cross-validation, against the dense regression."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.membership import Gaussian
from skanfis.objective import SeparableProblem
from skanfis.training import ridge

from .. import oracles


def dense_scores(problem, evaluation, n_rows):
    """GCV of every alpha, each by a regression of its own."""
    rows, antecedent = problem.rows, problem.antecedent
    dense = oracles.DenseProblem(rows, antecedent, problem.order, 1.0)
    phi = dense.design(evaluation.antecedent.parameters) @ dense.local
    gram = (phi.T * dense.weight) @ phi
    scores = []
    for alpha in ridge._ALPHAS:
        inverse = np.linalg.inv(gram + alpha * np.eye(len(gram)))
        beta = inverse @ ((phi.T * dense.weight) @ dense.y)
        error = np.sum(dense.weight[:, None] * (dense.y - phi @ beta) ** 2)
        scores.append(error / (1.0 - np.trace(inverse @ gram) / n_rows) ** 2)
    return np.array(scores)


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("n_outputs", [1, 2])
@pytest.mark.parametrize("noise", [0.1, 2.0])
def test_best_alpha_has_the_smallest_score_of_the_dense_regression(weighted, n_outputs, noise):
    g = np.random.default_rng(7)
    rows = oracles.bumpy_rows(g, 90, 2, n_outputs, weighted)
    rows.y[:] += noise * g.normal(size=rows.y.shape)
    problem = SeparableProblem(rows, oracles.random_grid(g, [Gaussian] * 2, [3, 3]), 1, 1e-3)
    evaluation = problem.evaluate(problem.antecedent.parameters)
    scores = dense_scores(problem, evaluation, rows.n_rows)
    chosen = ridge.best_alpha(problem, evaluation, rows.n_rows)
    assert scores[list(ridge._ALPHAS).index(chosen)] <= scores.min() * 1.002


def noisy(n_rows=150):
    g = np.random.default_rng(3)
    X = g.uniform(-2, 2, (n_rows, 2))
    return X, np.sin(X[:, 0]) + 0.3 * X[:, 1] + 0.5 * g.normal(size=n_rows)


def test_many_rules_on_few_noisy_rows_get_a_strong_ridge_and_gain_by_it():
    X, y = noisy()
    g = np.random.default_rng(4)
    X_new = g.uniform(-2, 2, (2000, 2))
    truth = np.sin(X_new[:, 0]) + 0.3 * X_new[:, 1]
    errors = {}
    for alpha in ("auto", "gcv"):
        model = ANFISRegressor(n_mfs=4, solver="lse", alpha=alpha, warn_out_of_bounds=False)
        errors[alpha] = np.sqrt(np.mean((model.fit(X, y).predict(X_new) - truth) ** 2))
    assert model.alpha_ >= 1e-3
    assert errors["gcv"] < 0.8 * errors["auto"]


def test_data_without_noise_get_next_to_none():
    X, _ = noisy()
    y = np.sin(X[:, 0]) * X[:, 1]
    assert ANFISRegressor(n_mfs=3, alpha="gcv", tol=1e-1).fit(X, y).alpha_ <= 1e-8


def test_the_loss_is_that_of_the_last_alpha():
    X, y = noisy()
    model = ANFISRegressor(n_mfs=3, alpha="gcv", tol=1e-2).fit(X, y)
    loss = np.mean((model.predict(X) - y) ** 2) / np.var(y)
    assert_allclose(model.loss_curve_[-1], loss, rtol=1e-9)
