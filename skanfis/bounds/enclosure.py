"""Ranges of a model's output, and of its slopes, on a box: docs/bounds.rst derives them.

E is the mean over rules, weighted by their strengths. f are the values of the consequents, b their
slopes. D are the slopes of log-strengths less their mean, c their curvatures. phi is any function
that all rules share. h is the way on which a tangent is followed out of range. Bounds include
rounding errors.
"""

from dataclasses import replace
from functools import partial
from math import prod

import numpy as np

from ..model import TSKModel
from ..policies import FARTHEST_ROW, SILENT
from .terms import (
    EPS,
    ROUNDINGS,
    enclosed,
    mean_range,
    product,
    size,
    square,
    term_ranges,
    widened,
)


def reach_of(model):
    """How far beyond the range of each input predictions still change, (n_inputs,)."""
    if model.out_of_bounds != "linear" or model.max_extrapolation == 0.0:
        return np.zeros(model.n_inputs)
    return min(model.max_extrapolation, FARTHEST_ROW) * model.spread


class _Parts:
    """The quantities of one batch of boxes; ranges have both ends along their first axis."""

    def __init__(self, rules: "Enclosure", low, high):
        model, ends = rules.model, np.stack([low, high])
        box = np.clip(ends, model.minimum[:, None], model.maximum[:, None])
        middle, half = 0.5 * (box[0] + box[1]), 0.5 * (box[1] - box[0]) * (1.0 + 4.0 * EPS)
        terms = term_ranges(model.antecedent, *box)
        at_middle = term_ranges(model.antecedent, middle, middle)
        # The part of the boxes in range, (2, n_inputs, n_boxes), half its widths, the range of h.
        self.box, self.half = box, half
        self.way = np.clip(ends - box, -rules.reach[:, None], rules.reach[:, None])
        # Inputs along which at least one box leaves the range.
        self.outside = np.flatnonzero(self.way.any(axis=(0, 2)))
        self.shares = [
            enclosed(one, place - len(rules.counts) - 1, terms, at_middle, half)
            for place, one in enumerate(rules.factors)
        ]
        # The shares that change with x_j, and ranges of D_j, which broadcast to the shape of f.
        self.moved = {j: one for one in self.shares for j in one.departure}
        self.departure = {j: one.departure[j] for j, one in self.moved.items()}
        self.strength = prod(one.high for one in self.shares)  # upper bound for every rule
        # f at the middle of the box, of shape (*counts, n_boxes), and its range.
        centre = rules.height + rules.slopes @ (middle - model.reference[:, None])
        radius = np.abs(rules.slopes) @ half
        self.middle = rules.shaped(centre)
        self.value = rules.shaped(np.stack([centre - radius, centre + radius]))
        # For each factor, by its axis, f less its mean along it.
        self.centred = {one.axis: rules.centred(self, [one]) for one in self.shares}
        self.there: dict = {}  # cache
        self.slack, self.slope_slack = rules.slacks(self)


class Enclosure:
    """Upper bounds of one output, or of its negative with sign -1, over batches of boxes."""

    def __init__(self, model: TSKModel, output: int, sign: float):
        self.model, self.output, self.sign = model, output, sign
        factors = model.antecedent.factor_terms()
        self.counts = model.antecedent.share_counts if factors else (1,)
        self.axes = tuple(range(len(self.counts)))
        # Every factor has its shares along an axis of its own.
        shapes = np.where(np.eye(len(self.counts), dtype=bool), self.counts, 1).tolist()
        self.factors = [
            {j: terms.reshape(*shape, terms.shape[-1]) for j, terms in one.items()}
            for one, shape in zip(factors, shapes, strict=False)
        ]
        self.height = sign * model.coefficients[:, :1, output]
        self.slopes = sign * model.consequents[:, 1:, output]
        self.reach, self.tangents = reach_of(model), model.tangent_groups
        answering = model.with_out_of_bounds("clip") if model.out_of_bounds in SILENT else model
        # The bounds are those of the rules. Holding outputs is monotone, and is applied to bounds.
        self.rules = replace(answering, target=None)
        self.lowest, self.highest = np.sort(sign * model.output_limits[:, output])

    def unheld(self, X):
        """Sign times the output at rows, before it is held within limits."""
        return self.sign * self.rules.predict(X)[:, self.output]

    def hold(self, values):
        """Values, or bounds, held within the limits of the output."""
        return np.clip(values, self.lowest, self.highest)

    def evaluate(self, j):
        """The function for ``search.largest``: of the slope by input j; of values if j is None."""
        return self.values if j is None else partial(self.slope, j=j)

    def values(self, low, high):
        """Upper bounds on boxes (n_inputs, n_boxes), a point in each, and the output there.

        Also how much the width along each input adds to the bound, (n_inputs, n_boxes).
        """
        with np.errstate(all="ignore"):
            parts = _Parts(self, low, high)
            natural = self._natural(parts)[1]
            slopes = np.stack([self._slope(parts, low, high, i) for i in range(len(low))], axis=1)
            points, rise = _best_centres(slopes, low, high)
            attained = self.unheld(points.T)
            by_slopes = attained + rise + 2.0 * parts.slack
            bound = np.fmin(np.where(np.isnan(natural), np.inf, natural), by_slopes)
            gain = (slopes[1] - slopes[0]) * (high - low)
        return self.hold(bound), points, self.hold(attained), gain

    def slope(self, low, high, j):
        """As :meth:`values`, for the slope by input j; where it jumps, values are one-sided."""
        with np.errstate(all="ignore"):
            parts = _Parts(self, low, high)
            natural = self._slope(parts, low, high, j)[1]
            bends = np.stack([self._mixed(parts, i, j) for i in range(len(low))], axis=1)
            points, rise = _best_centres(bends, low, high)
            least, most = self._slope(_Parts(self, points, points), points, points, j)
            # Beyond the range, the slope of the tangent changes by terms not enclosed here.
            inside = (low >= self.model.minimum[:, None]) & (high <= self.model.maximum[:, None])
            by_bends = np.where(inside.all(axis=0), most + rise, np.inf)
            gain = np.where(
                np.isfinite(by_bends), bends[1] - bends[0], self._gain_of_slope(parts, j)
            )
            bound = np.fmin(natural, by_bends)
            if np.isfinite([self.lowest, self.highest]).any():
                # If the output may be held, its slope may be zero.
                lowest, highest = self._natural(parts)
                is_free = (lowest >= self.lowest) & (highest <= self.highest)
                bound = np.where(is_free, bound, np.maximum(bound, 0.0))
            outputs = self.unheld(points.T)
            attained = np.where(outputs == self.hold(outputs), least, 0.0)
        return bound, points, attained, gain * (high - low)

    def _gain_of_slope(self, parts, j):
        """Roughly how much each input's width adds to the range of dP/dx_j, (n_inputs, n)."""
        gain, tangent = np.zeros_like(parts.half), parts.strength * size(self._tangent(parts, j))
        for i, ends in parts.departure.items():
            gain[i] = (size(ends) * tangent).sum(axis=self.axes)
        return gain

    def slacks(self, parts):
        """Largest rounding errors of values, (n_boxes,), and of slopes, (n_inputs, n_boxes)."""
        far_off = size(parts.box) + np.abs(self.model.reference)[:, None]
        largest = (np.abs(self.height) + np.abs(self.slopes) @ far_off).max(axis=0)
        part = EPS * (ROUNDINGS + self.model.n_rules + self.model.n_inputs)
        strength = parts.strength
        # How much errors of the strengths change the output, rule by rule.
        moved = np.zeros(parts.middle.shape)
        for one in parts.shares:
            moved += 2.0 * strength * np.fmin(one.error, 1.0) * size(parts.centred[one.axis])
        slopes = np.tile(part * np.abs(self.slopes).max(axis=0)[:, None], largest.size)
        for j, ends in parts.departure.items():
            # Where one rule fires alone, D is zero, but its slope is still rounded.
            steepness = np.maximum(parts.moved[j].steepness[j], size(ends))
            slopes[j] += part * (strength * steepness).sum(axis=self.axes) * largest
            slopes[j] += 2.0 * (size(ends) * moved).sum(axis=self.axes)
        ahead = size(parts.way)
        beyond = np.where(ahead > 0.0, ahead * slopes, 0.0).sum(axis=0)
        return moved.sum(axis=self.axes) + part * largest + beyond, slopes

    def shaped(self, by_rule):
        """Values by rule along the axes of all factors."""
        return by_rule.reshape(*by_rule.shape[:-2], *self.counts, by_rule.shape[-1])

    def _tangent(self, parts, j):
        """Range of b_j + D_j (f - phi) by rule."""
        own = self.shaped(self.slopes[:, j, None])
        if j not in parts.departure:
            return np.stack([own, own])
        return own + product(parts.departure[j], parts.centred[parts.moved[j].axis])

    def centred(self, parts, every):
        """Range of f less its means along the axes of these factors, by shares at the middle."""
        middle, radius = _less_means(parts.middle, every), 0.0
        for i in np.flatnonzero(self.slopes.any(axis=0)):
            own = _less_means(self.shaped(self.slopes[:, i, None]), every)
            radius = radius + np.abs(own) * parts.half[i]
        return np.stack([middle - radius, middle + radius])

    def _mean(self, parts, ends):
        """Range of the mean over rules, (2, n_boxes)."""
        return mean_range(ends, parts.shares).reshape(2, -1)

    def _natural(self, parts):
        """Range of the rules' output by its formula, E f + sum_j h_j dy/dx_j, (2, n_boxes)."""
        found = self._mean(parts, parts.value)
        for j in parts.outside:
            slope = self._steepness(self._there(parts, j), j)
            found = found + product(parts.way[:, j], slope)
        return widened(found, parts.slack)

    def _there(self, parts, j):
        """The parts at which the tangent along j is taken: other inputs may be at their medians."""
        own, at = self.tangents
        g = int(np.flatnonzero(own[:, j])[0])
        if np.isnan(at[g]).all():
            return parts
        if g not in parts.there:
            there = np.where(np.isnan(at[g])[:, None], parts.box, at[g][:, None])
            parts.there[g] = _Parts(self, *there)
        return parts.there[g]

    def _steepness(self, parts, j):
        """Range of the slope by x_j of the rules, in range."""
        return widened(self._mean(parts, self._tangent(parts, j)), parts.slope_slack[j])

    def _slope(self, parts, low, high, i):
        """Range of dP/dx_i, (2, n_boxes)."""
        model, outside, (own, at) = self.model, parts.outside, self.tangents
        inside = beyond = self._steepness(parts, i)
        if i in outside:
            beyond = self._steepness(self._there(parts, i), i)
        # A tangent that is taken at a median of x_i does not change with x_i.
        moves = np.isnan(at[own[:, outside].argmax(axis=0), i])
        for j in outside[(outside != i) & moves]:
            inside = inside + product(parts.way[:, j], self._mixed(self._there(parts, j), i, j))
        first, last = model.minimum[i], model.maximum[i]
        furthest = first - self.reach[i], last + self.reach[i]
        is_below = (low[i] < first) & (high[i] >= furthest[0])
        is_above = (high[i] > last) & (low[i] <= furthest[1])
        pieces = (
            ((low[i] <= last) & (high[i] >= first), inside),
            (is_below | is_above, beyond),
            ((low[i] < furthest[0]) | (high[i] > furthest[1]), np.zeros((2, 1))),
        )
        down = np.min([np.where(there, ends, np.inf)[0] for there, ends in pieces], axis=0)
        up = np.max([np.where(there, ends, -np.inf)[1] for there, ends in pieces], axis=0)
        # NaN stands for an unknown range: it is infinite.
        return np.where(np.isnan([down, up]), [[-np.inf], [np.inf]], [down, up])

    def _mixed(self, parts, i, j):
        """Range of the second derivative by x_i and x_j, which may be the same input."""
        found = np.zeros_like(parts.value)
        for one, other in ((i, j), (j, i)):
            if one in parts.departure:
                own = self.shaped(self.slopes[:, other, None])
                own = _less_means(own, [parts.moved[one]])
                found = found + product(parts.departure[one], (own, own))
        if i in parts.departure and j in parts.departure:
            first, second = parts.moved[i], parts.moved[j]
            both = product(parts.departure[i], parts.departure[j])
            if i == j:
                both = square(parts.departure[i]) + first.curvature[i]
            if first is second:
                # E D_i D_j is not zero within one factor: f loses its mean for any shares.
                off = parts.centred[first.axis]
                off = off - mean_range(off, [first])[::-1]
            else:
                off = self.centred(parts, [first, second])
            found = found + product(both, off)
        slack = EPS * ROUNDINGS * prod(self.counts) * size(found).max(axis=self.axes)
        return widened(self._mean(parts, found), slack)


def _less_means(values, every):
    """Values less their means along the axes of these factors, by shares at the middle."""
    for one in every:
        values = values - (one.middle * values).sum(axis=one.axis, keepdims=True)
    return values


def _best_centres(slopes, low, high):
    """Points at which the mean value form gives the least bound, and its rise above the value."""
    down, up = slopes
    between = (up * high - down * low) / (up - down)
    points = np.where(down >= 0.0, high, np.where(up <= 0.0, low, between))
    points = np.where(np.isfinite(points), points, 0.5 * (low + high))
    points = np.clip(points, low, high)
    rise = np.maximum(np.maximum(up * (high - points), down * (low - points)), 0.0)
    return points, rise.sum(axis=0) * (1.0 + EPS * (ROUNDINGS + low.shape[0]))
