"""Deviations in few digits and products: against those in double precision, all over the range."""

import numpy as np
import pytest
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.bounds import FixedPoint
from skanfis.learning import VariableProjection
from skanfis.shortest import points_of_range

SETTINGS = {
    "grid": {},
    "sharp": {"mf": "triangular"},
    "clusters": {"partition": KMeans(n_clusters=5, n_init=1, random_state=0)},
    "order 0": {"order": 0},
    "one slope": {"consequent_features": [1]},
    "known": {"constraints": [FixedPoint([0.2, 0.1, 0.0, 0.3], 0.3)]},
    "outputs": {},
    "far row": {},
    "offset": {},
}


def fitted(kind):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (400, 4))
    y = np.sin(3.0 * X[:, 0]) * X[:, 1] + X[:, 3] + 0.1 * rng.normal(size=400)
    if kind == "outputs":
        y = np.column_stack([y, 1e3 * y**2 + rng.normal(size=400)])
    if kind == "offset":
        y += 1e6
    if kind == "far row":
        X[0, 0] = 1e3
    solver = VariableProjection(tol=0.1, stiffness=1e-2)
    given = {"max_iter": 30, "agreement": 0.01, "alpha": 1e-3, "solver": solver}
    if "partition" not in SETTINGS[kind]:
        given["n_mfs"] = [3, 3, 1, 2] if kind != "known" else [3, 2, 1, 1]
    return ANFISRegressor(**given | SETTINGS[kind]).fit(X, y).model_


@pytest.mark.parametrize("kind", SETTINGS)
def test_quick_deviations_are_right_to_a_thousandth_all_over_the_range(kind):
    model = fitted(kind)
    rng = np.random.default_rng(1)
    everywhere = rng.uniform(model.minimum, model.maximum, (2000, 4))
    # Near terms, and in corners of the box.
    corners = rng.choice([0.0, 1.0], (200, 4)) * (model.maximum - model.minimum) + model.minimum
    X = np.vstack([everywhere, points_of_range(model, 2000, rng).T, corners])
    X = np.clip(X, model.minimum, model.maximum)
    exact, (outputs, quick) = model.standard_deviation(X), model.predict_with_deviation(X)
    part = quick / exact - 1.0
    assert np.abs(part).max() < 1e-3
    assert np.sqrt(np.mean(part**2)) < 2e-4
    np.testing.assert_allclose(outputs, model.predict(X), rtol=1e-12)
    tables, double = model.posterior._shortest(model), model.posterior._double(model)
    assert tables.dtype == np.float32
    # Of sums as large as that single precision leaves no digits.
    assert kind not in ("grid", "offset") or tables.is_narrow == (kind == "grid")
    if kind in ("grid", "one slope", "outputs"):
        assert tables.form.table.size < 0.75 * double.form.table.size
        assert tables.n_added < double.n_added


def test_where_no_quick_tables_are_right_they_are_in_double_precision(monkeypatch):
    model = fitted("grid")
    monkeypatch.setattr("skanfis.shortest.DIGITS", 1e-12)
    X = np.random.default_rng(2).uniform(model.minimum, model.maximum, (50, 4))
    assert (model.predict_with_deviation(X)[1] == model.standard_deviation(X)).all()
