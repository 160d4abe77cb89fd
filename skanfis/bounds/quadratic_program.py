"""The nearest consequents that keep linear constraints.

They minimise (u - u0)' M (u - u0) subject to E u = e and G u >= h, M = L L' being the matrix of the
normal equations. In v = L' (u - u0), a QR factorisation eliminates equalities; the rest is
least-distance programming by non-negative least squares (Lawson and Hanson 1974, chapter 23).
"""

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from ..consequent import NormalFactor

# Distances, and lengths relative to a row's own, that count as zero below this.
_ZERO = 1e-10
# Most rounds of the exchange.
_MOST_ROUNDS = 1000


class InfeasibleError(Exception):
    """No consequents keep the constraints."""


def nearest(factor: NormalFactor, start, equal, equal_to, at_least, least):
    """The u nearest to ``start`` with E u = e and G u >= h, and which inequalities are active."""
    half = factor.half_solve(at_least.T)
    base, toward = np.empty((len(half), 0)), np.empty(0)
    if equal.size:
        # The rows of E that others imply are left out, if e agrees.
        base, triangle, order = qr(factor.half_solve(equal.T), mode="economic", pivoting=True)
        sizes, asked = np.abs(np.diagonal(triangle)), (equal_to - equal @ start)[order]
        rank = np.count_nonzero(sizes > _ZERO * sizes[0])
        base, triangle = base[:, :rank], triangle[:rank]
        toward = solve_triangular(triangle[:, :rank], asked[:rank], trans="T")
        if (np.abs(triangle.T @ toward - asked) > _ZERO * (1.0 + np.abs(asked))).any():
            raise InfeasibleError
    short = least - at_least @ start - half.T @ (base @ toward)
    free = half - base @ (base.T @ half)
    length = np.sqrt(np.sum(free**2, axis=0))
    # No u changes these inequalities, given the equalities: if one fails, nothing helps.
    fixed = length <= _ZERO * np.sqrt(np.sum(half**2, axis=0)) + np.finfo(float).tiny
    if (short[fixed] > _ZERO * (1.0 + np.abs(least[fixed]))).any():
        raise InfeasibleError
    multipliers = np.zeros(least.size)
    kept = ~fixed
    if (short[kept] > 0.0).any():
        found = _least_distance(free[:, kept] / length[kept], short[kept] / length[kept])
        multipliers[kept] = found / length[kept]
    step = base @ toward + free @ multipliers
    return start + factor.back_solve(step), multipliers > 0.0


def nearest_by_exchange(factor, start, equal, equal_to, at_least, least, violated):
    """The same with inequalities that are added when they are violated, on top of those given.

    ``violated`` returns the rows of G, and of h, that a u violates; none if it keeps all.
    """
    n_given = len(least)
    for _ in range(_MOST_ROUNDS):
        solved, holds_back = nearest(factor, start, equal, equal_to, at_least, least)
        more, least_of_more = violated(solved)
        if not len(more):
            return solved
        # Inactive ones are dropped, and may come back. The distance grows, so this ends.
        kept = holds_back | (np.arange(len(least)) < n_given)
        at_least = np.vstack([at_least[kept], more])
        least = np.append(least[kept], least_of_more)
    raise InfeasibleError


def _least_distance(columns, short):
    """Multipliers of the shortest t with columns' t >= short."""
    scale = short.max()
    rows = np.vstack([columns, short / scale])
    target = np.zeros(rows.shape[0])
    target[-1] = 1.0
    multipliers, distance = nnls(rows, target, maxiter=30 * max(rows.shape))
    rest = 1.0 - (short / scale) @ multipliers
    if distance <= _ZERO or rest <= _ZERO**2:
        raise InfeasibleError
    return scale * multipliers / rest
