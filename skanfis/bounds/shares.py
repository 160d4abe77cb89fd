r"""What normalised strengths can be on a box, and what a mean with them as weights can be.

Strengths are products of shares, one of each factor: a softmax of sums l_k of log mu. Each share
is enclosed twice, from the ranges of all l_k, and by the mean value theorem about the middle. A
mean sum_k nu_k v_k is bounded by weak duality; docs/bounds.rst has the formulas.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent import Antecedent
from .arithmetic import EPS, ROUNDINGS, size
from .terms import TermRanges, ranges

__all__ = ["Factor", "Shares", "factors", "largest_mean", "smallest_mean", "term_ranges"]


@dataclass(frozen=True, eq=False)
class Factor:
    """Shares that sum to one: by input, positions of the terms (n_shares, n) whose log mu add up.

    The number of all terms stands for none.
    """

    terms: dict[int, np.ndarray]

    def total(self, by_term):
        """Sums over each share's terms, (n_shares, n_boxes); ``by_term`` ends in a row of zeros."""
        return sum(by_term[places].sum(axis=1) for places in self.terms.values())

    def along(self, by_term):
        """The same along each input: dict of (n_shares, n_boxes)."""
        return {j: by_term[places].sum(axis=1) for j, places in self.terms.items()}


@dataclass(frozen=True, eq=False)
class Shares:
    """The shares of one factor in every box, (n_shares, n_boxes) each."""

    middle: np.ndarray  # at the middle of the box
    low: np.ndarray
    high: np.ndarray
    error: np.ndarray  # of the logarithm of a share as it is computed, at most
    departure: dict[int, tuple[np.ndarray, np.ndarray]]  # range of D along each input
    curvature: dict[int, tuple[np.ndarray, np.ndarray]]  # of d^2 l / dx_j^2


def factors(antecedent: Antecedent):
    """The factors of a rule base, in the order of its rules."""
    return [Factor(terms) for terms in antecedent.factor_terms()]


def term_ranges(antecedent: Antecedent, low, high):
    """Ranges of all terms over boxes (n_inputs, n_boxes), with a row of zeros at the end."""
    parts = [ranges(group, low, high) for group in antecedent.groups]
    parts.append(TermRanges(*[np.zeros((1, low.shape[1]))] * len(TermRanges._fields)))
    return TermRanges(*map(np.concatenate, zip(*parts, strict=True)))


def enclosed(factor: Factor, terms: TermRanges, log_mu, half):
    """The :class:`Shares` of a factor; ``log_mu`` at the middles, ``half`` the boxes' widths."""
    low, high = factor.total(terms.low), factor.total(terms.high)
    error = factor.total(terms.error)
    middle = factor.total(log_mu)
    middle = np.exp(middle - middle.max(axis=0))
    middle /= middle.sum(axis=0)
    least, most = _by_range(low, high)
    slopes_low, slopes_high = factor.along(terms.slope_low), factor.along(terms.slope_high)
    slack = EPS * (ROUNDINGS + least.shape[0])
    for _ in range(2):
        shares = Shares(middle, least, most, error, {}, {})
        departure = _departures(shares, slopes_low, slopes_high)
        # The mean error of all counts for each: the sum of the softmax.
        common = np.minimum((most * error).sum(axis=0), error.max(axis=0))
        each = error + common + slack
        radius = sum(size(ends) * half[j] for j, ends in departure.items()) + 4.0 * each
        least = np.fmax(least, middle * np.exp(-radius))
        most = np.fmin(most, middle * np.exp(radius))
    curve_low, curve_high = factor.along(terms.curve_low), factor.along(terms.curve_high)
    curvature = {j: (curve_low[j], high) for j, high in curve_high.items()}
    return Shares(middle, least, most, each, departure, curvature)


def _by_range(low, high):
    """Shares from the ranges of their logarithms alone."""
    top = high.max(axis=0)
    down, up = np.exp(low - top), np.exp(high - top)
    n = down.shape[0]
    slack = (n + ROUNDINGS) * EPS
    others_up, others_down = up.sum(axis=0) - up, down.sum(axis=0) - down
    # What the subtraction has lost counts as being there.
    least = down / (down + np.maximum(others_up, 0.0) + 2.0 * slack * up.sum(axis=0))
    spare = np.maximum(others_down - 2.0 * slack * down.sum(axis=0), 0.0)
    most = np.minimum(up / (up + spare) * (1.0 + slack), 1.0)
    # Of a share that no box can give a strength to, nothing is left: 0 / 0.
    return np.nan_to_num(least * (1.0 - slack), nan=0.0), np.nan_to_num(most, nan=1.0)


def _departures(shares, slopes_low, slopes_high):
    found = {}
    for j, high in slopes_high.items():
        low = slopes_low[j]
        mean_low, mean_high = smallest_mean(low, [shares]), largest_mean(high, [shares])
        slack = 4.0 * ROUNDINGS * EPS * size((low, high))
        common = slack.max(axis=0, initial=0.0, where=shares.high > EPS)
        total = (shares.high * size((low, high))).sum(axis=0)
        common = common + EPS * (ROUNDINGS + low.shape[0]) * total
        found[j] = low - mean_high - slack - common, high - mean_low + slack + common
    return found


def largest_mean(values, every):
    """Upper bound of the mean of ``values`` (n_shares, ..., n_boxes) under all factors' shares."""
    for shares in reversed(every):
        middle = (shares.middle * values).sum(axis=-2)
        off = values - middle[..., None, :]
        values = middle + np.where(off > 0.0, shares.high * off, shares.low * off).sum(axis=-2)
    return values if every else values[0]


def smallest_mean(values, every):
    """Lower bound of the same."""
    return -largest_mean(-values, every)
