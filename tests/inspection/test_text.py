"""What is written is the model: read back by a person's means, it predicts what the model does."""

import re
import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.inspection import export_text
from skanfis.inspection.text import number, place
from skanfis.membership import Gaussian

from .. import oracles
from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES, build, rows_of
from ..oracles import textbook_membership

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]
NUMBER = r"[-\d.e+]+"


def test_noise_is_told_in_the_units_of_the_target():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(2000, 1))
    y = 3e3 * (np.sin(3 * X[:, 0]) + 0.1 * rng.standard_normal(2000))
    model = ANFISRegressor(n_mfs=3)
    scaled = TransformedTargetRegressor(model, transformer=StandardScaler()).fit(X, y)
    *_, last = export_text(scaled, output_names=["drift"]).splitlines()
    told = re.fullmatch(r"Standard deviation of the noise about the rules: drift (.*)\.", last)
    assert float(told[1]) == pytest.approx(300.0, rel=4.0 / np.sqrt(2 * 2000))
    # A model that was taken as it was given knows of none.
    assert "noise" not in export_text(replace(model.fit(X, y).model_, posterior=None))


def rules_read(text):
    """Per rule: its number, {input: term}, and its value for each output as a Python expression."""
    found = re.findall(
        r"^Rule (\d+),.*\n  IF (.*)\n((?:  (?:THEN| AND) .*\n?)+)", text, re.MULTILINE
    )
    rules = []
    for label, premise, conclusion in found:
        parts = premise.split(" AND ") if premise != "anything" else []
        terms = dict(re.fullmatch(r"(.+) is (.+)", part).groups() for part in parts)
        rules.append((int(label), terms, re.findall(r"(?:THEN|AND) .+? = (.*)", conclusion)))
    return rules


def terms_read(text):
    """{(input, term): (function, {parameter: number})}."""
    terms, name = {}, None
    for line in text.partition("Terms:\n")[2].splitlines():
        if heading := re.match(r"  (\S.*), trained from", line):
            name = heading[1]
        elif term := re.match(r"    (.+?): +(\w+), (.*)", line):
            numbers = dict(pair.rsplit(" ", 1) for pair in term[3].split(", "))
            terms[name, term[1]] = term[2], {k: float(v) for k, v in numbers.items()}
    return terms


def predict_as_read(text, rows):
    """Prediction by a person with the text in hand."""
    terms, rules = terms_read(text), rules_read(text)
    outputs = []
    for row in rows:
        at = dict(zip(NAMES, row, strict=True))
        firing = [
            np.prod([textbook_membership(terms[key][0], at[key[0]], terms[key][1]) for key in rule])
            for rule in (premise.items() for _, premise, _ in rules)
        ]
        values = []
        for _, _, expressions in rules:
            for name in NAMES:
                written = name if name.isidentifier() else f"[{name}]"
                expressions = [e.replace(written, repr(float(at[name]))) for e in expressions]
            values.append([eval(e, {}) for e in expressions])
        outputs.append(np.array(firing) @ values / np.sum(firing))
    return np.array(outputs)


@ALL
@pytest.mark.parametrize("about", ["mean", "origin"])
def test_text_in_full_digits_is_the_model(model, about):
    rows = rows_of(model, 1.0)
    text = export_text(model, precision=17, about=about)
    # A constant at the origin holds -b * 1e6 with b of 1 / 600: 1e-13 of that.
    assert_allclose(predict_as_read(text, rows), model.predict(rows), atol=1e-9, rtol=1e-10)


@ALL
def test_text_in_five_digits_is_the_model_to_three(model):
    # About the mean. About the origin the constants would leave no digit of the output.
    rows = rows_of(model, 1.0)
    error = predict_as_read(export_text(model, precision=5), rows) - model.predict(rows)
    assert np.abs(error).max() < 1e-3 * np.abs(model.predict(rows)).max()


@ALL
def test_every_rule_is_told_once_the_weightiest_first(model):
    labels = [label for label, _, _ in rules_read(export_text(model))]
    assert sorted(labels) == list(range(model.n_rules))
    assert labels == sorted(labels, key=lambda r: (-model.rule_weights[r], r))
    by_number = rules_read(export_text(model, sort_by="rule"))
    assert [label for label, _, _ in by_number] == sorted(labels)
    by_rows = [label for label, _, _ in rules_read(export_text(model, sort_by="rows"))]
    assert by_rows == sorted(labels, key=lambda r: (-model.rule_rows[r], r))


def test_rules_that_matter_and_a_line_for_the_rest():
    weights = A_GRID.rule_weights
    text = export_text(A_GRID, max_rules=3)
    strongest = np.argsort(-weights)[:3]
    assert [label for label, _, _ in rules_read(text)] == list(strongest)
    left = 100 * (1 - weights[strongest].sum())
    assert f"\n9 rules with {left:.3g} % of the weight left out.\n" in text
    enough = np.flatnonzero(weights >= 0.05)
    told = [label for label, _, _ in rules_read(export_text(A_GRID, min_weight=0.05))]
    assert sorted(told) == list(enough)
    assert "left out" not in export_text(A_GRID)


def test_a_grid_in_words():
    lines = export_text(A_GRID, sort_by="rule").splitlines()
    assert lines[0] == "12 rules, 3 inputs."
    assert lines[2].startswith("Rule 0, ")
    assert lines[3] == "  IF time is low AND chip temperature is low AND rate is low"
    assert lines[6].endswith("strongest on 0 rows:")
    factors = r"(\(time - 1000100\)|\(\[chip temperature\] - 20\)|\(rate - 0.004\))"
    assert re.fullmatch(rf"  THEN y = {NUMBER}( [+-] {NUMBER} \* {factors}){{3}}", lines[4])
    assert lines[-1] == "Outside these ranges: out_of_bounds='clip'."


def test_the_reference_is_a_round_number_near_the_mean():
    # 0.2 * 600 from 1e6, in hundreds, as the spread is; 0.4 * 0.01 in thousandths.
    text = export_text(A_GRID)
    assert "(time - 1000100)" in text
    assert "(rate - 0.004)" in text


def test_places_are_told_to_digits_of_their_widths():
    # At four significant digits 1000423 would be 1000000, at a width of 600.
    term = next(t for t in A_GRID.memberships() if t["input"] == "time")
    written = terms_read(export_text(A_GRID))["time", term["name"]][1]
    assert written["center"] == pytest.approx(term["center"], abs=1e-3 * term["width"])
    assert number(1000423.4, 4) == "1000000"
    assert place(1000423.4, 4, 600.0) == "1000423.4"
    assert place(-1e-13, 4, 600.0) == "0"
    assert place(0.1 + 0.2, 17, 1.0) == "0.30000000000000004"


def test_two_outputs_and_other_names():
    model = MODELS["rule table, order 1, 2 outputs"]
    text = export_text(model, feature_names=["t", "T", "w"], output_names=["bias", "scale"])
    rule = re.search(r"Rule 0,.*\n  IF (.*)\n  THEN bias = .*\n   AND scale = .*\n", text)
    assert re.fullmatch(r"t is near \S+ AND T is near \S+", rule[1])
    assert "chip" not in text


def test_an_input_without_terms_and_a_rule_without_inputs():
    text = export_text(MODELS["grid on two inputs, order 0, 1 outputs"])
    assert "chip temperature, trained from -10 to 42.5: no terms" in text
    text = export_text(MODELS["one rule, order 0, 1 outputs"])
    assert text.startswith("1 rule, 3 inputs.\n\nRule 0, 100 % of the weight, strongest on 40 rows")
    assert "  IF anything\n  THEN y = " in text


def test_a_slope_that_moves_no_digit_is_left_out():
    coefficients = A_GRID.coefficients.copy()
    coefficients[:, 2] = 1e-9
    model = replace(A_GRID, coefficients=coefficients)
    assert "* ([chip temperature]" not in export_text(model)
    assert "* ([chip temperature]" in export_text(model, precision=12)


def test_terms_may_be_left_out():
    assert "Terms" not in export_text(A_GRID, show_terms=False)


def test_a_fitted_estimator_is_told_in_its_units():
    X = np.linspace(200.0, 400.0, 50).reshape(-1, 1)
    text = export_text(ANFISRegressor(n_mfs=2, solver="lse").fit(X, X[:, 0] ** 2))
    assert "low:  gaussian, center 200, width" in text
    assert "x0, trained from 200 to 400" in text


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"precision": 0}, ValueError, "precision=0 must be a whole number from 1 to 17"),
        ({"precision": 4.0}, ValueError, "precision"),
        ({"precision": True}, ValueError, "precision"),
        ({"about": "here"}, ValueError, "about='here' must be one of 'mean', 'origin'"),
        ({"sort_by": "name"}, ValueError, "sort_by='name' must be one of 'weight', 'rows', 'rule'"),
        ({"max_rules": 0}, ValueError, "max_rules=0 must be a whole number of 1 or more"),
        ({"min_weight": 5}, ValueError, "min_weight=5 must be a number from 0 to 1"),
        ({"min_weight": "a"}, ValueError, "min_weight='a'"),
        ({"feature_names": ["a"]}, ValueError, "feature_names has 1 names; the model has 3 inputs"),
        ({"feature_names": "abc"}, TypeError, "feature_names must be a sequence of str"),
        ({"feature_names": [1, 2, 3]}, TypeError, "feature_names must be a sequence of str"),
        ({"feature_names": list("aba")}, ValueError, "feature_names repeats a name"),
        ({"output_names": list("ab")}, ValueError, "output_names has 2 names; the model has 1 out"),
    ],
)
def test_parameters_are_checked(settings, error, message):
    with pytest.raises(error, match=message):
        export_text(A_GRID, **settings)


def test_a_model_without_data_has_no_weights_to_tell():
    # As read from a .fis file.
    model = replace(A_GRID, rule_weights=np.full(12, 1 / 12), rule_rows=np.zeros(12))
    text = export_text(model, max_rules=2)
    assert "\nRule 0:\n  IF" in text
    assert "\n10 rules left out.\n" in text


@pytest.mark.theory
def test_time_grows_with_the_number_of_rules_and_no_faster(rng):
    def seconds(n_rules):
        model = build(oracles.random_scattered(rng, Gaussian, n_rules, (0, 1, 2)))
        start = time.process_time()
        text = export_text(model)
        assert text.count("\nRule ") == n_rules
        return time.process_time() - start

    few, many = (min(seconds(n_rules) for _ in range(2)) for n_rules in (400, 3_200))
    # Eight times the rules; 30 is for a busy machine. With the square of them it would be 60.
    assert many < 30 * few
