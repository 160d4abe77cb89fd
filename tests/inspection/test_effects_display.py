"""The picture of effects against means over the product of the inputs' values."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.inspection import EffectsDisplay, ResponseSurfaceDisplay, effects

from ..export.rule_bases import MODELS, build, rows_of
from ..quick import quick
from .encoded import encoded
from .test_anova import TREE
from .test_displays import drawn
from .test_effects import categories

pytest.importorskip("matplotlib.pyplot")
KINDS = {
    "grid": MODELS["grid, order 1, 2 outputs"],
    "tree": build(TREE, 1, 2),
    "scattered": MODELS["scattered, order 1, 2 outputs"],
}


def mean_at(model, X, columns, values):
    """Mean output over all combinations of the rows' values, with some of them given."""
    rows = np.stack(np.meshgrid(*X.T, indexing="ij"), axis=-1).reshape(-1, 3)
    rows[:, columns] = values
    return replace(model, target=None).predict(rows)[:, 1].mean()


@pytest.mark.parametrize("kind", KINDS)
def test_curves_and_pairs_are_means_over_the_product(kind):
    model = KINDS[kind]
    X, names = rows_of(model, 1.0, 9), list(model.input_names)
    display = drawn(EffectsDisplay.from_estimator(model, X, output=1))
    # Of rules that are drawn, 200 draws stand for the product.
    atol = 1e-9 if kind != "scattered" else 0.5
    shares = effects(model, X, output=1).table["sobol"]
    assert len(display.curves) == 3
    for curve in display.curves:
        j = names.index(curve["input"])
        assert curve["points"][0] == X[:, j].min()
        assert curve["points"][-1] == X[:, j].max()
        expected = [mean_at(model, X, [j], value) for value in curve["points"]]
        assert_allclose(curve["mean"], expected, atol=atol)
        assert_array_equal(curve["deviation"], 0.0)  # the model knows of none
        assert abs(curve["share"] - shares[curve["input"]]) < 0.02
        assert_allclose(curve["counts"].sum(), 1.0)
    strongest = shares[3:6].sort_values(ascending=False)
    assert display.pairs or kind == "scattered"
    for pair, (name, share) in zip(display.pairs, strongest.items(), strict=False):
        assert abs(pair["share"] - share) < 0.04
        if kind == "scattered":
            continue
        assert " and ".join(pair["inputs"]) == name
        columns = [names.index(one) for one in pair["inputs"]]
        mean = mean_at(model, X, [], 0.0)
        for a, b in ((0, 0), (3, 17), (30, 9)):
            values = pair["points"][0][a], pair["points"][1][b]
            alone = [mean_at(model, X, [j], v) for j, v in zip(columns, values, strict=True)]
            expected = mean_at(model, X, columns, values) - sum(alone) + mean
            assert_allclose(pair["effect"][b, a], expected, atol=1e-9)


def test_terms_are_memberships_and_the_strongest_inputs_are_shown():
    model = KINDS["grid"]
    X = rows_of(model, 1.0, 30)
    display = EffectsDisplay.from_estimator(model, X)
    for curve in display.curves:
        groups = {model.input_names[one.inputs[0]]: one for one in model.antecedent.groups}
        group = groups[curve["input"]]
        expected = group.family.value(np.tile(curve["points"], (group.n_terms, 1)), group.theta)
        assert_allclose(curve["terms"], expected, atol=1e-9)
    fewer = EffectsDisplay.from_estimator(model, X, max_shown=1)
    assert [one["input"] for one in fewer.curves] == [display.curves[0]["input"]]
    note = " ".join(fewer.figure_.get_supxlabel().split())
    assert note.endswith(f"without a curve: {len(display.curves) - 1} more inputs")
    with pytest.raises(ValueError, match="max_shown"):
        EffectsDisplay.from_estimator(model, X, max_shown=0)


@pytest.mark.parametrize(("drop", "levels"), [(None, "abc"), (["a"], "bca"), ("if_binary", "ba")])
def test_a_category_is_drawn_by_its_levels(drop, levels):
    X, y = categories()
    X, y = (one[X["fibre"].isin(list(levels))] for one in (X, y))
    counts = [2] + [1] * (len(levels) - (drop is not None))
    model = encoded(["fibre"], quick(n_mfs=counts), drop=drop).fit(X, y)
    for table in (X, None):
        display = drawn(EffectsDisplay.from_estimator(model, table))
        curve = next(one for one in display.curves if one["input"] == "fibre")
        assert curve["levels"] == list(levels)
        assert_array_equal(curve["edges"], np.arange(len(levels) + 1) - 0.5)
        frequent = X["fibre"].value_counts(normalize=True)[list(levels)]
        assert_allclose(curve["counts"], frequent, atol=1e-9)
        # Along a level the other columns of the category are zero, not at their means.
        rate, n = X["rate"].to_numpy(), len(X)
        for level, mean in zip(levels, curve["mean"], strict=True):
            rows = X.assign(fibre=level, rate=rate)
            assert_allclose(mean, model.predict(rows).sum() / n, atol=1e-9)
        axes = display.axes_[display.curves.index(curve)]
        assert [one.get_text() for one in axes.get_xticklabels()] == list(levels)


@pytest.mark.parametrize(
    "levels",
    [
        ["minivan", "subcompact", "pickup", "2seater", "suv", "midsize"],
        ["suv", *(f"a class of number {k}" for k in range(60))],
    ],
)
def test_labels_of_many_levels_stand_apart(levels, rng):
    X = pd.DataFrame({"class": rng.choice(levels, 300), "power": rng.normal(size=300)})
    X.loc[:99, "class"] = "suv"
    y = X["power"] * (X["class"] == "suv") + 0.1 * rng.normal(size=300)
    model = encoded(["class"], quick(partition="tree", max_rules=2)).fit(X, y)
    display = drawn(EffectsDisplay.from_estimator(model, X))
    sides = [
        labels
        for axes in display.axes_
        for labels in (axes.get_xticklabels(), axes.get_yticklabels())
        if labels[0].get_text() in levels
    ]
    assert len(sides) == 2  # under a panel of its own, and beside that of the pair or under it
    for labels in sides:
        boxes = [one.get_window_extent() for one in labels]
        assert not any(one.overlaps(next_one) for one, next_one in pairwise(boxes))


def test_numbers_of_many_letters_stand_apart(rng):
    low, high = [1977.0, 2e5, 0.0], [1999.0, 3e5, 2.0]
    X = pd.DataFrame(rng.uniform(low, high, (90, 3)), columns=["year", "people", "load"])
    model = quick(n_mfs=2).fit(X, 2e5 * (X["year"] - 1988) / 11 * (X["load"] - 1))
    displays = [one.from_estimator(model, X) for one in (EffectsDisplay, ResponseSurfaceDisplay)]
    for axes in [one for display in displays for one in drawn(display).figure_.axes]:
        low, high = axes.get_xlim()
        boxes = [
            label.get_window_extent()
            for label, at in zip(axes.get_xticklabels(), axes.get_xticks(), strict=True)
            if low <= at <= high
        ]
        assert not any(one.overlaps(next_one) for one, next_one in pairwise(boxes))


@pytest.mark.parametrize("value", [-3e-12, 0.0, 4e9])
def test_a_flat_curve_is_seen_at_its_value(rng, value):
    X = rng.uniform(size=(60, 2))
    display = EffectsDisplay.from_estimator(quick().fit(X, np.full(60, value)))
    low, high = display.axes_[0].get_ylim()
    assert low < value < high
    assert high - low <= abs(value) or not value
