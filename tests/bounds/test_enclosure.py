"""Bounds on boxes against the predictions in them: every family, rule base, order and policy."""

import numpy as np
import pytest

from skanfis import ANFISRegressor
from skanfis.bounds.enclosure import Enclosure

from ..export.every_model import CASES

N_BOXES = 24
POLICIES = [("linear", 0.5), ("clip", 0.5), ("linear", np.inf)]


def some_boxes(rng, model):
    """Of all sizes, in and out of the range; on some only rounding errors are left."""
    width, least = model.maximum - model.minimum, np.repeat([-17.0, -7.0], N_BOXES // 2)
    size = 10.0 ** rng.uniform(least[:, None], 0.2, (N_BOXES, 3)) * width
    middle = rng.uniform(model.minimum - 0.4 * width, model.maximum + 0.4 * width, (N_BOXES, 3))
    return (middle - 0.5 * size).T, (middle + 0.5 * size).T


def points_in(rng, low, high):
    """A row in every box, often at an edge."""
    u = rng.uniform(size=low.shape)
    u[rng.uniform(size=u.shape) < 0.2] = 0.0
    u[rng.uniform(size=u.shape) < 0.2] = 1.0
    return np.clip(low + u * (high - low), low, high)


# All of them, with many more rows, are gone through in benchmarks/certain.py.
@pytest.mark.theory
@pytest.mark.parametrize("number", range(0, len(CASES), 3))
def test_nothing_is_beyond_the_bounds(number):
    rng = np.random.default_rng(number)
    model = CASES[number].model.with_out_of_bounds(*POLICIES[number % 3])
    low, high = some_boxes(rng, model)
    output, j = model.n_outputs - 1, number % 3
    above, below = (Enclosure(model, output, sign) for sign in (1.0, -1.0))
    upper, lower = above.values(low, high)[0], -below.values(low, high)[0]
    steepest, least = above.slope(low, high, j)[0], -below.slope(low, high, j)[0]
    assert np.isfinite(upper).all()
    assert np.isfinite(lower).all()
    scale = np.abs(upper - lower).max() / (model.maximum - model.minimum)[j]
    for _ in range(5):
        x = points_in(rng, low, high)
        y = model.predict(x.T)[:, output]
        assert (lower <= y).all()
        assert (y <= upper).all()
        inside = model.in_bounds(x.T)
        slope = model.gradient(x.T)[inside, j, output]
        assert (least[inside] <= slope).all()
        assert (slope <= steepest[inside]).all()
        # The mean slope between two rows is one of those between them, out of range too.
        other = x.copy()
        other[j] = points_in(rng, low, high)[j]
        way = other[j] - x[j]
        far = np.abs(way) > 1e-4 * (model.maximum - model.minimum)[j]
        mean = (model.predict(other.T)[:, output] - y)[far] / way[far]
        slack = 1e-9 * np.abs(mean) + 1e-12 * scale
        assert (least[far] <= mean + slack).all()
        assert (mean - slack <= steepest[far]).all()


def test_slopes_hold_where_one_rule_speaks_alone(rng):
    """They are zero there, but for the rounding of that rule's own slope."""
    X = rng.uniform(size=(200, 2))
    y = np.sin(6.0 * X[:, 0]) + X[:, 1] ** 2
    model = ANFISRegressor(n_mfs=3, mf="triangular", order=0, max_iter=5).fit(X, y).model_
    low = rng.uniform(model.minimum, model.maximum, (400, 2)).T
    high = np.minimum(low * (1.0 + 1e-13), model.maximum[:, None])
    for j in range(2):
        slope = model.gradient(low.T)[:, j, 0]
        for sign in (-1.0, 1.0):
            assert (sign * slope <= Enclosure(model, 0, sign).slope(low, high, j)[0]).all()
