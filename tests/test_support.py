"""Where the data of every rule lie, against the definitions, and what coverage makes of it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor, blocks
from skanfis.learning.data import StandardisedData
from skanfis.learning.firing import RuleFiring, rule_support

from . import oracles


def brute_force(rows, antecedent, n_coefficients):
    """Share, centre, covariance and radius of every rule; one rule and one row at a time."""
    Z = (rows.X - rows.inputs.offset) / rows.inputs.scale
    strengths = antecedent.strengths(np.ascontiguousarray(Z.T))
    strongest = strengths.argmax(axis=0)
    found = []
    for r in range(antecedent.n_rules):
        own = {tuple(row) for row, best in zip(Z, strongest, strict=True) if best == r}
        if not own:
            found.append(None)
            continue
        part = strengths[r] * rows.weights
        center = np.average(Z, axis=0, weights=part)
        covariance = np.cov(Z.T, aweights=part, ddof=0).reshape(Z.shape[1], -1)
        precision = np.linalg.inv(covariance + 0.01 * np.eye(Z.shape[1]))
        speaks = strengths[r] >= 0.5 * strengths.max(axis=0)
        radius = max(
            np.sqrt((z - center) @ precision @ (z - center))
            for z, is_own in zip(Z, speaks, strict=True)
            if is_own
        )
        found.append((min(1.0, len(own) / n_coefficients), center, precision, radius))
    return found


def table(rng):
    """Clustered, repeated and correlated rows in the units of no one."""
    X = rng.normal(size=(400, 3)) @ [[1.0, 0.9, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 1.0]]
    X[::7] = X[0]
    X[1::9] = np.round(X[1::9])
    return X * [1e3, 1e-4, 1.0] + [1e6, 0.0, -3.0]


ANTECEDENTS = {
    "grid": lambda rng: oracles.random_grid(rng, [oracles.Gaussian] * 3, (2, 3, 2)),
    "scattered": lambda rng: oracles.random_scattered(rng, oracles.Gaussian, 5, (0, 2)),
    "rule table": oracles.random_table,
}


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("n_coefficients", [1, 4, 40])
@pytest.mark.parametrize("kind", ANTECEDENTS)
def test_support_is_that_of_the_definitions(kind, n_coefficients, weighted, rng, monkeypatch):
    X = table(rng)
    weight = rng.uniform(0.1, 3.0, len(X)) if weighted else None
    rows = StandardisedData.of(X, X[:, :1], weight)
    antecedent = ANTECEDENTS[kind](rng)
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 1)  # 64 rows
    firing = RuleFiring.of(rows, antecedent, n_coefficients)
    found = rule_support(rows, antecedent, n_coefficients, firing)
    assert_array_equal(found.factor, np.tril(found.factor))
    for r, expected in enumerate(brute_force(rows, antecedent, n_coefficients)):
        if expected is None:
            assert found.share[r] == found.radius[r] == 0.0
            continue
        share, center, precision, radius = expected
        assert found.share[r] == share
        assert_allclose(found.center[r], center, atol=1e-12)
        assert_allclose(found.factor[r].T @ found.factor[r], precision, rtol=1e-8, atol=1e-8)
        assert_allclose(found.radius[r], radius, rtol=1e-9)


def test_inputs_that_repeat_are_counted_once(rng):
    # Three places, a hundred rows each, and three coefficients; then two places.
    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    X = np.repeat(places, 100, axis=0)
    y = X @ [1.0, 2.0] + 0.1 * rng.normal(size=300)
    model = ANFISRegressor(n_mfs=1).fit(X, y)
    assert_array_equal(model.coverage(places), 1.0)
    with pytest.warns():
        two = ANFISRegressor(n_mfs=1).fit(X[:200], y[:200])
    assert_allclose(two.model_.support.share, 1.0)  # the second column never changes: P is 2
    with pytest.warns():
        one = ANFISRegressor(n_mfs=1).fit(np.array([[0.0, 0.0], [1.0, 1e-3]]), y[:2])
    assert_allclose(one.model_.support.share, 2.0 / 3.0)
