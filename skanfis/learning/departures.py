r"""How rules depart from their common line, in parts that each concern some inputs alone.

The departures delta = N u of all rules, in the value at their own centre and in their slopes, are a
table over the rules of a grid, (m_1, ..., m_d), and the functions of the basis. Along the axis of
every input with terms it is split by orthonormal contrasts, the first of which is the mean. What
varies along the axes of the inputs S, in the slope by input j, is a function of S and j together.
So each contrast belongs to one *component*,

    (j,)      how a rule's part of the output changes with input j alone,
    (i, j)    how that change depends on input i,
    ()        the rest: what concerns three inputs and more,

and |delta|^2 is the sum of the components' own. Scattered rules have no axes: there a component is
the values at the centres, (), or the slopes by an input, (j,). With a pull alpha_c on each, they
pay u' D' diag(alpha) D u, D = H N, H the contrasts.
"""

from functools import lru_cache
from itertools import product

import numpy as np
from scipy import linalg

from ..antecedent import Antecedent

# Beyond pairs nobody tells one interaction from another.
_MOST_INPUTS = 2


def departures(matrix, antecedent: Antecedent, slopes):
    """D, a departure in each row; all components; and which of these each row belongs to, by place.

    ``matrix`` (n_columns, n_columns) is N; ``slopes`` are the inputs that the functions of the
    basis but the first are slopes by, None where one is constant, and there is nothing to learn.
    A component is the inputs that it concerns, () for the rest.
    """
    counts, axes = antecedent.grid_counts, antecedent.inputs_with_terms
    components, component = _components(counts, axes, antecedent.n_rules, tuple(slopes))
    if counts is None:
        return matrix, components, component
    contrasts = np.eye(1)
    for m in counts:
        contrasts = np.kron(contrasts, linalg.helmert(m, full=True))
    by_rule = contrasts @ matrix.reshape(contrasts.shape[0], -1)
    return np.ascontiguousarray(by_rule.reshape(matrix.shape)), components, component


@lru_cache(maxsize=64)
def _components(counts, axes, n_rules, slopes):
    """All components, and which of them each row of D belongs to; not to be changed."""
    functions = [(), *((j,) for j in slopes)]
    if counts is None:
        # Of scattered rules; by an input that is constant there is nothing to learn.
        inputs = [() if None in by else by for by in functions] * n_rules
    else:
        contrasts = product(*map(range, counts))
        inputs = [_concerned(axes, one, by) for one in contrasts for by in functions]
    found = sorted(set(inputs), key=lambda own: (own == (), len(own), own))
    place = {own: k for k, own in enumerate(found)}
    return found, np.array([place[own] for own in inputs])


def _concerned(axes, contrast, by):
    """The inputs that a contrast along some axes concerns, in a value, (), or a slope, (j,)."""
    if None in by:
        return ()
    along = {j for j, varies in zip(axes, contrast, strict=True) if varies}
    inputs = along.union(by)
    # A slope by an input without terms, the same for all rules, is the line's but for rounding.
    is_own = len(inputs) <= _MOST_INPUTS and (along or inputs <= set(axes))
    return tuple(sorted(inputs)) if is_own else ()
