r"""What the consequents pay beside their errors: for disagreement, for standing alone, for slopes.

The cost of a model is, as docs/mathematics.rst explains,

    F = 1/2 [ MSE + lambda V + sum_c alpha_c |delta_c|^2 + sum_j rho_j b_j^2 ] ,

and every part is quadratic in the consequents beta.

*Agreement*, lambda. V, the mean over rows of sum_r w_r (f_r - y_hat)^2, is the disagreement of
rules that fire on the same row.

*The rules' common line* b, alpha_c. It is the line of least squares through all rules. delta_r is
how much rule r differs from it, in its value at its own centre and in its slopes times the distance
to the farthest row for which it stands (see ``SeparableProblem``). ``departures`` says which parts
delta_c this has; alpha_c is alpha times one of ``pulls``, whose geometric mean is one.

*The slopes b_j of that line* have a plain ridge: rho_j is rho times one of ``slope_pulls``. Nothing
pulls on the line's height.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import linalg

from ..antecedent import Antecedent
from ..consequent import LocalBasis, NormalFactor
from .departures import departures

# What comes first in a row of weights; after these, those on all slopes and on all components.
WEIGHTS = ("agreement", "stiffness")


@dataclass(frozen=True)
class Penalty:
    """Weights of the parts of the penalty, each zero or positive, relative to a mean over rows."""

    agreement: float = 0.0  # lambda
    alpha: float = 0.0  # pull of each rule to the common line, the mean of all components
    slope: float = 0.0  # rho, on the slopes of the common line, their mean
    stiffness: float = 0.0  # kappa, on the displacements of the premises
    # Weight of each component of the departures, in units of alpha, and of the slope by each input,
    # in units of rho; one where none is named, as of inputs that were constant on the rows then.
    pulls: dict[tuple[int, ...], float] = field(default_factory=dict)
    slope_pulls: dict[int, float] = field(default_factory=dict)
    # Inputs, and the rules that have one slope by each.
    common: tuple[tuple[int, tuple[int, ...]], ...] = ()
    # Inputs, and the rules that have no slope by each.
    absent: tuple[tuple[int, tuple[int, ...]], ...] = ()

    @property
    def n_held(self):
        """How many coefficients less there are: of every common slope, one is left."""
        n_common = sum(len(rules) - 1 for _, rules in self.common)
        return n_common + sum(len(rules) for _, rules in self.absent)


def mean_and_parts(weights, names):
    """The geometric mean of some weights, and these in units of it by name, where there are two."""
    if weights.size == 1:
        return float(weights[0]), {}
    mean = float(np.exp(np.log(weights).sum() / weights.size))
    return mean, dict(zip(names, (weights / mean).tolist(), strict=True))


def disagreement_matrix(gram, n_rules, local: LocalBasis):
    """Q = B - G of the disagreement V = beta' Q beta, and G itself, in the local basis.

    B is block diagonal, its block of rule r the sum over r' of the blocks G_(r, r'); ``gram`` is
    that of the design on [1, z].
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
    """The line that all rules share, and what the local coefficients u of all rules pay by it.

    ``extent`` (n_rules, n_basis - 1) is how far from its centre each rule stands for rows, along
    every input; ``slopes`` are the inputs that the consequents are linear in, None for those that
    are constant. By the others, which the attribute lists, the line has slopes.

    With S u the values of the rules at their centres and their slopes times the extent, and A b
    those of a line b that is every rule, the common line is that of least squares: A = Q R,
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
        # Slopes of the line and departures out of u, (n_slopes + n_columns, n_columns), and the
        # part of the penalty that each row belongs to.
        self._rows = np.concatenate([to_slopes[is_varying], by_part])
        self._part = np.concatenate([np.arange(len(self.slopes)), len(self.slopes) + component])
        parts = ["slope"] * len(self.slopes) + ["alpha"] * len(self.components)
        self.kinds = np.array([*WEIGHTS, *parts])
        # From a local slope to one per unit that all rules share.
        self._per_unit = extent.mean(axis=0) / local.spread
        self._place = {j: k for k, j in enumerate(slopes) if j is not None}
        # Along which all rules rise alike: the null space of the whole penalty.
        self.height = np.zeros(n_columns)
        self.height[::n_basis] = self.n_rules**-0.5

    def own_slopes(self, j, rules):
        """Rows that give the slopes by an input of some rules out of u, in the shared unit."""
        found = np.zeros((rules.size, self.height.size))
        per_unit = self._per_unit[rules, self._place[j]]
        found[np.arange(rules.size), self._columns(j, rules)] = per_unit
        return found

    def free(self, penalty: Penalty):
        """Orthonormal columns that u is made of, (n_columns, n_free); None where it is any."""
        if not (penalty.common or penalty.absent):
            return None
        columns, is_free = np.eye(self.height.size), np.ones(self.height.size, dtype=bool)
        for j, rules in penalty.common:
            # The slopes are one in the shared unit; the first column stands for all of them.
            own = self._columns(j, rules)
            local = 1.0 / self._per_unit[list(rules), self._place[j]]
            columns[own[0], own] = local / np.linalg.norm(local)
            is_free[own[1:]] = False
        for j, rules in penalty.absent:
            is_free[self._columns(j, rules)] = False
        return np.ascontiguousarray(columns[is_free].T)

    def _columns(self, j, rules):
        """Places in u of the slopes by an input of some rules."""
        return np.array(rules) * (self.height.size // self.n_rules) + 1 + self._place[j]

    def pull(self, penalty: Penalty):
        """The matrix of what departures and slopes pay, alpha_c |delta_c|^2 and rho_j b_j^2."""
        weights = self.weights(penalty)[len(WEIGHTS) :]
        rooted = np.sqrt(weights)[self._part, None] * self._rows
        # What is constant has no slope to learn, but one that is held.
        return rooted.T @ rooted + penalty.slope * self._to_none.T @ self._to_none

    def weights(self, penalty: Penalty):
        """All weights in a row, of these ``kinds``: of ``WEIGHTS``, every slope and component."""
        rho, alpha = penalty.slope, penalty.alpha
        slopes = [rho * penalty.slope_pulls.get(j, 1.0) for j in self.slopes]
        components = [alpha * penalty.pulls.get(one, 1.0) for one in self.components]
        return np.array([penalty.agreement, penalty.stiffness, *slopes, *components], dtype=float)

    def squares(self, coefficients):
        """Of every slope, and of every component of the departures; local, summed over outputs."""
        own = self._rows @ coefficients
        return self._by_part(np.einsum("ij,ij->i", own, own))

    def traces(self, factor: NormalFactor):
        """The same of the columns of a root of the inverse of what is factorised."""
        return self._by_part(factor.squares(self._rows))

    def _by_part(self, values):
        return np.bincount(self._part, values, len(self.slopes) + len(self.components))
