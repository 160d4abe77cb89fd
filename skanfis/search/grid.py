r"""Grid partition: terms over the range of every input, close together where the data are dense.

Terms stand at even steps of

    G(x) = sum of (gap between neighbouring values)^(2/3) up to x ,

which is where the optimal quantiser has its points (Panter and Dite 1951). Evenly spaced terms
would be wasted on a range that is mostly empty. The outer terms stand at quantiles, not at the
outermost rows.
"""

import numpy as np

from ..antecedent import GridAntecedent
from ..learning.data import StandardisedData
from .sample import DIGITS, representative_rows, weighted_quantile

# Neighbouring terms cross at this membership at the start. With the customary 0.5, training on
# Jang's sinc gets stuck; elsewhere it makes little difference.
OVERLAP = 0.6
# This part of the rows lies beyond the outermost terms: a term should not stand at an outlier, and
# a term at the very edge would be half empty.
_EDGE = 0.02


class Spacing:
    """Where the terms of an input stand, for any number of them."""

    def __init__(self, rows: StandardisedData):
        table, weight, _ = representative_rows(rows)
        ends = np.transpose(rows.inputs.box)
        columns = zip(table[:, : len(ends)].T, ends, strict=True)
        self._columns = [_levels(column, weight, own) for column, own in columns]
        self._centers: dict[tuple[int, int], np.ndarray] = {}  # that were asked for already

    def n_values(self, j):
        """Distinct values of an input between its outer quantiles: more terms are of no use."""
        return self._columns[j][0].size

    def centers(self, j, count):
        """Places of ``count`` terms on input ``j``, standardised; not to be changed."""
        if (j, count) not in self._centers:
            values, levels = self._columns[j]
            self._centers[j, count] = np.interp(np.linspace(0.0, 1.0, count), levels, values)
        return self._centers[j, count]


def _levels(column, weight, ends):
    """Values between the outer quantiles, and G there, from 0 to 1; ``ends`` are of all rows."""
    column = np.round(column, DIGITS)  # values that differ by rounding alone are one
    low, high = (weighted_quantile(column, weight, _EDGE, side) for side in (1, -1))
    values = np.unique(column)
    if values.size == 1:
        # An input that varies on few rows may be constant in the sample.
        values = np.unique(ends)
    if low == high:
        low, high = values[[0, -1]]
    values = values[(values >= low) & (values <= high)]
    levels = np.concatenate([[0.0], np.cumsum(np.diff(values) ** (2.0 / 3.0))])
    return values, levels / max(levels[-1], np.finfo(float).tiny)


def grid_antecedent(families, counts, spacing: Spacing, known=None):
    """Terms by a :class:`Spacing`; neighbours cross at about membership ``OVERLAP``.

    ``families`` and ``counts`` have one entry per input. Inputs with a count of one have no terms:
    they take part in the consequents alone. If a ``known`` rule base has as many terms on an input,
    these are taken. If it has one term less, the new term goes into the widest gap.
    """
    terms = {} if known is None else terms_by_input(known)
    inputs = [j for j, count in enumerate(counts) if count > 1]
    thetas = []
    for j in inputs:
        if j in terms and terms[j].shape[1] == counts[j]:
            thetas.append(terms[j])
            continue
        if j in terms:
            places = np.sort(terms[j][0])
            widest = int(np.argmax(np.diff(places)))
            centers = np.insert(places, widest + 1, places[widest : widest + 2].mean())
        else:
            centers = spacing.centers(j, counts[j])
        thetas.append(families[j].start(centers, _distance(np.diff(centers)), OVERLAP))
    return GridAntecedent.build([families[j] for j in inputs], inputs, thetas)


def _distance(gaps):
    """Each term's mean distance to its neighbours; an outermost term has only one."""
    return 0.5 * (np.append(gaps, gaps[-1]) + np.append(gaps[0], gaps))


def terms_by_input(antecedent):
    """Parameters of the terms, by input; inputs without terms are left out."""
    return {
        int(j): group.theta[:, group.inputs == j]
        for group in antecedent.groups
        for j in np.unique(group.inputs)
    }
