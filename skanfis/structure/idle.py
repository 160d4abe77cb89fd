"""Terms that are hardly true on any row: names for nothing that was seen."""

import numpy as np

from ..antecedent import Antecedent
from ..blocks import BLOCK_ROWS
from ..data import StandardisedData
from ..membership import LEAST_TRUTH

__all__ = ["has_idle_term"]


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
