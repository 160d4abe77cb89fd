"""Constraints on the outputs of a fit, kept for certain.

Rules in order (``construction``) keep them by their own inequalities. Where that costs more than
2 % of the error, the consequents are those on the way from there to the free fit that are as near
to it as branch and bound can prove. Where no order is known, or none holds, the way begins at the
best line for all rules.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .._validation import warn_user
from ..antecedent import TreeAntecedent
from ..consequent import NormalFactor
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..learning.objective import Evaluation
from ..model import TSKModel
from ..policies import SILENT
from .certified import cuts_of, spread_points
from .constraints import Constraints
from .construction import ONE_RULE, RuleOrder, is_in_order, nearest_in_order, with_equal_widths
from .contradictions import contradicted
from .enclosure import Enclosure
from .quadratic_program import InfeasibleError, nearest
from .search import largest
from .terms import is_known

# Squared errors over the free fit's: beyond the first, a way back is sought; beyond the other, with
# consequents that were drawn, it is told.
_DEAR, _FAR = 1.02**2, 1.1**2
# Halvings of the way; boxes of each proof, and of all on the way to the nearest (fewer where there
# are more terms than so many).
_HALVINGS, _MOST_BOXES, _ALL_BOXES, _TERMS = 6, 3000, 10_000, 20
# Rounds in which points are added, so many of a sample in each; all corners of so few inputs are in
# it. In standard deviations of the target, and of the input, what is kept at them: first and last.
_ROUNDS, _POINTS_A_ROUND, _SAMPLE, _CORNERS = 20, 20, 1024, 8
_FIRST_MARGIN, _LAST_MARGIN, _RAISE = 1e-3, 0.1, 1.5


@dataclass(frozen=True)
class Inequality:
    """An inequality on one output: on its slope by ``input``, or, where that is None, its value.

    sign times it must be at least sign times ``limit``.
    """

    output: int
    sign: float
    input: int | None
    limit: float
    name: str


@dataclass(frozen=True, eq=False)
class Ordered:
    """Local consequents of rules in order, at premises for which there is an order."""

    free: Evaluation  # the best at these premises
    local: np.ndarray  # (n_columns, n_outputs)
    met: list[np.ndarray]  # by output, sums over consequents on [1, z] that are met with equality
    is_line: bool


@dataclass(frozen=True, eq=False)
class Kept:
    """Consequents that keep all constraints, for certain."""

    free: Evaluation
    evaluation: Evaluation
    coefficients: np.ndarray  # in the user's units
    known: tuple  # what is met with equality, as ``Posterior.given`` takes it


def constrained(
    model: TSKModel, evaluation, problem, constraints: Constraints, in_user_units, rows
):
    """The consequents next to those of an evaluation that keep all constraints; and a report.

    ``model`` is in the user's units, ``in_user_units`` brings coefficients on [1, z] to them;
    ``rows`` are X, y and their numbers, to say which contradict what is known, or None.
    """
    fit = _ConstrainedFit(model, problem, constraints, in_user_units)
    ordered = fit.certified_order(evaluation)
    kept, drawn = fit.kept(ordered, ordered.local), 1.0 if ordered.is_line else 0.0
    before = evaluation.mean_squared_error
    if kept.evaluation.mean_squared_error > _DEAR * before:
        other, way = fit.drawn(kept, ordered)
        if other.evaluation.mean_squared_error < kept.evaluation.mean_squared_error:
            kept, drawn = other, way
    after = kept.evaluation.mean_squared_error
    report = {
        "certified": True,
        "drawn": drawn,
        "loss_before": float(before),
        "loss_after": float(after),
    }
    if rows is not None:
        held = replace(fit.model, coefficients=kept.coefficients)
        free = replace(model, target=None)
        names = contradicted(free, held, fit.inequalities, rows, after / before)
        for message in names:
            warn_user(message, ConstraintWarning)
    if drawn and after > _FAR * before:
        names = ", ".join(one.name for one in fit.inequalities)
        is_tree = isinstance(model.antecedent, TreeAntecedent)
        remedy = "a smaller max_rules" if is_tree else "partition='tree'"
        warn_user(
            f"To be certain of {names}, the rules were drawn {drawn:.0%} of the way to "
            f"{'one line' if ordered.is_line else 'rules in order'}, which raises the error of "
            f"training by {np.sqrt(after / before) - 1.0:.0%}. Use {remedy}, or leave a "
            "constraint out.",
            ConstraintWarning,
        )
    return kept, report


def at_equal_widths(problem, evaluation, constraints: Constraints):
    """The evaluation where Gaussian terms have one width on every input that has a sign."""
    inputs = np.flatnonzero(constraints.signs.any(axis=0))
    antecedent = with_equal_widths(evaluation.antecedent, inputs)
    if (antecedent.parameters == evaluation.antecedent.parameters).all():
        return evaluation
    return problem.evaluate(antecedent.parameters)


def in_order(problem, evaluation, constraints: Constraints, equal, equal_to) -> Ordered:
    """The nearest rules in order, or the nearest line; InfeasibleError where there is neither.

    ``equal`` are sums over the consequents on [1, z], and ``equal_to`` what each output has there.
    """
    try:
        return _nearest(problem, evaluation, constraints, equal, equal_to, is_line=False)
    except InfeasibleError:
        return _nearest(problem, evaluation, constraints, equal, equal_to, is_line=True)


def held_in_search(constraints: Constraints | None):
    """What makes premises and consequents, of standardised data, rise and fall as they must.

    None where nothing must. Limits and fixed points, in the user's units, are left out.
    """
    if constraints is None or not constraints.signs.any():
        return None
    nothing = np.full(len(constraints.signs), np.inf)
    signs = replace(constraints, lower=-nothing, upper=nothing)

    def held(problem, evaluation):
        no_points = np.empty((0, problem.n_columns)), np.empty((0, problem.n_outputs))
        evaluation = at_equal_widths(problem, evaluation, signs)
        ordered = in_order(problem, evaluation, signs, *no_points)
        return ordered.free.antecedent, problem.local.to_global(ordered.local)

    return held


def _nearest(problem, evaluation, constraints, equal, equal_to, is_line):
    normal, targets, slopes = evaluation.normal, problem.rows.targets, problem.consequent_inputs
    box = [end[slopes] for end in problem.rows.inputs.box]
    antecedent, factor, start = evaluation.antecedent, normal.factor, normal.coefficients
    to_local = np.eye(problem.n_columns)
    if is_line:
        lines = np.tile(np.eye(problem.n_basis), (antecedent.n_rules, 1))
        to_local = problem.local.to_local(lines)
        matrix = normal.gram + normal.penalty
        factor = NormalFactor(to_local.T @ matrix @ to_local)
        start = factor.solve(to_local.T @ (matrix @ start))
        antecedent, to_rules = ONE_RULE, np.eye(problem.n_basis)
        equal = equal @ lines
    else:
        to_rules = problem.local.to_global(to_local)
    local, met = np.empty_like(normal.coefficients), []
    for k, signs in enumerate(constraints.signs):
        limits = [
            (limit[k] - targets.offset[k]) / targets.scale[k]
            for limit in (constraints.lower, constraints.upper)
        ]
        order = RuleOrder.of(antecedent, signs, limits, slopes)
        if order is None:
            raise InfeasibleError(False)
        solved, rows = nearest_in_order(
            order, factor, start[:, k], to_rules, box, equal, equal_to[:, k]
        )
        local[:, k] = to_local @ solved
        # What one rule of a line meets, the first does: the others are the same.
        every = np.zeros((len(rows), evaluation.antecedent.n_rules, problem.n_basis))
        every[:, : rows.shape[1]] = rows
        met.append(every)
    return Ordered(evaluation, local, met, is_line)


class _ConstrainedFit:
    def __init__(self, model, problem, constraints, in_user_units):
        self.problem, self.constraints, self.in_user_units = problem, constraints, in_user_units
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self.model = replace(model.with_out_of_bounds("clip"), target=None)
        self.policy = model.out_of_bounds, model.max_extrapolation
        self.inequalities = _inequalities_of(constraints, model)
        self.n_boxes, self.part = 0, min(1.0, _TERMS / max(model.antecedent.n_terms, 1))
        beyond = constraints.points[~model.in_bounds(constraints.points)]
        if len(beyond) and model.out_of_bounds in SILENT:
            raise ValueError(
                f"constraints has a FixedPoint at {beyond[0]}, where a model with "
                f"out_of_bounds={model.out_of_bounds!r} predicts nothing: "
                f"{model.describe_out_of_bounds(beyond)} Use out_of_bounds='linear' or 'clip'."
            )

    def certified_order(self, evaluation) -> Ordered:
        """Rules in order, or a line; an error that says which constraints cannot be kept."""
        evaluation = at_equal_widths(self.problem, evaluation, self.constraints)
        equal, equal_to = self._fixed(self._columns(evaluation.antecedent))
        try:
            ordered = in_order(self.problem, evaluation, self.constraints, equal, equal_to)
            if not self._is_certified(ordered):
                # Rounding is larger than the margin: of a line there is next to none.
                ordered = _nearest(
                    self.problem, evaluation, self.constraints, equal, equal_to, is_line=True
                )
                if not self._is_certified(ordered):
                    raise InfeasibleError(False)
        except InfeasibleError as failure:
            raise self._refused(failure.by_equalities) from None
        return ordered

    def _is_certified(self, ordered):
        model, constraints = self._model(ordered, ordered.local), self.constraints
        limits = zip(constraints.lower, constraints.upper, strict=True)
        return all(
            is_in_order(model, k, signs, of_output)
            for k, (signs, of_output) in enumerate(zip(constraints.signs, limits, strict=True))
        )

    def _refused(self, by_equalities):
        n_points, n_rules = len(self.constraints.points), self.model.n_rules
        if by_equalities:
            names = " and ".join(map(repr, self.model.output_names))
            return InfeasibleConstraintsError(
                f"constraints fixes {names} at {n_points} points, which {n_rules} rules cannot "
                "all meet: two are the same, or there are more than consequents. Give fewer "
                "points, or use more rules."
            )
        names = " and ".join(one.name for one in self.inequalities)
        with_points = f", with the {n_points} fixed points of constraints," if n_points else ""
        return InfeasibleConstraintsError(
            f"No consequents of these {n_rules} rules keep {names}{with_points} all at once. Drop "
            "one of them, or use order=1 or more rules."
        )

    def kept(self, ordered, local, is_end=True) -> Kept:
        """Consequents with what is known of them: at the end of the way, what holds them there."""
        problem, model, points = self.problem, self.model, self.constraints.points
        if self.policy[0] == "linear":
            # Beyond, a tangent is known, which is more than a value: it is not counted.
            points = points[model.in_bounds(points)]
        fixed = [(np.clip(points, model.minimum, model.maximum), None)] if len(points) else []
        scale = np.append(1.0, problem.rows.inputs.scale[problem.consequent_inputs])
        known = tuple(
            fixed + [(rows * scale).reshape(len(rows), problem.n_columns).T] * is_end
            for rows in ordered.met
        )
        coefficients = self._model(ordered, local).coefficients
        return Kept(ordered.free, self._ended(ordered.free, local), coefficients, known)

    def drawn(self, kept, ordered):
        """The nearest that is proven on the way from there; and how far that is drawn."""
        if not all(is_known(group.family) for group in ordered.free.antecedent.groups):
            return kept, float(ordered.is_line)
        near, drawn = self._nearest_at_points(ordered), 1.0
        for drawn_to in (0.0, *(0.5 ** np.arange(1, 1 + _HALVINGS))):
            # First all of the way, then halves of what is left.
            now = drawn - drawn_to if drawn_to else 0.0
            local = near + now * (ordered.local - near)
            if next(self._not_proven(self._model(ordered, local)), None) is None:
                kept, drawn = self.kept(ordered, local, is_end=False), float(now)
                if now == 0.0:
                    break
        return kept, drawn if drawn < 1.0 or ordered.is_line else 0.0

    def _nearest_at_points(self, ordered):
        """The local consequents nearest to the free fit that keep all where they did not.

        Points are the worst of a sample, then those at which branch and bound finds a violation.
        """
        normal, problem, model = ordered.free.normal, self.problem, self.model
        columns = self._columns(ordered.free.antecedent)
        to_global = problem.local.to_global(np.eye(problem.n_columns))
        equal, equal_to = self._fixed(columns)
        sample = spread_points(model.minimum, model.maximum, _SAMPLE, _CORNERS)
        rows = [np.empty((0, problem.n_columns))] * problem.n_outputs
        least = [np.empty((0, 2))] * problem.n_outputs
        local, margin = normal.coefficients.copy(), np.array([1.0, _FIRST_MARGIN])
        for _ in range(_ROUNDS):
            for k, values in enumerate(equal_to.T):
                start, fixed = normal.coefficients[:, k], equal @ to_global
                try:
                    found = nearest(normal.factor, start, fixed, values, rows[k], least[k] @ margin)
                except InfeasibleError:
                    return local
                local[:, k] = found[0]
            now = self._model(ordered, local)
            worst = [(one, _worst(one, now, sample)) for one in self.inequalities]
            if not any(len(points) for _, points in worst):
                worst = list(self._not_proven(now))
                if not worst or margin[1] > _LAST_MARGIN or self.n_boxes > _ALL_BOXES * self.part:
                    break
                # With more of a margin there is less to find, and boxes are decided sooner.
                margin[1] *= _RAISE
            for one, points in worst:
                of_points, to_keep = self._rows(one, columns, points)
                rows[one.output] = np.vstack([rows[one.output], of_points @ to_global])
                least[one.output] = np.vstack([least[one.output], to_keep])
        return local

    def _rows(self, one, columns, points):
        """Sums over the consequents that an inequality is about; their least, and its margin."""
        inputs, targets = self.problem.rows.inputs, self.problem.rows.targets
        at, least = (points - inputs.offset) / inputs.scale, np.ones((len(points), 2))
        if one.input is None:
            least[:, 0] = one.sign * (one.limit - targets.offset[one.output])
            least[:, 0] /= targets.scale[one.output]
            return one.sign * columns.predict(at), least
        found, least[:, 0] = one.sign * columns.gradient(at)[:, one.input], 0.0
        # Where no consequents have much of a slope, none is asked for.
        least[:, 1] = np.minimum(np.abs(found).sum(axis=1), 1.0)
        return found, least

    def _not_proven(self, model):
        """Every inequality that branch and bound does not prove, and where it fails, if it does."""
        for one in self.inequalities:
            enclosure = Enclosure(model, one.output, -one.sign)
            bound_of = enclosure.values
            if one.input is not None:
                bound_of = partial(enclosure.slope, j=one.input)
            until, ends = -one.sign * one.limit, (model.minimum, model.maximum)
            most = int(_MOST_BOXES * self.part)
            found = largest(bound_of, *ends, 0.0, most, cuts_of(model), until=until)
            self.n_boxes += found.n_boxes
            if found.bound > until:
                yield one, found.point[None][: int(found.attained > until)]

    def _ended(self, evaluation, local):
        """The evaluation with other local consequents."""
        normal = evaluation.normal
        change, weighed = local - normal.coefficients, normal.gram + normal.penalty
        cost = evaluation.cost + 0.5 * float(np.sum(change * (weighed @ change)))
        error = 2.0 * cost - float(np.sum(local * (normal.penalty @ local)))
        return replace(
            evaluation,
            cost=cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=max(error, 0.0),
            normal=replace(normal, coefficients=local),
        )

    def _model(self, ordered, local):
        inputs = self.problem.rows.inputs
        coefficients = self.in_user_units(self.problem.local.to_global(local))
        if ordered.is_line and local is ordered.local:
            # To the last bit.
            coefficients = np.broadcast_to(coefficients[:1], coefficients.shape)
        antecedent = ordered.free.antecedent.change_units(inputs.offset, inputs.scale)
        return replace(self.model, antecedent=antecedent, coefficients=coefficients)

    def _fixed(self, columns):
        """Of the fixed points, sums over the consequents on [1, z], and what they are to be."""
        inputs, targets, constraints = (
            self.problem.rows.inputs,
            self.problem.rows.targets,
            self.constraints,
        )
        points = (constraints.points - inputs.offset) / inputs.scale
        values = (constraints.values - targets.offset) / targets.scale
        nothing = np.empty((0, self.problem.n_columns))
        columns = columns.with_out_of_bounds(*self.policy)
        return columns.predict(points) if len(points) else nothing, values

    def _columns(self, antecedent):
        """A model whose outputs are the columns of the design, in standardised inputs."""
        model, problem, inputs = self.model, self.problem, self.problem.rows.inputs
        n_rules, n_columns = antecedent.n_rules, problem.n_columns
        unit = np.eye(n_columns).reshape(n_rules, problem.n_basis, n_columns)
        coefficients = np.zeros((n_rules, 1 + model.n_inputs, n_columns))
        coefficients[:, 0] = unit[:, 0]
        coefficients[:, 1 + problem.consequent_inputs] = unit[:, 1:]
        at = model.tangent_at
        return replace(
            model,
            antecedent=antecedent,
            initial_antecedent=antecedent,
            coefficients=coefficients,
            reference=np.zeros(model.n_inputs),
            spread=np.ones(model.n_inputs),
            minimum=inputs.box[0],
            maximum=inputs.box[1],
            support=None,
            tangent_at=None if at is None else (at - inputs.offset) / inputs.scale,
            output_names=tuple(map(str, range(n_columns))),
        )


def _inequalities_of(constraints: Constraints, model: TSKModel):
    """The inequalities among the constraints, output by output."""
    found = []
    for k, name in enumerate(model.output_names):
        for j, sign in enumerate(constraints.signs[k]):
            if sign and model.minimum[j] < model.maximum[j]:
                what = f"monotonic_cst={sign} of {name!r} by {model.input_names[j]!r}"
                found.append(Inequality(k, float(sign), j, 0.0, what))
        for sign, limit in ((1.0, constraints.lower[k]), (-1.0, constraints.upper[k])):
            if np.isfinite(limit):
                found.append(Inequality(k, sign, None, limit, f"the limit {limit:g} of {name!r}"))
    return found


def _worst(one, model, points):
    """The points at which an inequality does not hold, the worst of them first, and not all."""
    if one.input is None:
        excess = one.sign * (one.limit - model.predict(points)[:, one.output])
    else:
        excess = -one.sign * model.gradient(points)[:, one.input, one.output]
    order = np.argsort(-excess)[:_POINTS_A_ROUND]
    return points[order[excess[order] > 0.0]]
