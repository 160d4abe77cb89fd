"""Text and HTML of rules are the model, and run nothing whatever the names contain."""

import re
from dataclasses import replace
from textwrap import dedent

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import OneHotEncoder, StandardScaler

from skanfis import ANFISRegressor
from skanfis.antecedent import TreeAntecedent
from skanfis.digits import percent
from skanfis.export import export_json, fold, read_json
from skanfis.inspection import explain, export_text, readability, rules_html
from skanfis.inspection.rules import parts_led
from skanfis.inspection.sentences import Sentences

from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES, rows_of
from ..outline import Outline
from ..quick import quick
from .encoded import encoded
from .reader import read_text

ALL = pytest.mark.parametrize("model", EVERY_PAIR.values(), ids=list(EVERY_PAIR))
A_GRID = MODELS["grid, order 1, 1 outputs"]


def with_common_slopes(model):
    """By the first input all rules have one slope, by the last one all but the first rule."""
    coefficients = model.coefficients.copy()
    coefficients[:, 1] = coefficients[0, 1]
    coefficients[1:, -1] = coefficients[1, -1]
    return replace(model, coefficients=coefficients)


def test_every_name_stands_in_one_line():
    model, keys = MODELS["grid, order 1, 2 outputs"], ("input_names", "output_names", "term_names")
    signs, shown = ("\n", "\x85", "\u2028", "\r\n", "\x1b"), (" ", " ", " ", " ", r"\x1b")
    named = [
        replace(
            model,
            **{
                key: tuple(f"a{k}{of[k % 5]}b" for k in range(len(getattr(model, key))))
                for key in keys
            },
        )
        for of in (signs, shown)
    ]
    assert export_text(named[0]) == export_text(named[1])
    assert rules_html(named[0]) == rules_html(named[1])
    found = readability(named[0], rows_of(model, 1.0))
    assert len(str(found).splitlines()) == 1 + max(len(found.findings), 1)
    terms = re.compile("    a")
    assert all(len(line) <= 96 or terms.match(line) for line in export_text(named[1]).splitlines())


def test_a_blank_level_is_told_in_quotes(rng):
    X = pd.DataFrame({"kind": rng.choice(["", "B", "C"], 90), "x": rng.uniform(size=90)})
    model = encoded(["kind"], quick(1)).fit(X, 2.0 * (X["kind"] == "") + X["x"])
    assert "if kind is ''" in export_text(model)


@pytest.mark.parametrize("value", [3.0, 1e-12, -0.015625, 2.5e12])
def test_a_constant_output_is_told_in_its_own_digits(rng, value):
    X = rng.uniform(-1, 1, size=(60, 2))
    found = read_text(export_text(quick(1).fit(X, np.full(60, value))), ["x0", "x1"])
    assert found.limits["y"] == (value, value)
    # Without the limits too, which hold any prediction at the value.
    assert_allclose(replace(found, limits={}).predict({"x0": 0.3, "x1": -0.2}), value, rtol=1e-4)


def test_a_constant_output_asks_for_no_digits_of_the_terms(rng):
    X = rng.uniform(-1, 1, size=(60, 2))
    y = np.sin(3 * X[:, 0]) + 0.1 * rng.standard_normal(60)
    constant = np.full(60, 3.0)
    alone, both = (quick([2, 1]).fit(X, one) for one in (y, np.column_stack([y, constant])))
    alone, both = (re.findall("center .*, width .*", export_text(one)) for one in (alone, both))
    assert both == alone


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_limits_hold_as_they_are_written(rng):
    X = rng.uniform(-1, 1, size=(60, 2))
    for shift in (0.0, 0.0017, 0.0044):
        model = ANFISRegressor(n_mfs=[2, 1]).fit(X, np.sin(3 * X[:, 0]) * X[:, 1] + shift)
        low, high = read_text(export_text(model), ["x0", "x1"]).limits["y"]
        held = model.model_.output_limits[:, 0]
        assert low <= held[0] < held[1] <= high
        assert [low, high] == pytest.approx(held, abs=0.01)


def test_a_target_that_rounding_alone_changes_does_not_vary(rng):
    X, y = rng.normal(size=(60, 2)), np.where(np.arange(60) % 2, 0.3, 0.1 + 0.2)
    assert "\ny varies by 0," in export_text(ANFISRegressor(max_rules=2).fit(X, y))


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
@pytest.mark.parametrize("options", [{"monotonic_cst": [1]}, {"loss": "huber"}])
def test_the_outputs_vary_about_the_rules_by_no_less_than_these_err(options, rng):
    X = rng.uniform(-3, 3, size=(300, 1))
    y = np.sin(X[:, 0]) + 0.1 * rng.standard_normal(300)
    y[::20] += 50.0 * ("loss" in options)
    model = ANFISRegressor(n_mfs=3, **options).fit(X, y)
    error = np.sqrt(np.mean((model.predict(X) - y) ** 2))
    assert error > 1.2 * model.model_.posterior.noise[0]
    told = re.search(r"y varies by (.*), about the rules by (.*) \(", export_text(model))
    assert [float(one) for one in told.groups()] == pytest.approx([np.std(y), error], rel=0.05)


def predicted(text, rows, names=NAMES):
    """By a person with the text in hand."""
    read = read_text(text, names)
    return np.array([read.predict(dict(zip(names, row, strict=True))) for row in rows])


@ALL
@pytest.mark.parametrize("precision", [1, 2, 4, 17])
def test_what_is_printed_is_measured_and_in_full_digits_it_is_the_model(model, precision):
    model = with_common_slopes(model) if model.order and model.n_rules > 1 else model
    rows = rows_of(model, 1.0)
    printed = Sentences.of(model, precision).printed if precision < 17 else model
    text = export_text(model, precision=precision)
    assert_allclose(predicted(text, rows), printed.predict(rows), atol=1e-9, rtol=1e-9)


@pytest.mark.theory
@pytest.mark.parametrize("partition", ["grid", "tree", "scattered"])
def test_the_text_of_a_fit_errs_as_the_last_line_says(partition):
    rng = np.random.default_rng(3)
    X = np.column_stack([rng.normal(size=(400, 2)), rng.integers(0, 2, 400)]) * [3.0, 700.0, 1.0]
    y = np.tanh(X[:, 0]) * (1 + X[:, 2]) + X[:, 1] / 700 + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor(partition=partition, max_rules=4).fit(X, 50.0 * y)
    text, names = export_text(model), ("x0", "x1", "x2")
    assert ("The truth of" in text) == (partition == "grid")  # of others it is told by signs
    said = predicted(text, X, names)[:, 0]
    errors = [np.mean((p - 50.0 * y) ** 2) for p in (said, model.predict(X))]
    ratio = model.readability_.summary["text_over_model"]
    assert ratio == pytest.approx(np.sqrt(errors[0] / errors[1]), rel=1e-3)
    assert ratio < 1.02
    more = round(100 * (ratio - 1))
    told = f"{more} % more than" if more else "as much as"
    cost = model.readability_.reading_cost
    assert f"\n{cost} numbers; the text as printed errs {told} the" in text


@pytest.mark.parametrize(("name", "said"), [("rate", "with rate"), ("on", "if on is [01]")])
def test_a_rule_without_a_slope_that_the_others_have_says_so(rng, name, said):
    X = np.column_stack([rng.normal(size=(400, 2)), rng.integers(0, 2, 400)])
    y = np.tanh(9.0 * X[:, 0]) + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor(partition="tree", max_rules=2).fit(X, y).model_
    names = ("speed", "rate", "on")
    # Three rules, of which two have a slope.
    tree = model.antecedent.split(0, 1, 0.3, 0.0)
    coefficients = np.zeros((3, 4, 1))
    coefficients[:2, 1 + names.index(name)] = 0.7
    support = model.support
    support = replace(support, center=support.center[[0, 0, 1]], share=np.ones(3))
    changes = {"antecedent": tree, "initial_antecedent": tree, "coefficients": coefficients}
    changes |= {"rule_weights": np.full(3, 1 / 3), "rule_rows": np.full(3, 100.0)}
    model = replace(model, **changes, support=support, posterior=None, term_names=())
    text = export_text(model, precision=17, feature_names=names)
    assert re.search(f"no change {said}", text.partition("Rule 2,")[2])
    assert text.count("no change") == 1
    assert_allclose(predicted(text, X, names), model.predict(X), atol=1e-9)


@pytest.mark.parametrize("gap", [0.0, 0.3, 3.0])
def test_a_width_is_left_out_where_every_row_is_on_one_side(rng, gap):
    x = rng.normal(size=400)
    X = np.column_stack([x + gap * np.sign(x), rng.normal(size=400)])
    y = np.where(x > 0.0, 3.0, X[:, 1]) + 0.3 * rng.standard_normal(400)
    model = ANFISRegressor(partition="tree", max_rules=2).fit(X, y)
    node = model.model_.antecedent.groups[0]
    assert list(node.inputs) == [0]
    surest = np.abs(X[:, 0] - node.theta[0]).min() / np.exp(node.theta[1])
    text = export_text(model)
    assert (surest > np.log(99.0)) == (gap == 3.0)
    assert ("±" not in text) == (gap == 3.0)
    assert "±" in export_text(model, precision=17)
    # Who reads the cut as crisp errs as the last line says.
    said = predicted(text, X, ("x0", "x1"))
    assert_allclose(said, Sentences.of(model.model_).printed.predict(X), atol=1e-9)
    errors = [np.mean((p - y) ** 2) for p in (said[:, 0], model.predict(X))]
    told = model.readability_.summary["text_over_model"]
    assert told == pytest.approx(np.sqrt(errors[0] / errors[1]), rel=1e-3)
    # Of a model that knows no rows the width is told.
    unknown = replace(model.model_, support=replace(model.model_.support, marginals=()))
    assert "±" in export_text(unknown)


def test_all_digits_leave_no_width_out(rng, tmp_path):
    X = rng.uniform(size=(400, 2)) + [100.0, 0.0] * (np.arange(400) < 100)[:, None]
    y = np.where(X[:, 0] > 50.0, 3.0, X[:, 1]) + 0.1 * rng.standard_normal(400)
    model = ANFISRegressor(partition="tree", max_rules=2).fit(X, y).model_
    # In the middle of the gap, so narrow that the cut is crisp on all rows to the last bit.
    narrow = TreeAntecedent.build([0], np.array([[50.0], [0.0]]), model.antecedent.paths)
    model = replace(model, antecedent=narrow, term_names=())
    assert "±" not in export_text(model)
    text, between = export_text(model, precision=17), np.full((11, 2), 0.5)
    between[:, 0] = np.linspace(45.0, 55.0, 11)
    assert_allclose(predicted(text, between, ("x0", "x1")), model.predict(between), atol=1e-9)
    export_json(model, tmp_path / "tree.json")
    assert "x0 > 50 ± 2.1972" in export_text(read_json(tmp_path / "tree.json"))


def test_a_rule_by_hand():
    # By the text alone, and for one row that anybody can follow.
    theta = [[6.8], [np.log(0.3 / np.log(9.0))]]
    tree = TreeAntecedent.build([0], theta, [[(0, True)], [(0, False)]])
    model = replace(
        MODELS["tree, order 1, 1 outputs"],
        antecedent=tree,
        initial_antecedent=tree,
        coefficients=np.array([[30.0, 5.8, 3.0, 0.0], [20.0, 0.0, 3.0, 0.0]])[:, :, None],
        reference=np.array([6.0, 1.0, 0.5]),
        spread=np.array([1.0, 2.0, 0.5]),
        minimum=np.array([4.0, -3.0, 0.0]),
        maximum=np.array([9.0, 5.0, 1.0]),
        rule_weights=np.array([0.25, 0.75]),
        rule_rows=np.array([25.0, 75.0]),
        support=None,
        term_names=(),
    )
    center = np.array([[7.5, 2.0, 1.0], [5.5, 0.5, 0.3]])
    support = MODELS["tree, order 1, 1 outputs"].support
    model = replace(model, support=replace(support, center=center, share=np.ones(2)))
    text = export_text(model, feature_names=["rooms", "age", "river"], show_terms=False)
    assert text == dedent("""\
        2 rules, 3 inputs, 100 rows.

        Common to the rules, y: +3 per age from 1.
        Every value has a part of this line; a rule's own slope replaces that of its input or level.

        Rule 1, strongest on 75 % of the rows:
          IF rooms < 6.8 ± 0.3
          THEN y is about 18.5, of it -1.5 from the common line

        Rule 0, strongest on 25 % of the rows:
          IF rooms > 6.8 ± 0.3
          THEN y is about 41.7, of it +3 from the common line: +5.8 per rooms from 7.5

        6 numbers.""")
    # At 7.1 rooms the cut is 0.9 true. At age 3 the common line is +6.
    row = np.array([[7.1, 3.0, 0.0]])
    by_hand = 0.9 * (41.7 - 3.0 + 6.0 + 5.8 * (7.1 - 7.5)) + 0.1 * (18.5 + 1.5 + 6.0)
    assert model.predict(row)[0, 0] == pytest.approx(by_hand, rel=1e-12)


def test_a_level_of_a_category_is_called_by_its_column(rng):
    X = pd.DataFrame({"rate": rng.normal(size=400), "fibre": rng.choice(["PM", "SM", "HB"], 400)})
    y = 2 * X["rate"] * (X["fibre"] == "PM") + (X["fibre"] == "SM") + 0.1 * rng.normal(size=400)
    model = ANFISRegressor(partition="tree", max_rules=2)
    pipe = encoded(["fibre"], model, sparse_output=True).fit(X, y)
    told = export_text(pipe).partition("Inputs")[0]
    assert "\n  IF fibre is PM\n" in told
    assert "\n  IF fibre is not PM\n" in told
    assert "\n  IF fibre is not PM\n" in export_text(fold(pipe))
    assert re.search(r"(\+1\S* if fibre is SM|-1\S* if fibre is HB)", told)
    assert "fibre_" not in told
    assert "fibre is not PM" in rules_html(pipe)
    # A scaler behind the encoder leaves rests of rounding, and no other words.
    scaled = make_pipeline(clone(pipe[0]), StandardScaler(), clone(model))
    assert export_text(scaled.fit(X, y)).partition("Inputs")[0] == told
    # A category is an input in one line.
    assert re.search(r"trained:\n  rate: \S+ to \S+\n  fibre: HB, PM, SM\nOut", export_text(pipe))
    # The encoder moves columns: measured on the whole, the text errs as the fit had found.
    measured = readability(pipe, X, y).line
    assert "the text as printed errs" in measured
    assert f"\n{measured}.\n" in export_text(pipe)


def test_a_rule_says_nothing_of_cases_that_none_of_its_rows_are(rng):
    group, on = rng.integers(0, 3, 300), rng.integers(0, 2, 300)
    X = np.column_stack([group[:, None] == [0, 1, 2], on]).astype(float)
    y = np.where(group == 1, 5.0 * on, 3.0 + group) + 0.5 * rng.normal(size=300)
    # Where alpha is given no slope is in common, and a weak one draws slopes together.
    model = ANFISRegressor(partition="tree", max_rules=2, alpha=0.01).fit(X, y).model_
    assert (model.coefficients[:, 1:4, 0] != 0.0).all()
    names = ["a", "b", "c", "on"]
    text, full = (export_text(model, precision=n, feature_names=names) for n in (2, 17))
    # Of columns of zeros and ones all is told by cases.
    assert re.search(r"IF \w+ is [01]\b", text)
    assert re.search(r" [+-]\S+ if on is [01]\b", text)
    assert " per " not in text
    read = {dict(asked)["b"]: said["y"][2] for _, asked, said in read_text(text, names).rules}
    assert list(read["1"]) == ["on"]
    assert "b" not in read["0"]
    assert {"a", "c"} < read["0"].keys()
    said = Sentences.of(model).printed.predict(X)
    assert_allclose(predicted(text, X, names), said, atol=1e-9)
    assert np.abs(said - model.predict(X)).max() < 0.1
    # To the last digit the model is told of rows as well that are two cases at once.
    both = np.array([[1.0, 1.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]])
    assert_allclose(predicted(full, both, names), model.predict(both), atol=1e-9)


@pytest.mark.parametrize("handle_unknown", ["error", "ignore"])
def test_a_value_is_that_of_a_level_and_others_are_told_from_it(handle_unknown, rng):
    X = pd.DataFrame({"sort": rng.choice(["a", "b", "c"], 300), "on": rng.choice(["y", "n"], 300)})
    X["rate"] = rng.normal(size=300)
    y = 5.0 * (X["sort"] == "b") - 3.0 * (X["sort"] == "c") + 2.0 * (X["on"] == "y") + X["rate"]
    # Where alpha is given, all levels have slopes.
    model = ANFISRegressor(partition="tree", max_rules=1, alpha=0.01)
    pipe = encoded(["sort", "on"], model, handle_unknown=handle_unknown)
    pipe.fit(X, y + 0.1 * rng.normal(size=300))
    (said,) = re.findall(r"THEN y is about ([\s\S]*?)\n\n", export_text(pipe))
    value, _, slopes = " ".join(said.split()).partition(": ")
    told = re.findall(r"([-+][\d.]+) if (sort|on) is (not )?([a-z])(?:, |$)", slopes)
    # One of three levels is what the value is of, and one of two.
    assert [column for _, column, _, _ in told] == ["sort", "sort", "on"]
    assert not any(is_not for *_, is_not, _ in told)
    slope, place = map(float, re.search(r"([-+][\d.]+) per rate from (\S+)", slopes).groups())
    by_hand = float(value) + slope * (X["rate"] - place)
    for change, column, _, level in told:
        by_hand += float(change) * (X[column] == level)
    assert np.abs(by_hand - pipe.predict(X)).max() < 0.1
    assert f"\n{2 + len(told)} numbers;" in export_text(pipe)


@pytest.mark.parametrize(
    ("slopes_of_rule", "common", "handle_unknown"),
    [
        ((4.0, 2.0), (0.0, 2.0), "error"),
        ((0.0, 5.0), (0.0, 2.0), "ignore"),
        ((4.0, 2.0), (-1.5, 0.5), "error"),
        ((4.0, 0.5), (-1.5, 0.5), "ignore"),
    ],
)
def test_of_two_levels_a_slope_of_a_rule_replaces_the_common_one(
    slopes_of_rule, common, handle_unknown, rng
):
    levels = rng.choice(["n", "y"], 300, p=[0.3, 0.7])
    X = pd.DataFrame({"rate": rng.normal(size=300), "on": levels})
    model = ANFISRegressor(partition="tree", max_rules=3, order=1)
    y = np.where(X["rate"] > 0.7, 9.0, np.where(X["rate"] < -0.7, -9.0, 0.0))
    pipe = encoded(["on"], model, handle_unknown=handle_unknown)
    pipe.fit(X, y + 0.1 * rng.normal(size=300))
    # By one indicator or by both, two rules have a common slope; the third has its own.
    coefficients = np.zeros((3, 4, 1))
    coefficients[:, 0, 0], coefficients[1:, 1:3, 0] = [1.0, 5.0, 9.0], common
    coefficients[0, 1:3, 0] = slopes_of_rule
    pipe[-1].model_ = replace(pipe[-1].model_, coefficients=coefficients)
    text = export_text(pipe)
    line = re.search(r"Common to the rules, y: (.*)\.", text)[1]
    assert line.count(" if on ") == 1
    told = re.findall(r"Rule (\d)[\s\S]*?THEN y is about (\S+)(?:, of it (\S+) .*)?(: .*)?\n", text)
    assert {r: slopes.count(" if on ") for r, *_, slopes in told if slopes} == {"0": 1}
    # What a rule says itself is said in place of the line.
    for level in "ny":
        row = pd.DataFrame({"rate": [0.0], "on": [level]})
        values = explain(pipe, row).set_index("rule")["value"]
        for r, value, part, slopes in told:
            said = re.search(r"([-+]\S+) if on is (not )?([ny])", slopes or line)
            holds = (level == said[3]) != bool(said[2])
            by_hand = float(value) - float(part or 0.0) + float(said[1]) * holds
            assert by_hand == pytest.approx(values[int(r)], abs=0.05)


def test_that_it_is_no_other_level_is_not_said(rng):
    X = pd.DataFrame({"sort": rng.choice(["a", "b", "c", "d"], 400), "rate": rng.normal(size=400)})
    y = 9.0 * (X["sort"] == "b") - 9.0 * (X["sort"] == "c")
    y = y + np.where(X["sort"] == "b", 3.0, 0.5) * X["rate"] + 0.1 * rng.normal(size=400)
    model = ANFISRegressor(partition="tree", max_rules=3, order=0, simplicity=0.0)
    pipe = make_pipeline(OneHotEncoder(sparse_output=False), model).fit(X[["sort"]], y)
    premises = sorted(re.findall(r"IF (.*)", export_text(pipe)))
    assert premises == ["sort is b", "sort is c", "sort is not b AND sort is not c"]
    assert "\n7 numbers;" in export_text(pipe)


def test_a_category_is_listed_by_its_levels(rng):
    X = pd.DataFrame({"sort": rng.choice(["a", "b", "c"], 300), "on": rng.choice(["y", "n"], 300)})
    X["rate"] = rng.normal(size=300)
    y = (X["sort"] == "b") + (X["on"] == "y") * X["rate"] + 0.1 * rng.normal(size=300)
    model = ANFISRegressor(n_mfs=[1, 2, 1, 1, 1])
    pipe = encoded(["sort", "on"], model, drop="if_binary").fit(X, y)
    lines = export_text(pipe).partition("trained:\n")[2].partition("\nOut")[0].splitlines()
    # An indicator with terms of its own stays by itself; the encoder knows a level without one.
    assert lines[0] == "  sort_b: 0 to 1"
    assert [line.partition(":")[0] for line in lines[1:3]] == ["    0", "    1"]
    assert lines[3].startswith("  rate: ")
    assert lines[4:] == ["  sort: a, c, other", "  on: y, n"]
    # Where it takes levels that it has not seen, they are others.
    unseen = {"handle_unknown": "ignore", "drop": "if_binary"}
    pipe = encoded(["sort", "on"], ANFISRegressor(n_mfs=1), **unseen)
    told = export_text(pipe.fit(X, y + (X["on"] == "y")))
    assert "\n  on: y, other\n" in told


@pytest.mark.parametrize("n_inputs", [4, 30])
def test_inputs_that_no_rule_names_are_one_line(rng, n_inputs):
    X = rng.normal(size=(80, n_inputs))
    fibre = pd.DataFrame({"fibre": rng.choice(["a", "b"], 80)})
    table = pd.concat([fibre, pd.DataFrame(X).add_prefix("x")], axis=1)
    counts = [1, 1, 2, *[1] * (n_inputs - 1)]
    model = ANFISRegressor(n_mfs=counts, consequent_features=[2, 3], agreement=0.1)
    pipe = encoded(["fibre"], model, sparse_output=True)
    pipe.fit(table, np.tanh(2.0 * X[:, 0]) + X[:, 1])
    told = "fibre, x2, x3" if n_inputs == 4 else "29 more inputs"
    text, names = export_text(pipe, precision=17), [f"x{j}" for j in range(n_inputs)]
    listed = text.partition("trained:\n")[2].partition("\nOut")[0].splitlines()
    inputs = [line.partition(": ")[0] for line in listed if line[2] != " "]
    assert inputs == ["  x0", "  x1", f"  {told}"]
    assert listed[-1] == f"  {told}: in no rule"
    assert_allclose(predicted(text, X, names)[:, 0], pipe.predict(table), atol=1e-9)
    # Where nothing is predicted outside, every range counts.
    pipe.set_params(anfisregressor__out_of_bounds="nan")
    assert "in no rule" not in export_text(pipe)


@ALL
def test_every_rule_is_told_once_the_strongest_on_most_rows_first(model):
    labels, led = [one[0] for one in read_text(export_text(model), NAMES).rules], parts_led(model)
    assert sorted(labels) == list(range(model.n_rules))
    assert labels == sorted(labels, key=lambda r: (-led[r], -model.rule_weights[r], r))


def test_rules_that_matter_and_a_line_for_the_rest():
    weights = A_GRID.rule_weights
    text = export_text(A_GRID, max_shown=3)
    strongest = np.argsort(-weights)[:3]
    assert [label for label, _, _ in read_text(text, NAMES).rules] == list(strongest)
    left = percent(1.0 - parts_led(A_GRID)[strongest].sum())
    assert f"\nLeft out: 9 rules, strongest on {left} of the rows.\n" in text
    assert "Left out" not in export_text(A_GRID)


def test_without_a_range_nothing_is_said_of_what_is_outside(rng):
    X, y = pd.DataFrame({"sort": rng.choice(["a", "b"], 60)}), rng.normal(size=60)
    pipe = make_pipeline(OneHotEncoder(sparse_output=False), ANFISRegressor(max_rules=1))
    for target in (y, y + 9.0 * (X["sort"] == "b")):
        assert "Outside" not in export_text(pipe.fit(X, target))


def test_slopes_that_move_no_digit_are_said_to_be_too_small():
    line = ANFISRegressor(n_mfs=1).fit(rows_of(A_GRID, 1.0), rows_of(A_GRID, 1.0)[:, 0]).model_
    coefficients = np.array([0.0, 1.0, 1e-9, 0.0]).reshape(1, 4, 1)
    text = export_text(replace(line, coefficients=coefficients), feature_names=NAMES)
    assert "\n  chip temperature: slopes too small to be written\n  rate: in no rule\n" in text


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"precision": 0}, ValueError, "precision=0 must be a whole number from 1 to 17"),
        ({"max_shown": 0}, ValueError, "max_shown=0 must be a whole number of 1 or more"),
        (
            {"feature_names": ["a"]},
            ValueError,
            "feature_names=.* one name for each of .*, all diff",
        ),
        ({"feature_names": "abc"}, TypeError, "feature_names must be a sequence of str"),
        ({"feature_names": 3}, TypeError, "feature_names must be a sequence of str, got 3"),
        ({"feature_names": list("aba")}, ValueError, "one name for each of .*, all different"),
        ({"output_names": list("ab")}, ValueError, "output_names=.* one name for each of 'y'"),
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
    assert "\nLeft out: 10 rules.\n" in text
    assert "errs" not in text


@pytest.mark.parametrize("order", [0, 1])
def test_what_the_text_errs_is_told_in_the_units_of_the_fit_alone(order, rng):
    """Behind a scaler numbers are rounded elsewhere; the other findings stay."""
    X = rng.uniform(0.0, 1e3, (100, 2))
    y = np.sin(X[:, 0] / 300.0) + 0.1 * rng.standard_normal(100)
    plain = ANFISRegressor(n_mfs=2, order=order).fit(X, y)
    scaled = make_pipeline(StandardScaler(), ANFISRegressor(n_mfs=2, order=order)).fit(X, y)
    *_, how, told = export_text(plain).split("\n\n")
    assert "What a rule errs by" in " ".join(how.split())
    assert ("plus its own slopes" in " ".join(how.split())) == bool(order)
    assert "; the text as printed errs " in told.splitlines()[0]
    *_, untold = export_text(scaled).split("\n\n")
    assert re.fullmatch(r"\d+ numbers\.", untold.splitlines()[0])
    assert untold.splitlines()[1:] == told.splitlines()[1:]


@pytest.mark.parametrize(("far", "origin"), [(30.0, 0.0), (60.0, 0.0), (100.0, 0.0), (-60.0, 1e3)])
def test_terms_are_written_with_the_digits_that_a_far_row_needs(far, origin, rng):
    x = origin + np.append(rng.normal(size=300), far)[:, None]
    y = np.abs(x[:, 0] - origin) + 0.01 * rng.normal(size=301)
    model = ANFISRegressor(n_mfs=2).fit(x, y).model_
    both = model, Sentences.of(model).printed
    ratios = [np.diff(one.antecedent.log_memberships(x[-1:].T), axis=0) for one in both]
    # With two digits of every number, they are 2, 126 and 17 apart.
    assert_allclose(*ratios, rtol=0.0, atol=0.1)


def test_more_digits_bring_the_text_of_a_tree_as_near_to_the_model(rng):
    X = rng.uniform(0.0, 24.0, (300, 1))
    y = np.sin(0.5 * X[:, 0])
    model = ANFISRegressor(partition="tree", max_rules=6).fit(X, y).model_
    counts = []
    for precision in (2, 4, 8):
        printed = Sentences.of(model, precision).printed
        counts.append((printed.antecedent.rule_terms >= 0).sum())
        assert_allclose(printed.predict(X), model.predict(X), atol=10.0**-precision)
    # A condition that others imply to two digits is written when more are asked for.
    assert counts[0] < counts[-1] == (model.antecedent.rule_terms >= 0).sum()


@pytest.mark.parametrize(("unit", "start"), [(1e-15, 0.0), (100.0, 1.7e9)])
def test_terms_are_written_without_rests_of_rounding_and_places_to_the_last_digit(unit, start, rng):
    z = rng.uniform(size=(80, 1))
    X, y = start + unit * z, np.tanh(9.0 * (z[:, 0] - 0.5)) + 0.1 * rng.standard_normal(80)
    model = ANFISRegressor(n_mfs=3).fit(X, y)
    numbers = re.findall(r"(?:center|width) (\S+?)(?:,|\n)", export_text(model))
    assert len(numbers) == 6
    assert max(len(text.partition("e")[0]) for text in numbers) <= len("1700000000.12")
    few, every = (read_text(export_text(model, precision=n), ["x0"]).terms for n in (2, 17))
    for term in model.memberships_:
        key, width = (term["input"], term["name"]), term["width"]
        # Places to digits of the width: of a time stamp as many as it takes.
        assert few[key][1]["center"] == pytest.approx(term["center"], abs=0.05 * width)
        assert every[key][1]["center"] == term["center"]
        assert every[key][1]["width"] == pytest.approx(width, rel=1e-13)


def test_of_rows_on_which_a_rule_is_not_the_strongest_no_error_is_told():
    X = np.linspace(0.0, 1.0, 80)[:, None]
    y = np.tanh(9.0 * (X[:, 0] - 0.5)) + 0.1 * np.cos(99.0 * X[:, 0])
    model = ANFISRegressor(n_mfs=2).partial_fit(X, y).partial_fit(X[:20], y[:20])
    text = export_text(model)
    assert re.findall(r"% of the rows(, errs by 0|:)", text) == [", errs by 0", ":"]
    assert text.endswith("\nErrors are of the rows of the latest partial_fit alone.")
    assert ">nan<" not in rules_html(model)


@ALL
def test_there_is_a_line_per_rule(model):
    page = Outline(rules_html(model, max_shown=100))
    assert page.names.count("tr") == 2 + model.n_rules
    terms = model.antecedent.rule_terms
    for t in np.unique(terms[terms >= 0]):
        assert Sentences.of(model).model.term_names[t] in page.text
    assert f"{model.n_rules} rule" in page.text
    left = f"Left out: {model.n_rules - 1} rule"
    assert (left in Outline(rules_html(model, max_shown=1)).text) == (model.n_rules > 1)


def test_below_the_table_stand_sentences_of_the_text():
    model = with_common_slopes(MODELS["grid, order 1, 2 outputs"])
    text, page = export_text(model, max_shown=3), Outline(rules_html(model, max_shown=3))
    told = [one for one in text.split("\n\n") if one.startswith(("Common", "Left out"))]
    # "This line" is that of the output named just before.
    assert ["this line" in one for one in told] == [True, True, False]
    assert " ".join(" ".join(told).split()) in page.text


def test_names_of_many_letters_keep_to_the_lines():
    names = ["two\nlines", " ".join(["a name out of a spreadsheet"] * 5), "c"]
    lines = export_text(A_GRID, feature_names=names).splitlines()
    assert max(len(line) for line in lines if not line.startswith("    ")) <= 96
    assert any("two lines: " in line for line in lines)


def test_names_are_text_whatever_they_contain():
    bad = '</td><script>alert("1")</script>&amp;'
    model = replace(
        A_GRID,
        input_names=(bad, "a<b", "c & 'd'"),
        output_names=("<img src=x onerror=alert(1)>",),
        term_names=tuple(f"<b>{name}" for name in A_GRID.term_names),
    )
    page = Outline(rules_html(model))
    assert not set(page.names) & {"script", "img", "link", "a"}
    assert page.names.count("b") == 1
    assert any(bad in text for text in page.texts)
    for _, attributes in page.tags:
        assert not any(name.startswith("on") for name in attributes)
        assert not {"src", "href"} & set(attributes)
