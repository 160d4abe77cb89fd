"""Constraints on the outputs of a fit, kept for certain.

Rules in order (``construction``) keep them by inequalities of their own; where no order is known,
or none holds, the best line for all rules does. If that raises the error by more than 2 %, the fit
goes back towards the free one as far as branch and bound can prove that all are kept.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .._validation import warn_user
from ..antecedent import TreeAntecedent
from ..consequent import NormalFactor, in_user_units
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..learning.data import Scale
from ..learning.objective import Evaluation
from ..model import TSKModel
from ..policies import SILENT
from .certified import spread_points, training_box
from .constraints import Constraints
from .construction import ONE_RULE, RuleOrder, is_in_order, nearest_in_order, with_equal_widths
from .contradictions import contradicted
from .enclosure import Enclosure
from .quadratic_program import InfeasibleError, nearest_by_exchange
from .search import largest
from .terms import is_known

# Ratios of squared errors, constrained over free: beyond the first, consequents nearer to the free
# fit are sought; beyond the other, consequents that were drawn are worth a warning.
_COSTLY, _WORTH_A_WARNING = 1.02**2, 1.1**2
# Halvings of the way; most boxes of a proof, and of all proofs before the way is halved (fewer
# where there are more terms than so many, for boxes then take longer).
_HALVINGS, _MOST_BOXES, _ALL_BOXES, _TERMS = 6, 3000, 10_000, 20
# Standard deviations of the target that rounding may leave between a fixed point and a prediction.
_OFF = 1e-8
# Points that are added at once, the worst of many; and the margin that is kept at them, in standard
# deviations of the target, and of the input.
_POINTS_A_ROUND, _MARGIN = 20, 0.01


@dataclass(frozen=True, eq=False)
class Kept:
    """Consequents that keep all constraints, for certain, and the free ones of these premises."""

    free: Evaluation
    evaluation: Evaluation  # with the constraints
    coefficients: np.ndarray  # in the user's units
    points: np.ndarray  # in the range, at which values are known


def constrained(model: TSKModel, evaluation, problem, constraints: Constraints, rows):
    """The consequents nearest to those of an evaluation that keep all constraints; and a report.

    ``model`` is in the user's units. With ``rows``, X, y and their numbers, a warning names those
    that contradict a constraint.
    """
    fit = _ConstrainedFit(model, evaluation, problem, constraints)
    ordered, is_line = fit.in_order()
    local, ended, drawn = ordered, fit.ended(ordered), float(is_line)
    before = float(evaluation.mean_squared_error)
    if ended.mean_squared_error > _COSTLY * before:
        nearer, way = fit.drawn(ordered)
        ended_nearer = fit.ended(nearer)
        if ended_nearer.mean_squared_error < ended.mean_squared_error:
            local, ended, drawn = nearer, ended_nearer, way
    held = fit.with_local(local, is_line and local is ordered)
    after = float(ended.mean_squared_error)
    # Of data without noise the free fit may have no error at all.
    raised = after / before if before else np.inf
    report = {"certified": True, "drawn": drawn, "loss_before": before, "loss_after": after}
    if rows is not None:
        free = replace(model, target=None)
        fixed = constraints.points, constraints.values
        for message in contradicted(free, held, fit.inequalities, fixed, rows, raised):
            warn_user(message, ConstraintWarning)
    if drawn and raised > _WORTH_A_WARNING and after:
        names = ", ".join(one.name for one in fit.inequalities) or "the fixed points"
        is_tree = isinstance(model.antecedent, TreeAntecedent)
        remedy = "a smaller max_rules" if is_tree else "partition='tree'"
        end = "one line" if is_line else "rules in order"
        warn_user(
            f"To be certain of {names}, the rules were drawn {drawn:.0%} of the way to {end}: that "
            f"raises the training error by {np.sqrt(raised) - 1.0:.0%}. Use {remedy}, or leave a "
            "constraint out.",
            ConstraintWarning,
        )
    return Kept(fit.free, ended, held.coefficients, fit.known_points), report


def at_equal_widths(problem, evaluation, constraints: Constraints):
    """The evaluation where Gaussian terms have one width on every input that has a sign."""
    inputs = np.flatnonzero(constraints.signs.any(axis=0))
    antecedent = with_equal_widths(evaluation.antecedent, inputs)
    if (antecedent.parameters == evaluation.antecedent.parameters).all():
        return evaluation
    return problem.evaluate(antecedent.parameters)


def ways_in_order(problem, evaluation, constraints: Constraints, equal, equal_to):
    """Yield the nearest rules in order, then the nearest line, and whether it is one.

    InfeasibleError if neither exists. Of the equalities E u = e for local consequents u, ``equal``
    is E, ``equal_to`` e by output.
    """
    failure = InfeasibleError(False)
    for is_line in (False, True):
        try:
            yield _nearest(problem, evaluation, constraints, equal, equal_to, is_line), is_line
        except InfeasibleError as error:
            failure = error
    raise failure


def held_in_search(constraints: Constraints | None):
    """The function that keeps signs during the search, on standardised data; None without signs.

    It gives the antecedent and consequents nearest to an evaluation. Limits and fixed points, which
    are in the user's units, are left to the final fit.
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
    to_local = np.eye(problem.n_columns)
    to_rules = problem.local.to_global(to_local)
    if is_line:
        lines = np.tile(np.eye(problem.n_basis), (antecedent.n_rules, 1))
        to_local = problem.local.to_local(lines)
        matrix = normal.gram + normal.penalty
        factor = NormalFactor(to_local.T @ matrix @ to_local)
        start = factor.solve(to_local.T @ (matrix @ start))
        antecedent, to_rules = ONE_RULE, np.eye(problem.n_basis)
        equal = equal @ to_local
    local = np.empty_like(normal.coefficients)
    limits = (np.stack([constraints.lower, constraints.upper]) - targets.offset) / targets.scale
    for k, signs in enumerate(constraints.signs):
        order = RuleOrder.of(antecedent, signs, limits[:, k], slopes)
        if order is None:
            raise InfeasibleError(False)
        local[:, k] = to_local @ nearest_in_order(
            order, factor, start[:, k], to_rules, box, equal, equal_to[:, k]
        )
    return local


class _ConstrainedFit:
    """The consequents that keep the constraints, at the premises of one evaluation."""

    def __init__(self, model, evaluation, problem, constraints):
        self.problem, self.constraints = problem, constraints
        # The best at premises for which there is an order.
        self.free = at_equal_widths(problem, evaluation, constraints)
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self.model = replace(model, target=None)
        # A model with an output for each local consequent: what it adds to the standardised target.
        n_columns = problem.n_columns
        as_it_is = Scale(*np.array([[0.0], [1.0], [0.0], [1.0]]).repeat(n_columns, axis=1))
        self.columns = self._with(np.eye(n_columns), as_it_is)
        self.inequalities = constraints.inequalities(model)
        self.n_boxes, self.part = 0, min(1.0, _TERMS / max(model.antecedent.n_terms, 1))
        self.is_inside = model.in_bounds(constraints.points)
        beyond = constraints.points[~self.is_inside]
        if len(beyond) and model.out_of_bounds in SILENT:
            raise ValueError(
                f"constraints has a FixedPoint at {beyond[0]}, where a model with "
                f"out_of_bounds={model.out_of_bounds!r} predicts nothing: "
                f"{model.describe_out_of_bounds(beyond)} Use out_of_bounds='linear' or 'clip'."
            )
        # E and e of the fixed points, for the local consequents.
        targets = problem.rows.targets
        values = (constraints.values - targets.offset) / targets.scale
        self.fixed = self.columns.predict(constraints.points), values

    def in_order(self):
        """Rules in order, or a line, and which; an error says what constraints cannot be kept."""
        try:
            ways = ways_in_order(self.problem, self.free, self.constraints, *self.fixed)
            # Of rules rounding may be larger than the margin, of a line there is next to none.
            return next(way for way in ways if self._is_certified(*way))
        except InfeasibleError as failure:
            raise self._refused(failure.by_equalities) from None

    def _is_certified(self, local, is_line):
        model, constraints = self.with_local(local, is_line), self.constraints
        limits = zip(constraints.lower, constraints.upper, strict=True)
        return self._meets_points(model) and all(
            is_in_order(model, k, signs, of_output)
            for k, (signs, of_output) in enumerate(zip(constraints.signs, limits, strict=True))
        )

    def _meets_points(self, model):
        """Whether it predicts all fixed points, to rounding."""
        off = np.abs(model.predict(self.constraints.points) - self.constraints.values)
        off /= self.problem.rows.targets.scale
        return bool((off <= _OFF).all())

    def _refused(self, by_equalities):
        n_points, n_rules = len(self.constraints.points), self.model.n_rules
        rules = "1 rule" if n_rules == 1 else f"{n_rules} rules"
        if by_equalities:
            names = " and ".join(map(repr, self.model.output_names))
            return InfeasibleConstraintsError(
                f"constraints fixes {names} at {n_points} points, which {rules} cannot all meet: "
                "two points are the same, or there are more points than consequents. Give fewer "
                "points, or use more rules."
            )
        names = " and ".join(one.name for one in self.inequalities)
        points = "1 fixed point" if n_points == 1 else f"{n_points} fixed points"
        with_points = f" together with the {points}" if n_points else ""
        return InfeasibleConstraintsError(
            f"No consequents of {rules} keep {names}{with_points}. Drop a constraint, or use "
            f"{'' if self.model.order else 'order=1 or '}more rules."
        )

    @property
    def known_points(self):
        """The fixed points, in the range."""
        model, points = self.model, self.constraints.points
        if model.out_of_bounds == "linear":
            # Beyond, a tangent is known, which is more than a value: it is not counted.
            points = points[self.is_inside]
        return np.clip(points, model.minimum, model.maximum)

    def drawn(self, ordered):
        """The nearest that is proven on the way from near the free fit, 0, to those in order, 1."""
        local, drawn = ordered, 1.0
        if not all(is_known(group.family) for group in self.free.antecedent.groups):
            return local, drawn
        near = self._nearest_at_points(ordered)
        halves = 0.5 ** np.arange(1, 1 + _HALVINGS)
        # First all of the way back, then the least step of it: where that fails others will too.
        for step in (1.0, halves[-1], *halves[:-1]):
            now = near + (drawn - step) * (ordered - near)
            if self._is_proven(self.with_local(now)):
                local, drawn = now, float(drawn - step)
            elif step == halves[-1]:
                break
            if drawn == 0.0:
                break
        return local, drawn

    def _nearest_at_points(self, ordered):
        """The local consequents nearest to the free fit that keep all where they did not.

        Points are the worst of a sample, then those at which branch and bound finds a violation.
        """
        normal, (equal, equal_to) = self.free.normal, self.fixed
        sample = spread_points(self.model.minimum, self.model.maximum)
        # An output stays in order where not even the fixed points can be met otherwise.
        local = ordered.copy()
        nothing = np.empty((0, self.problem.n_columns)), np.empty(0)

        def violated(u, k):
            local[:, k] = u
            now = self.with_local(local)
            own = [one for one in self.inequalities if one.output == k]
            worst = [_worst(one.excess(now, sample), sample) for one in own]
            if not any(map(len, worst)) and self.n_boxes <= _ALL_BOXES * self.part:
                worst = [self._failure(one, now) for one in own]
            pairs = zip(own, worst, strict=True)
            found = [nothing, *(self._rows(one, points) for one, points in pairs)]
            return tuple(map(np.concatenate, zip(*found, strict=True)))

        for k, values in enumerate(equal_to.T):
            given = normal.factor, normal.coefficients[:, k], equal, values, *nothing
            # Where the exchange does not end, its last consequents are as good to draw back from.
            with suppress(InfeasibleError):
                local[:, k] = nearest_by_exchange(*given, partial(violated, k=k))
        return local

    def _rows(self, one, points):
        """Sums over the local consequents that an inequality is about at points; their least."""
        rows, found = self.problem.rows, one.of(self.columns, points)
        if one.input is None:
            targets = rows.targets
            least = one.sign * (one.limit - targets.offset[one.output]) / targets.scale[one.output]
            return found, np.full(len(points), least + _MARGIN)
        found = found * rows.inputs.scale[one.input]
        # Where no consequents have much of a slope, none is asked for.
        return found, _MARGIN * np.minimum(np.abs(found).sum(axis=1), 1.0)

    def _proof(self, one, model):
        """What branch and bound finds of an inequality, and what its bound must not be above."""
        bound_of = Enclosure(model, one.output, -one.sign).evaluate(one.input)
        until, ends = -one.sign * one.limit, (model.minimum, model.maximum)
        most = int(_MOST_BOXES * self.part)
        found = largest(bound_of, *ends, 0.0, most, training_box(model), until=until)
        self.n_boxes += found.n_boxes
        return found, until

    def _is_proven(self, model):
        proofs = (self._proof(one, model) for one in self.inequalities)
        return self._meets_points(model) and all(found.bound <= until for found, until in proofs)

    def _failure(self, one, model):
        """The point where branch and bound finds that an inequality fails, if it does."""
        found, until = self._proof(one, model)
        return found.point[None][: int(found.attained > until)]

    def ended(self, local):
        """The evaluation of the free fit, with other local consequents in its place."""
        normal = self.free.normal
        change, weighed = local - normal.coefficients, normal.gram + normal.penalty
        cost = self.free.cost + 0.5 * float(np.sum(change * (weighed @ change)))
        error = 2.0 * cost - float(np.sum(local * (normal.penalty @ local)))
        return replace(
            self.free,
            cost=cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=max(error, 0.0),
            normal=replace(normal, coefficients=local),
        )

    def with_local(self, local, is_line=False):
        """The model with other local consequents."""
        model = self._with(local, self.problem.rows.targets)
        if is_line:
            # To the last bit.
            line = np.broadcast_to(model.coefficients[:1], model.coefficients.shape)
            return replace(model, coefficients=line)
        return model

    def _with(self, local, targets):
        """The model of local consequents, for targets of this scale."""
        problem, inputs = self.problem, self.problem.rows.inputs
        design = problem.consequent_inputs, self.model.order
        common = problem.penalty.common, self.model.rule_weights
        coefficients = problem.local.to_global(local)
        return replace(
            self.model,
            antecedent=self.free.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=in_user_units(coefficients, inputs, targets, *design, *common),
            output_names=tuple(map(str, range(targets.scale.size))),
        )


def _worst(excess, points):
    """The points at which something is in excess, the worst of them first, and not all."""
    order = np.argsort(-excess)[:_POINTS_A_ROUND]
    return points[order[excess[order] > 0.0]]
