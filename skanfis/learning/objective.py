r"""Training as a separable least-squares problem: cost, gradient and Gauss-Newton matrix.

With premise parameters theta, design Phi(theta), row weights S of sum W, and consequents beta,

    F(theta) = min_beta  1/2 [ |y - Phi beta|_S^2 / W + beta' P beta ] ,   P = lambda Q(theta) + A ,

where Q is the matrix of the disagreement V of rules that fire together, and A that of the other
penalties on the consequents (see ``penalty``). With r the residual and D = (d Phi / d theta) beta,

    grad F = [- D' S r + lambda/2 dV] / W ,
    H      = [D' S D - C (Phi' S Phi + W P)^-1 C'] / W ,    C = D' S Phi .

docs/mathematics.rst derives them, and dV, the derivative of V.

One iteration takes two passes over the rows (``passes``). :meth:`SeparableProblem.evaluate` sums
Phi' S [Phi, r] and gives cost and beta, which is all that a rejected step needs.
:meth:`SeparableProblem.linearise` sums the rest at this beta. An evaluation solves for the change
from *reference* coefficients, those of the last accepted point: r is their residual, and not y.

Theta here is the vector :attr:`Antecedent.parameters`; solvers move it through ``premise``.
"""

import copy
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..antecedent import Antecedent
from ..blocks import BLOCK_BYTES, fitting_rows
from ..consequent import LocalBasis, NormalFactor, outputs_of_rules, rule_masses
from .data import StandardisedData
from .gram import DesignMoments
from .passes import Design, FirstPass, JointPass, SecondPass
from .penalty import CommonLine, Penalty, disagreement_matrix

# Least 1 - h: for a row with a rule to itself it is a rounding error, and r / (1 - h) unbounded.
SMALLEST_FREEDOM = 1e-6


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The problem at one theta, and at coefficients that were solved for there, or given."""

    antecedent: Antecedent
    cost: float
    coefficients: np.ndarray  # on [1, z], (n_columns, n_outputs)
    masses: np.ndarray  # part of the weight on which each rule fires
    mean_squares: np.ndarray  # weighted, of the residual of every standardised output
    normal: "NormalEquations | None"  # None if the coefficients were given, not solved for

    @property
    def mean_squared_error(self):
        """Mean squared error of the standardised target, summed over outputs."""
        return float(self.mean_squares.sum())


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """The normal equations that the consequents were solved by, in the local basis."""

    gram: np.ndarray  # Phi' S Phi / W
    disagreement: np.ndarray  # Q
    penalty: np.ndarray  # P
    factor: NormalFactor  # of Phi' S Phi / W + P
    coefficients: np.ndarray  # local, (n_columns, n_outputs)
    free: np.ndarray | None  # columns that span the allowed coefficients, see ``CommonLine.free``

    def with_penalty(self, penalty, squares, free):
        """The same with another penalty, the change of the coefficients, and the new mean squares.

        ``squares`` are the mean squares before. It takes no pass over the rows, and adds the
        factor's shift to ``penalty`` in place.
        """
        factor = NormalFactor(self.gram + penalty, free)
        penalty.flat[:: penalty.shape[0] + 1] += factor.shift
        # By the normal equations, Phi' S r / W = P_0 u_0, with penalty P_0 and solution u_0 before.
        before, slope = self.coefficients, self.penalty @ self.coefficients
        # Start from the nearest coefficients that ``free`` allows.
        start = before if free is None else free @ (free.T @ before)
        solved = start + factor.solve(slope + self.gram @ (before - start) - penalty @ start)
        change = solved - before
        squares = squares + np.sum(change * (self.gram @ change - 2.0 * slope), axis=0)
        normal = replace(self, penalty=penalty, factor=factor, coefficients=solved, free=free)
        return normal, change, np.maximum(squares, 0.0)


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Gradient and Gauss-Newton matrix of the reduced cost, by the antecedent's parameters."""

    gradient: np.ndarray
    gauss_newton: np.ndarray
    cross: tuple[np.ndarray, ...]  # L^-1 C' / W for every output, L the factor of the consequents


class SeparableProblem:
    """The reduced problem of one set of rows.

    ``antecedent`` is the rule base at the start; the consequents' local basis is fixed by it.
    ``map_ordered`` is ``map``, or a function that spreads chunks over workers and keeps results in
    order. ``consequent_inputs`` are the inputs that the consequents are linear in, all by default.
    ``effective_weight`` counts the rows by weight.
    """

    def __init__(
        self,
        rows: StandardisedData,
        antecedent: Antecedent,
        penalty: Penalty,
        map_ordered: Callable[[Callable, Iterable], Iterable] = map,
        consequent_inputs: np.ndarray | None = None,
    ):
        self.rows, self.antecedent = rows, antecedent
        self.penalty, self.map_ordered = penalty, map_ordered
        every_input = np.arange(rows.X.shape[1])
        self.consequent_inputs = every_input if consequent_inputs is None else consequent_inputs
        self.n_basis = 1 + self.consequent_inputs.size
        self.n_columns = antecedent.n_rules * self.n_basis
        self.n_outputs = rows.y.shape[1]
        moments = DesignMoments(antecedent.share_counts, self.n_basis)
        self._design = Design(self.consequent_inputs, moments)
        self._block_rows = fitting_rows(
            sum(self._design.moments.shape)
            + self.n_columns
            + 6 * antecedent.parameters.size
            + 4 * (antecedent.n_terms + antecedent.n_rules)
        )
        self._weight, self.effective_weight = rows.total_weight, rows.effective_weight
        # glibc returns freed memory to the system beyond limits that grow with the largest piece
        # freed so far. Without a piece of this size, every block gets its arrays page by page
        # again, and a pass takes up to twice as long. The array itself is not used.
        np.empty(2 * BLOCK_BYTES // 8)
        no_coefficients = np.zeros((self.n_columns, self.n_outputs))
        self._sums_at_start: tuple | None = self._first_pass(antecedent, no_coefficients)
        gram = self._sums_at_start[0]
        self.on_sample: SeparableProblem | None = None
        self.local = LocalBasis.from_gram(gram, antecedent.n_rules)
        slopes = rows.inputs.varying(self.consequent_inputs)
        self.common_line = CommonLine(self.local, self._extent(antecedent), antecedent, slopes)

    def _extent(self, antecedent):
        """Distance from each rule's centre to the farthest row it stands for, along every input.

        It is weighted by the root of the strength, and at least one; (n_rules, n_basis - 1).
        """
        farthest = np.zeros((antecedent.n_rules, self.n_basis - 1))
        for _, Z, _, _ in self._blocks():
            root = np.sqrt(antecedent.strengths(Z))
            distance = np.abs(self._design.basis(Z)[1:] - self.local.center[:, :, None])
            distance *= root[:, None]
            np.maximum(farthest, distance.max(axis=2), out=farthest)
        return np.maximum(farthest, 1.0)

    @property
    def n_varying(self):
        """Outputs that vary, at least one: a constant one does not tell of the noise of others."""
        return max(int(np.count_nonzero(~self.rows.targets.is_constant)), 1)

    def with_penalty(self, penalty):
        """Return the same problem with another penalty; no pass over the rows."""
        other = copy.copy(self)
        other.penalty = penalty
        other.__dict__.pop("_pull", None)
        return other

    def on_all(self, rows):
        """Return the problem of all rows, of which this one's are a sample; no pass over them.

        The local basis stays that of the sample. Cost, consequents and gradient are those of all
        rows, the Gauss-Newton matrix is the sample's (subsampled Newton: Byrd et al. 2011). It is
        the dearest sum, and decides on the length of steps but not on where they end.
        """
        other = copy.copy(self)
        other.rows, other._weight, other.on_sample = rows, rows.total_weight, self
        other.effective_weight = rows.effective_weight
        other._sums_at_start = None
        return other

    def penalty_matrix(self, disagreement):
        """P in the local basis, from Q, the ``disagreement``."""
        return self.penalty.agreement * disagreement + self._pull

    @cached_property
    def _pull(self):
        return self.common_line.pull(self.penalty)

    def _blocks(self):
        return self.rows.blocks(self._block_rows)

    def _sum(self, one_pass):
        """The sums of a pass, over the total weight."""
        totals = self.rows.sum(one_pass, self._block_rows, self.map_ordered)
        return [total / self._weight for total in totals]

    def _first_pass(self, antecedent, reference):
        """Phi' S Phi, Phi' S r and r' S r (per output), over W; r is the reference's residual."""
        moments, slope, square = self._sum(FirstPass(self._design, antecedent, reference))
        return self._design.moments.gram(moments), np.ascontiguousarray(slope), square

    def evaluate(self, parameters, reference=None):
        """Cost and coefficients at ``parameters``; the coefficients ``reference`` are on [1, z]."""
        antecedent = self.antecedent.with_parameters(parameters)
        known = None
        if reference is None:
            known, reference = self._sums_at_start, np.zeros((self.n_columns, self.n_outputs))
        if known is None or not np.array_equal(parameters, self.antecedent.parameters):
            known = self._first_pass(antecedent, reference)
        gram, slope, square = known
        masses = rule_masses(gram, antecedent.n_rules)
        disagreement, gram = disagreement_matrix(gram, antecedent.n_rules, self.local)
        penalty = self.penalty_matrix(disagreement)
        free = self.common_line.free(self.penalty)
        factor = NormalFactor(gram + penalty, free)
        penalty.flat[:: self.n_columns + 1] += factor.shift
        reference_local = self.local.to_local(reference)
        pull = penalty @ reference_local
        slope = self.local.transform_rows(slope.copy()) - pull
        change = factor.solve(slope)
        costs = square + np.sum(reference_local * pull, axis=0) - np.sum(slope * change, axis=0)
        solved = reference_local + change
        paid = np.sum(solved * (penalty @ solved), axis=0)
        return Evaluation(
            antecedent,
            0.5 * float(costs.sum()),
            reference + self.local.to_global(change),
            masses,
            np.maximum(costs - paid, 0.0),
            NormalEquations(gram, disagreement, penalty, factor, solved, free),
        )

    def solved_again(self, evaluation):
        """An evaluation of this problem's rows, solved for this penalty; no pass over them."""
        before = evaluation.normal
        normal, change, squares = before.with_penalty(
            self.penalty_matrix(before.disagreement),
            evaluation.mean_squares,
            self.common_line.free(self.penalty),
        )
        paid = float(np.vdot(normal.coefficients, normal.penalty @ normal.coefficients))
        return replace(
            evaluation,
            cost=0.5 * (float(squares.sum()) + paid),
            coefficients=evaluation.coefficients + self.local.to_global(change),
            mean_squares=squares,
            normal=normal,
        )

    def linearise(self, evaluation):
        """Gradient and Gauss-Newton matrix at an evaluated point."""
        antecedent = evaluation.antecedent
        point = self._design, antecedent, evaluation.coefficients, self.penalty.agreement
        if self.on_sample is not None:
            slope, *_ = self._sum(JointPass(*point))
            return replace(self.curvature(evaluation), gradient=-slope)
        gauss_newton, slope, *cross = self._sum(SecondPass(*point))
        halves = []
        for one in cross:
            columns = np.ascontiguousarray(one.T)
            half = evaluation.normal.factor.half_solve(self.local.transform_rows(columns))
            gauss_newton -= half.T @ half
            halves.append(half)
        return Linearisation(-slope, gauss_newton, tuple(halves))

    def curvature(self, evaluation):
        """As :meth:`linearise`, but of a sample, if there is one; do not use the gradient."""
        if self.on_sample is None:
            return self.linearise(evaluation)
        # With the sample's own normal equations, both parts of H are of the same rows.
        sample, coefficients = self.on_sample, evaluation.coefficients
        own = sample.evaluate(evaluation.antecedent.parameters, coefficients)
        return sample.linearise(replace(own, coefficients=coefficients))

    def joint(self, parameters, coefficients):
        """Evaluation and both gradients, at ``parameters`` and any ``coefficients`` on [1, z]."""
        antecedent = self.antecedent.with_parameters(parameters)
        premises, slope, square, apart, masses = self._sum(
            JointPass(self._design, antecedent, coefficients, self.penalty.agreement)
        )
        local = self.local.to_local(coefficients)
        pull = self._pull @ local
        cost = 0.5 * (square.sum() + self.penalty.agreement * apart.sum() + np.sum(local * pull))
        evaluation = Evaluation(antecedent, cost, coefficients, masses, square, None)
        return evaluation, -premises, self._by_global(pull) - slope

    def residuals(self, evaluation):
        """Blocks of rows in order: slice, residual of the standardised target, weights."""
        for part, _, _, residual, weight in self._fired(evaluation):
            yield part, residual, weight

    def _fired(self, evaluation):
        """The same, with strengths of the rules and basis functions after the slice."""
        by_output = self._design.by_output(evaluation.coefficients)
        for part, Z, target, weight in self._blocks():
            strengths, basis_rows = evaluation.antecedent.strengths(Z), self._design.basis(Z)
            residual = target - outputs_of_rules(by_output, strengths, basis_rows)
            yield part, strengths, basis_rows, residual, weight

    def leave_one_out_error(self, evaluation):
        """Mean squared error of leaving out each row, at fixed premises (Allen 1974).

        It is the mean of (r_i / (1 - h_i))^2, with the leverage
        h_i = phi_i' (Phi' S Phi + W P)^-1 phi_i. Of a row that stands for several, one is left out.
        """
        total, unit = 0.0, self._weight / self.effective_weight
        # L^-1 T', so that the basis of this small matrix changes, and not that of the design.
        root = self.local.to_global(evaluation.normal.factor.root.T).T
        for _, strengths, basis_rows, residual, weight in self._fired(evaluation):
            half = root @ (strengths[:, None, :] * basis_rows).reshape(self.n_columns, -1)
            leverage = np.einsum("ij,ij->j", half, half)
            residual /= np.maximum(1.0 - unit * (leverage / self._weight), SMALLEST_FREEDOM)
            total += weight @ np.sum(residual**2, axis=0)
        return float(total / self._weight)

    def _by_global(self, local):
        """T^-T M: the derivative by coefficients on [1, z] from that by the local ones."""
        blocks = local.reshape(-1, self.n_basis, self.n_outputs).copy()
        blocks[:, 1:] *= self.local.spread[:, :, None]
        blocks[:, 1:] += self.local.center[:, :, None] * blocks[:, :1]
        return blocks.reshape(local.shape)
