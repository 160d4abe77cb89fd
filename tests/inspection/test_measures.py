"""Measures against loops over rows and rules, in any unit of the target."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent
from skanfis.inspection.measures import measure
from skanfis.inspection.sentences import Sentences
from skanfis.membership import Gaussian

from ..export.rule_bases import EVERY_PAIR, MODELS, build, rows_of

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
ONE = MODELS["one rule, order 1, 1 outputs"]


def data_of(model, n_rows=40):
    """Rows in and out of the box, a target that the model does not fit, weights with a zero."""
    X = rows_of(model, 1.2, n_rows)
    rng = np.random.default_rng(5)
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
    n_rules = model.n_rules
    w, total = model.strengths(X), weight.sum()
    rows, (squares, errors) = np.zeros(n_rules), np.zeros((2, n_rules, model.n_outputs))
    strongest = np.argmax(w, axis=1)
    printed = Sentences.of(model).printed
    left, as_printed = np.zeros((2, model.n_outputs))
    for i, x in enumerate(X):
        f = np.array([model.consequents[r].T @ [1.0, *x] for r in range(n_rules)])
        yhat = sum(w[i, r] * f[r] for r in range(n_rules))
        r = strongest[i]
        rows[r] += weight[i]
        squares[r] += weight[i] * (f[r] - yhat) ** 2
        errors[r] += weight[i] * (f[r] - y[i]) ** 2
        left += weight[i] * (yhat - y[i]) ** 2
        as_printed += weight[i] * (printed.predict(x[None])[0] - y[i]) ** 2
    spreads = np.full((n_rules, model.n_outputs), np.nan)
    for r in np.unique(strongest):
        own, s = y[strongest == r], weight[strongest == r]
        spreads[r] = np.sqrt(np.average((own - np.average(own, axis=0, weights=s)) ** 2, 0, s))
    with np.errstate(invalid="ignore"):
        return {
            "weight": total,
            "mean": mean,
            "deviation": sd,
            "rule_weights": weight @ w / total,
            "rule_rows": rows,
            "rule_alone": np.sqrt(squares / rows[:, None]) / sd,
            "alone": np.sqrt(squares.sum(axis=0) / total) / sd,
            "rule_errors": np.sqrt(errors / rows[:, None]) / sd,
            "rule_spreads": spreads / sd,
            "errors": np.sqrt(left / total) / sd,
            "printed_errors": np.sqrt(as_printed / total) / sd,
        }


def assert_alike(found, expected, rtol=1e-9):
    for name in (field.name for field in fields(found)):
        value = getattr(expected, name) if hasattr(expected, name) else expected[name]
        # Of a single row the spread is the root of what rounding leaves.
        atol = 1e-7 if name == "rule_spreads" else 1e-9
        assert_allclose(getattr(found, name), value, rtol=rtol, atol=atol, err_msg=name)


@ALL
@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_measures_are_what_loops_find(model, unit):
    X, y, weight = data_of(model)
    data = X, unit * y, weight
    # The textbook form of the consequents, far from the origin, has lost digits: so the tolerance.
    assert_alike(measure(model, *data), by_loops(model, *data), rtol=1e-6)


def of_two_rules(first, second):
    """Constants of two rules on the input in the middle, whose terms have a width of one."""
    theta = np.array([[-1.0, 1.0], [0.0, 0.0]])
    antecedent = GridAntecedent.build([Gaussian], [1], [theta])
    return replace(
        build(antecedent, order=0),
        antecedent=antecedent,
        coefficients=np.array([first, second], dtype=float).reshape(2, 1, 1),
        minimum=np.full(3, -2.0),
        maximum=np.full(3, 2.0),
        reference=np.zeros(3),
        spread=np.ones(3),
    )


def test_a_constant_target_has_a_deviation_of_one():
    X, y, _ = data_of(ONE)
    assert_array_equal(measure(ONE, X, np.full_like(y, 0.1)).deviation, 1.0)
    flat = of_two_rules(0.1, 0.1)  # predictions that differ by rounding errors
    found = measure(flat, np.random.default_rng(0).uniform(-2, 2, (99, 3)))
    assert_array_equal(found.deviation, 1.0)
    assert found.alone[0] < 1e-12


def test_rows_of_a_rule_that_are_all_alike_have_no_spread():
    X = np.linspace(-1.0, 1.0, 90)[:, None]
    y = np.where(X < 0.0, 0.1, np.where(X < 0.5, 1.3, 1.7))
    grid = ANFISRegressor(n_mfs=2, solver="lse").fit(X, y.ravel()).model_
    first, second = measure(grid, X, y).rule_spreads[:, 0]
    assert first == 0.0
    assert second > 0.1
