"""Writing .fis files: what is in them, and that they come back."""

import re
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import RuleTableAntecedent
from skanfis.export import export_fis
from skanfis.export.fis.reader import parse_fis
from skanfis.membership import MEMBERSHIPS
from skanfis.policies import OUT_OF_BOUNDS

from .. import oracles
from .rule_bases import EVERY_PAIR, MODELS, build, narrow_target, rows_of

A_GRID = MODELS["grid, order 1, 1 outputs"]


def full_scale(model):
    return np.ptp(model.predict(rows_of(model, 1.0, 200)), axis=0).max()


@pytest.mark.parametrize("name", EVERY_PAIR)
def test_comes_back_as_it_was(name):
    model = EVERY_PAIR[name]
    read = parse_fis(export_fis(model))
    rows = rows_of(model, 1.3, 200)
    # Time lies at 1e6 with a range of 2,000: this many digits a constant about zero loses.
    assert_allclose(read.predict(rows), model.predict(rows), atol=1e-11 * full_scale(model))
    assert_array_equal(read.minimum, model.minimum)
    assert_array_equal(read.maximum, model.maximum)
    assert read.antecedent.n_rules == model.n_rules
    assert read.order == model.order


@pytest.mark.parametrize("policy", OUT_OF_BOUNDS)
def test_says_the_policy_that_the_format_cannot(policy):
    text = export_fis(replace(A_GRID, out_of_bounds=policy, max_extrapolation=0.25))
    assert (f"out_of_bounds={policy!r}" in text) is (policy != "clip")
    assert ("max_extrapolation=0.25" in text) is (policy == "linear")
    assert parse_fis(text).out_of_bounds == "clip"


def test_names_become_identifiers_that_stay_apart():
    names = ("naïve (1)", "naïve [1]", "'; rm -rf /\n[Rules]")
    terms = ("is", "is not", "-1.5", "1.5", "\N{SNOWMAN}", "a'b", "AND")
    model = replace(A_GRID, input_names=names, term_names=terms)
    text = export_fis(model)
    read = parse_fis(text)
    assert read.input_names == ("naive_1", "naive_1_2", "rm_rf_Rules")
    assert read.term_names == ("term_is", "is_not", "minus_1_5", "term_1_5", "term3", "a_b", "AND")
    # In a comment, where a line end would have begun a line of its own.
    assert '% Input3 is "\'; rm -rf /\\n[Rules]".\n' in text
    rows = rows_of(model, 1.0)
    assert_allclose(read.predict(rows), model.predict(rows), atol=1e-11 * full_scale(model))


@pytest.mark.parametrize(("spacing", "has_gap"), [(1.0, True), (6.0, False)])
def test_warns_where_no_rule_of_the_file_fires(spacing, has_gap, rng):
    family = MEMBERSHIPS["triangular"]
    theta = family.start(np.array([-1.5, 1.5]), np.full(2, spacing), 0.5)
    antecedent = oracles.random_grid(rng, [family], [2], [0]).with_parameters(theta.ravel())
    told = pytest.warns(UserWarning, match=r"At [\d.]+ % of 1000 points")
    # Any other warning is an error.
    with told if has_gap else nullcontext():
        export_fis(build(antecedent, order=0))


@pytest.mark.parametrize("family", MEMBERSHIPS.values(), ids=list(MEMBERSHIPS))
@pytest.mark.parametrize("scale", [1e-51, 1e-30, 1e30, 1e51])
@pytest.mark.filterwarnings("ignore:.*no rule")
def test_what_is_written_can_be_read_or_is_refused(family, scale, rng):
    model = build(oracles.random_grid(rng, [family, family], [2, 3], [0, 2]))
    antecedent = model.antecedent.change_units(np.zeros(3), np.full(3, scale))
    box = {k: getattr(model, k) * scale for k in ("reference", "spread", "minimum", "maximum")}
    moved = replace(model, antecedent=antecedent, **box)
    if not 1e-40 < scale < 1e40:
        with pytest.raises(ValueError, match="cannot write what read_fis would refuse"):
            export_fis(moved)
        return
    text = export_fis(moved)
    rows = rows_of(moved, 1.0)
    found = parse_fis(text).predict(rows)
    assert_allclose(found, moved.predict(rows), rtol=1e-9, atol=1e-9 * np.abs(found).max())


def test_a_rule_that_asks_nothing_is_given_a_condition_that_always_holds():
    table = MODELS["rule table, order 1, 1 outputs"].antecedent
    asked = table.rule_terms.copy()
    asked[1] = -1
    model = build(RuleTableAntecedent(table.groups, asked))
    text = export_fis(model)
    # Other programs take no rule without a condition.
    assert "\n0 0 0, " not in text
    rows = rows_of(model, 1.0, 200)
    assert_allclose(parse_fis(text).predict(rows), model.predict(rows), atol=1e-9)


def test_says_that_constraints_hold_in_the_range_alone():
    told = "constraints of the fit hold within the Range"
    assert told not in export_fis(A_GRID)
    at = np.full(A_GRID.n_inputs, np.nan)
    at[0] = 0.5 * (A_GRID.minimum[0] + A_GRID.maximum[0])
    assert told in export_fis(replace(A_GRID, tangent_at=at))


def test_says_what_outputs_are_held_within():
    assert "held" not in export_fis(A_GRID)
    model = replace(MODELS["tree, order 1, 2 outputs"], target=narrow_target(2))
    told = r"At [\d.]+ % of 1000 points .* the \.fis file goes beyond"
    with pytest.warns(UserWarning, match=told):
        text = export_fis(model)
    found = re.findall(r"% In skanfis, Output[12] is held within \[(.*) (.*)\]: clamp", text)
    rows = rows_of(model, 1.0, 200)
    clamped = np.clip(parse_fis(text).predict(rows), *np.array(found, dtype=float).T)
    assert_allclose(clamped, model.predict(rows), atol=1e-11 * full_scale(model))
    endless = replace(model, out_of_bounds="linear", max_extrapolation=np.inf)
    with pytest.warns(UserWarning, match="goes beyond"):
        assert "Output1 is held within [-0.9 inf]: clamp it." in export_fis(endless)
