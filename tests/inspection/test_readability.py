"""Readability: its tables and sentences, pipelines and tables of every kind, the warning."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.antecedent import TreeAntecedent
from skanfis.exceptions import ReadabilityWarning
from skanfis.inspection import (
    export_text,
    measures,
    readability,
    rules_html,
    rules_table,
)
from skanfis.inspection.measures import crossings
from skanfis.inspection.readability import readability_of_rows

from ..export.rule_bases import EVERY_PAIR, MODELS, rows_of

A_GRID = MODELS["grid, order 1, 1 outputs"]
WELL = "Nothing measured here speaks against reading the rules one by one."


def found_of(model, **changes):
    """A report with measures that pass, but for what is changed."""
    X = rows_of(model, 1.0)
    y = np.random.default_rng(0).normal(size=(len(X), model.n_outputs))
    found = readability_of_rows(model, X, y)
    passing = {"truth": np.ones_like(found.measures.truth), "alone": np.full(model.n_outputs, 0.5)}
    return replace(found, measures=replace(found.measures, **(passing | changes)))


@pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
def test_tables_hold_the_measures(model):
    found = readability_of_rows(model, rows_of(model, 1.0))
    measures, terms, rules = found.measures, found.terms, found.rules
    assert_array_equal(terms["greatest_truth"], measures.truth[terms.index])
    assert_array_equal(terms["crossing"], crossings(model.antecedent)[terms.index])
    every = model.memberships()
    assert [(every[t]["input"], every[t]["name"]) for t in terms.index] == list(
        zip(terms["input"], terms["term"], strict=True)
    )
    for name in set(terms["input"]):
        own = terms.index[terms["input"] == name]
        gaps = np.diff([list(every[t].values())[3] for t in own])
        # Both sides of a cut have one place.
        assert np.all(gaps >= 0.0 if isinstance(model.antecedent, TreeAntecedent) else gaps > 0.0)
    for k, output in enumerate(model.output_names):
        own = rules[rules["output"] == output]
        assert_array_equal(own.index, np.arange(model.n_rules))
        assert_array_equal(own["weight"], measures.rule_weights)
        assert_array_equal(own["rows"], measures.rule_rows)
        assert_array_equal(own["alone"], measures.rule_alone[:, k])
    expected = [measures.alone.max(), terms["greatest_truth"].min(), terms["crossing"].max()]
    assert_array_equal(found.summary, expected)
    assert set(found.limits) == set(found.summary.index)


def test_the_numerals_of_the_sentences_are_counted():
    # "IF time is low AND chip temperature is low AND rate is low THEN y = a + b t + c T + d rate".
    assert found_of(A_GRID).reading_cost == 12 * (3 + 4)
    assert found_of(MODELS["grid, order 1, 2 outputs"]).reading_cost == 12 * (3 + 2 * 4)
    level = A_GRID.coefficients.copy()
    level[:, 2] = 0.0
    assert found_of(replace(A_GRID, coefficients=level)).reading_cost == 12 * (3 + 3)


def test_what_is_common_counts_once():
    common = A_GRID.coefficients.copy()
    common[:, 2] = 3.0
    common[1:, 1] = 2.0
    # Twelve of the last slope, two and one of what is common.
    found = found_of(replace(A_GRID, coefficients=common))
    assert found.reading_cost == 12 * (3 + 1) + 12 + 2 + 1


def test_nothing_is_found_at_the_limits():
    found = found_of(A_GRID)
    assert found.findings == []
    assert str(found).splitlines()[1:] == [WELL]
    assert found.rules["if"][0] == "time is low AND chip temperature is low AND rate is low"


def test_what_is_beyond_a_limit_is_said():
    truth = np.ones(7)
    truth[0] = 0.49
    (sentence,) = found_of(A_GRID, truth=truth).findings
    assert sentence == "A term is never truer than 0.5 on any row: 'low' of 'time' (0.49)."
    (sentence,) = found_of(A_GRID, truth=np.full(7, 0.123456)).findings
    assert sentence.startswith("7 of 7 terms are never truer than 0.5 on any row: 'low' of 'time'")
    assert sentence.endswith("(0.123) and 2 more.")
    (sentence,) = found_of(A_GRID, alone=np.array([0.51])).findings
    assert sentence.startswith("No rule can be read without the others: the strongest alone misses")
    two = found_of(MODELS["grid, order 1, 2 outputs"], alone=np.array([0.0, 3.0]))
    assert "No rule of 'y1'" in two.findings[0]
    assert two.summary["strongest_alone"] == 3.0


def test_neighbours_that_cannot_be_told_apart():
    # Widths of ten times, which are all parameters but the location.
    time, *others = A_GRID.antecedent.groups
    theta = time.theta + np.log(10.0) * (np.arange(len(time.theta)) > 0)[:, None]
    groups = (replace(time, theta=theta), *others)
    wide = replace(A_GRID, antecedent=replace(A_GRID.antecedent, groups=groups))
    height = crossings(wide.antecedent)[0]
    assert found_of(wide).findings == [
        f"Two terms can hardly be told apart, for they cross above 0.9: 'low' and 'high' of 'time' "
        f"({height:.3g})."
    ]


def target_of(X):
    return 1e3 + np.sin(X["kelvin"] / 20) + 1e6 * X["rate"] ** 2


def assert_same(found, expected, rtol=1e-9):
    assert_allclose(found.summary, expected.summary, rtol=rtol)
    assert_allclose(found.rules["alone"], expected.rules["alone"], rtol=rtol)
    assert_allclose(found.terms["greatest_truth"], expected.terms["greatest_truth"], rtol=rtol)


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_estimators_around_the_model_are_measured_in_their_own_units(fitted):
    pipe, X = fitted
    y = target_of(X)
    found = readability(pipe, X, y)
    assert_same(found, readability(pipe[-1], pipe[:-1].transform(X), y))
    assert list(found.terms["input"]) == ["kelvin"] * 3 + ["rate"] * 2
    assert_same(readability(pipe, X), readability(pipe, X, pipe.predict(X)))


def test_errors_name_the_row_and_the_column(monkeypatch):
    X = rows_of(A_GRID, 1.0)
    monkeypatch.setattr(measures, "LARGE_BLOCK_ROWS", 10)
    bad = X.copy()
    bad[33, 1] = np.nan
    with pytest.raises(ValueError, match="'chip temperature', first at row 33; 1 of its 40 values"):
        readability(A_GRID, bad)
    with pytest.raises(ValueError, match="X has 2 columns, the estimator takes 3"):
        readability(A_GRID, X[:, :2])
    with pytest.raises(ValueError, match=r"y has 2 columns; the model has 1 outputs: 'y'"):
        readability(A_GRID, X, np.ones((40, 2)))
    with pytest.raises(ValueError, match="Input y contains NaN in column 'y', first at row 3"):
        readability(A_GRID, X, np.where(np.arange(40) == 3, np.nan, 1.0))
    for settings in ({"y": np.ones(39)}, {"sample_weight": np.ones(39)}):
        with pytest.raises(ValueError, match="inconsistent numbers of samples"):
            readability(A_GRID, X, **settings)
    with pytest.raises(ValueError, match="Negative values in sample_weight: -1 at row 0"):
        readability(A_GRID, X, sample_weight=-np.ones(40))
    with pytest.raises(ValueError, match="minimum of 1 is required"):
        readability(A_GRID, X[:0])
    with pytest.raises(TypeError, match="must be a fitted ANFIS estimator"):
        readability(None, X)


def unreadable():
    """A pipeline whose two rules were driven apart: 30 standard deviations up, and as many down."""
    X = pd.DataFrame({"rate": np.linspace(-300.0, 300.0, 201)})
    y = np.tanh(X["rate"] / 100.0)
    pipeline = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=2, solver="lse")).fit(X, y)
    last = pipeline[-1]
    apart = last.model_.coefficients.copy()
    apart[:, 0, 0] += 30.0 * np.array([y.std(), -y.std()])
    last.model_ = replace(last.model_, coefficients=apart)
    last.readability_ = readability(last.model_, StandardScaler().fit_transform(X), y)
    return pipeline, readability(pipeline, X, y)


@pytest.mark.parametrize("read", [export_text, rules_table])
def test_reading_rules_that_cannot_be_read_warns_once(read):
    pipeline, found = unreadable()
    with pytest.warns(ReadabilityWarning) as caught:
        read(pipeline)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    title, *findings, what_helps = str(caught[0].message).splitlines()
    assert title == "The rules are not fit to be read one by one:"
    assert findings == [f"- {line}" for line in found.findings]
    assert "let them agree more (agreement=0.01, say" in what_helps


def test_findings_of_the_fit_are_in_the_names_of_the_whole():
    pipeline, _ = unreadable()
    last = pipeline[-1]
    measures = replace(last.readability_.measures, truth=np.array([1.0, 0.2]), alone=np.zeros(1))
    last.readability_ = replace(last.readability_, measures=measures)
    with pytest.warns(ReadabilityWarning, match=r"'high' of 'rate' \(0\.2\)"):
        export_text(pipeline)
    with pytest.warns(ReadabilityWarning, match=r"'high' of 'turn rate' \(0\.2\)"):
        export_text(pipeline, feature_names=["turn rate"])
    page = rules_html(pipeline)
    assert "Strongest rule alone 0 sd off the model" in page
    assert "&#x27;high&#x27; of &#x27;rate&#x27; (0.2)" in page
