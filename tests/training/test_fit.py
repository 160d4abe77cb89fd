"""A whole fit: clusterers, and what "auto" decides."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn.cluster import AgglomerativeClustering, KMeans

from skanfis import ANFISRegressor
from skanfis.exceptions import UnderdeterminedWarning
from skanfis.learning import VariableProjection
from skanfis.search.request import _labels


def data(n_rows=120):
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (n_rows, 2))
    return X, np.sin(4.0 * X[:, 0]) + X[:, 1] ** 2


def test_clusterer_without_weights_sees_repeated_rows(rng):
    table, times = rng.normal(size=(40, 2)), rng.integers(1, 9, 40)
    ward = AgglomerativeClustering(3)
    expected = ward.fit_predict(table.repeat(times, axis=0))[np.cumsum(times) - times]
    assert_array_equal(_labels(ward, 0, table, times.astype(float)), expected)
    assert (ward.fit_predict(table) != expected).any()


def test_clusterer_that_takes_weights_is_given_them(rng):
    table, weight = rng.normal(size=(60, 2)), 10.0 ** rng.uniform(0.0, 3.0, 60)
    kmeans = KMeans(3, n_init=1, random_state=0)
    expected = kmeans.fit(table, sample_weight=weight).labels_
    assert_array_equal(_labels(kmeans, 0, table, weight), expected)
    assert (kmeans.fit(table).labels_ != expected).any()


WEIGHTS = ("agreement_", "alpha_", "slope_alpha_", "stiffness_")


SEARCHED = {"partition": "grid", "max_rules": 4, "simplicity": 0.5}


@pytest.mark.parametrize("settings", [{"n_mfs": 2}, SEARCHED])
def test_weights_given_are_obeyed(settings):
    X, y = data()
    given = {"agreement": 1e-3, "alpha": 0.02, "solver": VariableProjection(stiffness=1e-3)}
    model = ANFISRegressor(**settings, **given).fit(X, y)
    assert model.n_rules_ > 1
    assert [getattr(model, name) for name in WEIGHTS] == [1e-3, 0.02, 0.02, 1e-3]
    # One that is given leaves the others to be found.
    model = ANFISRegressor(**settings, agreement=1e-3).fit(X, y)
    assert model.agreement_ == 1e-3
    assert model.alpha_ not in (0.0, 1e-3)
    model = ANFISRegressor(**settings, alpha=0.02).fit(X, y)
    assert (model.alpha_, model.slope_alpha_) == (0.02, 0.02)
    assert model.agreement_ > 0.0
    assert model.stiffness_ > 0.0


@pytest.mark.parametrize("n_rows", [11, 12])
def test_fewer_distinct_rows_than_parameters_are_reported(n_rows, recwarn):
    X, y = data(n_rows)
    model = ANFISRegressor(n_mfs=2, solver=VariableProjection(tol=0.5))
    model.fit(np.tile(X, (3, 1)), np.tile(y, 3))
    caught = [w for w in recwarn if w.category is UnderdeterminedWarning]
    assert len(caught) == (n_rows < 12)
    for warning in caught:
        assert "12 consequent parameters for 11 distinct training rows" in str(warning.message)


@pytest.mark.theory
def test_rules_hold_one_by_one_where_that_is_cheap():
    """A dip and a rise: rules that cancel one another fit them, and so do rules that agree more."""
    rng = np.random.default_rng(1)
    x = rng.uniform(0.0, 1.0, 130)
    truth = 1.5 * np.exp(-50.0 * (x - 0.6) ** 2) - 3.0 * np.exp(-100.0 * (x - 0.35) ** 2)
    y = truth + 0.3 * rng.normal(size=x.size)

    def alone_and_error(agreement="auto"):
        model = ANFISRegressor(n_mfs=5, agreement=agreement).fit(x[:, None], y)
        strengths, lines = model.strengths(x[:, None]), model.consequents_
        predicted = model.predict(x[:, None])
        strongest = lines[strengths.argmax(axis=1)]
        away = strongest[:, 0] + strongest[:, 1] * x - predicted
        error = np.sqrt(np.mean((predicted - truth) ** 2))
        return np.sqrt(np.mean(away**2)) / y.std(), error, model.agreement_

    alone, error, agreement = alone_and_error()
    assert alone <= 0.5 + 1e-9
    # What is asked for is obeyed, whatever it does to the rules.
    apart, error_apart, obeyed = alone_and_error(0.05 * agreement)
    assert apart > alone
    assert obeyed == 0.05 * agreement
    assert error < 1.15 * error_apart
