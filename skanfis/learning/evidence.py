r"""The evidence of a model: the probability of the data, with all parameters integrated out.

By Laplace's method, up to a constant that all models of the same data share,

    -2 log p = (n - 1) m log 2F + m [log |M| - log |P|+ + log R] + log |I + H / kappa| ,

    2F = MSE + beta' P beta + kappa |x|^2 ,    M = Phi' S Phi / W + P .

n is the number of rows by weight, m that of outputs, R that of rules; x are the displacements of
the premises, kappa is their stiffness, H the reduced Gauss-Newton matrix by x. |P|+ leaves out the
one direction on which no penalty acts, that in which all rules rise alike.

At the largest evidence, n / sigma^2 times the penalty that a weight causes equals the number of
parameters that the data determine against it. A step multiplies each weight by the ratio of that
number to the penalty (Fellner and Schall; Wood and Fasiolo 2017). At fixed premises it takes no
pass over the rows, only a new solve for beta. docs/mathematics.rst has the details, and the priors:
of the stiffness, as if nu displacements of size x0 had been seen before, and of the alpha_c and the
rho_j, which are expected to be alike.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import wrightomega

from ..consequent import NormalFactor
from .objective import Evaluation, SeparableProblem
from .penalty import WEIGHTS, CommonLine, Penalty, mean_and_parts

# The weights that the evidence can find.
FREE = ("agreement", "alpha", "slope", "stiffness")
# Limits of the weights: below, only rounding acts; above, all rules are one line to every digit.
SMALLEST = Penalty(agreement=1e-12, alpha=1e-12, slope=1e-12, stiffness=1e-10)
LARGEST = Penalty(agreement=1.0, alpha=1e4, slope=1e4, stiffness=1e4)
_AGREEMENT, _STIFFNESS = range(len(WEIGHTS))
_OTHERS = slice(len(WEIGHTS), None)
# x0 and nu: a term is expected to move by a fifth of a spacing.
PRIOR_DISPLACEMENT = 0.2
_PRIOR_NUMBER = 100.0
# 1 / s^2, s the prior's standard deviation of log alpha_c, and of log rho_j: a factor of three.
_LIKENESS = 1.0 / np.log(3.0) ** 2
# Most of a target lies within this many standard deviations of its mean.
_FAR = 2.0
# One step changes a weight by no more than this factor.
_LONGEST_STEP = np.log(100.0)
# A number below all weights that has a logarithm.
_NOTHING = np.finfo(float).tiny
# Numbers of parameters and penalties below this are rounding errors.
_ROUNDING = 1e-12
# A weight that changes by less, relative to itself, keeps its second digit.
_SETTLED = 5e-3
# What a number to read, or another turn, must gain in -2 log p: as much as a parameter costs by
# Akaike's criterion.
WORTH = 2.0
# Least 2F, in variances of the target: more exact than to rounding no fit can be.
_LEAST_ERROR = 1e-22


@dataclass(frozen=True, eq=False)
class Laplace:
    """The posterior at a point: everything that the evidence and its derivatives are made of."""

    penalty: Penalty
    effective_weight: float
    twice_cost: float  # 2F
    n_outputs: int  # outputs that vary
    determinants: float  # log |M| - log |P|+ + log R
    paid: np.ndarray  # its part of beta' P beta + kappa |x|^2, for each of ``CommonLine.weights``
    disagreement: np.ndarray  # Q, which makes up P together with the line
    line: CommonLine
    prior: NormalFactor  # of P, its null space filled in at the size of P
    factor: NormalFactor  # of M
    curvature: np.ndarray  # eigenvalues of H

    @property
    def n_columns(self):
        """Consequent parameters of one output."""
        return self.line.height.size - self.penalty.n_held

    @cached_property
    def trace_before(self):
        """For each weight, the trace of its part of the penalty in the prior.

        It is found on demand, like ``trace_after``: both take as long as all the rest, and the last
        of several posteriors seldom needs them.
        """
        return self._traces(self.prior, float(self.curvature.size))

    @cached_property
    def trace_after(self):
        """The same in the posterior: the number of parameters that each part holds."""
        return self._traces(self.factor, held_displacements(self.curvature, self.penalty.stiffness))

    def _traces(self, factor, by_stiffness):
        found = self.line.weights(self.penalty)
        # One rule disagrees with none: its Q holds rounding errors alone.
        found[_AGREEMENT] *= factor.trace(self.disagreement) if self.line.n_rules > 1 else 0.0
        found[_OTHERS] *= self.line.traces(factor)
        found[_STIFFNESS] = by_stiffness
        return found

    @property
    def freedom(self):
        """Degrees of freedom: rows by weight, less one for a constant, times outputs."""
        return max(self.effective_weight - 1.0, 0.5) * self.n_outputs

    @property
    def noise_variance(self):
        """sigma^2 of the standardised target, averaged over outputs."""
        return self.effective_weight * self.twice_cost / self.freedom

    @property
    def scale(self):
        """The factor n / sigma^2 from costs, which are means over rows, to -2 log p."""
        return self.effective_weight / self.noise_variance

    @property
    def prior_precision(self):
        """Prior precision n kappa / sigma^2 of the displacements, in units of the expected one."""
        return self.scale * self.penalty.stiffness * PRIOR_DISPLACEMENT**2

    @property
    def minus_twice_log(self):
        """-2 log p, up to a constant of the data."""
        consequents = self.freedom * np.log(self.twice_cost) + self.n_outputs * self.determinants
        pulls = (*self.penalty.pulls.values(), *self.penalty.slope_pulls.values())
        if pulls:
            consequents += _LIKENESS * float(np.sum(np.log(pulls) ** 2))
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
        """Effective number of all parameters: all, less those that the penalty holds."""
        return self.n_columns + self.curvature.size - float(np.sum(self.trace_after))


def held_displacements(curvature, stiffness):
    """The number of displacements that the stiffness holds; ``curvature`` are eigenvalues of H."""
    # Without stiffness nothing is held, even if there is no curvature, where this is 0 / 0.
    return float(np.sum(stiffness / (curvature + stiffness))) if stiffness else 0.0


def laplace(problem: SeparableProblem, evaluation: Evaluation, displacement=(), curvature=()):
    """The posterior at fixed premises; ``evaluation`` must be solved with the problem's penalty."""
    normal, line, penalty = evaluation.normal, problem.common_line, problem.penalty
    assert normal is not None
    matrix, factor, solved = normal.penalty, normal.factor, normal.coefficients
    # A model of one constant has no penalty but the shift: any size will do.
    size = np.trace(matrix) / matrix.shape[0]
    size = size if size > 2.0 * factor.shift else 1.0
    # P is singular. Its null space is filled in at P's own size, so that it has a Cholesky factor.
    prior = NormalFactor(matrix + size * np.outer(line.height, line.height), normal.free)
    paid = line.weights(penalty)
    paid[_AGREEMENT] *= np.vdot(solved, normal.disagreement @ solved)
    paid[_STIFFNESS] *= np.dot(displacement, displacement)
    paid[_OTHERS] *= line.squares(solved)
    return Laplace(
        penalty,
        problem.effective_weight,
        max(2.0 * evaluation.cost + float(paid[_STIFFNESS]), _LEAST_ERROR),
        problem.n_varying,
        factor.log_determinant() - prior.log_determinant() + np.log(size) + np.log(line.n_rules),
        paid,
        normal.disagreement,
        line,
        prior,
        factor,
        np.asarray(curvature, dtype=float),
    )


def least_weights(posterior: Laplace):
    """The least weights: with smaller ones, the prior expects rules far beyond the target.

    A priori, the disagreement V is expected to be n_columns sigma^2 / (n lambda), and a departure
    from the common line has the variance sigma^2 / (n alpha). Neither may exceed the square of what
    is far for a target.
    """
    if posterior.line.n_rules == 1:
        return SMALLEST
    far = posterior.noise_variance / posterior.effective_weight / _FAR**2
    return replace(SMALLEST, agreement=posterior.n_columns * far, alpha=far)


def reestimated(posterior: Laplace, free, least=SMALLEST):
    """The penalty after one step of every free weight, none below ``least``."""
    penalty, line = posterior.penalty, posterior.line
    now = line.weights(penalty)
    before, outputs = posterior.trace_before, np.full(now.size, posterior.n_outputs)
    outputs[_STIFFNESS] = 1
    determined = outputs * np.maximum(before - posterior.trace_after, 0.0)
    # Rounding may make a tiny penalty negative.
    cost = posterior.scale * np.maximum(posterior.paid, 0.0)
    if posterior.curvature.size:
        determined[_STIFFNESS] += _PRIOR_NUMBER
        cost[_STIFFNESS] += _PRIOR_NUMBER * posterior.prior_precision
    step = _log_ratio(determined, cost)
    slopes, components = line.of_slopes, line.of_components
    for alike in (slopes, components):
        step[alike] = _step_to_likeness(cost[alike], determined[alike], now[alike])
    moves = np.array([kind in free for kind in line.kinds]) & (before > 0.0)
    # All weights of a kind move, or none.
    moves[slopes], moves[components] = moves[slopes].any(), moves[components].any()
    low = np.maximum(line.weights(SMALLEST), line.weights(least))
    ratio = np.exp(np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
    found = np.where(moves, np.clip(now * ratio, low, line.weights(LARGEST)), now)
    after: dict[str, Any] = dict(zip(WEIGHTS, found.tolist(), strict=False))
    if moves[slopes].any():
        after["slope"], after["slope_pulls"] = mean_and_parts(found[slopes], line.slopes)
    if moves[components].any():
        after["alpha"], after["pulls"] = mean_and_parts(found[components], line.components)
    return replace(penalty, **after)


def _log_ratio(determined, cost):
    # If both are nothing, the weight stays as it is.
    return np.log((determined + _ROUNDING) / (cost + _ROUNDING))


def _step_to_likeness(cost, determined, weights):
    """Steps t of log weights that are expected to be alike.

    t is the root of cost e^t - determined + 2 (log pulls + t) / s^2; pulls are weights over their
    geometric mean. With z = determined s^2 / 2 - log pulls and the Wright omega function,
    t = z - omega(z + log(cost s^2 / 2)).
    """
    if weights.size <= 1 or weights[0] == 0.0:
        return _log_ratio(determined, cost)
    logs = np.log(weights)
    z = determined / (2.0 * _LIKENESS) - (logs - logs.mean())
    return z - wrightomega(z + np.log(cost / (2.0 * _LIKENESS) + _NOTHING))


def is_settled(line, penalty, after):
    """Whether no weight changes in its second digit."""
    now, then = line.weights(penalty), line.weights(after)
    return bool((np.abs(then - now) <= _SETTLED * now).all())
