"""The frozen model against the textbook formula, read from what it tells a person."""

import pickle
from dataclasses import replace
from io import BytesIO
from itertools import product

import joblib
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor, model
from skanfis.antecedent import GridAntecedent
from skanfis.learning import VariableProjection
from skanfis.membership import Bell, Gaussian
from skanfis.model import TSKModel
from skanfis.policies import OUT_OF_BOUNDS, TargetRange
from skanfis.support import RuleSupport

from . import oracles

NAMES = ("time", "temperature", "rate")


def naive(frozen, X):
    """p0 + p1 x1 + ... of every rule, averaged with products of memberships; one row at a time."""
    terms = frozen.memberships()
    on_input = {name: [t for t in terms if t["input"] == name] for name in frozen.input_names}
    if isinstance(frozen.antecedent, GridAntecedent):
        rules = list(product(*[found for found in on_input.values() if found]))
    else:
        rules = [[terms[t] for t in rule if t >= 0] for rule in frozen.antecedent.rule_terms]
    outputs = []
    for row in X:
        at = dict(zip(frozen.input_names, row, strict=True))
        firing = [
            np.prod([oracles.textbook_membership(t["function"], at[t["input"]], t) for t in rule])
            for rule in rules
        ]
        values = [p[0] + row @ p[1:] for p in frozen.consequents]
        outputs.append(np.dot(firing, values) / np.sum(firing))
    return np.array(outputs)


def build(antecedent, n_outputs=1, order=1, seed=0, **changes):
    """A model of standardised inputs with coefficients of order one."""
    g = np.random.default_rng(seed)
    shape = (antecedent.n_rules, 1 + 3 * order, n_outputs)
    settings = {
        "antecedent": antecedent,
        "initial_antecedent": antecedent,
        "coefficients": g.normal(size=shape),
        "reference": np.array([0.2, -0.1, 0.4]),
        "spread": np.array([1.0, 2.0, 0.5]),
        "minimum": np.array([-2.0, -3.0, -1.0]),
        "maximum": np.array([1.5, 3.0, 1.0]),
        "rule_weights": g.dirichlet(np.ones(antecedent.n_rules)),
        "rule_rows": 12.0 * g.dirichlet(np.ones(antecedent.n_rules)),
        "input_names": NAMES,
        "out_of_bounds": "clip",
        "support": oracles.random_support(g, antecedent.n_rules, 3),
    }
    return TSKModel(**(settings | changes))


def grid(families=(Gaussian, Bell, Gaussian), counts=(2, 3, 2), inputs=None):
    return oracles.random_grid(np.random.default_rng(1), families, counts, inputs)


def scattered(family=Gaussian, inputs=(0, 1, 2)):
    return oracles.random_scattered(np.random.default_rng(1), family, 4, inputs)


MODELS = {
    "grid": build(grid()),
    "input without terms": build(grid((Gaussian, Bell), (3, 2), (0, 2)), n_outputs=2),
    "order 0": build(grid(), order=0),
    "order 0, outputs": build(scattered(Bell), order=0, n_outputs=3),
    "scattered": build(scattered(), n_outputs=2),
    "no terms": build(GridAntecedent((), counts=())),
    "rule table": build(oracles.random_table(np.random.default_rng(1)), n_outputs=2),
    "scattered on two inputs": build(scattered(Gaussian, (0, 2))),
}
ALL = pytest.mark.parametrize("frozen", MODELS.values(), ids=list(MODELS))


def linear(**changes):
    return build(GridAntecedent((), counts=()), **changes)


def inside(frozen, rng, n=50):
    return rng.uniform(frozen.minimum, frozen.maximum, (n, frozen.n_inputs))


def around(frozen, rng, n=200):
    """Rows in and out of the box, in every combination of inputs."""
    span = frozen.maximum - frozen.minimum
    return rng.uniform(frozen.minimum - 2 * span, frozen.maximum + 2 * span, (n, frozen.n_inputs))


def fitted(X, y, **settings):
    return ANFISRegressor(**({"solver": VariableProjection(tol=1e-2)} | settings)).fit(X, y)


@pytest.fixture(scope="module")
def gyro():
    """A regressor on columns far from the origin: time stamps, kelvins, raw counts; two targets."""
    g = np.random.default_rng(4)
    X = np.column_stack(
        [1e9 + np.sort(g.uniform(0, 600, 400)), g.uniform(250, 330, 400), 1e-3 * g.normal(size=400)]
    )
    z = (X - X.mean(axis=0)) / X.std(axis=0)
    y = np.column_stack([np.sin(z[:, 0]) + z[:, 1] * z[:, 2], 1e4 + z[:, 1] ** 2])
    y += 0.01 * g.normal(size=y.shape)
    return X, fitted(X, y, n_mfs=[2, 2, 1]), fitted(X, y, n_mfs=2, mf="bell", order=0)


@ALL
def test_prediction_is_the_textbook_formula(frozen, rng):
    X = inside(frozen, rng)
    assert_allclose(frozen.predict(X), naive(frozen, X), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("which", [1, 2])
def test_fitted_model_is_the_textbook_formula_in_the_users_units(gyro, which):
    X, frozen = gyro[0][::7], gyro[which].model_
    # p0 holds -p1 * 1e9 beside values of order one: the textbook form has seven digits left.
    assert_allclose(naive(frozen, X), frozen.predict(X), atol=1e-6)


def test_model_about_its_reference_keeps_the_digits_that_the_textbook_form_loses():
    # Everything moved by 2^30, which is exact for these rows: so must the prediction be.
    near = build(scattered())
    antecedent = near.antecedent.change_units(np.full(3, 2.0**30), np.ones(3))
    far = build(
        antecedent, **{n: getattr(near, n) + 2.0**30 for n in ("reference", "minimum", "maximum")}
    )
    X = np.round(inside(near, np.random.default_rng(0)) * 1024) / 1024
    # The centres moved by 2^30 are rounded to 2^-23.
    assert_allclose(far.predict(X + 2.0**30), near.predict(X), atol=1e-5)


def test_fitted_model_predicts_its_training_data(gyro):
    # Nothing is lost between the solver's standardised units and the user's.
    X, estimator, _ = gyro
    frozen = estimator.model_
    z = (X - frozen.reference) / frozen.spread
    y = np.column_stack([np.sin(z[:, 0]) + z[:, 1] * z[:, 2], 1e4 + z[:, 1] ** 2])
    assert np.abs(frozen.predict(X) - y).max() < 0.5
    assert np.sqrt(np.mean((frozen.predict(X) - y) ** 2)) < 0.1


def test_fitted_model_describes_its_training_data(gyro):
    X, estimator, _ = gyro
    frozen = estimator.model_
    assert_allclose(frozen.reference, X.mean(axis=0), rtol=1e-12)
    assert_allclose(frozen.spread, X.std(axis=0), rtol=1e-9)
    assert_array_equal(frozen.minimum, X.min(axis=0))
    assert_array_equal(frozen.maximum, X.max(axis=0))
    assert_allclose(frozen.rule_weights, frozen.strengths(X).mean(axis=0), rtol=1e-8)
    assert_allclose(frozen.rule_weights.sum(), 1.0, rtol=1e-12)
    strongest = np.bincount(frozen.strengths(X).argmax(axis=1), minlength=frozen.n_rules)
    assert_allclose(frozen.rule_rows, strongest, rtol=1e-12)


def test_without_terms_the_model_is_linear(rng):
    frozen = linear(n_outputs=2)
    X = inside(frozen, rng)
    a, b = frozen.coefficients[0, 0], frozen.coefficients[0, 1:]
    assert_allclose(frozen.predict(X), a + (X - frozen.reference) @ b, rtol=1e-12)
    assert frozen.memberships() == []
    assert_array_equal(frozen.strengths(X), 1.0)


@ALL
def test_consequents_are_those_of_the_rules(frozen, rng):
    X = inside(frozen, rng, 5)
    by_rule = np.stack([p[0] + X @ p[1:] for p in frozen.consequents])
    a, b = frozen.coefficients[:, :1], frozen.coefficients[:, 1:]
    expected = a + (np.einsum("nj,rjo->rno", X - frozen.reference, b) if frozen.order else 0.0)
    assert_allclose(by_rule, np.broadcast_to(expected, by_rule.shape), rtol=1e-11, atol=1e-12)
    assert frozen.consequents.shape == (frozen.n_rules, 4, frozen.n_outputs)


def test_memberships_before_training_are_told_too():
    before, after = grid(), grid().with_parameters(grid().parameters + 0.25)
    frozen = build(after, initial_antecedent=before)
    for one, other in zip(frozen.memberships(trained=False), frozen.memberships(), strict=True):
        assert one["input"] == other["input"]
        assert_allclose(other["center"], one["center"] + 0.25, rtol=1e-12)
        assert_allclose(other["width"], one["width"] * np.exp(0.25), rtol=1e-12)
    assert [t["function"] for t in frozen.memberships()] == ["gaussian"] * 2 + ["bell"] * 3 + [
        "gaussian"
    ] * 2
    assert [t["input"] for t in frozen.memberships()] == ["time"] * 2 + ["temperature"] * 3 + [
        "rate"
    ] * 2


@ALL
def test_blocks_give_what_the_whole_gives(frozen, rng, monkeypatch):
    X = around(frozen, rng, 333)
    answers = [
        frozen.predict,
        frozen.strengths,
        frozen.coverage,
        frozen.with_out_of_bounds("linear").predict,
    ]
    whole = [answer(X) for answer in answers]
    monkeypatch.setattr(model, "_BLOCK_BYTES", 1)  # 64 rows
    for answer, expected in zip(answers, whole, strict=True):
        # BLAS may add in another order where a block ends.
        assert_allclose(answer(X), expected, rtol=1e-13, atol=1e-13)


@ALL
@pytest.mark.parametrize("policy", ["clip", "linear", "nan"])
def test_a_row_is_predicted_alone_as_in_company(frozen, rng, policy):
    frozen = frozen.with_out_of_bounds(policy)
    X = around(frozen, rng, 30)
    alone = np.vstack([frozen.predict(row[None]) for row in X])
    assert_allclose(frozen.predict(X), alone, rtol=1e-12, atol=1e-13)


@ALL
def test_single_precision_and_layout_of_the_input_do_not_matter(frozen, rng):
    X = inside(frozen, rng).astype(np.float32)
    expected = frozen.predict(X.astype(float))
    assert expected.dtype == np.float64
    assert_array_equal(frozen.predict(X), expected)
    assert_array_equal(frozen.predict(np.asfortranarray(X)), expected)


@ALL
def test_inputs_are_only_read(frozen, rng):
    X = around(frozen, rng)
    before = X.copy()
    X.flags.writeable = False
    for policy in ("clip", "linear", "nan"):
        frozen.with_out_of_bounds(policy).predict(X)
    frozen.coverage(X)
    frozen.strengths(X)
    assert_array_equal(X, before)


@ALL
def test_in_bounds_is_the_closed_box(frozen):
    middle = 0.5 * (frozen.minimum + frozen.maximum)
    rows = [middle, frozen.minimum, frozen.maximum]
    assert frozen.in_bounds(np.array(rows)).all()
    for j in range(3):
        for edge, side in ((frozen.minimum, -np.inf), (frozen.maximum, np.inf)):
            row = middle.copy()
            row[j] = np.nextafter(edge[j], side)
            assert not frozen.in_bounds(row[None])[0]
    assert not frozen.in_bounds(np.full((1, 3), np.nan))[0]


@ALL
def test_all_policies_agree_inside(frozen, rng):
    X = inside(frozen, rng)
    expected = frozen.predict(X)
    for policy in OUT_OF_BOUNDS:
        assert_array_equal(frozen.with_out_of_bounds(policy).predict(X), expected)


@ALL
def test_clip_gives_the_value_of_the_nearest_row_in_the_box(frozen, rng):
    X = around(frozen, rng)
    nearest = np.maximum(np.minimum(X, frozen.maximum), frozen.minimum)
    assert frozen.in_bounds(nearest).all()
    assert_allclose(frozen.predict(X), frozen.predict(nearest), rtol=1e-13, atol=1e-14)
    assert_allclose(frozen.strengths(X), frozen.strengths(nearest), rtol=1e-13, atol=1e-300)


@ALL
def test_nan_is_given_outside_and_nowhere_else(frozen, rng):
    X = np.vstack([around(frozen, rng), inside(frozen, rng)])
    found = frozen.with_out_of_bounds("nan").predict(X)
    within = frozen.in_bounds(X)
    assert 0 < within.sum() < len(X)
    assert np.isnan(found[~within]).all()
    assert_allclose(found[within], frozen.predict(X)[within], rtol=1e-13)


@ALL
def test_linear_is_continuous_at_the_edge(frozen, rng):
    frozen = frozen.with_out_of_bounds("linear")
    for j in range(3):
        for edge, side in ((frozen.minimum, -1e-9), (frozen.maximum, 1e-9)):
            at = inside(frozen, rng, 10)
            at[:, j] = edge[j]
            beyond = at.copy()
            beyond[:, j] += side
            assert not frozen.in_bounds(beyond).any()
            assert_allclose(frozen.predict(beyond), frozen.predict(at), atol=1e-7)


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


@ALL
def test_a_limit_of_zero_is_clip_and_the_end_of_the_tangent_is_continuous(frozen, rng):
    X = around(frozen, rng)
    clipped = frozen.with_out_of_bounds("clip").predict(X)
    assert_array_equal(frozen.with_out_of_bounds("linear", 0.0).predict(X), clipped)
    frozen = frozen.with_out_of_bounds("linear", 0.7)
    at = inside(frozen, rng, 10)
    for j in range(3):
        end = at.copy()
        end[:, j] = frozen.maximum[j] + 0.7 * frozen.spread[j]
        ends = []
        for step in (-1e-9, 1e-9, 5.0):
            beyond = end.copy()
            beyond[:, j] += step
            ends.append(frozen.predict(beyond))
        assert_allclose(ends[0], ends[1], atol=1e-7)
        assert_allclose(ends[1], ends[2], rtol=1e-12)


@pytest.mark.parametrize("limit", [-0.1, np.nan, "far", None])
def test_limit_is_checked(limit):
    frozen = build(grid())
    if limit is None:
        assert frozen.with_out_of_bounds("linear").max_extrapolation == frozen.max_extrapolation
        return
    with pytest.raises(ValueError, match=r"max_extrapolation=.* must be a number"):
        frozen.with_out_of_bounds("linear", limit)


def test_auto_is_what_the_rows_told_and_what_is_set_where_there_were_none():
    far = build(grid()).with_out_of_bounds("linear", 2.0)
    assert far.with_out_of_bounds("linear", "auto").max_extrapolation == 2.0
    told = replace(far, told_extrapolation=3.0)
    assert told.n_rules > 1
    assert told.with_out_of_bounds("linear", "auto").max_extrapolation == 3.0


def test_policy_as_it_is_set():
    frozen = build(grid())
    assert frozen.policy == "out_of_bounds='clip'"
    far = frozen.with_out_of_bounds("linear", 2)
    assert far.policy == "out_of_bounds='linear', max_extrapolation=2.0"


def test_raise_names_the_columns_and_the_numbers(rng):
    frozen = build(grid(), out_of_bounds="raise")
    X = inside(frozen, rng, 10)
    X[2, 1], X[3:5, 2] = -7.25, [1.5, 2.125]
    with pytest.raises(ValueError, match="outside the training data") as error:
        frozen.predict(X)
    message = str(error.value)
    assert "'temperature' in 1 of 10 rows (trained on [-3, 3], found [-7.25, " in message
    assert "'rate' in 2 of 10 rows (trained on [-1, 1], found [" in message
    assert "2.125])" in message
    assert "time" not in message
    assert frozen.describe_out_of_bounds(X) == message


def test_policy_is_changed_on_a_copy(rng):
    frozen = build(grid())
    other = frozen.with_out_of_bounds("nan")
    assert (frozen.out_of_bounds, other.out_of_bounds) == ("clip", "nan")
    assert other.antecedent is frozen.antecedent


def test_rows_known_to_be_inside_are_not_looked_at_again(rng):
    frozen = build(grid())
    X = inside(frozen, rng)
    assert_array_equal(frozen.predict(X, np.ones(len(X), dtype=bool)), frozen.predict(X))


@ALL
def test_coverage_is_the_formula(frozen, rng):
    X = around(frozen, rng, 60)
    expected = oracles.textbook_coverage(frozen, X)
    assert_allclose(frozen.coverage(X), expected, rtol=1e-9, atol=1e-300)
    assert 0.0 < expected.max() < 1.0


@ALL
def test_coverage_is_one_where_every_rule_has_data_near(frozen, rng):
    support = replace(
        frozen.support, share=np.ones(frozen.n_rules), radius=np.full(frozen.n_rules, 1e3)
    )
    fed = replace(frozen, support=support)
    assert_allclose(fed.coverage(inside(fed, rng)), 1.0, rtol=1e-12)


def test_without_knowledge_of_data_there_is_no_coverage(rng):
    frozen = build(grid(), support=None)
    assert_array_equal(frozen.coverage(around(frozen, rng)), 0.0)


@ALL
def test_coverage_falls_to_nothing_away_from_the_box(frozen, rng):
    edge = inside(frozen, rng, 20)
    edge[:, 0], along = frozen.maximum[0], np.array([1.0, 0.0, 0.0])
    before = frozen.coverage(edge)
    assert (before > 0.0).all()
    for distance in (0.01, 0.5, 2.0, 5.0):
        beyond = edge + distance * along
        assert (frozen.coverage(beyond) < before).all()
        before = frozen.coverage(beyond)
    assert (frozen.coverage(edge + 60.0 * along) == 0.0).all()


def test_coverage_is_zero_where_only_a_rule_without_data_speaks():
    theta = Gaussian.start(np.array([-1.5, 1.5]), np.array([0.5, 0.5]), 0.5)
    one_input = GridAntecedent.build([Gaussian], [0], [theta])
    wide = RuleSupport(np.array([1.0, 0.0]), np.zeros((2, 3)), np.zeros((2, 3, 3)), np.ones(2))
    frozen = build(one_input, support=wide)
    rows = np.array([[-2.0, 0.0, 0.0], [1.5, 0.0, 0.0]])
    assert_allclose(frozen.coverage(rows), [1.0, 0.0], atol=1e-9)


@ALL
def test_pickled_model_predicts_the_same_to_the_last_bit(frozen, rng):
    X = around(frozen, rng)
    file = BytesIO()
    joblib.dump(frozen, file)
    file.seek(0)
    for copy in (pickle.loads(pickle.dumps(frozen)), joblib.load(file)):
        for policy in ("clip", "linear", "nan"):
            expected = frozen.with_out_of_bounds(policy).predict(X)
            assert_array_equal(copy.with_out_of_bounds(policy).predict(X), expected)
        assert_array_equal(copy.coverage(X), frozen.coverage(X))
        assert copy.memberships() == frozen.memberships()


# Outputs that are held -------------------------------------------------------------------------

TARGET = TargetRange(np.array([-1.0]), np.array([0.5]), np.array([0.6]))


@pytest.mark.parametrize("policy", ["clip", "linear", "nan"])
@pytest.mark.parametrize(("limit", "margin"), [(0.0, 0.3), (0.5, 0.3), (0.6, 0.36), (1.0, 0.375)])
def test_outputs_are_held_beside_the_range_of_the_target(policy, limit, margin):
    free = build(scattered(), out_of_bounds=policy, max_extrapolation=limit)
    X = np.random.default_rng(4).uniform(-4.0, 4.0, (500, 3))
    said, answer = free.predict(X), replace(free, target=TARGET).predict(X)
    low, high = -1.0 - margin, 0.5 + margin
    assert (said < low).any()
    assert (said > high).any()
    assert_array_equal(answer, np.clip(said, low, high))


def test_tangent_without_end_is_not_held():
    free = build(scattered(), out_of_bounds="linear", max_extrapolation=np.inf)
    X = np.random.default_rng(4).uniform(-400.0, 400.0, (50, 3))
    assert_array_equal(replace(free, target=TARGET).predict(X), free.predict(X))


def test_no_row_however_far_is_answered_beyond_the_limits():
    g = np.random.default_rng(0)
    X, weight = g.standard_t(1.5, (200, 3)), g.integers(0, 3, 200)
    y = np.sin(X[:, 0]) + 0.1 * g.standard_normal(200)
    estimator = ANFISRegressor(3).fit(X, y, sample_weight=weight)
    own = y[weight > 0]
    deviation = np.sqrt(np.cov(y, fweights=weight, ddof=0))
    limits = [own.min() - 0.5 * deviation, own.max() + 0.5 * deviation]
    assert_allclose(estimator.model_.output_limits[:, 0], limits, rtol=1e-12)
    anywhere = estimator.model_.predict(g.standard_t(0.5, (2000, 3)))
    assert anywhere.min() >= limits[0]
    assert anywhere.max() <= limits[1]
