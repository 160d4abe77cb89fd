"""What a search may try: kinds of rule bases, each a sequence from small to large.

All kinds begin with one rule, a line. A grid gains one term at a time and keeps the terms that have
learnt; ``trials`` chooses the input, and an input that needs no terms gets none. A tree splits one
leaf at a time, or a quarter of its leaves once it has many (``splits``). Scattered rules grow by
half: the new ones stand at k-means clusters of the rows with large residuals, with terms on all
inputs that the search has found so far (``conditions`` removes those that are not needed).
"""

from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning

from .._threads import without
from ..antecedent import TreeAntecedent
from ..blocks import BLOCK_BYTES, row_blocks
from .clusters import clustered_antecedent, grown_antecedent
from .grid import OVERLAP, Spacing, grid_antecedent
from .sample import DIGITS, counting_weight, in_deviations, to_six_digits
from .splits import Split
from .tuning import Tuned

KINDS = ("grid", "tree", "scattered")
_MORE_CLUSTERS = 1.5
_RANK = 1e-10  # squares below this part of the largest are rounding errors


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: a grid, a tree, or a number of scattered rules."""

    counts: tuple[int, ...]  # terms per input of a grid, 1 for none
    n_clusters: int = 0  # number of scattered rules
    inputs: tuple[int, ...] = ()  # on which scattered rules have terms
    splits: tuple[Split, ...] = ()  # of a tree, in order
    slope_worth: float | None = None  # least worth of a slope (``sparse_slopes``); None keeps all
    has_all_slopes: bool = False  # slopes by all inputs even if rows are few (``lasso``)

    @property
    def kind(self):
        """One of the kinds."""
        if not self.is_grid:
            return "scattered" if self.n_clusters else "tree"
        return "grid"

    @property
    def is_grid(self):
        """Whether rules are all combinations of terms; one rule counts as a grid."""
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
        """The structure in words."""
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
        """The tree with these leaves split too, last leaf first: so no split renumbers another."""
        return replace(self, splits=(*self.splits, *sorted(splits, key=lambda one: -one.leaf)))

    def with_more_clusters(self, inputs):
        """Half as many scattered rules again, two at least, with terms also on these inputs."""
        number = max(2, int(np.ceil(_MORE_CLUSTERS * self.n_clusters)))
        inputs = tuple(sorted({*self.inputs, *inputs}))
        return replace(self, n_clusters=number, inputs=inputs)


def rule_base(candidate, rows, families, spacing, seed, smaller: Tuned | None = None):
    """The antecedent that a candidate begins with.

    It goes on from what a ``smaller`` candidate has learnt. Only the first scattered rules begin
    afresh, at clusters of the ``rows``.
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
    n_known = 0 if known.n_rules == 1 else known.n_rules
    clusterer = KMeans(candidate.n_clusters - n_known, n_init=1, random_state=seed)

    def label(table, weight):
        # k-means starts at randomly drawn rows. Sorting makes the draw independent of the order of
        # columns; rounding keeps rounding errors from deciding between two equally near centres.
        table = np.round(table, DIGITS)
        order = np.lexsort(np.sort(table, axis=1).T)
        # k-means warns of fewer clusters than asked for; ``Trials.larger`` checks their number.
        with without(ConvergenceWarning):
            labels = clusterer.fit(table[order], sample_weight=weight[order]).labels_
        return labels[np.argsort(order)]

    inputs = np.array(candidate.inputs)
    if n_known:
        return grown_antecedent(families, smaller, label, inputs)
    return clustered_antecedent(families, rows, label, inputs)


class TermScores:
    """Score tests (Rao 1948): how much of a model's residual new terms on an input would explain.

    The statistic is that of ``splits``, with h - p replaced by the shares nu_k of Gaussian terms,
    placed by ``Spacing``, less their means. The z_i are the inputs ``crossed``. What
    ``project_out`` has taken out does not count.
    """

    def __init__(self, tuned: Tuned, spacing: Spacing, crossed):
        rows, self.weight = tuned.problem.rows, counting_weight(tuned.problem.rows)
        self.X, self.spacing, root = rows.X, spacing, np.sqrt(self.weight)[:, None]
        self.basis = np.hstack([root, root * rows.X[:, crossed]])
        mean = np.average(tuned.residual, axis=0, weights=self.weight)
        self.residual, self.known = root * (tuned.residual - mean), np.empty((rows.n_rows, 0))

    def project_out(self, j, count):
        """Project what ``count`` terms on an input explain out of the residual and later scores."""
        pairs = self._shares([j], count)[:, 0].T[:, :, None] * self.basis[:, None]
        functions = pairs.reshape(len(self.X), -1)
        least = _RANK * np.sum(functions**2, axis=0).max()
        functions -= self.known @ (self.known.T @ functions)
        sizes, axes = np.linalg.eigh(functions.T @ functions)
        added = functions @ (axes / np.sqrt(np.maximum(sizes, least)))[:, sizes > least]
        self.known = np.hstack([self.known, added])
        self.residual -= added @ (added.T @ self.residual)

    def of(self, pairs):
        """Scores of pairs of an input and a number of terms, in deviations from chance."""
        scores, squared, n_known = np.empty(len(pairs)), self.basis**2, self.known.shape[1]
        products = (self.residual[:, :, None] * self.basis[:, None]).reshape(len(self.X), -1)
        part_free = max(1.0 - n_known / len(self.X), np.finfo(float).eps)
        variance = np.sum(self.residual**2, axis=0) / (part_free * self.weight.sum())
        least = np.finfo(float).tiny
        inputs, counts = np.transpose(pairs).reshape(2, -1)
        for count in np.unique(counts):
            # Many inputs at once, as some four arrays of them fit into a block: for few rows, calls
            # of NumPy would take longer than its work.
            size = BLOCK_BYTES // (4 * 8 * count * (len(self.X) + products.shape[1]))
            places = np.flatnonzero(counts == count)
            for block in row_blocks(places.size, max(size, 1)):
                own = places[block]
                shares = self._shares(inputs[own], count).reshape(count * own.size, -1)
                norm = shares**2 @ squared
                if n_known:
                    told = (self.known.T @ (one[:, None] * self.basis) for one in shares)
                    explained = np.array([np.sum(one**2, axis=0) for one in told])
                    norm = np.maximum(norm - explained, _RANK * norm)
                along = (shares @ products).reshape(count * own.size, variance.size, -1)
                squares = along**2 / np.maximum(norm[:, None] * variance[:, None], least)
                squares = squares.reshape(count, own.size, -1)
                free = 1.0 - 1.0 / count  # one of the shares follows from the others
                excess = in_deviations(free * squares.sum(axis=(0, 2)), free * squares[:, 0].size)
                scores[own] = [to_six_digits(one) for one in excess]
        return scores

    def _shares(self, inputs, count):
        """Centred shares of Gaussian terms whose neighbours cross at membership ``OVERLAP``.

        The shape is (count, n_inputs, n_rows).
        """
        centers = np.array([self.spacing.centers(j, count) for j in inputs]).T[:, :, None]
        distance = np.mean(np.diff(centers, axis=0), axis=0)
        distance[distance == 0.0] = 1.0
        log_truth = 4.0 * np.log(OVERLAP) * ((self.X.T[inputs] - centers) / distance) ** 2
        shares = np.exp(log_truth - log_truth.max(axis=0))
        shares /= shares.sum(axis=0)
        return shares - np.average(shares, axis=2, weights=self.weight)[:, :, None]
