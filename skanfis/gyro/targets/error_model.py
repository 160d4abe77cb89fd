"""The error that a compensator subtracts, and a proven bound of a target's difference from it.

Ranges of both, and of their slopes, are proven over boxes, and so is their difference, by the mean
value theorem. The error is a sum of rules, with ranges from ``skanfis.bounds``, and of polynomials
and the arcsine law, by interval arithmetic. An interval is a pair of arrays over the boxes.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from ..._threads import without
from ...bounds.enclosure import Enclosure
from ...bounds.terms import EPS, ROUNDINGS, product, size, square
from ...exceptions import OutOfBoundsWarning
from ...export.folding import found_by_search
from ..compose import FrozenRules, Polynomial, ResidualRegressor
from ..physics import OpenLoopArcsineRegressor

# Most boxes, and how often each is halved; accuracy of the bound, relative to the difference, and
# relative to the error itself.
_MOST_BOXES, _MOST_CUTS, _TOLERANCE, _NOTHING = 100_000, 30, 0.02, 1e-7
_N_POINTS = 4096


class ErrorModel:
    """The indicated minus the compensated rate [deg/s], as a function of the inputs.

    ``estimator`` is that of the compensator, or of a fold; ``ends`` (n_inputs, 2) is the range of
    X, to which it was fitted.
    """

    def __init__(self, compensator, estimator, X):
        self.ends = np.stack([X.min(), X.max()], axis=1)
        self.names, self._estimator, self._parts = list(X), estimator, _parts_of(estimator)
        self._output = self.names.index("output") if "output" in self.names else None
        self._own = 1.0 / compensator.scale_factor
        self._is_rate = compensator.predicts == "rate"

    def __call__(self, points):
        """The error at points (n_points, n_inputs); outside the range, its value at the edge."""
        X = np.clip(points, *self.ends.T)
        with without(OutOfBoundsWarning):
            predicted = self._estimator.predict(pd.DataFrame(X, columns=self.names))
        return self._own * X[:, self._output] - predicted if self._is_rate else predicted

    def ranges(self, low, high):
        """Range of the error over boxes (n_inputs, n_boxes), and of its slopes by input."""
        value, slopes = np.zeros((2, low.shape[1])), np.zeros((2, *low.shape))
        with np.errstate(all="ignore"):
            for columns, ranges in self._parts:
                of_value, of_slopes = ranges(low[columns], high[columns])
                value += of_value
                slopes[:, columns] += of_slopes
        if self._is_rate:
            indicated = np.sort(self._own * np.stack([low, high])[:, self._output], axis=0)
            value, slopes = indicated - value[::-1], -slopes[::-1]
            slopes[:, self._output] += self._own
        # Slack for rounding errors that the ranges do not include.
        steep, far = np.abs(slopes).max(axis=0), np.maximum(np.abs(low), np.abs(high))
        slack = ROUNDINGS * EPS * (np.abs(value).max(axis=0) + (steep * far).sum(axis=0))
        return np.add(value, [-slack, slack]), slopes


def polynomial_ranges(powers, coefficients, low, high, origin=0.0, width=1.0):
    """Range of sum_k c_k prod_j s_j^p_kj with s = (x - origin) / width over boxes, and of slopes.

    Boxes of x are (n_axes, n_boxes). A coefficient is one number, or one for each box.
    """
    ends, slopes = [(side - origin) / width for side in (low, high)], []
    for axis in range(powers.shape[1]):
        lowered = np.maximum(powers - (np.arange(powers.shape[1]) == axis), 0)
        steeper = (coefficients.T * powers[:, axis]).T
        slopes.append(_polynomial_range(lowered, steeper, *ends))
    return _polynomial_range(powers, coefficients, *ends), np.swapaxes(slopes, 0, 1) / width


def _polynomial_range(powers, coefficients, low, high):
    total = np.zeros((2, low.shape[1]))
    for power, coefficient in zip(powers, coefficients, strict=True):
        term = (coefficient, coefficient)
        for exponent, *ends in zip(power, low, high, strict=True):
            for _ in range(exponent):
                term = product(term, ends)
        total += np.broadcast_arrays(*term, low[0])[:2]
    return total


def _parts_of(estimator):
    """The summands of a prediction: for each, its columns and the function for its ranges."""
    found = found_by_search(estimator)
    if isinstance(found, ResidualRegressor):
        return [*_parts_of(found.base_), *_parts_of(found.residual_)]
    if isinstance(found, OpenLoopArcsineRegressor):
        return [(list(found.columns_), partial(_of_law, found))]
    if isinstance(found, Polynomial):
        place = {"origin": found.center[:, None], "width": found.scale[:, None]}
        ranges = partial(polynomial_ranges, found.powers, found.coefficients, **place)
        return [(list(found.columns_), ranges)]
    rules = FrozenRules.of(found, getattr(found, "n_features_in_", None))
    sides = [Enclosure(rules.model, 0, sign) for sign in (-1.0, 1.0)]
    return [(list(rules.positions), partial(_of_rules, sides))]


def _of_rules(sides, low, high):
    values, slopes = [], []
    for side in sides:
        values.append(side.sign * side.values(low, high)[0])
        each = [side.slope(low, high, j)[0] for j in range(len(low))]
        slopes.append(side.sign * np.stack(each))
    return values, slopes


def _of_law(law, low, high):
    """Ranges of asin(V / A(T)) / K(T) - b(T); NaN where the phase may exceed the largest."""
    (a, a_slope), (k, k_slope), (b, b_slope) = (
        polynomial_ranges(
            np.arange(each.size)[:, None], each, low[1:2], high[1:2], law.reference_temperature_
        )
        for each in (law.amplitude_, law.sagnac_factor_, law.bias_)
    )
    over_a, over_k = _inverse(a), _inverse(k)
    sine = product((low[0], high[0]), over_a)
    sine = np.where(size(sine) <= np.sin(law.max_phase), sine, np.nan)
    steep = product(product(over_a, over_k), [1 / np.sqrt(1 - s) for s in square(sine)])
    phase = np.arcsin(sine)
    bend = np.array(product(product(sine, a_slope[:, 0]), steep))
    turn = np.array(product(phase, product(k_slope[:, 0], square(over_k))))
    slopes = np.zeros((2, *low.shape))
    slopes[:, 0], slopes[:, 1] = steep, -(bend + turn + b_slope[:, 0])[::-1]
    return product(phase, over_k) - b[::-1], slopes


def _inverse(ends):
    """Range of 1 / x; NaN where x may be zero."""
    return [np.where(ends[0] * ends[1] > 0.0, 1.0 / end, np.nan) for end in ends[::-1]]


@dataclass(frozen=True, eq=False)
class Piecewise:
    """sum_k c_k prod_j s_j^p_kj with s_j = (x_j - origin_j) / width_j; held beyond the edges.

    ``edges`` (n_cells + 1), ``origins`` (n_cells) and ``widths`` are by axis; ``powers`` are of
    shape (n_terms, n_axes), ``coefficients`` (n_terms, *n_cells) [deg/s]. ``slack`` bounds the
    rounding errors of the target's arithmetic.
    """

    edges: list[np.ndarray]
    origins: list[np.ndarray]
    widths: list[float]
    powers: np.ndarray
    coefficients: np.ndarray
    slack: float

    @property
    def ends(self):
        """Where it begins and ends, (n_axes, 2)."""
        return np.array([edges[[0, -1]] for edges in self.edges])

    def __call__(self, points):
        """Values at points (n_points, n_axes)."""
        held = np.clip(points, *self.ends.T).T
        return self.ranges(held, held)[0][0]

    def ranges(self, low, high):
        """Range over boxes (n_axes, n_boxes), each within a cell, and of the slopes by axis."""
        cells = tuple(
            np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
            for edges, x in zip(self.edges, 0.5 * (low + high), strict=True)
        )
        origins = np.array([given[at] for given, at in zip(self.origins, cells, strict=True)])
        widths = np.reshape(self.widths, (-1, 1))
        coefficients = self.coefficients[:, *cells]
        return polynomial_ranges(self.powers, coefficients, low, high, origins, widths)


def spread(ends):
    """Points all over a box of one or two axes."""
    n_each = round(_N_POINTS ** (1.0 / len(ends)))
    axes = [np.linspace(low, high, n_each) for low, high in ends]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(ends))


def difference(error: ErrorModel, target: Piecewise):
    """Proven limits of the error minus the target, within the edges of the target.

    Boxes where the difference may exceed all values found so far are halved, while that helps.
    """
    points = spread(target.ends)
    errors = error(points)
    sampled = errors - target(points)
    enough = _TOLERANCE * np.ptp(sampled) + _NOTHING * np.abs(errors).max()
    least, most = sampled.min(), sampled.max()
    low, high = (
        np.stack(np.meshgrid(*ends, indexing="ij")).reshape(len(ends), -1)
        for ends in ([each[:-1] for each in target.edges], [each[1:] for each in target.edges])
    )
    ends = np.array([least, most])
    for _ in range(_MOST_CUTS):
        below, above = _limits(error, target, low, high)
        is_open = ~((below >= least - enough) & (above <= most + enough))
        if not 0 < 2 ** len(low) * is_open.sum() <= _MOST_BOXES:
            break
        ends = np.array(
            [below[~is_open].min(initial=ends[0]), above[~is_open].max(initial=ends[1])]
        )
        low, high = low[:, is_open], high[:, is_open]
        for axis in range(len(low)):
            middle = 0.5 * (low[axis] + high[axis])
            low, high = np.tile(low, 2), np.tile(high, 2)
            high[axis, : middle.size] = low[axis, middle.size :] = middle
    return [min(ends[0], below.min()) - target.slack, max(ends[1], above.max()) + target.slack]


def _limits(error, target, low, high):
    """Limits of the difference in every box, from the value at its middle and the slopes."""
    middle = 0.5 * (low + high)
    value = error.ranges(middle, middle)[0] - target.ranges(middle, middle)[0][::-1]
    (_, own), (_, its) = error.ranges(low, high), target.ranges(low, high)
    steepest = np.abs([own[0] - its[1], own[1] - its[0]]).max(axis=0)
    reach = 0.5 * (steepest * (high - low)).sum(axis=0) * (1.0 + 1e-9)
    return value[0] - reach, value[1] + reach
