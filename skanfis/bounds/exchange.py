"""Constraints held at points, and proven between them: points are added until the proof succeeds.

Constraints are held at some points, with a margin; violations are sought in a sample, then by
branch and bound, and their places added. Where a proof takes too many boxes the margin is raised.
Premises stay. The promise is of the range of the training data; docs/bounds.rst has more.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import chdtri
from sklearn.exceptions import ConvergenceWarning

from .._validation import warn_user
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..model import TSKModel
from .certified import cuts_of, spread_points
from .constraints import Constraints
from .enclosure import Enclosure
from .inequalities import HeldPoints, InfeasibleError
from .search import largest
from .terms import is_known

# Margins, in standard deviations of the target (and of the input): the first, and the last tried.
_FIRST_MARGIN, _LAST_MARGIN, _RAISE = 1e-3, 0.03, 3.0
# A bound on time: what is not proven by then is said not to be. One proof takes a second.
_MOST_ROUNDS, _MOST_BOXES = 40, 30_000
# Of each round half of the points are the worst, and half are spread over the others.
_SAMPLE, _POINTS_A_ROUND = 2048, 40
# That data which keep the constraints are said to contradict them.
_CHANCE = 1e-3
# Inputs up to which a sample has all corners of the range.
_CORNERS = 8


def constrained(model: TSKModel, evaluation, problem, constraints: Constraints, in_user_units):
    """The consequents nearest to those of an evaluation that keep all constraints.

    ``model`` is in the user's units, ``in_user_units`` brings coefficients on [1, z] to them. Gives
    the evaluation with its new coefficients, a report (a dict), and a :class:`Solved`.
    """
    exchange = _Exchange(model, problem, constraints, in_user_units)
    solved, is_proven = exchange.proven(evaluation)
    if not is_proven:
        # A margin that does not help is not paid for.
        exchange.points.margin = _FIRST_MARGIN
        solved = exchange.on_sample(evaluation)
        names = ", ".join(one.name for one in exchange.inequalities)
        why = "" if exchange.is_known else ": the ranges of its memberships are not known"
        warn_user(
            f"Not proven to hold everywhere{why}: {names}. It holds on the training data and a "
            f"sample of {_SAMPLE} points. Use fewer rules, or Gaussian terms.",
            ConvergenceWarning,
        )
    normal, local = evaluation.normal, solved.local
    error = 2.0 * solved.cost - float(np.sum(local * (normal.penalty @ local)))
    ended = replace(
        evaluation,
        cost=solved.cost,
        coefficients=problem.local.to_global(local),
        mean_squared_error=max(error, 0.0),
        normal=replace(normal, coefficients=local),
    )
    exchange.warn_of_contradictions(evaluation, solved, ended)
    report = {
        "certified": is_proven,
        "margin": exchange.points.margin,
        "rows": sum(map(len, exchange.points.after)),
        "boxes": exchange.n_boxes,
        "loss_before": float(evaluation.mean_squared_error),
        "loss_after": float(ended.mean_squared_error),
    }
    return ended, report, solved


class _Exchange:
    def __init__(self, model, problem, constraints, in_user_units):
        self.problem, self.in_user_units, self.n_boxes = problem, in_user_units, 0
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self.model = replace(model.with_out_of_bounds("clip"), target=None)
        free = replace(model, target=None)
        self.points = HeldPoints(free, problem, constraints, _FIRST_MARGIN)
        self.inequalities = self.points.inequalities
        self.is_known = all(is_known(group.family) for group in model.antecedent.groups)
        rows = problem.rows.sample or problem.rows
        spread = spread_points(model.minimum, model.maximum, _SAMPLE, _CORNERS)
        parts = [spread, rows.X[:: max(rows.n_rows // _SAMPLE, 1)]]
        # A row that is there twice is asked about once.
        self.sample = np.unique(np.vstack(parts), axis=0)

    def on_sample(self, evaluation):
        """Consequents without a violation in the sample."""
        for _ in range(_MOST_ROUNDS):
            solved = self._solve(evaluation)
            model = self._model(evaluation, solved)
            worst = [self._violations(one, model) for one in self.inequalities]
            if not self._add(worst):
                return solved
        return self._refuse(map(len, worst))

    def proven(self, evaluation):
        """Consequents without a violation, and whether that is proven."""
        for _ in range(_MOST_ROUNDS):
            solved = self.on_sample(evaluation)
            if not self.is_known:
                return solved, False
            worst, is_undecided = self._prove(self._model(evaluation, solved))
            if self._add(worst):
                continue
            if not is_undecided:
                return solved, True
            if self.points.margin * _RAISE > _LAST_MARGIN:
                return solved, False
            self.points.margin *= _RAISE
        return self._solve(evaluation), False

    def warn_of_contradictions(self, evaluation, solved, ended):
        """Warn where less than one fit in a thousand to such data would have to give up so much."""
        # What is paid is half a Mahalanobis distance, over sigma^2 / n, in the posterior.
        n_rows, scale = self.problem.rows.total_weight, self.problem.rows.targets.scale
        posterior = self.model.posterior
        for k, name in enumerate(self.model.output_names):
            guilty = [
                (one.name, active)
                for one, active in zip(self.inequalities, solved.active, strict=True)
                if one.output == k and active
            ]
            if posterior is None or not guilty:
                continue
            noise = max(posterior.noise[k] / scale[k], np.sqrt(np.finfo(float).eps))
            count = sum(active for _, active in guilty) + len(self.points.constraints.points)
            if 2.0 * n_rows * solved.paid[k] / noise**2 > chdtri(count, _CHANCE):
                names = " and ".join(name for name, _ in guilty)
                before, after = evaluation.mean_squared_error, ended.mean_squared_error
                warn_user(
                    f"The data contradict {names}: kept, it raises the mean squared error of "
                    f"training from {before:.3g} to {after:.3g} of the variance of {name!r}, far "
                    "more than noise would. Leave the constraint out, or look at the data.",
                    ConstraintWarning,
                )

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

    def _model(self, evaluation, solved):
        inputs = self.problem.rows.inputs
        return replace(
            self.model,
            antecedent=evaluation.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=self.in_user_units(self.problem.local.to_global(solved.local)),
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
            found = largest(evaluate, low, high, 0.0, _MOST_BOXES, cuts_of(model), until=until)
            self.n_boxes += found.n_boxes
            places = np.hstack([one[1] for one in seen]).T
            worst.append(_worst(places, np.concatenate([one[2] for one in seen]), until))
            is_undecided |= found.bound > until and not len(worst[-1])
        return worst, is_undecided


def _worst(points, excess, above):
    """Of points with an excess above some number the worst, and some others."""
    bad = np.flatnonzero(excess > above)
    worst = bad[np.argsort(-excess[bad], kind="stable")]
    half = _POINTS_A_ROUND // 2
    others = worst[half:][:: max((worst.size - half) // half, 1)][:half]
    return points[np.concatenate([worst[:half], others])]
