r"""The penalty on the consequents: on disagreement, on departures from a common line, on slopes.

The cost of a model is, as docs/mathematics.rst explains,

    F = 1/2 [ MSE + lambda V + sum_c alpha_c |delta_c|^2 + sum_j rho_j b_j^2 ] ,

and every part is quadratic in the consequents beta.

*Agreement*, lambda. V, the mean over rows of sum_r w_r (f_r - y_hat)^2, is the disagreement of
rules that fire on the same row.

*The rules' common line* b, alpha_c. It is the least-squares line through all rules. delta_r is the
departure of rule r from it: in its value at its own centre, and in its slopes times the distance to
the farthest row for which it stands (see ``SeparableProblem``). ``departures`` splits all delta_r
into components delta_c. alpha_c is alpha times one of ``pulls``, whose geometric mean is one.

*The slopes b_j of that line* have a plain ridge: rho_j is rho times one of ``slope_pulls``. The
line's height has no penalty. ``evidence`` finds the weights, when ``search.tuning`` asks it.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg, sparse

from ..antecedent import Antecedent
from ..consequent import LocalBasis, NormalFactor
from .departures import departures

# The first entries of ``CommonLine.weights``; those of all slopes and all components follow.
WEIGHTS = ("agreement", "stiffness")
# With fewer columns, products of dense matrices are faster even if most entries are zero.
_SPARSE_COLUMNS = 100


@dataclass(frozen=True)
class Penalty:
    """Weights of the parts of the penalty, each zero or positive, relative to a mean over rows."""

    agreement: float = 0.0  # lambda
    alpha: float = 0.0  # pull of the rules to the common line, the mean over components
    slope: float = 0.0  # rho, on the slopes of the common line, the mean over inputs
    stiffness: float = 0.0  # kappa, on the displacements of the premises
    # Weight of each component of the departures, in units of alpha, and of the slope by each input,
    # in units of rho. One that is missing is 1, as of an input that was constant in a sample.
    pulls: dict[tuple[int, ...], float] = field(default_factory=dict)
    slope_pulls: dict[int, float] = field(default_factory=dict)
    # Pairs of an input and the rules that share one slope by it.
    common: tuple[tuple[int, tuple[int, ...]], ...] = ()
    # Pairs of an input and the rules that have no slope by it.
    absent: tuple[tuple[int, tuple[int, ...]], ...] = ()

    @property
    def n_held(self):
        """Coefficients that are not free; of every common slope, one is."""
        n_common = sum(len(rules) - 1 for _, rules in self.common)
        return n_common + sum(len(rules) for _, rules in self.absent)


def mean_and_parts(weights, names):
    """The geometric mean of weights, and their ratios to it by name; none of a single weight."""
    if weights.size == 1:
        return float(weights[0]), {}
    mean = float(np.exp(np.log(weights).sum() / weights.size))
    return mean, dict(zip(names, (weights / mean).tolist(), strict=True))


def disagreement_matrix(gram, n_rules, local: LocalBasis):
    """Q = B - G of the disagreement V = beta' Q beta, and G itself, in the local basis.

    B is block diagonal: its block for rule r is the sum over r' of the blocks G_(r, r'). ``gram``
    is the Gram matrix of the design on [1, z].
    """
    n_columns = gram.shape[0]
    n_basis = n_columns // n_rules
    sums = gram.reshape(n_rules, n_basis, n_rules, n_basis).sum(axis=2)
    gram = local.transform_gram(gram)
    matrix = -gram
    blocks = matrix.reshape(n_rules, n_basis, n_rules, n_basis)
    rules = np.arange(n_rules)
    blocks[rules, :, rules, :] += local.transform_blocks(sums)
    return matrix, gram


class CommonLine:
    """The line that all rules share, and the penalty on local coefficients u that refers to it.

    ``extent`` (n_rules, n_basis - 1) is the distance, along every input, from a rule's centre to
    the farthest row for which it stands. ``slopes`` are the inputs that the consequents are linear
    in, with None for constant ones; the attribute ``slopes`` lists the others.

    S u are the values of the rules at their centres, and their slopes times the extent. A b is the
    same if every rule is the line b. The common line is the least-squares one: with A = Q R,
    b = R^-1 Q' S u, and the departures are N u = (S - Q Q' S) u.
    """

    def __init__(
        self,
        local: LocalBasis,
        extent: np.ndarray,
        antecedent: Antecedent,
        slopes: list[int | None],
    ):
        self.n_rules, n_basis = local.center.shape[0], local.n_basis
        n_columns, place = self.n_rules * n_basis, np.arange(1, n_basis)
        line = np.zeros((self.n_rules, n_basis, n_basis))  # A
        line[:, 0, 0] = 1.0
        line[:, 0, 1:] = local.center
        line[:, place, place] = extent
        orthonormal, triangle = np.linalg.qr(line.reshape(n_columns, n_basis))
        scale = np.ones((self.n_rules, n_basis))  # the diagonal of S
        scale[:, 1:] = extent / local.spread
        scale = scale.ravel()
        along = orthonormal * scale[:, None]  # S Q
        from_line = np.diag(scale) - orthonormal @ along.T  # N
        by_part, self.components, component = departures(from_line, antecedent, slopes)
        to_slopes = linalg.solve_triangular(triangle, along.T)[1:]
        is_varying = np.array([j is not None for j in slopes], dtype=bool)
        self.slopes = [j for j in slopes if j is not None]
        self._to_none = to_slopes[~is_varying]
        # Rows that map u to slopes of the line and to departures, (n_slopes + n_columns,
        # n_columns), and the part of the penalty that each row belongs to.
        self._rows = np.concatenate([to_slopes[is_varying], by_part])
        if self.n_rules == 1 and n_columns > _SPARSE_COLUMNS:
            # Its slopes are those of the line, and it departs by nothing: most entries are zero.
            self._rows = sparse.csr_array(self._rows)
        self._part = np.concatenate([np.arange(len(self.slopes)), len(self.slopes) + component])
        self.kinds = [*WEIGHTS, *["slope"] * len(self.slopes), *["alpha"] * len(self.components)]
        # Where the weights of the slopes, and those of the components, stand among all.
        last = len(WEIGHTS) + len(self.slopes)
        self.of_slopes, self.of_components = slice(len(WEIGHTS), last), slice(last, None)
        # Factors that convert local slopes to a unit that all rules share.
        self._per_unit = extent.mean(axis=0) / local.spread
        self._place = {j: k for k, j in enumerate(slopes) if j is not None}
        # The direction in which all rules rise alike: the null space of the whole penalty.
        self.height = np.zeros(n_columns)
        self.height[::n_basis] = self.n_rules**-0.5

    def own_slopes(self, j, rules):
        """Rows that map u to the slopes of ``rules`` by input j, in the shared unit."""
        found = np.zeros((rules.size, self.height.size))
        per_unit = self._per_unit[rules, self._place[j]]
        found[np.arange(rules.size), self._columns(j, rules)] = per_unit
        return found

    def free(self, penalty: Penalty):
        """Orthonormal columns that span the allowed u, (n_columns, n_free); None if any u is."""
        if not (penalty.common or penalty.absent):
            return None
        columns, is_free = np.eye(self.height.size), np.ones(self.height.size, dtype=bool)
        for j, rules in penalty.common:
            # The slopes are equal in the shared unit; one column stands for all of them.
            own = self._columns(j, rules)
            local = 1.0 / self._per_unit[list(rules), self._place[j]]
            columns[own[0], own] = local / np.linalg.norm(local)
            is_free[own[1:]] = False
        for j, rules in penalty.absent:
            is_free[self._columns(j, rules)] = False
        return np.ascontiguousarray(columns[is_free].T)

    def _columns(self, j, rules):
        """Positions in u of the slopes of ``rules`` by input j."""
        return np.array(rules) * (self.height.size // self.n_rules) + 1 + self._place[j]

    def pull(self, penalty: Penalty):
        """The matrix of the penalty on departures and slopes, alpha_c |delta_c|^2 + rho_j b_j^2."""
        weights = self.weights(penalty)[len(WEIGHTS) :]
        rooted = np.sqrt(weights)[self._part, None] * self._rows
        # A slope by a constant input cannot be learnt; rho holds it at zero.
        return rooted.T @ rooted + penalty.slope * self._to_none.T @ self._to_none

    def weights(self, penalty: Penalty):
        """All weights, in the order of ``kinds``: ``WEIGHTS``, then slopes, then components."""
        rho, alpha = penalty.slope, penalty.alpha
        slopes = [rho * penalty.slope_pulls.get(j, 1.0) for j in self.slopes]
        components = [alpha * penalty.pulls.get(one, 1.0) for one in self.components]
        return np.array([penalty.agreement, penalty.stiffness, *slopes, *components], dtype=float)

    def squares(self, coefficients):
        """Squares of every slope and component, summed over outputs; ``coefficients`` are local."""
        own = self._rows @ coefficients
        return self._by_part(np.einsum("ij,ij->i", own, own))

    def traces(self, factor: NormalFactor):
        """For every slope and component, Tr R (G + P)^-1 R', R its rows."""
        return self._by_part(factor.squares(self._rows))

    def _by_part(self, values):
        return np.bincount(self._part, values, len(self.slopes) + len(self.components))
