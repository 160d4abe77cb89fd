"""The least-squares problem at premises that stay, out of moments alone: no rows are read."""

import copy
from dataclasses import dataclass

import numpy as np

from ..antecedent import Antecedent
from ..consequent import LocalBasis, NormalFactor, rule_masses
from ..learning.data import Scale
from ..learning.objective import Evaluation, NormalEquations
from ..learning.penalty import CommonLine, Penalty, disagreement_matrix
from .farthest import Farthest
from .moments import Moments

__all__ = ["HeldProblem"]


@dataclass(frozen=True)
class _SizeOfRows:
    """What the search for the weights asks about the rows."""

    n_rows: int
    inputs: Scale
    targets: Scale


class HeldProblem:
    """What :class:`~skanfis.learning.objective.SeparableProblem` is of rows, of their moments.

    Parameters
    ----------
    moments : Moments
    farthest : Farthest
    antecedent : Antecedent
    penalty : Penalty
    n_distinct : int
        Distinct rows, as far as they are counted.
    """

    def __init__(
        self,
        moments: Moments,
        farthest: Farthest,
        antecedent: Antecedent,
        penalty: Penalty,
        n_distinct: int,
    ):
        self.antecedent, self.penalty = antecedent, penalty
        self.n_columns, self.n_outputs = moments.slope.shape
        self.rows = _SizeOfRows(n_distinct, moments.inputs, moments.targets)
        self.consequent_inputs, self.n_basis = moments.consequent_inputs, moments.n_basis
        self._gram = moments.gram / moments.weight
        self._slope = moments.slope / moments.weight
        self._square = moments.square / moments.weight
        self.local = LocalBasis.from_gram(self._gram, antecedent.n_rules)
        inputs, own = moments.inputs, moments.consequent_inputs
        center = inputs.offset[own] + inputs.scale[own] * self.local.center
        extent = np.maximum(farthest.distance(center) / inputs.scale[own], 1.0)
        self.common_line = CommonLine(self.local, extent, antecedent, inputs.varying(own))

    def with_penalty(self, penalty: Penalty):
        """Return the same problem with another penalty."""
        other = copy.copy(self)
        other.penalty = penalty
        return other

    def evaluate(self, _=None):
        """Cost and coefficients, as ``SeparableProblem.evaluate`` without a reference."""
        n_rules = self.antecedent.n_rules
        apart, gram = disagreement_matrix(self._gram, n_rules, self.local)
        penalty = self.penalty.agreement * apart
        penalty += self.common_line.pull(self.penalty)
        factor = NormalFactor(gram + penalty)
        penalty.flat[:: self.n_columns + 1] += factor.shift
        slope = self.local.transform_rows(self._slope.copy())
        solved = factor.solve(slope)
        cost = 0.5 * (self._square.sum() - np.sum(slope * solved))
        return Evaluation(
            self.antecedent,
            cost,
            self.local.to_global(solved),
            rule_masses(self._gram, n_rules),
            max(2.0 * cost - float(np.sum(solved * (penalty @ solved))), 0.0),
            NormalEquations(gram, apart, penalty, factor, solved),
        )

    def mean_squares(self, evaluation):
        """Mean squared error of every standardised output."""
        normal = evaluation.normal
        solved, slope = normal.coefficients, self.local.transform_rows(self._slope.copy())
        # By the residual of the normal equations; slope = (G + P) solved.
        at_zero = self._square - np.sum(solved * slope, axis=0)
        return np.maximum(at_zero - np.sum(solved * (normal.penalty @ solved), axis=0), 0.0)

    def information(self, evaluation):
        """(Phi' S Phi + W P) / W by the coefficients on [1, z], the noise's variance being one."""
        inverse = self.local.to_local(np.eye(self.n_columns))
        return self._gram + inverse.T @ evaluation.normal.penalty @ inverse
