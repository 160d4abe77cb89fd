"""Models of every membership, partition, order and number of outputs, as a list to go through.

Inputs are in everyday units, one of them far from the origin; rows are in the box and out of it.
"""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from skanfis.antecedent import RuleTableAntecedent, TermGroup
from skanfis.membership import MEMBERSHIPS, Gaussian
from skanfis.model import TSKModel
from skanfis.policies import OUT_OF_BOUNDS

from ..oracles import random_grid, random_scattered
from .rule_bases import OFFSET, SCALE, build, narrow_target


@dataclass(frozen=True)
class Case:
    """A model, and what it is called in the list."""

    label: str
    family: str
    partition: str
    model: TSKModel

    def traits(self):
        """What may meet in one model."""
        model = self.model
        return self.family, self.partition, model.order, model.n_outputs, model.out_of_bounds


def surface(n_rows=400, n_outputs=1):
    """Rows in everyday units, and outputs that are no sum of functions of one input."""
    g = np.random.default_rng(0)
    X = g.uniform(-1.0, 1.0, (n_rows, 3)) * [300.0, 40.0, 100.0] + [300.0, 20.0, 0.0]
    y = np.sin(X[:, 0] / 100.0) + 1e-3 * X[:, 1] * X[:, 2]
    return X, np.column_stack([y, 1e3 + y**2])[:, :n_outputs].squeeze()


def table_of(rng, family):
    """Four rules over terms of two families on three inputs; two do not look at all of them."""
    groups = []
    for j, of_input in enumerate((family, Gaussian, family)):
        centers = np.array([-1.0, 0.1, 1.2]) + 0.2 * rng.normal(size=3)
        theta = of_input.from_center_and_width(centers, rng.uniform(0.7, 1.5, 3))
        groups.append(TermGroup(of_input, np.full(3, j), theta))
    table = np.array([[0, -1, 6], [1, 4, 7], [2, 3, -1], [1, 5, 8]])
    return RuleTableAntecedent(tuple(groups), table)


PARTITIONS = {
    "grid": lambda rng, family: random_grid(rng, [family] * 3, (2, 3, 2)),
    "mixed grid": lambda rng, family: random_grid(rng, [family, Gaussian], (3, 2), (0, 2)),
    "scattered": lambda rng, family: random_scattered(rng, family, 4, (0, 1, 2)),
    "rule table": table_of,
}


def generate():
    """All combinations; the policies out of bounds go round among them."""
    policies = ("linear", "clip", "linear", "nan", "linear", "raise")
    limits = (np.inf, 0.5, 0.6, 0.5, 0.2, 0.5)
    every = product(MEMBERSHIPS.items(), PARTITIONS.items(), (0, 1), (1, 3))
    for i, ((name, family), (kind, make), order, n_outputs) in enumerate(every):
        turn = (i + i // 6) % 6
        policy, limit = policies[turn], limits[turn]
        antecedent = make(np.random.default_rng(i), family)
        label = f"{name}, {kind}, order {order}, {n_outputs} outputs, {policy} {limit}"
        beyond = {"out_of_bounds": policy, "max_extrapolation": limit}
        target = None if n_outputs == 1 else narrow_target(n_outputs)
        model = build(antecedent, order, n_outputs, target=target, **beyond)
        yield Case(label, name, kind, model)


def meetings(cases):
    """Every two traits that meet in one of the cases; of policies, those with order and outputs."""
    every = [case.traits() for case in cases]
    pairs = {(i, j, t[i], t[j]) for t in every for i, j in combinations(range(4), 2)}
    return pairs | {(4, 4, t[4], t[j]) for t in every for j in range(2, 5)}


def fewest(cases):
    """One case for each family and partition, in which any two traits still meet."""
    chosen, missing = [], meetings(cases)
    for pair in product(MEMBERSHIPS, PARTITIONS):
        of_pair = [case for case in cases if (case.family, case.partition) == pair]
        chosen.append(max(of_pair, key=lambda case: len(meetings([case]) & missing)))
        missing -= meetings(chosen[-1:])
    return tuple(chosen)


CASES = tuple(generate())
assert {case.model.out_of_bounds for case in CASES} == set(OUT_OF_BOUNDS)
# For what takes its time with every model.
FEWEST = fewest(CASES)
assert meetings(FEWEST) == meetings(CASES)


def rows(dtype, n_rows=3000):
    """Rows up to half the width of the box beyond it, as numbers of this type."""
    unit = np.random.default_rng(5).uniform(-4.0, 3.5, (n_rows, 3))
    unit[: n_rows // 2] = unit[: n_rows // 2] / 7.5 * 3.5
    return (OFFSET + SCALE * unit).astype(dtype)


def full_scale(y):
    """The largest output of each column."""
    return np.nanmax(np.abs(y), axis=0)
