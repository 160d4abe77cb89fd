"""Rules in order: what rises by construction, against branch and bound, rows and a programme."""

from functools import partial

import numpy as np
import pytest

from skanfis.antecedent import GridAntecedent, ScatteredAntecedent, TreeAntecedent
from skanfis.bounds.certified import cuts_of
from skanfis.bounds.construction import RuleOrder, held_by_order, order_of, with_equal_widths
from skanfis.bounds.enclosure import Enclosure
from skanfis.bounds.inequalities import InfeasibleError
from skanfis.bounds.search import largest
from skanfis.consequent import in_user_units
from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import (
    Bell,
    Gaussian,
    SigmoidDifference,
    Triangular,
    TwoSidedGaussian,
)
from skanfis.model import TSKModel

from .. import oracles

FREE = np.array([[-np.inf, np.inf]])


def tree(rng, n_inputs):
    """Cuts of random leaves, of random inputs; two cuts of an input on a path among them."""
    found = TreeAntecedent.build([], np.empty((2, 0)), [[]])
    for _ in range(rng.integers(1, 6)):
        leaf, j = rng.integers(found.n_rules), rng.integers(n_inputs)
        found = found.split(leaf, j, rng.normal(), np.log(rng.uniform(0.02, 1.0)))
    return found


def grid(rng, n_inputs):
    counts = rng.integers(2, 4, n_inputs)
    thetas = [
        np.stack([np.sort(rng.normal(size=n)), np.log(rng.uniform(0.3, 2.0, n))]) for n in counts
    ]
    return GridAntecedent.build([Gaussian] * n_inputs, range(n_inputs), thetas)


def scattered(rng, n_inputs):
    n_rules = rng.integers(2, 6)
    theta = rng.normal(size=(2, n_rules, n_inputs))
    return ScatteredAntecedent.build(Gaussian, np.arange(n_inputs), theta)


def other_families(rng, n_inputs):
    """Neither of one shape nor of one width; by branch and bound what they keep is found too."""
    families = rng.choice([TwoSidedGaussian, Bell, SigmoidDifference, Triangular], n_inputs)
    return oracles.random_grid(rng, families, rng.integers(2, 4, n_inputs))


def one_rule(rng, n_inputs):
    return GridAntecedent.build([], [], [])


KINDS = {
    "tree": tree,
    "grid": grid,
    "scattered": scattered,
    "other families": other_families,
    "one rule": one_rule,
}


def problem_of(antecedent, rng, order=1, n_inputs=2, alpha=1e-3):
    X = rng.uniform(-1.5, 1.5, (40, n_inputs)) * [1.0, 20.0] + [0.0, 500.0]
    y = rng.normal(size=(40, 1)) * 7.0 + 30.0
    rows = StandardisedData.of(X, y, None)
    return SeparableProblem(rows, antecedent, order, Penalty(alpha=alpha))


def kept(problem, evaluation, order):
    """A frozen model whose rules are in order."""
    nothing = np.empty((0, problem.n_columns)), np.empty(0)
    local, _ = held_by_order(order, evaluation, problem, 0, *nothing)
    inputs, targets = problem.rows.inputs, problem.rows.targets
    coefficients = in_user_units(
        problem.local.to_global(local[:, None]), inputs, targets, np.arange(2), problem.order
    )
    antecedent = evaluation.antecedent.change_units(inputs.offset, inputs.scale)
    return TSKModel(
        antecedent=antecedent,
        initial_antecedent=antecedent,
        coefficients=coefficients,
        reference=inputs.offset,
        spread=inputs.scale,
        minimum=inputs.minimum,
        maximum=inputs.maximum,
        rule_weights=evaluation.masses,
        rule_rows=evaluation.masses,
        input_names=("a", "b"),
        out_of_bounds="clip",
    )


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_in_order_rises(kind):
    """300 random models of a kind: rows, and the proof that knows nothing of an order."""
    rng = np.random.default_rng(5)
    falls = n_proven = n_asked = n_none = 0
    for place in range(60 if kind == "other families" else 300):
        antecedent = KINDS[kind](rng, 2)
        # One input rises or falls, or two.
        signs, order = np.array([1, -1, 0])[rng.integers(0, 3, 2)], place % 2
        if not signs.all() or (kind == "scattered" and not order):
            signs = np.array([1 - 2 * (place % 3 > 0), 0])
        order = 1 if kind == "other families" else order
        if not order:
            # Without slopes to help, terms must have one width.
            antecedent = with_equal_widths(antecedent, [0, 1])
        problem = problem_of(antecedent, rng, order)
        evaluation = problem.evaluate(antecedent.parameters)
        box, slopes = problem.rows.inputs.box, problem.consequent_inputs
        held = RuleOrder.of(antecedent, signs, FREE[0], *box, slopes)
        try:
            model = kept(problem, evaluation, held)
        except InfeasibleError:
            n_none += 1
            continue
        certificate, *ends = order_of(model, signs)
        assert certificate.holds(model.coefficients[:, :, 0], *ends)
        scale, low, high = problem.rows.targets.scale[0], model.minimum, model.maximum
        X = rng.uniform(low, high, (500, 2))
        slopes = model.gradient(X)[:, :, 0] * model.spread / scale
        assert (signs * slopes >= -1e-9).all()
        free = evaluation.coefficients.reshape(antecedent.n_rules, -1)
        ends = [end[: free.shape[1] - 1] for end in problem.rows.inputs.box]
        falls += (held.left(free, *ends)[0] < 0.0).any()
        for j in np.flatnonzero(signs):
            slope = partial(Enclosure(model, 0, -float(signs[j])).slope, j=int(j))
            until = 1e-9 * scale / model.spread[j]
            found = largest(slope, low, high, 0.0, 400, cuts_of(model), until=until)
            assert found.attained <= until
            n_proven, n_asked = n_proven + (found.bound <= until), n_asked + 1
    # A slope that touches zero inside the range takes more boxes than these.
    assert n_proven > 0.7 * n_asked
    assert falls > 30 or kind == "one rule"
    # Steep flanks ask for rules that are one to the last digits.
    assert n_none <= (12 if kind == "other families" else 0)
