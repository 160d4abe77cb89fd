r"""The choice: of all candidates nearly as good as the best, the one that is easiest to read.

Let e^2 be the squared error expected of new rows, and v that of the mean as a prediction. A
candidate is within the tolerance of ``simplicity`` s if (docs/mathematics.rst says why)

    e^2 - e_best^2  <=  ((1 + s)^2 - 1) min(e_best^2, v - e_best^2) .

Candidates within the tolerance that have no more rules than the best compete. Those whose rules
beat the mean one by one, e^2 plus their disagreement being at most v, go before all others. Then
the lowest reading cost wins; then rules that share their terms; then the smaller error. Shared
slopes are a claim about each rule: the squared error of the rules one by one must stay below v, or
their error rise by s at most. Half of what is left of the tolerance goes into agreement
(``start``).
"""

from dataclasses import dataclass

import numpy as np

from .candidates import Candidate

# A gain below this part of the target's variance is no gain: nobody reads rules for a
# hundred-thousandth of its deviation, and where a line is exact the gain is a rounding error.
_NOTHING = 1e-10


@dataclass(frozen=True, eq=False)
class Judged:
    """A candidate, and its errors on the rows that judge."""

    candidate: Candidate
    in_folds: list[Candidate]  # the candidate of the same size in every fold
    squares: np.ndarray  # squared errors on the rows that judge, summed over outputs
    free_squares: np.ndarray  # the same without monotonic constraints
    squared_error: float  # expected on new rows, once trained on all rows
    cost: int  # reading cost
    squared_error_of_rules: float  # of the rules one by one, each on the rows on which it fires

    def rules_beat_mean(self, variance):
        """Whether the rules one by one do; ``variance`` is the mean's squared error."""
        return self.squared_error_of_rules <= variance


@dataclass(frozen=True, eq=False)
class Judges:
    """The rows that judge: their weights and groups; errors within a group are not independent."""

    weight: np.ndarray
    group: np.ndarray
    certain: float  # standard errors by which several rules must beat one

    @classmethod
    def of(cls, parts, certain):
        """From the rows that each fold has left out."""
        weight = np.concatenate([rows.sample_weight for rows in parts])
        groups = np.arange(weight.size)
        if all(rows.groups is not None for rows in parts):
            named = np.concatenate([rows.groups for rows in parts])
            found = np.unique(named, return_inverse=True)[1]
            # A single group has no standard error: then rows count as independent.
            groups = found if found.any() else groups
        return cls(weight, groups, certain)

    def mean(self, squares) -> float:
        """Weighted mean of squared errors."""
        return float(np.average(squares, weights=self.weight))

    def are_less(self, squares, than, n_errors=1.0) -> bool:
        """Whether ``squares`` are below ``than`` on average, by more than some standard errors."""
        gain = than - squares
        mean = self.mean(gain)
        excess = np.bincount(self.group, self.weight * (gain - mean))
        error = np.sqrt(np.sum(excess**2)) / np.sum(self.weight)
        return bool(mean > max(n_errors * error, _NOTHING))


def best_of(judged, judges: Judges) -> Judged:
    """The candidate of the smallest error, where a higher reading cost must gain beyond chance."""
    best, *others = sorted(judged, key=lambda one: one.cost)
    line = best
    for one in others:
        best = one if judges.are_less(one.squares, best.squares) else best
        line = best if best.candidate.n_rules == 1 else line
    return best if judges.are_less(best.squares, line.squares, judges.certain) else line


def tolerated(least: float, variance: float, simplicity: float) -> float:
    """The largest squared error within the tolerance; ``least`` is that of the best candidate."""
    excess = (1.0 + simplicity) ** 2 - 1.0
    return least + excess * min(least, max(variance - least, 0.0))


def within(judged, best: Judged, most):
    """The candidates with at most this squared error, and no more rules than the best."""
    n_rules = best.candidate.n_rules
    return [one for one in judged if one.squared_error <= most and one.candidate.n_rules <= n_rules]


def chosen(found, variance):
    """The easiest to read, by the module's rule; ``variance`` is the mean's squared error."""

    def key(one):
        has_own = one.candidate.kind == "scattered"
        return not one.rules_beat_mean(variance), one.cost, has_own, one.squared_error

    return min(found, key=key)
