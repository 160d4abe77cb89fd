"""What a search may try: kinds of rule bases, each a sequence from small to large.

All kinds begin with one rule, a line. A grid grows by one term at a time, beside those that have
learnt already (``trials`` knows on which input); an input that asks for no terms gets none. Of a
tree, one leaf at a time is split, or a quarter of many (``splits``). Scattered rules are half as
many again each time, on clusters of k-means where the residual of the others is, with terms on the
inputs that smaller ones have asked for (``conditions`` says which of these may go).
"""

import warnings
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning

from ..antecedent import TreeAntecedent
from .clusters import clustered_antecedent, grown_antecedent
from .grid import OVERLAP, Spacing, grid_antecedent
from .sample import DIGITS, counting_weight, in_deviations, to_six_digits
from .splits import Split
from .tuning import Tuned

KINDS = ("grid", "tree", "scattered")
_MORE_CLUSTERS = 1.5
_RANK = 1e-10  # of squares: what is less beside the largest is rounding


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: a grid of terms per input, a tree, or so many scattered rules."""

    counts: tuple[int, ...]
    n_clusters: int = 0  # of scattered rules
    inputs: tuple[int, ...] = ()  # on which these have terms
    splits: tuple[Split, ...] = ()  # of a tree, one after the other
    slope_worth: float | None = None  # of slopes that are kept (``sparse_slopes``); None: all are
    has_all_slopes: bool = False  # also where rows are few (``lasso``)

    @property
    def kind(self):
        """One of the kinds, or "one rule"."""
        if not self.is_grid:
            return "scattered" if self.n_clusters else "tree"
        return "one rule" if self.n_rules == 1 else "grid"

    @property
    def is_grid(self):
        """Whether rules are all combinations of terms; one rule is."""
        return not (self.n_clusters or self.splits)

    @property
    def n_rules(self):
        """Number of rules."""
        return self.n_clusters or prod(self.counts) + len(self.splits)

    @property
    def n_terms(self):
        """Number of terms."""
        if self.is_grid:
            return sum(count for count in self.counts if count > 1)
        return self.n_clusters * len(self.inputs) or len(self.splits)

    def describe(self):
        """In words."""
        words = f"{self.kind} of {self.n_rules} rules"
        if self.n_clusters:
            words = f"{self.n_rules} scattered rules"
        elif self.n_rules == 1:
            words = "one rule"
        words += ", slopes by all inputs" if self.has_all_slopes else ""
        if self.slope_worth is not None:
            words += ", fewest slopes" if self.slope_worth else ", fewer slopes"
        return words

    def with_more_terms(self, j):
        """The grid with one more term on an input."""
        counts = list(self.counts)
        counts[j] += 1
        return replace(self, counts=tuple(counts))

    def with_more_splits(self, splits):
        """The tree with these leaves split too; the last come first, which moves no other leaf."""
        return replace(self, splits=(*self.splits, *sorted(splits, key=lambda one: -one.leaf)))

    def with_more_clusters(self, inputs):
        """Half as many scattered rules again, two at least, with terms on these inputs too."""
        number = max(2, int(np.ceil(_MORE_CLUSTERS * self.n_clusters)))
        inputs = tuple(sorted({*self.inputs, *inputs}))
        return replace(self, n_clusters=number, inputs=inputs)


def rule_base(candidate, rows, families, spacing, seed, smaller: Tuned | None = None):
    """The antecedent that a candidate begins with.

    All go on from what a ``smaller`` candidate has learnt, but for the first scattered rules, which
    begin at clusters of the ``rows``.
    """
    known: Any = None if smaller is None else smaller.evaluation.antecedent
    if candidate.splits:
        is_grown = isinstance(known, TreeAntecedent)
        tree = known if is_grown else TreeAntecedent.build([], [[], []], [[]])
        for split in candidate.splits[tree.n_nodes :]:
            tree = tree.split(split.leaf, split.input, split.cut, split.log_width)
        return tree
    if not candidate.n_clusters:
        return grid_antecedent(families, candidate.counts, spacing, known=known)
    n_known = 0 if known is None or known.n_rules == 1 else known.n_rules
    clusterer = KMeans(candidate.n_clusters - n_known, n_init=1, random_state=seed)

    def label(table, weight):
        # It begins at some of the rows: the order of columns is to have no part in which, and
        # rounding none in what is near to two centres.
        table = np.round(table, DIGITS)
        order = np.lexsort(np.sort(table, axis=1).T)
        # That there are fewer clusters shows.
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            labels = clusterer.fit(table[order], sample_weight=weight[order]).labels_
        return labels[np.argsort(order)]

    inputs = np.array(candidate.inputs)
    if n_known:
        return grown_antecedent(families, smaller, label, inputs)
    return clustered_antecedent(families, rows, label, inputs)


class TermScores:
    """Score tests: how much of the residual of a model further terms on an input would explain.

    The statistic of the splits of a tree (``splits``), with the shares nu_k of so many evenly
    spaced Gaussian terms, less their means, in the place of h - p; z_i are those of the inputs
    ``crossed``. What was projected out before does not count (Rao 1948).
    """

    def __init__(self, tuned: Tuned, spacing: Spacing, crossed):
        rows, self.weight = tuned.problem.rows, counting_weight(tuned.problem.rows)
        self.X, self.spacing, root = rows.X, spacing, np.sqrt(self.weight)[:, None]
        self.basis = np.hstack([root, root * rows.X[:, crossed]])
        mean = np.average(tuned.residual, axis=0, weights=self.weight)
        self.residual, self.known = root * (tuned.residual - mean), np.empty((rows.n_rows, 0))

    def project_out(self, j, count):
        """Take out what so many terms on an input explain, of the residual and of functions."""
        pairs = self._shares(j, count)[:, :, None] * self.basis[:, None]
        functions = pairs.reshape(len(self.X), -1)
        least = _RANK * np.sum(functions**2, axis=0).max()
        functions -= self.known @ (self.known.T @ functions)
        sizes, axes = np.linalg.eigh(functions.T @ functions)
        added = functions @ (axes / np.sqrt(np.maximum(sizes, least)))[:, sizes > least]
        self.known = np.hstack([self.known, added])
        self.residual -= added @ (added.T @ self.residual)

    def of(self, pairs):
        """Of every pair of an input and a number of terms, in deviations from chance."""
        scores, squared, n_known = [], self.basis**2, self.known.shape[1]
        products = (self.residual[:, :, None] * self.basis[:, None]).reshape(len(self.X), -1)
        part_free = max(1.0 - n_known / len(self.X), np.finfo(float).eps)
        variance = np.sum(self.residual**2, axis=0) / (part_free * self.weight.sum())
        for j, count in pairs:
            shares = self._shares(j, count)
            norm = (shares**2).T @ squared
            if n_known:
                explained = [self.known.T @ (own[:, None] * self.basis) for own in shares.T]
                norm = np.maximum(norm - np.sum(np.square(explained), axis=1), _RANK * norm)
            along = (shares.T @ products).reshape(count, variance.size, -1)
            least = np.finfo(float).tiny
            squares = along**2 / np.maximum(norm[:, None] * variance[:, None], least)
            free = 1.0 - 1.0 / count  # one of the shares follows from the others
            scores.append(to_six_digits(in_deviations(free * squares.sum(), free * squares.size)))
        return np.array(scores)

    def _shares(self, j, count):
        """Of Gaussian terms, neighbours of which cross at ``OVERLAP``, less their means."""
        centers = self.spacing.centers(j, count)
        distance = np.mean(np.diff(centers)) or 1.0
        log_truth = 4.0 * np.log(OVERLAP) * ((self.X[:, [j]] - centers) / distance) ** 2
        shares = np.exp(log_truth - log_truth.max(axis=1, keepdims=True))
        shares /= shares.sum(axis=1, keepdims=True)
        return shares - np.average(shares, axis=0, weights=self.weight)
