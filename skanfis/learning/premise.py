r"""What a solver moves: premises as a vector of displacements from their start, within bounds.

Every displacement is without unit and zero at the start. One means much the same for all of them: a
change of some length by a factor of e. By construction, terms stay readable:

* Terms of one input in different places stay in order, where there are data, and of widths that go
  with their distance (``ordered_terms``).
* Terms of scattered rules, and terms that share their place, move by themselves: a location by its
  shift in units of the term's own width, at most one width beyond the data.

Shape parameters are logarithms, and their displacements add to these.
"""

from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ..antecedent import Antecedent
from .ordered_terms import LOG_FACTOR, NEXT_TO_NOTHING, OrderedTerms, terms_of


@dataclass(frozen=True, eq=False)
class Premise:
    """The map from displacements to the antecedent's parameters, and the box they live in."""

    antecedent: Antecedent
    lower: np.ndarray
    upper: np.ndarray
    _unit: np.ndarray  # change per unit of displacement, of parameters that move by themselves
    _tied: np.ndarray  # index of the displacement that moves each parameter
    _ordered: tuple[OrderedTerms, ...]
    is_unbounded: bool = False  # whether ordered terms have no bounds

    @classmethod
    def of(cls, antecedent, minimum, maximum, is_unbounded=False):
        """The premise of an antecedent; each input's data lie in ``minimum`` to ``maximum``."""
        raw = antecedent.parameters
        lower, upper = np.full(raw.size, -LOG_FACTOR), np.full(raw.size, LOG_FACTOR)
        unit, ordered = np.ones(raw.size), []
        every = sorted(terms_of(antecedent), key=lambda term: (term.input, raw[term.location]))
        for j, members in groupby(every, key=lambda term: term.input):
            terms, low, high = list(members), minimum[j], maximum[j]
            places = raw[[term.location for term in terms]]
            if antecedent.is_ordered and len(terms) > 1 and (np.diff(places) > 0.0).all():
                ordered.append(OrderedTerms.of(terms, raw, low, high, is_unbounded))
                if not is_unbounded:
                    ordered[-1].bound(terms, raw, lower, upper)
            else:
                _bound_alone(terms, raw, low, high, unit, lower, upper)
                if antecedent.least_width > 0.0:
                    _bound_cuts(terms, raw, antecedent.least_width, lower, upper)
        tied = antecedent.tied
        size = np.unique(tied).size
        return cls(antecedent, lower[:size], upper[:size], unit, tied, tuple(ordered), is_unbounded)

    @classmethod
    def still(cls, antecedent):
        """The premise of an antecedent that does not move: it has no displacements."""
        none = np.empty(0)
        return cls(antecedent, none, none, none, none.astype(int), ())

    @property
    def size(self):
        """Number of displacements."""
        return self.lower.size

    def parameters(self, displacement):
        """The antecedent's parameters at a displacement."""
        if not np.any(displacement):
            # Parameters that do not move stay the same to the last bit.
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
        # A displacement on an edge stays exactly there: solvers take it as fixed.
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


def _bound_alone(terms, raw, low, high, unit, lower, upper):
    """Set units and bounds of locations that move by themselves, in widths of their terms."""
    locations = [term.location for term in terms]
    places, widths = raw[locations], np.exp(raw[[term.widths[0] for term in terms]])
    unit[locations] = widths
    # Up to one width beyond the data, or as far as the term already is.
    lower[locations] = np.minimum((low - places) / widths - 1.0, 0.0)
    upper[locations] = np.maximum((high - places) / widths + 1.0, 0.0)


def _bound_cuts(terms, raw, least_width, lower, upper):
    """Set bounds of the widths of cuts, and of all parameters of crisp cuts."""
    locations = np.array([term.location for term in terms])
    widths = np.array([term.widths[0] for term in terms])
    # A cut may become sharper but not softer, so that rules stay distinct.
    least = np.log(least_width) - raw[widths]
    lower[widths] = np.minimum(np.maximum(lower[widths], least), 0.0)
    upper[widths] = 0.0
    # A crisp cut stays as it is. It is at most half as wide as the least; 0.75 lies in between.
    is_crisp = np.exp(raw[widths]) < 0.75 * least_width
    for still in (locations[is_crisp], widths[is_crisp]):
        lower[still] = upper[still] = 0.0
