"""The consequents nearest to those of a free fit that provably keep all constraints.

The premises are those of one fit. First come the nearest consequents that keep the constraints at
points where the free fit breaks them: they keep them nearly everywhere. Then a bisection on the
line from these, 0, to rules in order, 1, finds the nearest that branch and bound can prove.
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
# Halvings of the line; most boxes of a proof, and of all proofs before the line is halved; number
# of terms beyond which both are fewer, because boxes then take longer.
_HALVINGS, _MOST_BOXES, _ALL_BOXES, _TERMS = 6, 3000, 10_000, 20
# Number of points that are added at once, the worst of a sample; and the margin that is kept at
# them, in standard deviations of the target, and of the input.
_POINTS_A_ROUND, _MARGIN = 20, 0.01


class Consequents:
    """A free fit with other consequents: their model, their error, and proofs of the constraints.

    ``model`` is in the user's units. ``free`` is the evaluation of the free fit, if possible at
    premises for which an order of the rules is known.
    """

    def __init__(self, model, free, problem, constraints):
        self.problem, self.free, self.constraints = problem, free, constraints
        # Holding outputs within limits is monotone: a constraint that the rules keep still holds.
        self._base = replace(model, target=None)
        self.inequalities = constraints.inequalities(model)
        # A model whose outputs are the parts of each local consequent in the standardised target.
        each = np.eye(problem.n_columns)
        self.columns = self._model(each, unit_scale(each))
        # E and e of the fixed points, for the local consequents.
        targets = problem.rows.targets
        values = (constraints.values - targets.offset) / targets.scale
        self.fixed = self.columns.predict(constraints.points), values
        # Boxes of all proofs so far, and the most of a proof and of all.
        part = min(1.0, _TERMS / max(free.antecedent.n_terms, 1))
        self._n_boxes, self._most, self._most_of_all = 0, int(part * _MOST_BOXES), part * _ALL_BOXES

    def model(self, local, is_line=False):
        """The model with these consequents; if ``is_line``, its rules are equal to the last bit."""
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
        """Whether the order of the rules proves all constraints, and fixed points are met."""
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
        """The nearest proven local consequents, and how far they are on the line to ``ordered``."""
        if not {one.family for one in self.free.antecedent.groups} <= {*FAMILIES.values()}:
            return ordered, 1.0
        near = self._nearest_at_points(ordered)
        if self._is_proven(near):
            return near, 0.0
        local, drawn, least = ordered, 1.0, 0.5**_HALVINGS
        # First the least step back: if its proof fails, those of larger steps will too.
        for step in (least, *(0.5**k for k in range(1, _HALVINGS))):
            now = near + (drawn - step) * (ordered - near)
            if self._is_proven(now):
                local, drawn = now, drawn - step
            elif step == least:
                break
        return local, drawn

    def _nearest_at_points(self, ordered):
        """The local consequents nearest to the free fit that keep the constraints at some points.

        Points are the worst of a sample, then those at which branch and bound finds a violation.
        """
        normal, (equal, equal_to) = self.free.normal, self.fixed
        # Each input has a spacing of its own. Sorting the inputs by their ranges makes the points
        # independent of the order of the columns.
        order = np.lexsort(self.problem.rows.inputs.box)
        low, high = self.columns.minimum, self.columns.maximum
        sample = spread_points(low[order], high[order])[:, np.argsort(order)]
        # An output keeps the consequents in order if no others even meet the fixed points.
        local = ordered.copy()
        nothing = np.empty((0, self.problem.n_columns)), np.empty(0)

        def violated(u, k):
            local[:, k] = u
            now = self.model(local)
            own = [one for one in self.inequalities if one.output == k]
            worst = [_worst(one.excess(now, sample), sample) for one in own]
            if not any(map(len, worst)) and self._n_boxes <= self._most_of_all:
                worst = [self._failure(one, now) for one in own]
            pairs = zip(own, worst, strict=True)
            rows = [nothing, *(self._rows(one, points) for one, points in pairs)]
            return tuple(map(np.concatenate, zip(*rows, strict=True)))

        for k, values in enumerate(equal_to.T):
            given = normal.factor, normal.coefficients[:, k], equal, values, *nothing
            # If the exchange does not end, its last consequents are as good a start of the line.
            with suppress(InfeasibleError):
                local[:, k] = nearest_by_exchange(*given, partial(violated, k=k))
        return local

    def _rows(self, one, points):
        """Rows of G and entries of h, G u >= h, of an inequality at points."""
        rows, found = self.problem.rows, one.of(self.columns, points)
        if one.input is None:
            targets = rows.targets
            least = one.sign * (one.limit - targets.offset[one.output]) / targets.scale[one.output]
            return found, np.full(len(points), least + _MARGIN)
        found = found * rows.inputs.scale[one.input]
        # Ask for less margin where no consequents have much of a slope.
        return found, _MARGIN * np.minimum(np.abs(found).sum(axis=1), 1.0)

    def _proof(self, one, model):
        """What branch and bound finds for an inequality, and the largest bound that proves it."""
        bound_of = Enclosure(model, one.output, -one.sign).evaluate(one.input)
        until, ends = -one.sign * one.limit, (model.minimum, model.maximum)
        cuts = training_box(model)
        found = largest(bound_of, *ends, 0.0, self._most, cuts, until=until)
        self._n_boxes += found.n_boxes
        return found, until

    def _is_proven(self, local):
        model = self.model(local)
        proofs = (self._proof(one, model) for one in self.inequalities)
        return self.meets_points(model) and all(one.bound <= until for one, until in proofs)

    def _failure(self, one, model):
        """The point at which branch and bound finds a violation, (1, n_inputs), or no point."""
        found, until = self._proof(one, model)
        return found.point[None][: int(found.attained > until)]


def _worst(excess, points):
    """The points with the largest positive excess, worst first, up to ``_POINTS_A_ROUND``."""
    order = np.argsort(-excess)[:_POINTS_A_ROUND]
    return points[order[excess[order] > 0.0]]
