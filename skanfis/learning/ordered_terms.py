r"""The terms of one input, one after another: the gaps between them, and widths that go with these.

* *In order, and where there are data.* The m terms that an input has, where no two are in the same
  place, divide its range, and a little beyond, into m + 1 gaps g. What moves are the ratios of
  neighbouring gaps, within bounds. No term can pass its neighbour or leave the data, and no gap is
  much wider than the next.
* *Of a width that goes with their distance.* With g_l and g_r the gaps beside term k, let its width
  be w_k where it is half true at half the wider of them, and W_k where it is 0.9 true at half the
  narrower one (smooth maximum and minimum, (g_l^p + g_r^p)^(1/p), p = 8 and -8). Its own width is
  w_k^(1 - v) W_k^v, and what moves is v, from 0 to 1. So two neighbours cross nowhere above 0.9:
  they can be told apart. And nowhere below 0.5: wherever a row is between two terms, one of them is
  true. An outermost term that moves inward has as its outer gap twice the way that it has gone: it
  stays true where it came from.

``is_free`` is the classic ANFIS: terms stay in order, but may leave the data by their distance, and
be four times as wide. It fits exact data better, by rules that cannot be read.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from ..membership import GREATEST_CROSSING, LEAST_TRUTH

__all__ = ["LOG_FACTOR", "LOG_FLATTER", "OrderedTerms", "Term", "terms_of"]

# Neighbouring gaps differ at most by this factor, the outer ones by the second from the next.
_LOG_RATIO, _LOG_OUTER = np.log(2.2), np.log(1.45)
# A ratio of gaps changes by so much, as a logarithm, per displacement: a term between two others
# that moves by some part of a gap then pays about as much as a width that changes by it.
_LOG_UNIT = 3.0**0.5
# Where the least a term may reach to passes the most, there is nothing between. Families that are
# flat at the top leave less room than this; their widths go with the nearer neighbour alone, and
# shrink by the factor by which Gaussians may where gaps are even.
_LOG_ROOM = np.log(2.5)
_LOG_SHRINKAGE = np.log(1.165)
# What is free to move has room to, wherever it starts. Of the room between the ends, what is left
# wherever the gaps are.
_MOBILE = 0.01
_LEAST_SLOPE = 0.1
# Shapes, and widths of terms that share their place with others, may change by this one.
LOG_FACTOR = np.log(4.0)
# A shape that makes the top of an ordered term flat, and so truer next to a neighbour, by this.
LOG_FLATTER = np.log(1.5)
# Terms may leave the data by this part of their mean distance: a term as narrow as may be is still
# more than half true at the edge. Where they are free, by the second.
_BEYOND, _FREE_BEYOND = 0.25, 1.0
# Of the smooth minimum and maximum of two gaps.
_POWER = 8.0
# A gap that a step has closed, as part of the range.
_SMALLEST_GAP = 1e-9
# Widths that are looked at for the widest; digits of a term by which it is looked up, and how many.
_CHANGES = 128
_DIGITS, _MOST_KEPT = 9, 4096


@dataclass(frozen=True, eq=False)
class Term:
    """Where one term's parameters are in the vector of all."""

    family: type
    input: int
    positions: np.ndarray
    location: int
    widths: np.ndarray
    shapes: np.ndarray
    is_width: np.ndarray  # of every position


def terms_of(antecedent):
    """All terms of an antecedent."""
    terms, start = [], 0
    for group in antecedent.groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        is_location, is_width = kinds == "location", kinds == "log_width"
        is_shape = kinds == "log_shape"
        positions = start + np.arange(group.theta.size).reshape(group.theta.shape)
        for own, j in zip(positions.T, group.inputs, strict=True):
            location, widths, shapes = own[is_location][0], own[is_width], own[is_shape]
            terms.append(Term(group.family, int(j), own, location, widths, shapes, is_width))
        start += group.theta.size
    return terms


@dataclass(frozen=True, eq=False)
class OrderedTerms:
    """The terms of one input, one after another.

    ``locations`` are their positions in the vector, ``widths`` those of all their widths, ``terms``
    which term each of these belongs to; ``low`` and ``high`` the ends of the range. ``basis`` and
    ``inverse`` lead from displacements to logarithms of gaps, but for a constant, and back. Both
    ``part`` and ``span`` are of every term: where its widths start between the least and the most,
    and how far these are apart.
    """

    locations: np.ndarray
    widths: np.ndarray
    terms: np.ndarray
    low: float
    high: float
    log_gaps: np.ndarray
    basis: np.ndarray
    inverse: np.ndarray
    part: np.ndarray
    span: np.ndarray

    @classmethod
    def of(cls, own, parameters, low, high, is_free):
        """Of terms from left to right, with all parameters; ``low`` to ``high`` are the data."""
        locations = np.array([term.location for term in own])
        widths = np.concatenate([term.widths for term in own])
        terms = np.repeat(np.arange(len(own)), [term.widths.size for term in own])
        values = parameters[locations]
        spacing = (values[-1] - values[0]) / (values.size - 1)
        low, high = min(low, values[0]), max(high, values[-1])
        if not is_free:
            # Where the data go on further, as in a heavy tail, there is hardly a row.
            low = max(low, 2.0 * values[0] - values[1])
            high = min(high, 2.0 * values[-1] - values[-2])
        margin = (_FREE_BEYOND if is_free else _BEYOND) * spacing
        low, high = low - margin, high + margin
        gaps = np.diff(np.concatenate([[low], values, [high]]))
        n = gaps.size
        if is_free:
            # Orthonormal columns that sum to zero: right singular vectors of ones.
            basis = np.linalg.svd(np.ones((1, n)))[2][1:].T
            inverse = basis.T
        else:
            basis = _LOG_UNIT * np.tril(np.ones((n, n - 1)), -1)
            inverse = np.diff(np.eye(n), axis=0) / _LOG_UNIT
        # The nearer neighbour alone counts, until it is known what the terms may be.
        part, span = np.ones(n - 1), np.full(n - 1, np.inf)
        return cls(locations, widths, terms, low, high, np.log(gaps), basis, inverse, part, span)

    def between(self, least, most):
        """The same with widths between two ends, given by the change of their logarithms."""
        return replace(self, part=-least / (most - least), span=most - least)

    def within_reach(self, own, parameters):
        """The terms with widths between their ends, and these: the changes of their logarithms."""
        near, far = self.at_start
        most = np.array([_widest(t, parameters, r) for t, r in zip(own, np.exp(near), strict=True)])
        least = np.array(
            [_narrowest(t, parameters, r) for t, r in zip(own, np.exp(far), strict=True)]
        )
        row = self
        # Between gaps of whatever sizes are allowed, the ends must not pass each other.
        is_even = (far - near <= _LOG_RATIO + _MOBILE).all()
        has_room = (most - least + far - near >= _LOG_ROOM).all() and (most - least > _MOBILE).all()
        if is_even and has_room:
            row = self.between(least, most)
        else:
            least = np.full(most.size, -_LOG_SHRINKAGE)
        return row, np.minimum(least, -_MOBILE), np.maximum(most, 0.0)

    def bounds(self):
        """Of the displacements of the gaps: neighbouring gaps stay of one size."""
        ratios = np.diff(self.log_gaps)
        lower, upper = np.full(ratios.size, -_LOG_RATIO), np.full(ratios.size, _LOG_RATIO)
        # Beyond the outermost term there is no other to share a gap with; nor is there need of one.
        lower[0], upper[-1] = -_LOG_OUTER, _LOG_OUTER
        upper[0], lower[-1] = ratios[0] + LOG_FACTOR, ratios[-1] - LOG_FACTOR
        lower, upper = np.minimum(lower - ratios, -_MOBILE), np.maximum(upper - ratios, _MOBILE)
        return lower / _LOG_UNIT, upper / _LOG_UNIT

    def gaps(self, displacement):
        """The gaps at a displacement, of all entries of the vector."""
        logs = self.log_gaps + self.basis @ displacement[self.locations]
        gaps = np.exp(logs - logs.max())
        return gaps * ((self.high - self.low) / gaps.sum())

    def gaps_of(self, values):
        """Gaps of any locations; where these are out of order, as little as can be."""
        gaps = np.diff(np.concatenate([[self.low], values, [self.high]]))
        return np.maximum(gaps, _SMALLEST_GAP * (self.high - self.low))

    def from_gaps(self, gaps):
        """The displacements of the locations at which the gaps are these."""
        return self.inverse @ (np.log(gaps) - self.log_gaps)

    def near(self, gaps):
        """Log of every term's distance to the nearer neighbour."""
        return self._reach(gaps)[0]

    def far(self, gaps):
        """The same for the farther one; an outermost term covers where it has moved from, too."""
        return self._reach(gaps)[1]

    def _reach(self, gaps):
        """Both, and the powers of gaps that they are sums of; covered gaps last."""
        # No gap beyond the outermost terms counts for the minimum.
        steep = gaps**-_POWER
        steep[0] = steep[-1] = 0.0
        # The outer ones are as if there were a neighbour beyond where that term was.
        covered = gaps.copy()
        covered[0] = 2.0 * max(gaps[0] - self._outer[0], 0.0)
        covered[-1] = 2.0 * max(gaps[-1] - self._outer[1], 0.0)
        high = covered**_POWER
        near = np.log(steep[:-1] + steep[1:]) / -_POWER
        return near, np.log(high[:-1] + high[1:]) / _POWER, steep, high, covered

    @staticmethod
    def _slopes(gaps, reach):
        """Derivatives of near and far by the gaps on the left and on the right of every term."""
        _, _, steep, high, covered = reach
        of_near, total = steep / gaps, steep[:-1] + steep[1:]
        by_near = np.array([of_near[:-1], of_near[1:]]) / total
        # A gap that covers nothing has no slope.
        of_far = high / np.where(covered > 0.0, covered, 1.0)
        by_far = np.array([of_far[:-1], of_far[1:]]) / (high[:-1] + high[1:])
        by_far[0, 0] *= 2.0
        by_far[1, -1] *= 2.0
        return by_near, by_far

    @cached_property
    def _outer(self):
        return tuple(np.exp(self.log_gaps[[0, -1]]).tolist())

    @cached_property
    def at_start(self):
        """What near and far are there."""
        return self._reach(np.exp(self.log_gaps))[:2]

    def _since_start(self, reach):
        """What near and far have changed by, and where the ends of a term's widths meet."""
        near, far = reach[0] - self.at_start[0], reach[1] - self.at_start[1]
        # The ends never pass each other, nor quite meet.
        lowest = far - (1.0 - _LEAST_SLOPE) * self.span
        return np.maximum(near, lowest), far, near < lowest

    def widening(self, displacement, gaps):
        """What the logarithms of the widths change by, beside their displacements."""
        near, far, _ = self._since_start(self._reach(gaps))
        t = self.terms
        between = self.part[t] + displacement[self.widths] / self.span[t]
        return (1.0 - between) * far[t] + between * near[t]

    def from_widths(self, change, gaps):
        """The displacements at which the logarithms of the widths have changed by so much."""
        near, far, _ = self._since_start(self._reach(gaps))
        t = self.terms
        own = change - (1.0 - self.part[t]) * far[t] - self.part[t] * near[t]
        return own / self._slope(near, far)[t]

    def _slope(self, near, far):
        """Of a term's log widths by their displacements: the ends come nearer, or part."""
        return 1.0 + (near - far) / self.span

    def jacobian(self, displacement):
        """Derivatives of locations and log widths by the locations' displacements.

        And those of the log widths by their own.
        """
        gaps = self.gaps(displacement)
        by_gap = gaps[:, None] * (self.basis - (gaps @ self.basis) / gaps.sum())
        t = self.terms
        between = self.part[t] + displacement[self.widths] / self.span[t]
        reach = self._reach(gaps)
        near, far, meets = self._since_start(reach)
        by_near, by_far = self._slopes(gaps, reach)
        by_near = np.where(meets, by_far, by_near)
        left, right = (1.0 - between) * by_far[:, t] + between * by_near[:, t]
        by_width = left[:, None] * by_gap[t] + right[:, None] * by_gap[t + 1]
        own = self._slope(near, far)[t]
        return by_gap.cumsum(axis=0)[:-1], by_width, own


def _narrowest(term, raw, reach):
    """The least change of a term's log widths at which it is half true half its reach away."""
    return _in_units_of(reach, term, raw, _least_change)


def _widest(term, raw, reach):
    """How much a term's widths may grow, the rest of it anywhere: the change of their logarithm."""
    return _in_units_of(reach, term, raw, _most_growth)


def _in_units_of(reach, term, raw, find):
    """What is found for the same term about zero, with lengths in units of its reach."""
    theta = raw[term.positions].copy()
    theta[term.is_width] -= np.log(reach)
    theta[term.positions == term.location] = 0.0
    # To digits that rounding errors do not reach: terms of one kind are looked up.
    return find(
        term.family, tuple(np.round(theta, _DIGITS).tolist()), tuple(term.is_width.tolist())
    )


@lru_cache(maxsize=_MOST_KEPT)
def _least_change(family, theta, is_width):
    changes = np.linspace(-LOG_FACTOR, LOG_FACTOR, 2 * _CHANGES)
    moved = np.array(theta)[:, None] + np.array(is_width)[:, None] * changes
    log_truth = [family.log_value(np.full((changes.size, 1), x), moved)[:, 0] for x in (-0.5, 0.5)]
    is_true = np.exp(np.min(log_truth, axis=0)) >= LEAST_TRUTH
    return float(changes[is_true.argmax()]) if is_true.any() else np.inf


@lru_cache(maxsize=_MOST_KEPT)
def _most_growth(family, theta, is_width):
    growth = np.linspace(0.0, LOG_FACTOR, _CHANGES)
    # A steep flank beside a large width is truer than both at their largest: all are tried.
    ranges = [
        (growth, np.full(_CHANGES, -_LOG_SHRINKAGE))
        if is_one
        else np.full((2, _CHANGES), [[LOG_FLATTER], [-LOG_FACTOR]])
        for is_one in is_width[1:]
    ]
    truth = np.zeros((2, _CHANGES))
    for changes in product(*ranges):
        # A family's location is its first parameter.
        moved = np.array(theta)[:, None] + np.vstack([np.zeros(_CHANGES), *changes])
        logs = [family.log_value(np.full((_CHANGES, 1), x), moved)[:, 0] for x in (-0.5, 0.5)]
        truth = np.maximum(truth, np.exp(logs))
    # A term that is true to one side for good has its flank on the other.
    flanks = [values for values in truth if values[0] < GREATEST_CROSSING]
    if not flanks:
        return 0.0
    return float(growth[np.flatnonzero(np.max(flanks, axis=0) <= GREATEST_CROSSING)[-1]])
