"""Which leaves a tree splits, where: the statistic row by row, and planted splits found."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.antecedent import TreeAntecedent
from skanfis.antecedent.tree import CRISP, LEAST_WIDTH
from skanfis.search.splits import Split, _scored, best_splits, together

from .test_candidates import sample_of, solved

pytestmark = pytest.mark.theory

NOTHING = TreeAntecedent.build([], [[], []], [[]])


def model_of(X, y, antecedent=NOTHING, weight=None):
    """A tree with its consequents, before its cuts move."""
    return solved(sample_of(X, y, weight), antecedent)


@pytest.mark.parametrize("n_outputs", [1, 2])
def test_the_statistic_is_the_formula_at_every_cut(rng, n_outputs):
    X = np.round(rng.uniform(-1.0, 1.0, (150, 3)), 1)
    weight = rng.integers(1, 5, 150).astype(float)
    y = np.abs(X[:, [0]]) * X[:, [1]] + 0.3 * rng.normal(size=(150, n_outputs))
    y[weight == 1.0, -1] *= 10.0  # of the outputs' noise, the rows of little weight say little
    tree = NOTHING.split(0, 2, 0.2, -1.0)
    tuned = model_of(X, y, tree, weight)
    rows = tuned.problem.rows
    residual = tuned.residual
    strengths = tree.strengths(rows.X.T)
    design = np.column_stack([np.ones(rows.n_rows), rows.X])
    coefficients = tuned.evaluation.coefficients.reshape(2, 4, -1)
    predicted = np.einsum("rn,nb,rbo->no", strengths, design, coefficients)
    assert_allclose(residual, rows.y - predicted, atol=1e-9)
    variance = np.average(residual**2, axis=0, weights=rows.sample_weight)
    best = {}
    for leaf, strength in enumerate(strengths):
        own = rows.sample_weight * strength
        b = np.column_stack([design[:, 0], rows.X - np.average(rows.X, axis=0, weights=own)])
        along = (own[:, None, None] * b[:, :, None] * residual[:, None]).reshape(rows.n_rows, -1)
        sums = np.column_stack([own, own[:, None] * b**2, along])
        for j in range(3):
            column = rows.X.T[[j]]
            (cuts,), (found,) = _scored(column, np.argsort(column), sums, 4, variance)
            cuts, found = cuts[np.isfinite(cuts)], found[np.isfinite(found)]
            expected = []
            for cut in cuts:
                assert not np.isin(cut, rows.X[:, j])
                h = rows.X[:, j] < cut
                function = (h - np.average(h, weights=own))[:, None] * b
                squares = (own * function.T @ residual) ** 2
                squares /= (own @ function**2)[:, None] * variance
                expected.append((squares.sum() - 4 * n_outputs) / np.sqrt(8 * n_outputs))
            assert_allclose(found, expected, rtol=1e-9)
            best[leaf, j] = max(expected)
    splits = best_splits(tuned, range(3), np.arange(3))
    order = sorted(best, key=best.get, reverse=True)
    assert [(split.leaf, split.input) for split in splits] == order


def test_a_leaf_without_weight_is_not_split(rng):
    X = rng.uniform(-1.0, 1.0, (60, 1))
    tuned = model_of(X, np.abs(X), NOTHING.split(0, 0, 3.0, -8.0))
    without = ~tuned.evaluation.antecedent.strengths(tuned.problem.rows.X.T).any(axis=1)
    assert without.tolist() == [True, False]
    assert {split.leaf for split in best_splits(tuned, range(1), np.arange(1))} == {1}


def test_cuts_are_as_wide_as_half_of_the_leaf_and_crisp_between_two_values(rng):
    columns = rng.normal(size=400), rng.integers(0, 2, 400), 1e-3 * rng.normal(size=400)
    X = np.column_stack(columns)
    X[::40, 2] = 50.0  # all other values are next to each other
    tuned = model_of(X, X[:, 0] ** 2 + X[:, 1] * X[:, 0], NOTHING.split(0, 0, 1.0, -3.0))
    column = tuned.problem.rows.X.T
    own = tuned.problem.rows.sample_weight * tuned.evaluation.antecedent.strengths(column)
    for split in best_splits(tuned, range(3), np.arange(3)):
        if split.input == 1:
            expected = min(0.5 * np.ptp(column[1]) / CRISP, 0.5 * LEAST_WIDTH)
            assert_allclose(split.cut, 0.5 * (column[1].min() + column[1].max()))
        else:
            z, w = column[split.input], own[split.leaf]
            spread = np.sqrt(np.cov(z, aweights=w, ddof=0))
            expected = max(0.5 * spread, LEAST_WIDTH)
        assert_allclose(np.exp(split.log_width), expected)


def test_of_inputs_that_part_the_rows_alike_the_order_of_columns_does_not_decide(rng):
    x = rng.uniform(-1.0, 1.0, 200)
    X, y = np.column_stack([x, x**3, np.exp(2.0 * x)]), np.abs(x)[:, None]
    order = np.array([2, 0, 1])
    forth = best_splits(model_of(X, y), range(3), np.empty(0, dtype=int))
    back = best_splits(model_of(X[:, order], y), range(3), np.empty(0, dtype=int))
    assert [split.input for split in forth] == [order[split.input] for split in back]


def test_values_that_differ_by_rounding_are_one(rng):
    """Half-way between two neighbouring numbers there is no third."""
    flag, x = rng.integers(0, 2, 200), rng.normal(size=200)
    wobble = np.where(rng.random(200) < 0.3, np.nextafter(flag, 2.0), flag)
    y = np.where(flag, x, -x)[:, None] + (wobble > 1.0)[:, None]
    exact, found = (
        best_splits(model_of(np.column_stack([column, x]), y), [0], np.arange(2))[0]
        for column in (flag, wobble)
    )
    assert_allclose(found.cut, exact.cut, atol=1e-8)
    assert_allclose(found.log_width, exact.log_width, atol=1e-8)  # crisp


def test_of_several_at_once_each_is_of_another_leaf_and_the_last_is_tried():
    order = (2, 0), (2, 1), (0, 1), (3, 0), (0, 0), (1, 1), (3, 1)
    splits = [Split(leaf, j, 0.0, 0.0) for leaf, j in order]
    found = [[(one.leaf, one.input) for one in some] for some in together(splits, 2, 2)]
    assert found == [[(2, 0), (0, 1), (3, 0)], [(2, 0), (0, 1), (1, 1)]]
    assert together(splits, 0, 3) == [[one] for one in splits[:3]]
    # Of no more leaves than there are, the last is tried.
    assert together(splits, 8, 9) == [[*(splits[k] for k in (0, 2, 3)), splits[5]]]
    assert together(splits[:2], 4, 9) == [[one] for one in splits[:2]]
    assert together([], 1, 4) == []
