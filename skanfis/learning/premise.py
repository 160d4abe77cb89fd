r"""What a solver moves: premises as a vector of displacements from their start, within bounds.

Every entry is without unit and zero at the start, and one means much the same for all of them, a
change of some length by a factor of e. Terms stay what a person can read, by construction:

* Terms that an input has in different places stay in order and where there are data, and of a width
  that goes with their distance (``ordered_terms``).
* Terms of scattered rules, and terms that share their place, move by themselves: a location by its
  shift in units of the term's own width, at most one width beyond the data.

Shape parameters are logarithms, and move as these.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent import Antecedent
from .ordered_terms import LOG_FACTOR, LOG_FLATTER, NEXT_TO_NOTHING, OrderedTerms, terms_of


@dataclass(frozen=True, eq=False)
class Premise:
    """The map from displacements to the antecedent's parameters, and the box they live in."""

    antecedent: Antecedent
    lower: np.ndarray
    upper: np.ndarray
    _unit: np.ndarray  # raw units per unit of displacement of what moves by itself
    _tied: np.ndarray  # the displacement by which each parameter moves
    _ordered: tuple[OrderedTerms, ...]

    @classmethod
    def of(cls, antecedent, minimum, maximum, is_unbounded=False):
        """The premise of an antecedent; ``minimum`` and ``maximum`` of each input's data."""
        raw = antecedent.parameters
        lower, upper = np.full(raw.size, -LOG_FACTOR), np.full(raw.size, LOG_FACTOR)
        unit, ordered = np.ones(raw.size), []
        terms = terms_of(antecedent)
        is_ordered = antecedent.is_ordered
        for j in sorted({term.input for term in terms}):
            own = sorted((t for t in terms if t.input == j), key=lambda t: raw[t.location])
            locations = np.array([term.location for term in own])
            if is_ordered and len(own) > 1 and (np.diff(raw[locations]) > 0.0).all():
                row = OrderedTerms.of(own, raw, minimum[j], maximum[j], is_unbounded)
                if not is_unbounded:
                    lower[locations], upper[locations] = row.bounds()
                    least, most = row.width_bounds(own, raw)
                    lower[row.widths], upper[row.widths] = least[row.terms], most[row.terms]
                    upper[np.concatenate([term.shapes for term in own])] = LOG_FLATTER
                ordered.append(row)
                continue
            first = np.array([term.widths[0] for term in own])
            widths = np.exp(raw[first])
            unit[locations] = widths
            # Up to one width beyond the data, or where the term stands already.
            lower[locations] = np.minimum((minimum[j] - raw[locations]) / widths - 1.0, 0.0)
            upper[locations] = np.maximum((maximum[j] - raw[locations]) / widths + 1.0, 0.0)
            if antecedent.least_width > 0.0:
                # A cut may become sharper, and no softer: a rule is to be told from the next.
                least = np.log(antecedent.least_width) - raw[first]
                lower[first] = np.minimum(np.maximum(lower[first], least), 0.0)
                upper[first] = 0.0
                # A crisp cut, at most half as wide as the least, stays; half-way is far from both.
                is_crisp = widths < 0.75 * antecedent.least_width
                for still in (locations[is_crisp], first[is_crisp]):
                    lower[still] = upper[still] = 0.0
        tied = antecedent.tied
        size = np.unique(tied).size
        return cls(antecedent, lower[:size], upper[:size], unit, tied, tuple(ordered))

    @property
    def size(self):
        """Number of displacements."""
        return self.lower.size

    def parameters(self, displacement):
        """The antecedent's parameters at a displacement."""
        if not np.any(displacement):
            # What is not moved is as it was given, to the last bit.
            return self.antecedent.parameters
        raw = self.antecedent.parameters + self._unit * displacement[self._tied]
        for row in self._ordered:
            gaps = row.gaps(displacement)
            raw[row.locations] = row.low + np.cumsum(gaps)[:-1]
            raw[row.widths] += row.widening(gaps)
        return raw

    def displacement(self, parameters):
        """The displacement at which the antecedent has these parameters."""
        x = ((parameters - self.antecedent.parameters) / self._unit)[: self.size]
        for row in self._ordered:
            gaps, x[row.locations] = row.of_locations(parameters[row.locations])
            x[row.widths] -= row.widening(gaps)
        # What stands on an edge stays there whatever rounding says: it is what does not move.
        for edge in (self.lower, self.upper):
            x = np.where(np.abs(x - edge) < NEXT_TO_NOTHING, edge, x)
        return x

    def jacobian(self, displacement):
        """Derivatives of the parameters by the displacements."""
        jacobian = np.zeros((self._unit.size, self.size))
        jacobian[np.arange(self._unit.size), self._tied] = self._unit
        for row in self._ordered:
            by_location, by_gaps = row.jacobian(displacement)
            jacobian[row.locations[:, None], row.locations] = by_location
            jacobian[row.widths[:, None], row.locations] = by_gaps
        return jacobian

    def pull_back(self, displacement, gradient, gauss_newton):
        """Gradient and Gauss-Newton matrix by the displacements from those by the parameters."""
        jacobian = self.jacobian(displacement)
        return jacobian.T @ gradient, jacobian.T @ gauss_newton @ jacobian
