"""Exported C, compiled and run, answers what ``predict`` answers."""

import re
import shutil
from dataclasses import astuple, replace
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import RobustScaler

from skanfis.antecedent import RuleTableAntecedent, TreeAntecedent
from skanfis.bounds import bounds
from skanfis.export import export_c
from skanfis.export.c.dialect import STATUS, Dialect
from skanfis.export.c.source import Source
from skanfis.learning import VariableProjection
from skanfis.membership import MEMBERSHIPS, Gaussian
from skanfis.options import LinearExtrapolation

from ..oracles import random_grid
from ..quick import quick
from .c_compiler import SANITIZE, STRICT, UNTOUCHED, evaluate_all, gcc, needs_compiler, run, told
from .every_model import CASES, FEWEST, full_scale, rows, surface
from .rule_bases import MODELS, SCALE, build

MIN_COVERAGE = 0.3
TOLERANCE = {"double": 1e-12, "float": 1e-5}
NUMPY = {"double": np.float64, "float": np.float32}
X, Y = surface()


def expected_status(model, X):
    """From the definitions in the header; and where rounding decides."""
    outside = ~model.in_bounds(X)
    coverage = model.coverage(X)
    status = outside * STATUS["OUT_OF_RANGE"]
    if model.out_of_bounds in ("nan", "raise"):
        status = status | outside * STATUS["NO_OUTPUT"]
    answered = (status & STATUS["NO_OUTPUT"]) == 0
    status = status | (answered & (coverage < MIN_COVERAGE)) * STATUS["UNCOVERED"]
    return status, np.abs(coverage - MIN_COVERAGE) < 1e-4


def expected_outputs(model, X, status, std):
    is_left = model.out_of_bounds == "raise" or (model.out_of_bounds, std) == ("nan", "c89")
    y = model.with_out_of_bounds("clip" if is_left else model.out_of_bounds).predict(X)
    if is_left:
        y[status & STATUS["NO_OUTPUT"] > 0] = UNTOUCHED
    return y


@needs_compiler
@pytest.mark.parametrize(
    ("dtype", "std", "part", "flags"),
    [
        pytest.param("double", "c99", slice(None), [], id="double"),
        pytest.param("float", "c99", slice(None), [], id="float", marks=pytest.mark.theory),
        # C89 differs by its exp and log alone: a part of the models is met by the sanitizers.
        pytest.param("double", "c89", slice(1, None, 5), SANITIZE, marks=pytest.mark.theory),
    ],
)
def test_every_model_answers_as_predict(dtype, std, part, flags, tmp_path):
    X = rows(NUMPY[dtype])
    # Of a row that is not finite there is no answer: each of three numbers in each column.
    bad = X[:9].copy()
    bad[np.arange(9), np.arange(9) % 3] = np.repeat([np.nan, np.inf, -np.inf], 3)
    # Each family four times in a row, each time on another partition.
    turned = sorted(range(len(FEWEST)), key=lambda i: (i // 4, (i + i // 4) % 4))
    cases = [FEWEST[i] for i in turned[part]]
    codes = [
        export_c(case.model, name=f"m{i}", dtype=dtype, std=std, min_coverage=MIN_COVERAGE)
        for i, case in enumerate(cases)
    ]
    n_outputs = [case.model.n_outputs for case in cases]
    answers = evaluate_all(codes, np.vstack([X, bad]), tmp_path, std, n_outputs, flags)
    Z = X.astype(float)
    for case, (y, status) in zip(cases, answers, strict=True):
        none = np.nan if (case.model.out_of_bounds, std) == ("nan", "c99") else UNTOUCHED
        assert np.array_equal(y[len(X) :], np.full((9, y.shape[1]), none), equal_nan=True)
        assert (status[len(X) :] == STATUS["NOT_FINITE"] + STATUS["NO_OUTPUT"]).all(), case.label
        y, status = y[: len(X)], status[: len(X)]
        expected, unsure = expected_status(case.model, Z)
        assert (status == expected)[~unsure].all(), case.label
        wanted = expected_outputs(case.model, Z, expected, std)
        answered = (expected & STATUS["NO_OUTPUT"]) == 0
        assert np.array_equal(y[~answered], wanted[~answered], equal_nan=True), case.label
        difference = np.abs(y[answered] - wanted[answered]) / full_scale(wanted[answered])
        assert difference.max() < TOLERANCE[dtype], case.label


# What lies around the list: pipelines, policies, edges, numbers of unusual size.


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize(("dtype", "std"), [("double", "c89"), ("float", "c99")])
def test_outputs_are_held_between_limits(dtype, std, tmp_path):
    X, y = surface(n_outputs=2)
    rules = quick(n_mfs=[3, 2, 2], max_iter=5, solver=VariableProjection(tol=1.0))
    estimator = make_pipeline(RobustScaler(), rules).fit(X, y)
    Z = (X.mean(axis=0) + 1.6 * (X - X.mean(axis=0))).astype(NUMPY[dtype])
    expected = estimator.predict(Z.astype(float))
    limits = np.quantile(expected, [0.2, 0.7], axis=0).T
    proven = bounds(estimator, np.stack([Z.min(axis=0), Z.max(axis=0)], axis=1))
    codes = [
        export_c(estimator, name=name, dtype=dtype, std=std, min_coverage=None, saturate=saturate)
        for name, saturate in (("free", None), ("held", limits), ("sound", proven))
    ]
    # Every answer comes after the self-test.
    free, found, sound = (y for y, _ in evaluate_all(codes, Z, tmp_path, std, [2, 2, 2]))
    assert (limits[:, 0] <= found).all()
    assert (found <= limits[:, 1]).all()
    held = np.clip(expected, *limits.T)
    assert (np.abs(found - held) <= 1e-5 * np.abs(expected).max(axis=0)).all()
    assert np.mean(found != free) > 0.4
    # These hold a fault too, which without them is seen.
    assert ["!(y[o] >=" in code.source for code in codes] == [False, True, True]
    # They stand in the place of those by which outputs are held without them.
    assert codes[1].cost.table_bytes == codes[0].cost.table_bytes
    # Proven limits change nothing in the box, but for their own rounding.
    np.testing.assert_allclose(sound, free, rtol=2.0 * np.finfo(Z.dtype).eps)


@pytest.mark.theory
@needs_compiler
def test_tangents_of_far_inputs_are_found_at_their_medians(tmp_path):
    # A float has steps of 8 at 1e8, where the inputs have a deviation of 600.
    offset = np.array([1e8 + 3.0, 20.0, 0.0])
    at = np.array([1e8 + 100.0, np.nan, 0.0])
    antecedent = random_grid(np.random.default_rng(0), [Gaussian] * 3, (3, 2, 2))
    low, high = np.float32([offset - 2.0 * SCALE, offset + 1.5 * SCALE]).astype(float)
    changes = {"minimum": low, "maximum": high, "tangent_at": at, "out_of_bounds": "linear"}
    model = build(antecedent, offset=offset, **changes)
    Z = (offset + SCALE * np.random.default_rng(1).uniform(-3.0, 3.0, (500, 3))).astype(np.float32)
    code = export_c(model, name="m", dtype="float")
    ((found, _),) = evaluate_all([code], Z, tmp_path, "c99", [1], flags=[])
    wanted = model.predict(Z.astype(float))
    assert np.abs(found - wanted).max() < 1e-5 * full_scale(wanted)


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize("dtype", TOLERANCE)
def test_digits_stay_at_a_foot_and_far_from_a_steep_cut(dtype, tmp_path):
    plain = {"offset": np.zeros(3), "scale": np.ones(3), "out_of_bounds": "linear"}
    # At the edge, 1.5, the second of two triangles alone is active, and all but zero.
    theta = np.array([[-1.0, 0.5], [0.0, 0.0], [0.0, np.log(1.0 + 1e-4)]])
    triangles = random_grid(np.random.default_rng(0), [MEMBERSHIPS["triangular"]], [2], [0])
    # The exponential of 2,000 widths is no number.
    steep = TreeAntecedent.build([], np.empty((2, 0)), [[]]).split(0, 0, 0.6, np.log(1e-3))
    models = [build(one, **plain) for one in (triangles.with_parameters(theta.ravel()), steep)]
    Z = np.random.default_rng(1).uniform(-1.5, 1.5, (300, 3)).astype(NUMPY[dtype])
    Z[:100, 0] += 3.0
    Z[100:200, 0] -= 0.5
    codes = [export_c(model, name=f"m{i}", dtype=dtype) for i, model in enumerate(models)]
    answers = evaluate_all(codes, Z, tmp_path, "c99", [1, 1], flags=[])
    for model, (found, _) in zip(models, answers, strict=True):
        wanted = model.predict(Z.astype(float))
        # Of a cut, rows are near by its width in one of a hundred: a float's last bit counts there.
        far = np.abs(Z[:, 0] - 0.6) > 0.02
        assert np.abs(found - wanted)[far].max() < TOLERANCE[dtype] * full_scale(wanted)


def test_the_short_form_leaves_the_files_out():
    code = export_c(quick(n_mfs=2, solver="lse").fit(X, Y), name="m")
    assert repr(code) == f"CCode(name='m', cost={code.cost!r})"


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize("dtype", TOLERANCE)
def test_tangent_without_end_saturates_at_the_largest_number(dtype, tmp_path):
    largest = np.finfo(NUMPY[dtype]).max
    signs = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    Z = np.vstack([signs * size for size in (1e30, 1e-3 * largest, largest)]).astype(NUMPY[dtype])
    endless = {"out_of_bounds": LinearExtrapolation(np.inf), "solver": "lse"}
    plane = quick(n_mfs=1, **endless).fit(X, Y)
    models = [plane, *(quick(n_mfs=3, mf=mf, **endless).fit(X, Y) for mf in MEMBERSHIPS)]
    codes = [export_c(m, name=f"m{k}", dtype=dtype) for k, m in enumerate(models)]
    answers = evaluate_all(codes, Z, tmp_path, "c99", [1] * len(codes), flags=[])
    beyond = (Z != 0.0).any(axis=1)
    for found, status in answers:
        assert np.isfinite(found).all()
        assert (status[beyond] == STATUS["OUT_OF_RANGE"] + STATUS["UNCOVERED"]).all()
    # Of a plane, what it is in exact arithmetic.
    value, *slopes = map(Fraction, plane.model_.consequents[0, :, 0])
    for row, (found,) in zip(Z, answers[0][0], strict=True):
        parts = [slope * Fraction(float(x)) for slope, x in zip(slopes, row, strict=True)]
        exact = min(max(value + sum(parts), -Fraction(float(largest))), Fraction(float(largest)))
        assert abs(Fraction(float(found)) - exact) <= 1e-5 * float(max(map(abs, [value, *parts])))


@pytest.mark.parametrize(
    ("scale_x", "scale_y", "what"),
    [
        (1e45, 1.0, "the minimum of 'x0'"),
        (1.0, 1e42, "a typical value of 'y'"),
        # All slopes are zero in single precision, where the constants are not.
        (1e9, 1e-30, "a consequent"),
        ([5.5e35, 1.0, 1.0], 1.0, "the inverse spread of 'x0'"),
    ],
)
def test_numbers_that_float_does_not_hold(scale_x, scale_y, what):
    model = quick(n_mfs=2).fit(X * scale_x, Y * scale_y)
    with pytest.raises(ValueError, match=rf"Single precision cannot hold .*{what}"):
        export_c(model, name="m", dtype="float")
    export_c(model, name="m", dtype="double")


def test_a_column_that_float_makes_one_number_is_refused():
    """A time stamp of today, in seconds: float has steps of 128 s there."""
    stamped = X + np.array([0.0, 1.7e9, 0.0])
    model = quick(n_mfs=2).fit(stamped, Y)
    with pytest.raises(ValueError, match="all values of 'x1' in the training data as one"):
        export_c(model, name="m", dtype="float")
    export_c(model, name="m", dtype="double")


# What is promised of the files.


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize(("kind", "dtype"), [("grid", "float"), ("rule table", "double")])
def test_no_state_no_heap_and_tables_of_the_size_reported(kind, dtype, tmp_path):
    case = next(c for c in CASES if c.partition == kind and c.model.out_of_bounds == "linear")
    code = export_c(case.model, tmp_path / "m", dtype=dtype)
    gcc(["-std=c99", "-Os", "-c", "m.c", "-o", "m.o"], tmp_path)
    by_kind = {}
    for line in run(["nm", "-S", "m.o"], tmp_path).stdout.splitlines():
        *size, letter, name = line.split()
        by_kind.setdefault(letter, {})[name] = int(size[1], 16) if len(size) > 1 else 0
    # Undefined: the functions of the library. No "d", "b", "c": nothing that could be written to.
    suffix = "f" if dtype == "float" else ""
    assert set(by_kind["U"]) <= {f"{name}{suffix}" for name in ("exp", "log", "sqrt")}
    assert set(by_kind) <= {"U", "T", "t", "r"}
    assert list(by_kind["T"]) == ["m_predict"]
    tables = {name: size for name, size in by_kind["r"].items() if name.startswith("m_")}
    declared = re.findall(r"^static const [\w ]+ (m_(?!test)\w+)\[", code.source, re.MULTILINE)
    # Tables of one number may become part of the code.
    assert set(tables) <= set(declared)
    assert code.cost.table_bytes == sum(tables.values()) or len(tables) < len(declared)
    assert sum(tables.values()) <= code.cost.table_bytes < sum(tables.values()) + 64


@pytest.mark.theory
@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
def test_files_are_cpp_too(tmp_path):
    cases = CASES[::17]
    for i, case in enumerate(cases):
        export_c(case.model, tmp_path / f"m{i}", dtype=("float", "double")[i % 2])
    included = "".join(f'#include "m{i}.c"\n' for i in range(len(cases)))
    (tmp_path / "all.cpp").write_text(included, encoding="ascii")
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    gcc([*flags, "-c", "all.cpp", "-o", "all.o"], tmp_path, compiler="g++")
    assert (tmp_path / "all.o").stat().st_size > 0


def cost_of(model, policy, min_coverage=None, **changes):
    """Exponentials, logarithms, square roots, multiplications and divisions."""
    model = replace(model, out_of_bounds=policy, **changes)
    return np.array(astuple(export_c(model, name="m", min_coverage=min_coverage).cost)[:5])


def test_tree_takes_an_exponential_per_node_and_two_out_of_range():
    model = MODELS["tree, order 1, 1 outputs"]
    # The place on the sigmoid, its other side, two products; per rule its value and three slopes.
    inside = np.array([5, 0, 0, 5 * 4 + 6 * 4, 5])
    for policy in ("clip", "nan", "raise"):
        np.testing.assert_array_equal(cost_of(model, policy), inside)
    # The way ahead, the place, three products; per rule twice the value; three inputs, one output.
    tangent, scale = np.array([5, 0, 0, 5 * 5 + 2 * 6 * 4, 5]), np.array([0, 0, 0, 3 + 1, 3])
    np.testing.assert_array_equal(cost_of(model, "linear"), inside + tangent + scale)
    # Two inputs are held: three places, of which every one takes the strengths, but not the values.
    moved = tangent + np.array([5, 0, 0, 5 * 4, 5])
    at = np.array([np.nan, 20.0, 0.0])
    out = cost_of(model, "linear", tangent_at=at)
    np.testing.assert_array_equal(out, inside + 3 * moved + scale)
    # z, the sum, and what comes to leaves and nodes.
    code = export_c(replace(model, out_of_bounds="nan"), name="m", min_coverage=None)
    assert code.cost.stack_bytes == 8 * (3 + 1 + 6 + 5)


def test_grid_takes_an_exponential_per_term(rng):
    X = rng.uniform(-1.0, 1.0, (800, 2))
    model = quick(n_mfs=6, solver="lse").fit(X, np.sin(3.0 * X[:, 0]) * X[:, 1]).model_
    # 2 per term and 1 to normalise it; per rule two shares, two slopes, a value; a sum per input.
    inside = np.array([12, 0, 0, 12 * 3 + 36 * (2 + 3), 2])
    np.testing.assert_array_equal(cost_of(model, "nan"), inside)
    # Slopes: place, width, minus two, the way ahead, the mean; values twice; the scale as above.
    outside = [0, 0, 0, 12 * 5 + 2 * 36 * 3 + 2 + 1, 2]
    np.testing.assert_array_equal(cost_of(model, "linear"), inside + outside)
    # Per rule three entries of a factor, two squares, and five more.
    known = 1 + np.count_nonzero(model.support.share)
    coverage = [known, 0, known, known * (3 + 2 + 5), 0]
    np.testing.assert_array_equal(cost_of(model, "nan", 0.1), inside + coverage)
    # It falls with the distance: per input two products, and two with the exponential.
    fades = [1, 0, 0, 2 * 2 + 2, 0]
    np.testing.assert_array_equal(cost_of(model, "clip", 0.1), inside + coverage + fades)
    whole = inside + outside + coverage + fades
    np.testing.assert_array_equal(cost_of(model, "linear", 0.1), whole)
    header = export_c(replace(model, out_of_bounds="linear"), name="m", min_coverage=0.1).header
    said = "{} exponentials, {} logarithms, {} square roots, {} multiply-adds, {} divisions."
    assert f"Largest cost of an evaluation: {said.format(*whole)}" in told(header)


def test_scattered_rules_take_an_exponential_per_rule_and_what_their_terms_do():
    model = MODELS["scattered on two inputs, order 0, 2 outputs"]
    # Three rules of five bells: a logarithm of |u| and one of 1 + exp; u, twice log |u|, the
    # exponent. The shares; two values.
    inside = np.array([3 + 5, 2 * 5, 0, 5 * 3 + 3 + 3 * 2, 1])
    np.testing.assert_array_equal(cost_of(model, "nan"), inside)
    # Of a slope the sigmoid takes one exponential and a division, by u another; u, twice log |u|,
    # the exponent, three more and the way ahead; then the mean, and values twice.
    outside = [5, 5, 0, 5 * 7 + 3 + 2 * 3 * 2 + 3 + 2, 2 * 5 + 3]
    np.testing.assert_array_equal(cost_of(model, "linear"), inside + outside)


def test_units_and_notes_stand_in_the_header():
    notes = ["A star * multiplies; */ and /* and \\ end nothing.", "ms? Ask; ??/ and ??? do not."]
    units = {"x1": "degC?", "y": "deg/s */"}
    header = export_c(quick(n_mfs=1).fit(X, Y), name="m", units=units, notes=notes).header
    comment = header.partition("#ifndef")[0]
    assert comment.count("*/") == 1
    assert "A star * multiplies; <U+002A>/ and /<U+002A> and <U+005C> end nothing." in comment
    # Two question marks may begin a trigraph, one may not.
    assert "ms? Ask; <U+003F>?/ and <U+003F><U+003F>? do not." in comment
    assert "[1] x1 [degC?]: " in comment
    assert "[0] y [deg/s <U+002A>/]: " in comment
    assert "\n * Two words.\n" in export_c(quick().fit(X, Y), name="m", notes="Two words.").header


@pytest.mark.theory
@needs_compiler
def test_self_test_passes_and_notices_a_changed_digit(tmp_path):
    code = export_c(quick(n_mfs=2).fit(X, Y), tmp_path / "m")
    flags = ["-std=c89", *STRICT, *SANITIZE, "-DM_SELF_TEST", "-DM_SELF_TEST_MAIN"]
    gcc([*flags, "m.c", "-o", "test", "-lm"], tmp_path)
    assert run(["./test"], tmp_path).returncode == 0
    first = re.compile(r"-?\d\.\d{6}").search(code.source, code.source.index("m_consequents"))
    digit = str((int(first[0][-1]) + 5) % 10)
    spoilt = code.source[: first.end() - 1] + digit + code.source[first.end() :]
    (tmp_path / "m.c").write_text(spoilt, encoding="ascii")
    gcc([*flags, "m.c", "-o", "test", "-lm"], tmp_path)
    assert run(["./test"], tmp_path).returncode == 1


@needs_compiler
def test_self_test_passes_where_a_range_is_as_narrow_as_rounding(tmp_path):
    """As of a constant column behind a scaler: ``predict`` takes rows beyond it for in range."""
    model = build(random_grid(np.random.default_rng(0), [Gaussian] * 3, (2, 1, 1)))
    low, high = model.minimum.copy(), model.maximum.copy()
    low[1], high[1] = 4.0 - 4.0 * np.spacing(4.0), 4.0 + 4.0 * np.spacing(4.0)
    code = export_c(replace(model, minimum=low, maximum=high), name="m")
    rows = np.array([[low[0], 4.0, low[2]], [low[0], np.nextafter(high[1], 5.0), low[2]]])
    ((_, status),) = evaluate_all([code], rows, tmp_path, "c99", [1])
    assert (status & STATUS["OUT_OF_RANGE"]).tolist() == [0, STATUS["OUT_OF_RANGE"]]


def test_positions_of_many_rules_need_more_than_an_int_of_16_bits():
    for n_rules, kind in ((32767, "int"), (32768, "long")):
        model = build(RuleTableAntecedent((), np.empty((n_rules, 0), dtype=int)), order=0)
        source = Source(model, Dialect("m", "double", "c99"), min_coverage=None)
        assert f"    {kind} i, r, o;\n" in source.body()


HOSTILE = [
    *("*/ int x; /*", "??/", "???/", 'quote " and \\', "line\nbreak\r\n#error", "//\\"),
    *("x" * 5000, "\x00\x1b[31m °C 陀螺"),
]


def test_identifiers_differ_in_what_an_old_compiler_looks_at():
    name, found = "compensation_new", set()
    for case in FEWEST:
        code = export_c(case.model, name=name)
        found |= set(re.findall(rf"\b{name}_\w+", code.source, re.IGNORECASE))
    assert len({one[:31] for one in found}) == len(found)


@needs_compiler
@pytest.mark.parametrize("std", ["c89", "c99"])
def test_names_of_columns_cannot_leave_their_comment(std, tmp_path, rng):
    X = pd.DataFrame(rng.uniform(size=(60, len(HOSTILE))), columns=HOSTILE)
    estimator = quick(n_mfs=[2] + [1] * (len(HOSTILE) - 1)).fit(X, X.sum(axis=1))
    code = export_c(estimator, tmp_path / "m", std=std)
    assert (code.header + code.source).isascii()
    assert max(map(len, (code.header + code.source).splitlines())) < 200
    flags = [f"-std={std}", "-trigraphs", *STRICT, "-c"]
    gcc([*flags, "m.c", "-o", "m.o"], tmp_path)
    assert (tmp_path / "m.h").read_text(encoding="ascii").count("*/") == code.header.count("/*")
    assert "int x; /" in code.header  # harmless, and so still readable


def test_name_comes_from_path_and_files_are_those_returned(tmp_path):
    code = export_c(quick(n_mfs=2).fit(X, Y), str(tmp_path / "gyro"))
    assert code.name == "gyro"
    assert (tmp_path / "gyro.h").read_text(encoding="ascii") == code.header
    assert (tmp_path / "gyro.c").read_text(encoding="ascii") == code.source
    other = export_c(quick(n_mfs=2).fit(X, Y), tmp_path / "a.b-c", name="gyro")
    assert '#include "a.b-c.h"' in other.source
    assert (tmp_path / "a.b-c.c").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "name=None takes the name from path"),
        ({"name": "2x"}, "name='2x' must be a letter, then letters"),
        ({"name": "a__b"}, "single underscores"),
        ({"name": "x" * 17}, "at most 16 in all"),
        ({"path": "no/folder/gyro.c"}, "only. It is from path: leave out a suffix"),
        ({"path": "no/folder/my model"}, "path ends in 'my model'"),
        ({"name": "m", "dtype": "float32"}, "dtype='float32' must be one of 'double', 'float'"),
        ({"name": "m", "min_coverage": 0.0}, r"min_coverage=0\.0 must be a number above 0"),
        ({"name": "m", "units": {"x7": "degC"}}, "units has x7, but the columns are time, "),
        ({"name": "m", "saturate": [(0.0, 1.0)] * 2}, "for each of the 1 outputs"),
        ({"name": "m", "saturate": [("low", "high")]}, r"saturate=\[\('low', 'high'\)\] must have"),
        ({"name": "m", "saturate": [(1.0, 0.0)]}, "must have finite .* with low below high"),
        (
            {"name": "m", "saturate": [(1.0 + 1e-9, 1.0 + 2e-9)], "dtype": "float"},
            "with a number of float32 between them",
        ),
    ],
)
def test_bad_argument(arguments, message):
    with pytest.raises(ValueError, match=message):
        export_c(CASES[0].model, **arguments)
