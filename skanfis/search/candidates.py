"""What a search may try: kinds of rule bases, each a sequence from small to large.

Both kinds begin with one rule, a line. A grid grows by one term at a time, beside those that have
learnt already (``trials`` knows on which input); an input that asks for no terms gets none.
Scattered rules stand on the clusters of k-means, half as many again each time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from sklearn.cluster import KMeans

from ..antecedent import TreeAntecedent
from ..antecedent.tree import CRISP, LEAST_WIDTH
from ..learning.data import StandardisedData
from ..membership import Membership
from .clusters import clustered_antecedent
from .grid import OVERLAP, Spacing, grid_antecedent
from .tuning import Tuned

KINDS = ("grid", "tree", "scattered")
_MORE_CLUSTERS = 1.5
# Digits that rounding leaves alone where units change.
_DIGITS = 9
# Cuts that are looked at are so many quantiles of a leaf; a new one is as wide as this part of the
# leaf's deviation; beyond so many inputs their products are not looked at.
_BINS, _WIDTH, _MOST_CROSSED = 16, 0.25, 200


@dataclass(frozen=True)
class Split:
    """Two leaves in the place of one, in standardised units."""

    leaf: int
    input: int
    cut: float
    log_width: float


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: a grid of so many terms per input, so many scattered rules, a tree."""

    counts: tuple[int, ...]
    n_clusters: int = 0  # of scattered rules
    splits: tuple[Split, ...] = ()  # of a tree, one after the other

    @property
    def kind(self):
        """One of the kinds, or "one rule"."""
        if self.splits:
            return "tree"
        if self.n_clusters:
            return "scattered"
        return "one rule" if self.n_rules == 1 else "grid"

    @property
    def n_rules(self):
        """Number of rules."""
        return self.n_clusters or prod(self.counts) + len(self.splits)

    def n_terms(self, inputs):
        """Number of terms, of scattered rules on so many inputs."""
        if self.splits:
            return len(self.splits)
        return self.n_clusters * inputs.size or sum(count for count in self.counts if count > 1)

    def describe(self):
        """In words."""
        if self.n_rules == 1:
            return "one rule"
        if self.n_clusters:
            return f"{self.n_clusters} scattered rules"
        return f"tree of {self.n_rules} rules" if self.splits else f"grid {list(self.counts)}"

    def with_more_terms(self, inputs):
        """The grid with one more term on each of some inputs."""
        counts = list(self.counts)
        for j in inputs:
            counts[j] += 1
        return replace(self, counts=tuple(counts))

    def with_split(self, split):
        """The tree with one leaf more."""
        return replace(self, splits=(*self.splits, split))

    def with_more_clusters(self, n_steps=1):
        """Half as many scattered rules again, two at least, so many times."""
        number = self.n_clusters
        for _ in range(n_steps):
            number = max(2, int(np.ceil(_MORE_CLUSTERS * number)))
        return replace(self, n_clusters=number)


@dataclass(frozen=True, eq=False)
class RuleBases:
    """What candidates begin with.

    Parameters
    ----------
    families : sequence of type of Membership
        One per input.
    inputs : ndarray of int
        Those that may have terms.
    spacing : Spacing
        Where the terms of grids stand.
    seed : int
        Of the clustering.
    """

    families: Sequence[type[Membership]]
    inputs: np.ndarray
    spacing: Spacing
    seed: int

    def of(self, candidate: Candidate, rows: StandardisedData, smaller=None):
        """The antecedent of a candidate.

        Clusters are sought in the rows; a grid keeps the terms that a ``smaller`` one has learnt.
        """
        if candidate.splits:
            tree = smaller if isinstance(smaller, TreeAntecedent) else TreeAntecedent.build([], np.empty((2, 0)), [[]])
            for split in candidate.splits[tree.n_nodes :]:
                tree = tree.split(split.leaf, split.input, split.cut, split.log_width)
            return tree
        if not candidate.n_clusters:
            return grid_antecedent(self.families, candidate.counts, self.spacing, known=smaller)
        clusterer = KMeans(candidate.n_clusters, n_init=1, random_state=self.seed)

        def label(table, weight):
            # It begins at some of the rows: the order of columns is to have no part in which, and
            # rounding none in what is near to two centres.
            table = np.round(table, _DIGITS)
            order = np.lexsort(np.sort(table, axis=1).T)
            labels = clusterer.fit(table[order], sample_weight=weight[order]).labels_
            return labels[np.argsort(order)]

        return clustered_antecedent(self.families, rows, label, self.inputs)


def term_scores(tuned: Tuned, inputs, counts, spacing: Spacing):
    """How much the residual of a model asks for so many terms on each input, (n_inputs,).

    With nu_k the shares of ``counts`` even Gaussian terms on an input, b the functions 1 and z_i,
    and r the residual, the statistic is the sum over k and b of

        (sum s nu_k b r)^2 / sum s (nu_k b)^2 ,    nu_k less its mean,

    in deviations from what noise alone would give it.
    """
    problem, rows = tuned.problem, tuned.problem.rows
    weight = rows.sample_weight
    assert weight is not None  # a search sample has them
    found = [residual for _, residual, _ in problem.residuals(tuned.evaluation)]
    residual = np.concatenate(found, axis=1).T
    residual -= np.average(residual, axis=0, weights=weight)
    variance = np.average(residual**2, axis=0, weights=weight)
    varying = rows.X[:, np.ptp(rows.X, axis=0) > 0.0]
    basis = np.column_stack([np.ones(rows.n_rows), varying])
    scores = np.zeros(inputs.size)
    for k, (j, count) in enumerate(zip(inputs, counts, strict=True)):
        shares = _shares(rows.X[:, j], spacing.centers(j, count))
        shares -= np.average(shares, axis=0, weights=weight)
        own = weight[:, None] * shares
        norm = (own * shares).T @ basis**2
        along = np.einsum("nk,no,nb->kbo", own, residual, basis, optimize=True)
        squares = along**2 / np.maximum(norm[:, :, None] * variance, np.finfo(float).tiny)
        # One of the shares follows from the others.
        n_free = squares.size * (1.0 - 1.0 / count)
        scores[k] = (squares.sum() * (1.0 - 1.0 / count) - n_free) / np.sqrt(2.0 * n_free)
    return scores


def _shares(column, centers):
    """Of Gaussian terms, neighbours of which cross at ``OVERLAP``, (n_rows, n_terms)."""
    distance = np.mean(np.diff(centers)) or 1.0
    log_truth = 4.0 * np.log(OVERLAP) * ((column[:, None] - centers) / distance) ** 2
    shares = np.exp(log_truth - log_truth.max(axis=1, keepdims=True))
    return shares / shares.sum(axis=1, keepdims=True)


def best_splits(tuned: Tuned, inputs, n_most):
    """Those that the residual of a model asks for most, best first; one of every leaf and input.

    At a cut, with p the part of the leaf below it, b the functions 1 and z_i about the leaf's own
    centre, and r the residual, the statistic is the sum over b of

        (sum s w (h - p) b r)^2 / sum s w (h - p)^2 b^2 ,    h one below the cut and zero above,

    in deviations from what noise alone would give it.
    """
    problem, rows = tuned.problem, tuned.problem.rows
    weight = rows.sample_weight
    found = [residual for _, residual, _ in problem.residuals(tuned.evaluation)]
    residual = np.concatenate(found, axis=1).T
    variance = np.average(residual**2, axis=0, weights=weight)
    varying = rows.X[:, np.ptp(rows.X, axis=0) > 0.0]
    if varying.shape[1] > _MOST_CROSSED:
        varying = varying[:, :0]
    strengths = tuned.evaluation.antecedent.strengths(rows.X.T)
    splits = []
    for leaf, strength in enumerate(strengths):
        own = weight * strength
        total = own.sum()
        basis = np.column_stack([np.ones(rows.n_rows), varying - own @ varying / total])
        along = (own[:, None] * basis)[:, :, None] * residual[:, None, :]
        squares = own[:, None] * basis**2
        values = np.column_stack([along.reshape(rows.n_rows, -1), squares, own])
        for j in inputs:
            order = np.argsort(rows.X[:, j], kind="stable")
            column = rows.X[order, j]
            upto = np.cumsum(own[order])
            # Where the next value is another one, about evenly by weight.
            ends = np.unique(np.searchsorted(upto, np.arange(1, _BINS) / _BINS * total))
            ends = np.unique(np.searchsorted(column, column[np.minimum(ends, column.size - 1)], side="right"))
            ends = ends[(ends > 0) & (ends < column.size)]
            if not ends.size:
                continue
            starts = np.concatenate([[0], ends])
            sums = np.add.reduceat(values[order], starts, axis=0).cumsum(axis=0)
            whole, below = sums[-1], sums[:-1]
            part = (below[:, -1:] / total).clip(0.0, 1.0)
            n_basis, n_out = basis.shape[1], residual.shape[1]
            n = n_basis * n_out
            difference = (below[:, :n] - part * whole[:n]).reshape(-1, n_basis, n_out)
            low, all_ = below[:, n : n + n_basis], whole[n : n + n_basis]
            norm = low * (1.0 - part) ** 2 + (all_ - low) * part**2
            square = difference**2 / np.maximum(norm[:, :, None] * variance, np.finfo(float).tiny)
            statistic = (square.sum(axis=(1, 2)) - n) / np.sqrt(2.0 * n)
            best = int(statistic.argmax())
            cut = 0.5 * (column[ends[best] - 1] + column[ends[best]])
            spread = np.sqrt(np.average((rows.X[:, j] - np.average(rows.X[:, j], weights=own)) ** 2, weights=own))
            width = max(_WIDTH * spread, LEAST_WIDTH)
            if column[ends[best] - 1] == column[0] and column[ends[best]] == column[-1]:
                width = 0.5 * (column[-1] - column[0]) / CRISP
            splits.append((statistic[best], Split(leaf, int(j), float(cut), float(np.log(width)))))
    splits.sort(key=lambda pair: -float(f"{pair[0]:.6g}"))
    return [split for _, split in splits[:n_most]]
