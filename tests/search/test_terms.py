"""Terms per input by folds that the caller has cut."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import GroupKFold

from skanfis import ANFISRegressor
from skanfis.search import search_terms

pytestmark = pytest.mark.theory

N_RUNS, N_LEVELS = 5, 10


def campaign(by_level, seed=0):
    """Runs at rates on a few levels; ``by_level`` is an error that each level has by chance."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(N_RUNS), 60)
    level = rng.integers(N_LEVELS, size=run.size)
    temperature = rng.uniform(-40.0, 60.0, run.size)
    rate = 20.0 * level + rng.normal(size=run.size)
    y = 50.0 * np.tanh(temperature / 15.0) + 0.1 * rng.normal(size=run.size)
    y += by_level * rng.normal(size=N_LEVELS)[level]
    return np.column_stack([temperature, rate]), y, run, level


def run_folds(run):
    return list(GroupKFold(N_RUNS).split(run, groups=run))


def run_and_level_folds(run, level):
    """Both held out; rows that are of one alone are on neither side."""
    part = level % 2
    return [
        (np.flatnonzero((run != r) & (part != p)), np.flatnonzero((run == r) & (part == p)))
        for r in range(N_RUNS)
        for p in range(2)
    ]


@pytest.mark.floors
def test_finds_what_the_regressor_finds_with_groups():
    X, y, run, _ = campaign(0.0)
    found = search_terms(X, y, run_folds(run))
    lines = ANFISRegressor(partition="grid").fit(X, y, groups=run).structures_
    errors = {tuple(line["n_mfs"]): y.std() * line["held_out_error"] for line in lines}
    assert dict(found.tried) == pytest.approx(errors)
    assert found.terms[0] > found.terms[1] == 1
    assert found.error == dict(found.tried)[found.terms] < 0.1 * errors[1, 1]


def test_error_is_of_rows_of_which_neither_run_nor_level_was_trained_on():
    X, y, run, level = campaign(1.0)
    folds = run_and_level_folds(run, level)
    squares = []
    for train, test in folds:
        low, high = X[train].min(axis=0), X[train].max(axis=0)
        test = test[((X[test] >= low) & (X[test] <= high)).all(axis=1)]
        plane = LinearRegression().fit(X[train], y[train])
        squares.append((plane.predict(X[test]) - y[test]) ** 2)
    tried = search_terms(X, y, folds, max_rules=1).tried
    assert [terms for terms, _ in tried] == [(1, 1)]
    assert_allclose(tried[0][1], np.sqrt(np.mean(np.concatenate(squares))), rtol=1e-3)


@cache
def by_heart(max_rules):
    X, y, run, _ = campaign(3.0)
    return search_terms(X, y, run_folds(run), max_rules)


def test_levels_are_not_learnt_by_heart_where_they_are_held_out_too():
    X, y, run, level = campaign(3.0)
    assert by_heart(4).terms[1] > 1
    assert search_terms(X, y, run_and_level_folds(run, level), max_rules=4).terms[1] == 1


@pytest.mark.parametrize("max_rules", [2, 4])
def test_keeps_to_the_most_rules(max_rules):
    found = by_heart(max_rules)
    assert max(np.prod(terms) for terms, _ in found.tried) == max_rules
    assert 1 < np.prod(found.terms) <= max_rules


def test_folds_without_two_rows_to_train_on_or_any_to_test_say_nothing():
    X, y, run, _ = campaign(0.0)
    X[1] = X[0]  # in the range of a fold that is trained on the first row alone
    folds, every = run_folds(run), np.arange(y.size)
    useless = [(every[:0], every), (every[:1], every[1:]), (every, every[:0])]
    tried = search_terms(X, y, [*folds, *useless], max_rules=1).tried
    assert tried == search_terms(X, y, folds, max_rules=1).tried
