"""The map of the rules has every rule in one cell, and shows which are empty."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skanfis import ANFISRegressor
from skanfis.export import fold
from skanfis.inspection import RuleActivationDisplay, rules_table

from ..export.rule_bases import MODELS
from .drawing import A_GRID, ALL, NAMES, drawn


@ALL
def test_every_rule_has_one_cell(model):
    display = RuleActivationDisplay.from_estimator(model)
    found = display.rules[display.rules >= 0]
    assert sorted(found) == list(range(model.n_rules))
    for (i, j), r in np.ndenumerate(display.rules):
        if r < 0:
            assert np.isnan(display.weights[i, j])
            assert np.isnan(display.rows[i, j])
        else:
            assert display.weights[i, j] == model.rule_weights[r]
            assert display.rows[i, j] == model.rule_rows[r]


def test_cells_of_a_grid_stand_where_their_terms_do():
    display = RuleActivationDisplay.from_estimator(A_GRID)
    assert (display.inputs_down, display.inputs_across) == (NAMES[:1], NAMES[1:])
    assert display.labels_down == ["low", "high"]
    assert display.labels_across == [
        f"{a}, {b}" for a in ("low", "medium", "high") for b in ("low", "high")
    ]
    table = rules_table(A_GRID)["if"]
    for (i, j), r in np.ndenumerate(display.rules):
        terms = [*display.labels_down[i].split(", "), *display.labels_across[j].split(", ")]
        assert list(table.loc[r]) == terms


def test_a_rule_that_does_not_look_at_an_input_says_any():
    display = RuleActivationDisplay.from_estimator(MODELS["rule table, order 1, 2 outputs"])
    assert any(label.startswith("any") for label in display.labels_down)
    assert any(label.endswith(", any") for label in display.labels_across)


def test_scattered_rules_are_listed_the_weightiest_first():
    model = MODELS["scattered, order 1, 1 outputs"]
    display = RuleActivationDisplay.from_estimator(model)
    assert_array_equal(display.rules[:, 0], np.argsort(-model.rule_weights))
    assert display.inputs_across == ()


def test_terms_of_one_input_stand_in_order():
    model = ANFISRegressor(n_mfs=3, solver="lse").fit(
        np.arange(30.0)[:, None], np.arange(30.0) ** 2
    )
    display = RuleActivationDisplay.from_estimator(model)
    assert display.labels_across == ["low", "medium", "high"]
    assert display.rules.tolist() == [[0, 1, 2]]


def test_empty_cells_are_hatched():
    display = drawn(RuleActivationDisplay.from_estimator(A_GRID))
    hatched = [patch for patch in display.ax_.patches if patch.get_hatch()]
    (cell,) = np.argwhere(display.rules == 1)
    assert [tuple(patch.get_xy()) for patch in hatched] == [(cell[1], cell[0])]
    assert "hatched" in display.ax_.get_title(loc="left")
    texts = [text.get_text() for text in display.ax_.texts]
    assert len(texts) == A_GRID.n_rules
    assert f"{100 * A_GRID.rule_weights[1]:.1f} %" in texts


def test_activation_on_other_rows(fitted):
    pipe, X = fitted
    some = X[X["kelvin"] < 270]
    display = drawn(RuleActivationDisplay.from_estimator(pipe, some))
    strengths = fold(pipe).strengths(some.to_numpy())
    for cell, r in np.ndenumerate(display.rules):
        assert display.weights[cell] == pytest.approx(strengths[:, r].mean(), rel=1e-12)
        assert display.rows[cell] == (strengths.argmax(axis=1) == r).sum()
    assert display.rows.sum() == len(some)


def test_a_large_map_has_no_numbers():
    X = np.random.default_rng(0).uniform(size=(500, 2))
    model = ANFISRegressor(n_mfs=11, order=0, solver="lse").fit(X, X[:, 0])
    assert not drawn(RuleActivationDisplay.from_estimator(model)).ax_.texts
