"""Reading .fis files: what they mean, and what is refused, with the line."""

import time

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.export import read_fis
from skanfis.export.fis.reader import parse_fis

from .fis_files import BY_HAND, with_line


def system(n_terms, rules, n_outputs=1):
    """A file with Gaussian terms at 1, 2, ... on every input and the rule's number as output."""
    n_inputs, n_rules = len(n_terms), len(rules)
    lines = BY_HAND.splitlines()[1:13]
    lines[4:7] = [f"NumInputs={n_inputs}", f"NumOutputs={n_outputs}", f"NumRules={n_rules}"]
    for j, n in enumerate(n_terms):
        lines += [f"[Input{j + 1}]", f"Name='x{j}'", "Range=[0 4]", f"NumMFs={n}"]
        lines += [f"MF{k}='t{k}':'gaussmf',[1 {k}]" for k in range(1, n + 1)]
    for k in range(n_outputs):
        lines += [f"[Output{k + 1}]", f"Name='y{k}'", "Range=[0 9]", f"NumMFs={n_rules}"]
        lines += [f"MF{r + 1}='r':'constant',[{r + 1}]" for r in range(n_rules)]
    lines += ["[Rules]"]
    for r, rule in enumerate(rules):
        lines.append(f"{' '.join(map(str, rule))}, {' '.join([str(r + 1)] * n_outputs)} (1) : 1")
    return "\n".join(lines)


def test_means_what_was_written_by_hand():
    model = parse_fis(BY_HAND)
    rows = np.array([[2.0, 0.5], [9.0, -0.25], [12.0, 0.0]])
    for (x, z), (u, v) in zip(rows, model.predict(rows), strict=True):
        x = min(x, 10.0)
        low, high = max(1 - x / 8, 0), np.exp(-((x - 10) ** 2) / 12.5)
        zero = 1 / (1 + abs(z / 0.5) ** 4)
        strengths = [low * zero, zero, high]
        sloped = x - 2 * z + 0.5
        # The triangle has a floor of 1e-10 beyond its foot.
        assert_allclose(u, np.average([sloped, 3, sloped], weights=strengths), rtol=1e-8)
        assert_allclose(v, np.average([1, 2, 4], weights=strengths), rtol=1e-8)
    assert model.input_names == ("x y", "z")
    assert model.output_names == ("u", "v")
    assert model.term_names == ("low", "high", "about zero")
    assert_array_equal(model.minimum, [0, -1])
    assert_array_equal(model.maximum, [10, 1])
    assert model.out_of_bounds == "clip"


@pytest.mark.parametrize(
    ("n_terms", "rules", "kind"),
    [
        ([2, 2], [(1, 1), (1, 2), (2, 1), (2, 2)], GridAntecedent),
        ([2, 2], [(2, 1), (1, 1), (1, 2), (2, 2)], GridAntecedent),  # in another order
        ([2, 0, 2], [(1, 0, 1), (1, 0, 2), (2, 0, 1), (2, 0, 2)], GridAntecedent),
        ([2, 2], [(1, 1), (2, 2)], RuleTableAntecedent),
        ([2, 2], [(1, 1), (1, 2), (2, 1)], RuleTableAntecedent),
        ([2, 2], [(0, 1), (0, 2), (1, 1), (2, 2)], RuleTableAntecedent),  # some leave one out
        ([1, 2], [(1, 1), (1, 2)], RuleTableAntecedent),
    ],
)
def test_rule_base_is_of_the_kind_that_suits_and_means_the_same(n_terms, rules, kind, rng):
    model = parse_fis(system(n_terms, rules, n_outputs=2))
    assert type(model.antecedent) is kind
    rows = rng.uniform(0.0, 4.0, (20, len(n_terms)))
    for row, outputs in zip(rows, model.predict(rows), strict=True):
        # Term k stands at k and has deviation 1.
        distance = np.where(rules, row - rules, 0.0)
        mu = np.exp(-0.5 * np.sum(distance**2, axis=1))
        assert_allclose(outputs, np.average(np.arange(len(rules)) + 1.0, weights=mu))


REFUSED = [
    # the system
    ("Type=", "Type='mamdani'", "'mamdani': only Sugeno systems are supported"),
    ("DefuzzMethod=", "DefuzzMethod='wtsum'", "only the weighted average"),
    ("AndMethod=", "AndMethod='min'", "only the product"),
    ("NumInputs=", "NumInputs=two", "a whole number, found 'two'"),
    ("NumInputs=", "NumInputs=0", "0 is below 1"),
    ("NumInputs=", "NumInputs=\N{ARABIC-INDIC DIGIT TWO}", "a whole number"),
    ("Version=", "Verzion=2.0", r"\[System\] has the unknown key 'Verzion'"),
    ("Version=", "Type='sugeno'", "'Type' for the second time"),
    # sections
    ("[Input1]", "[Input01]", r"expected \[System\], .* found '\[Input01\]'"),
    ("[Input2]", "[Input1]", r"\[Input1\] stands here for the second time"),
    ("% A comment", "stray", r"expected \[System\]"),
    # variables
    ("Range=[0 10]", "Range=[10 0]", "low < high"),
    ("Range=[0 10]", "Range=[0 inf]", "a number of size up to 1e.50, found 'inf'"),
    ("Range=[0 10]", f"Range=[0 {'1' * 200}]", "a number of size up to"),
    # membership functions
    ("MF1='flat'", "MF1='flat':'quadratic',[3]", "'quadratic' with 1 parameters is not supported"),
    ("MF1='flat'", "MF1='flat':'constant',[3 4]", "'constant' with 2 .* linear with 3 are"),
    # rules
    ("1 1, 2 1", "1 1 1, 2 1 (1) : 1", "3 numbers for 2 inputs"),
    ("1 1, 2 1", "1 1, 2 1 (0.5) : 1", "weight '0.5'; only weight 1"),
    ("1 1, 2 1", "1 1, 2 1 (1) : 2", r"by OR \(2\)"),
    ("1 1, 2 1", "-1 1, 2 1 (1) : 1", "'-1' for input 'x y', .* NOT .a negative number"),
    ("1 1, 2 1", "1.2 1, 2 1 (1) : 1", "hedges"),
    ("1 1, 2 1", "3 1, 2 1 (1) : 1", "'3' for input 'x y', which has 2"),
    ("1 1, 2 1", "1 1, 0 1 (1) : 1", "'0' for output 'u'"),
]


# In another line: what is missing has none, and is told by the head of its section.
REFUSED_ELSEWHERE = [
    ("[System]", "[Rules]", r"line \d+: \[Rules\] stands here for the second time"),
    ("Type=", "", r"line 2: \[System\] has no Type"),
    ("NumInputs=", "NumInputs=3", r"line 2: \[System\] counts \[Input3\]"),
    ("2 0, 2 3", "", r"line \d+: \[System\] counts 3 rules, \[Rules\] has 2"),
    ("NumMFs=1", "NumMFs=2", r"line \d+: \[Input2\] has no MF2"),
]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [(*two, f"line {with_line(*two)[1]}: .*{says}") for *two, says in REFUSED] + REFUSED_ELSEWHERE,
)
def test_refuses(old, new, message):
    with pytest.raises(ValueError, match=message):
        parse_fis(with_line(old, new)[0])


def test_refuses_a_file_of_nothing_but_comments():
    with pytest.raises(ValueError, match=r"line 1: the file has no \[System\]"):
        parse_fis("% nothing\n\n")


def test_reads_utf_8_with_and_without_mark_and_no_other_encoding(tmp_path):
    path = tmp_path / "named.fis"
    text = BY_HAND.replace("'z'", "'température'")
    for encoding in ("utf-8", "utf-8-sig"):
        path.write_text(text, encoding=encoding)
        assert read_fis(str(path)).input_names == ("x y", "température")
    for encoding in ("latin-1", "utf-16"):
        path.write_text(text, encoding=encoding)
        with pytest.raises(ValueError, match=r"named\.fis: line .* that UTF-8 does not print"):
            read_fis(path)


def test_refuses_many_rules_over_wide_consequents_before_memory_is_asked_for():
    # A short file: 20,000 rules share one linear consequent of 1,000 inputs.
    n_inputs, n_rules = 1000, 20_000
    head = system([0] * n_inputs, [(0,) * n_inputs])
    text = head.replace("NumRules=1\n", f"NumRules={n_rules}\n")
    text += "\n0 , 1 (1) : 1" * (n_rules - 1)
    with pytest.raises(ValueError, match="are 20,020,000 numbers; at most 20,000,000 are read"):
        parse_fis(text)


@pytest.mark.theory
@pytest.mark.parametrize(
    "line",
    [
        "MF1='" + "a" * 1_000_000,
        "MF1='a':'gaussmf',[" + "1 " * 500_000,
        "Range=[" + "1" * 1_000_000 + " 2]",
        "[" * 1_000_000,
    ],
    ids=lambda line: line[:20],
)
def test_long_lines_take_no_long_time(line):
    start = time.process_time()
    with pytest.raises(ValueError, match=r"line \d+: "):
        parse_fis(with_line("MF1='low'", line)[0])
    assert time.process_time() - start < 1.0
