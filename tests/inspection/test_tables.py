"""The table of rules holds the model; explanations add up to its predictions."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.inspection import explain, export_text, readability, rules_table

from ..export.every_model import FEWEST
from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES, rows_of
from ..quick import quick
from .encoded import encoded

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]


def sums(table, model):
    """Sum of contributions of every row and output, (n_rows, n_outputs)."""
    by_row = table.groupby(["row", "output"], sort=False)["contribution"].sum(min_count=1)
    return by_row.to_numpy().reshape(-1, model.n_outputs)


@ALL
def test_rules_table_holds_consequents_and_support(model):
    table = rules_table(model)
    assert_array_equal(table.index, np.arange(model.n_rules))
    assert_array_equal(table["data"]["weight"], model.rule_weights)
    assert_array_equal(table["data"]["rows"], model.rule_rows)
    known = model.support.share > 0.0
    assert_allclose(table["at"][known], model.support.center[known], rtol=1e-12)
    for k, name in enumerate(model.output_names):
        said = table[f"then {name}"]
        assert list(said) == ["value", *NAMES]
        assert_allclose(said[list(NAMES)], model.consequents[:, 1:, k], rtol=1e-12)
        at_center = model.consequents[:, 0, k] + np.sum(table["at"] * said[list(NAMES)], axis=1)
        assert_allclose(said["value"], at_center, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("case", FEWEST, ids=[case.label for case in FEWEST])
def test_contributions_add_up_to_the_prediction(case):
    """Of all policies; some outputs are held, and some tangents are taken at one place."""
    model = case.model
    model = model.with_out_of_bounds("nan") if model.out_of_bounds == "raise" else model
    rows = np.vstack([rows_of(model, 1.0, 10), rows_of(model, 2.0, 30)])
    inside = model.in_bounds(rows)
    assert 0 < inside.sum() < len(rows)
    table, expected = explain(model, rows), model.predict(rows)
    largest = max(np.nanmax(abs(expected)), np.nanmax(abs(table["contribution"])))
    assert_allclose(sums(table, model), expected, rtol=0, atol=1e-12 * largest)
    strengths = table.groupby(["row", "output"])["strength"].sum()
    assert_allclose(strengths, 1.0, rtol=1e-12)
    said, (low, high) = replace(model, target=None).predict(rows), model.output_limits
    assert (table["if"] == "held").sum() == ((said < low) | (said > high)).sum()
    is_out = (rows < model.minimum) | (rows > model.maximum)
    n_lines = is_out.sum() * model.n_outputs if model.out_of_bounds == "linear" else 0
    assert table["if"].str.startswith("beyond").sum() == n_lines


def test_among_these_are_outputs_that_are_held_and_tangents_that_are_taken_elsewhere():
    models = [case.model for case in FEWEST if case.model.out_of_bounds == "linear"]
    assert any(model.tangent_at is not None for model in models)
    tables = [explain(model, rows_of(model, 2.0, 30)) for model in models]
    assert any((table["if"] == "held").any() for table in tables)


@ALL
def test_what_rules_say_is_strength_times_value(model):
    rows = rows_of(model, 1.0, 5)
    table = explain(model, rows)
    assert len(table) == 5 * model.n_rules * model.n_outputs
    strengths, consequents = model.strengths(rows), model.consequents
    for line in table.itertuples():
        k = model.output_names.index(line.output)
        value = consequents[line.rule, 0, k] + rows[line.row] @ consequents[line.rule, 1:, k]
        assert line.value == pytest.approx(value, rel=1e-9, abs=1e-9)
        assert line.strength == pytest.approx(strengths[line.row, line.rule], rel=1e-12)
        assert line.contribution == pytest.approx(line.strength * line.value, rel=1e-12)
    # The strongest comes first.
    assert not (table.groupby(["row", "output"])["strength"].diff() > 0.0).any()


def test_what_is_wrong_is_refused():
    with pytest.raises(ValueError, match="X lies outside the training data: 'time' in"):
        explain(A_GRID.with_out_of_bounds("raise"), rows_of(A_GRID, 2.0))


def test_rules_of_a_category_are_explained_in_its_words(rng):
    X = pd.DataFrame({"fibre": rng.choice(["PM", "SM"], 200), "rate": rng.normal(size=200)})
    y = np.where(X["fibre"] == "PM", np.abs(X["rate"]), 3.0)
    pipe = encoded(["fibre"], quick(n_mfs=[2, 2]), drop="if_binary").fit(X, y)
    asked = set(explain(pipe, X[:20])["if"])
    assert any("fibre is PM" in premise for premise in asked)
    assert any("fibre is SM" in premise for premise in asked)
    assert set(readability(pipe, X, y).rules["if"]) == asked


def test_conditions_are_those_of_the_text():
    """Which leaves out those that others of the rule imply."""
    X = np.linspace(-3.0, 3.0, 300)[:, None]
    model = ANFISRegressor(partition="tree", max_rules=6).fit(X, np.sin(3.0 * X[:, 0]))
    lines = export_text(model).splitlines()
    asked = {line.removeprefix("  IF ") for line in lines if line.startswith("  IF ")}
    assert len(asked) == model.n_rules_
    assert set(explain(model, X[:1])["if"]) == asked
    assert set("x0 " + rules_table(model)["if", "x0"]) == asked
