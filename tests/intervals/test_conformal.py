"""Intervals against crepes, MAPIE, refits one row at a time, and the coverage that theory gives."""

import warnings

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn import config_context
from sklearn.base import clone
from sklearn.frozen import FrozenEstimator
from sklearn.linear_model import BayesianRidge, LinearRegression
from sklearn.model_selection import GroupKFold, KFold, ShuffleSplit
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.intervals import ConformalRegressor
from skanfis.intervals._scores import (
    final_step,
    group_scores,
    one_row_per_group,
    row_masses,
    score_quantile,
)
from skanfis.learning import VariableProjection

from ..quick import quick

SHORT = {"max_iter": 8, "solver": VariableProjection(tol=0.1)}


def bent(rng, n_rows):
    """Noise that grows with the input."""
    X = rng.uniform(-1, 1, size=(n_rows, 1))
    return X, np.sin(2 * X[:, 0]) + (0.1 + 0.2 * (X[:, 0] > 0)) * rng.normal(size=n_rows)


def covered(bounds, y):
    return np.mean((bounds[0] <= y) & (y <= bounds[1]))


def test_rows_without_weight_are_absent_for_a_frozen_regressor(rng):
    X, y = bent(rng, 60)
    frozen = FrozenEstimator(LinearRegression().fit(X, y))
    model = ConformalRegressor(frozen, method="split", calibration_fraction=1, scaled=False)
    expected = clone(model).fit(X[:40], y[:40]).predict_interval(X)
    given = np.arange(60) < 40
    assert_allclose(model.fit(X, y, sample_weight=given).predict_interval(X), expected, rtol=1e-12)


def test_split_is_that_of_crepes(rng):
    with warnings.catch_warnings():
        # When imported it has every UserWarning shown, whosever it is, and none raised.
        from crepes import ConformalRegressor as Crepes

    X, y = bent(rng, 200)
    new = bent(rng, 50)[0]
    fitted = quick(**SHORT).fit(*bent(rng, 100))
    mean, std = fitted.predict(X, return_std=True)
    theirs = Crepes().fit(residuals=y - mean, sigmas=std)
    frozen = FrozenEstimator(fitted)
    ours = ConformalRegressor(frozen, method="split", calibration_fraction=1.0).fit(X, y)
    mean, std = fitted.predict(new, return_std=True)
    for coverage in (0.5, 0.9, 0.95):
        expected = theirs.predict_int(mean, sigmas=std, confidence=coverage)
        assert_allclose(np.column_stack(ours.predict_interval(new, coverage)), expected, rtol=1e-12)


def test_folds_are_those_of_mapie(rng):
    from mapie.regression import CrossConformalRegressor

    X, y = bent(rng, 40)
    new = rng.uniform(-3, 3, size=(30, 1))
    cv = KFold(5, shuffle=True, random_state=3)
    settings = {"confidence_level": 0.8, "method": "base", "cv": cv}
    mapie = CrossConformalRegressor(LinearRegression(), **settings).fit_conformalize(X, y)
    expected = mapie.predict_interval(new)[1][:, :, 0]
    ours = ConformalRegressor(LinearRegression(), scaled=False, cv=cv).fit(X, y)
    assert_allclose(np.column_stack(ours.predict_interval(new, 0.8)), expected, rtol=1e-9)


def test_units_count_and_not_the_size_of_weights(rng):
    weight, groups = rng.uniform(1, 3, size=30), rng.permutation(np.arange(30) % 4)
    masses, n_units = row_masses(30, weight)
    assert_allclose(n_units, weight.sum() ** 2 / (weight**2).sum())
    assert_allclose(masses, weight / weight.sum() * n_units / (n_units + 1))
    masses, n_units = row_masses(30, weight, groups)
    assert n_units == 4
    assert_allclose(np.bincount(groups, masses), 0.2)
    # The ninth of nine scores, and of eight none.
    assert score_quantile(np.arange(9.0), row_masses(9)[0], 0.9) == 8.0
    assert score_quantile(np.arange(8.0), row_masses(8)[0], 0.9) == np.inf
    assert score_quantile(np.array([0.0, np.nan, np.nan]), row_masses(3)[0], 0.6) == np.inf


def hierarchical(rng, n_groups, within):
    """Scores of groups of a size each, which have a part of their own, and equal masses."""
    groups = np.repeat(np.arange(n_groups), rng.integers(4, 9, size=n_groups))
    own = np.sqrt(1.0 - within**2) * rng.normal(size=n_groups)[groups]
    scores = np.abs(own + within * rng.normal(size=groups.size))
    return scores, row_masses(groups.size, groups=groups)[0], groups


def test_quantile_of_groups_is_the_median_of_draws_of_one_row_from_each(rng):
    scores, masses, groups = hierarchical(rng, 12, 0.6)
    scores[3] = np.nan
    known = np.nan_to_num(scores, nan=np.inf)
    draws = np.stack([rng.choice(known[groups == g], 40_001) for g in range(12)])
    for coverage in (0.5, 0.75, 0.9):
        needed = int(np.ceil(13 * coverage - 1e-9))
        expected = np.median(np.sort(draws, axis=0)[needed - 1])
        assert one_row_per_group(scores, masses, groups, coverage) == expected
    # One row to a group: the plain quantile.
    masses = row_masses(scores.size, groups=np.arange(scores.size))[0]
    found = one_row_per_group(scores, masses, np.arange(scores.size), 0.9)
    assert found == score_quantile(scores, row_masses(scores.size)[0], 0.9)
    # The fourteenth of 24, though 25 * 0.56 is more than 14 when rounded.
    scores, masses = np.arange(24.0), np.full(24, 0.04)
    assert one_row_per_group(scores, masses, np.arange(24), 0.56) == 13.0
    assert score_quantile(scores, masses, 0.56) == 13.0


@pytest.mark.theory
@pytest.mark.parametrize("within", [0.1, 0.7, 1.0])
def test_rows_and_groups_are_covered_as_often_as_theory_says(within, rng):
    """29 groups known, whatever they have in common; new groups of many rows."""
    rows, whole = [], []
    for _ in range(150):
        known = hierarchical(rng, 29, within)
        own = np.sqrt(1.0 - within**2) * rng.normal(size=(40, 1))
        new = np.abs(own + within * rng.normal(size=(40, 50)))
        rows.append(np.mean(new <= one_row_per_group(*known, 0.9)))
        limit = score_quantile(*group_scores(*known, 0.8), 0.9)
        whole.append(np.mean(np.mean(new <= limit, axis=1) >= 0.8))
    # 27 of 30; the median of the quantiles lies above their mean, by 0.01 where rows are alone.
    assert 0.89 < np.mean(rows) < 0.925
    # Groups known have fewer rows than new ones: a part of five or six rows is a larger part.
    assert np.mean(whole) > 0.89


@pytest.mark.parametrize("weighting", ["none", "whole", "parts"])
def test_leave_one_out_is_that_of_refits(weighting, rng):
    """One rule and no ridge are a line: its residual and deviation without each row, by refits.

    A row is left out with all of its weight.
    """
    X, y = rng.normal(size=(25, 2)), rng.normal(size=25)
    given = {"whole": rng.integers(1, 6, 25).astype(float), "parts": rng.uniform(0.1, 1.0, 25)}
    weight = given.get(weighting)
    rules = ANFISRegressor(n_mfs=1, alpha=0.0)
    regressor = make_pipeline(StandardScaler(), rules) if weight is None else rules
    model = ConformalRegressor(regressor, method="loo").fit(X, y, sample_weight=weight)
    # As many rows as the weights say, or as their spread leaves, whichever are more.
    w = np.ones(25) if weight is None else weight * max(1.0, weight.sum() / np.sum(weight**2))
    A = np.column_stack([np.ones(25), X])
    root = np.sqrt(w)
    beta = np.linalg.lstsq(root[:, None] * A, root * y, rcond=None)[0]
    noise = np.sqrt(np.sum(w * (y - A @ beta) ** 2) / (w.sum() - 3.0))
    assert_allclose(final_step(model.estimator_)[0].noise_std_, noise, rtol=1e-8)
    expected, residuals = [], []
    for i in range(25):
        rest, own = np.delete(A, i, axis=0), np.delete(w, i)
        matrix = rest.T @ (own[:, None] * rest)
        beta = np.linalg.solve(matrix, rest.T @ (own * np.delete(y, i)))
        leverage = A[i] @ np.linalg.solve(matrix, A[i])
        residuals.append(abs(y[i] - A[i] @ beta))
        expected.append(residuals[-1] / (noise * np.sqrt(1 + leverage)))
    assert_allclose(model.scores_, np.sort(expected), rtol=1e-6)
    plain = clone(model).set_params(scaled=False).fit(X, y, sample_weight=weight)
    assert_allclose(plain.scores_, np.sort(residuals), rtol=1e-6)


@pytest.mark.parametrize("method", ["folds", "split", "loo"])
def test_scaled_by_the_deviation_of_rules_it_covers_and_is_wider_off_the_data(method, rng):
    X, y = bent(rng, 300)
    y = np.column_stack([y, 100.0 * X[:, 0] + 3.0 * rng.normal(size=300)])
    regressor = make_pipeline(StandardScaler(), quick(**SHORT))
    model = ConformalRegressor(regressor, method=method, cv=4).fit(X, y)
    new, truth = bent(rng, 3000)
    lower, upper = model.predict_interval(new, 0.8)
    assert lower.shape == (3000, 2)
    assert abs(covered((lower[:, 0], upper[:, 0]), truth) - 0.8) < 0.06
    lower, upper = model.predict_interval([[0.0], [1.5], [3.0]])
    assert (np.diff(upper - lower, axis=0) > 0.0).all()


@pytest.mark.parametrize("method", ["folds", "split", "loo"])
def test_the_interval_of_a_constant_target_has_no_width(method, rng):
    X, y = bent(rng, 60)
    model = ConformalRegressor(ANFISRegressor(n_mfs=2), method=method, cv=4)
    ends = model.fit(X, np.column_stack([y, np.full(60, 2.0)])).predict_interval(X, 0.8)
    assert_allclose(np.array(ends)[:, :, 1], 2.0, rtol=1e-12)


def test_groups_and_weights_reach_a_regressor_in_a_pipeline(rng):
    X, y = bent(rng, 60)
    run, weight = np.arange(60) // 6, rng.integers(0, 3, size=60).astype(float)
    with config_context(enable_metadata_routing=True):
        rules = quick(**SHORT).set_fit_request(sample_weight=True, groups=True)
        scaler = StandardScaler().set_fit_request(sample_weight=True)
        model = ConformalRegressor(make_pipeline(scaler, rules), cv=5)
        model.fit(X, y, sample_weight=weight, groups=pd.array(run, dtype=str))
    folds = list(GroupKFold(5).split(X, y, run))
    for estimator, (train, _) in zip(model.estimators_, folds, strict=True):
        alone = StandardScaler().fit(X[train], sample_weight=weight[train])
        fitted = quick(**SHORT).fit(alone.transform(X[train]), y[train], weight[train], run[train])
        assert_allclose(estimator.predict(X), fitted.predict(alone.transform(X)), rtol=1e-12)


class Keeping(LinearRegression):
    def fit(self, X, y):
        self.rows_ = X
        return super().fit(X, y)


class KeepingGroups(Keeping):
    def fit(self, X, y, groups):
        assert len(groups) == len(X)
        return super().fit(X, y)


@pytest.mark.parametrize("regressor", [Keeping(), KeepingGroups()], ids=["without", "with"])
@pytest.mark.parametrize(("method", "n_models"), [("folds", 5), ("split", 1)])
def test_groups_are_held_out_whole_and_told_to_who_takes_them(method, n_models, regressor, rng):
    X, y = bent(rng, 60)
    model = ConformalRegressor(regressor, method=method, scaled=False)
    model.fit(X, y, groups=np.arange(60) // 12)
    trained = model.estimators_ or [model.estimator_]
    assert len(trained) == n_models  # folds are no more than groups
    for one in trained:
        assert set(np.isin(X, one.rows_).reshape(5, 12).mean(axis=1)) == {0.0, 1.0}


RULES = ANFISRegressor(n_mfs=1, alpha=0.1)


class NeverFitted(BayesianRidge):
    def fit(self, X, y, sample_weight=None):
        raise AssertionError("Splits are to be refused before anything is fitted.")


@pytest.mark.parametrize(
    ("match", "params", "given"),
    [
        ("needs 9 rows held out or more; there are 6, enough for", {"method": "split"}, {}),
        ("needs 9 groups or more; there are 8", {}, {"groups": np.arange(24) // 3}),
        ("single group", {}, {"groups": np.zeros(24)}),
        ("single group", {}, {"groups": np.arange(24) < 12, "sample_weight": np.arange(24) < 12}),
        (
            *("None of the 6 rows held out has a positive weight", {"method": "split"}),
            {"sample_weight": np.arange(24) % 12 == 0},
        ),
        ("=0.99 leaves no row to train on", {"method": "split", "calibration_fraction": 0.99}, {}),
        ("X has the length 24, groups 23", {}, {"groups": np.zeros(23)}),
        ("leaves out rows, not groups", {"method": "loo"}, {"groups": np.arange(24)}),
        ("nothing of its noise.* another", {"method": "loo", "estimator": BayesianRidge()}, {}),
        (
            "not fitted to them here: use method='split'",
            {"method": "loo", "estimator": FrozenEstimator(LinearRegression().fit([[0.0]], [0.0]))},
            {},
        ),
        ("not have: use scaled=False", {"estimator": LinearRegression()}, {}),
        (r"row 0 0 times; every row must be held", {"cv": ShuffleSplit(2, random_state=0)}, {}),
        ("An iterator can be used once only", {"cv": iter([])}, {}),
        (
            "holds out row 3 and trains on its group; a model may not have seen",
            {"cv": list(KFold(6).split(np.ones(24))), "estimator": NeverFitted()},
            {"groups": np.arange(24) // 3},
        ),
        ("holds out row 0 and trains on it;", {"cv": [(np.arange(24),) * 2]}, {}),
        (
            "out_of_bounds='raise' refuses rows held out",
            {"estimator": make_pipeline(StandardScaler(), quick(n_mfs=1, out_of_bounds="raise"))},
            {},
        ),
        (
            "enable_metadata_routing=True",
            {"estimator": make_pipeline(StandardScaler(), RULES)},
            {"sample_weight": np.ones(24)},
        ),
        (
            *("Negative values in sample_weight", {"estimator": NeverFitted()}),
            {"sample_weight": -np.ones(24)},
        ),
        (r"n_jobs.*\[1, inf\)", {"n_jobs": 0}, {}),
    ],
)
def test_bad_input_is_refused_by_name(match, params, given):
    X, y = bent(np.random.default_rng(10), 24)
    model = ConformalRegressor(**({"estimator": RULES} | params))
    with pytest.raises(ValueError, match=match):
        model.fit(X, y, **given).predict_interval(X)


def test_levels_and_missing_numbers_are_refused_by_name():
    X, y = bent(np.random.default_rng(0), 24)
    with pytest.raises(ValueError, match="y has no rows: at least 2 are needed"):
        ConformalRegressor(RULES).fit(X[:0], y[:0])
    for name in ("y", "drift"):
        bad = pd.Series(np.where(np.arange(24) == 3, np.nan, y), name=name)
        with pytest.raises(ValueError, match=f"y contains NaN in column '{name}', first at row 3"):
            ConformalRegressor(NeverFitted()).fit(X, bad)
    model = ConformalRegressor(RULES, cv=4).fit(X, y)
    with pytest.raises(ValueError, match=r"coverage=90 must be a number between 0 and 1"):
        model.predict_interval(X, 90)
    with pytest.raises(ValueError, match="confidence is of whole groups, and fit was given none"):
        model.predict_interval(X, confidence=0.9)
    model.fit(X, y, groups=np.arange(24) // 2)
    assert model.n_units_ == 12
    # By default it is every group that counts.
    assert_array_equal(model.predict_interval(X, 0.7), model.predict_interval(X, 0.7, 0.7))
    assert np.isfinite(model.predict_interval(X, 0.7, 12 / 13)).all()
    with pytest.raises(ValueError, match="confidence='all' must be a number between 0 and 1"):
        model.predict_interval(X, confidence="all")
    with pytest.raises(ValueError, match=r"confidence=0\.95 needs 19 groups or more; there are 12"):
        model.predict_interval(X, 0.99, confidence=0.95)
    with pytest.raises(ValueError, match=r"confidence=2 must be a number between 0 and 1"):
        model.predict_interval(X, 0.9, confidence=2)
    # Where every group has one row, the coverage of rows is the confidence of groups.
    model.fit(X, y, groups=np.arange(24))
    assert_array_equal(model.predict_interval(X, 0.9, None), model.predict_interval(X, 0.5, 0.9))


def test_fit_that_is_interrupted_leaves_what_was_there(monkeypatch, rng):
    """And a cv of splits that can be read once is refused the second time."""
    X, y = bent(rng, 40)
    model = ConformalRegressor(RULES, cv=iter(list(KFold(4).split(X)))).fit(X, y)
    before = vars(model).copy()
    with pytest.raises(ValueError, match="gives no splits"):
        model.fit(np.hstack([X, X**2]), y)
    assert vars(model) == before
    model.set_params(cv=4)

    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("skanfis.intervals._scores.held_out_scores", interrupted)
    with pytest.raises(KeyboardInterrupt):
        model.fit(np.hstack([X, X**2]), y)
    assert vars(model) == before | {"cv": 4}
    assert len(model.predict_interval(X)[0]) == 40
