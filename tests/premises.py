"""Antecedents of every kind, points in the box of their premises, and their terms by input."""

import numpy as np
import pytest

from skanfis.antecedent import RuleTableAntecedent, TermGroup
from skanfis.membership import MEMBERSHIPS, Bell, Gaussian

from . import oracles

LOW, HIGH = np.array([-2.0, -3.0, -1.0]), np.array([2.5, 1.0, 4.0])
# As in the module.
MARGIN = 0.25
FACTOR, UNIT = np.log(4.0), 3.0**0.5


def grid(families, counts, inputs=None):
    return oracles.random_grid(np.random.default_rng(1), families, counts, inputs)


def scattered(family, n_rules, inputs, is_listed=True):
    """Rules with terms of their own, all in different places."""
    g, inputs = np.random.default_rng(2), np.array(inputs)
    centers = g.uniform(LOW[inputs], HIGH[inputs], (n_rules, inputs.size))
    theta = family.from_center_and_width(centers, g.uniform(0.5, 1.5, centers.shape))
    own = oracles.own_terms(family, inputs, theta)
    if not is_listed:
        return own
    # With a rule that has terms of the others, those of each input are in order.
    every = np.arange(inputs.size)
    shared = own.table[(every + 1) % n_rules, every]
    return RuleTableAntecedent(own.groups, np.vstack([own.table, shared]))


def shared_places(family):
    """Four terms on each of two inputs, two of the four in one place; one input with one term."""
    centers = np.array([[-1.0, 0.5, 0.5, 2.0], [-2.0, -2.0, 0.0, 0.5]])
    theta = family.from_center_and_width(centers, np.array([[1.0, 0.5, 0.8, 1.2]] * 2))
    groups = [TermGroup(family, np.full(4, j), theta[:, j]) for j in range(2)]
    alone = family.from_center_and_width(np.array([1.5]), np.array([2.0]))
    groups.append(TermGroup(family, np.array([2]), alone))
    table = np.array([[0, 4, 8], [1, 5, 8], [2, 6, 8], [3, 7, 8]])
    return RuleTableAntecedent(tuple(groups), table)


ORDERED = {
    "equal counts": grid([Gaussian] * 2, [3, 3], [0, 2]),
    "gaussians": grid([Gaussian] * 3, [2, 4, 3]),
    "bells": grid([Bell] * 2, [3, 2], [0, 2]),
    "families that alternate": grid([Bell, Gaussian, Bell], [2, 3, 4]),
    "scattered": scattered(Gaussian, 3, [0, 1, 2]),
    "scattered bells": scattered(Bell, 4, [1, 2]),
    **{name: grid([family] * 2, [2, 5], [0, 1]) for name, family in MEMBERSHIPS.items()},
}
ALONE = {
    "shared places": shared_places(Gaussian),
    "shared, bells": shared_places(Bell),
    "terms of their own": scattered(Gaussian, 3, [0, 1, 2], is_listed=False),
}
ANTECEDENTS = ORDERED | ALONE
ALL = pytest.mark.parametrize("antecedent", ANTECEDENTS.values(), ids=list(ANTECEDENTS))
ON_ORDERED = pytest.mark.parametrize("antecedent", ORDERED.values(), ids=list(ORDERED))
ON_ALONE = pytest.mark.parametrize("antecedent", ALONE.values(), ids=list(ALONE))


def in_the_box(premise, rng, n=20):
    """Displacements inside the box, and at its corners."""
    inside = rng.uniform(premise.lower, premise.upper, (n, premise.size))
    corners = np.where(rng.random((n, premise.size)) < 0.5, premise.lower, premise.upper)
    return np.vstack([inside, corners, premise.lower, premise.upper])


def terms(antecedent, vector):
    """A vector laid out as the parameters, by input: families and columns from left to right."""
    by_input, start = {}, 0
    at_start = antecedent.parameters
    for group in antecedent.groups:
        shape = group.theta.shape
        block = vector[start : start + group.theta.size].reshape(shape)
        places = at_start[start : start + group.theta.size].reshape(shape)[0]
        start += group.theta.size
        for t, j in enumerate(group.inputs.tolist()):
            by_input.setdefault(j, []).append((places[t], group.family, block[:, t]))
    return {j: sorted(own, key=lambda term: term[0]) for j, own in by_input.items()}


def locations(antecedent, vector):
    return {j: np.array([t[0] for _, _, t in own]) for j, own in terms(antecedent, vector).items()}


def kind_of(antecedent):
    """Of every parameter, "location", "log_width" or "log_shape"."""
    kinds = [np.repeat([p.kind for p in g.family.parameters], g.n_terms) for g in antecedent.groups]
    return np.concatenate(kinds)


def distances(places):
    """Mean distance of each term to its neighbours."""
    gaps = np.diff(places)
    return 0.5 * (np.append(gaps[:1], gaps) + np.append(gaps, gaps[-1:]))


def span(places, j, margin):
    """Where the terms of an input may stand."""
    low, high = min(LOW[j], places[0]), max(HIGH[j], places[-1])
    low = max(low, places[0] - (places[1] - places[0]))
    high = min(high, places[-1] + (places[-1] - places[-2]))
    beyond = margin * (places[-1] - places[0]) / (len(places) - 1)
    return low - beyond, high + beyond
