"""Files of models: they come back, and no damage does more than to be refused."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.export import export_fis, export_json
from skanfis.export.fis.reader import parse_fis
from skanfis.export.json_reader import parse_json

from ..export.mutations import HOSTILE_NUMBERS, mutated, number_paths, seeds, with_number
from ..export.rule_bases import rows_of
from .strategies import frozen_models

SOUND = seeds()


@given(frozen_models())
def test_json_comes_back_to_the_last_bit(model):
    rows = rows_of(model, 1.5)
    assert_array_equal(parse_json(export_json(model)).predict(rows), model.predict(rows))


@given(frozen_models(), st.data())
def test_json_with_other_numbers_is_finite_or_refused(model, data):
    document = json.loads(export_json(model))
    paths = list(number_paths(document))
    for _ in range(data.draw(st.integers(1, 3), label="changes")):
        path = data.draw(st.sampled_from(paths), label="path")
        numbers = st.floats() | st.integers() | st.sampled_from(HOSTILE_NUMBERS)
        document = with_number(document, path, data.draw(numbers, label="value"))
    try:
        read = parse_json(json.dumps(document))
    except ValueError:
        return
    rows = rows_of(model, 2.0, 5)
    assert np.isfinite(read.predict(rows)).all()
    assert np.isfinite(read.coverage(rows)).all()


@given(st.text() | st.recursive(st.none() | st.floats() | st.text(), st.lists).map(json.dumps))
def test_json_that_is_something_else_is_refused(text):
    with pytest.raises(ValueError, match=r"\w"):
        parse_json(text)


@given(frozen_models())
def test_fis_comes_back(model):
    try:
        text = export_fis(model)
    except UserWarning:
        return  # of places where the file does not say the same
    rows = rows_of(model, 0.99)
    wanted = model.predict(rows)
    assert_allclose(parse_fis(text).predict(rows), wanted, rtol=1e-6, atol=1e-6 * np.ptp(wanted))


@given(st.integers(0, 2**32 - 1))
def test_spoilt_fis_is_finite_or_refused(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        try:
            model = parse_fis(mutated(rng, SOUND).decode("utf-8-sig"))
        except ValueError:
            continue
        middle = 0.5 * (model.minimum + model.maximum)
        assert np.isfinite(model.predict(np.array([model.minimum, middle, model.maximum]))).all()
