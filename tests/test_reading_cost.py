"""How much there is to read, counted in the text itself."""

import re

import pytest

from skanfis.inspection import export_text
from skanfis.reading_cost import reading_cost

from .export.rule_bases import MODELS
from .inspection.test_text import rules_read

NUMERAL = r"\d[\d.]*(?:e[-+]?\d+)?"
NAME = r"(?:\[[^]]+\]|\b[a-z]\w*)"


@pytest.mark.parametrize("model", MODELS.values(), ids=list(MODELS))
def test_terms_values_and_slopes_are_counted_as_they_are_written(model):
    counted = 0
    for _, premise, conclusions in rules_read(export_text(model)):
        counted += len(premise)
        for conclusion in conclusions:
            # A slope and the place from which it counts are one.
            alone = re.sub(rf"\({NAME} [-+] {NUMERAL}\)", "", conclusion)
            counted += len(re.findall(NUMERAL, re.sub(NAME, "", alone)))
    _, n_basis, n_outputs = model.coefficients.shape
    n_slopes = model.n_rules * (n_basis - 1)
    assert reading_cost(model.antecedent, n_slopes, n_outputs) == counted
