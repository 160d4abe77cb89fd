"""A structure that a search may try, and the rules that it begins with."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans

from ..cluster import FuzzyCMeans, SubtractiveClustering
from ..learning.data import StandardisedData
from ..membership import Membership
from .clusters import clustered_antecedent
from .grid import Spacing, grid_antecedent

__all__ = ["MOST_RULES", "Candidate", "RuleBases"]

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
    family: type[Membership] | None = None  # where it is another one than that of the search

    def describe(self):
        """In words."""
        family = "" if self.family is None else f", {self.family.name}"
        if self.counts is not None:
            return f"grid {list(self.counts)}{family}"
        return _IN_WORDS[self.clustering].format(self.size) + family


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
    overlap : float
        Membership at which neighbours of a grid cross.
    seed : int or RandomState
        Of the clustering.
    """

    families: Sequence[type[Membership]]
    inputs: np.ndarray
    spacing: Spacing
    overlap: float
    seed: int | np.random.RandomState

    def of(self, candidate: Candidate, rows: StandardisedData):
        """The antecedent of a candidate; clusters are sought in the rows."""
        families = self.families
        if candidate.family is not None:
            families = [candidate.family] * len(families)
        if candidate.counts is not None:
            return grid_antecedent(families, candidate.counts, self.spacing, self.overlap)
        clusterer = self._clusterer(candidate, rows.y.shape[1])
        return clustered_antecedent(
            families,
            rows,
            lambda table, weight: clusterer.fit(table, sample_weight=weight).labels_,
            self.inputs,
            candidate.clustering == "k-means",
        )

    def _clusterer(self, candidate, n_outputs):
        if candidate.clustering == "subtractive":
            # Distances grow with the root of the columns' number.
            radius = candidate.size * np.sqrt(0.5 * (self.inputs.size + n_outputs))
            return SubtractiveClustering(radius=radius, max_clusters=MOST_RULES)
        if candidate.clustering == "fcm":
            return FuzzyCMeans(candidate.size, m="auto", random_state=self.seed)
        return KMeans(candidate.size, n_init=1, random_state=self.seed)
