r"""How far the training data carry every rule: what coverage reads.

A rule is known as far as data determine it, and only near them. Three things are kept of each, all
from the rows on which it fires:

- its *share* min(1, N / P): N distinct inputs on which it is the strongest, for P coefficients;
- where they lie: the mean of all inputs and their covariance, weighted by the rule's strength and
  the rows' weights; the covariance sees that inputs go together, which no range of one input alone
  does;
- its *radius* D: how far from that mean, in Mahalanobis' distance, the farthest training row lies
  on which it has at least half of the strongest rule's say.

The covariance of standardised inputs has 0.1^2 added to its diagonal: rows on a line or a surface
(two thermometers on one gyro) keep some thickness, and the distance stays finite off it.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from .antecedent import Antecedent
from .blocks import fitting_rows, row_blocks
from .consequent import basis
from .learning.data import StandardisedData, fingerprint
from .learning.gram import pairs

__all__ = ["FIRES", "RuleFiring", "RuleSupport", "inverse_factor"]

# Standard deviation added to every standardised input.
_THICKNESS = 0.1
# A rule fires on the rows on which it has at least this part of the strongest rule's strength.
FIRES = 0.5


@dataclass(frozen=True, eq=False)
class RuleSupport:
    r"""Where the training data of every rule lie, and whether there are enough of them.

    A rule that is the strongest on no training row has share zero, and zeros elsewhere.

    Attributes
    ----------
    share : ndarray of shape (n_rules,)
        min(1, N / P), with N the number of distinct training inputs on which the rule is the
        strongest and P the number of its coefficients.
    center : ndarray of shape (n_rules, n_inputs)
        Mean of the inputs, weighted by the rule's strength, in the units of the inputs.
    factor : ndarray of shape (n_rules, n_inputs, n_inputs)
        Lower triangular; the distance of x from the centre m is d = |factor (x - m)|, Mahalanobis'
        distance.
    radius : ndarray of shape (n_rules,)
        The largest d of a training row on which the rule fires.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> t = np.linspace(-1.0, 1.0, 50)
    >>> model = ANFISRegressor(n_mfs=1).fit(np.column_stack([t, t]), t).model_
    >>> model.support.share
    array([1.])
    >>> model.coverage(np.array([[0.5, 0.5], [0.5, -0.5]])).round(6)
    array([1., 0.])
    """

    share: np.ndarray
    center: np.ndarray
    factor: np.ndarray
    radius: np.ndarray

    @classmethod
    def of(cls, rows: StandardisedData, antecedent: Antecedent, n_coefficients: int, firing=None):
        """The support of every rule, in the rows' standardised units, in a pass over them.

        ``firing`` is the :class:`RuleFiring` of the same rows, with distinct inputs counted up to
        ``n_coefficients``; where it is not given, it takes a pass of its own. Memory does not grow
        with the rows: of each rule, at most ``n_coefficients`` fingerprints of inputs are held.
        """
        firing = RuleFiring.of(rows, antecedent, n_coefficients) if firing is None else firing
        n_rules, n_inputs = antecedent.n_rules, firing.second.shape[1] - 1
        known = np.flatnonzero(firing.n_distinct)
        center, factor = np.zeros((n_rules, n_inputs)), np.zeros((n_rules, n_inputs, n_inputs))
        mass = firing.second[known, 0, 0]
        center[known] = firing.second[known, 0, 1:] / mass[:, None]
        squares = firing.second[known, 1:, 1:] / mass[:, None, None]
        factor[known] = inverse_factor(squares, center[known])
        radius = rows.reduce(
            partial(_radii, antecedent=antecedent, center=center, factor=factor), np.maximum
        )
        return cls(firing.n_distinct / n_coefficients, center, factor, radius)

    def change_units(self, offset, scale):
        """Return the same support for inputs given as offset + scale * z, per input."""
        return RuleSupport(
            self.share, offset + scale * self.center, self.factor / scale, self.radius
        )

    def reordered(self, order):
        """Return the same support with the inputs in another order."""
        if (np.diff(order) > 0).all():
            return self
        # Triangular again, with the same norms: the Q of a QR decomposition turns, no more.
        turned = np.asarray(np.linalg.qr(self.factor[:, :, order[::-1]], mode="r"))
        return RuleSupport(
            self.share, self.center[:, order], turned[:, ::-1, ::-1].copy(), self.radius
        )

    def by_rule(self, Z):
        """The share of each rule, falling with the distance from its data, (n_rules, n_rows).

        share exp(-max(0, d - D)^2 / 2) at points Z (n_inputs, n_rows) in the box.
        """
        found = np.zeros((self.share.size, Z.shape[1]))
        known = self.share > 0.0
        away = self.factor[known] @ (Z - self.center[known, :, None])
        distance = np.sqrt(np.einsum("rjn,rjn->rn", away, away))
        beyond = np.maximum(distance - self.radius[known, None], 0.0)
        found[known] = self.share[known, None] * np.exp(-0.5 * beyond**2)
        return found


@dataclass(frozen=True, eq=False)
class RuleFiring:
    """How rules fire on a set of rows, in one pass over them.

    Attributes
    ----------
    overlap : ndarray of shape (n_rules, n_rules)
        Sums of s w_r w_q, s the rows' weights.
    second : ndarray of shape (n_rules, 1 + n_inputs, 1 + n_inputs)
        Sums of s w_r [1, z] [1, z]'.
    strongest : ndarray of shape (n_rules,)
        Weight of the rows on which each rule is the strongest.
    peak : ndarray of shape (n_rules,)
        Largest strength on any row.
    n_distinct : ndarray of int of shape (n_rules,)
        Distinct inputs on which each rule is the strongest, up to a limit.
    """

    overlap: np.ndarray
    second: np.ndarray
    strongest: np.ndarray
    peak: np.ndarray
    n_distinct: np.ndarray

    @classmethod
    def of(cls, rows: StandardisedData, antecedent: Antecedent, enough: int):
        """Of rows; distinct inputs are counted up to ``enough`` of each rule."""
        overlap, products, strongest, peak, distinct = rows.reduce(
            partial(_first_pass, antecedent=antecedent, enough=enough), _merge
        )
        return cls(overlap, _symmetric(products), strongest, peak, distinct.counts)


def _symmetric(products):
    """Sums of :func:`~skanfis.learning.gram.pairs` of n functions as matrices, (n_rules, n, n)."""
    n = int(np.sqrt(2 * products.shape[1]))
    upper = np.triu_indices(n)
    found = np.zeros((products.shape[0], n, n))
    found[:, *upper] = products
    found[:, upper[1], upper[0]] = products
    return found


def _first_pass(rows, antecedent, enough):
    """What :class:`RuleFiring` holds, of the symmetric products each but once."""
    n_rules, n_basis = antecedent.n_rules, 1 + rows.X.shape[1]
    overlap, strongest, peak = np.zeros((n_rules, n_rules)), np.zeros(n_rules), np.zeros(n_rules)
    products = np.zeros((n_rules, n_basis * (n_basis + 1) // 2))
    distinct = _DistinctInputs(n_rules, enough)
    for part in _blocks(rows, antecedent):
        Z, _, weight = rows.read(part)
        strengths = antecedent.strengths(Z)
        best = strengths.argmax(axis=0)
        distinct.add(Z, best)
        strongest += np.bincount(best, weights=weight, minlength=n_rules)
        np.maximum(peak, strengths.max(axis=1), out=peak)
        weighted = strengths if weight is None else strengths * weight
        overlap += weighted @ strengths.T
        basis_rows = basis(Z)
        products += weighted @ pairs(basis_rows, basis_rows).T
    return overlap, products, strongest, peak, distinct


def _merge(one, other):
    sums = [a + b for a, b in zip(one[:3], other[:3], strict=True)]
    return *sums, np.maximum(one[3], other[3]), one[4].joined(other[4])


def _radii(rows, antecedent, center, factor):
    """The largest distance at which each rule fires.

    The farthest row of a block is found by quadratic forms in [1, z], one product for all rules,
    and measured by the factor itself: what the product rounds away is not lost.
    """
    n_rules, n_inputs = center.shape
    affine = np.concatenate([-factor @ center[:, :, None], factor], axis=2)
    upper = np.triu_indices(1 + n_inputs)
    forms = (affine.transpose(0, 2, 1) @ affine)[:, *upper]
    forms[:, upper[0] != upper[1]] *= 2.0
    radius, every = np.zeros(n_rules), np.arange(n_rules)
    for part in _blocks(rows, antecedent):
        Z, _, _ = rows.read(part)
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
    """Slices of rows whose memberships and strengths take a bounded number of bytes."""
    n_basis = 1 + rows.X.shape[1]
    n_values = 3 * (antecedent.n_rules + antecedent.n_terms) + n_basis * (n_basis + 9) // 2
    return row_blocks(rows.n_rows, fitting_rows(n_values))


def inverse_factor(second, center):
    """Lower triangular W with W' W the inverse of the thickened covariances."""
    covariance = second - center[:, :, None] * center[:, None, :]
    covariance += _THICKNESS**2 * np.eye(center.shape[1])
    return np.tril(np.linalg.inv(np.linalg.cholesky(covariance)))


class _DistinctInputs:
    """Counts the distinct inputs on which each rule is the strongest, up to a limit."""

    def __init__(self, n_rules, enough):
        self.counts, self.enough = np.zeros(n_rules, dtype=int), enough
        # Of the rules that have not got enough: pairs of rule and fingerprint, each but once.
        self._rules, self._numbers = np.empty(0, dtype=int), np.empty(0)

    def add(self, Z, strongest):
        wanted = self.counts[strongest] < self.enough
        if wanted.any():
            self._absorb(strongest[wanted], fingerprint(Z[:, wanted]))

    def joined(self, other):
        """Return the count of both, each input once."""
        both = _DistinctInputs(self.counts.size, self.enough)
        both.counts = np.maximum(self.counts, other.counts)
        both._absorb(
            np.concatenate([self._rules, other._rules]),
            np.concatenate([self._numbers, other._numbers]),
        )
        return both

    def _absorb(self, rules, numbers):
        rules = np.concatenate([self._rules, rules])
        numbers = np.concatenate([self._numbers, numbers])
        order = np.lexsort((numbers, rules))
        rules, numbers = rules[order], numbers[order]
        is_new = np.ones(rules.size, dtype=bool)
        is_new[1:] = (np.diff(rules) != 0) | (np.diff(numbers) != 0.0)
        rules, numbers = rules[is_new], numbers[is_new]
        found = np.bincount(rules, minlength=self.counts.size)
        seen = (found > 0) & (self.counts < self.enough)
        self.counts[seen] = np.minimum(found[seen], self.enough)
        kept = self.counts[rules] < self.enough
        self._rules, self._numbers = rules[kept], numbers[kept]
