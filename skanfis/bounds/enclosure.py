r"""What a model's output, and its slopes, can be on a box.

With w the normalised strengths, f_r the consequents, b_rj and a_rj the slopes of f_r and of rule
r's log-strength along input j, and D_rj = a_rj - sum_s w_s a_sj,

    g = E f ,    d g / dx_j = E [ b_j + D_j (f - phi) ] ,

    d^2 g / dx_i dx_j = E [ D_i b_j + D_j b_i + (D_i D_j + [i = j] c_j) (f - g) ] ,

with c_rj the second derivative of rule r's log-strength along j,
where E is the mean over rules with weights w and phi any function of x that is the same for all
rules, because E D_j = 0: the line that they have in common is taken. Of a grid it may even differ
with the terms on all other inputs. All of it is enclosed by intervals of f - phi and D and the
means of ``shares``. Out of the training data, with c the
nearest point of their box and h the way followed beyond it (see ``model``), the prediction is

    P = g(c) + sum_j h_j dg/dx_j(c) = E [ f + sum_j h_j (b_j + D_j (f - phi)) ] ,

    dP/dx_i = dg/dx_i + sum over j != i of h_j d^2 g / dx_i dx_j    where x_i is in its range,
            = dg/dx_i where it is beyond, as far as the tangent is followed, and 0 from there on.

c and h are monotone in x, each in its own input: on a box they are intervals. The prediction then
lies below its mean above, and, by the mean value theorem, below

    P(p) + sum_j max over x_j of (dP/dx_j) (x_j - p_j)

for any p in the box; the p taken is that of the least bound (Baumann 1988), a corner where P is
monotone. P is piecewise smooth: a slope is the hull of those from all sides.

Bounds are of what is computed: to each is added what computing it, and computing the prediction,
can be off by. With delta_r the error of log w_r, R rules and n inputs, that is of g at the most

    2 sum_r w_r delta_r |f_r - phi|  +  (32 + R + n) eps max_r F_r ,

    F_r = |a_r| + sum_j |b_rj| (|x_j| + |x0_j|) ,

for an error of the strengths moves f_r against the mean.
"""

from dataclasses import dataclass, field, replace
from math import prod

import numpy as np

from ..model import TSKModel
from ..policies import FARTHEST_ROW
from .arithmetic import EPS, ROUNDINGS, product, size, square
from .shares import Shares, enclosed, factors, largest_mean, smallest_mean, term_ranges

__all__ = ["Enclosure", "reach_of"]


def reach_of(model):
    """How far predictions change beyond the range of each input, (n_inputs,)."""
    if model.out_of_bounds != "linear" or model.max_extrapolation == 0.0:
        return np.zeros(model.n_inputs)
    return min(model.max_extrapolation, FARTHEST_ROW) * model.spread


@dataclass(frozen=True, eq=False)
class _Parts:
    """What one batch of boxes is made of."""

    shares: list[Shares]
    value: tuple[np.ndarray, np.ndarray]  # range of f, of shape (*counts, n_boxes)
    middle: np.ndarray  # f at the middle of the box, likewise
    half: np.ndarray  # half the widths of the boxes in the range, (n_inputs, n_boxes)
    departure: dict[int, tuple[np.ndarray, np.ndarray]]  # of D, broadcast to the shape of f
    curvature: dict[int, tuple[np.ndarray, np.ndarray]]  # of d^2 log w / dx_j^2, likewise
    way: tuple[np.ndarray, np.ndarray]  # of h, (n_inputs, n_boxes)
    slack: np.ndarray | None = None  # (n_boxes,), what values are off by
    slope_slack: np.ndarray | None = None  # (n_inputs, n_boxes)
    known: dict = field(default_factory=dict)  # what ``centred`` has found


class Enclosure:
    """Upper bounds of one output, or of its negative with sign -1, over batches of boxes."""

    def __init__(self, model: TSKModel, output: int, sign: float):
        self.model, self.output, self.sign = model, output, sign
        self.factors = factors(model.antecedent)
        self.counts = model.antecedent.share_counts if self.factors else (1,)
        coefficients = sign * model.coefficients[:, :, output]
        self.height = coefficients[:, :1]
        self.slopes = np.zeros((model.n_rules, model.n_inputs))
        self.slopes[:, : coefficients.shape[1] - 1] = coefficients[:, 1:]
        self.place = {j: place for place, one in enumerate(self.factors) for j in one.terms}
        self.reach = reach_of(model)
        answers = model.out_of_bounds in ("clip", "linear")
        answering = model if answers else model.with_out_of_bounds("clip")
        # What the rules say is enclosed; that outputs are held comes last, being monotone.
        self.rules = replace(answering, target=None)
        self.lowest, self.highest = np.sort(sign * model.output_limits[:, output])

    def predict(self, X):
        """Sign times the output of rows (n_rows, n_inputs)."""
        return self.hold(self.say(X))

    def say(self, X):
        """The same before it is held."""
        return self.sign * self.rules.predict(X)[:, self.output]

    def hold(self, values):
        """Values, or bounds of them, within the limits that outputs are held in."""
        return np.clip(values, self.lowest, self.highest)

    def values(self, low, high):
        """Bounds of the output on boxes (n_inputs, n_boxes) that nothing in them is above.

        Then a point in each, (n_inputs, n_boxes), the output there, and what splitting the box
        along each input promises, (n_inputs, n_boxes).
        """
        with np.errstate(all="ignore"):
            parts = self._parts(low, high)
            natural = largest_mean(self._continued(parts), parts.shares) + parts.slack
            down, up = self._slopes(parts, low, high, range(low.shape[0]))
            points = _best_centres(down, up, low, high)
            attained = self.say(points.T)
            rise = np.maximum(np.maximum(up * (high - points), down * (low - points)), 0.0)
            rounded_up = 1.0 + EPS * (ROUNDINGS + low.shape[0])
            by_slopes = attained + rise.sum(axis=0) * rounded_up + 2.0 * parts.slack
            bound = np.fmin(np.where(np.isnan(natural), np.inf, natural), by_slopes)
            gain = (up - down) * (high - low)
        return self.hold(bound), points, self.hold(attained), gain

    def slope(self, low, high, j):
        """Bounds of dP/dx_j on boxes; what is returned is as of :meth:`values`.

        What is attained is so at the boxes' middles, in the limit where a slope jumps there.
        """
        with np.errstate(all="ignore"):
            parts = self._parts(low, high)
            natural = self._slopes(parts, low, high, [j])[1][0]
            bends = [self._mixed(parts, i, j) for i in range(len(low))]
            down, up = np.stack([b[0] for b in bends]), np.stack([b[1] for b in bends])
            points = _best_centres(down, up, low, high)
            least, most = self._slopes(self._parts(points, points), points, points, [j])
            rise = np.maximum(np.maximum(up * (high - points), down * (low - points)), 0.0)
            by_bends = most[0] + rise.sum(axis=0) * (1.0 + EPS * (ROUNDINGS + low.shape[0]))
            # Beyond the range the tangent's own slope changes by what is not enclosed here.
            inside = (low >= self.model.minimum[:, None]) & (high <= self.model.maximum[:, None])
            by_bends = np.where(inside.all(axis=0), by_bends, np.inf)
            gain = np.where(np.isfinite(by_bends), up - down, self._gain_of_slope(parts, j))
            bound = np.fmin(natural, by_bends)
            # Where the output may be held its slope may be zero.
            bound = np.where(self._may_be_held(parts), np.maximum(bound, 0.0), bound)
            said = self.say(points.T)
            attained = np.where(said == self.hold(said), least[0], 0.0)
        return bound, points, attained, gain * (high - low)

    def _may_be_held(self, parts):
        """Where what the rules say may pass the limits, (n_boxes,)."""
        if np.isinf([self.lowest, self.highest]).all():
            return np.zeros(parts.slack.size, dtype=bool)
        most = largest_mean(self._continued(parts), parts.shares) + parts.slack
        least = smallest_mean(self._continued(parts, end=0), parts.shares) - parts.slack
        return ~((most <= self.highest) & (least >= self.lowest))

    def _gain_of_slope(self, parts, j):
        """About how much of the range of dP/dx_j goes with each input's width, (n_inputs, n)."""
        strength, axes = self._largest_strengths(parts), tuple(range(len(self.counts)))
        tangent, gain = size(self._tangent(parts, j)), np.zeros_like(parts.half)
        for i, ends in parts.departure.items():
            gain[i] += (strength * size(ends) * tangent).sum(axis=axes)
        return gain

    def _largest_strengths(self, parts):
        strength = np.ones(parts.middle.shape)
        for place, one in enumerate(parts.shares):
            strength = strength * self._placed(one.high, place)
        return strength

    def _parts(self, low, high):
        model = self.model
        near, far = self._held(low), self._held(high)
        way = self._way(low, near), self._way(high, far)
        middle, half = 0.5 * (near + far), 0.5 * (far - near) * (1.0 + 4.0 * EPS)
        terms = term_ranges(model.antecedent, near, far)
        log_mu = model.antecedent.log_memberships(middle)
        log_mu = np.concatenate([log_mu, np.zeros((1, low.shape[1]))])
        shares = [enclosed(factor, terms, log_mu, half) for factor in self.factors]
        centre = self.height + self.slopes @ (middle - model.reference[:, None])
        radius = np.abs(self.slopes) @ half
        value = self._shaped(centre - radius), self._shaped(centre + radius)
        departure: dict = {}
        curvature: dict = {}
        for place, one in enumerate(shares):
            for found, of_factor in ((departure, one.departure), (curvature, one.curvature)):
                for j, ends in of_factor.items():
                    found[j] = tuple(self._placed(end, place) for end in ends)
        middle = self._shaped(centre)
        parts = _Parts(shares, value, middle, half, departure, curvature, way)
        slack, slope_slack = self._slacks(parts, near, far)
        return replace(parts, slack=slack, slope_slack=slope_slack)

    def _slacks(self, parts, near, far):
        """What values (n_boxes,), and slopes (n_inputs, n_boxes), are off by at the most."""
        far_off = size((near, far)) + np.abs(self.model.reference)[:, None]
        largest = (np.abs(self.height) + np.abs(self.slopes) @ far_off).max(axis=0)
        part = EPS * (ROUNDINGS + self.model.n_rules + self.model.n_inputs)
        strength = self._largest_strengths(parts)
        # What the errors of the strengths move the output by, rule by rule.
        moved = np.zeros(parts.middle.shape)
        for place, one in enumerate(parts.shares):
            error = self._placed(np.fmin(one.error, 1.0), place)
            moved += 2.0 * strength * error * size(self._centred(parts, place))
        axes = tuple(range(len(self.counts)))
        slopes = np.tile(part * np.abs(self.slopes).max(axis=0)[:, None], largest.size)
        for j, ends in parts.departure.items():
            slopes[j] += part * (strength * size(ends)).sum(axis=axes) * largest
            slopes[j] += 2.0 * (size(ends) * moved).sum(axis=axes)
        ahead = size(parts.way)
        beyond = np.where(ahead > 0.0, ahead * slopes, 0.0).sum(axis=0)
        return moved.sum(axis=axes) + part * largest + beyond, slopes

    def _held(self, x):
        """The nearest place in the range of the training data."""
        return np.clip(x, self.model.minimum[:, None], self.model.maximum[:, None])

    def _way(self, x, inside):
        reach = self.reach[:, None]
        return np.clip(x - inside, -reach, reach)

    def _shaped(self, by_rule):
        return by_rule.reshape(*self.counts, by_rule.shape[1])

    def _placed(self, by_share, place):
        """Values of a factor's shares along their own axis."""
        shape = [1] * len(self.counts)
        shape[place] = by_share.shape[0]
        return by_share.reshape(*shape, by_share.shape[1])

    def _tangent(self, parts, j):
        """Range of b_j + D_j (f - phi) by rule."""
        own = self._shaped(self.slopes[:, j, None])
        if j not in parts.departure:
            return own, own
        low, high = product(parts.departure[j], self._centred(parts, self.place[j]))
        return own + low, own + high

    def _centred(self, parts, *places):
        """Range of f less its means along the axes of these factors, at the middle's shares."""
        if places not in parts.known:
            parts.known[places] = self._found_centred(parts, places)
        return parts.known[places]

    def _centred_slopes(self, parts, j, *places):
        """Slopes of the consequents by input j less their means along the axes of these factors."""
        return self._less_means(parts, self._shaped(self.slopes[:, j, None]), places)

    def _found_centred(self, parts, places):
        middle = self._less_means(parts, parts.middle, places)
        radius = 0.0
        for i in np.flatnonzero(self.slopes.any(axis=0)):
            own = self._centred_slopes(parts, i, *places)
            radius = radius + np.abs(own) * parts.half[i]
        return middle - radius, middle + radius

    def _less_means(self, parts, values, places):
        for place in places:
            weight = self._placed(parts.shares[place].middle, place)
            axis = place - len(self.counts) - 1
            values = values - (weight * values).sum(axis=axis, keepdims=True)
        return values

    def _off_mean(self, parts, place):
        """Range of f less its mean along the axis of a factor, whatever the shares."""
        low, high = self._centred(parts, place)
        axis, shares = place - len(self.counts) - 1, [parts.shares[place]]
        least = smallest_mean(np.moveaxis(low, axis, -2), shares)
        most = largest_mean(np.moveaxis(high, axis, -2), shares)
        return low - np.expand_dims(most, axis), high - np.expand_dims(least, axis)

    def _continued(self, parts, end=1):
        """Largest f + sum_j h_j (b_j + D_j (f - phi)) by rule; with end=0 the smallest."""
        furthest = parts.value[end]
        for j in self._ways_out(parts):
            ahead = parts.way[0][j], parts.way[1][j]
            furthest = furthest + product(ahead, self._tangent(parts, j))[end]
        return furthest

    def _ways_out(self, parts):
        """Inputs along which some box leaves the range."""
        return np.flatnonzero((parts.way[0] < 0.0).any(axis=1) | (parts.way[1] > 0.0).any(axis=1))

    def _slopes(self, parts, low, high, wanted):
        """Range of dP/dx_i for the inputs wanted, (n_wanted, n_boxes) each."""
        model, found = self.model, []
        outside = self._ways_out(parts)
        for i in wanted:
            ends = self._tangent(parts, i)
            down, up = smallest_mean(ends[0], parts.shares), largest_mean(ends[1], parts.shares)
            down, up = down - parts.slope_slack[i], up + parts.slope_slack[i]
            beyond_down, beyond_up = down, up
            for j in outside[outside != i]:
                ahead = parts.way[0][j], parts.way[1][j]
                least, most = product(ahead, self._mixed(parts, i, j))
                down, up = down + least, up + most
            goes_in = (low[i] <= model.maximum[i]) & (high[i] >= model.minimum[i])
            goes_out = (low[i] < model.minimum[i]) | (high[i] > model.maximum[i])
            down = np.where(goes_in, down, np.inf)
            up = np.where(goes_in, up, -np.inf)
            down = np.where(goes_out, np.minimum(down, beyond_down), down)
            up = np.where(goes_out, np.maximum(up, beyond_up), up)
            ends = model.minimum[i] - self.reach[i], model.maximum[i] + self.reach[i]
            ends_here = (low[i] < ends[0]) | (high[i] > ends[1])
            down = np.where(ends_here, np.minimum(down, 0.0), down)
            up = np.where(ends_here, np.maximum(up, 0.0), up)
            is_held = (high[i] < ends[0]) | (low[i] > ends[1])
            down, up = np.where(is_held, 0.0, down), np.where(is_held, 0.0, up)
            found.append(
                (np.where(np.isnan(down), -np.inf, down), np.where(np.isnan(up), np.inf, up))
            )
        down, up = zip(*found, strict=True)
        return np.stack(down), np.stack(up)

    def _mixed(self, parts, i, j):
        """Range of the second derivative by two inputs, or twice by one."""
        low, high = np.zeros((2, *parts.value[0].shape))
        for one, other in ((i, j), (j, i)):
            if one in parts.departure:
                own = self._centred_slopes(parts, other, self.place[one])
                least, most = product(parts.departure[one], (own, own))
                low, high = low + least, high + most
        if i in parts.departure and j in parts.departure:
            places = self.place[i], self.place[j]
            same = places[0] == places[1]
            off = self._off_mean(parts, places[0]) if same else self._centred(parts, *places)
            both = product(parts.departure[i], parts.departure[j])
            if i == j:
                both = square(parts.departure[i])
                both = tuple(a + c for a, c in zip(both, parts.curvature[i], strict=True))
            least, most = product(both, off)
            low, high = low + least, high + most
        largest = size((low, high)).max(axis=tuple(range(low.ndim - 1)))
        slack = EPS * ROUNDINGS * prod(self.counts) * largest
        return (
            smallest_mean(low, parts.shares) - slack,
            largest_mean(high, parts.shares) + slack,
        )


def _best_centres(down, up, low, high):
    """The points from which slopes give the least upper bound, in the boxes."""
    between = (up * high - down * low) / (up - down)
    points = np.where(down >= 0.0, high, np.where(up <= 0.0, low, between))
    points = np.where(np.isfinite(points), points, 0.5 * (low + high))
    return np.clip(points, low, high)
