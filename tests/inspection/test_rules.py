"""Whoever asks to read rules that cannot be read is told so, once, in the words of the columns."""

import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.exceptions import ReadabilityWarning
from skanfis.export import fold
from skanfis.inspection import export_text, readability, rules_html, rules_table

X = pd.DataFrame({"rate": np.linspace(-300.0, 300.0, 201)})
Y = np.tanh(X["rate"] / 100.0)


def unreadable():
    """A pipeline whose two rules were driven apart: 30 standard deviations up, and as many down."""
    pipeline = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=2, solver="lse")).fit(X, Y)
    last = pipeline[-1]
    apart = last.model_.coefficients.copy()
    apart[:, 0, 0] += 30.0 * np.array([Y.std(), -Y.std()])
    last.model_ = replace(last.model_, coefficients=apart)
    last.readability_ = readability(last.model_, StandardScaler().fit_transform(X), Y)
    return pipeline


@pytest.mark.parametrize("read", [export_text, rules_table])
def test_reading_rules_that_cannot_be_read_warns_once(read):
    pipeline = unreadable()
    with pytest.warns(ReadabilityWarning) as caught:
        read(pipeline)
    assert len(caught) == 1
    title, *findings, what_helps = str(caught[0].message).splitlines()
    assert title == "The rules are not fit to be read one by one:"
    assert findings == [f"- {line}" for line in readability(pipeline, X, Y).findings]
    assert findings[0].startswith("- No rule can be read without the others: the strongest alone")
    assert "let them agree more (agreement=0.01, say" in what_helps


def test_pages_and_models_that_carry_the_findings_or_know_of_none_do_not_warn():
    pipeline = unreadable()
    model = fold(pipeline)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "No rule can be read without the others" in rules_html(pipeline)
        export_text(model)
        rules_table(model)


def test_what_the_warning_proposes_helps():
    # Noise-free: the evidence lets rules cancel one another for the last digits.
    drift = 0.1 * X["rate"] + 500.0 * np.exp(-X["rate"] / 100.0)
    with pytest.warns(ReadabilityWarning):
        export_text(ANFISRegressor(n_mfs=4).fit(X, drift))
    export_text(ANFISRegressor(n_mfs=4, agreement=0.01).fit(X, drift))


def test_the_warning_speaks_of_the_columns_of_the_whole():
    steep = ANFISRegressor(n_mfs=3, solver="lse")
    pipeline = make_pipeline(StandardScaler(), steep).fit(X, Y)
    last = pipeline[-1]
    truth = np.array([1.0, 0.2, 1.0])
    last.readability_ = replace(
        last.readability_, measures=replace(last.readability_.measures, truth=truth)
    )
    with pytest.warns(ReadabilityWarning, match=r"'medium' of 'rate' \(0\.2\)"):
        export_text(pipeline)
    with pytest.warns(ReadabilityWarning, match=r"'medium' of 'turn rate' \(0\.2\)"):
        export_text(pipeline, feature_names=["turn rate"])
