"""The picture of a tree whose shape, values and shares are known."""

import re

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from skanfis.inspection import TreeDisplay, export_text

from ..export.rule_bases import MODELS, a_tree, build
from ..quick import quick
from .encoded import encoded

plt = pytest.importorskip("matplotlib.pyplot")
A_TREE = MODELS["tree, order 1, 2 outputs"]
# As the text says it of every rule: on which part of the rows it is the strongest.
LEADS = A_TREE.rule_rows / A_TREE.rule_rows.sum()


def texts(display):
    """Every text by its place."""
    return {text.get_text(): text.get_position() for text in display.ax_.texts}


def test_leaves_stand_from_above_every_cut_to_below_it():
    display = TreeDisplay.from_estimator(A_TREE, output="y1")
    places = texts(display)
    heights = [places[leaf][1] for leaf in display.leaves]
    # split() puts what is above a cut before what is below.
    assert heights == sorted(heights, reverse=True)
    for r, path in enumerate(A_TREE.antecedent.paths):
        assert int(places[display.leaves[r]][0]) == len(path)
    assert sum("chip temperature" in text for text in places) == 2
    assert display.figure_ is display.ax_.figure
    assert "y1: what each rule says (its rows)" in display.ax_.get_title(loc="left")


def test_values_are_those_of_the_rules_where_their_rows_lie():
    for k in (0, 1):
        display = TreeDisplay(model=A_TREE, output=k)
        away = A_TREE.support.center - A_TREE.reference
        away[A_TREE.support.share == 0.0] = 0.0
        for r, value in enumerate(display.values):
            constant, *slopes = A_TREE.coefficients[r, :, k]
            assert_allclose(value, constant + away[r] @ slopes, atol=0.02 * np.ptp(display.values))
    constants = build(a_tree(), 0, support=None)
    values = constants.coefficients[:, 0, 0]
    assert_allclose(TreeDisplay(model=constants).values, values, atol=0.01 * np.ptp(values))
    shares = [float(leaf.split("(")[1].split(" %")[0]) for leaf in TreeDisplay(model=A_TREE).leaves]
    assert_allclose(shares, 100.0 * LEADS, rtol=0.05)


def test_branches_are_as_thick_as_the_rows_that_take_them():
    lines = TreeDisplay.from_estimator(A_TREE).ax_.lines
    assert len(lines) == 2 * A_TREE.antecedent.n_nodes
    widths = np.array([line.get_linewidth() for line in lines])
    # The first two come from the root, which all rows pass.
    assert_allclose(widths[:2].sum(), 2 * 0.6 + 6.0)
    assert_allclose(widths[0], 0.6 + 6.0 * LEADS[:3].sum())
    # Both from a cut begin where the branch to it ends: half-way between theirs, a step before.
    paths = np.array([line.get_xydata() for line in lines])
    starts, ends = (paths[:, k].reshape(-1, 2, 2) for k in (0, -1))
    assert_allclose(starts, np.repeat(ends.mean(axis=1, keepdims=True) - [1.0, 0.0], 2, axis=1))
    assert {*map(tuple, starts[1:, 0])} < {*map(tuple, ends.reshape(-1, 2))}


def test_cuts_are_called_as_in_the_text(rng):
    X = pd.DataFrame({"price in $": rng.normal(size=400), "shelf": rng.choice(["a", "b"], 400)})
    y = np.where(X["shelf"] == "b", 3.0, np.tanh(9.0 * X["price in $"])) + rng.normal(size=400) / 9
    model = quick(partition="tree", max_rules=3, order=0)
    pipe = encoded(["shelf"], model, drop="if_binary").fit(X, y)
    told = re.findall(r"^  IF (.*)$", export_text(pipe), flags=re.MULTILINE)
    asked = {part for premise in told for part in premise.split(" AND ")}
    assert {"shelf is b", "shelf is a"} < asked
    display = TreeDisplay.from_estimator(pipe)
    shown = {text.replace(r"\$", "$") for text in texts(display)}
    assert shown == asked | set(display.leaves)


def test_of_a_category_leaves_say_the_value_of_the_text(rng):
    X = pd.DataFrame({"sort": rng.choice(["a", "b", "c"], 400), "rate": rng.normal(size=400)})
    y = np.tanh(9.0 * X["rate"]) * 3.0 + 2.0 * (X["sort"] == "b") - 4.0 * (X["sort"] == "c")
    model = quick(partition="tree", max_rules=2, alpha=0.01)
    pipe = encoded(["sort"], model).fit(X, y + 0.1 * rng.normal(size=400))
    told = re.findall(r"Rule (\d)[\s\S]*?THEN y is about ([-\d.]+)", export_text(pipe))
    assert len(told) == 2
    values = TreeDisplay.from_estimator(pipe).values
    assert {int(r): float(value) for r, value in told} == dict(enumerate(values))


def test_what_cannot_be_drawn_is_refused(rng):
    X = rng.uniform(-1.0, 1.0, (300, 3))
    y = np.where(X[:, 0] > 0.2, np.where(X[:, 2] > -0.3, 2.0, 1.0), -1.0)
    with pytest.raises(ValueError, match="The model has 4 rules and is not a tree, so there"):
        TreeDisplay.from_estimator(quick(n_mfs=[2, 1, 2]).fit(X, y))
    with pytest.raises(ValueError, match=r"has 1 rule and is not a tree, .* two rules or more"):
        TreeDisplay.from_estimator(quick(partition="tree").fit(X, X[:, 0]))
    with pytest.raises(ValueError, match="'y2' is no output"):
        TreeDisplay.from_estimator(A_TREE, output="y2")
