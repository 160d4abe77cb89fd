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
from .rows import Rows, fingerprint

__all__ = ["FIRES", "RuleSupport", "inverse_factor"]

# Rows of one block, however few values it needs; and the bytes that these may take.
_MOST_ROWS, _FEWEST_ROWS = 4096, 64
_BLOCK_BYTES = 2**22
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
    def of(cls, rows: Rows, antecedent: Antecedent, n_coefficients: int):
        """The support of every rule, in the rows' standardised units, in two passes over them.

        Memory does not grow with the rows: of each rule, at most ``n_coefficients`` fingerprints of
        inputs are held.
        """
        mass, first, second, distinct = rows.reduce(
            partial(_first_pass, antecedent=antecedent, enough=n_coefficients), _merge
        )
        known = np.flatnonzero(distinct.counts)
        center, factor = np.zeros_like(first), np.zeros_like(second)
        center[known] = first[known] / mass[known, None]
        factor[known] = inverse_factor(second[known] / mass[known, None, None], center[known])
        radius = rows.reduce(
            partial(_radii, antecedent=antecedent, known=known, center=center, factor=factor),
            np.maximum,
        )
        return cls(distinct.counts / n_coefficients, center, factor, radius)

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


def _first_pass(rows, antecedent, enough):
    """Mass, sums of inputs and of their products by rule, and the distinct inputs."""
    n_rules, n_inputs = antecedent.n_rules, rows.X.shape[1]
    mass, first = np.zeros(n_rules), np.zeros((n_rules, n_inputs))
    second = np.zeros((n_rules, n_inputs, n_inputs))
    distinct = _DistinctInputs(n_rules, enough)
    for part in _blocks(rows, antecedent):
        Z, _, weight = rows.read(part)
        strengths = antecedent.strengths(Z)
        distinct.add(Z, strengths.argmax(axis=0))
        if weight is not None:
            strengths *= weight
        mass += strengths.sum(axis=1)
        first += strengths @ Z.T
        for of_rule, total in zip(strengths, second, strict=True):
            total += (of_rule * Z) @ Z.T
    return mass, first, second, distinct


def _merge(one, other):
    sums = [a + b for a, b in zip(one[:3], other[:3], strict=True)]
    return *sums, one[3].joined(other[3])


def _radii(rows, antecedent, known, center, factor):
    """The largest distance at which each rule fires."""
    radius = np.zeros(antecedent.n_rules)
    for part in _blocks(rows, antecedent):
        Z, _, _ = rows.read(part)
        strengths = antecedent.strengths(Z)
        fires = strengths >= FIRES * strengths.max(axis=0)
        for r in known[fires[known].any(axis=1)]:
            away = factor[r] @ (Z[:, fires[r]] - center[r][:, None])
            radius[r] = max(radius[r], np.sqrt(np.max(np.sum(away**2, axis=0))))
    return radius


def _blocks(rows, antecedent):
    """Slices of rows whose memberships and strengths take a bounded number of bytes."""
    n_values = 3 * antecedent.n_rules + 3 * antecedent.n_terms + 4 * rows.X.shape[1]
    n_rows = int(np.clip(_BLOCK_BYTES // (8 * n_values), _FEWEST_ROWS, _MOST_ROWS))
    return [part for chunk in rows.chunks(n_rows) for part in chunk]


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
