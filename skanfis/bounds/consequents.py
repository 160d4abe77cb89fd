"""Any local consequents at the premises of one fit, and the nearest that are proven to keep all.

Those nearest to the free fit that keep the constraints at the points where it did not are easily
found, and keep them nearly everywhere. On the straight way from these, 0, to those of
rules in order, 1, the nearest are sought of which branch and bound proves it.
"""

from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from ..consequent import in_user_units
from ..membership import FAMILIES
from ..search.sample import unit_scale
from .certified import spread_points, training_box
from .construction import is_in_order
from .enclosure import Enclosure
from .quadratic_program import InfeasibleError, nearest_by_exchange
from .search import largest

# Standard deviations of the target that rounding may leave between a fixed point and a prediction.
_OFF = 1e-8
# Halvings of the way; most boxes of a proof, and of all proofs before the way is halved (fewer
# where there are more terms than so many, for boxes then take longer).
_HALVINGS, _MOST_BOXES, _ALL_BOXES, _TERMS = 6, 3000, 10_000, 20
# Points that are added at once, the worst of many; and the margin that is kept at them, in standard
# deviations of the target, and of the input.
_POINTS_A_ROUND, _MARGIN = 20, 0.01


class Consequents:
    """What other consequents make of a free fit, and whether they keep the constraints.

    ``model`` is in the user's units; ``free`` is the evaluation of the free fit, at premises for
    which there is an order of the rules, if there is any. ``n_boxes`` are those of all proofs.
    """

    def __init__(self, model, free, problem, constraints):
        self.problem, self.free, self.constraints = problem, free, constraints
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self._base = replace(model, target=None)
        self.inequalities = constraints.inequalities(model)
        # A model with an output for each local consequent: what it adds to the standardised target.
        each = np.eye(problem.n_columns)
        self.columns = self._model(each, unit_scale(each))
        # E and e of the fixed points, for the local consequents.
        targets = problem.rows.targets
        values = (constraints.values - targets.offset) / targets.scale
        self.fixed = self.columns.predict(constraints.points), values
        self.n_boxes, self._part = 0, min(1.0, _TERMS / max(free.antecedent.n_terms, 1))

    def model(self, local, is_line=False):
        """The model; of one line for all rules, one to the last bit."""
        found = self._model(local, self.problem.rows.targets)
        if not is_line:
            return found
        line = np.broadcast_to(found.coefficients[:1], found.coefficients.shape)
        return replace(found, coefficients=line)

    def _model(self, local, targets):
        """The model for targets of this scale."""
        problem, inputs = self.problem, self.problem.rows.inputs
        design = problem.consequent_inputs, self._base.order
        common = problem.penalty.common, self._base.rule_weights
        coefficients = problem.local.to_global(local)
        return replace(
            self._base,
            antecedent=self.free.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=in_user_units(coefficients, inputs, targets, *design, *common),
            output_names=tuple(map(str, range(targets.scale.size))),
        )

    def loss(self, local):
        """The mean squared training error, of the standardised target, with these consequents."""
        normal = self.free.normal
        change, slope = local - normal.coefficients, normal.penalty @ normal.coefficients
        more = np.sum(change * (normal.gram @ change - 2.0 * slope), axis=0)
        return float(np.maximum(self.free.mean_squares + more, 0.0).sum())

    def is_certified(self, local, is_line):
        """Whether all constraints are kept, by the order of the rules."""
        model, constraints = self.model(local, is_line), self.constraints
        limits = zip(constraints.lower, constraints.upper, strict=True)
        return self.meets_points(model) and all(
            is_in_order(model, k, signs, of_output)
            for k, (signs, of_output) in enumerate(zip(constraints.signs, limits, strict=True))
        )

    def meets_points(self, model):
        """Whether a model predicts all fixed points, to rounding."""
        off = np.abs(model.predict(self.constraints.points) - self.constraints.values)
        off /= self.problem.rows.targets.scale
        return bool((off <= _OFF).all())

    def nearest_proven(self, ordered):
        """The nearest local consequents that are proven, and how much of the way they are."""
        if not {one.family for one in self.free.antecedent.groups} <= {*FAMILIES.values()}:
            return ordered, 1.0
        near = self._nearest_at_points(ordered)
        if self._is_proven(near):
            return near, 0.0
        local, drawn, least = ordered, 1.0, 0.5**_HALVINGS
        # First the least step: where that fails others will too.
        for step in (least, *(0.5**k for k in range(1, _HALVINGS))):
            now = near + (drawn - step) * (ordered - near)
            if self._is_proven(now):
                local, drawn = now, drawn - step
            elif step == least:
                break
        return local, drawn

    def _nearest_at_points(self, ordered):
        """The local consequents nearest to the free fit that keep all where they did not.

        Points are the worst of a sample, then those at which branch and bound finds a violation.
        """
        normal, (equal, equal_to) = self.free.normal, self.fixed
        # The points differ by input: their ranges and not the order of the columns decide how.
        order = np.lexsort(self.problem.rows.inputs.box)
        low, high = self.columns.minimum, self.columns.maximum
        sample = spread_points(low[order], high[order])[:, np.argsort(order)]
        # An output stays in order where not even the fixed points can be met otherwise.
        local = ordered.copy()
        nothing = np.empty((0, self.problem.n_columns)), np.empty(0)

        def violated(u, k):
            local[:, k] = u
            now = self.model(local)
            own = [one for one in self.inequalities if one.output == k]
            worst = [_worst(one.excess(now, sample), sample) for one in own]
            if not any(map(len, worst)) and self.n_boxes <= _ALL_BOXES * self._part:
                worst = [self._failure(one, now) for one in own]
            pairs = zip(own, worst, strict=True)
            rows = [nothing, *(self._rows(one, points) for one, points in pairs)]
            return tuple(map(np.concatenate, zip(*rows, strict=True)))

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
        most = int(_MOST_BOXES * self._part)
        found = largest(bound_of, *ends, 0.0, most, training_box(model), until=until)
        self.n_boxes += found.n_boxes
        return found, until

    def _is_proven(self, local):
        model = self.model(local)
        proofs = (self._proof(one, model) for one in self.inequalities)
        return self.meets_points(model) and all(one.bound <= until for one, until in proofs)

    def _failure(self, one, model):
        """The point where branch and bound finds that an inequality fails, if it does."""
        found, until = self._proof(one, model)
        return found.point[None][: int(found.attained > until)]


def _worst(excess, points):
    """The points at which something is in excess, the worst of them first, and not all."""
    order = np.argsort(-excess)[:_POINTS_A_ROUND]
    return points[order[excess[order] > 0.0]]
