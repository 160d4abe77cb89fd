"""How much there is to read, counted in the text itself."""

import re
from dataclasses import replace

import numpy as np
import pytest

from skanfis.inspection import export_text
from skanfis.reading_cost import reading_cost

from .export.rule_bases import MODELS, NAMES
from .inspection.reader import read_text
from .inspection.test_text import with_common_slopes

A_GRID = MODELS["grid, order 1, 2 outputs"]
VARIED = {
    "slopes in common": with_common_slopes(A_GRID),
    "slopes of zero": replace(A_GRID, coefficients=A_GRID.coefficients * np.c_[[1, 1, 0, 1]]),
}


@pytest.mark.parametrize("model", (MODELS | VARIED).values(), ids=list(MODELS | VARIED))
def test_terms_values_and_slopes_are_counted_as_they_are_written(model):
    text = export_text(model, precision=17)
    read = read_text(text, NAMES)
    counted = sum(map(len, read.common.values()))
    for _, premise, said in read.rules:
        counted += len(premise)
        # A value with the common line's part in it is one, and so is a slope with its place.
        counted += sum(1 + len(slopes) for _, _, slopes in said.values())
    own = model.consequents[:, 1:, 0][~model.common_slopes]
    n_slopes = np.count_nonzero(own) + model.common_slopes.any(axis=0).sum()
    assert reading_cost(model.antecedent, n_slopes, model.n_outputs) == counted
    assert re.search(rf"^{counted} numbers?\.$", text, re.MULTILINE)
