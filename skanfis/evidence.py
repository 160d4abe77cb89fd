r"""The evidence of a model: how probable the data are, with all that was learnt averaged out.

The cost of ``penalty`` is, in units of the noise's variance sigma^2, minus the logarithm of a
posterior: y = Phi beta + eps with eps ~ N(0, sigma^2 / s), consequents with the prior precision
n P / sigma^2, displacements x of the premises with n kappa / sigma^2, where n is the number of rows
(by weight) and kappa the stiffness. Laplace's method integrates over beta and x, and sigma^2 is put
at its maximum (MacKay 1992; for the linear part alone this is restricted maximum likelihood):

    -2 log p = (n - 1) m log 2F + m [log |M| - log |P|+ + log R] + log |I + H / kappa| ,

    2F = MSE + beta' P beta + kappa |x|^2 ,    M = Phi' S Phi / W + P ,

up to what is the same for all models of the same data; m is the number of outputs, R that of rules,
H the reduced Gauss-Newton matrix by x. |P|+ leaves out the one direction on which no penalty acts,
that in which all rules rise alike: it has a flat prior, for which n counts one less; its length in
beta grows as sqrt(R), for which log R makes good.

The weights tau of the penalty, P = sum_k tau_k P_k, are where the evidence is largest, which is
where, for each, as much is paid as is determined (Fellner and Schall; Wood and Fasiolo 2017):

    n / sigma^2  beta' tau_k P_k beta = m [ tr(P^- tau_k P_k) - tr(M^-1 tau_k P_k) ] ,

    n / sigma^2  kappa (|x|^2 + nu x0^2) = tr H (H + kappa)^-1 + nu ,

    sigma^2 = n 2F / ((n - 1) m) ,

each weight being multiplied by the ratio of the right side to the left. nu and x0 are the prior of
the stiffness, as if nu displacements of size x0 had been seen before, which adds nu (t - log t - 1)
to -2 log p, t = n kappa x0^2 / sigma^2; sigma^2 is held in it. At fixed premises this
takes no pass over the rows: for any weights, beta is one solve away.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .consequent import NormalFactor
from .objective import NormalEquations
from .penalty import CommonLine, Penalty

__all__ = [
    "FREE",
    "PRIOR_DISPLACEMENT",
    "Laplace",
    "extrapolated",
    "is_settled",
    "laplace",
    "least_weights",
    "reestimated",
]

# The weights that the evidence can find.
FREE = ("agreement", "alpha", "slope", "stiffness")
# Beyond these the weights mean nothing: rounding, and rules that are one line to every digit.
_SMALLEST = {"agreement": 1e-12, "alpha": 1e-12, "slope": 1e-12, "stiffness": 1e-10}
_LARGEST = {"agreement": 1.0, "alpha": 1e4, "slope": 1e4, "stiffness": 1e4}
# The premises' weight has a prior of its own, as if so many displacements of such a size had been
# seen before: a fifth of a spacing is what a term is expected to move.
PRIOR_DISPLACEMENT = 0.2
_PRIOR_NUMBER = 100.0
# Least weights where there are fewer distinct rows than this per consequent.
_UNDERDETERMINED = ((1.0, 1e-4), (2.0, 1e-6))
# Most of a target lies within so many standard deviations of its mean.
_FAR = 2.0
# One step changes a weight by no more than this factor.
_LARGEST_STEP = 100.0
# Successive steps of a weight are alike from this ratio on; next to one, all the way is open.
_ALIKE, _MOST_ALIKE = 0.5, 0.99
# What changes a weight by less leaves its second digit as it is.
_SETTLED = 5e-3
# The target of a fit that is exact to rounding has no more digits than this, squared.
_LEAST_ERROR = 1e-22


@dataclass(frozen=True)
class Laplace:
    """The posterior at a point: all that the evidence and its derivatives are made of.

    Parameters
    ----------
    penalty : Penalty
    n_rows : float
        Rows by weight.
    twice_cost : float
        2F.
    n_outputs : int
        Those that vary.
    determinants : float
        log |M| - log |P|+ + log R.
    paid : dict of str to float
        For each part of the penalty, beta' tau P beta (or kappa |x|^2).
    parts : dict of str to ndarray
        Matrices of those of the consequents.
    prior, factor : NormalFactor
        Of P, its null space joined in at P's own size, and of M.
    curvature : ndarray of shape (n_displacements,)
        Eigenvalues of H.
    n_columns : int
        Consequent parameters of one output.
    """

    penalty: Penalty
    n_rows: float
    twice_cost: float
    n_outputs: int
    determinants: float
    paid: dict
    parts: dict
    prior: NormalFactor
    factor: NormalFactor
    curvature: np.ndarray
    n_columns: int

    @cached_property
    def held_before(self):
        """Of each part of the penalty, by its weight, the trace in the prior.

        These and ``held_after`` take as long as all the rest, and are seldom asked of the last of
        several posteriors.
        """
        found = self._traces(self.prior)
        if self.curvature.size:
            found["stiffness"] = float(self.curvature.size)
        return found

    @cached_property
    def held_after(self):
        """The same in the posterior: how many parameters each part holds."""
        found = self._traces(self.factor)
        if self.curvature.size:
            stiffness = self.penalty.stiffness
            # Without stiffness nothing is held, not even where there is no curvature either.
            held = np.sum(stiffness / (self.curvature + stiffness)) if stiffness else 0.0
            found["stiffness"] = float(held)
        return found

    def _traces(self, factor):
        weights = _weighted(self.penalty)
        traces = factor.traces(self.parts.values())
        return {key: weights[key] * one for key, one in zip(self.parts, traces, strict=True)}

    @property
    def freedom(self):
        """Rows by weight times outputs, less what a constant takes."""
        return max(self.n_rows - 1.0, 0.5) * self.n_outputs

    @property
    def noise_variance(self):
        """sigma^2 of the standardised target, the mean over outputs."""
        return self.n_rows * self.twice_cost / self.freedom

    @property
    def prior_precision(self):
        """N kappa / sigma^2, in units of what is expected of it."""
        ratio = self.n_rows / self.noise_variance * self.penalty.stiffness
        return ratio * PRIOR_DISPLACEMENT**2

    @property
    def minus_twice_log(self):
        """-2 log p, up to a constant of the data."""
        consequents = self.freedom * np.log(self.twice_cost) + self.n_outputs * self.determinants
        if self.curvature.size == 0 or self.penalty.stiffness == 0.0:
            return consequents
        expected = self.prior_precision
        return (
            consequents
            + np.sum(np.log1p(self.curvature / self.penalty.stiffness))
            + _PRIOR_NUMBER * (expected - np.log(expected) - 1.0)
        )

    @property
    def n_effective(self):
        """Effective number of all parameters: of consequents, what the penalty leaves free."""
        return self.n_columns + self.curvature.size - sum(self.held_after.values())

    @property
    def n_effective_premises(self):
        """Effective number of the displacements: of each, the part that the data decide on."""
        return self.curvature.size - self.held_after["stiffness"] if self.curvature.size else 0.0


def _weighted(penalty):
    return {"agreement": penalty.agreement, "alpha": penalty.alpha, "slope": penalty.rho}


def _all_weights(penalty):
    return {**_weighted(penalty), "stiffness": penalty.stiffness}


def laplace(
    normal: NormalEquations,
    line: CommonLine,
    mean_squared_error: float,
    penalty: Penalty,
    n_rows: float,
    n_rules: int,
    displacement=None,
    curvature=None,
    n_outputs=None,
):
    """The posterior at fixed premises, for a penalty of any weights.

    ``normal`` and ``mean_squared_error`` are those of an evaluation, at weights of its own;
    ``n_outputs`` are those that vary, if not all do: a constant target says nothing about the noise
    of another.
    """
    parts = {"agreement": normal.disagreement, "alpha": line.own, "slope": line.slopes}
    weights = _weighted(penalty)
    matrix = np.zeros_like(normal.gram)
    for key, part in parts.items():
        matrix += weights[key] * part
    # Of one constant there is no penalty at all: any size will do.
    size = np.trace(matrix) / matrix.shape[0] or 1.0
    # ``matrix`` takes on the factor's shift.
    own, _, error = normal.with_penalty(matrix, mean_squared_error)
    factor, solved = own.factor, own.coefficients
    # The null space of P joins in at P's own size, so that what is left has a Cholesky factor.
    prior = NormalFactor(matrix + size * np.outer(line.height, line.height))
    paid = {
        key: weights[key] * float(np.sum(solved * (part @ solved))) for key, part in parts.items()
    }
    curvature = np.empty(0) if curvature is None else curvature
    if curvature.size:
        paid["stiffness"] = penalty.stiffness * float(displacement @ displacement)
    of_displacements = paid.get("stiffness", 0.0)
    return Laplace(
        penalty,
        n_rows,
        max(error + float(np.sum(solved * (matrix @ solved))) + of_displacements, _LEAST_ERROR),
        normal.coefficients.shape[1] if n_outputs is None else n_outputs,
        factor.log_determinant() - prior.log_determinant() + np.log(size) + np.log(n_rules),
        paid,
        parts,
        prior,
        factor,
        curvature,
        matrix.shape[0],
    )


def least_weights(posterior: Laplace, n_rules, n_distinct):
    """Weights below which the prior expects what no rule that can be read does.

    A priori, the disagreement V is expected to be n_columns sigma^2 / (n lambda), and a departure
    from the common line to have the variance sigma^2 / (n alpha): neither is to exceed the square
    of what is far for a target, two of its standard deviations.

    Where there are hardly more distinct rows than consequents, a model that passes through every
    row explains them without noise, and nothing in the data speaks against it. And rounding errors
    grow by 1 / alpha along what the data leave open. There the weights are never next to nothing.
    """
    rows_each = n_distinct / posterior.n_columns
    least = next((weight for enough, weight in _UNDERDETERMINED if rows_each < enough), 0.0)
    weights = dict.fromkeys(("agreement", "alpha", "slope"), least)
    if n_rules > 1:
        noise = posterior.noise_variance / posterior.n_rows
        weights["agreement"] = max(least, posterior.n_columns * noise / _FAR**2)
        weights["alpha"] = max(least, noise / _FAR**2)
    return weights


def reestimated(posterior: Laplace, free, least=None):
    """The penalty after one step of every free weight, none below ``least``."""
    weights = _all_weights(posterior.penalty)
    for key, paid in posterior.paid.items():
        before, after = posterior.held_before[key], posterior.held_after[key]
        if key not in free or before <= 0.0:
            continue
        outputs = 1 if key == "stiffness" else posterior.n_outputs
        determined = outputs * max(before - after, 0.0)
        cost = posterior.n_rows / posterior.noise_variance * paid
        if key == "stiffness":
            determined += _PRIOR_NUMBER
            cost += _PRIOR_NUMBER * posterior.prior_precision
        ratio = (determined + 1e-12) / (cost + 1e-12)
        ratio = min(max(ratio, 1.0 / _LARGEST_STEP), _LARGEST_STEP)
        smallest = max(_SMALLEST[key], 0.0 if least is None else least.get(key, 0.0))
        weights[key] = min(max(weights[key] * ratio, smallest), _LARGEST[key])
    return replace(posterior.penalty, **weights)


def extrapolated(before, now, after, free, least):
    """Where steps that follow one another lead: ``after``, and beyond it where they are alike.

    Where data hardly decide on a weight, as with more columns than rows, every step is a small part
    of the way. By Aitken's rule, the logarithms being a geometric sequence, the rest of the way is
    1 / (1 - r) last steps, r the ratio of one to that before; never more than the largest step.
    ``before`` is None where there is no such step.
    """
    if before is None:
        return after
    weights = [_all_weights(penalty) for penalty in (before, now, after)]
    found = {}
    for key in free:
        first, second, third = (np.log(max(w[key], _SMALLEST[key])) for w in weights)
        step, last = third - second, second - first
        if step * last <= 0.0 or step / last < _ALIKE:
            continue
        ratio = min(step / last, _MOST_ALIKE)
        jump = np.clip(step / (1.0 - ratio), -np.log(_LARGEST_STEP), np.log(_LARGEST_STEP))
        smallest = max(_SMALLEST[key], least.get(key, 0.0))
        found[key] = min(max(float(np.exp(second + jump)), smallest), _LARGEST[key])
    return replace(after, **found)


def is_settled(penalty, after):
    """Whether no weight changes in its second digit."""
    now, then = _all_weights(penalty), _all_weights(after)
    return all(abs(then[key] - now[key]) <= _SETTLED * now[key] for key in FREE)
