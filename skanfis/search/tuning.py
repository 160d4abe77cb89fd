r"""The weights of the penalty and the premises in turns, by the evidence.

At fixed weights the premises take a few steps down the cost; at fixed premises the weights take a
few steps up the evidence, which needs no pass over the data. The premises' step does not see the
evidence, only its cost: it may trade the one for the other, sharpening the terms until no two rules
fire on the same row and the disagreement is nought. So what is kept is the turn of the largest
evidence, and the turns end when it rises no further.

The weights come first, at the premises of the start: from weights that are far too small, the first
steps of the premises would go where no evidence leads back from. Data without noise are the other
case: what the premises of the start leave would be taken for noise. So there is a second way in,
*loose*, in which the premises come first and the weights are next to nothing. It is taken where
half of the noise is gone, and the evidence is for it; of rules that are given (``given``), the
error to be expected on new rows.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..learning.evidence import (
    PRIOR_DISPLACEMENT,
    Laplace,
    extrapolated,
    is_settled,
    laplace,
    least_weights,
    reestimated,
)
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.penalty import GREATEST_ALONE, Penalty
from ..learning.premise import Premise
from ..learning.varpro import varpro

__all__ = [
    "ARRIVING",
    "FIRST_PENALTY",
    "FIRST_STEPS",
    "HOLDING",
    "LESS_NOISE",
    "MOST_COLUMNS",
    "MOST_TURNS",
    "WORTHWHILE",
    "Tuned",
    "held",
    "is_affordable",
    "more_agreement",
    "scaled",
    "settled",
    "tune",
    "with_premises",
]

# In the middle of what data of every kind ask for; from there the first steps find their way.
FIRST_PENALTY = Penalty(agreement=1e-2, alpha=1e-2, slope=1e-2, stiffness=1e-2)
# Loose: what rounding errors need.
_LOOSE = 1e-12
# Its first turn goes far: weights are found where the premises have come to, not on their way.
_LOOSE_ITERATIONS = 25
# Of the noise's variance, what a loose training must bring it down to: rules that compensate one
# another are the price, and not to be paid for less.
LESS_NOISE = 0.5
# Steps of the weights at premises that have not moved yet: each of a hundredfold at the most, they
# lead from the start to any end.
FIRST_STEPS = 5
# Where no premises follow, the weights arrive: most of them within ten.
ARRIVING = 50
# Beyond so many consequent parameters every step costs seconds, and there are fewer.
MOST_COLUMNS = 512
_FEW_STEPS, _FEW_TURNS = 3, 2
# Part of the rows that effective parameters of the premises may be.
_MOST_EFFECTIVE = 0.5
# A turn: a few iterations of the premises, and steps of the weights to follow them. Neither is
# finished while the other moves: what is left is done in the training that follows.
_STEPS = 2
_ITERATIONS = 4
MOST_TURNS = 8
_TOLERANCE = 1e-3
# What a larger or freer model must gain in -2 log p: less is "not worth more than a bare mention"
# (Kass and Raftery 1995).
WORTHWHILE = 2.0
# Of displacements, which are in spacings: no data tell a hundred-thousandth of a spacing, and
# rounding errors stay below it.
_DIGITS = 5
# What counts as a rise of the evidence, in -2 log p: with the first turn without one they end.
_RISE = 0.5
# Where the strongest rule does not hold alone, agreement rises by a power of how far it is off, and
# within these factors; beyond the last weight, all rules are one line.
_RAISE = 3.0
_LEAST_RAISE, _LARGEST_RAISE = 2.0, 100.0
_MOST_AGREEMENT = 1.0
# What is found here is trained further, and on more rows.
_MARGIN = 0.9
# Rules that hold one by one are worth a tenth of the error, a fifth of its square. Where they would
# cost more, as they do where the data are next to exact, the model goes before its rules.
HOLDING = 1.2


@dataclass(frozen=True, eq=False)
class Tuned:
    """The end of the turns: the posterior, the point and the weights there."""

    problem: SeparableProblem
    evaluation: Evaluation
    displacement: np.ndarray
    posterior: Laplace
    is_apart: bool = False  # the strongest rule does not hold alone
    is_held: bool = False  # agreement was raised until it does

    @property
    def penalty(self):
        """The weights found."""
        return self.posterior.penalty

    @property
    def score(self):
        """-2 log p."""
        return self.posterior.minus_twice_log

    @property
    def is_trained(self):
        """Whether premises have moved, or looked where to."""
        return self.posterior.curvature.size > 0

    @cached_property
    def solved(self):
        """The evaluation at the weights found, where those it was made at are others."""
        return self.problem.solved_again(self.evaluation)

    @cached_property
    def expected_error(self):
        """Mean squared error to be expected on new rows, of the standardised target.

        That of the consequents on rows that are left out one by one, times what Akaike's final
        prediction error takes for the premises, (1 + k / n) / (1 - k / n) with their effective
        number k; infinite where that is more than half of the rows.
        """
        n_rows = self.posterior.n_rows
        share = self.posterior.n_effective_premises / n_rows
        if share > _MOST_EFFECTIVE:  # and nothing need be left out
            return np.inf
        left_out = self.problem.leave_one_out_error(self.solved, n_rows)
        return with_premises(left_out, share)

    @property
    def priced_error(self):
        """The error to be expected, and what rules are worth that hold where these do not."""
        return (HOLDING if self.is_apart else 1.0) * self.expected_error

    def takes_for_noise(self, loose, part=LESS_NOISE):
        """Whether a loose training has found what this one took for noise, down to a part of it."""
        return loose.posterior.noise_variance < part * self.posterior.noise_variance

    def is_beaten_loosely(self, loose, part=LESS_NOISE):
        """Whether it has, and the evidence is for it."""
        return self.takes_for_noise(loose, part) and loose.score < self.score - WORTHWHILE


def held(tuned, premise, free, n_rows) -> Tuned:
    """The same with rules that hold one by one, if that is cheap and agreement is free."""
    if "agreement" not in free:
        return tuned
    return _together(tuned, _Weights(tuned.problem, n_rows), premise, free)


def with_premises(left_out, share):
    """The error of rows left out at fixed premises, with what these take: a share of the rows."""
    return np.inf if share > _MOST_EFFECTIVE else left_out * (1.0 + share) / (1.0 - share)


class _Weights:
    """Steps of the penalty's weights up the evidence, at fixed premises."""

    def __init__(self, problem: SeparableProblem, n_rows: float, has_least: bool = True):
        self.problem, self.n_rows, self.has_least = problem, n_rows, has_least
        self.n_rules = problem.antecedent.n_rules
        self.n_outputs = max(int(np.count_nonzero(~problem.rows.targets.is_constant)), 1)
        self.n_distinct = problem.rows.n_rows  # a search sample has no row twice

    def improved(self, evaluation, x, penalty, steps, free, curvature=None) -> Laplace:
        """The posterior after so many steps of the free weights, or when they stand still.

        Steps that are alike are taken on to where they lead, if the evidence rises there; the last
        is always a plain one.
        """
        posterior, before = self._posterior(evaluation, x, penalty, curvature), None
        line = self.problem.common_line
        for left in reversed(range(steps)):
            least = None
            if self.has_least:
                least = least_weights(posterior, self.n_rules, self.n_distinct)
            plain = reestimated(posterior, free, least, self.n_distinct)
            far = extrapolated(line, before, posterior.penalty, plain, free, least)
            if before is not None and is_settled(line, posterior.penalty, far):
                break
            now, before = posterior, None
            if left and far != plain:
                posterior = self._posterior(evaluation, x, far, curvature)
            if posterior is now or posterior.minus_twice_log > now.minus_twice_log:
                posterior = self._posterior(evaluation, x, plain, curvature)
                before = now.penalty
        return posterior

    def _posterior(self, evaluation, x, penalty, curvature):
        return laplace(
            evaluation.normal,
            self.problem.common_line,
            evaluation.mean_squared_error,
            penalty,
            self.n_rows,
            self.n_rules,
            x,
            curvature,
            self.n_outputs,
        )


def tune(
    problem: SeparableProblem,
    premise: Premise,
    free,
    n_rows: float,
    turns=MOST_TURNS,
    first_steps=FIRST_STEPS,
    displacement=None,
    is_loose=False,
    has_least=True,
    begun: Tuned | None = None,
    is_last=True,
) -> Tuned:
    """Find the free weights, and the premises that go with them.

    Parameters
    ----------
    problem : SeparableProblem
        Its penalty is where the weights start.
    premise : Premise
    free : collection of str
        Weights to be found, of ``evidence.FREE``.
    n_rows : float
        Rows by weight.
    turns : int
        Most turns of the premises; with 0 they stay where they are.
    first_steps : int
        Steps of the weights before the premises move.
    displacement : ndarray of shape (premise.size,), optional
        Where the premises start; zero if not given.
    is_loose : bool
        Whether the premises come before the weights.
    has_least : bool
        Whether weights stay above those of ``least_weights``; without, rules may compensate one
        another beyond all reading.
    begun : Tuned, optional
        What earlier turns of the same have found: these go on from there. Without turns, the
        evaluation at the start.
    is_last : bool
        Whether no turns follow; then the rules are made to hold one by one.
    """
    steps_a_turn = _STEPS
    if problem.n_columns > MOST_COLUMNS:
        first_steps, turns, steps_a_turn = min(first_steps, _FEW_STEPS), min(turns, _FEW_TURNS), 1
    elif premise.size == 0 and turns > 0:
        first_steps = ARRIVING
    weights = _Weights(problem, n_rows, has_least)
    best = begun if begun is not None and begun.is_trained else None
    if best is None:
        if begun is not None:
            x, evaluation = begun.displacement, begun.evaluation
        else:
            x = np.zeros(premise.size) if displacement is None else displacement
            evaluation = problem.evaluate(premise.parameters(x))
        penalty = problem.penalty
        if is_loose:
            loose: dict[str, Any] = dict.fromkeys(free, _LOOSE)
            penalty = replace(penalty, **loose)
        posterior = weights.improved(evaluation, x, penalty, 0 if is_loose else first_steps, free)
        penalty = posterior.penalty
        if premise.size == 0 or turns == 0:
            return Tuned(problem.with_penalty(penalty), evaluation, x, posterior)
        if "stiffness" in free and not is_loose:
            stiffness = posterior.noise_variance / (n_rows * PRIOR_DISPLACEMENT**2)
            penalty = replace(penalty, stiffness=stiffness)
    else:
        x, penalty, evaluation = best.displacement, best.penalty, best.evaluation
    for turn in range(turns):
        is_first = is_loose and turn == 0 and best is None
        iterations = _LOOSE_ITERATIONS if is_first else _ITERATIONS
        steps = FIRST_STEPS if is_first else steps_a_turn
        found = _turned(weights, premise, penalty, x, evaluation, free, iterations, steps)
        x, penalty, evaluation = found.displacement, found.penalty, found.evaluation
        rises = best is None or found.score < best.score - _RISE
        if best is None or found.score < best.score:
            best = found
        if not rises:
            break
    assert best is not None
    if "agreement" in free and is_last:
        best = _together(best, weights, premise, free)
    return best


def _turned(weights: _Weights, premise: Premise, penalty, x, evaluation, free, iterations, steps):
    """One turn: premises down the cost, then weights up the evidence."""
    weighted = weights.problem.with_penalty(penalty)
    result = varpro(
        weighted,
        premise,
        max_iter=iterations,
        tol=_TOLERANCE,
        stiffness=penalty.stiffness,
        start=x,
        evaluation=weighted.solved_again(evaluation),
    )
    evaluation = result.evaluation
    x = premise.displacement(evaluation.antecedent.parameters)
    # One step before the end as a rule, and as good there: another pass is not worth it.
    curvature = np.maximum(np.linalg.eigvalsh(result.gauss_newton), 0.0)
    posterior = weights.improved(evaluation, x, penalty, steps, free, curvature)
    problem = weights.problem.with_penalty(posterior.penalty)
    return Tuned(problem, evaluation, x, posterior)


def _together(tuned: Tuned, weights: _Weights, premise: Premise, free) -> Tuned:
    """The same with so much more agreement that the strongest rule holds alone, if it is cheap."""
    others = [key for key in free if key != "agreement"]
    found: Tuned | None = tuned
    while found is not None:
        before = found
        penalty = more_agreement(found.problem, found.evaluation, _MARGIN * GREATEST_ALONE)
        if penalty is None:
            return replace(before, is_held=before is not tuned)
        x, evaluation = before.displacement, before.evaluation
        found = _turned(weights, premise, penalty, x, evaluation, others, _ITERATIONS, 0)
        if not is_affordable(found.evaluation, tuned.evaluation):
            found = None
    return replace(tuned, is_apart=True)


def more_agreement(
    problem: SeparableProblem, evaluation: Evaluation, limit=GREATEST_ALONE
) -> Penalty | None:
    """The penalty with more agreement where the strongest rule does not hold alone; else None."""
    apart = problem.strongest_alone(evaluation) / limit
    penalty = problem.penalty
    if apart <= 1.0 or penalty.agreement >= _MOST_AGREEMENT:
        return None
    factor = min(max(apart**_RAISE, _LEAST_RAISE), _LARGEST_RAISE)
    return replace(penalty, agreement=factor * penalty.agreement)


def is_affordable(held: Evaluation, apart: Evaluation) -> bool:
    """Whether rules that hold one by one cost no more of the error than they are worth."""
    return held.mean_squared_error <= HOLDING * apart.mean_squared_error


def settled(displacement):
    """Displacements without the digits that rounding errors reach; training goes on from there."""
    return np.round(displacement, _DIGITS)


def scaled(penalty: Penalty, free, ratio, is_held=False):
    """The free weights times a ratio: relative to a mean over rows, they fall with their number.

    But agreement that makes rules hold one by one does so for any number of rows. More digits than
    three say nothing, and would carry rounding errors into the model.
    """
    own = {
        "agreement": penalty.agreement / (ratio if is_held else 1.0),
        "alpha": penalty.alpha,
        "slope": penalty.rho,
        "stiffness": penalty.stiffness,
    }
    weights: dict[str, Any] = {key: _in_digits(own[key] * ratio) for key in free}
    for key in ("pulls", "slope_pulls"):
        pulls = getattr(penalty, key)
        weights[key] = {name: _in_digits(pull) for name, pull in pulls.items()}
    return replace(penalty, **weights)


def _in_digits(weight):
    return float(f"{weight:.3g}")
