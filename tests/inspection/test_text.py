"""Text and HTML of rules are the model, and run nothing whatever the names contain."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from numpy.testing import assert_allclose
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.inspection import export_text, rules_html
from skanfis.inspection.text import number, place

from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES, rows_of
from ..oracles import textbook_membership

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]
NUMBER = r"[-\d.e+]+"
WRITTEN = [name if name.isidentifier() else f"[{name}]" for name in NAMES]


def with_common_slopes(model):
    """By the first input all rules have one slope, by the last one all but the first rule."""
    coefficients = model.coefficients.copy()
    coefficients[:, 1] = coefficients[0, 1]
    coefficients[1:, -1] = coefficients[1, -1]
    return replace(model, coefficients=coefficients)


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
    """Per rule: its number, pairs (input, term), and by output its value as a Python expression."""
    found = re.findall(
        r"^Rule (\d+),.*\n  IF (.*)\n((?:  (?:THEN| AND) .*\n?)+)", text, re.MULTILINE
    )
    rules = []
    for label, premise, conclusion in found:
        parts = premise.split(" AND ") if premise != "anything" else []
        terms = []
        for part in parts:
            name, term, sides = re.fullmatch(r"(.+?) (?:is (.+)|([<>] .+))", part).groups()
            terms += [(name, one) for one in (sides.split(" and ") if sides else [term])]
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


def common_read(text):
    """Of every output, the terms of the common line by their inputs, as Python expressions."""
    found = re.findall(r"^Common to the rules, .+?: (.*)$", text, re.MULTILINE)
    term = rf"(?:^|[+-] ){NUMBER} \* \(?({'|'.join(map(re.escape, WRITTEN))})(?: [+-] {NUMBER}\))?"
    return [{part[1]: part[0] for part in re.finditer(term, line)} for line in found]


def with_common(expression, common):
    """A rule's value with those parts of the common line by whose inputs it says nothing itself."""
    return expression + "".join(
        f" + ({part})" for name, part in common.items() if name not in expression
    )


def predict_as_read(text, rows):
    """Prediction by a person with the text in hand."""
    terms, rules, common = terms_read(text), rules_read(text), common_read(text)
    if common:
        rules = [
            (label, rule, [with_common(e, c) for e, c in zip(expressions, common, strict=True)])
            for label, rule, expressions in rules
        ]
    outputs = []
    for row in rows:
        at = dict(zip(NAMES, row, strict=True))
        firing = [
            np.prod([textbook_membership(terms[key][0], at[key[0]], terms[key][1]) for key in rule])
            for _, rule, _ in rules
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


@pytest.mark.parametrize("name", ["grid", "rule table"])
@pytest.mark.parametrize("n_outputs", [1, 2])
def test_slopes_in_common_are_told_once(name, n_outputs):
    model = with_common_slopes(MODELS[f"{name}, order 1, {n_outputs} outputs"])
    text, rows = export_text(model, precision=17), rows_of(model, 1.0)
    assert_allclose(predict_as_read(text, rows), model.predict(rows), atol=1e-9, rtol=1e-10)
    expected = np.ones((model.n_rules, 3), dtype=bool)
    expected[:, 1], expected[0, 2] = False, False
    assert (model.common_slopes == expected).all()
    for _, _, values in rules_read(text):
        assert all("time" not in value for value in values)
    assert "time" in rules_html(model).partition("common to the rules")[2]


@ALL
def test_every_rule_is_told_once_the_weightiest_first(model):
    labels = [label for label, _, _ in rules_read(export_text(model))]
    assert sorted(labels) == list(range(model.n_rules))
    assert labels == sorted(labels, key=lambda r: (-model.rule_weights[r], r))


def test_rules_that_matter_and_a_line_for_the_rest():
    weights = A_GRID.rule_weights
    text = export_text(A_GRID, max_shown=3)
    strongest = np.argsort(-weights)[:3]
    assert [label for label, _, _ in rules_read(text)] == list(strongest)
    left = 100 * (1 - weights[strongest].sum())
    assert f"\n9 rules with {left:.3g} % of the weight left out.\n" in text
    assert "left out" not in export_text(A_GRID)


def test_a_grid_in_words():
    lines = export_text(A_GRID).splitlines()
    assert lines[0] == "12 rules, 3 inputs."
    start = [line.partition(",")[0] for line in lines].index("Rule 0")
    assert lines[start + 1] == "  IF time is low AND chip temperature is low AND rate is low"
    # The reference: 0.2 * 600 from 1e6, in hundreds, as the spread is; 0.4 * 0.01 in thousandths.
    factors = r"(\(time - 1000100\)|\(\[chip temperature\] - 20\)|\(rate - 0.004\))"
    assert re.fullmatch(rf"  THEN y = {NUMBER}( [+-] {NUMBER} \* {factors}){{3}}", lines[start + 2])
    assert lines[-1] == "Outside these ranges: out_of_bounds='clip'."


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


def test_a_slope_that_moves_no_digit_is_left_out():
    coefficients = A_GRID.coefficients.copy()
    coefficients[:, 2] = 1e-9
    model = replace(A_GRID, coefficients=coefficients)
    assert "* ([chip temperature]" not in export_text(model)
    assert "* ([chip temperature]" in export_text(model, precision=12)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"precision": 0}, ValueError, "precision=0 must be a whole number from 1 to 17"),
        ({"about": "here"}, ValueError, "about='here' must be one of 'mean', 'origin'"),
        ({"max_shown": 0}, ValueError, "max_shown=0 must be a whole number of 1 or more"),
        ({"feature_names": ["a"]}, ValueError, "must be 3 names, all different"),
        ({"feature_names": "abc"}, TypeError, "feature_names must be a sequence of str"),
        (
            {"feature_names": list("aba")},
            ValueError,
            "feature_names=.* must be 3 names, all different",
        ),
        ({"output_names": list("ab")}, ValueError, "output_names=.* must be 1 names"),
    ],
)
def test_parameters_are_checked(settings, error, message):
    with pytest.raises(error, match=message):
        export_text(A_GRID, **settings)


def test_a_model_without_data_has_no_weights_to_tell():
    # As read from a .fis file.
    model = replace(A_GRID, rule_weights=np.full(12, 1 / 12), rule_rows=np.zeros(12))
    text = export_text(model, max_shown=2)
    assert "\nRule 0:\n  IF" in text
    assert "\n10 rules left out.\n" in text


class Page(HTMLParser):
    """Collects tags and text, and checks that every tag is closed in its turn."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.texts = [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    def count(self, tag):
        return sum(found == tag for found, _ in self.tags)


@ALL
def test_there_is_a_line_per_rule(model):
    page = Page(rules_html(model, max_shown=100))
    assert "".join(page.texts).count("(no row)") == np.sum(model.rule_rows < 0.5)
    assert page.count("tr") == 2 + model.n_rules
    terms = model.antecedent.rule_terms
    told = "\n".join(page.texts)
    for t in np.unique(terms[terms >= 0]):
        assert model.term_names[t] in told
    assert f"{model.n_rules} rule" in "".join(page.texts)


def test_names_are_text_whatever_they_contain():
    bad = '</td><script>alert("1")</script>&amp;'
    model = replace(
        A_GRID,
        input_names=(bad, "a<b", "c & 'd'"),
        output_names=("<img src=x onerror=alert(1)>",),
        term_names=tuple(f"<b>{name}" for name in A_GRID.term_names),
    )
    page = Page(rules_html(model))
    tags = {tag for tag, _ in page.tags}
    assert not tags & {"script", "img", "link", "a"}
    assert page.count("b") == 1
    assert any(bad in text for text in page.texts)
    for _, attributes in page.tags:
        assert not any(name.startswith("on") for name in attributes)
        assert not {"src", "href"} & set(attributes)
