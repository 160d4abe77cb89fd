"""Readability: its tables and sentences, pipelines and tables of every kind."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.digits import in_digits
from skanfis.inspection import explain, export_text, readability

from ..export.rule_bases import MODELS, rows_of
from ..quick import quick
from .encoded import encoded

A_GRID = MODELS["grid, order 1, 1 outputs"]
WELL = "Nothing measured here speaks against reading the rules one by one."


def found_of(model, **changes):
    """A report with measures that pass, but for what is changed."""
    X = rows_of(model, 1.0)
    y = np.random.default_rng(0).normal(size=(len(X), model.n_outputs))
    found = readability(model, X, y)
    ones, rows = np.ones(model.n_outputs), changes.pop("rule_rows", np.full(model.n_rules, 50.0))
    passing = {"alone": 0.5 * ones, "errors": ones, "printed_errors": ones}
    passing["rule_spreads"] = found.measures.rule_errors / 1.0499
    measures = replace(found.measures, **(passing | changes))
    return replace(found, model=replace(model, rule_rows=rows), measures=measures)


def test_errors_are_in_the_units_of_the_target_whatever_the_rows(rng):
    X = rng.uniform(-1.0, 1.0, (200, 2))
    y = 10.0 * np.tanh(3.0 * X[:, 0]) + rng.normal(size=200)
    model = quick(n_mfs=[2, 1]).fit(X, y)
    few = np.abs(X[:, 0]) < 0.3
    errors = readability(model, X[few], y[few]).rules["error"]
    values = explain(model, X[few])
    values = values[values["strength"] > 0.5]
    for r, error in errors.items():
        own = values[values["rule"] == r]
        assert_allclose(error, np.sqrt(np.mean((own["value"] - y[few][own["row"]]) ** 2)))
    # Behind a scaler of the target as well what the fit has found is in its units.
    scaled = TransformedTargetRegressor(quick(n_mfs=[2, 1]), transformer=StandardScaler())
    told = re.findall(r"errs by (\S+) there", export_text(scaled.fit(X, y)))
    assert sorted(told) == sorted(in_digits(e, 2) for e in readability(scaled, X, y).rules["error"])


def test_nothing_is_found_at_the_limits():
    found = found_of(A_GRID, printed_errors=np.array([1.05]))
    assert found.findings == []
    line = "84 numbers; the text as printed errs 5 % more than the model."
    assert str(found).splitlines() == [line, WELL]
    assert found.rules["if"][0] == "time is low AND chip temperature is low AND rate is low"
    assert found_of(A_GRID, errors=np.zeros(1)).line == "84 numbers"


def test_what_is_beyond_a_limit_is_said():
    (sentence,) = found_of(A_GRID, alone=np.array([0.51])).findings
    assert sentence.startswith("No rule can be read without the others: used alone, the strongest")
    two = found_of(MODELS["grid, order 1, 2 outputs"], alone=np.array([0.0, 3.0]))
    assert "No rule of 'y1'" in two.findings[0]
    assert two.summary["strongest_alone"] == 3.0
    (sentence,) = found_of(A_GRID, printed_errors=np.array([1.06])).findings
    assert sentence.startswith("The text as printed errs 1.06 times as much as the model: print")
    # An output without an error, as one that never changes, hides no other.
    constant = {"errors": np.array([0.0, 1.0]), "printed_errors": np.array([0.0, 1.06])}
    assert found_of(two.model, **constant).findings == [sentence]
    (sentence,) = found_of(A_GRID, rule_rows=np.array([*[50.0] * 11, 6.0])).findings
    assert sentence == (
        "Strongest on fewer rows than its sentence has numbers: rule 11 (rows: 6, numbers: 7)."
    )
    (sentence,) = found_of(A_GRID, rule_rows=np.array([*[50.0] * 10, 6.0, 5.0])).findings
    assert sentence.endswith(": rule 10 (rows: 6, numbers: 7), rule 11 (rows: 5, numbers: 7).")


def test_a_rule_that_errs_more_than_the_mean_of_its_rows_is_named():
    X = np.concatenate([np.linspace(0.0, 0.1, 50), np.linspace(0.9, 1.0, 50)])[:, None]
    y = 10.0 * np.round(X) + np.tile([[-1.0], [1.0]], (50, 1))
    model = ANFISRegressor(n_mfs=2, order=0, agreement=1.0).fit(X, y.ravel()).model_
    assert readability(model, X, y).findings == []
    # On rows of another deviation too a rule errs in units of the target.
    error = np.sqrt(np.mean((model.coefficients[0] - y[:50]) ** 2))
    assert_allclose(readability(model, X[:50], y[:50]).rule_errors[0], error)
    coefficients = model.coefficients.copy()
    coefficients[1] += 3.0
    poor = readability(replace(model, coefficients=coefficients), X, y)
    errs = np.sqrt(np.mean((coefficients[1] - y[50:]) ** 2))
    assert [one for one in poor.findings if "constant" in one] == [
        "Errs more on its own rows than a constant would: rule 1 "
        f"(errs by {in_digits(errs, 3)}, a constant by 1)."
    ]
    # Through one row a constant may go itself.
    of_one_row = replace(poor.model, rule_rows=np.array([99.0, 1.0]))
    assert readability(of_one_row, X, y).findings == [
        "Strongest on fewer rows than its sentence has numbers: rule 1 (rows: 1, numbers: 2)."
    ]
    for n_rows, told in ((1, False), (2, True)):
        chunk = readability(poor.model, X[-n_rows:], y[-n_rows:])
        assert ("constant" in str(replace(chunk, is_of_chunk=True))) == told


def test_rows_are_counted_whatever_the_unit_of_the_weights(rng):
    X = rng.normal(size=(300, 2))
    y, weight = np.abs(X[:, 0]) + 0.1 * rng.standard_normal(300), rng.uniform(0.5, 1.5, 300)
    model = ANFISRegressor(partition="tree", max_rules=2)
    for unit in (1e-4, 1.0):
        assert "fewer rows" not in str(model.fit(X, y, unit * weight).readability_)
    few = replace(model.model_, rule_rows=np.array([298.0, 2.0]))
    assert "rule 1 (rows: 2, numbers:" in str(replace(model.readability_, model=few))


def test_rules_that_go_different_ways_beyond_chance(rng):
    X = pd.DataFrame(rng.normal(size=(500, 2)), columns=["rate", "time"])
    y = np.abs(X["rate"]) + X["time"] + 0.1 * rng.standard_normal(500)
    found = ANFISRegressor(partition="tree", max_rules=2).fit(X, y).readability_
    (sentence,) = [one for one in found.findings if "ways" in one]
    assert sentence == (
        "Rules go different ways, beyond chance: by rate up in rule 0 and down in rule 1."
    )
    # Of a slope whose deviation is a hundred times as large nothing can be said.
    model = found.model
    posterior = replace(model.posterior, consequents=100.0 * model.posterior.consequents)
    unsure = replace(found, model=replace(model, posterior=posterior))
    assert not [one for one in unsure.findings if "ways" in one]
    for sign in (1.0, -1.0):
        line = ANFISRegressor(n_mfs=1).fit(X, sign * X["time"] + 0.1 * rng.standard_normal(500))
        assert not line.readability_.findings


def test_of_many_slopes_some_are_two_deviations_off_by_chance(rng):
    # Nothing pulls on the slopes of eight rules by ten inputs, which only noise moves.
    model, told = ANFISRegressor([2, 2, 2, *7 * [1]], solver="lse", alpha=0.0, agreement=0.0), 0
    for _ in range(10):
        X = rng.normal(size=(500, 10))
        told += "ways" in str(model.fit(X, rng.normal(size=500)).readability_)
    assert told <= 2


def test_levels_go_different_ways_whatever_level_a_rule_counts_from(rng):
    # In each of two rules another level is the commonest, and the better one.
    best = np.where(np.arange(600) % 2, "A", "B")
    kind = np.where(rng.uniform(size=600) < 0.7, best, rng.choice(["A", "B"], 600))
    X = pd.DataFrame({"kind": kind, "on": np.arange(600) % 2})
    y = 3.0 * (kind == best) + 0.1 * rng.standard_normal(600)
    model = ANFISRegressor(partition="tree", max_rules=2, premise_features=[2])
    pipe = encoded(["kind"], model).fit(X, y)
    text = export_text(pipe)
    assert "if kind is A" in text
    assert "if kind is B" in text
    (sentence,) = readability(pipe, X, y).findings
    assert re.search("chance: if kind is [AB], up in rule [01] and down in rule [01].$", sentence)


def test_errors_name_the_row_and_the_column():
    X = rows_of(A_GRID, 1.0)
    bad = X.copy()
    bad[33, 1] = np.nan
    with pytest.raises(ValueError, match="'chip temperature', first at row 33; 1 of its 40 values"):
        readability(A_GRID, bad)
    with pytest.raises(ValueError, match=r"X has the shape \(\d+, 2\): the estimator"):
        readability(A_GRID, X[:, :2])
    with pytest.raises(ValueError, match=r"for each output of the model, 'y'; it has 2"):
        readability(A_GRID, X, np.ones((40, 2)))
    with pytest.raises(ValueError, match="Input y contains NaN in column 'y', first at row 3"):
        readability(A_GRID, X, np.where(np.arange(40) == 3, np.nan, 1.0))
    for settings in ({"y": np.ones(39)}, {"sample_weight": np.ones(39)}):
        with pytest.raises(ValueError, match="inconsistent numbers of samples"):
            readability(A_GRID, X, **settings)
    with pytest.raises(ValueError, match="Negative values in sample_weight: -1 at row 0"):
        readability(A_GRID, X, sample_weight=-np.ones(40))
    with pytest.raises(ValueError, match=r"X has the shape \(0, 3\)"):
        readability(A_GRID, X[:0])
    with pytest.raises(TypeError, match="must be a fitted ANFIS estimator"):
        readability(None, X)
