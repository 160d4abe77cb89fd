r"""The weights of the penalty and the premises in turns, by the evidence.

At fixed weights the premises take a few steps down the cost; at fixed premises the weights take a
few steps up the evidence, which needs no pass over the data. A step of the premises sees the cost
alone and may sharpen the terms until no two rules fire on the same row. So the turn of the largest
evidence is kept, and the turns end when the evidence rises no further.

The weights come first, at the premises of the start: from weights that are far too small, the first
steps of the premises would go where no evidence leads back from.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..consequent import MANY_COLUMNS
from ..learning.evidence import (
    LARGEST,
    PRIOR_DISPLACEMENT,
    SMALLEST,
    WORTH,
    Laplace,
    extrapolated,
    is_settled,
    laplace,
    least_weights,
    reestimated,
)
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.penalty import Penalty
from ..learning.premise import Premise
from ..learning.sparse_slopes import sparse_slopes
from ..learning.varpro import TOLERANCE, varpro
from ..reading_cost import reading_cost

# In the middle of the weights that the evidence finds for data of every kind.
FIRST_PENALTY = Penalty(agreement=1e-2, alpha=1e-2, slope=1e-2, stiffness=1e-2)
# Steps of the weights at premises that have not moved yet: each of a hundredfold at the most, they
# lead from the start to any end.
FIRST_STEPS = 5
# Where no premises follow, the weights arrive: most of them within ten.
ARRIVING = 50
# Steps and turns beyond ``MANY_COLUMNS``; so many turns have grids as well (``trials``).
_FEW_STEPS, FEW_TURNS = 3, 2
# A turn: a few iterations of the premises, then steps of the weights. Neither converges while the
# other moves: the training that follows does the rest.
_STEPS, _ITERATIONS, MOST_TURNS = 2, 4, 8
# The first turn of terms without bounds goes far.
_UNBOUNDED_ITERATIONS = 25
# Of agreement: less of a rise is not worth a training.
_MOST_RAISES, _HALVINGS, _LEAST_RAISE = 3, 8, 2.0


@dataclass(frozen=True, eq=False)
class Tuned:
    """The end of the turns: the posterior, the point and the weights there."""

    problem: SeparableProblem
    evaluation: Evaluation
    displacement: np.ndarray
    posterior: Laplace

    @property
    def penalty(self):
        """The weights found."""
        return self.posterior.penalty

    @cached_property
    def solved(self):
        """The evaluation, solved again at the weights found."""
        return self.problem.solved_again(self.evaluation)

    @property
    def disagreement(self):
        """Of rules that fire together, as in ``penalty``: what the error of each alone exceeds."""
        normal = self.solved.normal
        return float(np.vdot(normal.coefficients, normal.disagreement @ normal.coefficients))

    @cached_property
    def residual(self):
        """Of the standardised target, (n_rows, n_outputs)."""
        found = [residual for _, residual, _ in self.problem.residuals(self.evaluation)]
        return np.concatenate(found, axis=1).T

    @cached_property
    def expected_error(self):
        """Mean squared error to be expected on new rows, of the standardised target.

        That of the consequents on rows that are left out one by one, times what Akaike's final
        prediction error takes for the premises, (1 + k / n) / (1 - k / n) with their effective
        number k; infinite where these are as many as the rows.
        """
        n_rows = self.posterior.n_rows
        share = self.posterior.n_effective_premises / n_rows
        if share >= 1.0:
            return np.inf
        left_out = self.problem.leave_one_out_error(self.solved, n_rows)
        return left_out * (1.0 + share) / (1.0 - share)


def tune(
    problem: SeparableProblem,
    premise: Premise,
    free,
    n_rows: float,
    turns=MOST_TURNS,
    first_steps=FIRST_STEPS,
) -> Tuned:
    """Find the ``free`` weights, of ``evidence.FREE``, and the premises that go with them.

    The weights start at those of the problem's penalty and take ``first_steps`` before the premises
    move, in so many ``turns`` at most; with 0 these stay where they are. ``n_rows`` are rows by
    weight.
    """
    steps = _STEPS
    if problem.n_columns > MANY_COLUMNS:
        first_steps, turns, steps = min(first_steps, _FEW_STEPS), min(turns, FEW_TURNS), 1
    elif premise.size == 0 and turns > 0:
        first_steps = ARRIVING
    x = np.zeros(premise.size)
    evaluation = problem.evaluate(premise.parameters(x))
    start = _improved(problem, evaluation, x, problem.penalty, first_steps, free, n_rows)
    if premise.size == 0 or turns == 0:
        return start
    penalty = start.penalty
    if "stiffness" in free:
        stiffness = start.posterior.noise_variance / (n_rows * PRIOR_DISPLACEMENT**2)
        penalty = replace(penalty, stiffness=stiffness)
    first = turned(start, premise, penalty, free, steps)
    return _risen(first, premise, free, turns - 1, steps)


def tune_unbounded(problem: SeparableProblem, premise: Premise, free, n_rows: float) -> Tuned:
    """The same with the premises first, and weights that may be next to nothing.

    What the premises of the start leave of data without noise would be taken for noise.
    """
    x = np.zeros(premise.size)
    least: dict[str, Any] = dict.fromkeys(free, SMALLEST.alpha)
    penalty = replace(problem.penalty, **least)
    evaluation = problem.evaluate(premise.parameters(x))
    start = _improved(problem, evaluation, x, penalty, 0, free, n_rows)
    steps, far = FIRST_STEPS, _UNBOUNDED_ITERATIONS
    first = turned(start, premise, penalty, free, steps, far, has_least=False)
    return _risen(first, premise, free, MOST_TURNS - 1, _STEPS, has_least=False)


def _risen(tuned: Tuned, premise, free, turns, steps, has_least=True) -> Tuned:
    """The turn of the largest evidence, of so many more."""
    best = last = tuned
    for _ in range(turns):
        last = turned(last, premise, last.penalty, free, steps, has_least=has_least)
        gain = best.posterior.minus_twice_log - last.posterior.minus_twice_log
        best = last if gain > 0.0 else best
        if not gain > WORTH:
            break
    return best


def turned(
    tuned: Tuned, premise, penalty, free, steps=_STEPS, iterations=_ITERATIONS, has_least=True
) -> Tuned:
    """One turn from where the last one ended: premises down the cost, then weights up.

    ``has_least``: whether weights stay above those of ``least_weights``.
    """
    problem = tuned.problem.with_penalty(penalty)
    result = varpro(
        problem,
        premise,
        max_iter=iterations,
        tol=TOLERANCE,
        stiffness=penalty.stiffness,
        start=tuned.displacement,
        evaluation=problem.solved_again(tuned.evaluation),
    )
    evaluation = result.evaluation
    x = premise.displacement(evaluation.antecedent.parameters)
    # One step before the end as a rule, and as good there: another pass is not worth it.
    curvature = np.maximum(np.linalg.eigvalsh(result.gauss_newton), 0.0)
    n_rows = tuned.posterior.n_rows
    return _improved(problem, evaluation, x, penalty, steps, free, n_rows, curvature, has_least)


def _improved(
    problem, evaluation, x, penalty, steps, free, n_rows, curvature=(), has_least=True
) -> Tuned:
    """The point after so many steps of the free weights, or when they stand still.

    Steps that are alike are taken on to where they lead, if the evidence rises there; the last is
    always a plain one. ``before`` is the penalty before the last step, if that was a plain one.
    """
    line = problem.common_line
    n_outputs = max(int(np.count_nonzero(~problem.rows.targets.is_constant)), 1)
    n_distinct = problem.rows.n_rows  # a search sample has no row twice

    def posterior_at(weights):
        return laplace(evaluation, line, weights, n_rows, n_outputs, x, curvature)

    posterior, before = posterior_at(penalty), None
    for left in reversed(range(steps)):
        least = least_weights(posterior, n_distinct) if has_least else SMALLEST
        plain = reestimated(posterior, free, least, n_distinct)
        far = extrapolated(line, before, posterior.penalty, plain, free, least)
        if before is not None and is_settled(line, posterior.penalty, far):
            break
        jumped = posterior_at(far) if left and far != plain else None
        if jumped is None or jumped.minus_twice_log > posterior.minus_twice_log:
            posterior, before = posterior_at(plain), posterior.penalty
        else:
            posterior, before = jumped, None
    return Tuned(problem.with_penalty(posterior.penalty), evaluation, x, posterior)


def cost_of(tuned: Tuned) -> int:
    """To read the rules."""
    problem, n_rules = tuned.problem, tuned.problem.antecedent.n_rules
    n_slopes = n_rules * len(problem.common_line.slopes) - tuned.penalty.n_held
    return reading_cost(problem.antecedent, n_slopes, problem.n_outputs)


def with_most_agreement(tuned: Tuned, premise: Premise, free, room: float) -> Tuned:
    """The same with as much agreement as keeps the squared error within ``room`` times itself.

    The consequents alone tell how much that is at least; then the premises follow, which makes room
    for more, or for less.
    """
    is_known = np.isfinite(tuned.expected_error)
    if "agreement" not in free or not tuned.displacement.size or room <= 1.0 or not is_known:
        return tuned
    others = [key for key in free if key != "agreement"]
    most, best, agreement = room * tuned.expected_error, tuned, 0.0
    for _ in range(_MOST_RAISES):
        agreement = agreement or _most_agreement(best, most)
        if agreement < _LEAST_RAISE * best.penalty.agreement:
            break
        penalty = replace(best.penalty, agreement=agreement)
        found = turned(best, premise, penalty, others, steps=0)
        if found.expected_error <= most:
            best, agreement = found, 0.0
        else:
            agreement = float(np.sqrt(best.penalty.agreement * agreement))
    return best


def with_sparse_slopes(tuned: Tuned, free, worth) -> Tuned:
    """The same with slopes that are worth so much alone: else one for several rules, or none."""
    problem, posterior, x = tuned.problem, tuned.posterior, tuned.displacement
    if not {"alpha", "slope"} <= set(free) or problem.n_columns > MANY_COLUMNS:
        return tuned
    common, absent = sparse_slopes(posterior, tuned.solved.normal.coefficients, worth)
    penalty = replace(tuned.penalty, common=common, absent=absent)
    n_rows, curvature = posterior.n_rows, posterior.curvature
    return _improved(problem, tuned.evaluation, x, penalty, 0, free, n_rows, curvature)


def _most_agreement(tuned: Tuned, most: float) -> float:
    """The largest agreement at which the consequents alone keep the error, by bisection."""
    low, high = tuned.penalty.agreement, LARGEST.agreement
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        penalty = replace(tuned.penalty, agreement=middle)
        # The consequents of another penalty take no pass over the rows but for their error.
        raised = replace(tuned, problem=tuned.problem.with_penalty(penalty))
        low, high = (middle, high) if raised.expected_error <= most else (low, middle)
    return low


def scaled(penalty: Penalty, free, ratio, agreement_is_raised=False):
    """The free weights times a ratio: relative to a mean over rows, they fall with their number.

    But agreement that makes rules hold one by one does so for any number of rows. More digits than
    three say nothing, and would carry rounding errors into the model.
    """
    weights: dict[str, Any] = {key: _in_digits(getattr(penalty, key) * ratio) for key in free}
    if agreement_is_raised:
        weights["agreement"] = _in_digits(penalty.agreement)
    for key in ("pulls", "slope_pulls"):
        pulls = getattr(penalty, key)
        weights[key] = {name: _in_digits(pull) for name, pull in pulls.items()}
    return replace(penalty, **weights)


def _in_digits(weight):
    return float(f"{weight:.3g}")
