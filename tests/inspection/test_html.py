"""The HTML shows the rules, is well formed, and runs nothing whatever the names contain."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from skanfis.inspection import rules_html

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
