r"""The linear THEN parts of the rules, and the regression that finds them.

A rule's consequent is f_r(z) = beta_r . b(z) with the basis b(z) = [1, z_1, ..., z_d] (order 1) or
[1] (order 0). The design has one column per rule and basis function, Phi_(r, i) = w_r b_i, ordered
by rule. Like all arrays with an entry per row, it is transposed, shape (n_columns, n_rows).

Far from the origin the columns w_r and w_r z_j are nearly parallel. Each rule therefore has a
*local basis*, centred and scaled where it fires, [1, (z_j - a_rj) / h_rj], with a and h the mean
and standard deviation of z_j weighted by w_r. Phi_local = Phi T with T block diagonal. The Gram
matrix is transformed, not the design, and the penalty acts on the local coefficients. T is fixed at
the start of training, so that the objective stays the same function throughout.

Since sum_r w_r = 1, the moments behind a and h are row sums of the Gram matrix itself:
sum_r' G[(r, i), (r', j)] = sum over rows of s w_r b_i b_j, where b_j is 1 or z_j.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

# Least h, in standard deviations of the input: a rule that fires on one spot has no spread.
_SMALLEST_SPREAD = 0.05
# A rule with less than this part of the data's weight has no usable moments.
_SMALLEST_MASS = 1e-12
# A matrix without a Cholesky factor is shifted, ten times more each time: this many tries lead from
# rounding to the size of the matrix.
_MOST_SHIFTS = 20
# Beyond this many columns, operations on square matrices cost seconds: a search takes fewer steps,
# and traces are estimates.
MANY_COLUMNS = 512
# Vectors of random signs that estimate a trace to about 1 %.
_PROBES = 32
_EPS, _TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)


def basis(Z):
    """Rows [1, z_1, ..., z_d], shape (1 + n_inputs, n_rows); [1] without inputs."""
    return np.concatenate([np.ones((1, Z.shape[1])), Z])


def rule_outputs(coefficients, strengths, basis_rows):
    """w_r f_r (n_rules, n_rows) of one output and their sum; coefficients (n_rules, n_basis)."""
    weighted = coefficients @ basis_rows
    weighted *= strengths
    return weighted, weighted.sum(axis=0)


def outputs_of_rules(by_output, strengths, basis_rows):
    """Every output, (n_outputs, n_rows); coefficients (n_outputs, n_rules, n_basis)."""
    return np.stack([rule_outputs(one, strengths, basis_rows)[1] for one in by_output])


def in_user_units(coefficients, inputs, targets, slopes, order, common=(), masses=None):
    """Consequents about the inputs' means, from those on [1, z_slopes] of standardised data.

    Slopes that are ``common``, as in ``Penalty``, become equal to the last bit: their mean by the
    rules' ``masses``.
    """
    solved = coefficients.reshape(-1, 1 + slopes.size, targets.scale.size).copy()
    for j, rules in common:
        own = list(rules), 1 + int(np.flatnonzero(slopes == j)[0])
        solved[own] = np.average(solved[own], axis=0, weights=masses[own[0]])
    solved *= targets.scale
    solved[:, 0] += targets.offset
    if order == 0:
        return solved
    found = np.zeros((len(solved), 1 + inputs.scale.size, targets.scale.size))
    found[:, 0] = solved[:, 0]
    found[:, 1 + slopes] = solved[:, 1:] / inputs.scale[slopes, None]
    return found


def rule_masses(gram, n_rules):
    """Part of the data's weight on which each rule fires, from the Gram matrix of the design."""
    n_basis = gram.shape[0] // n_rules
    return gram[::n_basis, ::n_basis].sum(axis=1)


@dataclass(frozen=True, eq=False)
class LocalBasis:
    """Center a and spread h of every rule's own basis, each (n_rules, n_basis - 1)."""

    center: np.ndarray
    spread: np.ndarray

    @classmethod
    def from_gram(cls, gram, n_rules):
        """Weighted moments of the inputs under each rule, from Phi' S Phi / sum(s)."""
        n_basis = gram.shape[0] // n_rules
        blocks = gram.reshape(n_rules, n_basis, n_rules, n_basis)
        mass = rule_masses(gram, n_rules)
        fires = mass > _SMALLEST_MASS
        safe_mass = np.where(fires, mass, 1.0)[:, None]
        first = blocks[:, 1:, :, 0].sum(axis=2)
        second = np.stack([blocks[:, j, :, j].sum(axis=1) for j in range(n_basis)], axis=1)[:, 1:]
        center = np.where(fires[:, None], first / safe_mass, 0.0)
        variance = np.where(fires[:, None], second / safe_mass - center**2, 1.0)
        spread = np.sqrt(np.maximum(variance, _SMALLEST_SPREAD**2))
        return cls(center, spread)

    @property
    def n_basis(self):
        """Functions per rule."""
        return 1 + self.center.shape[1]

    def transform_rows(self, matrix):
        """T' M, in place; M has one row per column of Phi, or is an array of blocks by rule."""
        blocks = matrix.reshape(-1, self.n_basis, matrix.shape[-1])
        blocks[:, 1:] -= self.center[:, :, None] * blocks[:, :1]
        blocks[:, 1:] /= self.spread[:, :, None]
        return matrix

    def transform_gram(self, gram):
        """T' G T, a new array in C order."""
        half = self.transform_rows(gram.copy())
        return self.transform_rows(np.ascontiguousarray(half.T))

    def transform_blocks(self, blocks):
        """T_r' B_r T_r of every rule's own block, (n_rules, n_basis, n_basis); in place."""
        for half in (blocks, blocks.transpose(0, 2, 1)):
            self.transform_rows(half)
        return blocks

    def to_local(self, coefficients):
        """Coefficients on the local basis from those on [1, z], the inverse of to_global."""
        blocks = coefficients.reshape(-1, self.n_basis, coefficients.shape[1]).copy()
        blocks[:, 0] += np.einsum("rj,rjo->ro", self.center, blocks[:, 1:])
        blocks[:, 1:] *= self.spread[:, :, None]
        return blocks.reshape(coefficients.shape)

    def to_global(self, coefficients):
        """Coefficients on [1, z] from those on the local basis: T beta, (n_columns, n_outputs)."""
        blocks = coefficients.reshape(-1, self.n_basis, coefficients.shape[1]).copy()
        blocks[:, 1:] /= self.spread[:, :, None]
        blocks[:, 0] -= np.einsum("rj,rjo->ro", self.center, blocks[:, 1:])
        return blocks.reshape(coefficients.shape)


class NormalFactor:
    r"""The Cholesky factor L of G + P: the one factorisation behind solution and projector.

    Two different factorisations for them would make the reduced gradient wrong whenever two rules
    are alike, which is common here. ``shift`` times the identity is added, at the level of rounding
    (p eps max diag G), so that a singular matrix also has a solution, of small norm. With
    orthonormal columns E (``free``), solutions have the form E v, and L is the factor of
    E' (G + P) E.
    """

    def __init__(self, matrix, free=None):
        self._n, self._free = matrix.shape[0], free
        if free is not None:
            matrix = free.T @ matrix @ free
        floor = matrix.shape[0] * _EPS * np.diagonal(matrix).max(initial=0.0)
        self.shift = max(floor, _TINY)
        shifted = matrix.copy()
        shifted.flat[:: matrix.shape[0] + 1] += self.shift
        self._lower = self._factorise(shifted)

    def _factorise(self, shifted):
        for _ in range(_MOST_SHIFTS):
            lower, info = linalg.lapack.dpotrf(shifted, lower=1, clean=1)
            if info == 0:
                return lower
            # Rounding has made the shifted semi-definite matrix indefinite: shift further.
            shifted.flat[:: shifted.shape[0] + 1] += 9.0 * self.shift
            self.shift *= 10.0
        raise FloatingPointError("The normal equations of the consequents are not finite.")

    def solve(self, right_side):
        """(G + P)^-1 times right_side."""
        # LAPACK directly: the checks of scipy.linalg mostly take longer than the solution.
        found = linalg.lapack.dpotrs(self._lower, self._within(right_side), lower=1)[0]
        return found if self._free is None else self._free @ found

    def _within(self, columns):
        return columns if self._free is None else self._free.T @ columns

    def half_solve(self, right_side):
        """L^-1 times right_side, so that (.)' (.) is the quadratic form of the inverse."""
        return linalg.lapack.dtrtrs(self._lower, self._within(right_side), lower=1)[0]

    def back_solve(self, right_side):
        """L'^-1 times right_side."""
        found = linalg.lapack.dtrtrs(self._lower, right_side, lower=1, trans=1)[0]
        return found if self._free is None else self._free @ found

    def log_determinant(self):
        """log |G + P|."""
        return 2.0 * float(np.sum(np.log(np.diagonal(self._lower))))

    @cached_property
    def root(self):
        """L^-1; its product with many columns is faster than solving for them."""
        found = np.ascontiguousarray(linalg.lapack.dtrtri(self._lower, lower=1)[0])
        return found if self._free is None else found @ self._free.T

    def trace(self, matrix):
        """Tr (G + P)^-1 A for a symmetric A; an estimate if A is large (Hutchinson 1990)."""
        if matrix.shape[0] > MANY_COLUMNS:
            signs, solved = self._probes
            return float(np.vdot(solved, matrix @ signs)) / _PROBES
        return float(np.vdot(self.root @ matrix, self.root))

    def squares(self, rows):
        """The diagonal of R (G + P)^-1 R' for the rows of R; estimated as in ``trace``."""
        if rows.shape[1] > MANY_COLUMNS:
            signs, solved = self._probes
            return np.sum((rows @ solved) * (rows @ signs), axis=1) / _PROBES
        half = rows @ self.root.T
        return np.einsum("ij,ij->i", half, half)

    @cached_property
    def _probes(self):
        """Vectors of random signs, and the solutions for them."""
        n = self._n
        signs = np.random.default_rng(n).choice([-1.0, 1.0], size=(n, _PROBES))
        return signs, self.solve(signs)
