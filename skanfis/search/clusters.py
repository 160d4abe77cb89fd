r"""Scattered rules from clusters: one rule where the data gather.

Clusters are sought in standardised inputs and target together. A rule's terms stand at the mean of
its cluster; their widths are the cluster's standard deviations times sqrt(d), for the distance from
the centre grows as sqrt(d) in d inputs and rules would otherwise hardly overlap.
"""

import numpy as np

from ..antecedent import GridAntecedent, RuleTableAntecedent, ScatteredAntecedent, TermGroup
from ..learning.data import StandardisedData
from .sample import representative_rows

# Widths in standard deviations of the input: a cluster on one spot still gets a term of some width.
_SMALLEST_WIDTH = 0.1


def clustered_antecedent(families, rows: StandardisedData, label, premise_inputs):
    """A rule for every cluster that ``label(table, weight)`` finds in [z, y].

    z are the ``premise_inputs`` alone, in whose terms the rules are; ``families`` has one entry per
    input of the rows. ``label`` returns one integer per row; negative ones (noise) belong to no
    rule. A single cluster is a single rule without terms: a linear model.
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
    centers, widths = np.empty((2, found.size, inputs.size))
    for r, cluster in enumerate(found):
        own = labels == cluster
        z, mass = table[own][:, inputs], weight[own]
        centers[r] = np.average(z, axis=0, weights=mass)
        spread = np.sqrt(np.average((z - centers[r]) ** 2, axis=0, weights=mass))
        widths[r] = np.maximum(spread, _SMALLEST_WIDTH) * np.sqrt(inputs.size)
    if len({families[j] for j in inputs}) == 1:
        family = families[inputs[0]]
        theta = family.from_center_and_width(centers, widths)
        return ScatteredAntecedent.build(family, inputs, theta)
    groups = tuple(
        TermGroup(
            families[j],
            np.full(found.size, j),
            families[j].from_center_and_width(centers[:, k], widths[:, k]),
        )
        for k, j in enumerate(inputs)
    )
    first = found.size * np.arange(inputs.size)
    return RuleTableAntecedent(groups, np.arange(found.size)[:, None] + first)
