"""Where every rule fires on the rows: sums that coverage, pruning and reports read."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..antecedent import Antecedent, strongest_rules
from ..antecedent.base import TOLD_APART
from ..blocks import add_each, fitting_rows
from ..consequent import basis
from ..support import RuleSupport
from .data import StandardisedData, fingerprint
from .gram import pair_index, pairs

# A rule fires on a row if it has at least this part of the strongest rule's strength there.
FIRES = 0.5


@dataclass(frozen=True, eq=False)
class RuleFiring:
    """How rules fire on a set of rows of weights s, in one pass over them."""

    overlap: np.ndarray  # sums of s w_r w_q, (n_rules, n_rules)
    second: np.ndarray  # sums of s w_r [1, z] [1, z]', (n_rules, 1 + n_inputs, 1 + n_inputs)
    strongest: np.ndarray  # weight of the rows on which each rule is the strongest
    peak: np.ndarray  # largest strength of each rule on any row
    n_distinct: np.ndarray  # distinct inputs on which each rule is the strongest, up to a limit

    @classmethod
    def of(cls, rows: StandardisedData, antecedent: Antecedent, enough: int):
        """From rows; distinct inputs are counted up to ``enough`` for each rule."""
        (overlap, products, strongest), peak, distinct = rows.reduce(
            partial(_sums, antecedent=antecedent, enough=enough), partial(_added, enough=enough)
        )
        second = products[:, pair_index(1 + rows.inputs.scale.size)]
        return cls(overlap, second, strongest, peak, np.array([len(own) for own in distinct]))


def rule_support(rows: StandardisedData, antecedent: Antecedent, n_coefficients: int, firing):
    """The :class:`RuleSupport` of every rule, in the rows' standardised units.

    ``firing`` is the :class:`RuleFiring` of the same rows, with distinct inputs counted up to
    ``n_coefficients``.
    """
    center, factor = places(firing.second, firing.n_distinct > 0)
    radius = rows.reduce(
        partial(_radii, antecedent=antecedent, center=center, factor=factor), np.maximum
    )
    return RuleSupport(firing.n_distinct / n_coefficients, center, factor, radius)


def places(second, is_known):
    """Means of the rows of each rule, and lower triangular W, W' W the inverse of their covariance.

    ``second`` are sums of s w_r [1, z] [1, z]'. A small variance is added in all directions. Both
    results are zero for rules that are not known.
    """
    known = np.asarray(is_known)[:, None, None]
    moments = known * second / np.maximum(second[:, :1, :1], np.finfo(float).tiny)
    center = moments[:, 0, 1:].copy()
    covariance = moments[:, 1:, 1:] - center[:, :, None] * center[:, None, :]
    # Rows may lie on a line or surface (two thermometers on one gyro). With some thickness, the
    # distance of a point off it stays finite.
    covariance += TOLD_APART**2 * np.eye(center.shape[1])
    return center, known * np.tril(np.linalg.inv(np.linalg.cholesky(covariance)))


def _sums(rows, antecedent, enough):
    """Sums over rows, largest strengths, and up to ``enough`` distinct inputs for every rule."""
    n_rules, n_basis = antecedent.n_rules, 1 + rows.X.shape[1]
    overlap, strongest, peak = np.zeros((n_rules, n_rules)), np.zeros(n_rules), np.zeros(n_rules)
    products = np.zeros((n_rules, n_basis * (n_basis + 1) // 2))
    distinct = [np.empty(0)] * n_rules
    for _, Z, _, weight in _blocks(rows, antecedent):
        strengths = antecedent.strengths(Z)
        best, numbers = strongest_rules(strengths), fingerprint(Z)
        for r in np.unique(best):
            if len(distinct[r]) < enough:
                distinct[r] = np.union1d(distinct[r], numbers[best == r])[:enough]
        strongest += np.bincount(best, weights=weight, minlength=n_rules)
        np.maximum(peak, strengths.max(axis=1), out=peak)
        weighted = strengths * weight
        overlap += weighted @ strengths.T
        basis_rows = basis(Z)
        products += weighted @ pairs(basis_rows, basis_rows).T
    return [overlap, products, strongest], peak, distinct


def _added(one, other, enough):
    """The results of two sets of rows merged, each distinct input once."""
    distinct = [np.union1d(a, b)[:enough] for a, b in zip(one[2], other[2], strict=True)]
    return add_each(one[0], other[0]), np.maximum(one[1], other[1]), distinct


def _radii(rows, antecedent, center, factor):
    """The largest distance at which each rule fires.

    Quadratic forms in [1, z], one product for all rules, find the farthest row of a block. The
    factor itself measures its distance, without the rounding errors of the product.
    """
    n_rules, n_inputs = center.shape
    affine = np.concatenate([-factor @ center[:, :, None], factor], axis=2)
    upper = np.triu_indices(1 + n_inputs)
    forms = (affine.transpose(0, 2, 1) @ affine)[:, *upper]
    forms[:, upper[0] != upper[1]] *= 2.0
    radius, every = np.zeros(n_rules), np.arange(n_rules)
    for _, Z, _, _ in _blocks(rows, antecedent):
        strengths = antecedent.strengths(Z)
        fires = strengths >= FIRES * strengths.max(axis=0)
        basis_rows = basis(Z)
        squares = forms @ pairs(basis_rows, basis_rows)
        squares *= fires
        farthest = squares.argmax(axis=1)
        away = np.einsum("rij,jr->ri", factor, Z[:, farthest] - center.T)
        distance = np.linalg.norm(away, axis=1)
        np.maximum(radius, distance, out=radius, where=fires[every, farthest])
    return radius


def _blocks(rows, antecedent):
    """Blocks of rows whose memberships and strengths take a bounded number of bytes."""
    n_basis = 1 + rows.X.shape[1]
    n_values = 3 * (antecedent.n_rules + antecedent.n_terms) + n_basis * (n_basis + 9) // 2
    return rows.blocks(fitting_rows(n_values))
