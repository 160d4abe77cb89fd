"""Grid partition: evenly spaced terms over the range of every input."""

import numpy as np

from ..antecedent import GridAntecedent

__all__ = ["grid_antecedent"]


def grid_antecedent(families, counts, minimum, maximum, overlap):
    """Terms at even distances from ``minimum`` to ``maximum`` of each input.

    Inputs with a count of one have no terms: they take part in the consequents alone. ``families``,
    ``counts``, ``minimum`` and ``maximum`` have one entry per input; neighbours cross at membership
    ``overlap``.
    """
    inputs = [j for j, count in enumerate(counts) if count > 1]
    thetas = []
    for j in inputs:
        centers = np.linspace(minimum[j], maximum[j], counts[j])
        spacing = np.full(counts[j], (maximum[j] - minimum[j]) / (counts[j] - 1))
        thetas.append(families[j].start(centers, spacing, overlap))
    return GridAntecedent.build([families[j] for j in inputs], inputs, thetas)
