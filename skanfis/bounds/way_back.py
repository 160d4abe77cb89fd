"""From rules in order back towards the free fit, as far as branch and bound proves all constraints.

The consequents nearest to the free fit that keep the constraints at the points where they did not
are easily found, and keep them nearly everywhere. On the straight way from these, 0, to those in
order, 1, the nearest are sought of which it can be proven.
"""

from contextlib import suppress
from functools import partial

import numpy as np

from .certified import spread_points, training_box
from .consequents import Consequents
from .enclosure import Enclosure
from .quadratic_program import InfeasibleError, nearest_by_exchange
from .search import largest
from .terms import is_known

# Halvings of the way; most boxes of a proof, and of all proofs before the way is halved (fewer
# where there are more terms than so many, for boxes then take longer).
_HALVINGS, _MOST_BOXES, _ALL_BOXES, _TERMS = 6, 3000, 10_000, 20
# Points that are added at once, the worst of many; and the margin that is kept at them, in standard
# deviations of the target, and of the input.
_POINTS_A_ROUND, _MARGIN = 20, 0.01


class WayBack:
    """The way back from consequents in order, those of ``found``, to near the free fit."""

    def __init__(self, found: Consequents):
        self.found, self.inequalities = found, found.inequalities
        self.n_boxes, self.part = 0, min(1.0, _TERMS / max(found.free.antecedent.n_terms, 1))

    def nearest_proven(self, ordered):
        """The nearest local consequents that are proven, and how much of the way they are."""
        if not all(is_known(group.family) for group in self.found.free.antecedent.groups):
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
        found, n_columns = self.found, self.found.problem.n_columns
        normal, (equal, equal_to) = found.free.normal, found.fixed
        sample = spread_points(found.columns.minimum, found.columns.maximum)
        # An output stays in order where not even the fixed points can be met otherwise.
        local = ordered.copy()
        nothing = np.empty((0, n_columns)), np.empty(0)

        def violated(u, k):
            local[:, k] = u
            now = found.model(local)
            own = [one for one in self.inequalities if one.output == k]
            worst = [_worst(one.excess(now, sample), sample) for one in own]
            if not any(map(len, worst)) and self.n_boxes <= _ALL_BOXES * self.part:
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
        rows, found = self.found.problem.rows, one.of(self.found.columns, points)
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

    def _is_proven(self, local):
        model = self.found.model(local)
        proofs = (self._proof(one, model) for one in self.inequalities)
        return self.found.meets_points(model) and all(one.bound <= until for one, until in proofs)

    def _failure(self, one, model):
        """The point where branch and bound finds that an inequality fails, if it does."""
        found, until = self._proof(one, model)
        return found.point[None][: int(found.attained > until)]


def _worst(excess, points):
    """The points at which something is in excess, the worst of them first, and not all."""
    order = np.argsort(-excess)[:_POINTS_A_ROUND]
    return points[order[excess[order] > 0.0]]
