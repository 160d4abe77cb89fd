r"""What one pass adds up over the rows, a block at a time: the sums behind ``objective``.

A pass is a function of a block, Z (n_inputs, n_rows), target (n_outputs, n_rows) and weights or
None, that adds to its sums, arrays of the pass's ``shapes``. It holds the point at which it is
taken and nothing of the rows: it can be sent to where the rows are (``StandardisedData.sum``),
and only the sums come back.
"""

from dataclasses import dataclass

import numpy as np

from ..antecedent import Antecedent, by_parameter
from ..consequent import basis, rule_outputs
from .gram import DesignMoments
from .ordered_terms import terms_of

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Design:
    """The columns of the design: its basis functions, and what its Gram matrix is made of."""

    consequent_inputs: np.ndarray  # that the consequents are linear in
    n_basis: int
    moments: DesignMoments
    own_parameters: np.ndarray  # of the premises, see the function of this name

    def basis(self, Z):
        """Basis functions of the consequents at a block of rows."""
        return basis(Z[self.consequent_inputs])

    def by_rule(self, coefficients):
        """Coefficients (n_columns, n_outputs) as (n_rules, n_basis, n_outputs)."""
        return coefficients.reshape(-1, self.n_basis, coefficients.shape[1])


@dataclass(frozen=True, eq=False)
class FirstPass:
    """Phi' S Phi (its moments), Phi' S r and r' S r; r is the residual of a reference."""

    design: Design
    antecedent: Antecedent
    reference: np.ndarray  # coefficients on [1, z], (n_columns, n_outputs)

    @property
    def shapes(self):
        """Of the sums."""
        return [self.design.moments.shape, self.reference.shape, self.reference.shape[1:]]

    def __call__(self, Z, target, weight, sums):
        moments, slope, square = sums
        design, by_rule = self.design, self.design.by_rule(self.reference)
        basis_rows = design.basis(Z)
        weighted_basis = basis_rows if weight is None else basis_rows * weight
        strengths, shares = self.antecedent.strengths_and_shares(Z)
        design.moments.accumulate(moments, shares, basis_rows, weighted_basis)
        for k in range(len(target)):
            residual = target[k] - rule_outputs(by_rule[:, :, k], strengths, basis_rows)[1]
            slope[:, k] += (strengths @ (weighted_basis * residual).T).ravel()
            square[k] += weighted_basis[0] @ residual**2  # the basis begins with 1


@dataclass(frozen=True, eq=False)
class SecondPass:
    """D' S D + lambda K, the slope, and C of every output, at coefficients that were solved for."""

    design: Design
    antecedent: Antecedent
    coefficients: np.ndarray
    agreement: float

    @property
    def shapes(self):
        """Of the sums."""
        n_raw = self.antecedent.parameters.size
        n_columns, n_outputs = self.coefficients.shape
        cross = [(n_raw, n_columns)] * n_outputs
        return [(n_raw, n_raw), (n_raw,), *cross]

    def __call__(self, Z, target, weight, sums):
        square, slope, *cross = sums
        design, antecedent, agreement = self.design, self.antecedent, self.agreement
        by_rule = design.by_rule(self.coefficients)
        basis_rows = design.basis(Z)
        weighted_basis = basis_rows if weight is None else basis_rows * weight
        log_mu, gradients = antecedent.log_memberships_and_mean_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        columns = (strengths[:, None] * weighted_basis).reshape(-1, Z.shape[1])  # Phi' S
        for k in range(len(target)):
            by_rule_k, output = rule_outputs(by_rule[:, :, k], strengths, basis_rows)
            by_term = antecedent.term_sensitivity(by_rule_k, output, shares)
            sensitivity = by_parameter(gradients, by_term)
            weighted = sensitivity * weighted_basis[0]  # the basis begins with 1
            square += weighted @ sensitivity.T
            slope += weighted @ (target[k] - output)
            if agreement:
                sensitivity *= 1.0 - 0.5 * agreement
            cross[k] += sensitivity @ columns.T
            if agreement:
                excess = by_rule_k - strengths * output  # w_r e_r
                self._disagree(
                    square, slope, cross[k], excess, strengths, gradients, weighted_basis
                )

    def _disagree(self, square, slope, cross, excess, strengths, gradients, weighted_basis):
        """Add the part of V: its dV, K and L.

        With g_r the derivatives of rule r's own log-strength (those of the terms it has) and
        N = sum_r w_r g_r, d log w_r = g_r - N: K and L are sums over the few terms of each rule and
        products with N.
        """
        antecedent, half, n_raw = self.antecedent, 0.5 * self.agreement, slope.size
        # w_r e_r^2, where w_r may be next to nothing.
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
        # Of every rule, its own parameters; those that it lacks are a row of nothing at the end.
        own, size = self.design.own_parameters, n_raw + 1
        every = [gradient.reshape(-1, n_rows) for gradient in gradients]
        of_rule = np.concatenate([*every, np.zeros((1, n_rows))])[own]
        squares *= 0.5 * half * weight
        blocks = (of_rule * squares[:, None]) @ of_rule.transpose(0, 2, 1)
        places = (size * own[:, :, None] + own[:, None, :]).ravel()
        whole = np.bincount(places, blocks.ravel(), size**2).reshape(size, size)
        square += whole[:n_raw, :n_raw]
        apart = np.zeros((size, n_rules, self.design.n_basis))
        apart[own, np.arange(n_rules)[:, None]] = of_rule @ columns.transpose(0, 2, 1)
        cross += apart[:n_raw].reshape(cross.shape)


@dataclass(frozen=True, eq=False)
class JointPass:
    """Slopes by theta and beta but for A, r' S r and V (per output), and the rules' masses."""

    design: Design
    antecedent: Antecedent
    coefficients: np.ndarray
    agreement: float

    @property
    def shapes(self):
        """Of the sums."""
        by_output = self.coefficients.shape[1:]
        n_raw, n_rules = self.antecedent.parameters.size, self.antecedent.n_rules
        return [(n_raw,), self.coefficients.shape, by_output, by_output, (n_rules,)]

    def __call__(self, Z, target, weight, sums):
        premises, slope, square, apart, masses = sums
        design, antecedent, agreement = self.design, self.antecedent, self.agreement
        by_rule = design.by_rule(self.coefficients)
        basis_rows = design.basis(Z)
        log_mu, gradients = antecedent.log_memberships_and_mean_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        weight = np.ones(Z.shape[1]) if weight is None else weight
        masses += strengths @ weight
        for k in range(len(target)):
            by_rule_k, output = rule_outputs(by_rule[:, :, k], strengths, basis_rows)
            residual = target[k] - output
            weighted = residual * weight
            slope[:, k] += (strengths @ (basis_rows * weighted).T).ravel()
            square[k] += weighted @ residual
            by_term = antecedent.term_sensitivity(by_rule_k, output, shares)
            by_term *= weighted
            if agreement:
                excess = by_rule_k - strengths * output
                squares = excess**2 / np.maximum(strengths, _TINY)
                total = squares.sum(axis=0)
                apart[k] += weight @ total
                slope[:, k] -= agreement * ((excess * weight) @ basis_rows.T).ravel()
                change = antecedent.sum_over_rules(squares)
                change -= antecedent.sum_over_rules(strengths) * total
                by_term -= (0.5 * agreement) * weight * change
            premises += by_parameter(gradients, by_term).sum(axis=1)


def own_parameters(antecedent):
    """Of every rule, the positions of its terms' parameters in the vector of all.

    Shape (n_rules, the most that a rule has); of rules that have fewer, the rest is one position
    beyond the vector.
    """
    positions = [term.positions for term in terms_of(antecedent)]
    most = max(map(len, positions), default=0)
    # No term is the last.
    of_term = np.full((len(positions) + 1, most), antecedent.parameters.size)
    for row, own in zip(of_term, positions, strict=False):
        row[: own.size] = own
    return of_term[antecedent.rule_terms].reshape(antecedent.n_rules, -1)
