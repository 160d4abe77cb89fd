r"""What one pass adds up over the rows, a block at a time: the sums behind ``objective``.

A pass is a function of a block, Z (n_inputs, n_rows), target (n_outputs, n_rows) and weights, that
returns a list of arrays, its sums. It holds the point at which it is taken and no rows: it can be
sent to where the rows are (``StandardisedData.sum``), and only the sums come back.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent import Antecedent, by_parameter
from ..consequent import basis, outputs_of_rules, rule_outputs
from .gram import DesignMoments

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Design:
    """The columns of the design: its basis functions, and the moments of its Gram matrix."""

    consequent_inputs: np.ndarray  # inputs that the consequents are linear in
    moments: DesignMoments

    def basis(self, Z):
        """Basis functions of the consequents at a block of rows."""
        return basis(Z[self.consequent_inputs])

    def by_output(self, coefficients):
        """Coefficients (n_columns, n_outputs) as (n_outputs, n_rules, n_basis)."""
        n_basis = 1 + self.consequent_inputs.size
        return coefficients.reshape(-1, n_basis, coefficients.shape[1]).transpose(2, 0, 1)


def normal_sums(moments, strengths, shares, basis_rows, weight, residual):
    """Sums of a block: the moments of Phi' S Phi, then Phi' S r and r' S r of every output."""
    weighted = basis_rows * weight
    slopes = [(strengths @ (weighted * own).T).ravel() for own in residual]
    found = moments.of(shares, basis_rows, weighted)
    return [found, np.column_stack(slopes), residual**2 @ weight]


@dataclass(frozen=True, eq=False)
class _Pass:
    """A pass at a point: an antecedent, and coefficients of the consequents."""

    design: Design
    antecedent: Antecedent
    coefficients: np.ndarray  # on [1, z], (n_columns, n_outputs)
    agreement: float = 0.0

    def _disagreement(self, strengths, by_rule, output):
        """w_r e_r; its sum with e_r over rules; and how that sum changes with each term's log mu.

        ``by_rule`` is w_r f_r; e_r is f_r less the output. w_r may be next to nothing.
        """
        excess = by_rule - strengths * output
        squares = excess**2 / np.maximum(strengths, _TINY)
        total, antecedent = squares.sum(axis=0), self.antecedent
        change = antecedent.sum_over_rules(squares) - antecedent.sum_over_rules(strengths) * total
        return excess, total, change


class FirstPass(_Pass):
    """Moments of Phi' S Phi, Phi' S r and r' S r, r the residual of the coefficients."""

    def __call__(self, Z, target, weight):
        design, basis_rows = self.design, self.design.basis(Z)
        strengths, shares = self.antecedent.strengths_and_shares(Z)
        by_output = design.by_output(self.coefficients)
        residual = target - outputs_of_rules(by_output, strengths, basis_rows)
        return normal_sums(design.moments, strengths, shares, basis_rows, weight, residual)


class SecondPass(_Pass):
    """D' S D, minus the gradient, and C of every output, at solved coefficients."""

    def __call__(self, Z, target, weight):
        antecedent, basis_rows = self.antecedent, self.design.basis(Z)
        log_mu, gradients = antecedent.log_memberships_and_mean_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        columns = (strengths[:, None] * (basis_rows * weight)).reshape(-1, Z.shape[1])  # Phi' S
        n_raw = antecedent.parameters.size
        square, slope, every_cross = np.zeros((n_raw, n_raw)), np.zeros(n_raw), []
        for one, wanted in zip(self.design.by_output(self.coefficients), target, strict=True):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            sensitivity = antecedent.term_sensitivity(by_rule, output, shares)
            sensitivity = by_parameter(gradients, sensitivity)
            weighted = sensitivity * weight
            square += weighted @ sensitivity.T
            slope += weighted @ (wanted - output)
            every_cross.append(sensitivity @ columns.T)
            if self.agreement:
                *_, change = self._disagreement(strengths, by_rule, output)
                slope -= (0.5 * self.agreement) * (by_parameter(gradients, change) @ weight)
        return [square, slope, *every_cross]


class JointPass(_Pass):
    """Minus the gradients by theta and beta, without A; r' S r and V per output; rules' masses."""

    def __call__(self, Z, target, weight):
        antecedent, agreement = self.antecedent, self.agreement
        basis_rows = self.design.basis(Z)
        log_mu, gradients = antecedent.log_memberships_and_mean_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        premises, slopes = np.zeros(antecedent.parameters.size), []
        square, apart = np.zeros((2, len(target)))
        for k, one in enumerate(self.design.by_output(self.coefficients)):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            residual = target[k] - output
            weighted = residual * weight
            slope = strengths @ (basis_rows * weighted).T
            square[k] = weighted @ residual
            by_term = antecedent.term_sensitivity(by_rule, output, shares)
            by_term *= weighted
            if agreement:
                excess, total, change = self._disagreement(strengths, by_rule, output)
                apart[k] = weight @ total
                slope -= agreement * ((excess * weight) @ basis_rows.T)
                by_term -= (0.5 * agreement) * weight * change
            premises += by_parameter(gradients, by_term).sum(axis=1)
            slopes.append(slope.ravel())
        return [premises, np.column_stack(slopes), square, apart, strengths @ weight]
