r"""How rules depart from their common line, in components that each concern few inputs.

The departures delta = N u of all rules, in the value at their own centre and in their slopes, form
a table over the rules of a grid, (m_1, ..., m_d), and the basis functions. Orthonormal contrasts
split it along the axis of every input with terms; the first contrast is the mean. A contrast that
varies along the axes of the inputs S, in the slope by input j, concerns S and j together. So it
belongs to one *component*,

    (j,)      how the rules' part in the output changes with input j alone,
    (i, j)    how that change depends on input i,
    ()        the rest, which concerns three inputs and more,

and |delta|^2 is the sum over components. Scattered rules have no axes: there the components are the
values at the centres, (), and the slopes by each input, (j,). With a pull alpha_c on each, the
penalty is u' D' diag(alpha) D u, D = H N, H the contrasts.
"""

from functools import lru_cache
from itertools import product

import numpy as np
from scipy import linalg

from ..antecedent import Antecedent

# Interactions of more inputs than a pair are not told apart: no reader would.
_MOST_INPUTS = 2


def departures(matrix, antecedent: Antecedent, slopes):
    """D, with a departure in each row; all components; and the position of each row's component.

    ``matrix`` (n_columns, n_columns) is N. ``slopes`` are the inputs of all basis functions but the
    first, with None for a constant one, by which no slope can be learnt. A component is the tuple
    of inputs that it concerns, () for the rest.
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
    """All components, and the position of each row's component; cached, so not to be changed."""
    functions = [(), *((j,) for j in slopes)]
    if counts is None:
        # Scattered rules. A slope by a constant input cannot be learnt.
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
    # If all rules have one slope by an input without terms, they depart from it by rounding alone.
    is_own = len(inputs) <= _MOST_INPUTS and (along or inputs <= set(axes))
    return tuple(sorted(inputs)) if is_own else ()
