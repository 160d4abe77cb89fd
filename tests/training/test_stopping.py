"""Early stopping: what is held out, when it ends, what is restored."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.learning import SOLVERS, VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.options import EarlyStopping
from skanfis.training.stopping import hold_out

SETTINGS = {"early_stopping": True}
# Weights that let rules learn the noise.
FREE = {"agreement": 0.0, "alpha": 1e-6, "solver": VariableProjection(stiffness=0.0)}
LOOSE = FREE | SETTINGS


def overfitting(n_rows=150, seed=0):
    """Far too many rules for rows as noisy as these."""
    g = np.random.default_rng(seed)
    X = g.uniform(-2, 2, (n_rows, 2))
    return X, np.sin(2 * X[:, 0]) + 0.8 * g.normal(size=n_rows)


def held_out_by_default(X, y):
    seed = int(np.random.default_rng(0).integers(2**31 - 1))
    return hold_out(StandardisedData.of(X, y.reshape(len(y), -1)), 0.1, seed)[1]


def test_best_parameters_are_restored():
    X, y = overfitting()
    model = ANFISRegressor(n_mfs=6, **LOOSE).fit(X, y)
    validation = held_out_by_default(X, y)
    kept = np.setdiff1d(np.arange(150), validation)
    loss = np.mean((y[validation] - model.predict(X[validation])) ** 2) / np.var(y[kept])
    assert_allclose(loss, model.validation_loss_curve_.min(), rtol=1e-9)
    assert model.validation_loss_curve_.argmin() < len(model.validation_loss_curve_) - 1
    assert "Early stopping" in model.status_


@pytest.mark.parametrize("patience", [2, 5])
def test_it_ends_after_so_many_iterations_without_change(patience):
    X, y = overfitting()
    stopping = EarlyStopping(n_iter_no_change=patience, tol=1e-6)
    free = FREE | {"solver": VariableProjection(tol=1e-6, stiffness=0.0)}
    model = ANFISRegressor(n_mfs=4, early_stopping=stopping, **free)
    losses = model.fit(X, y).validation_loss_curve_
    counted, without = np.inf, 0
    ends = []
    for loss in losses:
        counted, without = (loss, 0) if loss < (1 - 1e-6) * counted else (counted, without + 1)
        ends.append(without == patience)
    assert ends.index(True) + 1 == len(losses) == model.n_iter_
    assert model.loss_curve_.shape == (model.n_iter_ + 1,)


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_solver_can_be_stopped(solver):
    X, y = overfitting()
    stopping = EarlyStopping(n_iter_no_change=3)
    model = ANFISRegressor(n_mfs=3, solver=solver, max_iter=60, early_stopping=stopping)
    assert model.fit(X, y).validation_loss_curve_.size == model.n_iter_


def test_whole_groups_are_held_out():
    g = np.random.default_rng(2)
    groups = np.repeat(np.arange(10), 20)
    rows = StandardisedData.of(g.normal(size=(200, 2)), g.normal(size=(200, 1)))
    training, validation = hold_out(replace(rows, groups=groups), 0.3, 0)
    assert set(groups[training]).isdisjoint(groups[validation])
    assert np.unique(groups[validation]).size == 3
    # Every group has a level of its own: what is held out cannot have been learnt.
    X = (groups + 0.1 * g.normal(size=200)).reshape(-1, 1)
    level = g.normal(size=10)[groups]
    alone, grouped = (
        ANFISRegressor(n_mfs=10, **LOOSE).fit(X, level, groups=given) for given in (None, groups)
    )
    assert grouped.validation_loss_curve_.min() > 1.5 * alone.validation_loss_curve_.min()


def test_groups_mean_nothing_where_nothing_is_held_out():
    X, y = overfitting()
    groups = np.arange(150) % 5
    one, other = ANFISRegressor(n_mfs=2).fit(X, y), ANFISRegressor(n_mfs=2).fit(X, y, groups=groups)
    assert_array_equal(one.predict(X), other.predict(X))


def test_held_out_rows_are_weighted_and_have_several_outputs():
    X, y = overfitting()
    weight = np.random.default_rng(1).uniform(0.5, 2.0, 150)
    both = np.column_stack([y, X[:, 1]])
    model = ANFISRegressor(n_mfs=2, **SETTINGS).fit(X, both, sample_weight=weight)
    every = StandardisedData.of(X, both, weight)
    _, held = hold_out(every, 0.1, int(np.random.default_rng(0).integers(2**31 - 1)))
    kept = np.setdiff1d(np.arange(150), held)
    mean = np.average(both[kept], axis=0, weights=weight[kept])
    variance = np.average((both[kept] - mean) ** 2, axis=0, weights=weight[kept])
    squares = ((both[held] - model.predict(X[held])) ** 2 / variance).sum(axis=1)
    expected = np.average(squares, weights=weight[held])
    assert_allclose(model.validation_loss_curve_.min(), expected, rtol=1e-9)


def test_random_state_chooses_the_rows():
    g = np.random.default_rng(0)
    rows = StandardisedData.of(g.normal(size=(100, 2)), g.normal(size=(100, 1)))
    one, again, other = (hold_out(rows, 0.2, seed)[1] for seed in (0, 0, 1))
    assert one.size == 20
    assert_array_equal(one, again)
    assert not np.array_equal(one, other)


def test_equal_rows_are_on_one_side():
    g = np.random.default_rng(0)
    X = g.normal(size=(50, 2))[np.arange(200) % 50]
    training, held = hold_out(StandardisedData.of(X, g.normal(size=(200, 1))), 0.2, 0)
    assert held.size == 40
    assert set(training % 50).isdisjoint(held % 50)


@pytest.mark.parametrize(
    ("n_rows", "groups", "fraction", "what"),
    [
        (3, None, 0.1, "3 rows"),
        (20, np.zeros(20), 0.5, "20 rows in 1 groups"),
        (10, None, 0.95, "10 rows"),
    ],
)
def test_too_few_rows_to_hold_out(n_rows, groups, fraction, what):
    X = np.random.default_rng(0).normal(size=(n_rows, 1))
    model = ANFISRegressor(n_mfs=1, early_stopping=EarlyStopping(fraction))
    with pytest.raises(ValueError, match=f"validation_fraction={fraction} leaves .* of {what}"):
        model.fit(X, X[:, 0], groups=groups)
