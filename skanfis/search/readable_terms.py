"""Terms that mean something: true on some row, and not true wherever another one is."""

from itertools import pairwise

import numpy as np

from ..antecedent import Antecedent
from ..blocks import BLOCK_ROWS
from ..learning.data import StandardisedData
from ..membership import GREATEST_CROSSING, LEAST_TRUTH

__all__ = ["has_idle_term", "has_twin_terms"]

# Places in the range of an input where neighbours are looked at.
_PLACES = 401


def has_idle_term(rows: StandardisedData, antecedent: Antecedent) -> bool:
    """Whether some term's membership is below one half on every row."""
    greatest = np.full(antecedent.n_terms, -np.inf)
    for chunk in rows.chunks(BLOCK_ROWS):
        for part in chunk:
            Z, _, _ = rows.read(part)
            np.maximum(greatest, antecedent.log_memberships(Z).max(axis=1), out=greatest)
            if (greatest >= np.log(LEAST_TRUTH)).all():
                return False
    return True


def has_twin_terms(rows: StandardisedData, antecedent: Antecedent) -> bool:
    """Whether two neighbours of some input cross, within its range, above 0.9."""
    low, high = rows.inputs.box
    log_truth = antecedent.log_memberships(np.linspace(low, high, _PLACES, axis=1))
    for j in np.unique(antecedent.term_inputs):
        mine = np.flatnonzero(antecedent.term_inputs == j)
        mine = mine[np.argsort(antecedent.term_places[mine], kind="stable")]
        for left, right in pairwise(log_truth[mine]):
            if np.minimum(left, right).max() > np.log(GREATEST_CROSSING):
                return True
    return False
