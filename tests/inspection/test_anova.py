"""Closed forms against the full product of rows; draws against closed forms."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.antecedent import TreeAntecedent
from skanfis.inspection.anova import DrawnAnova, ProductAnova, blocks_of_rows, input_marginals
from skanfis.learning.data import StandardisedData

from ..export.rule_bases import MODELS, build, rows_of

# The root's input is cut again on one path, and one leaf asks for two cuts of it.
PATHS = [
    [(0, True), (1, True)],
    [(0, True), (1, False), (2, True)],
    [(0, True), (1, False), (2, False)],
    [(0, False), (3, True)],
    [(0, False), (3, False)],
]
CUTS, LOG_WIDTHS = [0.1, -0.3, 0.6, 0.2], np.log([0.3, 0.2, 0.1, 0.5])
TREE = TreeAntecedent.build([1, 2, 1, 0], [CUTS, LOG_WIDTHS], PATHS)
PRODUCTS = {
    name: model for name, model in MODELS.items() if name.startswith(("grid", "one rule, order 1"))
} | {f"tree, order {order}, {n} outputs": build(TREE, order, n) for order in (0, 1) for n in (1, 2)}
ALL = pytest.mark.parametrize("model", PRODUCTS.values(), ids=list(PRODUCTS))
SUBSETS = [(0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)]


def on_the_product(model, X):
    """Outputs at all combinations of the rows' values, (n, n, n, n_outputs)."""
    n = len(X)
    rows = np.stack(np.meshgrid(*X.T, indexing="ij"), axis=-1).reshape(-1, 3)
    return replace(model, target=None).predict(rows).reshape(n, n, n, -1)


def mean_over(values, subset, weight):
    """E[y | x_v] at all combinations, by weighted means over the other axes."""
    for axis in range(3):
        if axis not in subset:
            mean = np.tensordot(values, weight, axes=(axis, 0))
            values = np.repeat(np.expand_dims(mean, axis), len(weight), axis)
    return values


def variance_of(values, weight):
    mean = np.einsum("ijk,i,j,k->", values, weight, weight, weight)
    return np.einsum("ijk,i,j,k->", (values - mean) ** 2, weight, weight, weight)


# Of conditional means and of blocks of several inputs: test_effects and test_effects_display.
@ALL
def test_variances_are_those_of_the_full_product(model):
    X, blocks = rows_of(model, 1.0, 9), [(0,), (1,), (2,)]
    weight = np.random.default_rng(0).uniform(0.2, 2.0, 9)
    weight /= weight.sum()
    of_rows = blocks_of_rows(model, blocks, X, weight)
    for k in range(model.n_outputs):
        y = on_the_product(model, X)[..., k]
        anova, total = ProductAnova(model, k, of_rows), variance_of(y, weight)
        assert_allclose(anova.mean, np.einsum("ijk,i,j,k->", y, weight, weight, weight), rtol=1e-10)
        found = [anova.closed(v) for v in SUBSETS]
        expected = [variance_of(mean_over(y, v, weight), weight) for v in SUBSETS]
        assert_allclose(found, expected, rtol=0, atol=1e-10 * total)
        others = [variance_of(mean_over(y, v, weight), weight) for v in [(1, 2), (0, 2), (0, 1)]]
        assert_allclose(anova.totals(), total - others, rtol=0, atol=1e-10 * total)


@pytest.mark.parametrize("n_rows", [25, 3000])
def test_a_fit_keeps_the_moments_of_every_input_and_its_quantiles(n_rows, rng):
    X, weight = rng.normal([50.0, -3.0], [4.0, 1.0], (n_rows, 2)), rng.integers(1, 4, n_rows)
    y = np.column_stack([np.sin(X[:, 0]) * X[:, 1], X[:, 1]])
    fitted = ANFISRegressor(n_mfs=[3, 2], max_iter=0, alpha=0.1, agreement=0.1)
    model = fitted.fit(X, y, sample_weight=weight).model_
    of_rows = blocks_of_rows(model, [(0,), (1,)], X, weight / weight.sum())
    for (found, *_), expected in zip(model.support.marginals, of_rows, strict=True):
        assert_allclose(found, expected.moments, rtol=0, atol=1e-11)
    for j, (_, values, _) in enumerate(model.support.marginals):
        z = np.sort(np.repeat((X[:, j] - model.reference[j]) / model.spread[j], weight))
        # Each is where so much of the weight lies below; of many rows, of a sample of these.
        below = np.searchsorted(z, values, side="right") / z.size
        parts = (np.arange(200) + 0.5) / 200
        assert np.abs(below - parts).max() < (0.2 if n_rows == 25 else 0.02)
        # Kept of all rows: those next to the places of terms.
        places = model.antecedent.term_places[model.antecedent.term_inputs == j, None]
        sides = (
            np.where(X[:, j] <= places, X[:, j], -np.inf),
            np.where(X[:, j] > places, X[:, j], np.inf),
        )
        expected = np.unique([sides[0].max(axis=1), sides[1].min(axis=1)])
        assert_allclose(model.seen_values[j][1], expected, rtol=1e-12)


def test_of_rules_that_do_not_factor_a_fit_keeps_quantiles():
    model = MODELS["scattered, order 1, 1 outputs"]
    X = rows_of(model, 1.0, 30)
    kept = input_marginals(StandardisedData.of(X, X), model.antecedent)
    for moments, values, _ in kept:
        assert moments is None
        assert values.shape == (200,)


def test_draws_come_to_the_closed_forms():
    model = MODELS["grid, order 1, 2 outputs"]
    X = rows_of(model, 1.0, 40)
    blocks = blocks_of_rows(model, [(0,), (1,), (2,)], X)
    exact, drawn = ProductAnova(model, 1, blocks), DrawnAnova(model, 1, blocks)
    for v in [v for n in (1, 2) for v in combinations(range(3), n)]:
        shares = [one.closed(v) / one.variance for one in (drawn, exact)]
        assert abs(np.subtract(*shares)) < 0.01
        found, expected = drawn.curve(v, X), exact.curve(v, X)
        assert np.sqrt(np.mean((found - expected) ** 2)) < 0.1 * np.sqrt(exact.variance)
    assert_allclose(drawn.totals(), exact.totals(), rtol=0, atol=0.015 * exact.variance)
    (found, _), (expected, variance) = (one.covariances(SUBSETS, X) for one in (drawn, exact))
    assert_allclose(found, expected, rtol=0, atol=0.01 * variance)
