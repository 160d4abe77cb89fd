"""A structure that a search may try."""

from dataclasses import dataclass

from ..membership import Membership

__all__ = ["Candidate"]

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
    is_loose: bool = False  # whether its training begins with the premises (see ``tuning``)
    family: type[Membership] | None = None  # where it is another one than that of the search

    def describe(self):
        """In words."""
        family = "" if self.family is None else f", {self.family.name}"
        if self.counts is not None:
            return f"grid {list(self.counts)}{family}"
        return _IN_WORDS[self.clustering].format(self.size) + family
