"""ANFISRegressor as a user meets it: what it learns, what it says, and the tools it works with."""

import threading
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn import config_context
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor, blocks
from skanfis.inspection import rules_html
from skanfis.learning import Hybrid, VariableProjection
from skanfis.learning import data as rows
from skanfis.learning.data import StandardisedData
from skanfis.membership import MEMBERSHIPS

from . import oracles
from .quick import quick, with_few_candidates

NAMES = ["time", "temperature", "rate"]
KMEANS = KMeans(n_clusters=4, n_init=1, random_state=0)


def surface():
    """Seconds, degrees Celsius and degrees per second; a smooth error that depends on all three."""
    rng = np.random.default_rng(0)
    X = rng.uniform([0.0, -40.0, -300.0], [1800.0, 85.0, 300.0], (240, 3))
    time, temperature, rate = X.T
    y = np.exp(-time / 600.0) + 1e-4 * (temperature - 25.0) ** 2 + np.tanh(rate / 150.0)
    y += 0.2 * np.sin(temperature / 30.0) * rate / 300.0
    return X, 0.02 * y


X, Y = surface()


def same_bits(one, other):
    """Whether two fitted models are one and the same."""
    assert_array_equal(one.predict(X), other.predict(X))
    assert_array_equal(one.consequents_, other.consequents_)
    assert one.memberships_ == other.memberships_
    assert one.initial_memberships_ == other.initial_memberships_
    assert_array_equal(one.loss_curve_, other.loss_curve_)
    assert_array_equal(one.coverage(X), other.coverage(X))


def textbook_strengths(estimator, memberships, data):
    names = getattr(estimator, "feature_names_in_", [f"x{j}" for j in range(data.shape[1])])
    return oracles.textbook_strengths(memberships, estimator.rules_, names, data)


@pytest.mark.parametrize("alpha", [1e-12, 1e-6, 1e-2, 1.0])
@pytest.mark.parametrize("weighted", [False, True])
def test_one_rule_is_ridge_regression_of_standardised_data(alpha, weighted):
    # (1/2) mean squared error + alpha/2 |b|^2 is Ridge's |error|^2 + n alpha |b|^2, times 1/(2 n);
    # with the target's mean gone, the intercept of the standardised problem is zero.
    weight = np.random.default_rng(0).uniform(0.1, 3.0, len(X)) if weighted else np.ones(len(X))
    model = ANFISRegressor(n_mfs=1, alpha=alpha).fit(X, Y, weight if weighted else None)
    scaler = StandardScaler().fit(X, sample_weight=weight)
    ridge = Ridge(alpha=alpha * weight.sum()).fit(scaler.transform(X), Y, sample_weight=weight)
    expected = ridge.predict(scaler.transform(X))
    # The ridge scales with the target: Y in place of its standardised form is the same problem.
    assert_allclose(model.predict(X), expected, rtol=0, atol=1e-12)
    assert model.n_rules_ == 1
    assert model.n_iter_ == 1
    assert model.memberships_ == []


SETTINGS = {
    "constant rules": {"n_mfs": 2, "order": 0},
    "clusters": {"partition": KMEANS},
    "clusters of bells": {"partition": KMEANS, "mf": "bell"},
    "one rule": {"n_mfs": 1},
    **{mf: {"n_mfs": [1, 2, 3], "mf": mf} for mf in sorted(MEMBERSHIPS)},
}


@pytest.mark.theory
@pytest.mark.parametrize(("place", "settings"), list(enumerate(SETTINGS.values())), ids=SETTINGS)
def test_attributes_reproduce_the_predictions(place, settings):
    n_outputs = 1 + place % 2
    scale, offset = np.array([1e-6, 1e6, 1.0]), np.array([1.0, -3e6, 1e4])
    data = X / np.ptp(X, axis=0) * scale + offset
    targets = Y if n_outputs == 1 else np.column_stack([Y, 1e3 + np.cos(X[:, 1] / 40.0)])
    model = quick(**settings).fit(data, targets)
    # What the rules say, before it is held within the limits of the target.
    model.model_ = replace(model.model_, target=None)
    # p0 + p1 x1 + ... cancels where x is far from the origin, by 10^6 spans for the first column.
    strengths = textbook_strengths(model, model.memberships_, data)
    consequents = model.consequents_.reshape(model.n_rules_, 4, n_outputs)
    expected = oracles.textbook_predict(strengths, consequents, data).reshape(targets.shape)
    error = np.abs(expected - model.predict(data)) / np.ptp(targets, axis=0)
    assert error.max() < 1e-8
    assert_allclose(model.strengths(data).T, strengths, rtol=0, atol=1e-8)


FREE = {"agreement": 0.0, "alpha": 1e-12, "solver": VariableProjection(tol=0.01, stiffness=0.0)}


@pytest.mark.parametrize("settings", [{"n_mfs": 1}, {"n_mfs": 2, "max_iter": 0}, {"n_mfs": 2}])
def test_run_that_is_at_its_end_at_once_counts_as_one_iteration(settings):
    model = ANFISRegressor(**settings).fit(X, X[:, 0])
    assert model.n_iter_ == 1
    assert model.loss_curve_.shape == (2,)
    assert model.loss_curve_[0] == model.loss_curve_[1]


def test_loss_curve_goes_from_the_start_to_the_end():
    # Where nothing is searched for, training starts from the initial memberships; and with next to
    # no penalty, the loss is that of least squares. Not so many iterations that it plays a part.
    model = ANFISRegressor(n_mfs=2, **FREE).fit(X, Y)
    assert model.loss_curve_.shape == (model.n_iter_ + 1,)
    assert (np.diff(model.loss_curve_) < 0).all()
    strengths = textbook_strengths(model, model.initial_memberships_, X)
    standardised = StandardScaler().fit_transform(X)
    basis = np.column_stack([np.ones(len(X)), standardised])
    design = np.einsum("rn,ni->nri", strengths, basis).reshape(len(X), -1)
    residual = Y - design @ np.linalg.lstsq(design, Y, rcond=None)[0]
    assert_allclose(model.loss_curve_[0], np.mean(residual**2) / Y.var(), rtol=1e-6)
    end = np.mean((Y - model.predict(X)) ** 2) / Y.var()
    assert_allclose(model.loss_curve_[-1], end, rtol=1e-6)


def test_max_iter_reached_is_said():
    solver = VariableProjection(tol=1e-9)
    with pytest.warns(ConvergenceWarning, match=r"max_iter=2: .* increase max_iter"):
        model = quick(max_iter=2, solver=solver).fit(X, Y)
    assert model.n_iter_ == 2
    assert "max_iter" in model.status_


def test_one_column_of_targets_is_the_vector_in_another_shape():
    flat, column = (quick().fit(X, y) for y in (Y, Y[:, None]))
    assert_array_equal(column.predict(X), flat.predict(X)[:, None])
    assert_array_equal(column.consequents_, flat.consequents_[:, :, None])


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
@pytest.mark.parametrize(
    "settings",
    # Every solver takes the same passes over the rows: one that asks for all of them, and Jang's.
    [
        {"max_rules": 2},
        {"n_mfs": 2, "loss": "huber"},
        {"partition": KMEANS, "mf": "bell", "solver": VariableProjection(stiffness=1e-3)},
        {"n_mfs": 2, "solver": Hybrid(stiffness=1e-3)},
    ],
    ids=["search", "huber", "clusters", "hybrid"],
)
def test_number_of_workers_changes_no_bit(monkeypatch, settings):
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 1)
    monkeypatch.setattr(blocks, "FEWEST_ROWS", 8)
    monkeypatch.setattr(rows, "_BLOCKS_PER_CHUNK", 3)
    with_few_candidates(monkeypatch)
    threads, read = set(), StandardisedData.read

    def read_and_remember(self, part):
        threads.add(threading.get_ident())
        return read(self, part)

    monkeypatch.setattr(StandardisedData, "read", read_and_remember)
    # Eight blocks in three chunks.
    data, target = X[:64], Y[:64]
    weight = np.random.default_rng(0).uniform(0.5, 2.0, len(data))
    models = {}
    for n_jobs in (None, 2):
        threads.clear()
        model = ANFISRegressor(n_jobs=n_jobs, agreement=0.1, alpha=0.01, max_iter=3, **settings)
        models[n_jobs] = model.fit(data, target, weight)
        # Else this test compares nothing.
        assert (len(threads) > 1) == (n_jobs == 2)
    same_bits(models[2], models[None])


LIBRARIES = pytest.mark.parametrize("library", ["pandas", "polars"])


def frame_of(library, data, names):
    library = pytest.importorskip(library)
    return library.DataFrame({name: data[:, j] for j, name in enumerate(names)})


@LIBRARIES
def test_data_frame_gives_names_to_the_terms_behind_a_scaler_too(library):
    frame = frame_of(library, X, NAMES)
    model = quick().fit(frame, frame_of(library, Y[:, None], ["error"])["error"])
    assert_array_equal(model.feature_names_in_, NAMES)
    assert [term["input"] for term in model.memberships_] == [n for n in NAMES for _ in range(2)]
    # A frame's memory runs along its columns, and so do sums.
    expected = quick().fit(X, Y).predict(X)
    assert_allclose(model.predict(frame), expected, rtol=0, atol=1e-10)
    pipeline = make_pipeline(StandardScaler(), quick()).set_output(transform=library)
    pipeline.fit(frame, Y)
    assert pipeline[-1].memberships_[-1]["input"] == "rate"
    # Standardised before or not: the fit depends on no units.
    assert_allclose(pipeline.predict(frame), expected, rtol=0, atol=1e-8 * np.ptp(Y))


def test_frame_without_names_that_are_text_is_an_array():
    model = quick().fit(pd.DataFrame(X), Y)
    assert not hasattr(model, "feature_names_in_")
    assert model.memberships_[0]["input"] == "x0"
    assert_array_equal(model.predict(pd.DataFrame(X)), model.predict(X))


@pytest.mark.parametrize(
    "n_mfs", [2, np.int64(2), [2, 2, 2], (2, 2, 2), np.array([2, 2, 2]), pd.Series([2, 2, 2])]
)
def test_number_of_terms_in_any_form(n_mfs):
    model = ANFISRegressor(n_mfs=n_mfs, solver="lse").fit(X, Y)
    same_bits(model, ANFISRegressor(n_mfs=2, solver="lse").fit(X, Y))
    assert model.n_mfs is n_mfs


def test_representations_show_what_was_changed_and_the_rules():
    model = ANFISRegressor(n_mfs=[2, 3, 2], mf="bell")
    assert repr(model) == "ANFISRegressor(mf='bell', n_mfs=[2, 3, 2])"
    fitted = clone(model).set_params(solver="lse").fit(X, Y)
    rules = rules_html(fitted)
    for html in (fitted._repr_html_(), fitted._repr_mimebundle_()["text/html"]):
        assert html.endswith(rules)
        assert "sk-container" in html
    assert rules[:40] not in model._repr_html_()
    with config_context(display="text"):
        assert list(fitted._repr_mimebundle_()) == ["text/plain"]
