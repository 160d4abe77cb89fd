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
from .ordered_terms import terms_of

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Design:
    """The columns of the design: its basis functions, and the moments of its Gram matrix."""

    consequent_inputs: np.ndarray  # inputs that the consequents are linear in
    moments: DesignMoments
    own_parameters: np.ndarray  # see the function of this name

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


class FirstPass(_Pass):
    """Moments of Phi' S Phi, Phi' S r and r' S r, r the residual of the coefficients."""

    def __call__(self, Z, target, weight):
        design, basis_rows = self.design, self.design.basis(Z)
        strengths, shares = self.antecedent.strengths_and_shares(Z)
        by_output = design.by_output(self.coefficients)
        residual = target - outputs_of_rules(by_output, strengths, basis_rows)
        return normal_sums(design.moments, strengths, shares, basis_rows, weight, residual)


class SecondPass(_Pass):
    """D' S D + lambda K, minus the gradient, and C of every output, at solved coefficients."""

    def __call__(self, Z, target, weight):
        antecedent, agreement = self.antecedent, self.agreement
        basis_rows = self.design.basis(Z)
        weighted_basis = basis_rows * weight
        log_mu, gradients = antecedent.log_memberships_and_mean_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        columns = (strengths[:, None] * weighted_basis).reshape(-1, Z.shape[1])  # Phi' S
        n_raw = antecedent.parameters.size
        square, slope, every_cross = np.zeros((n_raw, n_raw)), np.zeros(n_raw), []
        for one, wanted in zip(self.design.by_output(self.coefficients), target, strict=True):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            by_term = antecedent.term_sensitivity(by_rule, output, shares)
            sensitivity = by_parameter(gradients, by_term)
            weighted = sensitivity * weight
            square += weighted @ sensitivity.T
            slope += weighted @ (wanted - output)
            if agreement:
                sensitivity *= 1.0 - 0.5 * agreement
            cross = sensitivity @ columns.T
            if agreement:
                excess = by_rule - strengths * output  # w_r e_r
                self._disagree(square, slope, cross, excess, strengths, gradients, weighted_basis)
            every_cross.append(cross)
        return [square, slope, *every_cross]

    def _disagree(self, square, slope, cross, excess, strengths, gradients, weighted_basis):
        """Add the part of the disagreement V: dV, K and L.

        Let g_r be the derivatives of the log-strength of rule r before normalisation, which depends
        on its own terms alone, and N = sum_r w_r g_r. Then d log w_r = g_r - N, so that K and L are
        sums over the few terms of each rule, and products with N. e_r is f_r less the output.
        """
        antecedent, half, n_raw = self.antecedent, 0.5 * self.agreement, slope.size
        # w_r e_r^2; w_r may be next to nothing.
        squares = excess**2
        squares /= np.maximum(strengths, _TINY)
        weight, (n_rules, n_rows) = weighted_basis[0], excess.shape
        total = squares.sum(axis=0)
        mean = by_parameter(gradients, antecedent.sum_over_rules(strengths))  # N
        change = by_parameter(gradients, antecedent.sum_over_rules(squares))
        change -= mean * total  # e_r^2 dw_r, summed over rules
        slope -= half * (change @ weight)
        # - (change N' + N change' + total N N') / 4
        product = ((0.5 * half * weight) * (change + 0.5 * total * mean)) @ mean.T
        square -= product + product.T
        columns = (half * excess)[:, None] * weighted_basis
        cross -= mean @ columns.reshape(-1, n_rows).T
        # g_r by the own parameters of every rule; padding positions point to the zeros at the end.
        own, size = self.design.own_parameters, n_raw + 1
        every = [gradient.reshape(-1, n_rows) for gradient in gradients]
        of_rule = np.concatenate([*every, np.zeros((1, n_rows))])[own]
        squares *= 0.5 * half * weight
        blocks = (of_rule * squares[:, None]) @ of_rule.transpose(0, 2, 1)
        places = (size * own[:, :, None] + own[:, None, :]).ravel()
        whole = np.bincount(places, blocks.ravel(), size**2).reshape(size, size)
        square += whole[:n_raw, :n_raw]
        apart = np.zeros((size, n_rules, len(weighted_basis)))
        apart[own, np.arange(n_rules)[:, None]] = of_rule @ columns.transpose(0, 2, 1)
        cross += apart[:n_raw].reshape(cross.shape)


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
                excess = by_rule - strengths * output
                squares = excess**2 / np.maximum(strengths, _TINY)
                total = squares.sum(axis=0)
                apart[k] = weight @ total
                slope -= agreement * ((excess * weight) @ basis_rows.T)
                change = antecedent.sum_over_rules(squares)
                change -= antecedent.sum_over_rules(strengths) * total
                by_term -= (0.5 * agreement) * weight * change
            premises += by_parameter(gradients, by_term).sum(axis=1)
            slopes.append(slope.ravel())
        return [premises, np.column_stack(slopes), square, apart, strengths @ weight]


def own_parameters(antecedent):
    """For every rule, the positions of its terms' parameters in the vector of all.

    Shape (n_rules, the most that a rule has). Rules that have fewer are padded with the position
    just beyond the vector.
    """
    positions = [term.positions for term in terms_of(antecedent)]
    most = max(map(len, positions), default=0)
    # The last row, which index -1 finds, stands for no term.
    of_term = np.full((len(positions) + 1, most), antecedent.parameters.size)
    for row, own in zip(of_term, positions, strict=False):
        row[: own.size] = own
    return of_term[antecedent.rule_terms].reshape(antecedent.n_rules, -1)
