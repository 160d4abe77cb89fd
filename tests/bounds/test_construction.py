"""Rules in order: what rises by construction, against branch and bound, rows and a programme."""

from functools import partial
from itertools import combinations, product

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.bounds.certified import training_box
from skanfis.bounds.construction import RuleOrder, is_in_order, nearest_in_order, with_equal_widths
from skanfis.bounds.enclosure import Enclosure
from skanfis.bounds.search import largest
from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian

from .. import oracles
from ..quick import frozen

FREE, ORIGIN = (-np.inf, np.inf), np.zeros(2)


def tree(rng, n_inputs):
    """With two cuts of an input on a path, or more, among them."""
    return oracles.random_tree(rng, rng.integers(2, 7), range(n_inputs))


def grid(rng, n_inputs):
    counts = rng.integers(2, 4, n_inputs)
    thetas = [[np.sort(rng.normal(size=n)), np.log(rng.uniform(0.3, 2.0, n))] for n in counts]
    return GridAntecedent.build([Gaussian] * n_inputs, range(n_inputs), list(map(np.stack, thetas)))


def scattered(rng, n_inputs):
    n_rules = rng.integers(2, 6)
    theta = rng.normal(size=(2, n_rules, n_inputs))
    return oracles.own_terms(Gaussian, np.arange(n_inputs), theta)


KINDS = {
    "tree": tree,
    "grid": grid,
    "scattered": scattered,
    "one rule": lambda rng, n_inputs: GridAntecedent.build([], [], []),
}


def problem_of(antecedent, rng, order=1):
    X = rng.uniform(-1.5, 1.5, (40, 2)) * [1.0, 20.0] + [0.0, 500.0]
    y = rng.normal(size=(40, 1)) * 7.0 + 30.0
    rows = StandardisedData.of(X, y, None)
    penalty, inputs = Penalty(alpha=1e-3, slope=1e-3), np.arange(order * 2)
    return SeparableProblem(rows, antecedent, penalty, consequent_inputs=inputs)


def in_order(problem, evaluation, order):
    """The nearest local consequents that keep an order."""
    nothing = np.empty((0, problem.n_columns)), np.empty(0)
    box = [end[problem.consequent_inputs] for end in problem.rows.inputs.box]
    normal, to_rules = evaluation.normal, problem.local.to_global(np.eye(problem.n_columns))
    start = normal.coefficients[:, 0]
    return nearest_in_order(order, normal.factor, start, to_rules, box, *nothing)


def kept(problem, evaluation, order):
    """A frozen model whose rules are in order."""
    local = in_order(problem, evaluation, order)[:, None]
    return frozen(problem, evaluation, problem.local.to_global(local))


@pytest.mark.theory
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_in_order_rises(kind):
    """50 random models of a kind: rows, and the proof that knows nothing of an order."""
    rng = np.random.default_rng(5)
    falls = n_proven = n_asked = 0
    for place in range(50):
        # One input rises or falls, or two; scattered rules may be in other orders by the other.
        signs, order = np.array([1, -1, 0])[rng.integers(0, 3, 2)], place % 2
        if not signs.all() or kind == "scattered":
            signs = np.array([1 - 2 * (place % 3 > 0), 0])
        antecedent = with_equal_widths(KINDS[kind](rng, 2), np.flatnonzero(signs))
        problem = problem_of(antecedent, rng, order)
        evaluation = problem.evaluate(antecedent.parameters)
        held = RuleOrder.of(antecedent, signs, FREE, problem.consequent_inputs, ORIGIN)
        model = kept(problem, evaluation, held)
        assert is_in_order(model, 0, signs)
        scale, low, high = problem.rows.targets.scale[0], model.minimum, model.maximum
        X = rng.uniform(low, high, (500, 2))
        slopes = model.gradient(X)[:, :, 0] * model.spread / scale
        assert (signs * slopes >= -1e-9).all()
        free = evaluation.coefficients.reshape(antecedent.n_rules, -1)
        ends = [end[: free.shape[1] - 1] for end in problem.rows.inputs.box]
        falls += (held.margins(free, *ends)[0] < 0.0).any()
        for j in np.flatnonzero(signs):
            slope = partial(Enclosure(model, 0, -float(signs[j])).slope, j=int(j))
            until = 1e-9 * scale / model.spread[j]
            found = largest(slope, low, high, 0.0, 400, training_box(model), until=until)
            assert found.attained <= until
            n_proven, n_asked = n_proven + (found.bound <= until), n_asked + 1
    # A slope that touches zero inside the range takes more boxes than these.
    assert n_proven > 0.7 * n_asked
    assert falls > 5 or kind == "one rule"


@pytest.mark.parametrize("kind", ["tree", "grid"])
def test_slopes_that_are_none_stay_none_in_order(kind, rng):
    """By an input with which predictions rise too: of the first rule, and of all."""
    signs = np.array([1, 0])
    antecedent = with_equal_widths(KINDS[kind](rng, 2), [0])
    every = tuple(range(antecedent.n_rules))
    for rules in ((0,), every):
        penalty = Penalty(alpha=1e-3, slope=1e-3, absent=((0, rules),))
        problem = problem_of(antecedent, rng).with_penalty(penalty)
        evaluation = problem.evaluate(antecedent.parameters)
        order = RuleOrder.of(antecedent, signs, FREE, np.arange(2), ORIGIN)
        model = kept(problem, evaluation, order)
        assert is_in_order(model, 0, signs)
        slopes = model.coefficients[:, 1, 0]
        assert not slopes[list(rules)].any()
        assert slopes.any() == (rules != every)


@pytest.mark.theory
@pytest.mark.parametrize("signs", [[1, 0], [-1, 1]], ids=str)
@pytest.mark.parametrize("kind", ["tree", "grid", "scattered"])
def test_margins_are_the_least_of_the_inequality_on_the_box(kind, signs, rng):
    """At the corners of the other input, and at 20,001 places of the one that is told."""
    low, high = np.full(2, -1.5), np.full(2, 1.5)
    n_pairs = 0
    for _ in range(10):
        antecedent = KINDS[kind](rng, 2)
        if kind != "tree":
            antecedent = with_equal_widths(antecedent, range(2))
        order = RuleOrder.of(antecedent, np.array(signs), FREE, np.arange(2), ORIGIN)
        rules = rng.normal(size=(antecedent.n_rules, 3))
        told = 1 + np.flatnonzero(signs)
        rules[:, told] = np.abs(rules[:, told]) * np.array(signs)[told - 1]
        margins = order.margins(rules, low, high)[0]
        for k, margin in enumerate(margins):
            above, below, j, middle, width, own, curved, _ = (part[k] for part in order.pairs)
            x, least = np.linspace(low[0], high[0], 20_001), np.inf
            u = (x - middle) / width
            slopes = (own + curved * np.exp(u)) * rules[above, j]
            slopes += (own + curved * np.exp(-u)) * rules[below, j]
            for end in (low[0], high[0]):
                place = np.column_stack([x, np.full(x.size, end)][:: 1 if j == 1 else -1])
                values = place @ (rules[above, 1:] - rules[below, 1:])
                values += rules[above, 0] - rules[below, 0] + width * slopes
                least = min(least, values.min())
            assert margin == pytest.approx(least, rel=1e-5, abs=1e-5)
        n_pairs += margins.size
    assert n_pairs > 20


def test_the_least_change_that_is_in_order(rng):
    """Against a general solver, which has what every pair adds to the slope at many points."""
    antecedent = with_equal_widths(grid(rng, 2), [0])
    problem = problem_of(antecedent, rng)
    evaluation = problem.evaluate(antecedent.parameters)
    held = RuleOrder.of(antecedent, np.array([1, 0]), FREE, problem.consequent_inputs, ORIGIN)
    box, normal = problem.rows.inputs.box, evaluation.normal
    to_rules, start = problem.local.to_global(np.eye(problem.n_columns)), normal.coefficients[:, 0]
    found = in_order(problem, evaluation, held)
    weighed, rows = normal.gram + normal.penalty, []
    n_terms = antecedent.counts[0]
    for x, z in product(np.linspace(*np.transpose(box)[0], 51), np.transpose(box)[1]):
        strengths = antecedent.strengths(np.array([[x], [z]]))[:, 0]
        _, slopes = Gaussian.log_value_and_gradient(x, antecedent.groups[0].theta[:, :n_terms])
        for line in np.arange(antecedent.n_rules).reshape(n_terms, -1).T:
            for one, other in combinations(range(n_terms), 2):
                above, below = line[[other, one]]
                row = np.zeros((antecedent.n_rules, 3))
                row[[above, below], 1] = 1.0 + strengths[[above, below]] / (
                    strengths[[below, above]] * (n_terms - 1)
                )
                steeper = slopes[0, one] - slopes[0, other]
                row[above] += steeper * np.array([1.0, x, z])
                row[below] -= steeper * np.array([1.0, x, z])
                rows.append(row.ravel() @ to_rules / np.abs(row).max())
    for rule in np.eye(antecedent.n_rules):
        rows.append(np.outer(rule, [0.0, 1.0, 0.0]).ravel() @ to_rules)
    solved = minimize(
        lambda u: (u - start) @ weighed @ (u - start),
        found,
        jac=lambda u: 2.0 * weighed @ (u - start),
        constraints=LinearConstraint(np.array(rows), 0.0, np.inf),
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-14},
    )
    change = found - start
    assert change @ weighed @ change == pytest.approx(solved.fun, rel=1e-4)


@pytest.mark.parametrize(
    "antecedent",
    [
        # Of unequal widths shares cross twice; of bells slopes of logarithms are in no order.
        GridAntecedent.build([Gaussian], [0], [np.array([[0.0, 1.0], [0.0, 1.0]])]),
        GridAntecedent.build([Bell], [0], [np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 1.0]])]),
        # One rule has no term on the input, so that its share may go either way.
        RuleTableAntecedent.of_own_terms(
            [Gaussian], {0: np.array([[0.0, 1.0, np.nan], 3 * [0.0]])}
        ),
    ],
    ids=["unequal widths", "bells", "no term"],
)
def test_where_no_order_is_known_there_is_none(antecedent):
    slopes = np.array([0])
    assert RuleOrder.of(antecedent, np.array([1]), FREE, slopes, ORIGIN) is None
    assert RuleOrder.of(antecedent, np.array([0]), FREE, slopes, ORIGIN).pairs.above.size == 0
