"""Names of terms."""

from types import SimpleNamespace

import numpy as np
import pytest

from skanfis.antecedent import TreeAntecedent
from skanfis.antecedent.tree import CRISP
from skanfis.membership import Bell, Gaussian
from skanfis.naming import default_term_names, given_term_names

from . import oracles

BOX = np.array([[-10.0] * 3, [10.0] * 3])
INPUTS = ["time", "temperature", "rate"]


def grid(*counts):
    return oracles.random_grid(np.random.default_rng(0), [Gaussian] * len(counts), counts)


def model(antecedent, box=BOX, two_valued=(False, False, False)):
    """What names are made of, and given ones held against."""
    box = {"minimum": box[0], "maximum": box[1], "two_valued": two_valued}
    return SimpleNamespace(antecedent=antecedent, input_names=INPUTS, **box)


@pytest.mark.parametrize(
    ("counts", "names"),
    [
        ([2, 3], ("low", "high", "low", "medium", "high")),
        ([6], ("NL", "NM", "NS", "PS", "PM", "PL")),
        ([9], tuple(f"level {k}" for k in range(1, 10))),
        ([], ()),
    ],
)
def test_terms_of_a_grid_are_named_by_their_order(counts, names):
    assert default_term_names(model(grid(*counts))) == names


def test_two_terms_of_an_input_that_is_0_or_1_are_called_so():
    both = model(grid(2, 3, 2), two_valued=[True, True, False])
    assert default_term_names(both) == ("0", "1", "low", "medium", "high", "low", "high")


@pytest.mark.parametrize(
    ("places", "names"),
    [
        # Their digits: test_digits.py.
        ([21.34, -0.0123456, 0.0], ["21.3", "-0.0123", "0"]),
        ([1e9 + 1, 1e9 + 2], ["1000000001", "1000000002"]),
        # Those that differ by rounding have one name, and a number.
        ([1.0, 1.0 + 1e-15, -1e-16], ["1", "1 (2)", "0"]),
    ],
)
def test_other_terms_are_named_by_where_they_stand(places, names):
    rules = oracles.scattered_of_one_width(Bell, np.transpose([places]), 1.0)
    found = default_term_names(model(rules))
    assert found == tuple(f"near {name}" for name in names)


@pytest.mark.parametrize(
    ("places", "width", "names"),
    [
        ([2213.4, -3.0], 96.4, ["2213 ± 96", "-3 ± 96"]),
        ([2213.4, -3.0], 4.66, ["2213.4 ± 4.7", "-3 ± 4.7"]),
        ([2213.4, 1e-9], 1246.0, ["2200 ± 1200", "0 ± 1200"]),
        ([1700016712.3, 4e14], 13512.0, ["1700017000 ± 14000", "400000000000000 ± 14000"]),
        # As many digits as tell them apart; those that differ by rounding have one name.
        ([259.4, 259.1], 204.0, ["259.4 ± 204", "259.1 ± 204"]),
        ([1.0, 1.0 + 1e-15, 2.0], 1.0, ["1 ± 1", "1 ± 1", "2 ± 1"]),
    ],
)
def test_gaussian_terms_of_a_rule_say_how_far_they_reach(places, width, names):
    rules = oracles.scattered_of_one_width(Gaussian, np.transpose([places]), width)
    assert default_term_names(model(rules)) == tuple(f"near {name}" for name in names)


def test_given_names_replace_the_default():
    mine = {"temperature": ["cold", "mild", "hot"]}
    assert given_term_names(model(grid(2, 3)), mine) == ("low", "high", "cold", "mild", "hot")
    assert given_term_names(model(grid(2, 2)), ["S", "L"]) == ("S", "L", "S", "L")


@pytest.mark.parametrize(
    ("names", "error", "message"),
    [
        ({"speed": ["a", "b"]}, ValueError, r"'speed', which is no input; .*'time'"),
        (["a", "b", "c"], ValueError, r"names for input 'time': 3 given for 2 terms"),
        ({"time": ["a", "a"]}, ValueError, r"'time' repeats a name"),
        ({"time": "ab"}, TypeError, r"'time' must be a sequence of non-empty str"),
        ({"time": 2}, TypeError, r"'time' must be a sequence of non-empty str, got 2"),
        ({"time": ["a", ""]}, TypeError, r"'time' must be a sequence of non-empty str"),
    ],
)
def test_names_that_do_not_fit_are_refused(names, error, message):
    with pytest.raises(error, match=message):
        given_term_names(model(grid(2, 3)), names)


def tree(*cuts):
    """A chain of cuts (input, cut, half the length over which it turns)."""
    found = TreeAntecedent.build([], np.empty((2, 0)), [[]])
    for j, cut, half in cuts:
        found = found.split(found.n_rules - 1, j, cut, np.log(half / np.log(9.0)))
    return found


@pytest.mark.parametrize(
    ("cut", "half", "name"),
    [
        (6.8, 0.3, "6.8 ± 0.3"),
        (6.8123, 0.3149, "6.81 ± 0.31"),
        (-0.0125, 0.129, "-0.01 ± 0.13"),
        (0.0, 0.129, "0 ± 0.13"),
        (1000660.0, 131.8, "1000660 ± 130"),
        (2.5e-7, 1e-8, "2.5e-07 ± 1e-08"),
    ],
)
def test_a_side_has_the_digits_that_matter_over_its_width(cut, half, name):
    box = np.array([[-2e6], [3e6]])
    assert default_term_names(model(tree((0, cut, half)), box)) == (f"> {name}", f"< {name}")


def test_a_cut_near_the_end_of_the_range_has_rows_on_both_sides():
    box = np.array([[60_011.0], [1.3e9]])
    cut = tree((0, 4.7e6, 1.3e8))
    assert default_term_names(model(cut, box)) == ("> 5000000 ± 130000000", "< 5000000 ± 130000000")
    # What stands beyond the rows stays there.
    assert default_term_names(model(tree((0, 3.0, 1.3e8)), box))[0] == "> 0 ± 130000000"


def test_cuts_that_differ_are_told_apart_and_equal_ones_are_not():
    names = default_term_names(model(tree((0, 1.001, 0.3), (1, 2.0, 0.3), (0, 1.002, 0.3))))
    assert names[:3] == ("> 1.001 ± 0.3", "> 2 ± 0.3", "> 1.002 ± 0.3")
    names = default_term_names(model(tree((0, 1.0, 0.3), (1, 2.0, 0.3), (0, 1.0, 0.3))))
    assert names[3:] == ("< 1 ± 0.3", "< 2 ± 0.3", "< 1 ± 0.3")
    # Terms that differ by rounding are equal.
    names = default_term_names(model(tree((0, 1 / 3, 1 / 7), (0, 1 / 3 + 1e-13, 1 / 7))))
    assert names == ("> 0.33 ± 0.14", "> 0.33 ± 0.14", "< 0.33 ± 0.14", "< 0.33 ± 0.14")


def test_a_cut_between_two_values_has_no_width():
    box = np.array([[0.0, 2.0, 0.0], [1.0, 5.0, 1.0]])
    crisp = 0.5 / CRISP * np.log(9.0)
    found = tree((0, 0.5, crisp), (1, 3.5, 3.0 * crisp), (2, 0.4, 0.1))
    assert default_term_names(model(found, box))[:3] == ("1", "> 3.5", "> 0.4 ± 0.1")
    assert default_term_names(model(found, box))[3:] == ("0", "< 3.5", "< 0.4 ± 0.1")
    # One that blurs both values has a width, in their middle too.
    assert default_term_names(model(tree((0, 0.5, 0.1)), box))[0] == "> 0.5 ± 0.1"
    # In its middle, whatever rounding has left of that.
    box = np.array([[-1.0], [1.0]])
    assert default_term_names(model(tree((0, -3e-17, 2.0 * crisp)), box)) == ("> 0", "< 0")
