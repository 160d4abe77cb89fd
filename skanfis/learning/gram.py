r"""The Gram matrix of the design, from fewer products than the design has pairs of columns.

Columns of Phi are products of one share per *factor* of the rule base and one basis function,

    Phi_(k1 .. kd, i) = nu_(1, k1) ... nu_(d, kd) b_i .

A grid has one factor per input with terms. Scattered rules are a single factor whose shares are the
strengths. An entry of Phi' S Phi is therefore a moment of an unordered pair of shares for each
factor, and an unordered pair of basis functions,

    sum over rows of  s (nu_1k1 nu_1l1) ... (nu_dkd nu_dld) (b_i b_j) .

3 x 3 x 3 rules on three inputs have 2,160 moments, where the symmetric product of the design
(dsyrk) takes 5,886. The pairs are split into two groups of about equal size, each group's products
are formed row by row, and one general matrix product gives all moments. The matrix is put together
from the moments once per pass, factor by factor.
"""

from functools import cache
from math import prod

import numpy as np

from ..antecedent.base import combinations, pieces


def pairs(rows, others):
    """Products rows_i * others_j for all j >= i, (n (n + 1) / 2, n_rows)."""
    n = rows.shape[0]
    out = np.empty((n * (n + 1) // 2, rows.shape[1]), rows.dtype)
    start = 0
    for i in range(n):
        stop = start + n - i
        np.multiply(rows[i], others[i:], out=out[start:stop])
        start = stop
    return out


@cache
def pair_index(n):
    """The row of :func:`pairs` that holds (i, j) and (j, i), (n, n); cached, not to be changed."""
    index = np.zeros((n, n), dtype=np.int32)
    index[np.triu_indices(n)] = np.arange(n * (n + 1) // 2)
    return np.maximum(index, index.T)


class DesignMoments:
    """The moments of one design, which add up over blocks of rows.

    ``counts`` are the numbers of shares per factor of the rule base, empty for a single rule;
    ``n_basis`` is the number of basis functions per rule.
    """

    def __init__(self, counts, n_basis):
        self._lengths = (*counts, n_basis)
        self._sizes = [n * (n + 1) // 2 for n in self._lengths]
        # The basis is always in the right group. The split with the fewest rows is the fastest.
        self._split = min(range(len(self._sizes)), key=lambda k: sum(self._rows(k)))

    def _rows(self, split):
        return prod(self._sizes[:split]), prod(self._sizes[split:])

    @property
    def shape(self):
        """Shape of the moments."""
        return self._rows(self._split)

    def of(self, shares, basis_rows, weighted_basis):
        """Moments of a block of rows: shares (n_shares, n_rows), basis plain and weighted."""
        factors = pieces(shares, self._lengths[:-1])
        groups = [*(pairs(own, own) for own in factors), pairs(weighted_basis, basis_rows)]
        left, right = groups[: self._split], groups[self._split :]
        # An empty left group is a row of ones, with which the basis begins.
        return combinations(left or [basis_rows[:1]]) @ combinations(right).T

    def gram(self, moments):
        """Phi' S Phi from the moments of all rows, (n_columns, n_columns)."""
        moments = moments.reshape(self._sizes)
        n_columns, axes = prod(self._lengths), range(0, 2 * len(self._lengths), 2)
        # From the last factor on, so that the pairs of those in front are still one axis each.
        for axis, length in reversed([*enumerate(self._lengths)]):
            moments = moments.take(pair_index(length), axis=axis)
        by_column = moments.transpose(*axes, *(axis + 1 for axis in axes))
        return by_column.reshape(n_columns, n_columns)
