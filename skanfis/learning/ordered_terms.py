r"""The ordered terms of one input: they move by the gaps between them, and widths follow the gaps.

* *In order, and where there are data.* The m terms of an input, if no two share a place, divide its
  range and a margin on either side into m + 1 gaps g. The displacements change the ratios of
  neighbouring gaps, within bounds.
* *As wide as they are far apart.* A term's widths grow with the mean of the gaps beside it. Another
  displacement multiplies them by a factor. It is bounded so that the membership half-way to a
  neighbour is at least 0.5 and at most 0.9.

``is_unbounded`` is the classic ANFIS: terms stay in order, but may leave the data by the distance
between them, and be four times as wide. It fits exact data better, by rules that cannot be read.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

# Neighbouring gaps differ at most by the first factor. The gap beyond an outermost term is at most
# the second factor times the next gap.
_LOG_RATIO, _LOG_OUTER = np.log(2.2), np.log(1.45)
# Change of the log ratio of two gaps per unit of displacement. By this unit, a term that moves by
# some part of a gap pays about as much stiffness as a width that changes by the same part.
_LOG_UNIT = 3.0**0.5
# Least room to move, even for a displacement that starts on a bound.
_MOBILE = 0.01
# Shapes, and widths of terms that are not ordered, may change by this factor.
LOG_FACTOR = np.log(4.0)
# Shapes of ordered terms may grow by this factor: a flatter top is higher next to a neighbour.
_LOG_FLATTER = np.log(1.5)
# Terms may leave the data by this part of their mean distance: even the narrowest has a membership
# above 0.5 at the edge of the data then. Unbounded terms may leave by the whole distance.
_BEYOND = 0.25
# Displacements, and gaps as parts of the range, below this are rounding errors.
NEXT_TO_NOTHING = 1e-9
# Limits of a membership half-way between two terms: above the second, no reader can tell which of
# the two is meant.
_LEAST_TRUTH, _GREATEST_CROSSING = 0.5, 0.9
# Factors of a width that are tried to find the least and the largest.
_CHANGES = 256


@dataclass(frozen=True, eq=False)
class Term:
    """A term, and the positions of its parameters in the vector of all parameters."""

    family: type
    input: int
    positions: np.ndarray
    location: int
    widths: np.ndarray
    shapes: np.ndarray
    is_width: np.ndarray  # for every position


def terms_of(antecedent):
    """All terms of an antecedent."""
    terms = []
    for group in antecedent.with_parameters(np.arange(antecedent.parameters.size)).groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        is_width, is_shape = kinds == "log_width", kinds == "log_shape"
        for own, j in zip(group.theta.T, group.inputs, strict=True):
            # The first parameter is the location.
            widths, shapes = own[is_width], own[is_shape]
            terms.append(Term(group.family, int(j), own, own[0], widths, shapes, is_width))
    return terms


@dataclass(frozen=True, eq=False)
class OrderedTerms:
    """The terms of one input, one after another."""

    locations: np.ndarray  # positions of the locations in the vector of all parameters
    widths: np.ndarray  # positions of all widths
    terms: np.ndarray  # the term of each width
    low: float  # the ends of the range, margins included
    high: float
    log_gaps: np.ndarray  # at the start
    basis: np.ndarray  # maps displacements to log gaps, up to a constant
    inverse: np.ndarray  # maps log gaps to displacements

    @classmethod
    def of(cls, own, parameters, low, high, is_unbounded):
        """From terms in order, and the vector of all parameters; data lie in ``low``..``high``."""
        locations = np.array([term.location for term in own])
        widths = np.concatenate([term.widths for term in own])
        terms = np.repeat(np.arange(len(own)), [term.widths.size for term in own])
        values = parameters[locations]
        spacing = (values[-1] - values[0]) / (values.size - 1)
        low, high = min(low, values[0]), max(high, values[-1])
        if not is_unbounded:
            # No further beyond the outermost term than the next one: in a tail there are few rows.
            low = max(low, 2.0 * values[0] - values[1])
            high = min(high, 2.0 * values[-1] - values[-2])
        margin = spacing if is_unbounded else _BEYOND * spacing
        low, high = low - margin, high + margin
        gaps = np.diff(np.concatenate([[low], values, [high]]))
        n = gaps.size
        if is_unbounded:
            # Orthonormal columns that sum to zero: right singular vectors of ones.
            basis = np.linalg.svd(np.ones((1, n)))[2][1:].T
            inverse = basis.T
        else:
            basis = _LOG_UNIT * np.tril(np.ones((n, n - 1)), -1)
            inverse = np.diff(np.eye(n), axis=0) / _LOG_UNIT
        return cls(locations, widths, terms, low, high, np.log(gaps), basis, inverse)

    def bound(self, own, parameters, lower, upper):
        """Set the bounds of all displacements of these terms; the arguments as in :meth:`of`."""
        lower[self.locations], upper[self.locations] = self._bounds_of_gaps()
        reach = np.exp(self._start)
        changes = [_range(term, parameters, r) for term, r in zip(own, reach, strict=True)]
        least, most = np.array(changes).T
        lower[self.widths], upper[self.widths] = least[self.terms], most[self.terms]
        upper[np.concatenate([term.shapes for term in own])] = _LOG_FLATTER

    def _bounds_of_gaps(self):
        """Bounds of the displacements of the gaps, which keep neighbouring gaps of similar size."""
        ratios = np.diff(self.log_gaps)
        lower, upper = np.full(ratios.size, -_LOG_RATIO), np.full(ratios.size, _LOG_RATIO)
        # An outer gap has no term on its other side: it may shrink, but hardly exceed the next gap.
        lower[0], upper[-1] = -_LOG_OUTER, _LOG_OUTER
        upper[0], lower[-1] = ratios[0] + LOG_FACTOR, ratios[-1] - LOG_FACTOR
        lower, upper = np.minimum(lower - ratios, -_MOBILE), np.maximum(upper - ratios, _MOBILE)
        return lower / _LOG_UNIT, upper / _LOG_UNIT

    def gaps(self, displacement):
        """The gaps at a displacement, the vector of all entries."""
        logs = self.log_gaps + self.basis @ displacement[self.locations]
        gaps = np.exp(logs - logs.max())
        return gaps * ((self.high - self.low) / gaps.sum())

    def of_locations(self, values):
        """Gaps and displacements of any locations; gaps are tiny where these are out of order."""
        gaps = np.diff(np.concatenate([[self.low], values, [self.high]]))
        gaps = np.maximum(gaps, NEXT_TO_NOTHING * (self.high - self.low))
        return gaps, self.inverse @ (np.log(gaps) - self.log_gaps)

    @staticmethod
    def _beside(gaps):
        """The gaps to the left and right neighbour; an outermost term has its only one twice."""
        left, right = gaps[:-1].copy(), gaps[1:].copy()
        left[0], right[-1] = right[0], left[-1]
        return left, right

    def _reach(self, gaps):
        """Log of every term's mean distance to its neighbours."""
        return np.log(0.5 * np.sum(self._beside(gaps), axis=0))

    @cached_property
    def _start(self):
        return self._reach(np.exp(self.log_gaps))

    def widening(self, gaps):
        """Change of the log widths with the gaps, on top of the widths' own displacements."""
        return (self._reach(gaps) - self._start)[self.terms]

    def jacobian(self, displacement):
        """Derivatives of locations and log widths by the locations' displacements."""
        gaps = self.gaps(displacement)
        by_gap = gaps[:, None] * (self.basis - (gaps @ self.basis) / gaps.sum())
        total = np.sum(self._beside(gaps), axis=0)
        by_reach = np.sum(self._beside(by_gap), axis=0) / total[:, None]
        return by_gap.cumsum(axis=0)[:-1], by_reach[self.terms]


def _range(term, raw, reach):
    """Least and largest change of a term's log widths: membership 0.5 and 0.9 half-way."""
    theta = raw[term.positions].copy()
    theta[term.is_width] -= np.log(reach)
    theta[term.positions == term.location] = 0.0
    changes = np.linspace(-LOG_FACTOR, LOG_FACTOR, _CHANGES)
    moved = theta[:, None] + term.is_width[:, None] * changes
    truth = np.exp(term.family.log_value(np.array([-0.5, 0.5]), moved)).T
    # A shoulder stays near one on one side: its flank is the other side.
    flanks = [side for side in truth if side[0] < _GREATEST_CROSSING] or [truth[0]]
    is_true = np.min(flanks, axis=0) >= _LEAST_TRUTH
    is_distinct = np.max(flanks, axis=0) <= _GREATEST_CROSSING
    least = changes[is_true.argmax()] if is_true.any() else 0.0
    most = changes[np.flatnonzero(is_distinct)[-1]] if is_distinct.any() else 0.0
    return min(least, -_MOBILE), max(most, 0.0)
