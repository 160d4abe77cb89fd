"""JSON of a model: exact, readable, and strict on the way in."""

import json
import time
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.export import export_json, read_fis, read_json
from skanfis.export.json_reader import parse_json

from .fis_files import BY_HAND
from .rule_bases import EVERY_PAIR, MODELS, build, narrow_target, rows_of

A_GRID = replace(MODELS["grid, order 1, 2 outputs"], target=narrow_target(2))


def assert_same(read, model):
    """All that a model consists of, to the last bit, but what no file has."""
    if isinstance(model, tuple):
        for one, other in zip(read, model, strict=True):
            assert_same(one, other)
    elif is_dataclass(model) and not isinstance(model, type):
        assert type(read) is type(model)
        for field in fields(model):
            # What effects are found by.
            if field.name != "marginals":
                assert_same(getattr(read, field.name), getattr(model, field.name))
    else:
        assert_array_equal(read, model)


A_TREE = MODELS["tree, order 1, 2 outputs"]
# Without one rule it has two terms of the first input, where others have other inputs. It has names
# of its own, and an input that is held beyond the range.
A_REST = build(A_TREE.antecedent.without_rules([1])[0], tangent_at=np.array([np.nan, 20.0, 0.0]))
A_REST = replace(A_REST, term_names=tuple(f"term {t}" for t in range(A_REST.antecedent.n_terms)))


@pytest.mark.parametrize("model", [*EVERY_PAIR.values(), A_REST], ids=[*EVERY_PAIR, "a rest"])
def test_comes_back_to_the_last_bit(model):
    read = parse_json(export_json(model))
    assert_same(read, model)
    rows = rows_of(model, 1.3)
    assert_array_equal(read.predict(rows), model.predict(rows))
    assert_array_equal(read.coverage(rows), model.coverage(rows))


def test_a_posterior_may_leave_directions_out():
    X, y = make_jang_sinc()
    model = ANFISRegressor(n_mfs=3).fit(X, y).model_
    whole, nothing = model.posterior, np.zeros((0, 0, 0))
    assert len(whole.premises) == 12

    def with_rows(rows):
        parts = {"premises": whole.premises[rows], "cross": whole.cross[:, rows]}
        return replace(model, posterior=replace(whole, **parts, pinned=nothing))

    fewer = with_rows(np.arange(2, 12))
    assert_same(parse_json(export_json(fewer, posterior=True)), fewer)
    with pytest.raises(ValueError, match="premises has 24 rows; 12 fit"):
        export_json(with_rows(np.tile(np.arange(12), 2)), posterior=True)


def test_a_person_can_read_it():
    text = export_json(A_GRID)
    assert '\n    {"name": "low", "input": 0, "function": "gaussian", "center": ' in text
    # One line per input, output, term, rule and its support; ten keys, the ends of five lists, two
    # braces.
    assert text.count("\n") == 3 + 2 + 7 + 12 + 12 + 10 + 5 + 2


def _set(*path):
    """A change that sets what stands at a path to its last entry."""
    *keys, last, value = path

    def change(document):
        for key in keys:
            document = document[key]
        document[last] = value

    return change


REFUSED = [
    (_set("version", 3), "of version 3, this skanfis reads versions 1 to 2: upgrade"),
    (_set("version", "2"), "\"version\" is '2', not a whole number"),
    (_set("format", "pickle"), "not a model of skanfis"),
    (_set("more", 1), "the file has the unknown key 'more'"),
    (lambda d: d.pop("rules"), "the file has no 'rules'"),
    (_set("rules", 3), "rules: 3 is not a list of 1 or more"),
    (_set("inputs", 0, 3), r"inputs\[0\] is 3, not an object"),
    (_set("out_of_bounds", "wrap"), "out_of_bounds is 'wrap'"),
    (_set("outputs", 0, "name", 1), r"outputs\[0\]\.name: 1 is not a name"),
    (
        lambda d: d["outputs"][0].update(dict.fromkeys(d["outputs"][0], None) | {"name": "y"}),
        "outputs: minimum, maximum and spread are null of some, but not of all",
    ),
    (_set("outputs", 0, "upper", "1"), r"outputs\[0\]\.upper: '1' is not a number of size up to"),
    (_set("outputs", 0, "upper", -0.9), r"outputs\[0\]: lower is not below upper"),
    (_set("outputs", 0, "lower", 1.6), r"outputs\[0\]: nothing from minimum to maximum is within"),
    (lambda d: d["outputs"].pop(), r"rules\[0\]\.consequents: .* is not a list of 1"),
    (_set("outputs", 0, "name", "\ud800"), r"outputs\[0\]\.name: '\\ud800' is not a name"),
    (_set("inputs", 1, "name", "time"), r"inputs\[1\] has the name of another input"),
    (_set("inputs", 0, "minimum", 1e9), r"inputs\[0\]: minimum is above maximum"),
    (_set("inputs", 0, "reference", np.nan), r"inputs\[0\]\.reference: nan is not a number"),
    (_set("inputs", 0, "tangent_at", 1e9), r"inputs\[0\]: tangent_at is not from minimum to"),
    (lambda d: d["support"].pop(), "support has 11 entries; the model has 12 rules"),
    (_set("support", 2, "share", 1.5), r"support\[2\]\.share: 1\.5 is not a number from 0 to 1"),
    (_set("support", 0, "center", [0.0]), r"support\[0\]\.center: \[0\.0\] is not a list of 3"),
    (_set("support", 0, "center", 0.0), r"support\[0\]\.center: 0\.0 is not a list of 3"),
    (_set("terms", 0, "input", 3), r"is not a whole number from 0 to 2"),
    (_set("terms", 0, "function", "sinc"), r'terms\[0\] has no "function" among gaussian, '),
    (_set("terms", 0, "function", ["gaussian"]), r'terms\[0\] has no "function" among gaussian, '),
    (_set("terms", 0, "log_width", 200.0), "not a number of size up to 115"),
    (_set("terms", 0, "before_training", {}), r"terms\[0\]\.before_training has no"),
    (_set("rule_base", "forest"), "rule_base is 'forest'"),
    (_set("rule_base", "tree"), 'those of a "tree" are sigmoid_rising first'),
    (_set("rules", 0, "terms", [0, 2, 6]), 'the rules are not those of "rule_base": "grid"'),
    (_set("rules", 0, "terms", [0, 2]), "other numbers of terms"),
    (_set("rules", 0, "terms", [0, 2, 99]), "99 is not a whole number from -1 to 6"),
    (_set("rules", 0, "weight", 0.9), r"rules\[\]\.weight: the sum over all rules is 1\.\d+"),
    (
        _set("rules", 0, "consequents", 1, 2, 1e51),
        r"rules\[0\]\.consequents\[1\]\[2\]: 1e\+51 is not a number of size up to 1e\+50",
    ),
    (_set("rules", 0, "consequents", 0, 3.0), r"consequents\[0\]: 3\.0 is not a list of 4"),
    (_set("rules", 0, "consequents", 0, [1.0, 2.0]), r"\[0\]: \[1\.0, 2\.0\] is not a list of 4"),
    (_set("rules", 1, "consequents", [[1.0], [1.0]]), "other numbers of terms or coefficients"),
]


def _without(place):
    """Remove a node's two sides from all lists; what was after it moves up."""

    def change(document):
        n = len(document["terms"]) // 2
        for t in (n + place, place):
            document["terms"].pop(t)
        for rule in document["rules"]:
            kept = [t for t in rule["terms"] if t % n != place or t < 0]
            rule["terms"] = [t - (t % n > place) - (t >= n) if t >= 0 else t for t in kept]
        longest = max(len(rule["terms"]) for rule in document["rules"])
        for rule in document["rules"]:
            rule["terms"] += [-1] * (longest - len(rule["terms"]))

    return change


def _idle(document):
    """Add a node that no path goes by."""
    terms = document["terms"]
    terms[:] = [*terms[:5], terms[4], *terms[5:], terms[-1]]
    for rule in document["rules"]:
        rule["terms"] = [t + (t >= 5) for t in rule["terms"]]


NO_TREE = [
    (_set("terms", 5, "center", 1.0), r"terms\[0\]: the side below has another input, cut or"),
    (_set("terms", 6, "input", 1), r"terms\[1\]: the side below has another input, cut or"),
    (_set("terms", 7, "log_width", 1.0), r"terms\[2\]: the side below has another input, cut"),
    (
        lambda d: (d["terms"].pop(), _set("rules", 1, "terms", [0, 2, -1])(d)),
        "terms: 5 sides above a cut, and 4 below",
    ),
    (_without(4), "the paths are no tree: each cut stands at one place"),
    (_without(0), "the paths are no tree"),
    (_set("rules", 0, "terms", [2, 0, 4]), "the paths are no tree"),
    (_set("rules", 5, "terms", [5, 6, 9]), "the paths are no tree"),
    (_set("rules", 5, "terms", [9, 1, 5]), "the paths are no tree"),
    (_idle, "the paths are no tree"),
    # A rule is gone, and its weight another's: a cut has one side.
    (
        lambda d: d["rules"][0].update(weight=d["rules"][0]["weight"] + d["rules"].pop()["weight"]),
        "the paths are no tree",
    ),
]
A_TABLE = MODELS["rule table, order 1, 1 outputs"]


@pytest.mark.parametrize(
    ("model", "change", "message"),
    [
        *((A_GRID, *case) for case in REFUSED),
        *((A_TREE, *case) for case in NO_TREE),
        (A_TABLE, _set("rules", 0, "terms", [0, 0, -1]), r"terms: \[0, 0\] has a term twice"),
    ],
)
def test_refuses(model, change, message):
    document = json.loads(export_json(model))
    change(document)
    with pytest.raises(ValueError, match=message):
        parse_json(json.dumps(document))


def test_a_grid_of_more_rules_than_there_are_is_refused_before_memory_is_asked_for():
    document = json.loads(export_json(A_GRID))
    # Three inputs of a thousand terms each, or more.
    document["terms"] = [one for one in document["terms"] for _ in range(1000)]
    with pytest.raises(ValueError, match='the rules are not those of "rule_base": "grid"'):
        parse_json(json.dumps(document))


def test_refuses_more_numbers_than_are_read(monkeypatch):
    text = export_json(A_GRID)
    monkeypatch.setattr("skanfis.export.limits.MOST_NUMBERS", 12 * (7 + 4 * 2) - 1)
    with pytest.raises(ValueError, match="2 outputs are 180 numbers; at most 179 are read"):
        parse_json(text)


POSTERIOR_REFUSED = [
    ("inputs", [0, 0], r"posterior\.inputs: \[0, 0\] has an input twice, or more than 2"),
    ("noise", [1e-60], r"posterior\.noise\[0\] is neither 0 nor 1e-50 or more"),
    # Twelve consequents and the eight parameters of four terms.
    ("pinned", [[[0.0] * 20] * 21], r"posterior\.pinned has 21 rows; 20 fit"),
]


@pytest.mark.parametrize(("key", "value", "message"), POSTERIOR_REFUSED)
def test_refuses_a_posterior_that_does_not_fit(key, value, message):
    estimator = ANFISRegressor(n_mfs=2, max_iter=2).fit(*make_jang_sinc())
    document = json.loads(export_json(estimator, posterior=True))
    document["posterior"][key] = value
    with pytest.raises(ValueError, match=message):
        parse_json(json.dumps(document))


def test_files_of_the_first_version_are_read():
    # Written by the last skanfis that wrote them, which predicted this.
    path = Path(__file__).with_name("version_1.json")
    model = read_json(path)
    bare = json.loads(path.read_text(encoding="utf-8")) | {"posterior": None}
    assert_same(parse_json(json.dumps(bare)), replace(model, posterior=None))
    value, deviation = model.predict_with_deviation(np.array([[0.3], [4.0], [11.0]]))
    assert_allclose(value[:, 0], [3.77747601, 0.4999443, 1.04645844], rtol=1e-8)
    assert_allclose(deviation[:, 0], [0.09150537, 0.08393119, 0.09278191], rtol=1e-6)
    assert '"version": 2' in export_json(model)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "Expecting value"),
        ("{", "line 1 column 2"),
        ('{"format": NaN}', "not a model of skanfis"),
        ('{"format": 1, "format": 2}', "'format' stands twice"),
        (export_json(A_GRID) + "}", "Extra data"),
        (export_json(A_GRID).replace("0.015", "1e999"), "inf is not a number of size up to"),
    ],
)
def test_refuses_text_that_is_no_such_json(text, message):
    with pytest.raises(ValueError, match=message):
        parse_json(text)


@pytest.mark.parametrize("given", [BY_HAND, export_json(A_GRID), b"{}", Path('{"a": 1}')])
def test_text_in_place_of_a_path_is_named(given):
    for read in (read_json, read_fis):
        with pytest.raises(ValueError, match="path is the text of a model, not the path of a file"):
            read(given)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    """Editors of Windows write one."""
    text = export_json(A_GRID)
    (tmp_path / "model.json").write_text(text, encoding="utf-8-sig")
    assert export_json(read_json(tmp_path / "model.json")) == text


def test_refuses_deep_nesting_other_encodings_and_large_files(tmp_path):
    path = tmp_path / "model.json"
    path.write_text("[" * 1_000_000, encoding="utf-8")
    with pytest.raises(ValueError, match=r"model\.json: nested too deeply"):
        read_json(path)
    path.write_text(export_json(A_GRID), encoding="utf-16")
    with pytest.raises(ValueError, match=r"model\.json: no JSON: 'utf-8' codec"):
        read_json(path)
    with open(path, "wb") as file:
        file.truncate(2**40)
    start = time.perf_counter()
    with pytest.raises(ValueError, match="larger than 16,777,216 bytes"):
        read_json(path)
    assert time.perf_counter() - start < 1.0


def test_what_would_be_larger_than_is_read_is_not_written(tmp_path, monkeypatch):
    size = len(export_json(A_GRID).encode())
    monkeypatch.setattr("skanfis.export.model_json.MOST_BYTES", size - 1)
    with pytest.raises(ValueError, match=rf"read_json would refuse: {size:,} bytes, of at most"):
        export_json(A_GRID, tmp_path / "large.json")
    assert not any(tmp_path.iterdir())


def test_what_could_not_be_read_is_not_written():
    wide = replace(A_GRID, spread=np.array([1e-60, 1.0, 1.0]))
    with pytest.raises(ValueError, match=r"cannot write .*: inputs\[0\]\.spread: 1e-60"):
        export_json(wide)
