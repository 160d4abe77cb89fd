"""Many rows: premises from a sample, a step on all rows, and the error of training on all."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.mixture import GaussianMixture

from skanfis import ANFISRegressor
from skanfis.learning import VariableProjection, sampling
from skanfis.learning.data import StandardisedData

from ..memory import traced
from ..quick import quick

N_ROWS, N_SAMPLE = 8000, 2000


G = np.random.default_rng(0)
X = G.uniform(-1.0, 1.0, (N_ROWS, 2))
Y = np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.1 * G.standard_normal(N_ROWS)


@pytest.fixture
def few_are_many(monkeypatch):
    monkeypatch.setattr(sampling, "MANY_ROWS", N_ROWS - 1)
    monkeypatch.setattr(sampling, "SAMPLE_ROWS", N_SAMPLE)


@pytest.fixture
def full_passes(monkeypatch):
    """Passes over all rows, by name."""
    seen = []
    whole = StandardisedData.sum

    def counted(self, one_pass, *args):
        if self.n_rows == N_ROWS:
            seen.append(type(one_pass).__name__)
        return whole(self, one_pass, *args)

    monkeypatch.setattr(StandardisedData, "sum", counted)
    return seen


def test_threshold_is_where_the_docs_say():
    assert (sampling.MANY_ROWS, sampling.SAMPLE_ROWS) == (100_000, 20_000)


def test_repeated_rows_are_no_weights_that_a_clusterer_must_take(few_are_many):
    mixture = GaussianMixture(3, random_state=0)
    assert quick(partition=mixture).fit(X.round(1), Y.round(1)).n_rules_ == 3


@pytest.mark.theory
@pytest.mark.parametrize("settings", [{"n_mfs": 3}, {"max_rules": 4}])
def test_weights_that_are_all_alike_are_of_no_account_below_one(few_are_many, settings):
    """However small: as many rows as there are, and not what the weights add up to."""
    plain = ANFISRegressor(**settings).fit(X, Y)
    light = ANFISRegressor(**settings).fit(X, Y, sample_weight=np.full(N_ROWS, 1e-4))
    assert light.n_rules_ == plain.n_rules_
    told, deviation = light.predict(X[:200], return_std=True)
    expected, expected_deviation = plain.predict(X[:200], return_std=True)
    assert_allclose(told, expected, rtol=0, atol=1e-6)
    assert_allclose(deviation, expected_deviation, rtol=1e-5)


@pytest.mark.theory
def test_same_error_after_a_handful_of_passes(few_are_many, full_passes, monkeypatch):
    quick = ANFISRegressor(n_mfs=3, simplicity=0.0).fit(X, Y)
    assert full_passes[:3] == ["FirstPass", "JointPass", "FirstPass"]
    assert len(full_passes) <= 5
    monkeypatch.setattr(sampling, "MANY_ROWS", N_ROWS)
    full = ANFISRegressor(n_mfs=3, simplicity=0.0).fit(X, Y)
    # Agreement may have been raised on the sample and not on all rows.
    assert quick.loss_curve_[-1] < 1.01 * full.loss_curve_[-1]
    new = np.random.default_rng(1).uniform(-0.99, 0.99, (2000, 2))
    difference = quick.predict(new) - full.predict(new)
    # Less than the noise's own effect on 9 rules of 3 coefficients.
    assert np.sqrt(np.mean(difference**2)) < 0.1 * np.sqrt(27 / N_ROWS)


@pytest.mark.parametrize(
    "settings", [{"solver": "hybrid", "max_iter": 3}, {"solver": "lse"}], ids=str
)
def test_every_way_of_training_ends_on_all_rows(few_are_many, settings):
    settings = {"solver": VariableProjection(tol=1e-2)} | settings
    model = ANFISRegressor(n_mfs=2, **settings).fit(X, Y)
    residual = (Y - model.predict(X)) / Y.std()
    assert_allclose(np.mean(residual**2), model.loss_curve_[-1], rtol=1e-9)
    assert model.model_.rule_rows.sum() == pytest.approx(N_ROWS)


def test_memory_does_not_grow_with_the_rows(few_are_many):
    """A file of single precision may be mapped to memory that would not hold a double per row."""
    many = np.tile(X.astype(np.float32), (200, 1))
    target = many[:, 0] * many[:, 1]
    with traced() as peak:
        quick([2, 1], solver="lse").fit(many, target)
    assert peak[0] < many.nbytes
