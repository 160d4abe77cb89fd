r"""How rules depart from their common line, in parts that each concern some inputs alone.

The departures delta = N u of all rules, in the value at their own centre and in their slopes, are a
table over the rules of a grid, (m_1, ..., m_d), and the functions of the basis. It is split as in
the analysis of variance, but in functions and not in cells: along the axis of every input with
terms by orthonormal contrasts, the first of which is the mean. What varies along the axes of the
inputs S, in the slope by input j, is a function of S and j together. So each contrast belongs to
one *component*,

    (j,)      how a rule's part of the output changes with input j alone,
    (i, j)    how that change depends on input i,
    ()        the rest: what concerns three inputs and more,

and |delta|^2 is the sum of the components' own. Scattered rules have no axes: there a component is
the values at the centres, (), or the slopes by an input, (j,).

Each component c has a pull of its own, alpha_c: sum_c alpha_c |delta_c|^2 = u' D' diag(alpha) D u
with D = H N, H the contrasts.
"""

from functools import cached_property
from itertools import product

import numpy as np
from scipy import linalg

from .antecedent import Antecedent

__all__ = ["Departures"]

# Beyond pairs nobody tells one interaction from another.
_MOST_INPUTS = 2


class Departures:
    """The departures N u of consequents in local coordinates u, N = S - Q A'.

    Parameters
    ----------
    scale : ndarray of shape (n_columns,)
        The diagonal of S.
    orthonormal, along : ndarray of shape (n_columns, n_basis)
        Q and A.
    antecedent : Antecedent
    slopes : list of (int or None)
        The input that each function of the basis but the first is a slope by; None where it is
        constant, and there is nothing to learn.

    Attributes
    ----------
    components : list of tuple of int
        The inputs that each component concerns; () for the rest.
    """

    def __init__(self, scale, orthonormal, along, antecedent: Antecedent, slopes):
        self._scale, self._orthonormal, self._along = scale, orthonormal, along
        self._counts = antecedent.grid_counts
        inputs = _inputs_of_departures(antecedent, slopes)
        self.components = sorted(set(inputs), key=lambda own: (own == (), len(own), own))
        place = {own: k for k, own in enumerate(self.components)}
        self._component = np.array([place[own] for own in inputs])

    @cached_property
    def together(self):
        """N' N, of all components alike."""
        return np.diag(self._scale**2) - self._along @ self._along.T

    @cached_property
    def matrix(self):
        """D, a departure in each row, (n_columns, n_columns)."""
        found = np.diag(self._scale) - self._orthonormal @ self._along.T
        if self._counts is None:
            return found
        contrasts = np.eye(1)
        for m in self._counts:
            contrasts = np.kron(contrasts, linalg.helmert(m, full=True))
        by_rule = found.reshape(contrasts.shape[0], -1)
        return np.ascontiguousarray((contrasts @ by_rule).reshape(found.shape))

    def pulled(self, weights):
        """D' diag(weights) D for a weight of every component, (n_columns, n_columns)."""
        rooted = np.sqrt(weights)[self._component, None] * self.matrix
        return rooted.T @ rooted

    def squares(self, coefficients):
        """|delta_c|^2 of every component, summed over outputs; local (n_columns, n_outputs)."""
        return self.products(coefficients, coefficients)

    def traces(self, inverse):
        """Traces of D_c M^-1 D_c' of every component, M^-1 a symmetric matrix."""
        return self._sums(np.sum((self.matrix @ inverse) * self.matrix, axis=1))

    def products(self, one, other):
        """Sums of delta_c of one times delta_c of the other, of every component; as ``squares``."""
        return self._sums(np.sum((self.matrix @ one) * (self.matrix @ other), axis=1))

    def _sums(self, values):
        return np.bincount(self._component, values, len(self.components))


def _inputs_of_departures(antecedent, slopes):
    """The inputs that each row of D concerns."""
    if antecedent.grid_counts is None:
        return [(), *(() if j is None else (j,) for j in slopes)] * antecedent.n_rules
    functions = [(), *((j,) for j in slopes)]
    axes = [int(j) for j in antecedent.share_inputs]
    contrasts = product(*map(range, antecedent.grid_counts))
    return [_concerned(axes, one, by) for one in contrasts for by in functions]


def _concerned(axes, contrast, by):
    """The inputs that a contrast along some axes concerns, in a value, (), or a slope, (j,)."""
    if None in by:
        return ()
    along = {j for j, varies in zip(axes, contrast, strict=True) if varies}
    inputs = along.union(by)
    # A slope by an input without terms, the same for all rules, is the line's but for rounding.
    is_own = len(inputs) <= _MOST_INPUTS and (along or inputs <= set(axes))
    return tuple(sorted(inputs)) if is_own else ()
