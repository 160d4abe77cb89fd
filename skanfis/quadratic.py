r"""A quadratic form of rows of the design, phi' A phi, out of few products.

Columns of the design are products of one share per factor of the rule base and one basis function
(see ``gram``), so that with the symmetric matrix A

    phi' A phi = sum_(moments) T_(i, j) l_i r_j ,

l and r products of pairs nu_k nu_l of every factor and of pairs of basis functions: one product
with a table T and one inner product per row.

The pairs of one factor are m (m + 1) / 2 functions, mostly of one input, and smooth: far fewer of
them span the others to rounding. Terms that lie far apart have a product of zero, and Gaussian
shares are near polynomials of a low degree. An interpolative decomposition (a QR decomposition with
column pivoting, Cheng et al. 2005) picks those that are kept and writes the others as their
combinations, which are folded into T: 6 x 6 terms need about 12 x 12 of their 21 x 21 pairs. What
is left out is measured in units of the form itself, at points spread evenly over the range.

Where four digits are enough, fewer combinations of the pairs do than there are pairs to keep. Of
pairs g(x) of one factor, and what the table and the others make of them, c, values are g' c. With
g = R' q, q orthonormal at the points, the left singular vectors U of R c, weighted as the values'
errors count, say which functions U' q the values need most: a higher-order singular value
decomposition (De Lathauwer et al. 2000), in the metric of the values.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import prod

import numpy as np
from scipy import linalg

__all__ = ["QuadraticForm", "row_products", "summed_with"]

# Pairs of a factor are compared at so many points for each of them at least, or all are kept.
_POINTS_PER_PAIR = 2


@dataclass(frozen=True, eq=False)
class QuadraticForm:
    """Phi' A phi by a table over kept pairs of every factor, the basis the last of them.

    ``counts`` are the functions of every factor; ``pairs`` holds for each factor the two columns of
    each pair, (2, n_kept); ``table`` has those of the first ``split`` factors along its rows, of
    the others along its columns; of several forms a table each. ``turns`` are the combinations of
    each factor's pairs that the table is over, (n_functions, n_kept), or None of the pairs
    themselves.
    """

    counts: tuple[int, ...]
    pairs: tuple[np.ndarray, ...]
    table: np.ndarray
    split: int
    turns: tuple[np.ndarray | None, ...]

    @classmethod
    def of(cls, matrix, counts, n_basis):
        """Of a symmetric matrix (n_columns, n_columns), for shares and basis functions.

        Or of several, (n_forms, n_columns, n_columns), whose values are found together.
        """
        lengths = (*counts, n_basis)
        pairs = [np.stack(np.triu_indices(length)) for length in lengths]
        return cls._of_table(lengths, pairs, _paired(matrix, lengths, lengths))

    @classmethod
    def between(cls, matrix, counts, n_basis):
        """Of phi' A psi, A any matrix: psi has the same shares and another basis."""
        pairs = [np.stack(np.triu_indices(length)) for length in counts]
        pairs.append(np.indices((n_basis, n_basis)).reshape(2, -1))
        return cls._of_table((*counts, n_basis), pairs, _paired(matrix, (*counts, n_basis), counts))

    @classmethod
    def _of_table(cls, counts, pairs, table, turns=None):
        """With rows and columns shared out so that fewest products are formed."""
        lead, sizes = table.shape[: -len(counts)], table.shape[-len(counts) :]
        split = min(range(len(sizes)), key=lambda k: prod(sizes[:k]) + prod(sizes[k:]))
        table = np.ascontiguousarray(table).reshape(*lead, prod(sizes[:split]), -1)
        return cls(counts, tuple(pairs), table, split, tuple(turns or [None] * len(counts)))

    def astype(self, dtype):
        """The same in another precision."""
        with np.errstate(over="ignore", under="ignore"):
            turns = tuple(None if turn is None else turn.astype(dtype) for turn in self.turns)
            return replace(self, table=self.table.astype(dtype), turns=turns)

    def values(self, shares, basis_rows):
        """Phi' A phi of every row, (n_rows,) or (n_forms, n_rows); shares (n_shares, n_rows).

        Products are formed of one side of the table; with the groups of the other it is summed up
        one by one, which costs less than to form their products. Of several forms products are
        formed once, and sums for each: the longer side is the one formed then.
        """
        groups = self._groups(shares, basis_rows)
        formed, summed, table = groups[self.split :], groups[: self.split], self.table
        n_summed, n_formed = table.shape[-2:]
        if (n_summed < n_formed) == (table.ndim == 2):
            formed, summed, table = summed, formed, np.swapaxes(table, -1, -2)
        return summed_with(table @ row_products(formed, basis_rows), summed)[..., 0, :]

    def products(self, shares, basis_rows, others):
        """Phi' A phi, phi' A psi and psi' A psi of every row, (3, n_rows).

        Psi has the same shares and other basis functions; the basis is never along the rows.
        """
        *groups, _ = self._groups(shares, basis_rows)
        along = self._along(groups, basis_rows)
        i, j = self.pairs[-1]
        own, other = (basis_rows[i], basis_rows[j]), (others[i], others[j])
        both = 0.5 * (own[0] * other[1] + own[1] * other[0])
        rights = own[0] * own[1], both, other[0] * other[1]
        return np.stack([np.einsum("bn,bn->n", right, along) for right in rights])

    def summed_between(self, weights, shares, basis_rows, others):
        """Of several forms ``between`` rows the weighted sum phi' A psi, (n_rows,).

        ``weights`` (n_forms, n_rows) of every form.
        """
        *groups, _ = self._groups(shares, basis_rows)
        formed = row_products([weights, *groups], basis_rows)
        pairs = row_products([basis_rows, others], basis_rows)
        return np.einsum("bn,bn->n", pairs, self.table.reshape(len(formed), -1).T @ formed)

    def _along(self, groups, like):
        """The table summed with the groups of shares: of each pair of basis functions the factor.

        First with those along its rows, then with the others: their products with the pairs of
        basis functions need not be formed.
        """
        along = np.swapaxes(self.table, -1, -2) @ row_products(groups[: self.split], like)
        if self.split == len(groups):
            return along
        middle = row_products(groups[self.split :], like)
        along = along.reshape(*along.shape[:-2], len(middle), -1, like.shape[1])
        return np.einsum("...mbn,mn->...bn", along, middle)

    def shortened(self, shares, basis_rows, tol):
        """The same up to ``tol`` for every factor, root mean square at given rows, in fewer pairs.

        Rows are to lie all over the range, and in it.
        """
        groups, pairs = self._groups(shares, basis_rows), list(self.pairs)
        table = self.table.reshape([len(group) for group in groups])
        for k, group in enumerate(groups[:-1]):
            if _POINTS_PER_PAIR * len(group) > basis_rows.shape[1]:
                continue
            rest = row_products(groups[:k] + groups[k + 1 :], basis_rows)
            first = np.moveaxis(table, k, 0)
            weights = np.abs(first.reshape(len(group), -1) @ rest).max(axis=1)
            kept, combined = _spanning(group, weights, tol)
            table = np.moveaxis(np.tensordot(combined, first, axes=(0, 0)), 0, k)
            groups[k], pairs[k] = group[kept], pairs[k][:, kept]
        return self._of_table(self.counts, pairs, table)

    def turned(self, shares, basis_rows, weights, tol):
        """The same up to ``tol`` for every factor, in fewer combinations of the pairs.

        Root mean square of the values' errors times ``weights`` (n_rows,), at given rows that lie
        all over the range; where forming the combinations costs less than it saves.
        """
        groups, turns = self._groups(shares, basis_rows), list(self.turns)
        table = self.table.reshape([len(group) for group in groups])
        for k, group in enumerate(groups[:-1]):
            n_pairs, n_others = len(group), table.size // len(group)
            if _POINTS_PER_PAIR * n_pairs > basis_rows.shape[1]:
                continue
            rest = row_products(groups[:k] + groups[k + 1 :], basis_rows)
            first = np.moveaxis(table, k, 0)
            turn, back = _turned(group, first.reshape(n_pairs, -1) @ rest * weights, tol)
            if len(turn) * (n_pairs + n_others) < n_pairs * n_others:
                table = np.moveaxis(np.tensordot(back, first, axes=(0, 0)), 0, k)
                groups[k], turns[k] = turn @ group, turn
        return self._of_table(self.counts, self.pairs, table, turns)

    def _groups(self, shares, basis_rows):
        groups, start = [], 0
        for count, runs in zip(self.counts[:-1], self._runs[:-1], strict=True):
            groups.append(_pair_products(shares[start : start + count], runs))
            start += count
        groups.append(_pair_products(basis_rows, self._runs[-1]))
        return [
            one if turn is None else turn @ one
            for one, turn in zip(groups, self.turns, strict=True)
        ]

    @cached_property
    def _runs(self):
        """Pairs of every factor, those of one function with consecutive others together."""
        return [_runs_of(*own) for own in self.pairs]


def _paired(matrices, lengths, symmetric):
    """Matrices (..., n_columns, n_columns) as tables over pairs of every factor's functions.

    Of the first factors, as many as are in ``symmetric``, pairs that differ in their order alone
    are one.
    """
    *lead, _, _ = matrices.shape
    n, before = len(lengths), len(lead)
    table = matrices.reshape(*lead, *lengths, *lengths)
    axes = [before + axis for k in range(n) for axis in (k, n + k)]
    table = table.transpose([*range(before), *axes])
    table = table.reshape([*lead, *(length**2 for length in lengths)])
    for k, length in enumerate(symmetric, start=before):
        i, j = np.triu_indices(length)
        shape = [1] * table.ndim
        shape[k] = len(i)
        others = (i != j).astype(table.dtype).reshape(shape)
        table = np.take(table, i * length + j, k) + others * np.take(table, j * length + i, k)
    return table


def _runs_of(first, second):
    """Runs of pairs with the same first function: this, slices of the second ones and of places."""
    starts = np.flatnonzero((np.diff(first) != 0) | (np.diff(second) != 1)) + 1
    ends = [0, *starts.tolist(), len(first)]
    return [
        (int(first[a]), slice(int(second[a]), int(second[b - 1]) + 1), slice(a, b))
        for a, b in pairwise(ends)
    ]


def _pair_products(functions, runs):
    """Products of pairs of functions (n, n_rows): no copy of these is made."""
    products = np.empty((runs[-1][2].stop, functions.shape[1]), functions.dtype)
    for first, second, place in runs:
        np.multiply(functions[first], functions[second], out=products[place])
    return products


def row_products(groups, like):
    """Products of one row of each group, all combinations, the last group's row fastest."""
    result = groups[0] if groups else np.ones((1, like.shape[1]), like.dtype)
    for group in groups[1:]:
        result = (result[:, None, :] * group).reshape(-1, like.shape[1])
    return result


def summed_with(values, groups):
    """Sums over products of one row of each group, times values (..., n * n_products, n_rows).

    One group after the other: the products are not formed. (..., n, n_rows) are left.
    """
    for group in reversed(groups):
        by_group = values.reshape(*values.shape[:-2], -1, *group.shape)
        values = np.einsum("...mgn,gn->...mn", by_group, group)
    return values


def _spanning(functions, weights, tol):
    """Some of the functions (n, n_points), by number, and all as their combinations, (n, n_kept).

    Of every function its weight times the root mean square of what is left out counts, and the sum
    of these stays within ``tol``.
    """
    n, n_points = functions.shape
    weights = np.maximum(weights, np.finfo(float).tiny)
    scaled = functions * (weights / np.sqrt(n_points))[:, None]
    triangle, order = linalg.qr(scaled.T, mode="r", pivoting=True)
    triangle = triangle[:n]
    # Column norms of what is under each row: what is left of all that come after it.
    left = np.sqrt(np.cumsum((triangle**2)[::-1], axis=0)[::-1]).sum(axis=1)
    n_kept = max(int(np.count_nonzero(left > tol)), 1)
    kept = np.sort(order[:n_kept])
    place = np.argsort(order[:n_kept])
    combined = np.zeros((n, n_kept))
    combined[order[:n_kept], np.argsort(place)] = 1.0
    dropped = order[n_kept:]
    if dropped.size:
        solved = linalg.solve_triangular(triangle[:n_kept, :n_kept], triangle[:n_kept, n_kept:])
        back = (solved * weights[order[:n_kept], None] / weights[dropped]).T
        combined[dropped] = back[:, place]
    return kept, combined


def _turned(functions, factors, tol):
    """Combinations of functions (n, n_points), (n_kept, n), and all by these, (n, n_kept).

    Of sums of the functions times ``factors`` (n, n_points), at other points, as much is left out
    as leaves their root mean square within ``tol``.
    """
    root_n = np.sqrt(functions.shape[1])
    left, sizes, _ = np.linalg.svd(functions / root_n, full_matrices=False)
    is_there = sizes > np.finfo(float).eps * len(functions) * sizes[0]
    left, sizes = left[:, is_there], sizes[is_there]
    scaled = (sizes[:, None] * left.T) @ factors / root_n
    turn, parts, _ = np.linalg.svd(scaled, full_matrices=False)
    rest = np.sqrt(np.cumsum(parts[::-1] ** 2)[::-1])
    turn = turn[:, : max(int(np.count_nonzero(rest > tol)), 1)]
    return (turn.T / sizes) @ left.T, (left * sizes) @ turn
