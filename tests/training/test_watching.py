"""What watches a training: rows held out, lines of text, scikit-learn's callbacks."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import sklearn
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor, regressor
from skanfis.datasets import make_jang_sinc
from skanfis.learning import VariableProjection
from skanfis.learning.data import StandardisedData
from skanfis.options import EarlyStopping
from skanfis.training import watching
from skanfis.training.watching import hold_out

from ..quick import quick

X, Y = make_jang_sinc()

needs_callbacks = pytest.mark.skipif(
    not hasattr(ANFISRegressor, "set_callbacks"),
    reason=f"scikit-learn {sklearn.__version__} has no callbacks; they come with 1.9",
)


class Recorder:
    """A callback that notes what it is told, and asks to stop after so many tasks."""

    def __init__(self, most=None):
        self.most, self.tasks, self.errors, self.torn_down = most, [], [], False

    def setup(self, estimator, context):
        self.max_subtasks = context.max_subtasks

    def teardown(self, estimator, context):
        self.torn_down = True

    def on_fit_task_begin(self, estimator, context):
        pass

    def on_fit_task_end(self, estimator, context, *, X, y, metadata, fitted_estimator):
        self.tasks.append(context.task_name)
        if fitted_estimator is not None:
            self.errors.append(np.mean((fitted_estimator.predict(X) - y) ** 2) / np.var(y))
        self.metadata = metadata
        return self.most is not None and len(self.tasks) >= self.most


def test_verbose_writes_a_line_per_iteration(capsys):
    model = ANFISRegressor(n_mfs=3, verbose=True).fit(X, Y)
    lines = capsys.readouterr().out.splitlines()
    told = "[ANFISRegressor] 9 rules, agreement {:.3g}, alpha {:.3g}, stiffness {:.3g}"
    assert lines[0] == told.format(model.agreement_, model.alpha_, model.stiffness_)
    assert len(lines) == 1 + model.n_iter_
    assert f"iteration {model.n_iter_}: loss {model.loss_curve_[-1]:.6g}" in lines[-1]
    quick().fit(X, Y)
    assert capsys.readouterr().out == ""


def test_verbose_tells_of_every_candidate_when_it_is_judged(capsys):
    """Not only after the search, which takes most of the time of a default fit."""
    model = ANFISRegressor(max_rules=2, verbose=True).fit(X, Y)
    lines = capsys.readouterr().out.splitlines()
    for one in model.structures_:
        error, cost = one["expected_error"], one["reading_cost"]
        of_error = f"expected error {error:.3g} sd of the target"
        told = f"{one['structure']}: {of_error}, {cost} numerals"
        assert f"[ANFISRegressor] {told}" in lines[: -1 - model.n_iter_]
    assert "candidates compared, " in lines[-1 - model.n_iter_]


@needs_callbacks
class TestCallbacks:
    def test_every_iteration_is_told_with_a_usable_model_and_none_changes_it(self):
        seen, weight = Recorder(), np.full(len(Y), 2.0)
        model = quick(n_mfs=3).set_callbacks(seen).fit(X, Y, sample_weight=weight)
        assert seen.tasks == ["iteration"] * model.n_iter_ + ["fit"]
        assert_allclose(seen.errors[:-1], model.loss_curve_[1:], rtol=1e-6)
        assert seen.max_subtasks == 500
        assert seen.torn_down
        assert_array_equal(seen.metadata["sample_weight"], 2.0)
        plain = quick(n_mfs=3).fit(X, Y, sample_weight=weight)
        assert_array_equal(plain.predict(X), model.predict(X))

    def test_wish_to_stop_is_honoured(self):
        model = quick(n_mfs=3).set_callbacks(Recorder(most=1)).fit(X, Y)
        assert model.n_iter_ == 1
        assert "callback ended the training" in model.status_

    def test_they_are_torn_down_where_fit_fails(self):
        seen = Recorder()
        model = ANFISRegressor(n_mfs=2).set_callbacks(seen)
        with pytest.raises(ValueError, match="NaN"):
            model.fit(np.full((5, 1), np.nan), np.arange(5.0))
        assert seen.torn_down

    def test_those_of_scikit_learn_work_through_searches(self, capsys):
        from sklearn.callback import ProgressBar, ScoringMonitor

        pytest.importorskip("rich")
        monitor = ScoringMonitor(scoring="neg_mean_squared_error")
        inner = quick().set_callbacks(monitor)
        pipeline = make_pipeline(StandardScaler(), inner)
        search = GridSearchCV(pipeline, {"anfisregressor__n_mfs": [2, 3]}, cv=2, n_jobs=1)
        search.set_callbacks(ProgressBar())
        search.fit(X, Y)
        assert "GridSearchCV" in capsys.readouterr().out
        assert np.isfinite(search.best_score_)


@pytest.mark.parametrize(
    ("where", "name"),
    [(watching.Printer, "__call__"), (regressor, "measure")],
    ids=["at the end of an iteration", "once the model is there"],
)
def test_an_estimator_that_is_interrupted_is_as_before(monkeypatch, where, name):
    """By Ctrl-C, as a terminal would send it."""

    def interrupt(*_):
        raise KeyboardInterrupt

    model = quick(verbose=True).fit(X, Y)
    before = dict(vars(model), n_mfs=3)
    monkeypatch.setattr(where, name, interrupt)
    with pytest.raises(KeyboardInterrupt):
        model.set_params(n_mfs=3).fit(X[:, :1], Y)
    assert vars(model) == before
    with pytest.raises(KeyboardInterrupt):
        quick(n_mfs=3, verbose=True).fit(X, Y)


@needs_callbacks
@pytest.mark.parametrize("settings", [{"max_iter": 0}, {"early_stopping": True}, {"loss": "huber"}])
def test_callbacks_are_given_the_data_as_they_were_given(settings):
    frame = pd.DataFrame(X, columns=["a", "b"])

    class Data(Recorder):
        def on_fit_task_end(self, estimator, context, *, X, fitted_estimator):
            self.tasks.append(X is frame)
            fitted_estimator.predict(X)

    seen = Data()
    model = quick(**settings)
    model.set_callbacks(seen).fit(frame, Y, sample_weight=np.arange(len(Y)))
    assert seen.tasks
    assert all(seen.tasks)


# Weights that let rules learn the noise.
FREE = {"agreement": 0.0, "alpha": 1e-6, "solver": VariableProjection(stiffness=0.0)}
LOOSE = FREE | {"early_stopping": True}


def overfitting():
    """Far too many rules for rows as noisy as these."""
    g = np.random.default_rng(0)
    X = g.uniform(-2, 2, (150, 2))
    return X, np.sin(2 * X[:, 0]) + 0.8 * g.normal(size=150)


@pytest.mark.parametrize("weighted_and_two", [False, True])
def test_best_parameters_are_restored(weighted_and_two):
    X, y = overfitting()
    y, weight = y[:, None], None
    if weighted_and_two:
        y = np.column_stack([y, X[:, 1]])
        weight = np.random.default_rng(1).uniform(0.5, 2.0, 150)
    model = ANFISRegressor(n_mfs=5, **LOOSE).fit(X, y, sample_weight=weight)
    weight = np.ones(150) if weight is None else weight
    seed = int(np.random.default_rng(0).integers(2**31 - 1))
    kept, held = hold_out(StandardisedData.of(X, y, weight), 0.1, seed)
    mean = np.average(y[kept], axis=0, weights=weight[kept])
    variance = np.average((y[kept] - mean) ** 2, axis=0, weights=weight[kept])
    # Rows beyond the range count at its edge, by what the rules say.
    said = replace(model.model_.with_out_of_bounds("clip"), target=None)
    left = y[held] - said.predict(X[held])
    loss = np.average(np.sum(left**2 / variance, axis=1), weights=weight[held])
    assert_allclose(loss, model.validation_loss_curve_.min(), rtol=1e-9)
    if not weighted_and_two:
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


def test_whole_groups_are_held_out(rng):
    groups = np.repeat(np.arange(10), 20)
    rows = StandardisedData.of(rng.normal(size=(200, 2)), rng.normal(size=(200, 1)))
    training, validation = hold_out(replace(rows, groups=groups), 0.3, 0)
    assert set(groups[training]).isdisjoint(groups[validation])
    assert np.unique(groups[validation]).size == 3
    # Every group has a level of its own: what is held out cannot have been learnt.
    X = (groups + 0.1 * rng.normal(size=200)).reshape(-1, 1)
    level = rng.normal(size=10)[groups]
    model = ANFISRegressor(n_mfs=10, **LOOSE)
    alone, grouped = (clone(model).fit(X, level, groups=given) for given in (None, groups))
    assert grouped.validation_loss_curve_.min() > 1.5 * alone.validation_loss_curve_.min()
    # A row without weight is none, and neither is its group.
    weight = (groups > 0).astype(float)
    weighted = clone(model).fit(X, level, weight, groups)
    without = clone(model).fit(X[20:], level[20:], groups=groups[20:])
    assert_array_equal(weighted.predict(X), without.predict(X))


def test_a_single_group_counts_as_none(rng):
    X = rng.normal(size=(60, 1))
    model = ANFISRegressor(n_mfs=2, early_stopping=True)
    alone, grouped = (clone(model).fit(X, X[:, 0] ** 2, groups=g) for g in (None, np.zeros(60)))
    assert_array_equal(grouped.predict(X), alone.predict(X))


def test_equal_rows_are_on_one_side(rng):
    X = rng.normal(size=(50, 2))[np.arange(200) % 50]
    training, held = hold_out(StandardisedData.of(X, rng.normal(size=(200, 1))), 0.2, 0)
    assert held.size == 40
    assert set(training % 50).isdisjoint(held % 50)
    same = StandardisedData.of(np.ones((9, 2)), rng.normal(size=(9, 1)))
    with pytest.raises(ValueError, match=r"of 9 rows \(1 of them distinct\), 0 to train on and 9"):
        hold_out(same, 0.2, 0)


@pytest.mark.parametrize(
    ("n_rows", "groups", "fraction", "what"),
    [
        (3, None, 0.1, "3 rows"),
        (10, None, 0.95, "10 rows"),
        (20, np.arange(20) % 2, 0.95, "20 rows in 2 groups"),
    ],
)
def test_too_few_rows_to_hold_out(n_rows, groups, fraction, what):
    X = np.random.default_rng(0).normal(size=(n_rows, 1))
    model = ANFISRegressor(n_mfs=1, early_stopping=EarlyStopping(fraction))
    told = f"validation_fraction={fraction} leaves, of {what}, .*: at.*more .*groups"
    with pytest.raises(ValueError, match=told):
        model.fit(X, X[:, 0], groups=groups)
