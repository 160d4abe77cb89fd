"""Every measure against loops over rows and rules, identities between them, and invariances."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, ScatteredAntecedent
from skanfis.inspection import measures
from skanfis.inspection.measures import Source, measure
from skanfis.membership import Gaussian

from ..export.rule_bases import EVERY_PAIR, MODELS, build, rows_of

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
ONE = MODELS["one rule, order 1, 1 outputs"]
A_TABLE = MODELS["rule table, order 1, 2 outputs"]


def source_of(X, y=None, weight=None):
    return Source(len(X), lambda part: X[part], y, weight)


def data_of(model, reach=1.2, n_rows=40, seed=5):
    """Rows in and out of the box, a target that the model does not fit, weights with a zero."""
    X = rows_of(model, reach, n_rows)
    rng = np.random.default_rng(seed)
    y = 3.0 + 2.0 * rng.normal(size=(n_rows, model.n_outputs))
    weight = rng.uniform(0.2, 3.0, n_rows)
    weight[7] = 0.0
    return X, y, weight


def by_loops(model, X, y, weight):
    """What the definitions say, one row and one rule at a time."""
    X = np.clip(X, model.minimum, model.maximum)
    X, y, weight = X[weight > 0], y[weight > 0], weight[weight > 0]
    mean = np.average(y, axis=0, weights=weight)
    sd = np.sqrt(np.average((y - mean) ** 2, axis=0, weights=weight))
    low, high = y.min(axis=0), y.max(axis=0)
    n_rules, n_outputs = model.n_rules, model.n_outputs
    mu = np.exp(model.antecedent.log_memberships(X.T))
    w = model.strengths(X)
    total = weight.sum()
    rule_rows, alone2, disagreement2 = np.zeros(n_rules), *np.zeros((2, n_rules, n_outputs))
    sums = np.zeros(n_outputs)
    for i, x in enumerate(X):
        f = np.array([model.consequents[r].T @ [1.0, *x] for r in range(n_rules)])
        yhat = sum(w[i, r] * f[r] for r in range(n_rules))
        strongest = max(range(n_rules), key=lambda r: w[i, r])
        rule_rows[strongest] += weight[i]
        alone2[strongest] += weight[i] * (f[strongest] - yhat) ** 2
        for r in range(n_rules):
            disagreement2[r] += weight[i] * w[i, r] * (f[r] - yhat) ** 2
        sums = np.maximum(sums, sum(abs(w[i, r] * (f[r] - mean)) for r in range(n_rules)))
    inputs = np.concatenate([g.inputs for g in model.antecedent.groups] or [np.empty(0)])
    wordless = np.full(model.n_inputs, np.nan)
    for j in set(inputs.astype(int)):
        wordless[j] = weight @ [all(mu[inputs == j, i] < 0.5) for i in range(len(X))] / total
    mass = weight @ w
    with np.errstate(invalid="ignore"):
        centers = (w * weight[:, None]).T @ X / mass[:, None]
        values = np.array([model.consequents[r].T @ [1.0, *centers[r]] for r in range(n_rules)])
        return {
            "weight": total,
            "mean": mean,
            "deviation": sd,
            "low": low,
            "high": high,
            "truth": mu.max(axis=1),
            "wordless": wordless,
            "rule_weights": mass / total,
            "rule_rows": rule_rows,
            "rule_alone": np.sqrt(alone2 / rule_rows[:, None]) / sd,
            "rule_disagreement": np.sqrt(disagreement2 / mass[:, None]) / sd,
            "rule_values": (values - mean) / sd,
            "alone": np.sqrt(alone2.sum(axis=0) / total) / sd,
            "disagreement": np.sqrt(disagreement2.sum(axis=0) / total) / sd,
            "greatest_sum": sums / (high - low),
        }


def assert_alike(found, expected, rtol=1e-9):
    for name in (field.name for field in fields(found)):
        value = getattr(expected, name) if hasattr(expected, name) else expected[name]
        assert_allclose(getattr(found, name), value, rtol=rtol, atol=1e-9, err_msg=name)


@ALL
def test_measures_are_what_loops_find(model):
    X, y, weight = data_of(model)
    # The textbook form of the consequents, far from the origin, has lost digits: so the tolerance.
    assert_alike(measure(model, source_of(X, y, weight)), by_loops(model, X, y, weight), rtol=1e-6)


@ALL
def test_without_a_target_the_predictions_stand_for_it(model):
    X, _, weight = data_of(model)
    y = model.with_out_of_bounds("clip").predict(X)
    expected = measure(model, source_of(X, y, weight))
    for policy in ("clip", "linear", "nan", "raise"):
        found = measure(replace(model, out_of_bounds=policy), source_of(X, None, weight))
        assert_alike(found, expected)


@ALL
def test_local_error_is_global_error_and_disagreement(model):
    # Krogh and Vedelsby: sum_r w_r (y - f_r)^2 = (y - yhat)^2 + sum_r w_r (f_r - yhat)^2.
    X, y, weight = data_of(model, reach=1.0)
    found = measure(model, source_of(X, y, weight))
    f = np.einsum("rio,ni->nro", model.consequents, np.column_stack([np.ones(len(X)), X]))
    share = (weight / weight.sum())[:, None]
    local = np.sum(share * np.einsum("nr,nro->no", model.strengths(X), (y[:, None] - f) ** 2), 0)
    whole = np.sum(share * (y - model.predict(X)) ** 2, axis=0)
    assert_allclose(
        (found.deviation * found.disagreement) ** 2, local - whole, rtol=1e-6, atol=1e-9
    )


@ALL
def test_parts_add_up(model):
    X, y, weight = data_of(model)
    found = measure(model, source_of(X, y, weight))
    assert found.rule_weights.sum() == pytest.approx(1.0)
    assert found.rule_rows.sum() == pytest.approx(weight.sum())
    rows = np.nan_to_num(found.rule_alone) ** 2 * found.rule_rows[:, None] / weight.sum()
    assert_allclose(np.sqrt(rows.sum(axis=0)), found.alone, rtol=1e-12)
    fires = found.rule_disagreement**2 * found.rule_weights[:, None]
    assert_allclose(np.sqrt(fires.sum(axis=0)), found.disagreement, rtol=1e-12)


@pytest.mark.parametrize("has_target", [True, False])
@ALL
def test_whole_weights_count_as_repeated_rows(model, has_target):
    X, y, _ = data_of(model)
    y = y if has_target else None
    times = np.random.default_rng(0).integers(0, 4, len(X))
    repeated = source_of(np.repeat(X, times, axis=0), y if y is None else np.repeat(y, times, 0))
    assert_alike(measure(model, source_of(X, y, times.astype(float))), measure(model, repeated))


@pytest.mark.parametrize("has_target", [True, False])
def test_blocks_do_not_matter(monkeypatch, has_target):
    X, y, weight = data_of(A_TABLE, n_rows=1000)
    weight[300:400] = 0.0  # a block without weight
    source = source_of(X, y if has_target else None, weight)
    expected = measure(A_TABLE, source)
    monkeypatch.setattr(measures, "LARGE_BLOCK_ROWS", 70)
    monkeypatch.setattr(measures, "_BLOCK_BYTES", 1)
    assert_alike(measure(A_TABLE, source), expected)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
@ALL
def test_units_do_not_matter(model, factor):
    X, y, weight = data_of(model)
    expected = measure(model, source_of(X, y, weight))
    scale = np.array([factor, 1.0 / factor, 7.0])
    offset = np.array([300.0, -100.0, 0.5]) * scale
    coefficients = model.coefficients * factor
    coefficients[:, 1:] /= scale[: coefficients.shape[1] - 1, None]
    coefficients[:, 0] += 5.0 * factor
    moved = replace(
        model,
        antecedent=model.antecedent.change_units(offset, scale),
        coefficients=coefficients,
        **{
            name: offset + scale * getattr(model, name)
            for name in ("reference", "minimum", "maximum")
        },
        spread=scale * model.spread,
    )
    found = measure(moved, source_of(offset + scale * X, (5.0 + y) * factor, weight))
    for name in ("mean", "low", "high"):
        assert_allclose(getattr(found, name) / factor - 5.0, getattr(expected, name), rtol=1e-6)
    kept = {name: getattr(expected, name) for name in ("mean", "low", "high", "deviation")}
    assert_alike(replace(found, **kept), expected, rtol=1e-6)
    assert_allclose(found.deviation / factor, expected.deviation, rtol=1e-9)


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_squares_of_the_target_neither_overflow_nor_vanish(scale):
    X, y, weight = data_of(ONE)
    model = replace(ONE, coefficients=ONE.coefficients * scale)
    found = measure(model, source_of(X, y * scale, weight))
    expected = measure(ONE, source_of(X, y, weight))
    assert_allclose(found.deviation / scale, expected.deviation, rtol=1e-12)
    assert_allclose(found.rule_values, expected.rule_values, rtol=1e-9)


def test_a_single_rule_is_the_model():
    X, y, weight = data_of(ONE)
    found = measure(ONE, source_of(X, y, weight))
    assert_array_equal(found.alone, 0.0)
    assert_array_equal(found.disagreement, 0.0)
    assert found.truth.size == 0
    # Its center is the mean of the rows.
    center = np.average(np.clip(X, ONE.minimum, ONE.maximum), axis=0, weights=weight)
    assert_allclose(
        found.mean + found.deviation * found.rule_values[0], ONE.predict(center[None])[0], rtol=1e-9
    )


def of_two_rules(first, second, centers=(-1.0, 1.0)):
    """Constants of two rules on the input in the middle, whose terms have a width of one."""
    theta = np.array([centers, [0.0, 0.0]], dtype=float)
    antecedent = GridAntecedent.build([Gaussian], [1], [theta])
    model = build(antecedent, order=0)
    coefficients = np.array([first, second], dtype=float).reshape(2, 1, 1)
    return replace(
        model,
        antecedent=antecedent,
        coefficients=coefficients,
        minimum=np.full(3, -2.0),
        maximum=np.full(3, 2.0),
        reference=np.zeros(3),
        spread=np.ones(3),
    )


def test_equally_strong_rules_count_in_equal_parts():
    model = of_two_rules(1.0, 4.0)
    X = np.zeros((1, 3))  # yhat is 2.5, both rules miss by 1.5
    found = measure(model, source_of(X, np.array([[2.0]])))
    assert_allclose(found.rule_rows, 0.5)
    assert_allclose(found.alone, 1.5)
    X, y = np.zeros((3, 3)), np.array([[0.0], [1.0], [2.0]])
    X[:, 1] = [-1.0, 0.0, 1.0]
    w = 1.0 / (1.0 + np.exp(-2.0))  # of the nearer rule at its center
    expected = np.sqrt((2 * (3.0 * (1.0 - w)) ** 2 + 1.5**2) / 3.0) / np.std(y)
    assert_allclose(measure(model, source_of(X, y)).alone, expected, rtol=1e-12)


def test_rules_that_cancel():
    # w (50 + 1) + (1 - w) (-50 + 1) with w near 1/2: the model is near one, no rule is.
    model = of_two_rules(51.0, -49.0, centers=(0.0, 1e-3))
    X = np.random.default_rng(0).uniform(-2.0, 2.0, (200, 3))
    y = model.predict(X) + np.linspace(-1.0, 1.0, 200)[:, None]
    found = measure(model, source_of(X, y))
    assert_allclose(found.alone * found.deviation, 50.0, rtol=1e-2)
    assert_allclose(found.disagreement * found.deviation, 50.0, rtol=1e-2)
    # Each contributes half of fifty.
    assert_allclose(found.greatest_sum * found.span, 50.0, rtol=1e-2)
    beyond = [51.0 - found.high[0], found.low[0] + 49.0] / found.span
    assert_allclose(found.rule_beyond[:, 0], beyond, rtol=1e-9)


def test_an_offset_of_the_target_is_no_compensation():
    model, far = of_two_rules(1.0, -1.0), of_two_rules(1e6 + 1.0, 1e6 - 1.0)
    X = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 3))
    near, found = measure(model, source_of(X)), measure(far, source_of(X))
    assert_allclose(found.greatest_sum, near.greatest_sum, rtol=1e-6)
    assert found.greatest_sum[0] < 1.0


def test_a_rule_that_never_fires_has_no_center():
    theta = np.array([[0.0, 1e6], [0.0, 0.0]])[:, :, None]
    model = build(ScatteredAntecedent.build(Gaussian, np.array([0]), theta))
    model = replace(model, antecedent=ScatteredAntecedent.build(Gaussian, np.array([0]), theta))
    X = np.zeros((5, 3))
    model = replace(model, minimum=np.full(3, -1.0), maximum=np.ones(3), reference=np.zeros(3))
    X[:, 0] = np.linspace(-1.0, 1.0, 5)
    found = measure(model, source_of(X))
    assert found.rule_weights[1] == 0.0
    for values in (found.rule_values, found.rule_beyond, found.rule_alone, found.rule_disagreement):
        assert np.isnan(values[1]).all()
        assert np.isfinite(values[0]).all()


def test_a_constant_target_has_a_deviation_and_a_range_of_one():
    X, y, _ = data_of(ONE)
    found = measure(ONE, source_of(X, np.full_like(y, 0.1)))
    assert_array_equal([found.deviation, found.span], 1.0)
    flat = of_two_rules(0.1, 0.1)  # predictions that differ by rounding errors
    found = measure(flat, source_of(np.random.default_rng(0).uniform(-2, 2, (99, 3))))
    assert_array_equal([found.deviation, found.span], 1.0)
    assert found.alone[0] < 1e-12
