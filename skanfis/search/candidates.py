"""What a search may try: kinds of rule bases, each a sequence from small to large.

Both kinds begin with one rule, a line. A grid grows by one term at a time, on the input where the
error expected of new rows promises to be the smallest before any premise has moved; an input that
asks for no terms gets none. Scattered rules stand on the clusters of k-means, half as many again
each time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from sklearn.cluster import KMeans

from ..learning.data import StandardisedData
from ..membership import Membership
from .clusters import clustered_antecedent
from .grid import OVERLAP, Spacing, grid_antecedent
from .tuning import Tuned

KINDS = ("grid", "scattered")
_MORE_CLUSTERS = 1.5


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: a grid of so many terms per input, or so many scattered rules."""

    counts: tuple[int, ...]
    n_clusters: int = 0  # of scattered rules

    @property
    def kind(self):
        """ "one rule", "grid" or "scattered"."""
        if self.n_clusters:
            return "scattered"
        return "one rule" if self.n_rules == 1 else "grid"

    @property
    def n_rules(self):
        """Number of rules."""
        return self.n_clusters or prod(self.counts)

    def n_terms(self, inputs):
        """Number of terms, of scattered rules on so many inputs."""
        return self.n_clusters * inputs.size or sum(count for count in self.counts if count > 1)

    def describe(self):
        """In words."""
        if self.n_rules == 1:
            return "one rule"
        if self.n_clusters:
            return f"{self.n_clusters} scattered rules"
        return f"grid {list(self.counts)}"

    def with_one_more_term(self, j):
        """The grid with one more term on an input."""
        counts = list(self.counts)
        counts[j] += 1
        return replace(self, counts=tuple(counts))

    def with_more_clusters(self):
        """Half as many scattered rules again, two at least."""
        return replace(self, n_clusters=max(2, int(np.ceil(_MORE_CLUSTERS * self.n_clusters))))


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

    def of(self, candidate: Candidate, rows: StandardisedData):
        """The antecedent of a candidate; clusters are sought in the rows."""
        if not candidate.n_clusters:
            return grid_antecedent(self.families, candidate.counts, self.spacing)
        clusterer = KMeans(candidate.n_clusters, n_init=1, random_state=self.seed)
        return clustered_antecedent(
            self.families,
            rows,
            lambda table, weight: clusterer.fit(table, sample_weight=weight).labels_,
            self.inputs,
        )


def term_scores(tuned: Tuned, inputs: np.ndarray, centers: np.ndarray):
    """How much the residual of a linear model asks for two terms on each input, (n_inputs,).

    With w the share of the upper of two Gaussian terms on an input, at ``centers``, (n_inputs, 2),
    and r the residual, the statistic is the sum over basis functions b of
    (sum s w b r)^2 / sum s (w b)^2.
    """
    problem, rows = tuned.problem, tuned.problem.rows
    weight, distance = rows.sample_weight, np.diff(centers, axis=1).ravel()
    assert weight is not None  # a search sample has them
    # The log of the ratio of two such Gaussians has this slope.
    slope = -8.0 * np.log(OVERLAP) / distance
    shares = 1.0 / (1.0 + np.exp(-slope * (rows.X[:, inputs] - centers.mean(axis=1))))
    shares -= np.average(shares, axis=0, weights=weight)
    basis = np.column_stack([np.ones(rows.n_rows), rows.X[:, problem.consequent_inputs]])
    scale = (basis**2).T @ (weight[:, None] * shares**2)
    statistic = np.zeros(inputs.size)
    for part, residual, own in problem.residuals(tuned.evaluation):
        for one in residual:
            along = basis[part].T @ (shares[part] * (own * one)[:, None])
            statistic += np.sum(along**2 / np.maximum(scale, np.finfo(float).tiny), axis=0)
    return statistic
