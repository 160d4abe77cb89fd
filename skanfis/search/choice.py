r"""One rule of choice: of all candidates that are next to the best, the one that is read soonest.

With e^2 the squared error expected of new rows and v that of the mean, a candidate is within the
tolerance of ``simplicity`` s where (docs/mathematics.rst says why)

    e^2 - e_best^2  <=  ((1 + s)^2 - 1) min(e_best^2, v - e_best^2) .

Of all within it that have no more rules than the best, the one that costs least to read is taken:
of those, if there are any, whose rules err less than the mean one by one, e^2 and their
disagreement being below v. Of equal cost it is one whose terms are not each rule's own, then that
with the smaller error. Slopes in common are a claim about each rule: what the rules err one by one
must stay below v, or rise by s at most. Half of what is left of the tolerance goes into agreement
(``start``).
"""

from dataclasses import dataclass

import numpy as np

from .candidates import Candidate

# Of the target's variance: nobody reads rules for a hundred-thousandth of its deviation, and beside
# an exact line what they gain is rounding.
_NOTHING = 1e-10


@dataclass(frozen=True, eq=False)
class Judged:
    """A candidate, and what it left of rows that had no part in it."""

    candidate: Candidate
    in_folds: list[Candidate]  # its like in every fold
    squares: np.ndarray  # squared errors of these rows, summed over outputs
    free_squares: np.ndarray  # what they were if nothing had to rise or fall
    squared_error: float  # expected of new rows, once trained on all rows
    cost: int  # to read it
    squared_error_of_rules: float  # of the rules one by one, each on the rows on which it fires

    def rules_beat_mean(self, variance):
        """Whether they do one by one, ``variance`` being the mean's squared error."""
        return self.squared_error_of_rules <= variance


@dataclass(frozen=True, eq=False)
class Judges:
    """The rows that judge: their weights, and which of them are alike, those of one group."""

    weight: np.ndarray
    group: np.ndarray

    @classmethod
    def of(cls, parts):
        """Of the rows that each fold has left out."""
        weight = np.concatenate([rows.sample_weight for rows in parts])
        if any(rows.groups is None for rows in parts):
            return cls(weight, np.arange(weight.size))
        groups = np.unique(np.concatenate([rows.groups for rows in parts]), return_inverse=True)[1]
        # A single group says nothing.
        return cls(weight, groups if groups.any() else np.arange(weight.size))

    def mean(self, squares) -> float:
        """Of squared errors."""
        return float(np.average(squares, weights=self.weight))

    def are_less(self, squares, than) -> bool:
        """Whether squared errors are, by more than one standard error, and than next to nothing."""
        gain = than - squares
        mean = self.mean(gain)
        excess = np.bincount(self.group, self.weight * (gain - mean))
        error = np.sqrt(np.sum(excess**2)) / np.sum(self.weight)
        return bool(mean > max(error, _NOTHING))


def best_of(judged, judges: Judges) -> Judged:
    """That of the smallest error; what costs more to read must be better by more than chance."""
    best, *others = sorted(judged, key=lambda one: one.cost)
    for one in others:
        best = one if judges.are_less(one.squares, best.squares) else best
    return best


def tolerated(least: float, variance: float, simplicity: float) -> float:
    """The largest squared error that is within the tolerance, ``least`` being the best's."""
    excess = (1.0 + simplicity) ** 2 - 1.0
    return least + excess * min(least, max(variance - least, 0.0))


def within(judged, best: Judged, most):
    """All of at most this error and no more rules than the best."""
    n_rules = best.candidate.n_rules
    return [one for one in judged if one.squared_error <= most and one.candidate.n_rules <= n_rules]


def chosen(found, variance):
    """What is read soonest, ``variance`` being the mean's squared error; see the module."""

    def key(one):
        has_own = one.candidate.kind == "scattered"
        return not one.rules_beat_mean(variance), one.cost, has_own, one.squared_error

    return min(found, key=key)
