r"""What the consequents pay beside their errors: for disagreement, for standing alone, for slopes.

With f_r the value of rule r and y_hat = sum_r w_r f_r, the cost of a model is

    F = 1/2 [ MSE + lambda V + sum_c alpha_c |delta_c|^2 + rho |slopes of b|^2 ] ,

    V = mean over rows of  sum_r w_r (f_r - y_hat)^2 ,

and every part is quadratic in the consequents beta.

*Agreement*, lambda. Because sum_r w_r = 1, for every row

    sum_r w_r (y - f_r)^2 = (y - y_hat)^2 + sum_r w_r (f_r - y_hat)^2

(the ambiguity decomposition of Krogh and Vedelsby 1995): local learning, in which every rule is a
model of the rows on which it fires, is global learning plus V, the *disagreement* of rules that
fire on the same row. lambda = 0 lets rules compensate one another at will, lambda = 1 is local
learning, and as lambda grows beyond all rules become one line. With G the Gram matrix of the
design, V = beta' Q beta with Q = B - G, where B is block diagonal and its block of rule r the row
sum over r' of the blocks G_(r, r'): nothing else is accumulated.

*The rules' common line*, alpha_c. Disagreement is weighed by the rows and says nothing where there
are none. There a pull of each rule by itself holds it: delta_r is how much the rule differs from
the rules' common line b, in its value at its own centre and in its slopes times the distance to
the farthest row for which it stands (see ``SeparableProblem``). b is the line of least squares
through all rules, that for which sum_r |delta_r|^2 is smallest. What a departure concerns, one
input alone, or how one input's part depends on another, are components with a pull each (see
``departures``): alpha times one of ``pulls``, whose geometric mean is one.

*The slopes of that line*, rho, are a plain ridge; of a single rule it is all there is. Nothing
pulls on the line's height: constants are free.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from .antecedent import Antecedent
from .consequent import LocalBasis
from .departures import Departures

__all__ = ["GREATEST_ALONE", "WEIGHTS", "CommonLine", "Penalty", "disagreement_matrix"]

# In standardised units: whoever reads the strongest rule alone is then as wrong as a model that
# explains three quarters of the variance; beyond, the rule says too little of the model.
GREATEST_ALONE = 0.5
# What comes first in a row of weights; after these, the pulls on all components.
WEIGHTS = ("agreement", "slope", "stiffness")


@dataclass(frozen=True)
class Penalty:
    """Weights of the parts of the penalty, each zero or positive, relative to a mean over rows."""

    agreement: float = 0.0  # lambda
    alpha: float = 0.0  # pull of each rule to the common line, the mean of all components
    slope: float | None = None  # rho, on the slopes of the common line; None is alpha
    stiffness: float = 0.0  # kappa, on the displacements of the premises
    pulls: tuple[float, ...] = ()  # of each component, in alphas; () is one for all

    @property
    def rho(self):
        """The weight of the common line's slopes."""
        return self.alpha if self.slope is None else self.slope

    def weights(self, n_components):
        """All weights in a row, (3 + n_components,): those of ``WEIGHTS``, and the pulls."""
        found = np.empty(len(WEIGHTS) + n_components)
        found[:3] = self.agreement, self.rho, self.stiffness
        found[3:] = self.pulls or 1.0
        found[3:] *= self.alpha
        return found

    @classmethod
    def of_weights(cls, weights):
        """The penalty of such a row; the pulls of several components are positive."""
        agreement, slope, stiffness, *alphas = weights.tolist()
        if len(alphas) == 1:
            return cls(agreement, alphas[0], slope, stiffness)
        alpha = float(np.exp(np.mean(np.log(weights[3:]))))
        return cls(agreement, alpha, slope, stiffness, tuple(one / alpha for one in alphas))


def disagreement_matrix(gram, n_rules):
    """Q = B - G of the disagreement V = beta' Q beta, from the Gram matrix on [1, z]."""
    n_columns = gram.shape[0]
    n_basis = n_columns // n_rules
    sums = gram.reshape(n_rules, n_basis, n_rules, n_basis).sum(axis=2)
    matrix = -gram
    blocks = matrix.reshape(n_rules, n_basis, n_rules, n_basis)
    rules = np.arange(n_rules)
    blocks[rules, :, rules, :] += sums
    return matrix


class CommonLine:
    """The line that all rules share, in the coordinates of their local basis.

    Parameters
    ----------
    local : LocalBasis
    extent : ndarray of shape (n_rules, n_basis - 1)
        How far from its centre each rule stands for rows, along every input.
    antecedent : Antecedent
        The rules.
    slopes : list of (int or None)
        The inputs that the consequents are linear in; None for those that are constant.

    Attributes
    ----------
    departures : Departures
        From the line, of the local coefficients u.
    slopes : ndarray of shape (n_columns, n_columns)
        E of |slopes of b|^2 = u' E u.
    height : ndarray of shape (n_columns,)
        The unit vector along which all rules rise alike: the null space of the whole penalty.
    """

    def __init__(
        self,
        local: LocalBasis,
        extent: np.ndarray,
        antecedent: Antecedent,
        slopes: list[int | None],
    ):
        n_rules, n_basis = local.center.shape[0], local.n_basis
        n_columns = n_rules * n_basis
        # In (value at the centre, slopes) of every rule, the rules of a common line b are A b.
        line = np.zeros((n_rules, n_basis, n_basis))
        line[:, np.arange(n_basis), np.arange(n_basis)] = 1.0
        line[:, 0, 1:] = local.center
        line[:, np.arange(1, n_basis), np.arange(1, n_basis)] = extent
        orthonormal, triangle = np.linalg.qr(line.reshape(n_columns, n_basis))
        # Local slopes are per spread of the rule; these are per unit of z.
        scale = np.ones((n_rules, n_basis))
        scale[:, 1:] = extent / local.spread
        scale = scale.ravel()
        along = orthonormal * scale[:, None]
        self.departures = Departures(scale, orthonormal, along, antecedent, slopes)
        # b = triangle^-1 along' u
        to_slopes = linalg.solve_triangular(triangle, along.T)[1:]
        self.slopes = to_slopes.T @ to_slopes
        self.height = np.zeros(n_columns)
        self.height[::n_basis] = n_rules**-0.5

    def pull(self, penalty: Penalty):
        """The matrix of what departures and slopes pay, sum_c alpha_c |delta_c|^2 + rho |b|^2."""
        if penalty.pulls:
            matrix = self.departures.pulled(penalty.weights(self.n_components)[3:])
        else:
            matrix = penalty.alpha * self.departures.together
        matrix += penalty.rho * self.slopes
        return matrix

    @property
    def n_components(self):
        """Of the departures."""
        return len(self.departures.components)
