r"""Where the rows of every rule lie, kept so that more can come: what coverage and reports read.

Sums over rows of w_r [1, z] [1, z]' give the mean and the covariance of ``support`` for every rule;
distinct rows are counted as far as anything asks for their number. The farthest row of a rule in
Mahalanobis' distance is sought among rows that were the farthest in some direction when they came,
a few per rule: as the covariance changes, another that is gone may have become the farthest.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..antecedent import Antecedent
from ..learning.data import StandardisedData
from ..learning.firing import FIRES, inverse_factor
from ..support import RuleSupport
from .scales import Change

__all__ = ["Distinct", "RuleFiring"]

# 2^64 over the golden ratio, made odd: a product by it loses no bit, and spreads neighbours evenly
# (Knuth, The Art of Computer Programming, volume 3, section 6.4).
_ODD = np.uint64(0x9E3779B97F4A7C15)


def row_keys(table):
    """A number for every row (n_rows, n_columns): equal for equal rows, all but surely not else."""
    keys = np.zeros(table.shape[0], dtype=np.uint64)
    for column in table.T:
        # Adding zero makes one zero of the two.
        bits = np.ascontiguousarray(column + 0.0).view(np.uint64)
        keys = (keys ^ bits) * _ODD
        keys ^= keys >> np.uint64(29)
    return keys


@dataclass(frozen=True, eq=False)
class Distinct:
    """Which distinct rows there have been, in each of several classes, up to ``enough`` of each."""

    counts: np.ndarray
    enough: int
    classes: np.ndarray
    keys: np.ndarray

    @classmethod
    def none(cls, n_classes, enough):
        """Of no rows."""
        return cls(
            np.zeros(n_classes, dtype=int), enough, np.empty(0, int), np.empty(0, dtype=np.uint64)
        )

    def plus(self, classes, keys):
        """With more rows, given by class and key."""
        wanted = self.counts[classes] < self.enough
        if not wanted.any():
            return self
        classes = np.concatenate([self.classes, classes[wanted]])
        keys = np.concatenate([self.keys, keys[wanted]])
        order = np.lexsort((keys, classes))
        classes, keys = classes[order], keys[order]
        is_new = np.ones(classes.size, dtype=bool)
        is_new[1:] = (np.diff(classes) != 0) | (keys[1:] != keys[:-1])
        classes, keys = classes[is_new], keys[is_new]
        # More than enough of a class are no use.
        place = np.arange(classes.size) - np.searchsorted(classes, classes)
        classes, keys = classes[place < self.enough], keys[place < self.enough]
        counts = np.bincount(classes, minlength=self.counts.size)
        return replace(self, counts=counts, classes=classes, keys=keys)


@dataclass(frozen=True, eq=False)
class RuleFiring:
    """How the rules have fired.

    Attributes
    ----------
    second : ndarray of shape (n_rules, 1 + n_inputs, 1 + n_inputs)
        Sums of s w_r [1, z] [1, z]' on the scales of the moments beside it.
    strongest : ndarray of shape (n_rules,)
        Weight of the rows on which each rule is the strongest.
    peak : ndarray of shape (n_rules,)
        Largest strength on any row.
    distinct : Distinct
        Inputs on which each rule is the strongest.
    rules, rows : ndarray of shape (n,) and (n, n_inputs)
        Rows that may be the farthest of a rule, in the units of X.
    """

    second: np.ndarray
    strongest: np.ndarray
    peak: np.ndarray
    distinct: Distinct
    rules: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, rows: StandardisedData, antecedent: Antecedent, parts):
        """Of rows in blocks, on their own scales."""
        n_rules, n_inputs = antecedent.n_rules, rows.X.shape[1]
        second = np.zeros((n_rules, 1 + n_inputs, 1 + n_inputs))
        strongest, peak = np.zeros(n_rules), np.zeros(n_rules)
        distinct = Distinct.none(n_rules, 1 + n_inputs)
        rules, far = [], []
        for part in parts:
            raw = np.array(rows.X[part].T, dtype=float, order="C")
            Z, _, weight = rows.read(part)
            basis = np.concatenate([np.ones((1, Z.shape[1])), Z])
            strengths = antecedent.strengths(raw)
            best, top = strengths.argmax(axis=0), strengths.max(axis=0)
            distinct = distinct.plus(best, row_keys(raw.T))
            strongest += np.bincount(best, weights=weight, minlength=n_rules)
            np.maximum(peak, strengths.max(axis=1), out=peak)
            fires = strengths >= FIRES * top
            if weight is not None:
                strengths *= weight
            for r in range(n_rules):
                second[r] += (strengths[r] * basis) @ basis.T
                own = np.flatnonzero(fires[r])
                rules.append(np.full(own.size, r))
                far.append(raw.T[own])
            rules, far = _outermost(rules, far, second, rows.inputs)
        return cls(second, strongest, peak, distinct, rules[0], far[0])

    def faded(self, factor):
        """With all weights times a factor."""
        return replace(self, second=factor * self.second, strongest=factor * self.strongest)

    def on(self, change: Change):
        """The same sums on other scales."""
        return replace(self, second=np.stack([change.of_square(one) for one in self.second]))

    def plus(self, other, scale):
        """Of the rows of both, which are on this scale."""
        second = self.second + other.second
        rules, rows = _outermost([self.rules, other.rules], [self.rows, other.rows], second, scale)
        return RuleFiring(
            second,
            self.strongest + other.strongest,
            np.maximum(self.peak, other.peak),
            self.distinct.plus(other.distinct.classes, other.distinct.keys),
            rules[0],
            rows[0],
        )

    def support(self, scale, n_coefficients):
        """The support of every rule, in the units of X."""
        known = self.distinct.counts > 0
        center, factor = _centers(self.second, known)
        away = (self.rows - scale.offset) / scale.scale - center[self.rules]
        distance = np.linalg.norm(np.einsum("nij,nj->ni", factor[self.rules], away), axis=1)
        radius = np.zeros(known.size)
        np.maximum.at(radius, self.rules, distance)
        share = np.minimum(self.distinct.counts, n_coefficients) / n_coefficients
        center[~known] = 0.0
        return RuleSupport(share, center, factor, np.where(known, radius, 0.0)).change_units(
            scale.offset, scale.scale
        )


def _centers(second, known):
    """Mean and inverse factor of the covariance of every rule; zeros of those not known."""
    center = np.zeros((second.shape[0], second.shape[1] - 1))
    factor = np.zeros((*center.shape, center.shape[1]))
    known = known & (second[:, 0, 0] > 0.0)
    mass = second[known, 0, 0]
    center[known] = second[known, 0, 1:] / mass[:, None]
    factor[known] = inverse_factor(second[known, 1:, 1:] / mass[:, None, None], center[known])
    return center, factor


def _outermost(rules, rows, second, scale):
    """Of rows by their rules, those farthest along either side of every whitened direction."""
    rules, rows = np.concatenate(rules), np.concatenate(rows)
    center, factor = _centers(second, np.ones(second.shape[0], dtype=bool))
    n_inputs = rows.shape[1]
    kept = []
    for r in np.unique(rules):
        own = np.flatnonzero(rules == r)
        if own.size > 2 * n_inputs + 1:
            away = ((rows[own] - scale.offset) / scale.scale - center[r]) @ factor[r].T
            found = [*away.argmax(axis=0), *away.argmin(axis=0), (away**2).sum(axis=1).argmax()]
            own = own[np.unique(found)]
        kept.append(own)
    chosen = np.concatenate(kept) if kept else np.empty(0, dtype=int)
    return [rules[chosen]], [rows[chosen]]
