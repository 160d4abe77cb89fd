"""Where the rows of every rule lie, and how many there are, for rows that come in chunks.

Sums are over the rows' standardised inputs z. To add the sums of two sets of rows, both are first
converted to the scale of all their rows, z' = t + g z.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..antecedent import strongest_rules
from ..learning.data import Scale
from ..learning.firing import FIRES, places
from ..support import RuleSupport

# Farthest rows of a rule that are kept, beside those with the extremes of an input.
_MOST_FAR = 8


@dataclass(frozen=True, eq=False)
class RuleRows:
    """All that is kept of the rows of every rule; of a fixed size, immutable."""

    second: np.ndarray  # sums of s w_r [1, z] [1, z]', (n_rules, 1 + n_inputs, 1 + n_inputs)
    strongest: np.ndarray  # weight of the rows on which each rule is the strongest
    peak: np.ndarray  # largest strength of each rule on any row
    extent: np.ndarray  # largest sqrt(w_r) |x - a_r|, by inputs that consequents are linear in
    # Pairs of a rule and the fingerprint of an input on which it is the strongest, (n, 2).
    distinct: np.ndarray
    # A rule, and a row on which it fires far from its centre, (n, 1 + n_inputs).
    farthest: np.ndarray

    @classmethod
    def none(cls, n_rules, n_inputs, n_slopes):
        """The sums over no rows."""
        extent, zeros = np.zeros((n_rules, n_slopes)), np.zeros(n_rules)
        second = np.zeros((n_rules, 1 + n_inputs, 1 + n_inputs))
        return cls(second, zeros, zeros, extent, np.empty((0, 2)), np.empty((0, 1 + n_inputs)))

    @classmethod
    def of(cls, X, basis_rows, strengths, weight, numbers, slope_inputs, centers):
        """The sums over a block of rows, X (n_inputs, n_rows), ``basis_rows`` [1, z].

        ``numbers`` are fingerprints of the inputs, ``centers`` a_r of the rules on the inputs by
        which they have slopes, (n_rules, n_slopes).
        """
        best, top = strongest_rules(strengths), strengths.max(axis=0)
        weighted = basis_rows * weight
        rule, row = np.nonzero(strengths >= FIRES * top)
        root, extent = np.sqrt(strengths), np.empty_like(centers)
        for j, x in enumerate(X[slope_inputs]):
            extent[:, j] = (root * np.abs(x - centers[:, j, None])).max(axis=1)
        return cls(
            np.stack([(own * weighted) @ basis_rows.T for own in strengths]),
            np.bincount(best, weights=weight, minlength=len(strengths)),
            strengths.max(axis=1),
            extent,
            np.column_stack([best, numbers]),
            np.column_stack([rule, X.T[row]]),
        )

    def faded(self, factor):
        """The sums with all weights times a factor."""
        return replace(self, second=factor * self.second, strongest=factor * self.strongest)

    def plus(self, other, scale: Scale):
        """The sums over the rows of both, which must be on ``scale``."""
        second = self.second + other.second
        distinct = np.unique(np.vstack([self.distinct, other.distinct]), axis=0)
        far = np.vstack([self.farthest, other.farthest])
        rules, distance = _distances(far, second, scale)
        far = far[np.lexsort((-distance, rules))]
        rank = np.arange(len(distinct)) - np.searchsorted(distinct[:, 0], distinct[:, 0])
        return RuleRows(
            second,
            self.strongest + other.strongest,
            np.maximum(self.peak, other.peak),
            np.maximum(self.extent, other.extent),
            distinct[rank < second.shape[1]],
            _outermost(far),
        )

    def on(self, shift, factor):
        """The sums on z' = shift + factor z."""
        second = [rescaled(rescaled(own, shift, factor).T, shift, factor) for own in self.second]
        return replace(self, second=np.stack(second))

    def support(self, scale: Scale, n_coefficients):
        """The support of every rule, in the units of X."""
        counts = np.bincount(self.distinct[:, 0].astype(int), minlength=len(self.second))
        known = counts > 0
        center, factor = places(self.second, known)
        radius = np.zeros(known.size)
        rules, distance = _distances(self.farthest, self.second, scale)
        np.maximum.at(radius, rules, distance)
        share = np.minimum(counts, n_coefficients) / n_coefficients
        support = RuleSupport(share, center, factor, radius * known)
        return support.change_units(scale.offset, scale.scale)


def rescaled(sums, shift, factor):
    """Sums of [1, z] times a factor, by rule along the first axis, converted to [1, t + g z]."""
    blocks = sums.reshape(-1, 1 + shift.size, sums.shape[-1]).copy()
    blocks[:, 1:] *= factor[:, None]
    blocks[:, 1:] += shift[:, None] * blocks[:, :1]
    return blocks.reshape(sums.shape)


def _outermost(far):
    """The rows to keep, of rows by rule, farthest first: each may be farthest as centres move."""
    kept = []
    for own in np.split(far, np.flatnonzero(np.diff(far[:, 0])) + 1):
        ends = np.concatenate([own.argmin(axis=0), own.argmax(axis=0)])
        kept.append(own[np.union1d(np.arange(min(_MOST_FAR, len(own))), ends)])
    return np.vstack(kept)


def _distances(farthest, second, scale):
    """The rules of ``farthest`` rows, and the Mahalanobis distances of these from the centres."""
    rules = farthest[:, 0].astype(int)
    center, factor = places(second, np.ones(len(second)))
    away = (farthest[:, 1:] - scale.offset) / scale.scale - center[rules]
    return rules, np.linalg.norm(np.einsum("nij,nj->ni", factor[rules], away), axis=1)
