"""A tree against products of sigmoids along its paths, written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.antecedent import RuleTableAntecedent, TreeAntecedent
from skanfis.antecedent.tree import CRISP, LEAST_WIDTH
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import PRODUCTS

from .. import oracles

ROOT = TreeAntecedent.build([], np.empty((2, 0)), [[]])
SIZES = pytest.mark.parametrize("n_rules", [1, 2, 5, 12])


def tree(n_rules, inputs=(0, 1, 2)):
    return oracles.random_tree(np.random.default_rng(1), n_rules, inputs)


def sides(found, Z):
    """How true it is that each node's input is above its cut, (n_nodes, n_rows)."""
    nodes = found.groups[0]
    z = (Z[nodes.inputs] - nodes.theta[0][:, None]) / np.exp(nodes.theta[1])[:, None]
    return oracles.sigmoid(z)


def by_paths(found, Z):
    """Strengths as products down the paths."""
    above = sides(found, Z)
    true = [[above[n] if up else 1.0 - above[n] for n, up in path] for path in found.paths]
    return np.array([np.prod(path or [0 * Z[0] + 1], axis=0) for path in true])


@SIZES
def test_strengths_are_products_along_the_paths(n_rules, rng):
    Z = rng.normal(size=(3, 200))
    found = tree(n_rules)
    assert found.n_rules == n_rules
    assert found.n_nodes == n_rules - 1
    assert_allclose(found.strengths(Z), by_paths(found, Z), rtol=1e-9, atol=1e-14)


def test_a_split_leaves_the_other_leaves_as_they_are(rng):
    Z, whole = rng.normal(size=(3, 100)), tree(5)
    split = whole.split(2, 1, 0.4, np.log(0.3))
    before, after = whole.strengths(Z), split.strengths(Z)
    assert_array_equal(after[[0, 1, 4, 5]], before[[0, 1, 3, 4]])
    above = oracles.sigmoid((Z[1] - 0.4) / 0.3)
    assert_allclose(after[2], before[2] * above, rtol=1e-12)
    assert_allclose(after[3], before[2] * (1.0 - above), rtol=1e-9)
    assert split.paths[2] == [*whole.paths[2], (4, True)]
    assert split.paths[3] == [*whole.paths[2], (4, False)]


@pytest.mark.theory
@pytest.mark.parametrize("agreement", [0.0, 0.05])
@pytest.mark.parametrize(("order", "n_outputs"), [(1, 1), (0, 2)])
def test_gradient_and_gauss_newton_by_cuts_and_widths(agreement, order, n_outputs, rng):
    rows = oracles.bumpy_rows(rng, 250, 2, n_outputs, weighted=True)
    start = tree(5, inputs=(0, 1))
    penalty = Penalty(agreement=agreement, alpha=1e-3, slope=1e-2)
    problem = SeparableProblem(rows, start, penalty, consequent_inputs=np.arange(2 * order))
    dense = oracles.DenseProblem(rows, start, order, penalty)
    premise = Premise.of(start, *rows.inputs.box)
    assert premise.size == 8
    x = 0.2 * rng.normal(size=premise.size)
    evaluation = problem.evaluate(premise.parameters(x))
    raw = problem.linearise(evaluation)
    gradient, gauss_newton = premise.pull_back(x, raw.gradient, raw.gauss_newton)
    slope = oracles.central_difference(lambda d: dense.cost(premise.parameters(d)), x, 1e-3)
    assert_allclose(gradient, slope, rtol=0, atol=1e-8 * np.abs(slope).max())
    jacobian = oracles.central_difference(premise.parameters, x, 1e-3)
    expected = jacobian.T @ dense.gauss_newton(premise.parameters(x)) @ jacobian
    assert_allclose(gauss_newton, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_widths_have_a_floor_and_crisp_cuts_stay():
    theta = np.array([[0.5, 0.0], np.log([0.5 / CRISP, 0.3])])
    start = TreeAntecedent.build([0, 1], theta, [[(0, True)], [(0, False), (1, True)]])
    premise = Premise.of(start, np.full(2, -1.0), np.ones(2))
    lowest = start.with_parameters(premise.parameters(premise.lower)).groups[0].theta
    highest = start.with_parameters(premise.parameters(premise.upper)).groups[0].theta
    assert_array_equal(lowest[:, 0], theta[:, 0])
    assert_array_equal(highest[:, 0], theta[:, 0])
    assert np.exp(lowest[1, 1]) >= LEAST_WIDTH * (1.0 - 1e-12)
    assert_allclose(lowest[0, 1], -1.3)  # a width beyond the data


@pytest.mark.parametrize(("offset", "scale"), [(-40.0, 1.8), (1e6, 1e-3)])
def test_change_of_units_moves_cuts_and_rows_together(offset, scale, rng):
    Z, found = rng.normal(size=(3, 100)), tree(6)
    moved = found.change_units(np.full(3, offset), np.full(3, scale))
    assert isinstance(moved, TreeAntecedent)
    assert_allclose(moved.strengths(offset + scale * Z), found.strengths(Z), atol=1e-6)


class TestOneTermEach:
    """Sides of an input on one path as one term."""

    @staticmethod
    def two_cuts(first, second):
        """Two cuts of input 1 on one path, and one of input 0."""
        found = ROOT.split(0, 1, first, np.log(0.3)).split(0, 1, second, np.log(0.2))
        return found.split(1, 0, 0.1, np.log(0.5))

    def test_every_pair_of_directions_has_a_family(self):
        found = set()
        for second in (1.5, -1.5):
            table, _ = self.two_cuts(0.2, second).with_one_term_each(["a", "b"])
            found |= {group.family for group in table.groups}
        below = ROOT.split(0, 0, 0.2, -1.0).split(1, 0, 1.5, -1.0)
        found |= {g.family for g in below.with_one_term_each(["a"])[0].groups}
        assert found >= set(PRODUCTS.values())

    def test_three_cuts_of_an_input_on_one_path_are_refused_by_name(self):
        found = self.two_cuts(0.2, 1.5).split(0, 1, 1.8, -1.0)
        with pytest.raises(ValueError, match=r"'rate' \(at 0.2, 1.5, 1.8\).* partition='grid'"):
            found.with_one_term_each(["time", "rate"])

    def test_terms_that_are_no_sides_are_refused(self):
        table = oracles.random_table(np.random.default_rng(0))
        twice = RuleTableAntecedent(table.groups, np.array([[0, 1], [2, 4]]))
        with pytest.raises(ValueError, match="Rule 0 has 2 terms of 'a'"):
            twice.with_one_term_each(["a", "b", "c"])


@pytest.mark.parametrize(
    ("cuts", "widths", "left"),
    [
        # 0.9 true at 1 and at 2: next to nothing lies between.
        ([0.0, 3.0], [1.0, 1.0], [0]),
        ([0.0, 1.9], [1.0, 1.0], [0, 1]),
        # A wide side reaches over a narrow one, whichever is the outer.
        ([0.0, 3.0], [2.5, 0.1], [0, 1]),
        ([0.0, 3.0], [0.1, 2.5], [0, 1]),
        ([0.0, 7.0, 3.5], [1.0, 1.0, 1.0], [0]),
    ],
)
def test_sides_that_follow_from_others_are_left_out(cuts, widths, left):
    theta = np.array([cuts, np.log(np.array(widths) / np.log(9.0))])
    # Down one path, ever below; and up one, ever above, on a mirror, in other units.
    for unit, is_above in ((1.0, False), (-1e3, True)):
        path = [(node, is_above) for node in range(len(cuts))]
        others = [[*path[:k], (k, not is_above)] for k in range(len(cuts))]
        told = theta * [[unit], [1.0]] + [[0.0], [np.log(abs(unit))]]
        found = TreeAntecedent.build([0] * len(cuts), told, [path, *others])
        assert found.without_implied(0.0) is found
        shorter = found.without_implied(0.011)
        kept = [t % len(cuts) for t in shorter.rule_terms[0] if t >= 0]
        assert kept == left
        Z = unit * np.linspace(-15.0, 15.0, 2001)[None]
        assert np.abs(shorter.strengths(Z) - found.strengths(Z)).max() < 0.011


def test_cuts_any_number_of_widths_apart_are_told_from_one_another():
    theta = np.array([[-1e4, 1e4], [0.0, 0.0]])
    found = TreeAntecedent.build([0, 0], theta, [[(0, False), (1, False)], [(0, True)]])
    assert found.without_implied(0.01).rule_terms[0].tolist().count(-1) == 1
