"""What data say against a constraint: against a t statistic, and on what is true."""

import numpy as np
import pytest

from skanfis import ANFISRegressor
from skanfis.bounds.constraints import Inequality
from skanfis.bounds.contradictions import contradicted

RISES = Inequality(0, 1.0, 0, 0.0, "rises")


def told(model, X, y, *inequalities, fixed=None):
    rows = X, y[:, None], np.arange(len(y))
    fixed = fixed or (np.empty((0, X.shape[1])), np.empty((0, 1)))
    return list(contradicted(model.model_, model.model_, inequalities, fixed, rows, 2.0))


@pytest.mark.parametrize("t", [-6.0, -3.0, 6.0])
def test_a_line_speaks_by_its_t_statistic(t, rng):
    """Of a single rule the mean change over its deviation is slope over standard error.

    So is the distance of a fixed point at the mean of the rows over that of the mean.
    """
    x, noise = rng.uniform(-1.0, 1.0, 200), rng.normal(size=200)
    design = np.column_stack([np.ones(200), x])
    noise -= design @ np.linalg.lstsq(design, noise, rcond=None)[0]
    variance = noise @ noise / 198.0
    slope = t * np.sqrt(variance / np.sum((x - x.mean()) ** 2))
    X, y = x[:, None], slope * x + noise
    line = ANFISRegressor(n_mfs=1, alpha=1e-9, agreement=0.0).fit(X, y)
    assert bool(told(line, X, y, RISES)) == (t < -4.0)
    fixed = np.array([[x.mean()]]), np.array([[y.mean() + t * np.sqrt(variance / 200.0)]])
    found = told(line, X, y, fixed=fixed)
    assert len(found) == (abs(t) > 4.0)
    assert all("The data contradict FixedPoint at [" in sentence for sentence in found)


@pytest.mark.parametrize("policy", ["clip", "linear"])
def test_a_point_out_of_range_is_held_to_what_is_answered_there(policy, rng):
    """However far it is: the edge, or what is followed from there, is what has to give way."""
    X = rng.uniform(-1.0, 1.0, (300, 1))
    y = np.tanh(3.0 * X[:, 0]) + 0.1 * rng.normal(size=300)
    free = ANFISRegressor(n_mfs=3, out_of_bounds=policy).fit(X, y)
    X = np.array([[1.2], [9.0]])
    for value, is_against in ((0.0, True), (free.model_.predict(X[1:])[0, 0] + 0.02, False)):
        found = told(free, X, X[:, 0], fixed=(X[1:], np.array([[value]])))
        assert bool(found) == is_against


@pytest.mark.theory
def test_what_is_true_is_not_contradicted():
    """Draws of a saturation, which is flat for half of the range, by three terms."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        X = rng.uniform(-1.0, 1.0, (100, 2))
        y = np.minimum(X[:, 0], 0.0) + 0.3 * rng.normal(size=100)
        free = ANFISRegressor(n_mfs=[3, 1]).fit(X, y)
        assert not told(free, X, y, RISES)
        assert not told(free, X, y, Inequality(0, -1.0, None, 0.0, "limit"))
