"""The tables hold the measures; what is beyond a limit is said, what is not is not."""

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.inspection import Readability, rules_table
from skanfis.inspection.findings import (
    GREATEST_ALONE,
    GREATEST_BEYOND,
    GREATEST_CROSSING,
    GREATEST_SUM,
    GREATEST_WORDLESS,
    LEAST_TRUTH,
    findings_without_rows,
)
from skanfis.inspection.readability import readability_of_rows
from skanfis.inspection.readable_terms import crossings

from ..export.rule_bases import EVERY_PAIR, MODELS, rows_of

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]


def found_of(model):
    X = rows_of(model, 1.0)
    y = np.random.default_rng(0).normal(size=(len(X), model.n_outputs))
    return readability_of_rows(model, X, y)


def all_well(model, **changes):
    """A report with measures that pass, but for what is changed."""
    found = found_of(model)
    measures = replace(
        found.measures,
        truth=np.ones_like(found.measures.truth),
        alone=np.full(model.n_outputs, GREATEST_ALONE),
        greatest_sum=np.full(model.n_outputs, GREATEST_SUM),
        wordless=np.where(np.isnan(found.measures.wordless), np.nan, GREATEST_WORDLESS),
        rule_values=np.zeros((model.n_rules, model.n_outputs)),
    )
    return replace(found, measures=replace(measures, **changes))


@ALL
def test_tables_hold_the_measures(model):
    found = found_of(model)
    measures, terms, rules = found.measures, found.terms, found.rules
    assert_array_equal(terms["greatest_truth"], measures.truth[terms.index])
    assert_array_equal(terms["crossing"], crossings(model.antecedent)[terms.index])
    every = model.memberships()
    assert [(every[t]["input"], every[t]["name"]) for t in terms.index] == list(
        zip(terms["input"], terms["term"], strict=True)
    )
    location = [next(v for v in list(every[t].values())[3:]) for t in terms.index]
    for name in set(terms["input"]):
        own = np.array(location)[(terms["input"] == name).to_numpy()]
        assert np.all(np.diff(own) > 0.0)
    assert len(rules) == model.n_rules * model.n_outputs
    for k, output in enumerate(model.output_names):
        own = rules[rules["output"] == output]
        assert_array_equal(own.index, rules_table(model).index)
        assert_array_equal(own["weight"], measures.rule_weights)
        assert_array_equal(own["rows"], measures.rule_rows)
        assert_array_equal(own["alone"], measures.rule_alone[:, k])
        assert_array_equal(own["disagreement"], measures.rule_disagreement[:, k])
        inside = (own["value"] >= measures.low[k]) & (own["value"] <= measures.high[k])
        assert_array_equal(own["in_range"], inside)
        assert_array_equal(own["beyond"] == 0.0, inside)
        line = found.outputs.loc[output]
        assert line["strongest_alone"] == measures.alone[k]
        assert line["rules_beyond"] == np.sum(own["beyond"] > GREATEST_BEYOND)
    assert found.summary["disagreement"] == measures.disagreement.max()
    if len(terms):
        assert found.summary["least_truth"] == terms["greatest_truth"].min()
        assert found.summary["greatest_crossing"] == np.nanmax(terms["crossing"])
        assert found.summary["wordless"] == found.inputs["wordless"].max()
    counts = terms.groupby("input").size()
    assert_array_equal(found.inputs["terms"], counts[found.inputs.index])
    places = [model.input_names.index(name) for name in found.inputs.index]
    assert_array_equal(found.inputs["wordless"], measures.wordless[places])


def test_terms_of_a_rule_are_told_in_words():
    rules = found_of(A_GRID).rules
    assert rules["if"][0] == "time is low AND chip temperature is low AND rate is low"


def test_nothing_is_found_at_the_limits():
    found = all_well(A_GRID)
    assert found.summary["greatest_crossing"] < GREATEST_CROSSING
    assert found.findings == []
    assert str(found).splitlines()[1:] == [
        "Nothing measured here speaks against reading the rules one by one."
    ]


def changed(name, value):
    values = getattr(all_well(A_GRID).measures, name).copy()
    values[0] = value
    return all_well(A_GRID, **{name: values})


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("truth", LEAST_TRUTH - 0.01, "A term is never truer than 0.5 on any row: 'low' of 'time'"),
        ("alone", GREATEST_ALONE + 0.01, "misses the model by 0.51 standard deviations"),
        ("greatest_sum", GREATEST_SUM + 0.01, "add up, in size, to 2.01 ranges of the target"),
        ("wordless", 0.23, "no term of an input is truer than 0.5: 'time' (23% of the rows)"),
        ("rule_values", 1e3, "A rule says where it fires what the target never was"),
        ("rule_values", -1e3, "by more than 0.25 of it: rule 0 (by "),
    ],
)
def test_what_is_beyond_a_limit_is_said(name, value, sentence):
    (found,) = changed(name, value).findings
    assert sentence in found


def test_a_value_is_beyond_from_a_quarter_of_the_range_on():
    measures = all_well(A_GRID).measures
    for share, is_said in ((0.24, False), (0.26, True)):
        value = measures.high[0] + share * (measures.high[0] - measures.low[0])
        report = changed("rule_values", (value - measures.mean[0]) / measures.deviation[0])
        assert bool(report.findings) == is_said
        assert not report.rules["in_range"][0]
        assert_allclose(report.rules["beyond"][0], share)


def test_many_are_counted():
    measures = all_well(A_GRID).measures
    (sentence,) = all_well(A_GRID, truth=np.full_like(measures.truth, 0.123456)).findings
    assert sentence.startswith("7 of 7 terms are never truer than 0.5 on any row: 'low' of 'time'")
    assert sentence.endswith("(0.123) and 2 more.")


def test_neighbours_that_cannot_be_told_apart():
    # Widths of ten times, which are all parameters but the location.
    time, *others = A_GRID.antecedent.groups
    theta = time.theta + np.log(10.0) * (np.arange(len(time.theta)) > 0)[:, None]
    groups = (replace(time, theta=theta), *others)
    wide = replace(A_GRID, antecedent=replace(A_GRID.antecedent, groups=groups))
    height = crossings(wide.antecedent)[0]
    assert height > GREATEST_CROSSING
    sentence = (
        f"Two terms can hardly be told apart, for they cross above 0.9: 'low' and 'high' of 'time' "
        f"({height:.3g})."
    )
    assert sentence in found_of(wide).findings
    assert findings_without_rows(wide)[-1] == sentence


def test_outputs_are_named_where_there_are_several():
    model = MODELS["grid, order 1, 2 outputs"]
    measures = all_well(model).measures
    found = all_well(model, alone=np.array([0.0, 3.0]), greatest_sum=np.array([5.0, 0.0]))
    first, second = found.findings
    assert "of 'y0' cancel" in first
    assert "No rule of 'y1'" in second
    assert found.summary["strongest_alone"] == 3.0
    assert measures.alone.shape == (2,)


def test_without_rows_a_term_beyond_the_range_is_found():
    theta = A_GRID.antecedent.groups[0].theta.copy()
    theta[0, 0] = A_GRID.minimum[0] - 50.0 * np.exp(theta[1, 0])
    groups = (replace(A_GRID.antecedent.groups[0], theta=theta), *A_GRID.antecedent.groups[1:])
    away = replace(A_GRID, antecedent=replace(A_GRID.antecedent, groups=groups))
    expected = "A term is never truer than 0.5 in the range of training: 'low' of 'time' (0)."
    assert expected in findings_without_rows(away)
    # On the rows, which lie in the range, it is no truer.
    assert any("'low' of 'time'" in sentence for sentence in found_of(away).findings)


def test_it_is_frozen_and_can_be_pickled():
    found = found_of(A_GRID)
    with pytest.raises(FrozenInstanceError):
        found.model = None
    again = pickle.loads(pickle.dumps(found))
    assert isinstance(again, Readability)
    assert str(again) == str(found)
    assert again.rules.equals(found.rules)
    assert repr(found).startswith("<Readability of TSKModel(12 rules")


def test_names_are_escaped_in_html():
    bad = "<b>&"
    model = replace(A_GRID, input_names=(bad, "x", "y"), term_names=("<i>",) * 7)
    html = changed("truth", 0.1)
    html = replace(html, model=model)._repr_html_()
    assert "<b>" not in html
    assert "<i>" not in html
    assert "&lt;b&gt;&amp;" in html
    assert "and 2 more lines" in html  # of twelve rules


def test_measuring_needs_no_export(fresh_process):
    # It may run in every fit: exports and pandas, where scikit-learn does not load it, take longer
    # to load than a fit.
    assert not {"skanfis.export", "pandas"} & set(fresh_process["modules_for_measuring"])
