"""The HTML shows the rules, is well formed, and runs nothing whatever the names contain."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.inspection import rules_html
from skanfis.inspection.readability import readability_of_rows

from .drawing import A_GRID, ALL


class Page(HTMLParser):
    """Collects tags and text, and checks that every tag is closed in its turn."""

    VOID = ("br",)

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.texts = [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    def count(self, tag):
        return sum(found == tag for found, _ in self.tags)


@ALL
def test_there_is_a_line_per_rule_and_a_curve_per_term(model):
    page = Page(rules_html(model, max_rules=100))
    assert page.count("tr") == 1 + model.n_rules
    assert page.count("polyline") == model.antecedent.n_terms
    for name in model.term_names:
        assert name in "".join(page.texts)
    assert f"{model.n_rules} rule" in "".join(page.texts)


def test_the_weightiest_rules_come_first_and_the_rest_are_counted():
    text = "".join(Page(rules_html(A_GRID, max_rules=2)).texts)
    first, second = np.argsort(-A_GRID.rule_weights)[:2]
    shares = [f"{100 * A_GRID.rule_weights[r]:.3g} %" for r in (first, second)]
    assert re.search(f"{shares[0]}.*{shares[1]}.*and 10 rules with ", text, re.DOTALL)


def test_a_rule_without_rows_is_marked():
    texts = Page(rules_html(A_GRID, max_rules=100)).texts
    assert sum("(no row)" in text for text in texts) == 1


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
    assert tags == {"div", "b", "table", "tr", "th", "td", "span", "svg", "polyline", "title", "br"}
    assert page.count("b") == 1
    assert bad in page.texts
    assert not any(name.startswith("on") for _, attrs in page.tags for name in attrs)


def test_nothing_is_loaded():
    for _, attributes in Page(rules_html(A_GRID)).tags:
        assert not {"src", "href", "id", "class"} & set(attributes)
        assert "url(" not in attributes.get("style", "")


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"max_rules": 0}, "max_rules=0"), ({"precision": 99}, "from 1 to 17")],
)
def test_parameters_are_checked(settings, message):
    with pytest.raises(ValueError, match=message):
        rules_html(A_GRID, **settings)


def text_of(estimator):
    return "".join(Page(rules_html(estimator, max_rules=100)).texts)


def test_without_rows_it_says_what_can_be_said():
    # All terms of the time a hundred times as wide: neighbours cross near one.
    time, *others = A_GRID.antecedent.groups
    theta = time.theta + np.log(100.0) * (np.arange(len(time.theta)) > 0)[:, None]
    wide = replace(
        A_GRID, antecedent=replace(A_GRID.antecedent, groups=(replace(time, theta=theta), *others))
    )
    sentence = "'low' and 'high' of 'time' (1)"
    assert sentence in text_of(wide)
    assert sentence not in text_of(A_GRID)
    assert "strongest" not in text_of(wide)


def test_what_the_fit_found_is_told_in_the_names_of_the_whole():
    X = pd.DataFrame(
        {"kelvin": np.linspace(250.0, 330.0, 60), "rate": np.tile([1.0, 2.0, 4.0], 20)}
    )
    y = 1e3 + np.sin(X["kelvin"] / 20.0)
    pipe = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=[3, 2], solver="lse")).fit(X, y)
    del pipe[-1].readability_
    without = text_of(pipe)
    assert "trongest rule alone" not in without
    Z, anfis = pipe[0].transform(X), pipe[-1]
    found = readability_of_rows(anfis.model_, Z, y.to_numpy()[:, None])
    never = replace(found.measures, truth=np.full(5, 0.25))
    anfis.readability_ = replace(found, measures=never)
    text = text_of(pipe)
    assert f"Strongest rule alone {found.measures.alone[0]:.3g} sd off the model" in text
    assert "'low' of 'kelvin' (0.25)" in text
    assert "'low' of 'x0' (0.25)" in text_of(anfis)
    assert anfis._repr_html_().endswith(rules_html(anfis))
