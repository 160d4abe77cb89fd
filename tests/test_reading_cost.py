"""How much there is to read, counted in the text itself."""

import re

import pytest

from skanfis.inspection import export_text
from skanfis.reading_cost import reading_cost

from .export.rule_bases import MODELS, NAMES
from .inspection.reader import read_text


@pytest.mark.parametrize("model", MODELS.values(), ids=list(MODELS))
def test_terms_values_and_slopes_are_counted_as_they_are_written(model):
    text, counted = export_text(model, precision=17), 0
    for _, premise, said in read_text(text, NAMES).rules:
        counted += len(premise)
        # A value with the common line's part in it is one, and so is a slope with its place.
        counted += sum(1 + len(slopes) for _, _, slopes in said.values())
    _, n_basis, n_outputs = model.coefficients.shape
    n_slopes = model.n_rules * (n_basis - 1)
    assert reading_cost(model.antecedent, n_slopes, n_outputs) == counted
    assert re.search(rf"^{counted} numbers?\.$", text, re.MULTILINE)
