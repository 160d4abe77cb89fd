"""Frozen models of every kind of rule base, order and number of outputs, in everyday units."""

from itertools import product

import numpy as np

from skanfis.antecedent import GridAntecedent, TreeAntecedent
from skanfis.membership import Bell, Gaussian, TwoSidedGaussian
from skanfis.model import TSKModel
from skanfis.policies import TargetRange

from .. import oracles

# Of x = OFFSET + SCALE z, with z of order one.
OFFSET, SCALE = np.array([1e6, 20.0, 0.0]), np.array([600.0, 15.0, 0.01])
NAMES = ("time", "chip temperature", "rate")


def a_tree():
    """Leaves that ask of an input nothing, one side, or two: above both, between, below both."""
    tree, splits = TreeAntecedent.build([], np.empty((2, 0)), [[]]), [(0, 0, 0.6, 0.4)]
    # Of the first input: above both cuts, between them, below both.
    splits += [(1, 0, -0.7, 0.3), (0, 0, 1.1, 0.2), (2, 2, 0.3, 0.05), (0, 1, -0.4, 0.8)]
    for leaf, j, cut, width in splits:
        tree = tree.split(leaf, j, cut, np.log(width))
    return tree


def _antecedents():
    def rng():
        return np.random.default_rng(1)

    families = (Gaussian, Bell, TwoSidedGaussian)
    return {
        "grid": oracles.random_grid(rng(), families, (2, 3, 2)),
        "grid on two inputs": oracles.random_grid(rng(), (Gaussian, Gaussian), (3, 2), (0, 2)),
        "scattered": oracles.random_scattered(rng(), Gaussian, 4, (0, 1, 2)),
        "scattered on two inputs": oracles.random_scattered(rng(), Bell, 3, (1, 2)),
        "rule table": oracles.random_table(rng()),
        "tree": a_tree(),
        "one rule": GridAntecedent((), counts=()),
    }


def build(antecedent, order=1, n_outputs=1, offset=OFFSET, scale=SCALE, **changes):
    """A model with random consequents; rule 1 has never fired where there are more than two.

    The antecedent is of inputs of order one, the model in units of ``offset`` and ``scale``.
    """
    g = np.random.default_rng(2)
    n_rules = antecedent.n_rules
    coefficients = g.normal(size=(n_rules, 1 + 3 * order, n_outputs))
    coefficients[:, 1:] /= scale[:, None][: 3 * order]
    weights = g.dirichlet(np.ones(n_rules))
    rows = np.round(40.0 * weights)
    if n_rules > 2:
        rows[1] = 0.0
    moved = antecedent.change_units(offset, scale)
    settings = {
        "antecedent": moved,
        "initial_antecedent": moved.with_parameters(moved.parameters + 0.25),
        "coefficients": coefficients,
        "reference": offset + scale * [0.2, -0.1, 0.4],
        "spread": scale * [1.0, 1.1, 0.9],
        "minimum": offset - 2.0 * scale,
        "maximum": offset + 1.5 * scale,
        "rule_weights": weights,
        "rule_rows": rows,
        "input_names": NAMES,
        "out_of_bounds": "clip",
        "support": oracles.random_support(g, n_rules, 3).change_units(offset, scale),
    }
    return TSKModel(**(settings | changes))


def narrow_target(n_outputs):
    """A target whose limits hold some of the outputs, which are of order one.

    Of the first and of the last, one limit was asked for.
    """
    ones = np.ones(n_outputs)
    lower, upper = -np.inf * ones, np.inf * ones
    lower[0], upper[-1] = -0.9, 1.2
    return TargetRange(-1.0 * ones, 1.5 * ones, 0.8 * ones, lower, upper)


MODELS = {
    f"{kind}, order {order}, {n_outputs} outputs": build(antecedent, order, n_outputs)
    for (kind, antecedent), order, n_outputs in product(_antecedents().items(), (0, 1), (1, 2))
}
# Half of them: every kind meets both orders and both numbers of outputs, and these each other.
EVERY_PAIR = {
    name: model
    for place, (name, model) in enumerate(MODELS.items())
    if (place // 4 + model.order + model.n_outputs) % 2
}


def rows_of(model, reach, n_rows=40):
    """Rows in the box (reach 1) or in and out of it (reach above 1)."""
    middle, half = (model.maximum + model.minimum) / 2, (model.maximum - model.minimum) / 2
    unit = np.random.default_rng(3).uniform(-1.0, 1.0, (n_rows, model.n_inputs))
    return middle + reach * half * unit
