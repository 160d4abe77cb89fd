"""What is seen of a training from outside, and how it is ended."""

import numpy as np
import pandas as pd
import pytest
import sklearn
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.training import progress

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
    weights = [f"{w:.3g}" for w in (model.agreement_, model.alpha_, model.stiffness_)]
    assert lines[0] == "[ANFISRegressor] 9 rules, agreement {}, alpha {}, stiffness {}".format(
        *weights
    )
    assert len(lines) == 1 + model.n_iter_
    assert f"iteration {model.n_iter_}: loss {model.loss_curve_[-1]:.6g}" in lines[-1]
    quick().fit(X, Y)
    assert capsys.readouterr().out == ""


def test_verbose_tells_of_searches(capsys):
    ANFISRegressor(verbose=True).fit(X, Y)
    assert "candidates compared" in capsys.readouterr().out.splitlines()[0]


@needs_callbacks
class TestCallbacks:
    def test_every_iteration_is_told_with_a_usable_model(self):
        seen = Recorder()
        model = quick(n_mfs=3).set_callbacks(seen).fit(X, Y)
        assert seen.tasks == ["iteration"] * model.n_iter_ + ["fit"]
        assert_allclose(seen.errors[:-1], model.loss_curve_[1:], rtol=1e-6)
        assert seen.max_subtasks == 500
        assert seen.torn_down

    def test_wish_to_stop_is_honoured(self):
        model = quick(n_mfs=3).set_callbacks(Recorder(most=1)).fit(X, Y)
        assert model.n_iter_ == 1
        assert "callback asked for the end" in model.status_

    def test_weights_are_passed_on(self):
        seen = Recorder()
        quick().set_callbacks(seen).fit(X, Y, sample_weight=np.full(len(Y), 2.0))
        assert_array_equal(seen.metadata["sample_weight"], 2.0)

    def test_they_do_not_change_the_model(self):
        plain = quick(n_mfs=3).fit(X, Y)
        watched = quick(n_mfs=3).set_callbacks(Recorder()).fit(X, Y)
        assert_array_equal(plain.predict(X), watched.predict(X))

    def test_they_are_torn_down_where_fit_fails(self):
        seen = Recorder()
        model = ANFISRegressor(n_mfs=2).set_callbacks(seen)
        with pytest.raises(ValueError, match="NaN"):
            model.fit(np.full((5, 1), np.nan), np.arange(5.0))
        assert seen.torn_down

    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
    def test_those_of_scikit_learn_work_through_searches(self, capsys):
        from sklearn.callback import ProgressBar, ScoringMonitor

        pytest.importorskip("rich")
        monitor = ScoringMonitor(scoring="neg_mean_squared_error")
        inner = quick().set_callbacks(monitor)
        search = GridSearchCV(
            make_pipeline(StandardScaler(), inner),
            {"anfisregressor__n_mfs": [2, 3]},
            cv=2,
            n_jobs=1,
        )
        search.set_callbacks(ProgressBar())
        search.fit(X, Y)
        assert "GridSearchCV" in capsys.readouterr().out
        assert np.isfinite(search.best_score_)


def interrupt_after(monkeypatch, n_iter):
    """Ctrl-C at the end of an iteration, as a terminal would send it."""

    def interrupt(self, iteration, evaluation):
        if iteration == n_iter:
            raise KeyboardInterrupt

    monkeypatch.setattr(progress.Printer, "__call__", interrupt)


class TestInterrupt:
    def test_estimator_is_as_before(self, monkeypatch):
        model = quick(verbose=True).fit(X, Y)
        before = model.predict(X)
        interrupt_after(monkeypatch, 1)
        with pytest.raises(KeyboardInterrupt):
            model.set_params(n_mfs=3).fit(X, Y)
        assert_array_equal(model.predict(X), before)
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
