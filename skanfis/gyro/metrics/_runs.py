"""The runs of a log: their rows, and the mean errors within them."""

import numpy as np

from .._columns import check_labels

__all__ = ["rows_by_run"]


def rows_by_run(run, n_rows, at_least=2):
    """Positions of the rows of each run, in order of appearance."""
    if run is None:
        return [np.arange(n_rows)]
    labels = check_labels(run, "run", n_rows)
    _, first, place = np.unique(labels, return_index=True, return_inverse=True)
    if first.size < at_least:
        raise ValueError(f"There is {first.size} run; at least {at_least} are needed.")
    order = np.argsort(place, kind="stable")
    rows = np.split(order, np.cumsum(np.bincount(place))[:-1])
    return [rows[i] for i in np.argsort(first)]
