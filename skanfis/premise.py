r"""What a solver moves: premises as a vector of displacements from their start, within bounds.

Every entry is without unit and zero at the start, and one means much the same for all of them, a
change of some length by a factor of e. Terms stay what a person can read, by construction:

* *In order, and where there are data.* The m terms that an input has, where no two are in the same
  place, divide its range, and a little beyond, into m + 1 gaps g. What moves are the logarithms of
  the gaps, whose sum is fixed: log g = log g(0) + B x up to a constant, with orthonormal columns of
  B that sum to zero. No term can pass its neighbour or leave the data.
* *Of a width that goes with their distance.* With s_k the distance to the nearest neighbour, or
  rather its smooth minimum over the two sides, (g_l^-4 + g_r^-4)^(-1/4), the logarithms of a term's
  widths are those of the start, plus log s_k / s_k(0), plus x. Terms that come together so become
  narrower by themselves. At the upper bound of x a term is 0.9 true at half the distance s_k, so
  that min(mu_k, mu_l) of two neighbours nowhere exceeds 0.9: they can be told apart.
* Terms of scattered rules, and terms that share their place, move by themselves: a location by its
  shift in units of the term's own width, at most one width beyond the data.

``is_free`` is the classic ANFIS: terms stay in order, but may leave the data by their distance, and
be four times as wide. It fits exact data better, by rules that cannot be read.

Shape parameters are logarithms, and move as these.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from .antecedent import Antecedent, ScatteredAntecedent

__all__ = ["Premise"]

# Widths may shrink, and the gaps between terms change, by these factors.
_LOG_SHRINKAGE = np.log(1.3)
_LOG_GAP = np.log(4.0)
# Shapes, and widths of terms that share their place with others, may change by this one.
_LOG_FACTOR = np.log(4.0)
# A shape that makes the top of an ordered term flat, and so truer next to a neighbour, by this.
_LOG_FLATTER = np.log(1.5)
# Terms may leave the data by this part of their mean distance: a term as narrow as may be is still
# more than half true at the edge. Where they are free, by the second.
_BEYOND, _FREE_BEYOND = 0.25, 1.0
# Neighbours can be told apart where they cross below this.
_HIGHEST_CROSSING = 0.9
# Of the smooth minimum of two gaps.
_POWER = 4.0
# A gap that a step has closed, as part of the range.
_SMALLEST_GAP = 1e-9
# Displacements this near to an edge of the box are on it.
_ON_EDGE = 1e-9
# Widths that are looked at for the widest.
_CHANGES = 128


@dataclass(frozen=True, eq=False)
class _Ordered:
    """The terms of one input, one after another.

    ``locations`` are their positions in the vector, ``widths`` those of all their widths, ``terms``
    which term each of these belongs to; ``low`` and ``high`` the ends of the range.
    """

    locations: np.ndarray
    widths: np.ndarray
    terms: np.ndarray
    low: float
    high: float
    log_gaps: np.ndarray
    log_spacing: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(cls, locations, widths, terms, values, low, high, beyond):
        margin = beyond * (values[-1] - values[0]) / (values.size - 1)
        low, high = min(low, values[0]) - margin, max(high, values[-1]) + margin
        gaps = np.diff(np.concatenate([[low], values, [high]]))
        n = gaps.size
        # Orthonormal columns that sum to zero: all right singular vectors of (1, ..., 1) but that.
        basis = np.linalg.svd(np.ones((1, n)))[2][1:].T
        return cls(locations, widths, terms, low, high, np.log(gaps), _log_spacing(gaps), basis)

    def gaps(self, displacement):
        logs = self.log_gaps + self.basis @ displacement[self.locations]
        gaps = np.exp(logs - logs.max())
        return gaps * ((self.high - self.low) / gaps.sum())

    def gaps_of(self, values):
        """Gaps of any locations; where these are out of order, as little as can be."""
        gaps = np.diff(np.concatenate([[self.low], values, [self.high]]))
        return np.maximum(gaps, _SMALLEST_GAP * (self.high - self.low))

    def jacobian(self, gaps):
        """Derivatives of the locations, and of every term's log spacing, by the displacements."""
        by_gap = gaps[:, None] * (self.basis - (gaps @ self.basis) / gaps.sum())
        between = gaps[1:-1]
        steep = between ** (-_POWER)
        total = np.concatenate([steep, [0.0]]) + np.concatenate([[0.0], steep])
        by_spacing = np.zeros((between.size + 1, between.size))
        k = np.arange(between.size)
        by_spacing[k, k] = steep / between / total[:-1]
        by_spacing[k + 1, k] = steep / between / total[1:]
        return np.cumsum(by_gap, axis=0)[:-1], by_spacing @ by_gap[1:-1]


def _log_spacing(gaps):
    """Log of every term's distance to its neighbours, from all gaps."""
    steep = gaps[1:-1] ** (-_POWER)
    total = np.concatenate([steep, [0.0]]) + np.concatenate([[0.0], steep])
    return -np.log(total) / _POWER


@dataclass(frozen=True, eq=False)
class Premise:
    """The map from displacements to the antecedent's parameters, and the box they live in."""

    antecedent: Antecedent
    lower: np.ndarray
    upper: np.ndarray
    _unit: np.ndarray  # raw units per unit of displacement of what moves by itself
    _ordered: tuple[_Ordered, ...]

    @classmethod
    def of(cls, antecedent, minimum, maximum, is_free=False):
        """The premise of an antecedent; ``minimum`` and ``maximum`` of each input's data."""
        raw = antecedent.parameters
        lower, upper = np.full(raw.size, -_LOG_FACTOR), np.full(raw.size, _LOG_FACTOR)
        unit, ordered = np.ones(raw.size), []
        terms = _terms(antecedent)
        is_ordered = not isinstance(antecedent, ScatteredAntecedent)
        for j in sorted({term.input for term in terms}):
            own = sorted((t for t in terms if t.input == j), key=lambda t: raw[t.location])
            locations = np.array([term.location for term in own])
            if is_ordered and len(own) > 1 and (np.diff(raw[locations]) > 0.0).all():
                row = _Ordered.of(
                    locations,
                    np.concatenate([term.widths for term in own]),
                    np.repeat(np.arange(len(own)), [term.widths.size for term in own]),
                    raw[locations],
                    minimum[j],
                    maximum[j],
                    _FREE_BEYOND if is_free else _BEYOND,
                )
                ordered.append(row)
                lower[locations], upper[locations] = -_LOG_GAP, _LOG_GAP
                if is_free:
                    continue
                lower[row.widths] = -_LOG_SHRINKAGE
                upper[np.concatenate([term.shapes for term in own])] = _LOG_FLATTER
                widest = [
                    _widest(term, raw, np.exp(s))
                    for term, s in zip(own, row.log_spacing, strict=True)
                ]
                upper[row.widths] = np.array(widest)[row.terms]
                continue
            widths = np.exp([raw[term.widths[0]] for term in own])
            unit[locations] = widths
            # Up to one width beyond the data, or where the term stands already.
            lower[locations] = np.minimum((minimum[j] - raw[locations]) / widths - 1.0, 0.0)
            upper[locations] = np.maximum((maximum[j] - raw[locations]) / widths + 1.0, 0.0)
        return cls(antecedent, lower, upper, unit, tuple(ordered))

    @property
    def size(self):
        """Number of displacements."""
        return self.lower.size

    def parameters(self, displacement):
        """The antecedent's parameters at a displacement."""
        if not np.any(displacement):
            # What is not moved is as it was given, to the last bit.
            return self.antecedent.parameters
        raw = self.antecedent.parameters + self._unit * displacement
        for row in self._ordered:
            gaps = row.gaps(displacement)
            raw[row.locations] = row.low + np.cumsum(gaps)[:-1]
            raw[row.widths] += (_log_spacing(gaps) - row.log_spacing)[row.terms]
        return raw

    def displacement(self, parameters):
        """The displacement at which the antecedent has these parameters."""
        x = (parameters - self.antecedent.parameters) / self._unit
        for row in self._ordered:
            gaps = row.gaps_of(parameters[row.locations])
            x[row.locations] = row.basis.T @ (np.log(gaps) - row.log_gaps)
            x[row.widths] -= (_log_spacing(gaps) - row.log_spacing)[row.terms]
        # What stands on an edge stays there whatever rounding says: it is what does not move.
        for edge in (self.lower, self.upper):
            x = np.where(np.abs(x - edge) < _ON_EDGE, edge, x)
        return x

    def pull_back(self, displacement, gradient, gauss_newton):
        """Gradient and Gauss-Newton matrix by the displacements from those by the parameters."""
        jacobian = np.diag(self._unit)
        for row in self._ordered:
            by_location, by_spacing = row.jacobian(row.gaps(displacement))
            jacobian[np.ix_(row.locations, row.locations)] = by_location
            jacobian[np.ix_(row.widths, row.locations)] = by_spacing[row.terms]
        return jacobian.T @ gradient, jacobian.T @ gauss_newton @ jacobian


@dataclass(frozen=True, eq=False)
class _Term:
    """Where one term's parameters are in the vector of all."""

    family: type
    input: int
    positions: np.ndarray
    location: int
    widths: np.ndarray
    shapes: np.ndarray


def _terms(antecedent):
    """All terms of an antecedent."""
    terms, start = [], 0
    for group in antecedent.groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        positions = start + np.arange(group.theta.size).reshape(group.theta.shape)
        for own, j in zip(positions.T, group.inputs, strict=True):
            location = own[kinds == "location"][0]
            widths, shapes = own[kinds == "log_width"], own[kinds == "log_shape"]
            terms.append(_Term(group.family, int(j), own, location, widths, shapes))
        start += group.theta.size
    return terms


def _widest(term, raw, spacing):
    """How much a term's widths may grow, the rest of it anywhere: the change of their logarithm."""
    growth = np.linspace(0.0, _LOG_FACTOR, _CHANGES)
    sides = raw[term.location] + np.array([-0.5, 0.5]) * spacing
    # A steep flank beside a large width is truer than both at their largest: all are tried.
    ranges = [
        (growth, np.full(_CHANGES, -_LOG_SHRINKAGE))
        if position in term.widths
        else np.full((2, _CHANGES), [[_LOG_FLATTER], [-_LOG_FACTOR]])
        for position in term.positions
        if position != term.location
    ]
    truth = np.zeros((2, _CHANGES))
    for changes in product(*ranges):
        # A family's location is its first parameter.
        theta = raw[term.positions][:, None] + np.vstack([np.zeros(_CHANGES), *changes])
        logs = [term.family.log_value(np.full((_CHANGES, 1), x), theta)[:, 0] for x in sides]
        truth = np.maximum(truth, np.exp(logs))
    # A term that is true to one side for good has its flank on the other.
    flanks = [values for values in truth if values[0] < _HIGHEST_CROSSING]
    if not flanks:
        return 0.0
    return growth[np.flatnonzero(np.max(flanks, axis=0) <= _HIGHEST_CROSSING)[-1]]
