"""The picture of what a search compared, on candidates whose place in it is known beforehand."""

import copy

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import ANFISRegressor
from skanfis.inspection import StructureDisplay

from ..quick import quick

pytest.importorskip("matplotlib.pyplot")


@pytest.fixture(scope="module")
def line():
    x = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
    return quick(1).fit(x, x[:, 0])


def candidate(kind, rules, cost, error, chosen=False, beat=True):
    known = {"kind": kind, "rules": rules, "reading_cost": cost}
    return known | {"expected_error": error, "rules_beat_mean": beat, "chosen": chosen}


# Best first, as they come.
CLEAR = [
    candidate("grid", 8, 40, 0.20),
    candidate("grid", 4, 20, 0.205, chosen=True),
    candidate("grid", 6, 12, 0.21, beat=False),
    candidate("scattered", 6, 30, 0.22),
    candidate("scattered", 2, 10, 0.25),
    candidate("grid", 2, 9, 0.30),
    candidate("one rule", 1, 3, 0.60),
]
WEAK = [candidate("grid", 2, 9, 0.98), candidate("one rule", 1, 3, 0.981, chosen=True)]


def shown(line, structures, simplicity=0.05):
    """The picture of an estimator that has compared these, drawn: what is wrong in it raises."""
    planted = copy.copy(line)
    planted.structures_, planted.simplicity = structures, simplicity
    display = StructureDisplay.from_estimator(planted)
    display.figure_.canvas.draw()
    return display


def drawn_lines(display):
    return {line.get_label(): line for line in display.ax_.get_lines()}


def test_every_candidate_is_where_its_cost_and_error_put_it(line):
    lines = drawn_lines(shown(line, CLEAR))
    # The line of a kind goes from the cheapest to the dearest.
    grids = [[9, 0.30], [12, 0.21], [20, 0.205], [40, 0.20]]
    assert_array_equal(lines["grid"].get_xydata(), grids)
    assert_array_equal(lines["scattered"].get_xydata(), [[10, 0.25], [30, 0.22]])
    assert_array_equal(lines["one rule"].get_xydata(), [[3, 0.60]])
    assert_array_equal(lines["chosen: 4 rules"].get_xydata(), [[20, 0.205]])
    poor = lines["rules worse than the mean, one by one"]
    assert_array_equal(poor.get_xydata(), [[12, 0.21]])
    assert len({lines[kind].get_marker() for kind in ("one rule", "grid", "scattered")}) == 3


@pytest.mark.parametrize(
    ("structures", "simplicity", "squared"),
    [
        (CLEAR, 0.05, (1.05 * 0.20) ** 2),
        (CLEAR, 0.1, (1.1 * 0.20) ** 2),
        # Where little is explained, a tenth of that: (1.05^2 - 1) (1 - 0.98^2).
        (WEAK, 0.05, 0.98**2 + 0.1025 * (1.0 - 0.98**2)),
        # What the search takes for the best is better by more than chance: no more is known.
        (WEAK, 0.0, 0.981**2),
        # A structure that was given stands alone.
        ([candidate("grid", 2, 6, 0.0, chosen=True)], 0.05, 0.0),
        ([candidate("grid", 2, 6, 0.3, chosen=True)], 0.05, (1.05 * 0.3) ** 2),
    ],
)
def test_the_line_is_the_tolerance_of_simplicity(line, structures, simplicity, squared):
    display = shown(line, structures, simplicity)
    dashed = drawn_lines(display)[f"tolerated, simplicity={simplicity:g}"]
    assert_allclose(dashed.get_ydata(), np.sqrt(squared), rtol=1e-12)
    assert display.tolerance == pytest.approx(np.sqrt(squared), rel=1e-12)


def test_a_constant_output_does_not_widen_the_tolerance(rng):
    X = rng.uniform(-1.0, 1.0, (200, 2))
    y = X[:, 0] + 2.0 * rng.normal(size=200)
    every = [y, np.column_stack([y, np.full(200, 3.0)])]
    one, two = (StructureDisplay.from_estimator(ANFISRegressor().fit(X, Y)) for Y in every)
    assert two.tolerance == pytest.approx(one.tolerance, rel=1e-9)


def test_numbers_on_the_axes_are_plain(line):
    axes = shown(line, [*CLEAR, candidate("grid", 100, 700, 0.01)]).ax_
    written = [text.get_text() for text in axes.get_xticklabels()]
    assert {"5", "10", "20", "50", "100", "200", "500"} <= set(written)
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert shown(line, CLEAR).ax_.get_yscale() == "linear"


def test_what_has_compared_nothing_has_no_picture(line):
    for structures in ([], [candidate("grid", 9, 90, np.inf, chosen=True)]):
        with pytest.raises(ValueError, match="no structure with an expected error, so"):
            shown(line, structures)
    with pytest.raises(ValueError, match="Fit one with n_mfs='auto'"):
        StructureDisplay.from_estimator(line.model_)


def test_the_legend_hides_no_candidate(line):
    display = StructureDisplay.from_estimator(line)
    display.figure_.draw_without_rendering()
    legend = display.ax_.get_legend().get_window_extent()
    assert legend.y0 >= display.ax_.get_window_extent().y1
