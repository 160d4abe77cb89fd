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
very beta, so that the gradient is exact. Phi itself is never formed (see ``gram``). A pass holds
one block of rows per worker, whatever the number of rows.

The right side is the residual of *reference* coefficients, those of the last accepted point, not y:
the cost of a nearly exact fit would otherwise be a small difference of large numbers.

Theta here is the vector :attr:`Antecedent.parameters`; what solvers move is in ``premise``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .antecedent import Antecedent
from .consequent import LocalBasis, RidgeFactor, basis, rule_masses, rule_outputs
from .gram import DesignMoments
from .rows import Rows

__all__ = ["Evaluation", "JointGradient", "Linearisation", "SeparableProblem"]

# Working set of a block in bytes. Smaller blocks stay nearer to the processor but pay the price of
# a call to NumPy more often; of 2^18 to 2^24, this was fastest or near it (benchmarks/one_pass.py).
_BLOCK_BYTES = 2**22
_FEWEST_ROWS, _MOST_ROWS = 128, 4096


def _keep_freed_memory():
    """Have the C library keep what a block frees for the next block.

    glibc hands freed memory back to the operating system beyond limits that grow with the largest
    piece freed so far; without one of this size, every block gets its arrays page by page again,
    and a pass takes up to twice as long. Nothing is written to it. Elsewhere this does nothing.
    """
    np.empty(2 * _BLOCK_BYTES // 8)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The problem at one theta, and at the coefficients solved for there or given."""

    antecedent: Antecedent
    cost: float
    coefficients: np.ndarray  # on [1, z], (n_columns, n_outputs)
    factor: RidgeFactor | None  # None where the coefficients were given, not solved for
    masses: np.ndarray  # part of the weight on which each rule fires
    mean_squared_error: float  # of the standardised target, weighted, summed over outputs


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Gradient and Gauss-Newton matrix of the reduced cost, by the antecedent's parameters."""

    gradient: np.ndarray
    gauss_newton: np.ndarray


@dataclass(frozen=True, eq=False)
class JointGradient:
    """The cost at given coefficients, and its gradient by premises and coefficients together."""

    evaluation: Evaluation
    premises: np.ndarray  # by the antecedent's parameters
    coefficients: np.ndarray  # by those on [1, z]


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
    consequent_inputs : ndarray of int, optional
        The inputs that the consequents are linear in, if not all are.
    """

    def __init__(
        self,
        rows: Rows,
        antecedent: Antecedent,
        order: int,
        alpha: float,
        map_ordered: Callable[[Callable, Iterable], Iterable] = map,
        consequent_inputs: np.ndarray | None = None,
    ):
        self.rows = rows
        self.antecedent = antecedent
        self.order = order
        self.alpha = alpha
        self.map_ordered = map_ordered
        every_input = np.arange(rows.X.shape[1])
        given = every_input if consequent_inputs is None else consequent_inputs
        self.consequent_inputs = given if order == 1 else every_input[:0]
        self._takes_every_input = self.consequent_inputs.size == every_input.size
        self.n_basis = 1 + self.consequent_inputs.size
        self.n_columns = antecedent.n_rules * self.n_basis
        self.n_outputs = rows.y.shape[1]
        self._moments = DesignMoments(antecedent.share_counts, self.n_basis)
        self._chunks = rows.chunks(self._block_rows(antecedent))
        self._weight = rows.total_weight
        _keep_freed_memory()
        no_coefficients = np.zeros((self.n_columns, self.n_outputs))
        gram, _, _ = self._first_pass(antecedent, no_coefficients)
        self.local = LocalBasis.from_gram(gram, antecedent.n_rules)

    def _block_rows(self, antecedent):
        values_per_row = (
            sum(self._moments.shape)
            + antecedent.parameters.size * (1 + self.n_basis)
            + 4 * (antecedent.n_terms + antecedent.n_rules)
        )
        fitting = _BLOCK_BYTES // (8 * values_per_row) // 64 * 64
        return int(np.clip(fitting, _FEWEST_ROWS, _MOST_ROWS))

    def _basis(self, Z):
        """Basis functions of the consequents at a block of rows."""
        return basis(Z if self._takes_every_input else Z[self.consequent_inputs])

    def _sum_over_chunks(self, accumulate, shapes):
        """Sum of what ``accumulate(rows, sums)`` adds to zeroed arrays, in the chunks' order."""

        def of_chunk(chunk):
            sums = [np.zeros(shape, order="F") for shape in shapes]
            for part in chunk:
                accumulate(part, sums)
            return sums

        totals = [np.zeros(shape, order="F") for shape in shapes]
        for sums in self.map_ordered(of_chunk, self._chunks):
            for total, one in zip(totals, sums, strict=True):
                total += one
        return [total / self._weight for total in totals]

    def _first_pass(self, antecedent, reference):
        """Phi' S Phi, Phi' S r and r' S r (per output), over W; r is the reference's residual."""
        by_rule = reference.reshape(antecedent.n_rules, self.n_basis, self.n_outputs)

        def accumulate(part, sums):
            moments, slope, square = sums
            Z, target, weight = self.rows.read(part)
            basis_rows = self._basis(Z)
            weighted_basis = basis_rows if weight is None else basis_rows * weight
            strengths, shares = antecedent.strengths_and_shares(Z)
            self._moments.accumulate(moments, shares, basis_rows, weighted_basis)
            for k in range(self.n_outputs):
                residual = target[k] - rule_outputs(by_rule[:, :, k], strengths, basis_rows)[1]
                slope[:, k] += (strengths @ (weighted_basis * residual).T).ravel()
                square[k] += weighted_basis[0] @ residual**2  # the basis begins with 1

        shapes = [self._moments.shape, reference.shape, (self.n_outputs,)]
        moments, slope, square = self._sum_over_chunks(accumulate, shapes)
        return self._moments.gram(moments), np.ascontiguousarray(slope), square

    def evaluate(self, parameters, reference=None):
        """Cost and coefficients at ``parameters``; ``reference`` coefficients on [1, z]."""
        antecedent = self.antecedent.with_parameters(parameters)
        if reference is None:
            reference = np.zeros((self.n_columns, self.n_outputs))
        gram, slope, square = self._first_pass(antecedent, reference)
        factor = RidgeFactor(self.local.transform_gram(gram), self.alpha)
        reference_local = self.local.to_local(reference)
        slope = self.local.transform_rows(slope) - factor.alpha * reference_local
        change = factor.solve(slope)
        at_reference = square.sum() + factor.alpha * np.sum(reference_local**2)
        cost = 0.5 * (at_reference - np.sum(slope * change))
        penalty = factor.alpha * np.sum((reference_local + change) ** 2)
        return Evaluation(
            antecedent,
            cost,
            reference + self.local.to_global(change),
            factor,
            rule_masses(gram, antecedent.n_rules),
            max(2.0 * cost - penalty, 0.0),
        )

    def linearise(self, evaluation):
        """Gradient and Gauss-Newton matrix at an evaluated point."""
        antecedent = evaluation.antecedent
        n_raw, n_rules = antecedent.parameters.size, antecedent.n_rules
        by_rule = evaluation.coefficients.reshape(n_rules, self.n_basis, self.n_outputs)

        def accumulate(part, sums):
            square, slope, *cross = sums
            Z, target, weight = self.rows.read(part)
            basis_rows = self._basis(Z)
            weighted_basis = basis_rows if weight is None else basis_rows * weight
            log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
            strengths, shares = antecedent.normalise(log_mu)
            n_rows = Z.shape[1]
            sensitivity = np.empty((n_raw, n_rows))
            for k in range(self.n_outputs):
                by_rule_k, output = rule_outputs(by_rule[:, :, k], strengths, basis_rows)
                by_term = antecedent.term_sensitivity(by_rule_k, output, shares)
                self._chain(gradients, by_term, sensitivity)
                # One product for D' S Phi and, the basis beginning with 1, the weighted D itself.
                products = sensitivity[:, None, :] * weighted_basis
                square += products[:, 0] @ sensitivity.T
                slope += products[:, 0] @ (target[k] - output)
                cross[k] += products.reshape(-1, n_rows) @ strengths.T

        shapes = [(n_raw, n_raw), (n_raw,)]
        shapes += [(n_raw * self.n_basis, n_rules)] * self.n_outputs
        gauss_newton, slope, *cross = self._sum_over_chunks(accumulate, shapes)
        for one in cross:
            by_column = one.reshape(n_raw, self.n_basis, n_rules).transpose(2, 1, 0)
            columns = np.ascontiguousarray(by_column).reshape(self.n_columns, n_raw)
            half = evaluation.factor.half_solve(self.local.transform_rows(columns))
            gauss_newton -= half.T @ half
        return Linearisation(-slope, gauss_newton)

    def joint(self, parameters, coefficients):
        """Cost and its gradient at ``parameters`` and any ``coefficients`` on [1, z]."""
        antecedent = self.antecedent.with_parameters(parameters)
        premises, slope, square, masses = self._joint_pass(antecedent, coefficients)
        local = self.local.to_local(coefficients)
        cost = 0.5 * (square.sum() + self.alpha * np.sum(local**2))
        return JointGradient(
            Evaluation(antecedent, cost, coefficients, None, masses, float(square.sum())),
            -premises,
            self.alpha * self._by_global(local) - slope,
        )

    def residuals(self, evaluation):
        """Blocks of rows in order: slice, residual of the standardised target, weights or None."""
        by_rule = evaluation.coefficients.reshape(-1, self.n_basis, self.n_outputs)
        for chunk in self._chunks:
            for part in chunk:
                Z, target, weight = self.rows.read(part)
                strengths = evaluation.antecedent.strengths(Z)
                basis_rows = self._basis(Z)
                for k in range(self.n_outputs):
                    target[k] -= rule_outputs(by_rule[:, :, k], strengths, basis_rows)[1]
                yield part, target, weight

    def leverage(self, evaluation, part):
        """h_i = phi_i' (Phi' S Phi + alpha W I)^-1 phi_i of some rows, shape (n_rows,)."""
        Z, _, _ = self.rows.read(part)
        strengths = evaluation.antecedent.strengths(Z)
        design = (strengths[:, None, :] * self._basis(Z)).reshape(self.n_columns, -1)
        half = evaluation.factor.half_solve(self.local.transform_rows(design))
        return np.sum(half**2, axis=0) / self._weight

    def _joint_pass(self, antecedent, coefficients):
        """D' S r, Phi' S r, r' S r (per output) and each rule's mass, over W."""
        by_rule = coefficients.reshape(antecedent.n_rules, self.n_basis, self.n_outputs)

        def accumulate(part, sums):
            premises, slope, square, masses = sums
            Z, target, weight = self.rows.read(part)
            basis_rows = self._basis(Z)
            log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
            strengths, shares = antecedent.normalise(log_mu)
            masses += strengths.sum(axis=1) if weight is None else strengths @ weight
            for k in range(self.n_outputs):
                by_rule_k, output = rule_outputs(by_rule[:, :, k], strengths, basis_rows)
                residual = target[k] - output
                weighted = residual if weight is None else residual * weight
                slope[:, k] += (strengths @ (basis_rows * weighted).T).ravel()
                square[k] += weighted @ residual
                by_term = antecedent.term_sensitivity(by_rule_k, output, shares)
                by_term *= weighted
                premises += self._chain_sum(gradients, by_term)

        shapes = [(antecedent.parameters.size,), coefficients.shape]
        shapes += [(self.n_outputs,), (antecedent.n_rules,)]
        return self._sum_over_chunks(accumulate, shapes)

    def _by_global(self, local):
        """T^-T M: the derivative by coefficients on [1, z] from that by the local ones."""
        blocks = local.reshape(-1, self.n_basis, self.n_outputs).copy()
        blocks[:, 1:] *= self.local.spread[:, :, None]
        blocks[:, 1:] += self.local.center[:, :, None] * blocks[:, :1]
        return blocks.reshape(local.shape)

    @staticmethod
    def _chain_sum(gradients, by_term):
        """Sum over rows of what ``_chain`` gives, without an array of every parameter's rows."""
        parts, term = [], 0
        for gradient in gradients:
            n_terms = gradient.shape[1]
            own = by_term[term : term + n_terms]
            parts.append(np.einsum("pti,ti->pt", gradient, own).ravel())
            term += n_terms
        return np.concatenate(parts) if parts else np.empty(0)

    @staticmethod
    def _chain(gradients, by_term, out):
        """Sensitivity to every parameter: that to log mu times its derivative, group by group."""
        row = term = 0
        for gradient in gradients:
            n_parameters, n_terms, _ = gradient.shape
            target = out[row : row + n_parameters * n_terms].reshape(gradient.shape)
            np.multiply(gradient, by_term[term : term + n_terms], out=target)
            row, term = row + n_parameters * n_terms, term + n_terms
