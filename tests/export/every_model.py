"""Models of every membership, partition, order and number of outputs, as a list to go through.

Inputs are in everyday units, one of them far from the origin; rows are in the box and out of it.
"""

from itertools import chain, product
from typing import NamedTuple

import numpy as np

from skanfis.antecedent import GridAntecedent, RuleTableAntecedent
from skanfis.membership import FAMILIES, Gaussian
from skanfis.model import TSKModel
from skanfis.policies import OUT_OF_BOUNDS

from ..oracles import random_grid, random_scattered, random_table, random_tree
from .rule_bases import OFFSET, SCALE, build, narrow_target


class Case(NamedTuple):
    """A model, and what it is called in the list."""

    label: str
    partition: str
    model: TSKModel


def surface(n_rows=400, n_outputs=1):
    """Rows in everyday units, and outputs that are no sum of functions of one input."""
    g = np.random.default_rng(0)
    X = g.uniform(-1.0, 1.0, (n_rows, 3)) * [300.0, 40.0, 100.0] + [300.0, 20.0, 0.0]
    y = np.sin(X[:, 0] / 100.0) + 1e-3 * X[:, 1] * X[:, 2]
    return X, np.column_stack([y, 1e3 + y**2])[:, :n_outputs].squeeze()


PARTITIONS = {
    "grid": lambda rng, family: random_grid(rng, [family] * 3, (2, 3, 2)),
    "mixed grid": lambda rng, family: random_grid(rng, [family, Gaussian], (3, 2), (0, 2)),
    "scattered": lambda rng, family: random_scattered(rng, family, 4, (0, 1, 2)),
    "rule table": lambda rng, family: random_table(rng, 4, families=(family, Gaussian, family)),
}


def generate():
    """All combinations; the policies out of bounds go round among them."""
    policies = ("linear", "clip", "linear", "nan", "linear", "raise")
    limits = (np.inf, 0.5, 0.6, 0.5, 0.2, 0.5)
    every = product(FAMILIES.items(), PARTITIONS.items(), (0, 1), (1, 3))
    trees = product([("sides", None)], [("tree", lambda rng, _: random_tree(rng))], (0, 1), (1, 3))
    for i, ((name, family), (kind, make), order, n_outputs) in enumerate(chain(every, trees)):
        turn = (i + i // 6) % 6
        policy, limit = policies[turn], limits[turn]
        antecedent = make(np.random.default_rng(i), family)
        label = f"{name}, {kind}, order {order}, {n_outputs} outputs, {policy} {limit}"
        beyond = {"out_of_bounds": policy, "max_extrapolation": limit}
        target = None if n_outputs == 1 else narrow_target(n_outputs)
        # Inputs that outputs rise with for certain: none, some, all.
        held = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 1], [1, 1, 1]][i % 5], dtype=bool)
        at = np.where(held, OFFSET + SCALE * [0.3, -0.2, 0.1], np.nan) if held.any() else None
        model = build(antecedent, order, n_outputs, target=target, tangent_at=at, **beyond)
        yield Case(label, kind, model)


CASES = tuple(generate())
# One of each family and partition, for what takes its time: orders and numbers of outputs go round.
FEWEST = tuple(CASES[4 * i + (i + i // 4) % 4] for i in range(len(CASES) // 4))
# The tree among them clips: one that is followed on its tangent.
FEWEST += CASES[-2:-1]


def odd_ones():
    """Rules that look at nothing, and are their mean; a line, a constant; slopes by some inputs."""
    nothing, one = RuleTableAntecedent((), np.empty((3, 0), dtype=int)), GridAntecedent((), ())
    linear = {"out_of_bounds": "linear"}
    yield Case("no terms, clip", "rule table", build(nothing))
    yield Case("no terms, linear", "rule table", build(nothing, **linear))
    yield Case("a line", "grid", build(one, 1, 2, **linear))
    yield Case("a constant", "grid", build(one, 0, **linear))
    model = build(random_grid(np.random.default_rng(0), [Gaussian] * 3, (1, 3, 1)), **linear)
    model.coefficients[:, [1, 3]] = 0.0
    yield Case("scheduled", "grid", model)


FEWEST += tuple(odd_ones())
assert {case.model.out_of_bounds for case in FEWEST} == set(OUT_OF_BOUNDS), (
    "a policy has no turn in generate()"
)


def rows(dtype, n_rows=3000):
    """Rows up to half the width of the box beyond it, as numbers of this type."""
    unit = np.random.default_rng(5).uniform(-4.0, 3.5, (n_rows, 3))
    unit[: n_rows // 2] = unit[: n_rows // 2] / 7.5 * 3.5
    return (OFFSET + SCALE * unit).astype(dtype)


def full_scale(y):
    """The largest output of each column."""
    return np.nanmax(np.abs(y), axis=0)
