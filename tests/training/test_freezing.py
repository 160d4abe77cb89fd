"""How far the tangent is followed: against the definition row by row."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis import ANFISRegressor
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.options import LinearExtrapolation
from skanfis.policies import FARTHEST, MAX_EXTRAPOLATION

from ..quick import quick

DISTANCES = [MAX_EXTRAPOLATION, 1.0, 2.0, 5.0, 20.0, FARTHEST]


def quartiles(column):
    """The ends of the inner half of a column, each row of which counts once."""
    ordered = np.sort(column)
    quarter = int(np.ceil(0.25 * ordered.size)) - 1
    return ordered[quarter], ordered[-1 - quarter]


def by_definition(model, X, Y):
    """The distance that leaves the least of rows beyond the quartiles, row by row."""
    frozen, ends = model.model_, [quartiles(column) for column in X.T]
    left = np.zeros(len(DISTANCES))
    n_beyond = 0
    for x, y in zip(X, Y, strict=True):
        nearest = np.array([min(max(v, a), b) for v, (a, b) in zip(x, ends, strict=True)])
        if (nearest == x).all():
            continue
        n_beyond += 1
        value, slope = frozen.predict(nearest[None])[0], frozen.gradient(nearest[None])[0]
        for k, distance in enumerate(DISTANCES):
            way = [
                min(max(v, -distance * h), distance * h)
                for v, h in zip(x - nearest, frozen.spread, strict=True)
            ]
            error = (value + way @ slope - y) / frozen.target.spread
            left[k] += error @ error
    left /= n_beyond
    left += np.sum((frozen.posterior.noise / frozen.target.spread) ** 2)
    best = int(np.argmin(left))
    return DISTANCES[best] if left[best] < 0.25 * left[0] else MAX_EXTRAPOLATION


@pytest.mark.parametrize("case", range(6))
def test_distance_is_that_of_the_definition(case):
    g = np.random.default_rng(case)
    X = [g.normal, g.lognormal, g.uniform][case % 3](size=(120, 3))
    Y = np.column_stack([X @ [1.0, -2.0, 0.5], np.tanh(X[:, 0]) + X[:, 1]])[:, : 1 + case % 2]
    Y = Y + [0.0, 0.05][case // 3] * g.normal(size=Y.shape)
    model = quick(2).fit(X, Y)
    assert model.model_.rows_extrapolation == by_definition(model, X, Y)


def test_weights_are_copies_and_order_is_of_no_account(rng):
    X = rng.lognormal(size=(60, 2))
    y = X[:, 0] * X[:, 1]
    times = rng.integers(1, 4, size=60)
    told = [
        quick(2).fit(X, y, sample_weight=times).model_.rows_extrapolation,
        quick(2).fit(np.repeat(X, times, axis=0), np.repeat(y, times)).model_.rows_extrapolation,
        quick(2).fit(X[::-1], y[::-1], sample_weight=times[::-1]).model_.rows_extrapolation,
    ]
    assert_array_equal(told, told[0])


def test_auto_of_a_model_as_given_is_its_own_limit(rng):
    """And not that of the policy with which it was taken."""
    X = rng.uniform(size=(100, 2))
    model = quick(2).fit(X, X[:, 0] ** 2)
    unknown = replace(model.model_, rows_extrapolation=None, posterior=None, max_extrapolation=2.0)
    policy = LinearExtrapolation(np.inf)
    given = ANFISRegressor(partition=unknown, max_iter=0, out_of_bounds=policy).fit(X, X[:, 0])
    given.set_params(out_of_bounds="linear")
    with pytest.warns(OutOfBoundsWarning, match="max_extrapolation=2.0"):
        found = given.predict(X + 5.0)
    assert_array_equal(found, unknown.predict(X + 5.0)[:, 0])
