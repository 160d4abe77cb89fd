"""What a search may try: structures, the rules they begin with, the inputs worth a try."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans

from ..cluster import FuzzyCMeans, SubtractiveClustering
from ..learning.data import StandardisedData
from ..membership import Membership
from .clusters import clustered_antecedent
from .grid import OVERLAP, Spacing, grid_antecedent
from .tuning import Tuned

# More nobody reads.
MOST_RULES = 36
_IN_WORDS = {
    "k-means": "{} scattered rules",
    "fcm": "{} fuzzy clusters",
    "subtractive": "clusters of radius {}",
}


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: terms per input, or the clusters of a clustering."""

    counts: tuple[int, ...] | None
    size: float | None = None  # number of clusters, or the radius that they have
    clustering: str = ""  # "k-means", "subtractive" or "fcm"

    def describe(self):
        """In words."""
        if self.counts is not None:
            return f"grid {list(self.counts)}"
        return _IN_WORDS[self.clustering].format(self.size)


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
    seed : int or RandomState
        Of the clustering.
    """

    families: Sequence[type[Membership]]
    inputs: np.ndarray
    spacing: Spacing
    seed: int | np.random.RandomState

    def of(self, candidate: Candidate, rows: StandardisedData):
        """The antecedent of a candidate; clusters are sought in the rows."""
        if candidate.counts is not None:
            return grid_antecedent(self.families, candidate.counts, self.spacing)
        clusterer = self._clusterer(candidate, rows.y.shape[1])
        return clustered_antecedent(
            self.families,
            rows,
            lambda table, weight: clusterer.fit(table, sample_weight=weight).labels_,
            self.inputs,
        )

    def _clusterer(self, candidate, n_outputs):
        if candidate.clustering == "subtractive":
            # Distances grow with the root of the columns' number.
            radius = candidate.size * np.sqrt(0.5 * (self.inputs.size + n_outputs))
            return SubtractiveClustering(radius=radius, max_clusters=MOST_RULES)
        if candidate.clustering == "fcm":
            return FuzzyCMeans(candidate.size, m="auto", random_state=self.seed)
        return KMeans(candidate.size, n_init=1, random_state=self.seed)


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
