"""Constraints on the outputs of a fit, provably kept.

Rules in order (``construction``) keep them by linear inequalities. If no order is known, or none
exists, one line for all rules keeps them. If this raises the error by more than 2 %, the fit moves
back towards the free one, as far as branch and bound can prove that all constraints still hold.
"""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from .._validation import warn_user
from ..antecedent import TreeAntecedent
from ..consequent import NormalFactor
from ..digits import counted, percent
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..model import TSKModel
from ..policies import SILENT
from .consequents import Consequents
from .constraints import Constraints
from .construction import ONE_RULE, RuleOrder, nearest_in_order, with_equal_widths
from .contradictions import contradicted
from .quadratic_program import InfeasibleError

# Ratios of squared errors, constrained over free. Beyond the first, consequents nearer to the free
# fit are sought; beyond the second, there is a warning if the fit was drawn towards rules in order.
_COSTLY, _WORTH_A_WARNING = 1.02**2, 1.1**2
_OF_MARGINS = 1e-8  # squared error, in variances of the target, that margins alone may cost


def proven_consequents(model: TSKModel, evaluation, problem, constraints: Constraints, rows):
    """The consequents nearest to those of an evaluation that provably keep all constraints.

    Returns these, in the user's units like ``model``; the evaluation of the free consequents at the
    same premises; the constrained ones in its units; the points in range at which values are known;
    and a report. If ``rows`` are given, X, y and their numbers, a warning names those that
    contradict a constraint.
    """
    _check_points(model, constraints)
    if not len(constraints.points):
        # A constant within its limits keeps every sign; margins would give its rules slopes.
        low, high = problem.rows.targets.minimum, problem.rows.targets.maximum
        keeps = (low == high) & (constraints.lower < low) & (high < constraints.upper)
        constraints = replace(constraints, signs=np.where(keeps[:, None], 0, constraints.signs))
    # The free fit at premises for which an order may be known.
    free = at_equal_widths(problem, evaluation, constraints)
    found = Consequents(model, free, problem, constraints)
    local, is_line = _in_order(found)
    held, drawn = found.model(local, is_line), float(is_line)
    before, after = evaluation.mean_squared_error, found.loss(local)
    if after > _COSTLY * before:
        nearer, way = found.nearest_proven(local)
        if found.loss(nearer) < after:
            local, held = nearer, found.model(nearer)
            drawn, after = way, found.loss(nearer)
        elif way == 1.0:
            drawn = way  # no proof was found before the rules in order
    raised = after / max(before, _OF_MARGINS)  # on exact data, the free fit may have no error
    report = {"certified": True, "drawn": drawn, "loss_before": before, "loss_after": after}
    told = []
    if rows is not None:
        unheld, fixed = replace(model, target=None), (constraints.points, constraints.values)
        told = list(contradicted(unheld, held, found.inequalities, fixed, rows, raised))
    for message in told:
        warn_user(message, ConstraintWarning)
    # What the data contradict costs much with any rules: other rules are no remedy.
    if drawn and raised > _WORTH_A_WARNING and not told:
        names = " and ".join(one.name for one in found.inequalities) or "the fixed points"
        is_tree = isinstance(model.antecedent, TreeAntecedent)
        remedy = "a smaller max_rules" if is_tree else "partition='tree'"
        end = "a single line that keeps" if is_line else "rules that provably keep"
        warn_user(
            f"To guarantee {names}, the rules were moved {percent(drawn)} of the way to {end} "
            f"this. That raises the training error by {percent(np.sqrt(raised) - 1.0)}. Use "
            f"{remedy}, or drop a constraint.",
            ConstraintWarning,
        )
    points = constraints.points
    if model.out_of_bounds == "linear":
        # A point beyond the range fixes a tangent, not a value in range: it is left out.
        points = points[model.in_bounds(points)]
    points = np.clip(points, model.minimum, model.maximum)
    return held.coefficients, free, problem.local.to_global(local), points, report


def _check_points(model, constraints):
    """Raise ValueError for a fixed point at which the policy gives no value."""
    beyond = constraints.points[~model.in_bounds(constraints.points)]
    if len(beyond) and model.out_of_bounds in SILENT:
        raise ValueError(
            f"constraints has a FixedPoint at {beyond[0]}, but out_of_bounds="
            f"{model.out_of_bounds!r} predicts nothing there. "
            f"{model.describe_out_of_bounds(beyond)} Use out_of_bounds='linear' or 'clip'."
        )


def _in_order(found: Consequents):
    """Local consequents in order, and whether they are one line; an error if there are none."""
    try:
        ways = ways_in_order(found.problem, found.free, found.constraints, *found.fixed)
        # Rounding may exceed the margin of rules, but hardly that of a line, which comes next.
        return next(way for way in ways if found.is_certified(*way))
    except InfeasibleError:
        raise InfeasibleConstraintsError(_refusal(found)) from None


def _refusal(found):
    n_points, n_rules = len(found.constraints.points), found.problem.antecedent.n_rules
    points = f"the {counted(n_points, 'fixed point')}" if n_points else ""
    names = " and ".join(one.name for one in found.inequalities)
    kept = " together with ".join(filter(None, [names, points]))
    more = "more rules" if found.columns.order else "order=1 or more rules"
    rules = counted(n_rules, "rule")
    return f"No consequents of {rules} keep {kept}. Drop a constraint, or use {more}."


def at_equal_widths(problem, evaluation, constraints: Constraints):
    """The evaluation with Gaussian terms of one width on every input with a monotonic sign."""
    inputs = np.flatnonzero(constraints.signs.any(axis=0))
    antecedent = with_equal_widths(evaluation.antecedent, inputs)
    if (antecedent.parameters == evaluation.antecedent.parameters).all():
        return evaluation
    return problem.evaluate(antecedent.parameters)


def ways_in_order(problem, evaluation, constraints: Constraints, equal, equal_to):
    """Yield the nearest rules in order, then the nearest line, each with whether it is a line.

    InfeasibleError if neither exists. ``equal`` is E and ``equal_to`` e by output, in the
    equalities E u = e for local consequents u.
    """
    for is_line in (False, True):
        with suppress(InfeasibleError):
            yield _nearest(problem, evaluation, constraints, equal, equal_to, is_line), is_line
    raise InfeasibleError


def held_in_search(constraints: Constraints | None):
    """The function that enforces signs during the search, on standardised data; None without signs.

    It returns the antecedent and the nearest consequents in order for an evaluation. Limits and
    fixed points, which are in the user's units, are left to the final fit.
    """
    if constraints is None or not constraints.signs.any():
        return None
    nothing = np.full(len(constraints.signs), np.inf)
    signs = replace(constraints, lower=-nothing, upper=nothing)

    def held(problem, evaluation):
        no_points = np.empty((0, problem.n_columns)), np.empty((0, problem.n_outputs))
        evaluation = at_equal_widths(problem, evaluation, signs)
        local, _ = next(ways_in_order(problem, evaluation, signs, *no_points))
        return evaluation.antecedent, problem.local.to_global(local)

    return held


def _nearest(problem, evaluation, constraints, equal, equal_to, is_line):
    normal, targets, slopes = evaluation.normal, problem.rows.targets, problem.consequent_inputs
    box = [end[slopes] for end in problem.rows.inputs.box]
    antecedent, factor, start = evaluation.antecedent, normal.factor, normal.coefficients
    to_rules = problem.local.to_global(np.eye(problem.n_columns))
    if is_line:
        every = problem.local.to_local(np.tile(np.eye(problem.n_basis), (antecedent.n_rules, 1)))
        matrix = normal.gram + normal.penalty
        factor = NormalFactor(matrix, np.linalg.qr(every)[0])
        antecedent, start = ONE_RULE, factor.solve(matrix @ start)
        to_rules = to_rules[: problem.n_basis]
    local, about = np.empty_like(normal.coefficients), np.zeros(problem.rows.inputs.scale.size)
    limits = (np.stack([constraints.lower, constraints.upper]) - targets.offset) / targets.scale
    for k, signs in enumerate(constraints.signs):
        order = RuleOrder.of(antecedent, signs, limits[:, k], slopes, about)
        if order is None:
            raise InfeasibleError
        equalities = equal, equal_to[:, k]
        local[:, k] = nearest_in_order(order, factor, start[:, k], to_rules, box, *equalities)
    return local
