r"""Scattered rules from clusters: one rule where the data gather.

Clusters are sought in standardised inputs and target together, as is the custom since genfis2
(Chiu 1994), so that rules part where the target bends and not only where the inputs are dense. A
rule's terms stand at the mean of its cluster; their widths are the cluster's standard deviations
times sqrt(d), for the distance from the centre grows as sqrt(d) in d inputs and rules would
otherwise hardly overlap.
"""

from functools import cache
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.optimize import brentq

from ..antecedent import GridAntecedent, RuleTableAntecedent, ScatteredAntecedent, TermGroup
from ..learning.data import StandardisedData
from .sample import representative_rows

__all__ = ["clustered_antecedent"]

# Widths in standard deviations of the input: a cluster on one spot still gets a term of some width.
_SMALLEST_WIDTH = 0.1
# Terms that cross above this at the start are one term: training may bring them closer still, and
# above 0.9 nobody could tell them apart.
_HIGHEST_CROSSING = 0.85
# Beyond so many widths terms of a family of one's own never part.
_FARTHEST = 1e6
# Widths go with the number of inputs that tell clusters apart, and that with the widths: a bound,
# should they go to and fro.
_MOST_TURNS = 4


def clustered_antecedent(
    families, rows: StandardisedData, label, premise_inputs, share_terms=False
):
    """A rule for every cluster that ``label(table, weight)`` finds in [z, y].

    z are the ``premise_inputs`` alone, in whose terms the rules are; ``families`` has one entry per
    input of the rows.

    ``label`` returns one integer per row; negative ones (noise) belong to no rule. A single cluster
    is a single rule without terms: a linear model. Where terms are shared, those of an input that
    could not be told apart are one.
    """
    table, weight, _ = representative_rows(rows)
    n_inputs = rows.X.shape[1]
    inputs = premise_inputs[~rows.inputs.is_constant[premise_inputs]]
    seen = np.hstack([table[:, premise_inputs], table[:, n_inputs:]])
    labels = np.asarray(label(seen, weight))
    found = np.unique(labels[labels >= 0])
    if found.size == 0:
        raise ValueError(
            "partition found no cluster: every training row was labelled as noise. Give a "
            "clusterer whose parameters fit standardised data (zero mean, unit deviation)."
        )
    if found.size == 1 or inputs.size == 0:
        return GridAntecedent((), counts=())
    members = [labels == cluster for cluster in found]
    masses = np.array([weight[m].sum() for m in members])
    centers = np.array(
        [np.average(table[m, :n_inputs], axis=0, weights=weight[m]) for m in members]
    )
    spreads = np.array(
        [
            np.sqrt(np.average((table[m, :n_inputs] - c) ** 2, axis=0, weights=weight[m]))
            for m, c in zip(members, centers, strict=True)
        ]
    )
    if share_terms:
        return _with_shared_terms(families, inputs, centers, spreads, masses)
    widths = np.maximum(spreads, _SMALLEST_WIDTH) * np.sqrt(inputs.size)
    if len({families[j] for j in inputs}) == 1:
        family = families[inputs[0]]
        theta = family.from_center_and_width(centers[:, inputs], widths[:, inputs])
        return ScatteredAntecedent.build(family, inputs, theta)
    groups = tuple(
        TermGroup(
            families[j],
            np.full(found.size, j),
            families[j].from_center_and_width(centers[:, j], widths[:, j]),
        )
        for j in inputs
    )
    first = found.size * np.arange(inputs.size)
    return RuleTableAntecedent(groups, np.arange(found.size)[:, None] + first)


def _with_shared_terms(families, inputs, centers, spreads, masses):
    """Rules over terms that can be told apart: those of an input that cannot are one term.

    With fewer inputs that tell rules apart the terms of the others are narrower, so the number of
    these is found in turns.
    """
    n_telling = inputs.size
    for _ in range(_MOST_TURNS):
        widths = np.maximum(spreads, _SMALLEST_WIDTH) * np.sqrt(max(n_telling, 1))
        shared = {
            j: _merged(families[j], centers[:, j], widths[:, j], masses) for j in inputs.tolist()
        }
        telling = [j for j, (_, _, term_of) in shared.items() if term_of.max() > 0]
        if len(telling) == n_telling:
            break
        n_telling = len(telling)
    if not telling:
        return GridAntecedent((), counts=())
    groups, columns, first = [], [], 0
    for j in telling:
        center, width, term_of = shared[j]
        theta = families[j].from_center_and_width(center, width)
        groups.append(TermGroup(families[j], np.full(center.size, j), theta))
        columns.append(first + term_of)
        first += center.size
    return RuleTableAntecedent(tuple(groups), np.unique(np.column_stack(columns), axis=0))


def _merged(family, centers, widths, masses):
    """Centres and widths of the terms left on an input, and the term of every rule.

    Neighbours that cross highest are merged first, into a term of their common mean and deviation.
    """
    order = np.argsort(centers, kind="stable").tolist()
    terms = [(centers[r], widths[r] ** 2, masses[r], [r]) for r in order]
    distances = [_distance(*pair) for pair in pairwise(terms)]
    while distances and min(distances) < _closest(family):
        k = distances.index(min(distances))
        terms[k : k + 2] = [_joined(*terms[k : k + 2])]
        first = max(k - 1, 0)
        distances[first : k + 2] = [_distance(*pair) for pair in pairwise(terms[first : k + 2])]
    term_of = np.empty(centers.size, dtype=int)
    for t, (_, _, _, rules) in enumerate(terms):
        term_of[rules] = t
    left = np.array([(center, np.sqrt(variance)) for center, variance, _, _ in terms])
    return left[:, 0], left[:, 1], term_of


def _joined(one, other):
    mass = one[2] + other[2]
    parts = one[2] / mass, other[2] / mass
    center = parts[0] * one[0] + parts[1] * other[0]
    variance = sum(
        p * (t[1] + (t[0] - center) ** 2) for p, t in zip(parts, (one, other), strict=True)
    )
    return center, variance, mass, one[3] + other[3]


def _distance(one, other):
    """From one term to the next, in units of both their widths together."""
    return (other[0] - one[0]) / (sqrt(one[1]) + sqrt(other[1]))


@cache
def _closest(family):
    """The distance at which two terms cross just low enough: as many of its own widths from each.

    Of terms that rise or fall for good, how true the one is there that is the less true.
    """
    theta = family.from_center_and_width(np.zeros(1), np.ones(1))

    def crossing(distance):
        return min(family.value(np.array([[side]]), theta)[0, 0] for side in (-distance, distance))

    if crossing(0.0) <= _HIGHEST_CROSSING:
        return 0.0
    far = 1.0
    while crossing(far) > _HIGHEST_CROSSING and far < _FARTHEST:
        far *= 2.0
    if crossing(far) > _HIGHEST_CROSSING:
        return np.inf
    return brentq(lambda distance: crossing(distance) - _HIGHEST_CROSSING, 0.0, far)
