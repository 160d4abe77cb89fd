"""Rows out of the range, by the inputs that they leave it along: which lie on one line or face.

See ``faces`` for what these are. An input with terms counts by its side; inputs without terms, any
number of them, count as one.
"""

import numpy as np

from .antecedent import Antecedent

__all__ = ["on_faces", "sorted_by_face"]

# Rows of a block on one face, from which on its tables are worth their while.
_ENOUGH = 64
# Columns of the design up to which there are any: they are kept, half a megabyte of each face.
_MOST_COLUMNS = 512
# Inputs with terms that rows of a face leave the range by: of more there are few rows on each.
_MOST_AWAY = 5
# Inputs with terms of a block up to which their sides make one number, exactly.
_MOST_SIDES = 32
# Those that rows are sorted by: their sides make a number of 16 bits.
_MOST_SORTED = 9


def sorted_by_face(X, antecedent: Antecedent, minimum, maximum):
    """An order of rows X (n_rows, n_inputs) out of the range, those on one face together.

    Blocks of such rows have few faces, each of many rows.
    """
    if None in antecedent.share_inputs:
        return np.arange(len(X))
    used = _inputs_with_terms(antecedent)[:_MOST_SORTED]
    numbers = np.zeros(len(X), dtype=np.int16)
    for column, low, high in zip(X[:, used].T.copy(), minimum[used], maximum[used], strict=True):
        numbers *= 3
        numbers += column > high
        numbers -= column < low
    if (numbers == numbers[0]).all():
        return np.arange(len(X))
    return np.argsort(numbers, kind="stable")


def on_faces(way, antecedent: Antecedent, n_columns):
    """Rows on a line, (None, rows, ...), and on each face, (((input, side), ...), rows, others).

    ``others`` is whether these rows leave the range along inputs without terms too. Rows are those
    of faces on which there are enough. ``way`` (n_inputs, n_rows) leads from the range to the rows;
    of a design of ``n_columns``.
    """
    with_terms = _inputs_with_terms(antecedent)
    ways = way[with_terms]
    outside = ways != 0.0
    n_away = outside.sum(axis=0)
    rows = np.flatnonzero(n_away == 0)
    if rows.size:
        yield None, rows, True
    used = np.flatnonzero(outside.any(axis=1))
    if n_columns > _MOST_COLUMNS or None in antecedent.share_inputs or used.size > _MOST_SIDES:
        return
    rows = np.flatnonzero((n_away > 0) & (n_away <= _MOST_AWAY))
    sides = np.sign(ways[used][:, rows])
    # Of rows that stay in the range along all others fewer products are asked for.
    others = np.delete(way, with_terms, axis=0).any(axis=0)[rows]
    numbers = 3.0 ** np.arange(used.size) @ sides + 3.0**used.size * others
    while rows.size >= _ENOUGH:
        own = numbers == numbers[0]
        if np.count_nonzero(own) >= _ENOUGH:
            away = zip(with_terms[used].tolist(), sides[:, 0].astype(int).tolist(), strict=True)
            yield tuple((j, side) for j, side in away if side), rows[own], bool(others[0])
        if own.all():
            return
        rows, sides, others, numbers = rows[~own], sides[:, ~own], others[~own], numbers[~own]


def _inputs_with_terms(antecedent):
    return np.unique(np.concatenate([[], *(g.inputs for g in antecedent.groups)])).astype(int)
