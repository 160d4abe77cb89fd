r"""What a solver moves: premises as a vector of displacements from their start, within bounds.

Every entry is without unit and zero at the start, and one means much the same for all of them:

* a width or a shape parameter: the change of its logarithm;
* grid partition, first term of an input: its shift in units of the terms' spacing; every further
  term: the change of the logarithm of its distance from the term before it. The terms of an input
  so stay in order by construction, and can be read as "low" to "high" after training too;
* scattered rules, a location: its shift in units of the term's own width.

Bounds keep a term a term: without them the reduced problem has minima in which terms collapse onto
a row, flatten until they mean nothing, or leave the data.
"""

from dataclasses import dataclass

import numpy as np

from .antecedent import Antecedent, GridAntecedent

__all__ = ["Premise"]

# Widths and shapes may change by this factor either way.
_LOG_FACTOR = np.log(4.0)
# The first term of a grid may shift by so many spacings; neighbours may come together to a fifth
# of their distance and part to twice it.
_SHIFT = 1.0
_LOG_GAP = (-np.log(5.0), np.log(2.0))


@dataclass(frozen=True, eq=False)
class Premise:
    """The map from displacements to the antecedent's parameters, and the box they live in."""

    antecedent: Antecedent
    lower: np.ndarray
    upper: np.ndarray
    _unit: np.ndarray  # raw units per unit of displacement; gap starts where is_gap
    _is_gap: np.ndarray
    _ordered: np.ndarray  # matrix from (first location, gaps, everything else) to raw parameters

    @classmethod
    def of(cls, antecedent, minimum, maximum):
        """The premise of an antecedent; ``minimum`` and ``maximum`` of each input's data."""
        raw = antecedent.parameters
        n = raw.size
        lower, upper = np.full(n, -_LOG_FACTOR), np.full(n, _LOG_FACTOR)
        unit, is_gap, ordered = np.ones(n), np.zeros(n, dtype=bool), np.eye(n)
        for indices, inputs, widths in _locations(antecedent):
            if isinstance(antecedent, GridAntecedent):
                for j in np.unique(inputs):
                    run = indices[inputs == j]
                    gaps = np.diff(raw[run])
                    unit[run] = np.concatenate([[gaps.mean()], gaps])
                    is_gap[run[1:]] = True
                    ordered[np.ix_(run, run)] = np.tri(run.size)
                    lower[run], upper[run] = _LOG_GAP
                    lower[run[0]], upper[run[0]] = -_SHIFT, _SHIFT
            else:
                unit[indices] = widths
                # Up to one width beyond the data, or where the term stands already.
                lower[indices] = np.minimum((minimum[inputs] - raw[indices]) / widths - 1.0, 0.0)
                upper[indices] = np.maximum((maximum[inputs] - raw[indices]) / widths + 1.0, 0.0)
        return cls(antecedent, lower, upper, unit, is_gap, ordered)

    @property
    def size(self):
        """Number of displacements."""
        return self.lower.size

    def parameters(self, displacement):
        """The antecedent's parameters at a displacement."""
        growth = np.where(self._is_gap, self._unit * np.expm1(displacement * self._is_gap), 0.0)
        return self.antecedent.parameters + self._ordered @ np.where(
            self._is_gap, growth, self._unit * displacement
        )

    def displacement(self, parameters):
        """The displacement at which the antecedent has these parameters."""
        growth = np.linalg.solve(self._ordered, parameters - self.antecedent.parameters)
        growth = growth / self._unit
        return np.where(self._is_gap, np.log1p(np.where(self._is_gap, growth, 0.0)), growth)

    def pull_back(self, displacement, gradient, gauss_newton):
        """Gradient and Gauss-Newton matrix by the displacements from those by the parameters."""
        per_unit = self._unit * np.where(self._is_gap, np.exp(displacement * self._is_gap), 1.0)
        jacobian = self._ordered * per_unit
        return jacobian.T @ gradient, jacobian.T @ gauss_newton @ jacobian


def _locations(antecedent):
    """Per group: indices of the location parameters in the vector, their inputs, their widths."""
    start = 0
    for group in antecedent.groups:
        kinds = [parameter.kind for parameter in group.family.parameters]
        row, width_row = kinds.index("location"), kinds.index("log_width")
        indices = start + row * group.n_terms + np.arange(group.n_terms)
        yield indices, group.inputs, np.exp(group.theta[width_row])
        start += group.theta.size
