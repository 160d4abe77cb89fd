"""Constraints on the outputs of a fit, kept for certain: by rules in order, or proven.

Where rules in order (``construction``) cost too much, constraints are held at points, with a
margin; violations are sought in a sample, then by branch and bound, and their places added, until
the proof succeeds. What cannot be proven is drawn towards one line for all rules.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.special import chdtri

from .._validation import warn_user
from ..antecedent import TreeAntecedent
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..learning.objective import Evaluation
from ..model import TSKModel
from .certified import cuts_of, spread_points
from .constraints import Constraints
from .construction import RuleOrder, held_by_order, order_of, with_equal_widths
from .enclosure import Enclosure
from .inequalities import HeldPoints, InfeasibleError, paid_for
from .search import largest
from .terms import is_known

# Margins, in standard deviations of the target (and of the input): the first, and the last tried.
_FIRST_MARGIN, _LAST_MARGIN, _RAISE = 1e-3, 0.1, 3.0
# A bound on time: boxes of all proofs of a fit (fewer where there are more terms than so many),
# and of each of those on the way to what is certain.
_MOST_ROUNDS, _ROUNDS_A_MARGIN, _MOST_BOXES, _TERMS = 40, 4, 15_000, 20
_HALVINGS, _PART_OF_DRAWN = 6, 0.2
# Squared errors over the free fit's: rules in order may cost 2 % of the error; more than a tenth,
# drawn, is told; what data contradict raises it by so much.
_DEAR, _FAR, _PLAIN, _ROWS_TOLD = 1.02**2, 1.1**2, 1.01**2, 5
# Of each round half of the points are the worst, and half are spread over the others.
_SAMPLE, _POINTS_A_ROUND = 2048, 40
# That data which keep the constraints are said to contradict them.
_CHANCE = 1e-3
# Of all slopes of the free fit by an input, the part of wrong sign that no shape of rules explains.
_MUCH = 0.25
# Inputs up to which a sample has all corners of the range.
_CORNERS = 8


@dataclass(frozen=True, eq=False)
class Kept:
    """Consequents that keep all constraints, for certain."""

    free: Evaluation  # the best at the same premises
    evaluation: Evaluation
    coefficients: np.ndarray  # in the user's units
    known: tuple  # what is met with equality, as ``Posterior.given`` takes it
    drawn: float = 0.0


def constrained(
    model: TSKModel, evaluation, problem, constraints: Constraints, in_user_units, rows
):
    """The consequents next to those of an evaluation that keep all constraints; and a report.

    ``model`` is in the user's units, ``in_user_units`` brings coefficients on [1, z] to them;
    ``rows`` are X, y and their numbers, to say which contradict what is known, or None. Where
    rules in order cost too little to matter, they are the answer; else what is nearest and proven;
    else what is nearest of those. One width for all terms of an input may be what it takes.
    """
    exchange = _Exchange(model, problem, constraints, in_user_units)
    before = evaluation.mean_squared_error
    kept, free = exchange.in_order(evaluation), evaluation
    if kept is None or kept.evaluation.mean_squared_error > _DEAR * before:
        inputs = np.flatnonzero(constraints.signs.any(axis=0))
        equal = problem.evaluate(with_equal_widths(free.antecedent, inputs).parameters)
        other = exchange.in_order(equal)
        if other and _nearer(kept, other) is other:
            kept, free = other, equal
    ordered = kept
    if kept is None or kept.evaluation.mean_squared_error > _DEAR * before:
        kept = _nearer(kept, exchange.nearest(free, kept))
    exchange.warn_of_contradictions(evaluation, kept, rows)
    after = kept.evaluation.mean_squared_error
    report = {
        "certified": True,
        "drawn": kept.drawn,
        "boxes": exchange.n_boxes,
        "loss_before": float(before),
        "loss_after": float(after),
    }
    if kept.drawn and after > _FAR * before:
        names = ", ".join(one.name for one in exchange.inequalities)
        is_tree = isinstance(model.antecedent, TreeAntecedent)
        remedy = "a smaller max_rules" if is_tree else "partition='tree'"
        warn_user(
            f"To be certain of {names}, the rules were drawn {kept.drawn:.0%} of the way to "
            f"{'rules in order' if ordered else 'one line'}, which raises the error of training by "
            f"{np.sqrt(after / before) - 1.0:.0%}. Use {remedy}, or leave a constraint out.",
            ConstraintWarning,
        )
    return kept, report


def _nearer(one, other):
    """Of two, either of which may be None, the one of the smaller error."""
    found = [kept for kept in (one, other) if kept is not None]
    return min(found, key=lambda kept: kept.evaluation.mean_squared_error, default=None)


class _Exchange:
    def __init__(self, model, problem, constraints, in_user_units):
        self.problem, self.in_user_units, self.n_boxes = problem, in_user_units, 0
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self.model = replace(model.with_out_of_bounds("clip"), target=None)
        free = replace(model, target=None)
        self.points = HeldPoints(free, problem, constraints, _FIRST_MARGIN)
        self.inequalities = self.points.inequalities
        self.budget = int(_MOST_BOXES * min(1.0, _TERMS / max(model.antecedent.n_terms, 1)))
        self.is_known = all(is_known(group.family) for group in model.antecedent.groups)

    @cached_property
    def sample(self):
        """Points at which violations are sought first."""
        spread = spread_points(self.model.minimum, self.model.maximum, _SAMPLE, _CORNERS)
        # A row that is there twice is asked about once.
        return np.unique(np.vstack([spread, self.some_rows]), axis=0)

    @property
    def some_rows(self):
        """Rows of training."""
        rows = self.problem.rows.sample or self.problem.rows
        return rows.X[:: max(rows.n_rows // _SAMPLE, 1)]

    def in_order(self, evaluation, is_line=False):
        """The nearest consequents of rules in order; None where there is no such order, or none."""
        constraints, problem = self.points.constraints, self.problem
        equal, equal_to = self.points.equalities(evaluation.antecedent)
        local, met = evaluation.normal.coefficients.copy(), []
        for k, signs in enumerate(constraints.signs):
            limits = constraints.lower[k], constraints.upper[k]
            wanted = 0 * signs if is_line else signs
            box, slopes = problem.rows.inputs.box, problem.consequent_inputs
            order = RuleOrder.of(evaluation.antecedent, wanted, limits, box[0], box[1], slopes)
            if order is None:
                return None
            order = replace(order, signs=signs[slopes])
            try:
                local[:, k], rows = held_by_order(
                    order, evaluation, problem, k, equal, equal_to[:, k], is_line=is_line
                )
            except InfeasibleError:
                return None
            met.append(rows)
        model = self._model(evaluation, local)
        if is_line:
            mean = model.coefficients.mean(axis=0)
            model = replace(model, coefficients=np.broadcast_to(mean, model.coefficients.shape))
        for k, signs in enumerate(constraints.signs):
            limits = constraints.lower[k], constraints.upper[k]
            order, *ends = order_of(model, 0 * signs if is_line else signs, limits)
            order = replace(order, signs=signs[: len(ends[0])])
            if not order.holds(model.coefficients[:, :, k], *ends):
                return None
        scale = np.append(1.0, problem.rows.inputs.scale[problem.consequent_inputs])
        points = self.points.known_points()
        known = tuple(
            [*points, (rows * scale).reshape(len(rows), problem.n_columns).T] for rows in met
        )
        return Kept(evaluation, self._ended(evaluation, local), model.coefficients, known)

    def nearest(self, evaluation, ordered):
        """The nearest that is proven, or what is drawn as far as it can be."""
        try:
            solved, is_proven = self.proven(evaluation)
        except InfeasibleConstraintsError:
            if ordered is None:
                raise
            return ordered
        if is_proven:
            return self._kept(evaluation, solved, solved.local)
        return self._drawn(evaluation, solved, ordered)

    def _kept(self, evaluation, solved, local, drawn=0.0):
        """What is proven as it is."""
        coefficients = self._model(evaluation, local).coefficients
        return Kept(evaluation, self._ended(evaluation, local), coefficients, solved.known, drawn)

    def _drawn(self, evaluation, solved, ordered):
        """Between what is found and rules in order, or one line, as near as can be proven."""
        end = ordered or self.in_order(evaluation, is_line=True)
        if end is None:
            self._refuse([True] * len(self.inequalities))
        drawn, at = 1.0, replace(end, drawn=1.0)
        for step in 0.5 ** np.arange(1, 1 + _HALVINGS) if self.is_known else ():
            way = end.evaluation.normal.coefficients - solved.local
            local = solved.local + (drawn - step) * way
            self.most_boxes = self.n_boxes + int(_PART_OF_DRAWN * self.budget)
            worst, is_undecided = self._prove(self._model(evaluation, local))
            if not is_undecided and not any(map(len, worst)):
                drawn -= step
                at = self._kept(evaluation, solved, local, drawn)
        return at

    def _ended(self, evaluation, local):
        """The evaluation with other local consequents."""
        normal = evaluation.normal
        cost = evaluation.cost + float(paid_for(local, normal).sum())
        error = 2.0 * cost - float(np.sum(local * (normal.penalty @ local)))
        return replace(
            evaluation,
            cost=cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=max(error, 0.0),
            normal=replace(normal, coefficients=local),
        )

    def on_sample(self, evaluation):
        """Consequents without a violation in the sample."""
        for _ in range(_MOST_ROUNDS):
            solved = self._solve(evaluation)
            model = self._model(evaluation, solved.local)
            worst = [self._violations(one, model) for one in self.inequalities]
            if not self._add(worst):
                return solved
        return self._refuse(map(len, worst))

    def proven(self, evaluation):
        """Consequents without a violation, and whether that is proven."""
        self.most_boxes = self.budget
        while self.points.margin <= _LAST_MARGIN and self.n_boxes < self.most_boxes:
            for _ in range(_ROUNDS_A_MARGIN):
                solved = self.on_sample(evaluation)
                if not self.is_known:
                    return solved, False
                worst, is_undecided = self._prove(self._model(evaluation, solved.local))
                if not self._add(worst):
                    if not is_undecided:
                        return solved, True
                    break
            # With more of a margin there is less to find, and boxes are decided sooner.
            self.points.margin *= _RAISE
        # A margin that does not help is not paid for.
        self.points.margin = _FIRST_MARGIN
        return self.on_sample(evaluation), False

    def warn_of_contradictions(self, evaluation, kept, rows):
        """Warn where less than one fit in a thousand to such data would have to give up so much.

        Rules in order give up more than they must: it is the nearest consequents that count.
        """
        posterior, before = self.model.posterior, evaluation.mean_squared_error
        if posterior is None or kept.evaluation.mean_squared_error <= _PLAIN * before:
            return
        try:
            solved = self.on_sample(evaluation)
        except InfeasibleConstraintsError:
            return
        after = self._ended(evaluation, solved.local).mean_squared_error
        if after <= _PLAIN * before:
            return
        # What is paid is half a Mahalanobis distance, over sigma^2 / n, in the posterior.
        n_rows, scale = self.problem.rows.total_weight, self.problem.rows.targets.scale
        free, held = (
            self._model(evaluation, local)
            for local in (evaluation.normal.coefficients, solved.local)
        )
        for k, name in enumerate(self.model.output_names):
            guilty = [
                (one.name, active)
                for one, active in zip(self.inequalities, solved.active, strict=True)
                if one.output == k and active and (one.input is None or self._bends(one, free))
            ]
            if not guilty:
                continue
            noise = max(posterior.noise[k] / scale[k], np.sqrt(np.finfo(float).eps))
            count = sum(active for _, active in guilty) + len(self.points.constraints.points)
            if 2.0 * n_rows * solved.paid[k] / noise**2 > chdtri(count, _CHANCE):
                names = " and ".join(name for name, _ in guilty)
                warn_user(
                    f"The data contradict {names}: kept, it raises the mean squared error of "
                    f"training from {before:.3g} to {after:.3g} of the variance of {name!r}, far "
                    f"more than noise would{_against(rows, k, free, held)}. Leave the "
                    "constraint out, or look at the data.",
                    ConstraintWarning,
                )

    def _bends(self, one, free):
        """Whether much of what the free fit does with an input is against its sign."""
        slopes = one.sign * free.gradient(self.some_rows)[:, one.input, one.output]
        return np.maximum(-slopes, 0.0).sum() > _MUCH * np.abs(slopes).sum()

    def _add(self, worst):
        """Hold the inequalities at more points each; whether there were any."""
        for place, points in enumerate(worst):
            self.points.hold(place, points)
        return any(map(len, worst))

    def _solve(self, evaluation):
        """The nearest consequents, or an error that says which constraints cannot be kept."""
        try:
            return self.points.solve(evaluation)
        except InfeasibleError as error:
            failure = error
        if failure.by_equalities:
            n_points = len(self.points.constraints.points)
            raise InfeasibleConstraintsError(
                f"constraints fixes {self.model.output_names[failure.output]!r} at {n_points} "
                f"points, which {self.model.n_rules} rules cannot all meet: two are the same, or "
                "there are more than consequents. Give fewer points, or use more rules."
            )
        return self._refuse([one.output == failure.output for one in self.inequalities])

    def _refuse(self, is_guilty):
        """Raise an error; ``is_guilty`` has, of every inequality, whether it is not kept."""
        pairs = zip(self.inequalities, is_guilty, strict=True)
        names = " and ".join(one.name for one, guilty in pairs if guilty)
        n_points = len(self.points.constraints.points)
        with_points = f", with the {n_points} fixed points of constraints," if n_points else ""
        raise InfeasibleConstraintsError(
            f"No consequents of these {self.model.n_rules} rules keep {names}{with_points} all at "
            "once. Drop one of them, or use order=1 or more rules."
        )

    def _model(self, evaluation, local):
        inputs = self.problem.rows.inputs
        return replace(
            self.model,
            antecedent=evaluation.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=self.in_user_units(self.problem.local.to_global(local)),
        )

    def _violations(self, inequality, model):
        """Points of the sample at which an inequality is violated, the worst and some others."""
        # A slope over a small step has so many digits, no more.
        least = 1e-9 * self.problem.rows.targets.scale[inequality.output]
        if inequality.input is None:
            values = model.predict(self.sample)[:, inequality.output]
            return _worst(self.sample, inequality.sign * (inequality.limit - values), least)
        before, after, step = self.points.steps(self.sample, inequality.input)
        change = (model.predict(after) - model.predict(before))[:, inequality.output]
        falls = (-inequality.sign * change / step).reshape(-1, 2).max(axis=1)
        return _worst(self.sample, falls, least / model.spread[inequality.input])

    def _prove(self, model):
        """Points of violation of every inequality, and whether a proof ran out of boxes."""
        worst, is_undecided = [], False
        for one in self.inequalities:
            told = model.coefficients[:, :, one.output]
            if one.input is not None and not told[:, 1:].any() and not np.ptp(told[:, 0]):
                # Slopes of a constant are nothing but rounding, which no bound is below.
                worst.append(self.sample[:0])
                continue
            enclosure = Enclosure(model, one.output, -one.sign)
            bound_of = enclosure.values
            if one.input is not None:
                bound_of = partial(enclosure.slope, j=one.input)
            until = -one.sign * one.limit
            seen: list[tuple] = []

            def evaluate(low, high, bound_of=bound_of, seen=seen):
                seen.append(bound_of(low, high))
                return seen[-1]

            low, high = model.minimum, model.maximum
            left = max(self.most_boxes - self.n_boxes, 1)
            found = largest(evaluate, low, high, 0.0, left, cuts_of(model), until=until)
            self.n_boxes += found.n_boxes
            places = np.hstack([one[1] for one in seen]).T
            worst.append(_worst(places, np.concatenate([one[2] for one in seen]), until))
            is_undecided |= found.bound > until and not len(worst[-1])
        return worst, is_undecided


def _against(rows, k, free, held):
    """Rows whose errors constraints raise the most, as the end of a sentence."""
    if rows is None:
        return ""
    X, y, numbers = rows
    before, after = ((y[:, k] - model.predict(X)[:, k]) ** 2 for model in (free, held))
    worst = np.sort(numbers[np.argsort(before - after)[:_ROWS_TOLD]])
    return f"; rows {', '.join(map(str, worst))} speak most against it"


def _worst(points, excess, above):
    """Of points with an excess above some number the worst, and some others."""
    bad = np.flatnonzero(excess > above)
    worst = bad[np.argsort(-excess[bad], kind="stable")]
    half = _POINTS_A_ROUND // 2
    others = worst[half:][:: max((worst.size - half) // half, 1)][:half]
    return points[np.concatenate([worst[:half], others])]
