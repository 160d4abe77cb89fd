r"""Several starts: the reduced problem has many minima, and no start is the right one for all data.

The first start is the structure's own; every further one is displaced at random, so much in every
direction as steps go without leaving one arrangement of the terms for another (see ``premise`` for
the units). What is best is the smallest leave-one-out error of the linear part,

    mean of (r_i / (1 - h_i))^2 ,    h_i = phi_i' (Phi' S Phi + W P)^-1 phi_i ,

(Allen 1974; a row of weight s counts as s rows, of which one is left out), not the training error:
of two minima that meet the data alike, it prefers the one whose rules each rest on many rows.
"""

import numpy as np

__all__ = ["displaced_starts"]

# Standard deviation of a start's displacements: a third of a spacing, beyond which terms would swap
# places and the start would be another structure.
_SPREAD = 0.3


def displaced_starts(premise, first, n_starts, rng):
    """Displacements of ``n_starts`` starts, the first as given, within the premise's box."""
    starts = rng.normal(scale=_SPREAD, size=(n_starts, premise.size))
    starts[0] = 0.0 if first is None else first
    return np.clip(starts, premise.lower, premise.upper)
