r"""Order statistics with a mass for every row, and one more for the row that is to come.

Of K units (rows, or groups of rows) and a new one that might have come in any other's place, each
has the mass 1 / (K + 1); that of a group is shared by its rows. The mass of the new one lies at
infinity. A score s covers with probability c where the rows of score s or less have the mass c:
without groups, where s is the ceil((K + 1) c)-th smallest.
"""

from bisect import bisect_left
from numbers import Real

import numpy as np

__all__ = [
    "check_level",
    "group_scores",
    "is_enough",
    "n_needed",
    "one_row_per_group",
    "row_masses",
    "score_quantile",
]

# What rounding leaves of a sum of masses.
_ROUNDING = 1e-9


def row_masses(n_rows, sample_weight=None, groups=None):
    """The mass of every row, (n_rows,), and the number of units.

    Weights say how often a row counts beside the others, not how many rows there are: the number of
    units is that of an unweighted sample of the same precision, (sum s)^2 / sum s^2 (Kish 1965).
    """
    weight = np.ones(n_rows) if sample_weight is None else sample_weight / np.max(sample_weight)
    if groups is None:
        total = np.sum(weight)
        n_units = float(total**2 / np.sum(weight**2))
        return weight * (n_units / (total * (n_units + 1.0))), n_units
    totals = np.bincount(groups, weights=weight)
    n_units = float(np.count_nonzero(totals))
    share = weight / np.where(totals > 0.0, totals, 1.0)[groups]
    return share / (n_units + 1.0), n_units


def check_level(name, level):
    """Raise ValueError unless a level is a number between 0 and 1."""
    if not (isinstance(level, Real) and 0.0 < float(level) < 1.0):
        raise ValueError(f"{name}={level!r} must be a number between 0 and 1.")


def is_enough(mass, coverage):
    """Whether a mass is the coverage or more, up to rounding."""
    return mass >= coverage - _ROUNDING


def n_needed(coverage):
    """The least number of units with K / (K + 1) >= coverage."""
    return int(np.ceil(coverage / (1.0 - coverage) - _ROUNDING))


def score_quantile(scores, masses, coverage):
    """The smallest score (n_rows,) below or at which lies the mass ``coverage``; infinite if none.

    NaN counts as infinite: what was not predicted is not covered by any width.
    """
    scores = np.where(np.isnan(scores), np.inf, scores)
    order = np.argsort(scores)
    place = np.searchsorted(np.cumsum(masses[order]), coverage - _ROUNDING)
    return scores[order[place]] if place < scores.size else np.inf


def group_scores(scores, masses, groups, coverage):
    """Of every group the smallest score that ``coverage`` of its rows do not exceed, and its mass.

    A group so is one observation of what groups do: a score that a new group's does not exceed
    covers that part of its rows, or more.
    """
    present = [number for number in np.unique(groups) if masses[groups == number].any()]
    parts = [groups == number for number in present]
    shares = [masses[part] / masses[part].sum() for part in parts]
    found = [
        score_quantile(scores[part], share, coverage)
        for part, share in zip(parts, shares, strict=True)
    ]
    return np.array(found), np.array([masses[part].sum() for part in parts])


def one_row_per_group(scores, masses, groups, coverage):
    """The median of the quantiles that one row drawn from every group would give.

    Of K rows, one from each group, and one of a new group, the ceil((K + 1) c)-th smallest score
    covers the new one with probability c (Dunn, Wasserman and Ramdas 2023). The median over all
    draws is the smallest score q such that P(N(q) >= ceil((K + 1) c)) >= 1 / 2, N the number of
    rows drawn of a score of q or less, a sum of K indicators with the groups' own probabilities.
    """
    scores = np.where(np.isnan(scores), np.inf, scores)
    numbers, place = np.unique(groups, return_inverse=True)
    kept = masses > 0.0
    share = np.where(kept, masses, 0.0) / np.where(kept, np.bincount(place, masses)[place], 1.0)
    present = np.unique(place[kept])
    needed = int(np.ceil((present.size + 1) * coverage - _ROUNDING))
    values = np.unique(scores[kept])

    def is_reached(q):
        below = np.bincount(place, share * (scores <= q), minlength=numbers.size)[present]
        return _at_least(below, needed) >= 0.5 - _ROUNDING

    first = bisect_left(values, True, key=is_reached)
    return values[first] if first < values.size else np.inf


def _at_least(probabilities, needed):
    """The probability that so many of independent events happen, or more."""
    counts = np.zeros(probabilities.size + 1)
    counts[0] = 1.0
    for p in np.clip(probabilities, 0.0, 1.0):
        counts[1:] = counts[1:] * (1.0 - p) + counts[:-1] * p
        counts[0] *= 1.0 - p
    return counts[needed:].sum()
