r"""What predictions, slopes and their bounds can be off by, as computed.

With delta_r the error of log w_r, R rules and n inputs, and eps twice the unit roundoff,

    |error of g| <= 2 sum_r w_r delta_r |f_r - phi|  +  N eps max_r F_r ,

    F_r = |a_r| + sum_j |b_rj| (|x_j| + |x0_j|) ,    N = 32 + R + n :

an error of the strengths moves f_r against the mean, for their sum is one; sums of R and n
numbers lose R + n roundings at the most of what is summed. Slopes of strengths are differences
of two sums of the size of sum_r w_r |a_rj| max F, where a is the slope of log w; they inherit
delta too.
"""

import numpy as np

from .intervals import size
from .terms import EPS

__all__ = ["Rounding"]

# Roundings of a rule's output and its strength, in EPS, with room to spare: as in ``enclosure``,
# beside those of the sums over rules and inputs, which are counted.
_ROUNDINGS = 32.0


class Rounding:
    """Of one batch of boxes: what values and slopes are off by, at the most."""

    def __init__(self, enclosure, parts, near, far):
        model = enclosure.model
        far_off = size((near, far)) + np.abs(model.reference)[:, None]
        terms = np.abs(enclosure.height) + np.abs(enclosure.slopes) @ far_off
        self.largest = terms.max(axis=0)
        self.steepest = np.abs(enclosure.slopes).max(axis=0)[:, None]
        self.part = EPS * (_ROUNDINGS + model.n_rules + model.n_inputs)
        self.departure = parts.departure
        self.strength = np.ones(parts.middle.shape)
        for place, one in enumerate(parts.shares):
            self.strength = self.strength * enclosure.placed(one.high, place)
        self.axes = tuple(range(parts.middle.ndim - 1))
        # What the errors of the strengths move the output by, rule by rule.
        self.moved = np.zeros(parts.middle.shape)
        for place, one in enumerate(parts.shares):
            error = enclosure.placed(np.fmin(one.error, 1.0), place)
            off = size(enclosure.centred(parts, place))
            self.moved = self.moved + 2.0 * self.strength * error * off

    def of_slopes(self):
        """(n_inputs, n_boxes)."""
        slack = self.part * np.broadcast_to(self.steepest, (self.steepest.size, self.largest.size))
        slack = slack.copy()
        for j, ends in self.departure.items():
            by_rule = self.strength * size(ends)
            slack[j] += self.part * by_rule.sum(axis=self.axes) * self.largest
            slack[j] += 2.0 * (size(ends) * self.moved).sum(axis=self.axes)
        return slack

    def of_values(self, way):
        """(n_boxes,), the way beyond the range included."""
        ahead = np.maximum(np.abs(way[0]), np.abs(way[1]))
        slack = self.moved.sum(axis=self.axes) + self.part * self.largest
        return slack + np.where(ahead > 0.0, ahead * self.of_slopes(), 0.0).sum(axis=0)
