r"""Tuning: the premises and the weights of the penalty take turns, guided by the evidence.

At fixed weights the premises take a few steps down the cost. At fixed premises the weights take a
few steps up the evidence, which needs no pass over the data. A step of the premises lowers the cost
alone, and may sharpen the terms until no two rules fire on the same row. So the turn of the largest
evidence is kept, and the turns end when the evidence rises no further.

The weights come first, at the premises of the start: with weights far too small, the first steps of
the premises would lead to a point from which the evidence finds no way back.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..consequent import MANY_COLUMNS
from ..learning.data import StandardisedData
from ..learning.evidence import (
    LARGEST,
    PRIOR_DISPLACEMENT,
    SMALLEST,
    WORTH,
    Laplace,
    held_displacements,
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
# Steps of the weights at given premises. Most weights settle within ten.
ARRIVING = 50
# Steps and turns beyond ``MANY_COLUMNS``; turns of grids (``trials``), with more rows than before,
# and of raising agreement.
FEW_TURNS = 2
# A turn: a few iterations of the premises, then steps of the weights. Neither converges while the
# other moves; the training that follows does the rest.
_STEPS, _ITERATIONS, MOST_TURNS = 2, 4, 8
# With fewer rows per consequent, free terms are not tried, and slopes by the lasso's inputs are.
ROWS_PER_CONSEQUENT = 2
# Terms without bounds move far in their first turn.
_UNBOUNDED_ITERATIONS = 25
# They must lower the expected squared error below this part of it: a smaller gain may be chance.
_LESS_ERROR = 0.9
# Bisection steps that raise the agreement; a smaller rise is not worth a training.
_HALVINGS, _LEAST_RAISE = 8, 2.0


@dataclass(frozen=True, eq=False)
class Tuned:
    """A point of the tuning: the premises and the weights."""

    problem: SeparableProblem
    premise: Premise
    free: Sequence[str]  # names of the weights to be found, of ``evidence.FREE``
    evaluation: Evaluation  # at the premises, for the weights that they moved by
    solved: Any  # the same, solved again for the weights of now
    displacement: np.ndarray
    curvature: np.ndarray  # eigenvalues of H; empty before the premises move

    @classmethod
    def start(cls, problem: SeparableProblem, premise: Premise, free, x=None):
        """The point at displacement ``x``, zero if not given, with the weights of the problem."""
        x = np.zeros(premise.size) if x is None else x
        evaluation = problem.evaluate(premise.parameters(x))
        return cls(problem, premise, free, evaluation, evaluation, x, np.empty(0))

    def with_penalty(self, penalty):
        """The same point at other weights; no pass over the rows."""
        problem = self.problem.with_penalty(penalty)
        return replace(self, problem=problem, solved=problem.solved_again(self.evaluation))

    @cached_property
    def posterior(self) -> Laplace:
        """The posterior at this point."""
        return laplace(self.problem, self.solved, self.displacement, self.curvature)

    @property
    def penalty(self):
        """The weights found."""
        return self.problem.penalty

    @property
    def disagreement(self):
        """V (``penalty``): how much the rules' squared error, one by one, exceeds the model's."""
        normal = self.solved.normal
        return float(np.vdot(normal.coefficients, normal.disagreement @ normal.coefficients))

    @cached_property
    def residual(self):
        """Residual of the standardised target, (n_rows, n_outputs)."""
        found = [residual for _, residual, _ in self.problem.residuals(self.evaluation)]
        return np.concatenate(found, axis=1).T

    @cached_property
    def expected_error(self):
        """Mean squared error expected on new rows, of the standardised target.

        The leave-one-out error, at fixed premises, times the factor of Akaike's final prediction
        error for the premises, (1 + k / n) / (1 - k / n), k their effective number. It is infinite
        where k reaches the number of rows n.
        """
        n_held = held_displacements(self.curvature, self.penalty.stiffness)
        share = (self.curvature.size - n_held) / self.problem.effective_weight
        if share >= 1.0:
            return np.inf
        left_out = self.problem.leave_one_out_error(self.solved)
        return left_out * (1.0 + share) / (1.0 - share)


def tune(
    problem: SeparableProblem,
    premise: Premise,
    free,
    turns=MOST_TURNS,
    first_steps=ARRIVING,
) -> Tuned:
    """Find the ``free`` weights, names of ``evidence.FREE``, and the premises that go with them.

    The weights start at those of the problem's penalty, and take ``first_steps`` before the
    premises move. There are ``turns`` turns at most; with 0 the premises stay.
    """
    steps = _STEPS
    if problem.n_columns > MANY_COLUMNS:
        first_steps, turns, steps = min(first_steps, FEW_TURNS), min(turns, FEW_TURNS), 1
    start = _improved(Tuned.start(problem, premise, free), first_steps)
    if premise.size == 0 or turns == 0:
        return start
    if "stiffness" in free:
        expected = problem.effective_weight * PRIOR_DISPLACEMENT**2
        stiffness = start.posterior.noise_variance / expected
        start = start.with_penalty(replace(start.penalty, stiffness=stiffness))
    return _risen(turned(start, steps), turns - 1, steps)


def tuned_on(tuned: Tuned, rows: StandardisedData) -> Tuned:
    """The same, tuned on from where it is, with more rows than it has seen."""
    seen = tuned.problem
    if seen.rows.n_rows == rows.n_rows:
        return tuned
    penalty = scaled(tuned.penalty, tuned.free, seen.effective_weight / rows.effective_weight)
    inputs, is_unbounded = seen.consequent_inputs, tuned.premise.is_unbounded
    problem = SeparableProblem(rows, seen.antecedent, penalty, consequent_inputs=inputs)
    premise = Premise.of(seen.antecedent, *rows.inputs.box, is_unbounded=is_unbounded)
    x = premise.displacement(tuned.evaluation.antecedent.parameters)
    start = Tuned.start(problem, premise, tuned.free, x)
    if not tuned.curvature.size:
        return _improved(start, _STEPS)
    return _risen(turned(start), FEW_TURNS - 1, _STEPS)


def with_free_terms(tuned: Tuned) -> Tuned:
    """The same with ordered terms without bounds, as in classic ANFIS, if this pays.

    Their premises move first, at the smallest weights. Else, on data without noise, the misfit of
    the first premises would be taken for noise.
    """
    problem, antecedent = tuned.problem, tuned.problem.antecedent
    # With hardly more rows than coefficients, unbounded terms could pass through every row.
    has_rows = problem.rows.n_rows >= ROWS_PER_CONSEQUENT * problem.n_columns
    has_moved = tuned.curvature.size > 0 and antecedent.is_ordered
    if not (has_moved and has_rows and problem.n_columns <= MANY_COLUMNS):
        return tuned
    premise = Premise.of(antecedent, *problem.rows.inputs.box, is_unbounded=True)
    least: dict[str, Any] = dict.fromkeys(tuned.free, SMALLEST.alpha)
    start = Tuned.start(problem, premise, tuned.free)
    start = start.with_penalty(replace(problem.penalty, **least))
    freed = _risen(turned(start, ARRIVING, _UNBOUNDED_ITERATIONS), MOST_TURNS - 1, _STEPS)
    return freed if freed.expected_error < _LESS_ERROR * tuned.expected_error else tuned


def _risen(tuned: Tuned, turns, steps) -> Tuned:
    """The point of the largest evidence, after up to ``turns`` more turns."""
    best = last = tuned
    for _ in range(turns):
        last = turned(last, steps)
        gain = best.posterior.minus_twice_log - last.posterior.minus_twice_log
        best = last if gain > 0.0 else best
        if not gain > WORTH:
            break
    return best


def turned(tuned: Tuned, steps=_STEPS, iterations=_ITERATIONS) -> Tuned:
    """One turn from the end of the last: premises down the cost, then weights up the evidence."""
    result = varpro(
        tuned.problem,
        tuned.premise,
        max_iter=iterations,
        tol=TOLERANCE,
        stiffness=tuned.penalty.stiffness,
        start=tuned.displacement,
        evaluation=tuned.solved,
    )
    evaluation = result.evaluation
    x = tuned.premise.displacement(evaluation.antecedent.parameters)
    # Usually it is that of one step before the end, which is as good and saves a pass.
    curvature = np.maximum(np.linalg.eigvalsh(result.gauss_newton), 0.0)
    there = {"evaluation": evaluation, "solved": evaluation, "displacement": x}
    return _improved(replace(tuned, **there, curvature=curvature), steps)


def _improved(tuned: Tuned, steps) -> Tuned:
    """The same point after up to ``steps`` steps of the free weights, fewer if they settle."""
    for _ in range(steps):
        posterior = tuned.posterior
        least = SMALLEST if tuned.premise.is_unbounded else least_weights(posterior)
        penalty = reestimated(posterior, tuned.free, least)
        if is_settled(tuned.problem.common_line, tuned.penalty, penalty):
            break
        tuned = tuned.with_penalty(penalty)
    return tuned


def cost_of(tuned: Tuned) -> int:
    """Reading cost of the rules."""
    problem, n_rules = tuned.problem, tuned.problem.antecedent.n_rules
    n_slopes = n_rules * len(problem.common_line.slopes) - tuned.penalty.n_held
    return reading_cost(problem.antecedent, n_slopes, problem.n_outputs)


def with_most_agreement(tuned: Tuned, room: float) -> Tuned:
    """The same with as much agreement as lets the squared error rise by the factor ``room``.

    First the agreement is raised at fixed premises. Then these follow, which may leave room for
    more, or for less.
    """
    is_known = np.isfinite(tuned.expected_error)
    if "agreement" not in tuned.free or not tuned.displacement.size or room <= 1.0 or not is_known:
        return tuned
    most, best, agreement = room * tuned.expected_error, tuned, 0.0
    for _ in range(FEW_TURNS):
        agreement = agreement or _most_agreement(best, most)
        if agreement < _LEAST_RAISE * best.penalty.agreement:
            break
        found = turned(best.with_penalty(replace(best.penalty, agreement=agreement)), steps=0)
        if found.expected_error <= most:
            best, agreement = found, 0.0
        else:
            agreement = float(np.sqrt(best.penalty.agreement * agreement))
    return best


def with_sparse_slopes(tuned: Tuned, worth) -> Tuned:
    """The same, where rules share a slope or have none unless their own is worth ``worth``."""
    if not {"alpha", "slope"} <= set(tuned.free) or tuned.problem.n_columns > MANY_COLUMNS:
        return tuned
    common, absent = sparse_slopes(tuned.posterior, tuned.solved.normal.coefficients, worth)
    return tuned.with_penalty(replace(tuned.penalty, common=common, absent=absent))


def _most_agreement(tuned: Tuned, most: float) -> float:
    """The largest agreement that keeps the error below ``most`` at fixed premises, by bisection."""
    low, high = tuned.penalty.agreement, LARGEST.agreement
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        # Solving again takes no pass over the rows; only the error of the solution does.
        raised = tuned.with_penalty(replace(tuned.penalty, agreement=middle))
        low, high = (middle, high) if raised.expected_error <= most else (low, middle)
    return low


def scaled(penalty: Penalty, free, ratio, agreement_is_raised=False):
    """The free weights times ``ratio``: relative to a mean over rows, they fall as rows rise.

    Raised agreement stays: it makes rules hold one by one for any number of rows. Weights keep
    three digits; more would carry rounding errors into the model.
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
