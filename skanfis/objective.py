r"""Training as a separable least-squares problem: cost, gradient and Gauss-Newton matrix.

With premise parameters theta, design Phi(theta), weights S of sum W and consequents beta,

    F(theta) = min_beta  1/(2 W) |y - Phi beta|_S^2 + alpha/2 |beta|^2 .

beta is eliminated (variable projection: Golub and Pereyra 1973). With r the residual and
D = (d Phi / d theta) beta its sensitivity at fixed beta, the envelope theorem gives the gradient
exactly, and the Schur complement of the joint Gauss-Newton matrix that of the reduced problem
(Kaufman 1975):

    grad F = -D' S r / W
    H      = [D' S D - D' S Phi (Phi' S Phi + alpha W I)^-1 Phi' S D] / W .

Everything is a block of one Gram matrix and adds over rows. Two passes make one iteration:
:meth:`SeparableProblem.evaluate` accumulates Phi' S [Phi, r] and gives cost and beta, which is all
that a rejected step needs; :meth:`SeparableProblem.linearise` accumulates D' S [D, Phi, r] at that
very beta, so that the gradient is exact. A pass holds one block of rows per worker, whatever the
number of rows.

The right side is the residual of *reference* coefficients, those of the last accepted point, not y:
the cost of a nearly exact fit would otherwise be a small difference of large numbers.

Theta here is the vector :attr:`Antecedent.parameters`; what solvers move is in ``premise``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas

from .antecedent import Antecedent
from .consequent import LocalBasis, RidgeFactor, basis, design, rule_masses
from .rows import Rows

__all__ = ["Evaluation", "Linearisation", "SeparableProblem"]

# Working set of a block in bytes. Smaller blocks stay nearer to the processor but pay the price of
# a call to NumPy more often; between 2^18 and 2^22, this was fastest (benchmarks/one_pass.py).
_BLOCK_BYTES = 2**21
_FEWEST_ROWS, _MOST_ROWS = 128, 4096


@dataclass(frozen=True)
class Evaluation:
    """The reduced problem at one theta."""

    antecedent: Antecedent
    cost: float
    coefficients: np.ndarray  # on [1, z], (n_columns, n_outputs)
    factor: RidgeFactor
    masses: np.ndarray  # part of the weight on which each rule fires
    mean_squared_error: float  # of the standardised target, weighted, summed over outputs


@dataclass(frozen=True)
class Linearisation:
    """Gradient and Gauss-Newton matrix of the reduced cost, by the antecedent's parameters."""

    gradient: np.ndarray
    gauss_newton: np.ndarray


class SeparableProblem:
    """The reduced problem of one set of rows.

    Parameters
    ----------
    rows : Rows
    antecedent : Antecedent
        The rule base at the start, which freezes the consequents' local basis.
    order : {0, 1}
        Order of the consequents.
    alpha : float
        Ridge on the local coefficients, relative to the mean over rows.
    map_ordered : callable
        ``map``, or what stands in for it to spread chunks over workers; results in order.
    """

    def __init__(
        self,
        rows: Rows,
        antecedent: Antecedent,
        order: int,
        alpha: float,
        map_ordered: Callable[[Callable, Iterable], Iterable] = map,
    ):
        self.rows = rows
        self.antecedent = antecedent
        self.order = order
        self.alpha = alpha
        self.map_ordered = map_ordered
        self.n_basis = 1 + rows.X.shape[1] if order == 1 else 1
        self.n_columns = antecedent.n_rules * self.n_basis
        self.n_outputs = rows.y.shape[1]
        self._chunks = rows.chunks(self._block_rows(antecedent))
        self._weight = rows.total_weight
        no_coefficients = np.zeros((self.n_columns, self.n_outputs))
        gram = self._gram(antecedent, no_coefficients)[: self.n_columns, : self.n_columns]
        self.local = LocalBasis.from_gram(np.ascontiguousarray(gram), antecedent.n_rules)

    def _block_rows(self, antecedent):
        values_per_row = self.n_columns + antecedent.parameters.size + 4 * antecedent.n_terms
        fitting = _BLOCK_BYTES // (8 * values_per_row) // 64 * 64
        return int(np.clip(fitting, _FEWEST_ROWS, _MOST_ROWS))

    def _sum_over_chunks(self, accumulate, shapes):
        """Sum of what ``accumulate(chunk, sums)`` adds to zeroed arrays, in the chunks' order."""

        def of_chunk(chunk):
            sums = [np.zeros(shape, order="F") for shape in shapes]
            for part in chunk:
                accumulate(part, sums)
            return sums

        totals = None
        for sums in self.map_ordered(of_chunk, self._chunks):
            if totals is None:
                totals = sums
            else:
                for total, one in zip(totals, sums, strict=True):
                    total += one
        return [total / self._weight for total in totals]

    def _design(self, antecedent, Z, root_weight, out=None):
        """Weighted strengths, term log-gradient left out, and the weighted design."""
        strengths = antecedent.strengths(Z)
        if root_weight is not None:
            strengths = strengths * root_weight
        return design(strengths, basis(Z, self.order), out)

    def _gram(self, antecedent, reference):
        """[Phi, r]' S [Phi, r] / W, with r the residual of the reference coefficients."""
        n_columns, n_all = self.n_columns, self.n_columns + self.n_outputs

        def accumulate(part, sums):
            Z, target, root_weight = self.rows.read(part)
            stacked = np.empty((n_all, Z.shape[1]))
            self._design(antecedent, Z, root_weight, stacked[:n_columns])
            np.subtract(target, reference.T @ stacked[:n_columns], out=stacked[n_columns:])
            blas.dsyrk(1.0, stacked.T, beta=1.0, c=sums[0], trans=1, lower=1, overwrite_c=1)

        (gram,) = self._sum_over_chunks(accumulate, [(n_all, n_all)])
        return np.tril(gram) + np.tril(gram, -1).T

    def evaluate(self, parameters, reference=None):
        """Cost and coefficients at ``parameters``; ``reference`` coefficients on [1, z]."""
        antecedent = self.antecedent.with_parameters(parameters)
        p = self.n_columns
        if reference is None:
            reference = np.zeros((p, self.n_outputs))
        gram = self._gram(antecedent, reference)
        factor = RidgeFactor(self.local.transform_gram(gram[:p, :p]), self.alpha)
        reference_local = self.local.to_local(reference)
        slope = self.local.transform_rows(gram[:p, p:].copy()) - factor.alpha * reference_local
        change = factor.solve(slope)
        square = np.trace(gram[p:, p:]) + factor.alpha * np.sum(reference_local**2)
        cost = 0.5 * (square - np.sum(slope * change))
        local_coefficients = reference_local + change
        penalty = factor.alpha * np.sum(local_coefficients**2)
        return Evaluation(
            antecedent,
            cost,
            reference + self.local.to_global(change),
            factor,
            rule_masses(gram[:p, :p], antecedent.n_rules),
            max(2.0 * cost - penalty, 0.0),
        )

    def linearise(self, evaluation):
        """Gradient and Gauss-Newton matrix at an evaluated point."""
        antecedent, coefficients = evaluation.antecedent, evaluation.coefficients
        n_raw = antecedent.parameters.size
        by_rule = coefficients.reshape(antecedent.n_rules, self.n_basis, self.n_outputs)
        shapes = [(n_raw, n_raw), (n_raw, self.n_outputs)]
        shapes += [(self.n_columns, n_raw)] * self.n_outputs

        def accumulate(part, sums):
            square, slope, *cross = sums
            Z, target, root_weight = self.rows.read(part)
            log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
            strengths, shares = antecedent.normalise(log_mu)
            if root_weight is not None:
                strengths = strengths * root_weight
            basis_rows = basis(Z, self.order)
            phi = design(strengths, basis_rows)
            sensitivity = np.empty((n_raw, Z.shape[1]))
            for k in range(self.n_outputs):
                rule_outputs = by_rule[:, :, k] @ basis_rows
                rule_outputs *= strengths
                output = rule_outputs.sum(axis=0)
                by_term = antecedent.term_sensitivity(rule_outputs, output, shares)
                self._chain(gradients, by_term, sensitivity)
                blas.dsyrk(
                    1.0, sensitivity.T, beta=1.0, c=square, trans=1, lower=1, overwrite_c=1
                )
                slope[:, k] += sensitivity @ (target[k] - output)
                blas.dgemm(
                    1.0, phi.T, sensitivity.T, beta=1.0, c=cross[k], trans_a=1, overwrite_c=1
                )

        square, slope, *cross = self._sum_over_chunks(accumulate, shapes)
        gauss_newton = np.tril(square) + np.tril(square, -1).T
        for one in cross:
            half = evaluation.factor.half_solve(self.local.transform_rows(np.ascontiguousarray(one)))
            gauss_newton -= half.T @ half
        return Linearisation(-slope.sum(axis=1), gauss_newton)

    @staticmethod
    def _chain(gradients, by_term, out):
        """Sensitivity to every parameter: that to log mu times its derivative, group by group."""
        row = term = 0
        for gradient in gradients:
            n_parameters, n_terms, n_rows = gradient.shape
            target = out[row : row + n_parameters * n_terms].reshape(gradient.shape)
            np.multiply(gradient, by_term[term : term + n_terms], out=target)
            row, term = row + n_parameters * n_terms, term + n_terms
