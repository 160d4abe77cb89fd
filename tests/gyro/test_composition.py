"""Physics plus what it leaves: sums, nested parameters, and groups through Pipelines."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.compose import make_column_transformer
from sklearn.linear_model import LinearRegression
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.gyro.compose import ResidualRegressor
from skanfis.gyro.physics import OpenLoopArcsineRegressor

pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")


LOG = make_ofog(n_devices=1, n_runs=4, duration=2400, sampling_interval=20, random_state=0)
X, RATE = LOG[["output", "temperature", "time"]], LOG["rate"].to_numpy()


def test_the_second_learns_what_the_first_leaves():
    """A line and a parabola orthogonal to it: each part finds its own."""
    x = np.linspace(-1.0, 1.0, 41)[:, None]
    y = 3.0 * x[:, 0] + 2.0 * (x[:, 0] ** 2 - np.mean(x**2))
    square = make_pipeline(PolynomialFeatures(2), LinearRegression())
    model = ResidualRegressor(LinearRegression(), square).fit(x, y)
    assert model.base_.coef_ == pytest.approx(3.0)
    assert model.residual_[-1].coef_ == pytest.approx([0.0, 0.0, 2.0], abs=1e-12)
    np.testing.assert_allclose(model.predict(x), y, atol=1e-12)


def test_rounds_take_from_the_base_what_is_not_its_own(rng):
    """Two columns that go together: least squares in turn ends where least squares of both is."""
    x = rng.normal(size=(200, 2)) @ [[1.0, 0.7], [0.0, 0.7]]
    y = 2.0 * x[:, 0] - 1.0 * x[:, 1]
    columns = [make_column_transformer(("passthrough", [j])) for j in (0, 1)]
    parts = [make_pipeline(column, LinearRegression()) for column in columns]
    distance = {}
    for n_rounds in (1, 3, 60):
        model = ResidualRegressor(*parts, n_rounds=n_rounds).fit(x, y)
        slopes = [model.base_[-1].coef_[0], model.residual_[-1].coef_[0]]
        distance[n_rounds] = np.abs(np.subtract(slopes, [2.0, -1.0])).max()
    assert distance[1] > 0.5
    assert distance[3] < 0.5 * distance[1]
    assert distance[60] < 1e-6
    with pytest.raises(ValueError, match="n_rounds == 0"):
        ResidualRegressor(n_rounds=0).fit(x, y)


def test_what_the_parts_do_not_have_is_said(rng):
    X, y = rng.normal(size=(9, 2)), np.arange(9.0)
    model = ResidualRegressor(LinearRegression(), KNeighborsRegressor(2)).fit(X, y)
    for method in (model.in_bounds, model.coverage):
        with pytest.raises(ValueError, match=f"KNeigh.* has no method '{method.__name__}'"):
            method(X)


def test_groups_reach_the_part_that_chooses_by_them(rng):
    """A line, and runs of two inputs that are off by so much each: rules would learn them."""
    run = np.repeat(np.arange(12), 12)
    x = np.column_stack([rng.uniform(-1, 1, run.size), rng.uniform(-1, 1, 12)[run]])
    y = 3 * x[:, 0] + rng.normal(size=12)[run] + 0.05 * rng.normal(size=run.size)
    part = make_pipeline(StandardScaler(), ANFISRegressor(partition="grid", max_rules=6))
    model = ResidualRegressor(LinearRegression(), part)
    n_rules = [model.fit(x, y, groups=g).residual_[-1].n_rules_ for g in (None, run)]
    # Rows of one run tell of each other; another run knows nothing of them.
    assert n_rules[0] > 3
    assert n_rules[1] == 1
    alone = clone(part).fit(x, y - model.base_.predict(x), anfisregressor__groups=run)
    np.testing.assert_array_equal(model.residual_.predict(x), alone.predict(x))


def test_a_base_that_refuses_training_rows_is_refused():
    base = OpenLoopArcsineRegressor(max_phase=0.3, out_of_bounds="nan")
    with pytest.raises(ValueError, match=r"base has no finite prediction for .* training rows"):
        ResidualRegressor(base, LinearRegression()).fit(X, RATE)


def test_a_fit_that_fails_leaves_both_parts_of_the_one_before():
    model = ResidualRegressor(OpenLoopArcsineRegressor(), LinearRegression()).fit(X, RATE)
    before = model.predict(X)
    model.set_params(residual=LinearRegression(positive="no"))
    with pytest.raises(ValueError, match="positive"):
        model.fit(X[["output", "temperature"]], 2.0 * RATE)
    assert model.n_features_in_ == 3
    np.testing.assert_array_equal(model.predict(X), before)
