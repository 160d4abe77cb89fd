r"""The error of groups that are left out: of a new run, device or day.

With A = W^-1/2 L^-1 Phi_g' S_g^1/2 the scaled design of a group of rows, of the factor L of the
normal equations of all, and r the residuals of all times S_g^1/2, the residuals of a fit without
the group are, by the Sherman-Morrison-Woodbury formula,

    e = (I - A'A)^-1 r ,      |e|^2 = |r|^2 + sum_j (2 - l_j) / (1 - l_j)^2 (u_j' A r)^2 ,

l_j and u_j the eigenvalues and eigenvectors of AA'. The first is taken where the group has fewer
rows than there are coefficients, the second where it has more. What is held in L'u (see
``constraints``) is orthogonal to what moves: it is projected out of A.
"""

import numpy as np

from ..blocks import fitting_rows, row_blocks

__all__ = ["leave_group_out_error"]

# Of what a group has to itself.
_SMALLEST_FREEDOM = 1e-6


def leave_group_out_error(problem, evaluation, held):
    """Mean squared error of leaving out each group of rows, at fixed premises, summed over outputs.

    Parameters
    ----------
    problem : SeparableProblem
        Whose rows have groups.
    evaluation : Evaluation
        With its normal equations.
    held : sequence of ndarray of shape (n_columns, n_held)
        Of every output orthonormal columns of what stays as it is.
    """
    groups = problem.rows.groups
    order = np.argsort(groups, kind="stable")
    ends = np.flatnonzero(np.diff(groups[order])) + 1
    total = sum(_squares(problem, evaluation, held, own) for own in np.split(order, ends))
    return float(total / problem.rows.total_weight)


def _squares(problem, evaluation, held, rows):
    """Sum of the squared errors of some rows, by weight, of consequents found without them."""
    if rows.size <= problem.n_columns:
        half, residual = _scaled(problem, evaluation, rows)
        return sum(
            _of_few(_without(own, half), one) for own, one in zip(held, residual, strict=True)
        )
    n_columns, squares = problem.n_columns, 0.0
    gram, right = np.zeros((n_columns, n_columns)), np.zeros((n_columns, len(held)))
    for part in row_blocks(rows.size, fitting_rows(n_columns)):
        half, residual = _scaled(problem, evaluation, rows[part])
        gram += half @ half.T
        right += half @ residual.T
        squares += np.sum(residual**2)
    for own, one in zip(held, right.T, strict=True):
        squares += _of_many(_without(own, _without(own, gram).T), _without(own, one))
    return squares


def _scaled(problem, evaluation, rows):
    """A and r of some rows."""
    residual, weight = problem.residual(evaluation, rows)
    root = 1.0 if weight is None else np.sqrt(weight)
    return problem.half(evaluation, rows) * root, residual * root


def _without(held, columns):
    return columns - held @ (held.T @ columns)


def _of_few(half, residual):
    values, vectors = np.linalg.eigh(half.T @ half)
    return np.sum((vectors.T @ residual / _freedom(values)) ** 2)


def _of_many(gram, right):
    """What is added to the squares of all rows' fit."""
    values, vectors = np.linalg.eigh(gram)
    free = _freedom(values)
    return np.sum((1.0 + free) * (vectors.T @ right / free) ** 2)


def _freedom(values):
    return np.maximum(1.0 - values, _SMALLEST_FREEDOM)
