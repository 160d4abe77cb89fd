"""The frozen model against the textbook formula, read from what it tells a person."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor, model
from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.export import export_json, read_json
from skanfis.membership import Bell, Gaussian
from skanfis.policies import MAX_EXTRAPOLATION, TargetRange

from . import oracles
from .export import rule_bases


def naive(frozen, X):
    """p0 + p1 x1 + ... of every rule, averaged with products of memberships."""
    rules = oracles.rules_by_hand(frozen.antecedent)
    strengths = oracles.textbook_strengths(frozen.memberships(), rules, frozen.input_names, X)
    return oracles.textbook_predict(strengths, frozen.consequents, X)


# In units in which every input is of order one.
build = partial(rule_bases.build, offset=np.zeros(3), scale=np.array([1.0, 1.5, 0.5]))


def grid(families=(Gaussian, Bell, Gaussian), counts=(2, 3, 2), inputs=None):
    return oracles.random_grid(np.random.default_rng(1), families, counts, inputs)


def scattered(family=Gaussian, inputs=(0, 1, 2)):
    return oracles.random_scattered(np.random.default_rng(1), family, 4, inputs)


MODELS = {
    "grid": build(grid()),
    "tree": build(oracles.random_tree(np.random.default_rng(1)), n_outputs=2),
    "input without terms": build(grid((Gaussian, Bell), (3, 2), (0, 2)), n_outputs=2),
    "order 0": build(grid(), order=0),
    "order 0, outputs": build(scattered(Bell), order=0, n_outputs=3),
    "scattered": build(scattered(), n_outputs=2),
    "no terms": build(GridAntecedent((), counts=())),
    "rule table": build(oracles.random_table(np.random.default_rng(1)), n_outputs=2),
    "scattered on two inputs": build(scattered(Gaussian, (0, 2))),
}
ALL = pytest.mark.parametrize("frozen", MODELS.values(), ids=list(MODELS))


@pytest.fixture(autouse=True)
def _blocks_of_64_rows(monkeypatch):
    monkeypatch.setattr(model, "BLOCK_BYTES", 1)


def inside(frozen, rng, n=80):
    return rng.uniform(frozen.minimum, frozen.maximum, (n, frozen.n_inputs))


def around(frozen, rng, n=200):
    """Rows in and out of the box, in every combination of inputs."""
    span = frozen.maximum - frozen.minimum
    return rng.uniform(frozen.minimum - 2 * span, frozen.maximum + 2 * span, (n, frozen.n_inputs))


@ALL
def test_prediction_is_the_textbook_formula(frozen, rng):
    X = inside(frozen, rng)
    assert_allclose(frozen.predict(X), naive(frozen, X), rtol=1e-10, atol=1e-10)


def test_the_short_form_counts_many_names():
    model = rule_bases.build(rule_bases.a_tree(), n_outputs=11)
    inputs = ", ".join(map(repr, model.input_names))
    assert repr(model) == f"TSKModel({model.n_rules} rules, {inputs} -> 11 outputs)"
    one = ANFISRegressor(n_mfs=1, alpha=0.1).fit([[0.0], [1.0]], [0.0, 1.0])
    assert repr(one.model_) == "TSKModel(1 rule, 'x0' -> 'y')"


def test_model_about_its_reference_keeps_the_digits_that_the_textbook_form_loses():
    # Everything moved by 2^30, which is exact for these rows: so must the prediction be.
    near = build(scattered())
    antecedent = near.antecedent.change_units(np.full(3, 2.0**30), np.ones(3))
    places = {n: getattr(near, n) + 2.0**30 for n in ("reference", "minimum", "maximum")}
    far = replace(near, antecedent=antecedent, **places)
    X = np.round(inside(near, np.random.default_rng(0)) * 1024) / 1024
    # The centres moved by 2^30 are rounded to 2^-23.
    assert_allclose(far.predict(X + 2.0**30), near.predict(X), atol=1e-5)


@ALL
def test_in_bounds_is_the_closed_box_but_for_rounding(frozen):
    middle = 0.5 * (frozen.minimum + frozen.maximum)
    rows = [middle, frozen.minimum, frozen.maximum]
    assert frozen.in_bounds(np.array(rows)).all()
    for j in range(3):
        for edge, side in ((frozen.minimum, -np.inf), (frozen.maximum, np.inf)):
            row = middle.copy()
            row[j] = np.nextafter(edge[j], side)
            assert frozen.in_bounds(row[None])[0]
            row[j] = edge[j] + np.sign(side) * 1e-13
            assert not frozen.in_bounds(row[None])[0]
    assert not frozen.in_bounds(np.full((1, 3), np.nan))[0]


@ALL
def test_clip_gives_the_value_of_the_nearest_row_in_the_box(frozen, rng):
    X = around(frozen, rng)
    nearest = np.maximum(np.minimum(X, frozen.maximum), frozen.minimum)
    assert frozen.in_bounds(nearest).all()
    assert_allclose(frozen.predict(X), frozen.predict(nearest), rtol=1e-13, atol=1e-14)
    one_by_one = np.vstack([frozen.strengths(row[None]) for row in nearest])
    assert_allclose(frozen.strengths(X), one_by_one, rtol=1e-13, atol=1e-300)


@ALL
def test_nan_is_given_outside_and_nowhere_else(frozen, rng):
    X = np.vstack([around(frozen, rng), inside(frozen, rng)])
    found = frozen.with_out_of_bounds("nan").predict(X)
    within = frozen.in_bounds(X)
    assert 0 < within.sum() < len(X)
    assert np.isnan(found[~within]).all()
    assert_allclose(found[within], frozen.predict(X)[within], rtol=1e-13)


@ALL
def test_gradient_is_that_of_the_textbook_formula(frozen, rng):
    X, step = inside(frozen, rng, 12), 1e-6
    found = frozen.gradient(X)
    assert found.shape == (12, 3, frozen.n_outputs)
    for j in range(3):
        ahead, behind = X.copy(), X.copy()
        ahead[:, j] += step
        behind[:, j] -= step
        numeric = (naive(frozen, ahead) - naive(frozen, behind)) / (2 * step)
        assert_allclose(found[:, j], numeric, rtol=1e-6, atol=1e-8)


@pytest.mark.theory
@ALL
@pytest.mark.parametrize("limit", [0.0, 0.3, 2.0, np.inf])
def test_linear_is_the_tangent_of_the_nearest_row_as_far_as_the_limit(frozen, rng, limit):
    frozen = frozen.with_out_of_bounds("linear", limit)
    X = around(frozen, rng, 100)
    nearest = X.clip(frozen.minimum, frozen.maximum)
    way, reach = X - nearest, limit * frozen.spread
    way = np.where(way > reach, reach, np.where(way < -reach, -reach, way))
    assert_array_equal(frozen.way_out(X), way)
    ahead = np.einsum("ij,ijo->io", way, frozen.gradient(nearest))
    expected = naive(frozen, nearest) + ahead
    assert_allclose(frozen.predict(X), expected, rtol=1e-10, atol=1e-10)
    assert_allclose(frozen.gradient(X), frozen.gradient(nearest), rtol=1e-12)


@pytest.mark.theory
@ALL
def test_tangents_do_not_change_with_inputs_that_are_held_elsewhere(frozen, rng):
    """Every slope is that of the formula with all other held inputs at their places."""
    at = np.array([0.5, np.nan, -0.2])
    held = replace(frozen.with_out_of_bounds("linear", 0.7), tangent_at=at)
    X = around(frozen, rng, 60)
    nearest = X.clip(frozen.minimum, frozen.maximum)
    way, expected = held.way_out(X), naive(frozen, nearest)
    for j in range(3):
        place = nearest.copy()
        for i in {0, 2} - {j}:
            place[:, i] = at[i]
        expected += way[:, j, None] * frozen.gradient(place)[:, j]
    assert_allclose(held.predict(X), expected, rtol=1e-10, atol=1e-10)
    # Next to the edge it is next to the edge's value.
    edge = nearest + 1e-9 * np.sign(X - nearest)
    assert_allclose(held.predict(edge), frozen.predict(nearest), atol=1e-6)


def test_auto_is_half_a_deviation_where_the_noise_is_not_known():
    far = build(grid()).with_out_of_bounds("linear", 2.0)
    assert far.with_out_of_bounds("linear").max_extrapolation == 2.0
    assert far.with_out_of_bounds("linear", "auto").max_extrapolation == MAX_EXTRAPOLATION


@ALL
def test_coverage_is_the_formula(frozen, rng):
    X = around(frozen, rng, 80)
    expected = oracles.textbook_coverage(frozen, X)
    assert_allclose(frozen.coverage(X), expected, rtol=1e-9, atol=1e-300)
    assert 0.0 < expected.max() < 1.0


def test_coverage_is_one_at_most_whatever_strengths_are_rounded_to(rng):
    frozen = build(scattered())
    n_rules = len(frozen.support.share)
    everywhere = replace(frozen.support, share=np.ones(n_rules), radius=np.full(n_rules, np.inf))
    X = inside(frozen, rng, 1000)
    assert (frozen.strengths(X).sum(axis=1) > 1.0).any()
    assert_array_equal(replace(frozen, support=everywhere).coverage(X).max(), 1.0)


def test_without_knowledge_of_data_there_is_no_coverage(rng):
    frozen = build(grid(), support=None)
    assert_array_equal(frozen.coverage(around(frozen, rng)), 0.0)


TARGET = TargetRange(np.array([-0.5]), np.array([0.5]), np.array([0.4]))


@pytest.mark.parametrize("policy", ["clip", "linear", "nan"])
@pytest.mark.parametrize("limit", [0.0, 0.5, 2.0])
def test_outputs_are_held_beside_the_range_of_the_target(policy, limit):
    free = build(scattered(), out_of_bounds=policy, max_extrapolation=limit)
    X = np.random.default_rng(4).uniform(-4.0, 4.0, (500, 3))
    said, answer = free.predict(X), replace(free, target=TARGET).predict(X)
    # A twentieth of the range for each deviation, half of one at the least.
    high = 0.5 + max(limit, 0.5) / 20.0
    low = -high
    assert (said < low).any()
    assert (said > high).any()
    assert_allclose(answer, np.clip(said, low, high), rtol=1e-12)


class TestAsRuleTable:
    """A tree as rules listed one by one, with one term on an input."""

    def test_it_predicts_the_same(self):
        for n_outputs in (1, 2):
            tree = rule_bases.MODELS[f"tree, order 1, {n_outputs} outputs"]
            table, rows = tree.as_rule_table(), rule_bases.rows_of(tree, 1.3, 500)
            assert type(table.antecedent) is RuleTableAntecedent
            full_scale = np.abs(tree.predict(rows)).max()
            assert_allclose(table.predict(rows), tree.predict(rows), atol=1e-12 * full_scale)
            assert_allclose(table.gradient(rows), tree.gradient(rows), rtol=1e-7, atol=1e-7)
            # Its terms say both sides.
            assert "> 999580 ± 400 and < 1000360 ± 530" in table.term_names
            assert "> 0.003 ± 0.0011" in table.term_names
            # What is known of a tree's parameters is not known of these.
            assert replace(tree, posterior=object()).as_rule_table().posterior is None

    def test_what_has_one_term_each_is_left_as_it_is(self):
        for name in ("grid", "scattered", "rule table", "one rule"):
            model = rule_bases.MODELS[f"{name}, order 1, 1 outputs"]
            assert model.as_rule_table() is model


@pytest.mark.parametrize("counts", [(2, 2), (3, 2)])
def test_apply_gives_the_strongest_rule_and_of_equals_the_first(counts, rng):
    frozen = ANFISRegressor(list(counts), max_iter=0, alpha=0.1, agreement=0.1)
    X = rng.uniform(-1.0, 1.0, (50, 2))
    X[:2] = [[-1.0, -1.0], [1.0, 1.0]]
    estimator = frozen.fit(X, X[:, 0])
    found = estimator.apply(X)
    for row, rule in zip(estimator.strengths(X), found, strict=True):
        assert rule == max(range(row.size), key=row.__getitem__)
    assert_array_equal(estimator.model_.apply(X), found)
    # Half way between the terms of both inputs rules are equally strong but for rounding.
    model_ = estimator.model_
    places = model_.antecedent.term_places
    middle = [[places[: counts[0]].mean(), places[counts[0] :].mean()]]
    strengths = estimator.strengths(middle)[0]
    equal = np.flatnonzero(np.isclose(strengths, strengths.max(), rtol=1e-12))
    assert equal.size >= 2
    assert estimator.apply(middle)[0] == equal[0]


def test_a_table_is_read_by_its_names_and_other_shapes_are_refused(rng):
    frozen = MODELS["grid"]
    X = around(frozen, rng)
    table = pd.DataFrame(X, columns=frozen.input_names).assign(more=0.0).iloc[:, ::-1]
    for ask in ("predict", "in_bounds", "strengths", "coverage", "gradient", "way_out"):
        assert_array_equal(getattr(frozen, ask)(table), getattr(frozen, ask)(X))
    assert_array_equal(frozen.predict(X.tolist()), frozen.predict(X))
    # As scikit-learn has it, numbers are no names.
    assert_array_equal(frozen.predict(pd.DataFrame(X)), frozen.predict(X))
    name = frozen.input_names[1]
    with pytest.raises(ValueError, match=f"X lacks the column '{name}': the model takes '"):
        frozen.predict(table.drop(columns=name))
    with pytest.raises(ValueError, match=r"X has the shape \(200, 2\): the model takes '"):
        frozen.strengths(X[:, :2])


@pytest.mark.parametrize("weighted", [False, True])
def test_inputs_that_are_0_or_1_are_known_whatever_is_done_with_the_model(weighted, rng, tmp_path):
    n_rows = 20_000
    X = np.column_stack([rng.random(n_rows) < 0.01, rng.random(n_rows) < 0.7, rng.random(n_rows)])
    X = np.column_stack([X, X[:, 1], X[:, 0] + 1.0]).astype(float)
    # One row of twenty thousand is neither.
    X[7, 3], X[:2, 2] = 0.5, (0.0, 1.0)
    weight = rng.integers(0, 5, n_rows) if weighted else None
    trained = ANFISRegressor(n_mfs=1).fit(X, X @ np.arange(5.0), weight).model_
    export_json(trained, tmp_path / "model.json")
    for known in (trained, read_json(tmp_path / "model.json")):
        assert known.two_valued.tolist() == [True, True, False, False, False]
