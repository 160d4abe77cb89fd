r"""Order statistics with a mass for every row, and one more for the row that is to come.

Each of K units (rows, or groups of rows) and of a new one has the mass 1 / (K + 1); a group's is
shared by its rows, the new one's lies at infinity. A score covers with probability c where the rows
of this score or less have the mass c.
"""

from bisect import bisect_left

import numpy as np

__all__ = [
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

    Of weighted rows that of an unweighted sample as precise, (sum s)^2 / sum s^2 (Kish 1965).
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


def is_enough(mass, coverage):
    """Whether a mass is the coverage or more, up to rounding."""
    return mass >= coverage - _ROUNDING


def n_needed(coverage):
    """The least number of units with K / (K + 1) >= coverage."""
    return int(np.ceil(coverage / (1.0 - coverage) - _ROUNDING))


def score_quantile(scores, masses, coverage):
    """The smallest score at or below which lies the mass ``coverage``; NaN counts as infinite."""
    scores = np.where(np.isnan(scores), np.inf, scores)
    order = np.argsort(scores)
    place = np.searchsorted(np.cumsum(masses[order]), coverage - _ROUNDING)
    return scores[order[place]] if place < scores.size else np.inf


def group_scores(scores, masses, groups, coverage):
    """Of every group the score that ``coverage`` of its rows do not exceed, and its mass."""
    found = []
    for number in np.unique(groups[masses > 0.0]):
        part = groups == number
        mass = masses[part].sum()
        found.append((score_quantile(scores[part], masses[part] / mass, coverage), mass))
    return tuple(np.transpose(found))


def one_row_per_group(scores, masses, groups, coverage):
    """The median of the quantiles that one row drawn from every group would give.

    The smallest score q with P(N(q) >= ceil((K + 1) c)) >= 1 / 2, N the number of rows drawn of a
    score of q or less: a sum of indicators of the groups (Dunn, Wasserman and Ramdas 2023).
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
